"""What was given up on one robot of a group and comes there after all: put right wherever the start is by then."""

from __future__ import annotations

import itertools

import pytest

from app.domain.models import ReasonCode, State
from tests.support.network import QUEUE, Fate

LATE = 200.0  # s: the time-out and the quiet time are over by then


def given_up(hall, late=LATE, **values):
    """The start's first request to whichever robot gets it hangs, and arrives that much later. Returns that robot's name."""
    values = {"start_window_minutes": 30} | values
    hall.plan("A", **values)
    for name in hall.machines:
        hall.network.next("POST", QUEUE, Fate.LATE, late, robot=name)
    hall.run(301)
    hall.network.planned.clear()
    return hall.run_of().robot


def released(hall):
    return hall.run_of().robot_id is None


def ran(hall):
    return [item for item in hall.items() if item.started]


def hold_all(hall):
    for name in hall.machines:
        hall.hold(name)


def test_while_no_robot_has_it_again_the_late_item_is_the_one_though_it_is_done_by_then(hall):
    first = given_up(hall)
    hold_all(hall)
    hall.run(140)
    assert released(hall)
    hall.network.down |= set(hall.machines)  # the item comes and is done while nobody can see it
    hall.run(300)
    hall.network.down.clear()
    hall.run(60)
    assert (hall.run_of().state, hall.run_of().robot) == (State.COMPLETED, first)
    assert len(hall.items()) == 1


def test_a_late_item_that_ran_while_the_app_was_off_is_found_by_the_next_run(hall):
    """It was given up, and nobody was there while it might still have come."""
    first = given_up(hall, late=400.0, start_window_minutes=1)
    hold_all(hall)
    hall.run(140)
    assert hall.run_of().state is State.FAILED
    hall.power_cut(3600)
    hall.run(60)
    assert (hall.run_of().state, hall.run_of().robot) == (State.COMPLETED, first)


def test_a_late_item_that_runs_is_the_one_though_the_start_waits_for_another_robot_already(hall):
    """The other robot can't be asked at that moment: nothing has been sent there."""
    first = given_up(hall, late=130.0)
    hold_all(hall)
    hall.run_until(lambda: released(hall), within=130)
    hall.network.next("GET", "/mission_queue", Fate.SLOW, 8.0, robot=first)
    hall.run(60)
    assert hall.run_of().robot == first
    hall.run(300)
    assert hall.run_of().state is State.COMPLETED
    assert len(ran(hall)) == 1


@pytest.mark.parametrize("is_done", [False, True])
def test_a_start_that_ended_without_a_robot_is_put_right(hall, is_done):
    first = given_up(hall, late=300.0, start_window_minutes=3)
    hold_all(hall)
    hall.run(220)
    assert (hall.run_of().state, hall.run_of().reason.code) == (State.FAILED, ReasonCode.NO_ROBOT)
    hall.run(70)
    hall.network.down |= set(hall.machines)  # nobody sees how it comes and begins
    hall.run(300 if is_done else 12)
    hall.network.down.clear()
    hall.run(360)
    assert len(ran(hall)) == 1
    assert (hall.run_of().state, hall.run_of().robot) == (State.COMPLETED, first)


def test_what_is_pending_and_too_late_is_cancelled_and_told(hall):
    first = given_up(hall, late=300.0, start_window_minutes=3)
    for _n in range(20):
        hall.stranger_queues(robot=first)
    hold_all(hall)
    hall.run(340)
    assert hall.run_of().state is State.FAILED
    assert "late_cancelled" in hall.alarms()
    assert {str(item.state) for item in hall.items() if item.description == hall.run_of().token} == {"Aborted"}


def test_what_may_still_come_is_not_pruned(hall):
    given_up(hall, late=400.0, start_window_minutes=3)
    hold_all(hall)
    hall.container.catalogue.change_settings(history_limit=1)
    hall.run(220)
    hall.container.holds.release(hall.robot("R2").id)
    hall.plan("B", at="2026-11-23T06:12", robot_id=hall.robot("R2").id, group_id=None)
    hall.plan("C", at="2026-11-23T06:14", robot_id=hall.robot("R2").id, group_id=None)
    hall.run(700)
    assert hall.run_of().robot == ""
    assert "late_cancelled" in hall.alarms()
    assert [item.description for item in ran(hall) if item.description == hall.run_of().token] == []


def test_a_robot_that_is_put_back_is_searched_again(hall):
    first = given_up(hall)
    hold_all(hall)
    hall.run_until(lambda: released(hall), within=130)
    removed = hall.container.catalogue.remove_robot(hall.robot(first).id)
    hall.run(5)
    hall.container.catalogue.restore(removed)
    hall.run(120)
    assert hall.run_of().robot == first


def test_another_machine_at_the_address_has_numbers_of_its_own(hall):
    """The first floor on the robot is that of its machine then; on another one everything of ours lies above another number."""
    hall.only("R1")
    for _n in range(30):
        hall.stranger_queues()
    hall.machines["R1"].cancel_all()
    hall.run(30)
    hall.plan("A", start_window_minutes=30)
    hall.network.next("POST", QUEUE, Fate.LOST)
    hall.run_until(lambda: bool(hall.executions()) and hall.run_of().tried, within=500)
    floor = hall.run_of().tried["1"]["floor"]
    assert (floor >= 30, hall.run_of().tried["1"]["serial"]) == (True, hall.robot("R1").serial_number)


def test_two_that_queue_say_what_the_later_one_waits_for(hall):
    hall.plan(
        "A", recurrence="FREQ=MINUTELY;INTERVAL=1", overlap="queue", respect_working_days=False, start_window_minutes=30
    )
    hall.run(300 + 70)
    first, second, *_more = itertools.islice(hall.executions(), 3)
    assert (second.robot_id, second.wait_details["before"]) == (None, first.planned_at.isoformat())


def test_figures_count_what_ended_without_a_robot(hall):
    hold_all(hall)
    hall.plan("A", start_window_minutes=2)
    hall.run(430)
    figures = hall.container.kpis.facts()
    assert (hall.run_of().state, hall.run_of().robot_id, figures.failed) == (State.FAILED, None, 1)
    assert [robot.robot for robot in figures.robots] == ["R1", "R2", "R3"]
