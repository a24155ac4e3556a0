"""What is kept and said of an answer that leaves open whether a start was taken."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from app.domain.execution import Execution, Trigger
from app.domain.message import render
from app.mir.errors import Busy, ConnectionLost, NotAMir, RobotFault, TimedOut
from app.services.dispatch.attempt import answer_in_doubt

NOON = datetime(2026, 11, 23, 12, tzinfo=UTC)


def start(**parameters: object) -> Execution:
    return Execution(Trigger.MANUAL, 1, "R1", "Deliver", "g", NOON, NOON, NOON, "token", "UTC", parameters=parameters)


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
        (Busy(status=503, reason="Docking"), "the robot answered: Docking (status 503)", False),
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
