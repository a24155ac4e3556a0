"""Parameters that a mission does not take, in commands as real processes, with and without a running app."""

from __future__ import annotations

from contextlib import nullcontext

import pytest

from tests.support.process import configuration_of, is_one_line, once_now, prepared, run, running, write_configuration

UNKNOWN = "Go to position has no parameter Speed; it takes Position"


@pytest.mark.parametrize("beside", [running, lambda _directory: nullcontext()], ids=["beside an app", "alone"])
def test_they_are_refused_at_once_and_nothing_is_sent(tmp_path, fleet, beside):
    configuration, data = configuration_of(fleet), tmp_path / "data"
    robot = configuration["robots"][0]["name"]
    wrong = once_now(robot, "Go to position", "S", parameters={"Speed": 1})
    file = write_configuration(tmp_path / "file.json", configuration | {"schedules": [wrong]})
    prepared(data, configuration)
    with beside(data):
        started = run(data, "--run-now", robot, "Go to position", "--parameter", "Speed=1")
        imported = run(data, "--import-config", file)
    for done in (started, imported):
        assert (done.returncode, UNKNOWN in done.stderr, is_one_line(done.stderr)) == (2, True, True), done.stderr
    assert fleet.robots[0].state()["queue"] == []


@pytest.mark.long
def test_an_empty_directory_takes_no_file_with_them_either(tmp_path, fleet):
    configuration = configuration_of(fleet)
    wrong = once_now(
        configuration["robots"][0]["name"], "Go to position", "S", parameters={"Position": "Nowhere at all"}
    )
    done = run(
        tmp_path / "data",
        "--import-config",
        write_configuration(tmp_path / "file.json", configuration | {"schedules": [wrong]}),
    )
    assert done.returncode == 2
    assert "Go to position can't take Nowhere at all for Position: Choose one of" in done.stderr


def test_a_position_may_be_given_by_its_name(tmp_path, fleet):
    configuration, data = configuration_of(fleet), tmp_path / "data"
    prepared(data, configuration)
    done = run(
        data, "--run-now", configuration["robots"][0]["name"], "Go to position", "--parameter", "Position=Line 1"
    )
    (item,) = fleet.robots[0].state()["queue"]
    assert (done.returncode, done.stdout.strip(), len(item["parameters"][0]["value"])) == (0, str(item["id"]), 36)
