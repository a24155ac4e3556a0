"""Parameters that a mission does not take, in commands as real processes, with and without a running app."""

from __future__ import annotations

from contextlib import nullcontext

import pytest

from tests.support.examples import at_night
from tests.support.process import answer, configuration_of, once_now, prepared, refusal, running, write_configuration

UNKNOWN = "Go to position has no parameter Speed, it takes Position"


@pytest.mark.parametrize("app", [running, *at_night(lambda _directory: nullcontext())], ids=["with an app", "alone"])
def test_they_are_refused_at_once_and_nothing_is_sent(tmp_path, fleet, app):
    configuration, data = configuration_of(fleet), tmp_path / "data"
    robot = configuration["robots"][0]["name"]
    wrong = once_now(robot, "Go to position", "S", parameters={"Speed": 1})
    file = write_configuration(tmp_path / "file.json", configuration | {"schedules": [wrong]})
    prepared(data, configuration)
    with app(data):
        assert UNKNOWN in refusal(data, "--run-now", robot, "Go to position", "--parameter", "Speed=1")
        assert UNKNOWN in refusal(data, "--import-config", file)
    assert fleet.robots[0].state()["queue"] == []


@pytest.mark.long
def test_an_empty_directory_takes_no_file_with_them_either(tmp_path, fleet):
    configuration = configuration_of(fleet)
    wrong = once_now(
        configuration["robots"][0]["name"], "Go to position", "S", parameters={"Position": "Nowhere at all"}
    )
    file = write_configuration(tmp_path / "file.json", configuration | {"schedules": [wrong]})
    problem = refusal(tmp_path / "data", "--import-config", file)
    assert "Go to position can't take Nowhere at all for Position: Choose one of" in problem


def test_a_position_may_be_given_by_its_name(tmp_path, fleet):
    configuration, data = configuration_of(fleet), tmp_path / "data"
    prepared(data, configuration)
    robot = configuration["robots"][0]["name"]
    printed = answer(data, "--run-now", robot, "Go to position", "--parameter", "Position=Line 1")
    (item,) = fleet.robots[0].state()["queue"]
    assert (printed.strip(), len(item["parameters"][0]["value"])) == (str(item["id"]), 36)
