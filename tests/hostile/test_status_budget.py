"""A robot whose answers are larger than needed: they are not parsed, and a message says what was omitted."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from app.mir import parse
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import Rejected, Unreadable
from app.mir.transport import Response
from app.screens.home.view import LONGEST_QUESTION, prompt
from tests.support.home_facts import READY, snapshot

KIB = 1024


class Answers:
    """A transport that always gives the same answer."""

    def __init__(self, status: int, body: bytes) -> None:
        self.answer = Response(status, body)

    def send(self, *_args, **_options) -> Response:
        return self.answer

    def read_connection(self) -> None:
        """No connection."""

    def close(self) -> None:
        pass


def client(status: int, content: object) -> RobotClient:
    return RobotClient(Address.parse("10.0.0.1"), Token(""), transport=Answers(status, json.dumps(content).encode()))


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
    asked = {
        "state_id": 5,
        "user_prompt": {"guid": "g", "question": "Which?", "options": [f"Door {n}" for n in range(1000)]},
    }
    status = client(200, asked).status()
    assert status.user_prompt.options == tuple(f"Door {n}" for n in range(12))
    assert status.user_prompt.more_options == 988
    shown = prompt(replace(snapshot(1, READY), status=status), old=False)
    assert len(shown.options) == 12
    assert shown.question == "Which? (988 more answers can be given at the robot)"


def test_a_prompt_with_twelve_options_says_nothing_of_more():
    asked = {
        "state_id": 5,
        "user_prompt": {"guid": "g", "question": "Which?", "options": [f"Door {n}" for n in range(12)]},
    }
    assert prompt(replace(snapshot(1, READY), status=client(200, asked).status()), old=False).question == "Which?"


@pytest.mark.parametrize(
    "option",
    ["x" * 256, "x" * 600, "Yes\u202e", "Y\x00es", "", " ", 5, None, "ab12" * 20],
    ids=["long", "longer", "turned around", "a control character", "empty", "blank", "a number", "none", "a secret"],
)
def test_an_answer_is_sent_as_the_robot_offers_it_or_not_offered(option):
    asked = {"state_id": 5, "user_prompt": {"guid": "g", "question": "Which?", "options": [option, "x" * 255, " No"]}}
    status = client(200, asked).status()
    assert (status.user_prompt.options, status.user_prompt.more_options) == (("x" * 255, "No"), 1)


def test_a_question_without_end_leaves_the_answers_in_sight():
    asked = {
        "state_id": 5,
        "user_prompt": {"guid": "g", "question": "Is the aisle free of people? " * 120, "options": ["Yes", "No"]},
    }
    question = prompt(replace(snapshot(1, READY), status=client(200, asked).status()), old=False).question
    assert question.startswith("Is the aisle free of people? Is the aisle")
    assert question.endswith("… read all of it at the robot")
    assert len(question) <= LONGEST_QUESTION + len(" … read all of it at the robot")
