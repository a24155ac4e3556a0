"""A robot that fails start after start: others of its group go first, and an alarm names it."""

from __future__ import annotations

from datetime import timedelta

import pytest

from app.database.errors import DatabaseUnavailable
from app.domain.choice import chosen
from app.domain.models import State
from app.services.dispatch.ledger import TOO_MANY
from mir_sim.mission_queue import ItemState
from tests.support.network import QUEUE, Fate

STARTS = 5


@pytest.fixture
def bad(hall):
    """The machine of R1, which is otherwise the best of equals: it aborts whatever it begins, and is Ready again at once."""
    machine, is_bad = hall.machines["R1"], True

    def abort():
        if is_bad and machine.run is not None:
            machine.controller.end(ItemState.ABORTED, "Mission cannot be completed")
        hall.at(1.0, abort)

    def repair():
        nonlocal is_bad
        is_bad = False

    hall.at(1.0, abort)
    machine.repair = repair
    return machine


def plan_often(hall, minutes=10, starts=STARTS, **values):
    hall.plan(recurrence=f"FREQ=MINUTELY;INTERVAL={minutes};COUNT={starts}", **values)
    hall.run(300 + starts * minutes * 60)


def robots_of(hall):
    return [row.robot for row in sorted(hall.executions(), key=lambda row: row.planned_at)]


def alarm_of(hall):
    return next((alarm for alarm in hall.container.alarms.open() if alarm.code == "robot_fails"), None)


def test_others_that_are_free_go_first_and_the_choice_says_why(hall, bad):
    plan_often(hall)
    rows = sorted(hall.executions(), key=lambda row: row.planned_at)
    assert (rows[0].robot, rows[0].state) == ("R1", State.FAILED)
    assert all(row.robot != "R1" and row.state is State.COMPLETED for row in rows[1:])
    assert "R1: free now, its last start failed" in chosen(rows[1].choice, "UTC")


def test_alone_it_still_gets_every_start_and_an_alarm_names_it(hall, bad):
    hall.only("R1")
    plan_often(hall)
    assert robots_of(hall) == ["R1"] * STARTS
    assert (alarm_of(hall).key, alarm_of(hall).details["count"]) == (f"robot:{hall.robot('R1').id}", STARTS)


def test_the_failed_start_has_its_alarm_though_that_of_the_robot_cannot_be_written(hall, bad, monkeypatch):
    def fail(*_args, **_details):
        raise DatabaseUnavailable("the disk is full")

    monkeypatch.setattr(hall.container.alarms, "raise_about_robot", fail)
    hall.only("R1")
    plan_often(hall, starts=TOO_MANY)
    assert [alarm.count for alarm in hall.container.alarms.open() if alarm.code == "execution_failed"] == [TOO_MANY]


def test_two_failures_are_no_alarm(hall, bad):
    hall.only("R1")
    plan_often(hall, starts=TOO_MANY - 1)
    assert alarm_of(hall) is None


def test_its_own_starts_count_as_those_of_its_group(hall, bad):
    """Another app start lies between: what is counted is kept."""
    for number in range(TOO_MANY):
        hall.plan(f"own {number}", f"2026-11-23T06:{5 + 5 * number:02}", robot_id=hall.robot("R1").id, group_id=None)
        hall.run(400)
        hall.power_cut(5)
    plan_often(hall, at=f"{hall.clock.now() + timedelta(minutes=5):%Y-%m-%dT%H:%M}", starts=2)
    assert alarm_of(hall).details["count"] == TOO_MANY
    assert "R1" not in robots_of(hall)[TOO_MANY:]
    assert f"R1: free now, {TOO_MANY} starts failed in a row" in chosen(hall.run_of().choice, "UTC")


def test_its_first_success_ends_the_alarm_and_is_a_clean_sheet(hall, bad):
    hall.only("R1")
    plan_often(hall, starts=TOO_MANY)
    bad.repair()
    hall.container.operator.run_now(hall.robot("R1").id, 1)
    hall.run(300)
    assert alarm_of(hall).cleared_at is not None
    hall.switch("R2", on=True)
    hall.plan("later", f"{hall.clock.now() + timedelta(minutes=5):%Y-%m-%dT%H:%M}")
    hall.run(400)
    assert "failed" not in chosen(hall.run_of("later").choice, "UTC")


def test_what_a_person_cancels_is_not_held_against_it(hall):
    hall.only("R1")
    hall.plan(recurrence=f"FREQ=MINUTELY;INTERVAL=10;COUNT={STARTS}")
    hall.run(300)
    for _time in range(STARTS):
        hall.run_until(lambda: hall.executions(State.EXECUTING))
        hall.container.operator.cancel_execution(hall.executions(State.EXECUTING)[0].id)
        hall.run(600)
    assert {row.state for row in hall.executions()} == {State.CANCELLED}
    assert alarm_of(hall) is None


def test_one_that_answers_every_start_with_an_error_is_passed_over_too(hall):
    """The first start waits for the quiet time there, as it may have come; later ones go elsewhere at once."""
    for _time in range(STARTS):
        hall.network.next("POST", QUEUE, Fate.LOST, robot="R1")
    plan_often(hall)
    rows = sorted(hall.executions(), key=lambda row: row.planned_at)
    assert "R1" not in {row.robot for row in rows}
    assert all((row.submitted_at - row.planned_at).total_seconds() < 3 for row in rows[1:])


def refused_unsent(hall):
    """Starts that no robot takes, as the app finds out when they are to be sent."""
    hall.network.down.update(hall.machines)
    plan = {"recurrence": "FREQ=MINUTELY;INTERVAL=10;COUNT=4", "parameters": {"Speed": 1}}
    hall.at(60, lambda: hall.network.down.clear())
    return plan


def test_what_the_app_refuses_without_sending_it_is_not_held_against_a_robot(hall):
    hall.plan(**refused_unsent(hall))
    hall.plan("own", robot_id=hall.robot("R1").id, group_id=None, **refused_unsent(hall))
    hall.run(3000)
    assert {row.state for row in hall.executions()} == {State.FAILED}
    assert (hall.network.posts(), alarm_of(hall)) == ([], None)
    hall.plan("later", f"{hall.clock.now() + timedelta(minutes=5):%Y-%m-%dT%H:%M}")
    hall.run(400)
    assert "failed" not in chosen(hall.run_of("later").choice, "UTC")
