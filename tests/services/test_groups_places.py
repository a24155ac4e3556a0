"""Places where only so many missions of this app may be at a time."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import pytest

from app.domain.models import Group, Place, ReasonCode, State, Wait
from app.domain.reasons import waiting_sentence
from tests.support.groups import Hall
from tests.support.network import QUEUE, Fate


@pytest.fixture
def hall(tmp_path):
    hall = Hall(tmp_path)
    hall.add_mission("Wait at home")
    yield hall
    hall.switch_off()


def full_dock(hall, most=1):
    hall.container.catalogue.edit(lambda edit: edit.save_place(Place("Dock 2", most, (1,))))


def at_the_dock(hall):
    return sum(
        run.state in (State.SUBMITTING, State.QUEUED, State.EXECUTING) and run.mission == "Deliver"
        for run in hall.executions()
    )


def test_not_more_than_the_place_has_room_for(hall):
    full_dock(hall, most=2)
    for name in "ABC":
        hall.plan(name)
    for _n in range(60):
        hall.run(10)
        assert at_the_dock(hall) <= 2
    assert [run.state for run in hall.executions()] == [State.COMPLETED] * 3


def test_what_waits_for_a_place_keeps_no_robot_from_others_and_says_who_is_there(hall):
    full_dock(hall)
    hall.plan("A")
    hall.run(303)
    hall.plan("B", at="2026-11-23T06:06")
    hall.plan("C", at="2026-11-23T06:06", mission_id=2)
    hall.plan("D", at="2026-11-23T06:06", mission_id=2)
    hall.run(65)
    waits = hall.run_of("B")
    assert (waits.state, waits.wait, waits.wait_details["robot"]) == (State.WAITING, Wait.PLACE, hall.run_of("A").robot)
    assert "Waits for Dock 2: " in waiting_sentence(waits)
    assert {hall.run_of(name).state for name in "CD"} == {State.EXECUTING}


@pytest.mark.parametrize("fixed", ["A", "B"])
def test_starts_of_one_robot_respect_a_place_too(hall, fixed):
    full_dock(hall)
    for name in "AB":
        hall.plan(name, **({"robot_id": hall.robot("R1").id, "group_id": None} if name == fixed else {}))
    for _n in range(60):
        hall.run(10)
        assert at_the_dock(hall) <= 1
    assert [run.state for run in hall.executions()] == [State.COMPLETED] * 2


def test_two_starts_for_two_robots_of_one_instant_share_a_place(hall):
    full_dock(hall)
    for name, robot in zip("AB", ("R1", "R2"), strict=True):
        hall.plan(name, robot_id=hall.robot(robot).id, group_id=None)
    hall.run(302)
    assert sorted((run.state, run.wait) for run in hall.executions())[1] == (State.WAITING, Wait.PLACE)
    hall.run(400)
    assert [run.state for run in hall.executions()] == [State.COMPLETED] * 2


def test_an_unknown_outcome_holds_its_place(hall):
    full_dock(hall)
    hall.plan("A", start_window_minutes=30)
    for name in hall.machines:
        hall.network.next("POST", QUEUE, Fate.LOST, robot=name)
    hall.run(303)
    hall.network.planned.clear()
    hall.plan("B", at="2026-11-23T06:06")
    hall.run(80)
    assert (hall.run_of("A").state, hall.run_of("B").wait) == (State.SUBMITTING, Wait.PLACE)


def test_a_place_that_stays_full_ends_it(hall):
    full_dock(hall)
    hall.plan("A", start_window_minutes=60)
    hall.run(301)
    robot = hall.run_of("A").robot
    hall.machines[robot].pause()
    hall.plan("B", at="2026-11-23T06:06", start_window_minutes=1)
    hall.run(130)
    assert hall.run_of("B").reason.code is ReasonCode.PLACE_BUSY


def test_a_site_with_another_group_shares_the_place(hall):
    full_dock(hall)
    other = hall.container.catalogue.edit(lambda edit: edit.save_group(Group("Yard", (hall.robot("R3").id,))))
    hall.plan("A")
    hall.plan("B", group_id=other.id)
    hall.run(303)
    assert at_the_dock(hall) == 1
    assert (
        datetime.fromisoformat(
            next(row for row in hall.executions() if row.wait is Wait.PLACE).wait_details["until"]
        ).second
        == 0
    )


def test_a_place_stays_taken_when_the_mission_that_is_there_is_renamed(hall):
    full_dock(hall)
    hall.plan("A")
    hall.plan("B", at="2026-11-23T06:06")
    hall.run(320)
    catalogue = hall.container.catalogue
    catalogue.save_mission(replace(catalogue.edit(lambda edit: edit.the_mission(1)), name="Deliver kits"))
    hall.run(45)
    assert (hall.run_of("A").state, hall.run_of("B").wait) == (State.EXECUTING, Wait.PLACE)


def test_what_a_person_gave_to_a_robot_that_is_held_then_keeps_no_place(hall):
    full_dock(hall)
    hall.only("R1")
    for _n in range(9):
        hall.stranger_queues(robot="R1")
    hall.plan("A", start_window_minutes=60, minimum_battery_percent=50)
    hall.run(305)
    hall.machines["R1"].set_battery(20.0)
    hall.run(10)
    hall.container.operator.assign_robot(hall.run_of("A").id, hall.robot("R1").id)
    hall.run(10)
    assert hall.run_of("A").wait is Wait.BATTERY
    hall.switch("R2", on=True)
    hall.plan("B", at="2026-11-23T06:07")
    hall.run(110)
    assert (hall.run_of("B").state, hall.run_of("B").robot) == (State.EXECUTING, "R2")
