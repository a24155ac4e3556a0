"""A tablet that sleeps just before a start sends nothing by what it knew of the robot before."""

from __future__ import annotations

from functools import partial

import pytest

from app.domain.models import State, Wait
from tests.support.clock import VirtualClock
from tests.support.network import Fate

BEFORE = [1.0, 0.5, 0.3, 0.2, 0.05]  # s, of the instant


def drained(site, seconds):
    """The tablet sleeps while the robot uses its battery up."""
    site.machines["R1"].set_battery(10.0)
    site.suspend(seconds)


@pytest.mark.parametrize("before", BEFORE)
@pytest.mark.parametrize("asleep", [5.0, 600.0])
def test_after_a_sleep_the_battery_is_read_before_a_start_is_sent(site, plan, before, asleep):
    plan("2026-11-23T06:05", minimum_battery_percent=50)
    site.run(300.0 - before)
    drained(site, asleep)
    site.run(60)
    assert site.network.posts() == []
    [row] = site.executions()
    assert (row.state, row.wait) == (State.WAITING, Wait.BATTERY)


@pytest.mark.parametrize("before", BEFORE)
def test_a_robot_that_is_charged_gets_its_start_once_after_a_sleep(site, plan, before):
    plan("2026-11-23T06:05", minimum_battery_percent=50)
    site.run(300.0 - before)
    site.suspend(600.0)
    site.run(60)
    assert len(site.network.posts()) == 1


def judged_first(site, seconds):
    """When it wakes the scheduler's thread is quicker than the robot's."""
    VirtualClock.suspend(site.clock, seconds)
    site.engine.advance()


def stopped(site, seconds):
    """The process was stopped: both clocks went on."""
    site.clock.advance(seconds)


@pytest.mark.parametrize("sleep", [judged_first, stopped])
def test_asleep_between_connecting_and_sending_it_is_read_again_too(site, plan, monkeypatch, sleep):
    plan("2026-11-23T06:05", minimum_battery_percent=50)
    site.run(60)
    site.network.next("POST", "/mission_queue", Fate.ASLEEP, 300.0)
    monkeypatch.setattr(site.clock, "suspend", partial(sleep, site))
    site.at(239.99, lambda: site.machines["R1"].set_battery(10.0))
    site.run(300)
    assert site.network.posts() == []
    assert [(row.state, row.wait) for row in site.executions()] == [(State.WAITING, Wait.BATTERY)]


@pytest.mark.parametrize("before", BEFORE)
@pytest.mark.parametrize("step", [-600.0, 600.0])
def test_a_clock_that_is_set_just_before_a_start_looks_the_same(site, plan, before, step):
    plan("2026-11-23T06:05", minimum_battery_percent=50)
    site.run(300.0 - before)
    site.machines["R1"].set_battery(10.0)
    site.clock.step(step)
    site.run(700)
    assert site.network.posts() == []


def test_a_process_that_was_stopped_reads_it_again(site, plan):
    """Both clocks went on."""
    plan("2026-11-23T06:05", minimum_battery_percent=50)
    site.run(299.9)
    site.machines["R1"].set_battery(10.0)
    site.clock.advance(600.0)
    site.run(60)
    assert site.network.posts() == []
