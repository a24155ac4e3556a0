"""What ``--run-now`` says on stderr while its mission waits, whichever process carries it out."""
from __future__ import annotations

import threading
import time

import pytest

import mir_sim
from app.failures import Failure
from app.process import commands, waiting
from app.process.data_directory import DataDirectory
from tests.support.process import PATIENCE, configuration_of, prepared, running


@pytest.fixture
def fleet():
    with mir_sim.serve(robots=1) as fleet:
        yield fleet


@pytest.fixture(autouse=True)
def often(monkeypatch):
    monkeypatch.setattr(waiting, "SAID_EVERY", 0.5)


def silent(configuration):
    """With a robot at an address where nothing answers, that is given up at the fourth attempt."""
    configuration["robots"][0]["address"] = "http://127.0.0.1:9"
    configuration["settings"] = {"retry_limit": 3}
    return configuration


def run(directory, configuration):
    robot, mission = configuration["robots"][0]["name"], configuration["missions"][0]["name"]
    commands._run_now(DataDirectory(directory), robot, mission, [])


def test_it_says_that_the_robot_is_silent(tmp_path, fleet, capsys):
    configuration = silent(configuration_of(fleet))
    prepared(tmp_path / "data", configuration)
    with pytest.raises(Failure, match="was not started"):
        run(tmp_path / "data", configuration)
    said = capsys.readouterr()
    assert "failed: 127.0.0.1:9 refused the connection" in said.err
    assert all(line.startswith("main.py: ") for line in said.err.splitlines())
    assert said.out == ""


def test_beside_a_running_app_too(tmp_path, fleet, capsys):
    configuration = silent(configuration_of(fleet))
    prepared(tmp_path / "data", configuration)
    with running(tmp_path / "data"), pytest.raises(Failure, match="was not started"):
        run(tmp_path / "data", configuration)
    assert "failed: 127.0.0.1:9 refused the connection" in capsys.readouterr().err


def test_what_is_taken_at_once_waits_for_nothing(tmp_path, fleet, capsys):
    configuration = configuration_of(fleet)
    prepared(tmp_path / "data", configuration)
    run(tmp_path / "data", configuration)
    said = capsys.readouterr()
    assert (said.out.strip().isdecimal(), said.err) == (True, "")


def test_a_stderr_that_stands_still_holds_up_nothing(tmp_path, fleet, monkeypatch, capsys):
    configuration = silent(configuration_of(fleet))
    prepared(tmp_path / "data", configuration)
    stands = threading.Event()
    monkeypatch.setattr(waiting, "complain", lambda _text: stands.wait(PATIENCE * 3))
    began = time.monotonic()
    with pytest.raises(Failure):
        run(tmp_path / "data", configuration)
    stands.set()
    assert time.monotonic() - began < PATIENCE * 2
