"""Undoing that a schedule was switched off or on: it is as it was, and what waited runs once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import InvalidInput, Schedule, State


@pytest.fixture(params=["FREQ=DAILY", None], ids=["daily", "once"])
def waiting(site, plan, request) -> Schedule:
    """Whose start waits for a charge."""
    site.machines["R1"].set_battery(12.0)
    schedule = plan("2026-11-23T06:05", request.param, minimum_battery_percent=30, start_window_minutes=20)
    site.run(310)
    assert [run.state for run in site.executions()] == [State.WAITING]
    return schedule


def now(site, schedule: Schedule) -> Schedule:
    return next(each for each in site.container.catalogue.schedules() if each.id == schedule.id)


def charge(site) -> None:
    site.machines["R1"].set_battery(80.0)
    site.run(600)


@pytest.mark.parametrize("seconds", [0, 3])
def test_what_waited_runs_once(site, waiting, seconds):
    switched = site.container.catalogue.switch_schedule(waiting.id, False)
    site.run(seconds)
    assert not now(site, waiting).enabled
    site.container.catalogue.switch_back(switched)
    assert now(site, waiting).enabled
    charge(site)
    assert [run.state for run in site.executions()] == [State.COMPLETED]
    assert len(list(site.machines["R1"].queue)) == 1


def test_nothing_is_sent_while_it_is_off(site, waiting):
    site.container.catalogue.switch_schedule(waiting.id, False)
    charge(site)
    assert list(site.machines["R1"].queue) == []


def test_what_fell_due_while_it_was_off_by_mistake_runs(site, plan):
    schedule = plan("2026-11-23T06:05", "FREQ=DAILY", start_window_minutes=20)
    site.run(298)
    switched = site.container.catalogue.switch_schedule(schedule.id, False)
    site.run(5)
    site.container.catalogue.switch_back(switched)
    site.run(600)
    assert [(row.planned_at.minute, row.state) for row in site.executions()] == [(5, State.COMPLETED)]


def test_undone_twice_it_runs_once(site, waiting):
    switched = site.container.catalogue.switch_schedule(waiting.id, False)
    for _press in range(2):
        site.container.catalogue.switch_back(switched)
    charge(site)
    site.container.catalogue.switch_back(switched)
    site.run(600)
    assert len(list(site.machines["R1"].queue)) == 1


def test_too_late_for_what_waited_it_is_on_all_the_same(site, plan):
    site.machines["R1"].set_battery(12.0)
    schedule = plan("2026-11-23T06:05", "FREQ=DAILY", minimum_battery_percent=30, start_window_minutes=20)
    site.run(310)
    switched = site.container.catalogue.switch_schedule(schedule.id, False)
    site.run(1500)
    site.container.catalogue.switch_back(switched)
    charge(site)
    assert now(site, schedule).enabled
    assert list(site.machines["R1"].queue) == []


def test_switching_on_is_undone_by_switching_off(site, plan):
    schedule = plan("2026-11-23T06:05", "FREQ=DAILY", enabled=False)
    switched = site.container.catalogue.switch_schedule(schedule.id, True)
    assert now(site, schedule).enabled
    site.container.catalogue.switch_back(switched)
    site.run(600)
    assert (now(site, schedule).enabled, site.executions()) == (False, [])


def test_what_was_changed_meanwhile_stays(site, waiting):
    switched = site.container.catalogue.switch_schedule(waiting.id, False)
    site.container.catalogue.save_schedule(replace(now(site, waiting), priority=3))
    site.container.catalogue.switch_back(switched)
    assert (now(site, waiting).priority, now(site, waiting).enabled) == (3, True)


def test_a_schedule_that_is_gone_is_not_switched(site, waiting):
    switched = site.container.catalogue.switch_schedule(waiting.id, False)
    site.container.catalogue.remove_schedule(waiting.id)
    with pytest.raises(InvalidInput, match="there is no such schedule any more"):
        site.container.catalogue.switch_back(switched)
