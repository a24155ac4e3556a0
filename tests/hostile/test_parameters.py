"""Parameters of missions without end: each run keeps a copy of them."""
from __future__ import annotations

import json
from datetime import datetime

import pytest

from app.container import Container
from app.domain.models import InvalidInput, Mission, Robot, Schedule
from app.services.catalogue.configuration import import_configuration
from tests.support.process import is_one_line, run

ENDLESS = {
    "a long text": ({"x": "y" * 1001}, "the value of 'x' has at most 1000 characters"),
    "very many": ({f"p{number}": 1 for number in range(51)}, "a mission can be given 50 parameters at most"),
    "a long name": ({"x" * 81: 1}, "the name of a parameter has 1 to 80 characters"),
    "many digits": ({"x": 10**4000}, "the value of 'x' is too large a number"),
    "many digits below zero": ({"x": -10**4000}, "the value of 'x' is too large a number"),
}
ENOUGH = {**{f"p{number}": "y" * 1000 for number in range(48)}, "a": 2**63 - 1, "b": -1.5e300}


@pytest.fixture
def container(tmp_path):
    container = Container.open(tmp_path / "data")
    container.catalogue.save_mission(Mission("M", "guid-1"))
    container.catalogue.save_robot(Robot("R", "http://127.0.0.1:9", "distributor"), "secret")
    yield container
    container.close()


def schedule(parameters: object) -> bytes:
    return json.dumps({"format": "amr-scheduler/1", "schedules": [
        {"name": "S", "robot": "R", "mission": "M", "start": "2026-11-23T06:30", "parameters": parameters}]}).encode()


@pytest.mark.parametrize(("parameters", "problem"), ENDLESS.values(), ids=ENDLESS.keys())
def test_they_are_refused_in_a_file_in_a_schedule_and_for_one_run(container, parameters, problem):
    robot, mission = container.catalogue.robots()[0], container.catalogue.missions()[0]
    with pytest.raises(InvalidInput, match=problem):
        import_configuration(container.catalogue, schedule(parameters))
    with pytest.raises(InvalidInput, match=problem):
        container.catalogue.save_schedule(Schedule("S", robot.id, mission.id, datetime(2026, 11, 23, 6), "UTC", "FREQ=DAILY",
                                                   parameters=parameters))
    with pytest.raises(InvalidInput, match=problem):
        container.operator.run_now(robot.id, mission.id, parameters)
    assert (container.catalogue.schedules(), container.ledger.open_for(robot.id)) == ([], [])


def test_what_missions_need_is_taken(container):
    import_configuration(container.catalogue, schedule(ENOUGH))
    assert container.catalogue.schedules()[0].parameters == ENOUGH


def test_the_command_says_so_in_one_line(container, tmp_path):
    container.close()
    done = run(tmp_path / "data", "--run-now", "R", "M", "--parameter", f"x={'9' * 4000}")
    assert (done.returncode, is_one_line(done.stderr)) == (2, True)
