"""How many questions a robot bears: only what was seen twice, or a boot, sets the pace at which it is asked from then on."""

from __future__ import annotations

import itertools
import json

import pytest

from app.domain.check_up import Level, Rest, Topic
from app.mir.errors import ConnectionLost
from app.mir.transport import Response
from app.services.check_up.load_probes import latency, load
from app.services.check_up.session import CheckUpSession
from tests.support.findings import says
from tests.support.recorded_robot import AskedRobot

LOST = ConnectionLost(address="10.0.0.1")


def losing(*numbers: int) -> AskedRobot:
    """One whose answers to these requests never arrive."""
    robot, count = AskedRobot(), itertools.count(1)
    robot.gives(LOST, lambda method, path: next(count) in numbers)
    return robot


def asked_for_load(robot: AskedRobot) -> CheckUpSession:
    session = robot.session()
    session.add(Topic.LOAD, load(session))
    return session


@pytest.mark.parametrize("number", [3, 20, 41])
def test_one_gap_sets_no_pace(number):
    session = asked_for_load(losing(number))
    assert "rest" not in session.facts
    level, text = says(session, Topic.LOAD)
    assert level is Level.AMBER
    assert text.startswith("It left one of ")
    assert text.endswith("answered all when it was asked as often again")


def test_a_robot_that_does_not_bear_it_twice_is_asked_less():
    robot = AskedRobot()
    times = []

    def is_too_much(_method, _path):
        times.append(robot.clock.monotonic())
        return sum(times[-1] - at < 8.0 for at in times) > 25

    robot.gives(LOST, is_too_much)
    session = asked_for_load(robot)
    assert session.facts["rest"] == Rest(25, 10.0)
    assert says(session, Topic.LOAD) == (
        Level.RED,
        "It stopped answering when it was asked 26 times within 10 s, twice",
    )


def test_of_a_robot_that_loses_answers_at_any_time_it_is_not_found_out():
    session = losing(7, 19, 44, 80, 95).session()
    session.add(Topic.LATENCY, latency(session))
    session.add(Topic.LOAD, load(session))
    assert "rest" not in session.facts
    level, text = says(session, Topic.LOAD)
    assert level is Level.AMBER
    assert text.startswith("Not found out")


def test_a_robot_that_stays_away_gets_no_pace():
    session = asked_for_load(losing(*range(30, 5000)))
    assert "rest" not in session.facts
    assert says(session, Topic.LOAD) == (
        Level.RED,
        "It stopped answering when it was asked 29 times within 10 s, and was not back within 5 min",
    )


def test_one_that_does_not_say_how_long_it_is_on_is_not_taken_for_booted():
    robot = losing(12)
    lost = robot.meddle

    def meddle(method, path, answer):
        status = json.loads(lost(method, path, answer).body)
        del status["uptime"]
        return Response(answer.status, json.dumps(status).encode(), answer.headers)

    robot.meddle = meddle
    assert "rest" not in asked_for_load(robot).facts
