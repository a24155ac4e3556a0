"""Starts that any robot of a group may take: kept until one is free, given to one, and never to two."""

from __future__ import annotations

import sqlite3
from dataclasses import replace
from datetime import datetime
from itertools import pairwise

import pytest

from app.database.errors import DatabaseUnavailable
from app.domain.choice import chosen
from app.domain.models import Group, Overlap, ReasonCode, Schedule, State, Trigger, Wait
from app.services.dispatch.ledger import Ledger
from tests.support.network import QUEUE, Fate
from tests.support.site import GUIDS, Site


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
            Schedule(name, None, 1, datetime.fromisoformat(at), "UTC", group_id=group.id, **values)
        )

    return planned


def lose_mission(machine):
    machine.site.table("/missions").remove(GUIDS["Deliver"])


def queues(site):
    return {
        name: [item.description for item in machine.queue]
        for name, machine in site.machines.items()
        if len(machine.queue)
    }


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


@pytest.mark.parametrize("refused_by", ["R1", "R2"])
def test_a_robot_that_refuses_leaves_it_to_the_others_and_is_told_of(site, plan, refused_by):
    """Robots of one group that differ in what they have: the mission is missing on one."""
    plan()
    lose_mission(site.machines[refused_by])
    site.run(330)
    [run] = site.executions()
    assert run.robot not in ("", refused_by)
    assert sum(map(len, queues(site).values())) == 1


def test_when_all_refuse_it_fails_and_says_why(site, plan):
    plan()
    for machine in site.machines.values():
        lose_mission(machine)
    site.run(330)
    [run] = site.executions()
    assert (run.state, run.reason.code) == (State.FAILED, ReasonCode.UNKNOWN_MISSION)


@pytest.mark.parametrize(
    ("is_busy", "items", "alarm"), [(True, 1, "duplicate_healed"), (False, 2, "duplicate_running")]
)
def test_a_request_that_comes_after_all_is_set_right_on_the_robot_that_had_been_given_up(
    site, plan, is_busy, items, alarm
):
    """It is cancelled while it is pending; one that runs is a person's matter."""
    plan(start_window_minutes=30)
    for name in site.machines:
        site.network.next("POST", QUEUE, Fate.LATE, 130.0, robot=name)
    site.run(301)
    [run] = site.executions()
    site.network.planned.clear()
    site.run(60)
    for _n in range(20 * is_busy):
        site.stranger_queues(robot=run.robot)
    first = run.robot
    site.run(600)
    [run] = site.executions()
    assert (run.state, run.robot != first) == (State.COMPLETED, True)
    ours = [
        item
        for machine in site.machines.values()
        for item in machine.queue
        if item.description == run.token and item.started
    ]
    assert len(ours) == items
    assert alarm in [each.code for each in site.container.alarms.open()]


def test_a_robot_that_is_switched_off_gives_back_what_waits_for_it(site, plan):
    plan()
    site.run(299.8)
    for robot in site.container.catalogue.robots()[:2]:
        site.container.catalogue.set_robot_enabled(robot.id, False)
    site.run(60)
    [run] = site.executions()
    assert (run.robot, run.state) == ("R3", State.EXECUTING)


def test_while_all_are_held_it_waits_and_goes_when_one_is_released(site, plan):
    plan()
    for robot in site.container.catalogue.robots():
        site.container.holds.hold("cleaning", None, robot.id)
    site.run(330)
    [run] = site.executions()
    assert (run.state, run.wait, run.robot_id) == (State.WAITING, Wait.ROBOT, None)
    assert {each["out"] for each in run.wait_details["robots"]} == {"held"}
    site.container.holds.release(2)
    site.run(10)
    [run] = site.executions()
    assert run.robot == "R2"


def test_at_the_last_call_it_goes_into_a_queue(site, plan):
    """Rather late than lost: every robot is busy with somebody else's long mission."""
    plan(start_window_minutes=2)
    for name in site.machines:
        for _n in range(30):
            site.stranger_queues(robot=name)
    site.run(300 + 110)
    assert site.executions()[0].state is State.WAITING
    site.run(12)
    [run] = site.executions()
    assert (run.state, run.choice["last_call"]) == (State.QUEUED, True)


def test_what_is_edited_while_it_waits_goes_as_it_is_now(site, plan):
    site.add_mission("Home")
    schedule = plan()
    for robot in site.container.catalogue.robots():
        site.container.holds.hold("cleaning", None, robot.id)
    site.run(310)
    site.container.catalogue.save_schedule(replace(schedule, mission_id=2))
    site.container.holds.release(1)
    site.run(30)
    [run] = site.executions()
    assert (run.mission, run.mission_guid, run.robot) == ("Home", GUIDS["Home"], "R1")


