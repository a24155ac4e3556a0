"""How many questions a robot bears: only what was seen twice, or a boot, sets the pace at which it is asked from then on."""

from __future__ import annotations

import json

import pytest

from app.domain.check_up import Level, Rest
from app.domain.message import render
from app.mir.errors import ConnectionLost
from app.mir.transport import Response
from app.services.check_up.pace import load, measure
from tests.support.asked_robot import AskedRobot


def says(look) -> tuple[Level, str]:
    return look.findings[-1].level, render(look.findings[-1].says)


def lose(robot: AskedRobot, *numbers: int) -> None:
    """Answers to these requests, counted from now on."""
    count = 0

    def meddle(method, path, answer):
        nonlocal count
        count += 1
        if count in numbers:
            raise ConnectionLost(address="10.0.0.1")
        return answer

    robot.meddle = meddle


def bears(robot: AskedRobot, requests: int, seconds: float) -> None:
    """It leaves unanswered what comes beyond."""
    times = []

    def meddle(method, path, answer):
        now = robot.clock.monotonic()
        times.append(now)
        if sum(now - at < seconds for at in times) > requests:
            raise ConnectionLost(address="10.0.0.1")
        return answer

    robot.meddle = meddle


@pytest.mark.parametrize("number", [3, 20, 41])
def test_one_gap_sets_no_pace(number):
    robot = AskedRobot()
    look = robot.look()
    lose(robot, number)
    load(look, 0.0, 60.0)
    assert "rest" not in look.seen
    level, text = says(look)
    assert level is Level.AMBER
    assert text.startswith("It left one of ")
    assert text.endswith("answered all when it was asked as often once more")


def test_a_robot_that_does_not_bear_it_twice_is_asked_less():
    robot = AskedRobot()
    look = robot.look()
    bears(robot, 25, 8.0)
    load(look, 0.0, 60.0)
    assert look.seen["rest"] == Rest(25, 10.0)
    assert says(look) == (Level.RED, "It stopped answering when it was asked 26 times within 10 s, twice")


def test_of_a_robot_that_loses_answers_at_any_time_it_is_not_found_out():
    robot = AskedRobot()
    look = robot.look()
    lose(robot, 7, 19, 44, 80, 95)
    measure(look, 60, 0.0, 60.0)
    load(look, 0.0, 60.0)
    assert "rest" not in look.seen
    assert says(look)[0] is Level.AMBER
    assert says(look)[1].startswith("Not found out")


def test_a_robot_that_stays_away_gets_no_pace():
    robot = AskedRobot()
    look = robot.look()
    lose(robot, *range(30, 5000))
    load(look, 0.0, 60.0)
    assert "rest" not in look.seen
    assert says(look) == (
        Level.RED,
        "It stopped answering when it was asked 29 times within 10 s, and was not back within 5 min",
    )


def test_one_that_does_not_say_how_long_it_is_on_is_not_taken_for_booted():
    robot = AskedRobot()
    look = robot.look()
    lose(robot, 12)
    lost = robot.meddle

    def meddle(method, path, answer):
        status = json.loads(lost(method, path, answer).body)
        del status["uptime"]
        return Response(answer.status, json.dumps(status).encode(), answer.headers)

    robot.meddle = meddle
    load(look, 0.0, 60.0)
    assert "rest" not in look.seen
