"""Answers that leave open whether a start was taken: what the robot said is shown while it is looked for, and afterwards."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from app.domain.message import render
from app.domain.models import Execution, ReasonCode, State, Trigger
from app.domain.reasons import sentence, waiting_sentence
from app.mir.errors import Busy, ConnectionLost, NotAMir, RobotFault, TimedOut
from app.services.dispatch.refusals import answer_in_doubt
from tests.support.network import Fate

START = "2026-11-23T06:05"
WHY = "the robot answered: Position mirconst-guid not found (status 500)"
NOON = datetime(2026, 11, 23, 12, tzinfo=UTC)
QUIET = 95.0  # s, and a little more than the quiet time


def start(**parameters: object) -> Execution:
    return Execution(Trigger.MANUAL, 1, "R1", "Deliver", "g", NOON, NOON, NOON, "token", "UTC", parameters=parameters)


@pytest.fixture
def in_doubt(site, plan):
    """A start whose POST the robot has answered with 500 and a sentence."""
    plan(START, name="S")
    site.network.next("POST", "/mission_queue", Fate.SAYS_WHY)
    site.run_until(lambda: site.executions(State.SUBMITTING) and site.network.posts())
    site.run(5)


def test_what_the_robot_says_is_shown_while_it_is_looked_for(site, in_doubt):
    (row,) = site.executions(State.SUBMITTING)
    assert waiting_sentence(row) == f"Checking with the robot: {WHY}"


def test_a_start_that_the_robot_cannot_take_ends_as_refused_and_is_not_sent_again(site, in_doubt):
    site.run(QUIET)
    (row,) = site.executions(State.FAILED)
    assert (row.reason.code, sentence(row.reason, "UTC")) == (ReasonCode.REFUSED, f"The robot refused it: {WHY}")
    site.run(900)
    assert len(site.network.posts()) == 1


def test_a_restart_in_between_forgets_nothing_of_it(site, in_doubt):
    site.switch_off(cleanly=False)
    site.switch_on()
    site.run(2 * QUIET)
    (row,) = site.executions(State.FAILED)
    assert (row.reason.code, len(site.network.posts())) == (ReasonCode.REFUSED, 1)
    assert WHY in sentence(row.reason, "UTC")


def test_one_that_was_taken_all_the_same_runs(site, plan):
    """The robot put it into its queue and then answered 500."""
    plan(START)
    site.network.next("POST", "/mission_queue", Fate.ERROR_AFTER)
    site.run(400)
    (row,) = site.executions()
    assert (row.state, len(site.network.posts())) == (State.COMPLETED, 1)


def test_one_that_a_person_cancels_ends_as_cancelled(site, in_doubt):
    site.container.operator.cancel_execution(site.executions()[0].id)
    site.run(QUIET)
    (row,) = site.executions()
    assert (row.state, row.reason.code) == (State.CANCELLED, ReasonCode.USER_CANCELLED)


def test_a_robot_that_only_says_that_something_went_wrong_is_tried_again(site, plan):
    plan(START, start_window_minutes=2)
    site.network.next("POST", "/mission_queue", Fate.ERROR_BEFORE, count=2)
    site.run(900)
    (row,) = site.executions(State.FAILED)
    assert len(site.network.posts()) == 2
    assert "the robot answered: Internal server error (status 500)" in sentence(row.reason, "UTC")


def test_of_a_group_another_robot_gets_it(hall):
    hall.plan("2026-11-23T06:05")
    hall.network.next("POST", "/mission_queue", Fate.SAYS_WHY)
    hall.run(1200)
    (row,) = hall.executions(State.COMPLETED)
    (refused,) = [each for each in row.tried.values() if each.get("is_for_good")]
    assert (refused["code"], refused["robot"] != row.robot) == ("refused", True)


@pytest.mark.parametrize(
    ("error", "text", "is_final"),
    [
        (RobotFault(status=500, reason="No such action"), "the robot answered: No such action (status 500)", True),
        (RobotFault(status=501, reason="Not here"), "the robot answered: Not here (status 501)", True),
        (
            RobotFault(status=500, reason="Internal Server Error."),
            "the robot answered: Internal Server Error. (status 500)",
            False,
        ),
        (RobotFault(status=502, reason="upstream"), "the robot answered: upstream (status 502)", False),
        (RobotFault(status=502), "the robot failed on its side (status 502)", False),
        (RobotFault(status=504), "the robot failed on its side (status 504)", False),
        (Busy(reason="Docking"), "the robot answered: Docking (status 503)", False),
        (NotAMir(code="web_page"), "the robot answers with a web page, not like a MiR robot", False),
    ],
)
def test_every_answer_has_its_own_sentence_and_only_a_reason_is_final(error, text, is_final):
    kept = answer_in_doubt(start(), error)
    assert bool(kept.get("is_reason")) is is_final
    assert render(kept["answer"]) == text


@pytest.mark.parametrize("error", [TimedOut(seconds=5), ConnectionLost()])
def test_where_nothing_was_answered_nothing_is_said_of_an_answer(error):
    assert answer_in_doubt(start(), error) == {}


def test_robots_answer_a_parameter_that_they_do_not_know_with_no_more_than_that_something_went_wrong():
    assert answer_in_doubt(start(Speed=1), RobotFault(status=500, reason="Internal server error"))["is_reason"]
