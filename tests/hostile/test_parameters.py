"""Parameters of missions without end: each run keeps a copy of them."""

from __future__ import annotations

from contextlib import nullcontext
from datetime import datetime

import pytest

from app.domain.models import InvalidInput, Mission, Robot, Schedule
from app.mir.errors import Unreadable
from app.mir.parameters import MOST_PARAMETERS, from_actions, from_definition
from tests.support.edits import import_file
from tests.support.process import is_one_line, run

ENDLESS = {
    "a long text": ({"x": "y" * 1001}, "the value of 'x' has at most 1000 characters"),
    "very many": ({f"p{number}": 1 for number in range(51)}, "a mission can be given 50 parameters at most"),
    "a long name": ({"x" * 81: 1}, "the name of a parameter has 1 to 80 characters"),
    "many digits": ({"x": 10**4000}, "the value of 'x' is too large a number"),
    "many digits below zero": ({"x": -(10**4000)}, "the value of 'x' is too large a number"),
}
ENOUGH = {**{f"p{number}": "y" * 1000 for number in range(48)}, "a": 2**63 - 1, "b": -1.5e300}


@pytest.fixture
def container(container):
    container.catalogue.save_mission(Mission("M", "guid-1"))
    container.catalogue.save_robot(Robot("R", "http://127.0.0.1:9", "distributor"), "secret")
    return container


def take(container, parameters: object) -> None:
    schedule = {"name": "S", "robot": "R", "mission": "M", "start": "2026-11-23T06:30", "parameters": parameters}
    import_file(container.catalogue, schedules=[schedule])


@pytest.mark.parametrize(("parameters", "problem"), ENDLESS.values(), ids=ENDLESS.keys())
def test_they_are_refused_in_a_file_in_a_schedule_and_for_one_run(container, parameters, problem):
    robot, mission = container.catalogue.robots()[0], container.catalogue.missions()[0]
    with pytest.raises(InvalidInput, match=problem):
        take(container, parameters)
    with pytest.raises(InvalidInput, match=problem):
        container.catalogue.save_schedule(
            Schedule("S", robot.id, mission.id, datetime(2026, 11, 23, 6), "UTC", "FREQ=DAILY", parameters=parameters)
        )
    with pytest.raises(InvalidInput, match=problem):
        container.operator.run_now(robot.id, mission.id, parameters)
    assert (container.catalogue.schedules(), container.ledger.open_for(robot.id)) == ([], [])


def test_ordinary_parameters_are_accepted(container):
    take(container, ENOUGH)
    assert container.catalogue.schedules()[0].parameters == ENOUGH


@pytest.mark.parametrize("count", [MOST_PARAMETERS, MOST_PARAMETERS + 1, 1000])
def test_a_robot_that_asks_for_more_has_no_fields_made_for_them(count):
    """A thousand of them held the window for seconds as soon as the mission was chosen."""
    asked = [{"id": f"p{number}", "input_name": f"p{number}"} for number in range(count)]
    for read, answer in ((from_definition, {"parameters": asked}), (from_actions, [{"parameters": asked}])):
        refused = pytest.raises(Unreadable, match="the list of parameters has more than 50 entries")
        with nullcontext() if count <= MOST_PARAMETERS else refused:
            assert len(read(answer)) == count


def test_the_command_says_so_in_one_line(container, tmp_path):
    container.close()
    done = run(tmp_path, "--run-now", "R", "M", "--parameter", f"x={'9' * 4000}")
    assert (done.returncode, is_one_line(done.stderr)) == (2, True)
