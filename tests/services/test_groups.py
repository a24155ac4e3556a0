"""Starts that any robot of a group may take: kept until one is free, given to one, and never to two."""
from __future__ import annotations

from datetime import datetime

import pytest

from app.domain.models import Group, Schedule, State, Wait
from tests.support.network import QUEUE, Fate
from tests.support.site import Site


@pytest.fixture
def site(tmp_path):
    """Three robots of one group."""
    site = Site(tmp_path, robots=3)
    robots = site.add_robots()
    site.add_mission("Deliver")
    site.container.catalogue.edit(lambda edit: edit.save_group(Group("Hall", tuple(robot.id for robot in robots))))
    yield site
    site.switch_off()


@pytest.fixture
def plan(site):
    def planned(name="A", at="2026-11-23T06:05", **values):
        [group] = site.container.catalogue.groups()
        return site.container.catalogue.save_schedule(
            Schedule(name, None, 1, datetime.fromisoformat(at), "UTC", group_id=group.id, **values))
    return planned


def queues(site):
    return {name: [item.description for item in machine.queue] for name, machine in site.machines.items() if len(machine.queue)}


def test_a_start_goes_to_a_free_robot_at_its_instant(site, plan):
    plan()
    site.run(310)
    [run] = site.executions()
    assert (run.state, run.robot_group) == (State.EXECUTING, "Hall")
    assert run.robot in site.machines
    assert (run.submitted_at - run.planned_at).total_seconds() < 0.5
    assert queues(site) == {run.robot: [run.token]}


def test_starts_of_one_instant_go_to_different_robots(site, plan):
    for name in "ABC":
        plan(name)
    site.run(310)
    assert sorted(run.robot for run in site.executions()) == ["R1", "R2", "R3"]


def test_one_too_many_waits_for_the_first_that_is_free(site, plan):
    for name in "ABCD":
        plan(name)
    site.run(303)
    [waits] = site.executions(State.WAITING)
    assert (waits.robot_id, waits.wait, waits.wait_details["group"]) == (None, Wait.ROBOT, "Hall")
    site.run(400)
    assert [run.state for run in site.executions()] == [State.COMPLETED] * 4
    assert sum(map(len, queues(site).values())) == 4


def test_when_a_robot_refuses_the_connection_another_one_comes(site, plan):
    plan()
    site.run(295)
    site.network.down |= {"R1"}
    site.run(60)
    [run] = site.executions()
    assert run.robot in ("R2", "R3")
    assert sum(map(len, queues(site).values())) == 1


@pytest.mark.parametrize("fate", [Fate.LOST, Fate.ANSWER_LOST])
def test_while_an_answer_is_open_no_other_robot_gets_it(site, plan, fate):
    plan()
    for name in site.machines:
        site.network.next("POST", QUEUE, fate, robot=name)
    site.run(340)
    [run] = site.executions()
    assert run.robot_id is not None
    site.run(700)
    [run] = site.executions()
    assert run.state is State.COMPLETED
    assert sum(map(len, queues(site).values())) == 1


def test_a_start_of_a_group_survives_a_crash_at_any_time(site, plan):
    plan()
    for seconds in (301, 1, 5, 30):
        site.run(seconds)
        site.switch_off(cleanly=False)
        site.stay_off(2)
        site.switch_on()
    site.run(600)
    assert [run.state for run in site.executions()] == [State.COMPLETED]
    assert sum(map(len, queues(site).values())) == 1
