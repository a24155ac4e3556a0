"""``main.py --check-up`` as a real process, against a robot on a socket; its measurement is shortened from a minute to two questions."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from pathlib import Path

import pytest

import mir_sim
from app.container import Container
from app.domain.check_up import Report
from app.process.data_directory import DataDirectory
from mir_sim.profile import read
from tests.support.examples import at_night
from tests.support.process import ROOT, configuration_of, environment, is_one_line, once_now, prepared, wait_for

# Signals as at a terminal: these tests may run under nohup or in the background, where signals are ignored, and a process inherits that.
QUICK = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from app.mir import raw_client
from app.services.check_up import load_probes
load_probes.QUESTIONS, load_probes.LOAD_S = 2, 1.0
raw_client.EVERY = 0.05
import main
sys.argv[0] = "main.py"
sys.exit(main.main(sys.argv[1:]))
"""
WITHIN = 60.0


@contextmanager
def started(data: Path, *arguments: str, stdin: int = subprocess.DEVNULL) -> Iterator[subprocess.Popen[str]]:
    """The app with these arguments, until the block ends."""
    process = subprocess.Popen(
        [sys.executable, "-c", QUICK, "--data-dir", str(data), *arguments],
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        env=environment(),
        cwd=ROOT,
    )
    with process:
        try:
            yield process
        finally:
            process.kill()


def run(data: Path, *arguments: str, stdin: int = subprocess.DEVNULL) -> tuple[int, str, str]:
    with started(data, *arguments, stdin=stdin) as process:
        out, err = process.communicate(timeout=WITHIN)
    return process.returncode, out, err


@contextmanager
def ready(data: Path) -> Iterator[subprocess.Popen[str]]:
    """The app without a window."""
    with started(data, "--headless") as process:
        assert process.stdout.readline() == "ready\n"
        yield process


@contextmanager
def headless(data: Path) -> Iterator[None]:
    """The same, which ends well."""
    with ready(data) as process:
        yield
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=WITHIN)
        assert process.returncode == 0


@contextmanager
def in_a_trial(data: Path, robot: mir_sim.FleetRobot) -> Iterator[subprocess.Popen[str]]:
    """A check-up with a mission, when that is in the robot's queue."""
    with started(data, "--check-up", robot.name, "--with-mission", "--yes") as process:
        wait_for(lambda: len(queue(robot)) >= 2, within=WITHIN)
        yield process


@pytest.fixture
def fleet() -> Iterator[mir_sim.Fleet]:
    with mir_sim.serve(robots=1, profile=mir_sim.deviant("moves-descriptions")) as fleet:
        yield fleet


@pytest.fixture
def data(tmp_path, fleet) -> Path:
    prepared(tmp_path / "data", configuration_of(fleet))
    return tmp_path / "data"


@pytest.fixture
def robot(fleet) -> mir_sim.FleetRobot:
    return fleet.robots[0]


def queue(robot) -> list[str]:
    return [item["state"] for item in robot.state()["queue"]]


def missions(robot) -> int:
    return len(list(robot.model.site.table("/missions")))


def kept(data: Path) -> Report | None:
    with closing(Container.open(DataDirectory.prepare(data).path)) as container:
        return container.check_ups.report(container.catalogue.robots()[0].id)


def test_it_prints_the_report_keeps_it_and_writes_what_was_found(data, robot, tmp_path):
    file = tmp_path / "found.json"
    code, out, err = run(data, "--check-up", robot.name, "--report", str(file))
    assert (code, err) == (0, "")
    assert out.startswith(f"Check-up of {robot.name}\nMiR250, serial number ")
    assert "Only read: no mission was queued" in out
    assert queue(robot) == []
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["report"]["text"] == out
    assert read(file).search is True
    assert file.stat().st_mode & 0o777 == 0o600
    report = kept(data)
    assert [finding.topic for finding in report.findings] == [
        finding["topic"] for finding in found["report"]["findings"]
    ]


@pytest.mark.long
def test_to_stdout_the_file_comes_alone_so_that_a_program_can_read_it(data, robot):
    code, out, err = run(data, "--check-up", robot.name, "--report", "-")
    assert (code, err) == (0, "")
    assert json.loads(out)["report"]["robot"] == robot.name


@pytest.mark.long
def test_a_report_that_can_not_be_printed_is_kept_and_the_command_is_done(data, robot):
    with started(data, "--check-up", robot.name) as process:
        process.stdout.close()
        err = process.stderr.read()
        assert process.wait(WITHIN) == 0
    assert is_one_line(err, "done, but stdout can't be written: Broken pipe")
    assert kept(data) is not None


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    """Our side of it, and the command's."""
    ours, its = pty.openpty()
    yield ours, its
    os.close(ours)
    os.close(its)


@pytest.mark.parametrize("answer", ["\n", *at_night("n\n", "\x04")])  # the last one ends the input
def test_a_terminal_asks_before_anything_moves(data, robot, terminal, answer):
    ours, its = terminal
    os.write(ours, answer.encode())
    code, _out, err = run(data, "--check-up", robot.name, "--with-mission", stdin=its)
    assert code == 2
    assert f"{robot.name} gets a mission that waits a second" in err
    assert err.endswith("nothing was asked of the robot\n")
    assert queue(robot) == []


