"""One robot whose starts are handed over when it is free: the order is the app's, and nothing is late for that."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from app.domain.execution import State, Wait
from app.domain.models import HandOver, Robot
from app.domain.reasons import waiting_sentence
from tests.support.groups import Hall
from tests.support.network import QUEUE, Fate


@pytest.fixture
def hall(tmp_path):
    hall = Hall(tmp_path, robots=2)
    hall.container.catalogue.edit(
        lambda edit: edit.robots.update(edit.c, replace(edit.the(Robot, 1), hand_over=HandOver.WHEN_FREE))
    )
    hall.container.changes.publish("robots")
    hall.run(5)
    yield hall
    hall.switch_off()


def plan(hall, name, at="2026-11-23T06:05", **values):
    return hall.plan(name, at, **({"robot_id": 1, "group_id": None, "start_window_minutes": 60} | values))


@pytest.mark.long
def test_they_come_one_by_one_the_most_important_first(hall):
    for name, priority in zip("ABCD", (0, 2, -1, 1), strict=True):
        plan(hall, name, priority=priority)
    hall.run(1500)
    runs = sorted(hall.executions(), key=lambda run: run.submitted_at)
    assert [run.schedule for run in runs] == ["B", "D", "A", "C"]
    assert all(0 <= (after.submitted_at - before.ended_at).total_seconds() < 4.5 for before, after in pairwise(runs))


def test_what_comes_later_and_matters_more_goes_before_what_waits(hall):
    plan(hall, "A"), plan(hall, "B")
    plan(hall, "Urgent", "2026-11-23T06:06", priority=2)
    hall.run(1500)
    assert [run.schedule for run in sorted(hall.executions(), key=lambda run: run.submitted_at)] == ["A", "Urgent", "B"]


def test_what_waits_says_so(hall):
    plan(hall, "A"), plan(hall, "B")
    hall.run(310)
    waits = hall.run_of("B")
    assert (waits.state, waits.wait, waits.attempts) == (State.WAITING, Wait.ROBOT, 0)
    assert waiting_sentence(waits) == "Waits until R1 is free, until 07:05 at the latest"


def test_it_waits_for_what_somebody_else_has_put_there_and_goes_into_the_queue_at_the_last_call(hall):
    for _n in range(30):
        hall.stranger_queues()
    plan(hall, "A", start_window_minutes=2)
    hall.run(410)
    assert hall.run_of().state is State.WAITING
    hall.run(10)
    assert hall.run_of().state is State.QUEUED


def test_a_person_is_next(hall):
    plan(hall, "A"), plan(hall, "B")
    hall.run(310)
    row = hall.container.operator.run_now(1, 1)
    hall.run(600)
    by_submission = sorted(hall.executions(), key=lambda run: run.submitted_at)
    assert by_submission[1].id == row.id


def test_while_an_answer_is_open_nothing_else_goes(hall):
    hall.network.next("POST", QUEUE, Fate.LATE, 60.0)
    plan(hall, "A"), plan(hall, "B")
    hall.run(350)
    assert sorted(run.state for run in hall.executions()) == [State.SUBMITTING, State.WAITING]
    hall.run(900)
    assert hall.states() == [State.COMPLETED] * 2


def test_a_free_robot_starts_at_the_instant(hall):
    plan(hall, "A")
    hall.run(320)
    assert (hall.run_of().submitted_at - hall.run_of().planned_at).total_seconds() < 1.0


def test_the_other_robot_gets_all_at_once_as_before(hall):
    for name in "AB":
        plan(hall, name, robot_id=2)
    hall.run(302)
    assert {run.state for run in hall.executions()} <= {State.QUEUED, State.EXECUTING}