def test_two_of_a_schedule_that_queues_come_one_after_the_other_on_whichever_robot(site, plan):
    plan(recurrence="FREQ=MINUTELY;INTERVAL=1", overlap=Overlap.QUEUE, respect_working_days=False)
    site.run(900)
    runs = [run for run in site.executions() if run.submitted_at]
    assert len(runs) > 3
    assert all(before.ended_at <= after.submitted_at for before, after in pairwise(runs))


def test_the_database_lets_no_start_change_from_one_robot_to_another(site, plan):
    plan()
    site.run(310)
    [run] = site.executions()
    with pytest.raises(sqlite3.IntegrityError, match="by way of none"):
        site.container.db.write(lambda c: c.execute("UPDATE executions SET robot_id = ?", (run.robot_id + 1,)))
    with pytest.raises(sqlite3.IntegrityError, match="needs a robot"):
        site.container.db.write(lambda c: c.execute("UPDATE executions SET robot_id = NULL"))


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


def test_a_decision_that_fails_is_tried_again_and_stops_no_other_group(site, plan, monkeypatch):
    """Nothing can be written at that moment."""
    bind, failed = Ledger.bind, []

    def failing(*args):
        if not failed:
            failed.append(1)
            raise DatabaseUnavailable("nothing can be written")
        return bind(*args)

    monkeypatch.setattr(Ledger, "bind", failing)
    plan()
    site.run(330)
    [run] = site.executions()
    assert run.submitted_at is not None


def test_what_was_ever_sent_to_a_robot_lies_above_its_first_floor(site, plan):
    """It refuses a connection first, takes the request without an answer next, and is given the start a third time."""
    plan(start_window_minutes=30)
    for robot in site.container.catalogue.robots()[1:]:
        site.container.catalogue.set_robot_enabled(robot.id, False)
    site.run(295)
    site.network.down |= {"R1"}
    site.run(10)
    site.network.down.clear()
    site.network.next("POST", QUEUE, Fate.LATE, 89.0)
    site.run(60)
    [run] = site.executions()
    assert run.queue_floor is not None
    floor = run.queue_floor
    site.run_until(
        lambda: site.executions()[0].robot_id is None or site.executions()[0].submitted_at is not None, within=200
    )
    [run] = site.executions()
    site.run(600)
    assert sum(map(len, queues(site).values())) == 1
    assert site.executions()[0].queue_floor == floor


def test_a_start_is_sent_as_it_is_when_its_robot_is_bound(site, plan, monkeypatch):
    """A person changes the mission between the decision and the binding."""
    site.add_mission("Home")
    schedule, bind = plan(), Ledger.bind

    def after_an_edit(ledger, *args):
        site.container.catalogue.save_schedule(replace(schedule, mission_id=2))
        monkeypatch.setattr(Ledger, "bind", bind)
        return bind(ledger, *args)

    monkeypatch.setattr(Ledger, "bind", after_an_edit)
    site.run(310)
    [run] = site.executions()
    assert (run.mission, run.mission_guid) == ("Home", GUIDS["Home"])
    assert [item.mission_id for machine in site.machines.values() for item in machine.queue] == [GUIDS["Home"]]


def test_a_copy_of_what_a_person_has_cancelled_is_stopped_on_the_robot_that_had_been_given_up(site, plan):
    plan(start_window_minutes=30)
    for name in site.machines:
        site.network.next("POST", QUEUE, Fate.LATE, 130.0, robot=name)
    site.run(301)
    [run] = site.executions()
    first = run.robot
    site.network.planned.clear()
    site.run_until(lambda: site.executions()[0].robot not in ("", first), within=200)
    site.run(3)
    site.container.operator.cancel_execution(run.id)
    site.run(120)
    assert {str(item.state) for machine in site.machines.values() for item in machine.queue} == {"Aborted"}
    assert "late_cancelled" in [alarm.code for alarm in site.container.alarms.open()]


def test_a_robot_on_its_way_to_the_charger_by_itself_is_free_once_it_charges(site, plan):
    """Its idle mission ends by itself when something comes."""
    charger = site.add_mission("Return to charger")
    for robot in site.container.catalogue.robots():
        site.container.catalogue.save_idle_rule(robot.id, charger.id, after_minutes=5)
    plan(at="2026-11-23T06:40")
    site.run(2400 + 5)
    [run] = [run for run in site.executions() if run.trigger is Trigger.SCHEDULED]
    assert (run.submitted_at - run.planned_at).total_seconds() < 3


def test_the_choice_says_what_its_robot_had_over_others_that_were_free(site, plan):
    for minute in (5, 20, 35):
        plan(f"{minute}", f"2026-11-23T06:{minute:02}")
    site.run(2200)
    first, _second, third = sorted(site.executions(), key=lambda run: run.planned_at)
    assert chosen(first.choice, "UTC") == "R1: free now; R2: free now; R3: free now"
    assert chosen(third.choice, "UTC") == "R3: free now, has run less today; R1: free now; R2: free now"