@pytest.mark.long
def test_interrupting_the_question_says_that_nothing_was_done(data, robot, terminal):
    with started(data, "--check-up", robot.name, "--with-mission", stdin=terminal[1]) as process:
        asked = process.stderr.readline() + process.stderr.read(len("Go on? [y/N] "))
        process.send_signal(signal.SIGINT)
        _out, err = process.communicate(timeout=WITHIN)
    assert asked.endswith("Go on? [y/N] ")
    assert (process.returncode, err) == (2, "\nmain.py: nothing was asked of the robot\n")
    assert queue(robot) == []


def test_a_trial_is_done(data, robot, tmp_path):
    before = missions(robot)
    file = tmp_path / "found.json"
    code, out, err = run(data, "--check-up", robot.name, "--with-mission", "--report", str(file))
    assert (code, err) == (0, "")
    assert "The app's mark comes back in the field order_description" in out
    assert queue(robot) == ["Done", "Done", "Aborted", "Done"]
    assert missions(robot) == before
    assert robot.state()["state_id"] == 3
    assert read(file).description_field == "order_description"


@pytest.mark.long
def test_a_running_app_does_the_check_up_and_continues(data, robot):
    with headless(data):
        code, out, err = run(data, "--check-up", robot.name, "--with-mission", "Home", "--yes")
        assert (code, err) == (0, "")
        assert "Tried with the mission Home" in out
        assert queue(robot) == ["Done", "Done", "Aborted", "Done"]
    assert kept(data).mission == "Home"


def test_a_start_of_the_plan_goes_first(tmp_path, fleet, robot):
    data = tmp_path / "data"
    prepared(data, configuration_of(fleet, schedules=[once_now(robot.name, "Deliver", "Morning")]))
    code, out, err = run(data, "--check-up", robot.name, "--with-mission", "--yes")
    assert (code, out) == (2, "")
    assert is_one_line(err, "Morning is planned at")
    assert queue(robot) == []


@pytest.mark.long
def test_wrong_arguments_are_reported_in_one_line(data, fleet, robot):
    for arguments, words in (
        (("--check-up", "Nobody"), f"there is no robot 'Nobody'; known: {robot.name}"),
        (("--check-up", robot.name, "--with-mission", "Dance", "--yes"), "the robot has no mission Dance"),
        (("--check-up", robot.name, "--report", "/nowhere/found.json"), "/nowhere/found.json can't be written"),
        (("--check-up", ""), "--check-up needs the name of a robot"),
        (("--with-mission",), "--with-mission and --report belong to --check-up ROBOT"),
        (("--check-up", robot.name, "--yes"), "--yes belongs to"),
        (("--check-up", robot.name, "--headless"), "can't be combined"),
    ):
        code, out, err = run(data, *arguments)
        assert (code, out) == (2, ""), arguments
        assert is_one_line(err, words)
    fleet.stop()
    code, out, err = run(data, "--check-up", robot.name)
    assert code == 1
    assert is_one_line(err, f"the check-up of {robot.name} is not complete: It could not be asked")
    assert "Problem" in out
    assert kept(data) is None


@pytest.mark.long
def test_killed_in_the_middle_the_app_undoes_everything_when_it_starts(data, robot):
    before = missions(robot)
    with in_a_trial(data, robot):
        pass
    assert missions(robot) == before + 1
    assert robot.state()["state_id"] == 4
    with headless(data):
        wait_for(lambda: missions(robot) == before and robot.state()["state_id"] == 3, within=WITHIN)
        assert set(queue(robot)) == {"Aborted"}


@pytest.mark.long
def test_when_the_app_is_killed_it_gives_up_so_that_the_app_can_start_again(data, robot):
    before = missions(robot)
    with ready(data) as app, in_a_trial(data, robot) as process:
        app.kill()
        out, err = process.communicate(timeout=WITHIN)
    assert (process.returncode, out) == (1, "")
    assert is_one_line(err, "ended before it answered; give the command again")
    with headless(data):
        wait_for(lambda: missions(robot) == before and robot.state()["state_id"] == 3, within=WITHIN)


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("app_runs", [False, True])
def test_interrupting_it_or_closing_its_terminal_leaves_nothing(data, robot, number, app_runs):
    before = missions(robot)
    with headless(data) if app_runs else nullcontext():
        with in_a_trial(data, robot) as process:
            process.send_signal(number)
            out, err = process.communicate(timeout=WITHIN)
        assert (process.returncode, out) == (1, "")
        assert is_one_line(err)
        assert (missions(robot), robot.state()["state_id"]) == (before, 3), "it ends when the robot has been put back"
        assert set(queue(robot)) <= {"Aborted", "Done"}
        assert not (data / "inbox").exists() or not list((data / "inbox").iterdir())
        assert "interrupted; nothing is left on the robot" in err
    assert kept(data) is None


@pytest.mark.long
def test_what_could_not_be_restored_is_reported_at_the_end(data, robot):
    with headless(data):
        with in_a_trial(data, robot) as process:
            robot.control({"fault": {"kind": "drop_request", "path": "*", "count": None}})
            process.send_signal(signal.SIGTERM)
            out, err = process.communicate(timeout=WITHIN)
        robot.control({"fault": None})
        assert (process.returncode, out) == (1, "")
        assert is_one_line(err, "interrupted; Its state is not the same as before: ")
