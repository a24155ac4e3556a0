"""A robot whose answers are larger than needed: they are not parsed, and a message says what was omitted."""

from __future__ import annotations

import json

import pytest

from app.domain.robot import RobotStatus
from app.mir import parse
from app.mir.client import RobotClient
from app.mir.errors import Rejected, Unreadable
from app.screens.common.formats import LONGEST_QUESTION
from app.screens.home.card import Note
from app.screens.home.view import present
from tests.support.home_facts import NOW, with_aino
from tests.unit.mir.answers import answered

KIB = 1024


def client(status: int, content: object) -> RobotClient:
    return answered(status, json.dumps(content).encode())


def asked(question: str, options: list[object]) -> RobotStatus:
    """The status of a robot that asks this."""
    prompted = {"guid": "g", "question": question, "options": options}
    return client(200, {"state_id": 5, "user_prompt": prompted}).status()


def shown(status: RobotStatus) -> Note:
    """What Home shows of its question."""
    return present(with_aino(status), NOW).card.note


def large(size: int) -> dict[str, object]:
    return {"state_id": 3, "robot_name": "R1", "noise": ["x" * 10] * (size // 14)}


def test_a_status_within_the_budget_is_read():
    assert client(200, large(250 * KIB)).status().robot_name == "R1"


@pytest.mark.parametrize(
    "call",
    [RobotClient.status, RobotClient.identify, lambda robot: robot.queue_item(1), lambda robot: robot.mission("guid")],
)
def test_a_large_answer_is_not_parsed(call, monkeypatch):
    monkeypatch.setattr(parse, "loads", lambda _body: pytest.fail("parsed"))
    with pytest.raises(Unreadable, match="256 KiB"):
        call(client(200, large(300 * KIB)))


def test_the_words_of_a_large_refusal_are_not_looked_for():
    with pytest.raises(Rejected) as refused:
        client(400, {"error_human": "no"} | large(300 * KIB)).status()
    assert not refused.value.params["reason"]


def test_a_prompt_shows_twelve_options_and_says_how_many_there_are():
    status = asked("Which?", [f"Door {n}" for n in range(1000)])
    assert status.user_prompt.options == tuple(f"Door {n}" for n in range(12))
    assert status.user_prompt.more_options == 988
    assert len(shown(status).answers) == 12
    assert (shown(status).problem, shown(status).step) == ("Which?", "988 more answers at the robot")


def test_a_prompt_with_twelve_options_says_nothing_of_more():
    assert shown(asked("Which?", [f"Door {n}" for n in range(12)])).problem == "Which?"


@pytest.mark.parametrize(
    "option",
    ["x" * 256, "x" * 600, "Yes\u202e", "Y\x00es", "", " ", 5, None, "ab12" * 20],
    ids=["long", "longer", "turned around", "a control character", "empty", "blank", "a number", "none", "a secret"],
)
def test_an_answer_is_sent_as_the_robot_offers_it_or_not_offered(option):
    found = asked("Which?", [option, "x" * 255, " No"]).user_prompt
    assert (found.options, found.more_options) == (("x" * 255, "No"), 1)


def test_a_question_without_end_leaves_the_answers_in_sight():
    question = shown(asked("Is the aisle free of people? " * 120, ["Yes", "No"])).problem
    assert question.startswith("Is the aisle free of people? Is the aisle")
    assert question.endswith("… read all of it at the robot")
    assert len(question) <= LONGEST_QUESTION + len(" … read all of it at the robot")
