"""What ``--run-now`` says on stderr while its mission waits, in any process."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys

import pytest

import mir_sim
from app.failures import Failure
from app.process import run_now_command
from app.process.data_directory import DataDirectory
from mir_sim.fleets import KINDS
from mir_sim.fleets.enterprise_orders import API_KEYS
from tests.support import targets
from tests.support.process import PATIENCE, ROOT, configuration_of, environment, prepared, running, wait_for


@pytest.fixture(autouse=True)
def often(monkeypatch):
    monkeypatch.setattr(run_now_command, "REPORT_EVERY", 0.5)


def silent(configuration):
    """With a robot at an address where nothing answers, that is given up at the fourth attempt."""
    configuration["robots"][0]["address"] = "http://127.0.0.1:9"
    configuration["settings"] = {"retry_limit": 3}
    return configuration


def run(directory, configuration):
    robot, mission = configuration["robots"][0]["name"], configuration["missions"][0]["name"]
    run_now_command.run(DataDirectory(directory), robot, mission, [])


def test_it_says_that_the_robot_is_silent(tmp_path, fleet, capsys):
    configuration = silent(configuration_of(fleet))
    prepared(tmp_path / "data", configuration)
    with pytest.raises(Failure, match="was not started"):
        run(tmp_path / "data", configuration)
    said = capsys.readouterr()
    assert "127.0.0.1:9 refused the connection" in said.err
    assert all(line.startswith("main.py: ") for line in said.err.splitlines())
    assert said.out == ""


@pytest.mark.long
def test_during_a_running_app_too(tmp_path, fleet, capsys):
    configuration = silent(configuration_of(fleet))
    prepared(tmp_path / "data", configuration)
    with running(tmp_path / "data"), pytest.raises(Failure, match="was not started"):
        run(tmp_path / "data", configuration)
    assert "127.0.0.1:9 refused the connection" in capsys.readouterr().err


def test_what_is_taken_at_once_waits_for_nothing(tmp_path, fleet, capsys):
    configuration = configuration_of(fleet)
    prepared(tmp_path / "data", configuration)
    run(tmp_path / "data", configuration)
    said = capsys.readouterr()
    assert (said.out.strip().isdecimal(), said.err) == (True, "")


NOTES_THAT_IT_WAITS = """
import sys, pathlib, main
from app.process import run_now_command
say, noted = run_now_command.print_error, pathlib.Path(sys.argv.pop())
run_now_command.print_error, run_now_command.REPORT_EVERY = lambda text: (noted.touch(), say(text)), 0.2
sys.exit(main.main(sys.argv[1:]))"""


def test_a_blocked_stderr_delays_nothing(tmp_path):
    """Nor the end of the process, when the mission has been taken."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    configuration = configuration_of()
    configuration["robots"] = [
        {"name": "R1", "address": f"http://127.0.0.1:{port}", "username": "distributor", "password": "distributor"}
    ]
    prepared(tmp_path / "data", configuration)
    reader, full = os.pipe()
    os.set_blocking(full, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(full, b"x" * 4096)
    os.set_blocking(full, True)
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            NOTES_THAT_IT_WAITS,
            "--data-dir",
            tmp_path / "data",
            "--run-now",
            "R1",
            "Home",
            tmp_path / "waits",
        ],
        stdout=subprocess.PIPE,
        stderr=full,
        cwd=ROOT,
        env=environment(),
        text=True,
    )
    try:
        wait_for((tmp_path / "waits").exists)
        with mir_sim.serve(robots=1, port=port):
            said, _nothing = process.communicate(timeout=PATIENCE * 2)
        assert process.returncode == 0
        assert said.strip().isdecimal()
    finally:
        process.kill()
        os.close(reader)
        os.close(full)


@pytest.mark.parametrize("kind", KINDS)
def test_a_fleet_that_was_never_asked_who_it_is_gets_it(kind, tmp_path, capsys):
    with mir_sim.serve(robots=1, fleet=kind) as served:
        targets.give_identity(served.above.model, "distributor")
        configuration = configuration_of()
        access = {"username": "distributor", "password": "distributor"}
        if kind == "enterprise":
            access = {"password": next(iter(API_KEYS))}
        configuration["fleets"] = [{"name": "Hall", "address": served.above.url, "kind": kind, **access}]
        configuration["robots"] = [{"name": "R1", "fleet": "Hall", "vehicle": "any"}]
        prepared(tmp_path / "data", configuration)
        run(tmp_path / "data", configuration)
    assert capsys.readouterr().out.strip().isdecimal()
