"""Where what the app says can't be shown: what was done stays done, and what is planned is started, on real processes."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import mir_sim
from tests.support.examples import at_night
from tests.support.process import (
    PATIENCE,
    ROOT,
    command,
    configuration_of,
    environment,
    import_configuration,
    is_one_line,
    once_now,
    prepared,
    run,
    wait_for,
    write_configuration,
)

ENDS_WITHIN = 15.0  # s after SIGTERM, on a busy machine
XOFF, XON = b"\x13", b"\x11"  # Ctrl-S, Ctrl-Q


@pytest.fixture
def robot(fleet) -> mir_sim.FleetRobot:
    return fleet.robots[0]


@pytest.fixture
def site(tmp_path, fleet, robot) -> Path:
    """The robot is in a group, and no old code page has the letters of its name."""
    configuration = configuration_of(fleet, poll_interval_seconds=1)
    configuration["robots"][0]["name"] = "Łaźnia 東"
    prepared(tmp_path / "data", configuration | {"groups": [{"name": "Hall", "robots": ["Łaźnia 東"]}]})
    return tmp_path / "data"


def started(robot) -> int:
    return len(robot.state()["queue"])


# ---------------------------------------------------------------------- commands
def in_shell(script: str, arguments: list[str], **environ: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-c", script, "bash", *arguments],
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=PATIENCE * 3,
        env=environment() | environ,
        cwd=ROOT,
        check=False,
    )


@pytest.mark.parametrize("stdout", ["> /dev/full", *at_night(">&-", "| true", "> /dev/full 2>&1", ">&- 2>&-")])
def test_a_mission_is_started_once_and_the_command_is_done_whatever_takes_its_answer(site, robot, stdout):
    done = in_shell(f'set -o pipefail; "$@" {stdout}', command(site, "--run-now", "Hall", "Home"))
    assert (done.returncode, done.stdout, started(robot)) == (0, "", 1)
    assert done.stderr == "" or (is_one_line(done.stderr) and "done, but stdout can't be written" in done.stderr)


@pytest.mark.long
@pytest.mark.parametrize("encoding", ["cp1252", "iso8859-1", "ascii:strict"])
def test_the_answer_is_utf_8_in_any_locale(site, robot, encoding):
    done = in_shell('"$@"', command(site, "--run-now", "Hall", "Home"), PYTHONIOENCODING=encoding)
    assert (done.returncode, done.stderr, started(robot)) == (0, "", 1)
    assert done.stdout.startswith("Łaźnia 東 ")
    refused = in_shell('"$@"', command(site, "--run-now", "東", "Home"), PYTHONIOENCODING=encoding)
    assert refused.returncode == 2
    assert "no robot '東'; known: Łaźnia 東" in refused.stderr


@pytest.mark.long
def test_other_commands_that_act_are_done_too(site):
    path = write_configuration(site.with_name("more.json"), {"places": [{"name": "Dock", "most": 2}]})
    for arguments in (("--import-config", path), ("--remove-pin",), ("--move-here",)):
        done = in_shell('"$@" > /dev/full', command(site, *arguments))
        assert (done.returncode, is_one_line(done.stderr)) == (0, True), arguments
    assert "Dock" in run(site, "--export-config", "-").stdout
    assert "stdout can't be written" in (site / "logs" / "amr-scheduler.log").read_text(encoding="utf-8")


# ---------------------------------------------------------------------- headless
def headless(site: Path, script: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        ["bash", "-c", script, "bash", *command(site, "--headless")],
        stdin=subprocess.DEVNULL,
        env=environment(),
        cwd=ROOT,
    )


@pytest.mark.parametrize(
    "output", [">&- 2>&-", *at_night("", ">&-", "> /dev/full 2> /dev/full", "> >(true) 2> >(true)")]
)
def test_whatever_takes_ready_it_schedules(site, robot, output):
    app = headless(site, f'exec "$@" {output}')
    try:
        check_it_schedules(site, robot)
        app.send_signal(signal.SIGTERM)
        assert app.wait(PATIENCE) == 0
    finally:
        app.kill()
        app.wait()


def check_it_schedules(site: Path, robot) -> None:
    wait_for(lambda: "schedules on" in logged(site), what="the app to run")
    import_configuration(site, {"schedules": [once_now("Łaźnia 東", "Home", "Now")]})
    wait_for(lambda: started(robot) == 1, what="the robot to get its start")


def check_it_ends(app: subprocess.Popen[bytes]) -> None:
    app.send_signal(signal.SIGTERM)
    assert app.wait(ENDS_WITHIN) == 0


def logged(site: Path) -> str:
    path = site / "logs" / "amr-scheduler.log"
    return path.read_text(encoding="utf-8") if path.exists() else ""


@contextmanager
def on_a_terminal(site: Path) -> Iterator[tuple[subprocess.Popen[bytes], int, list[bytes]]]:
    """Headless on a terminal, with the terminal's other end and what came out of it."""
    ours, terminal = pty.openpty()
    app = subprocess.Popen(
        command(site, "--headless"),
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
        env=environment(),
        cwd=ROOT,
        start_new_session=True,
    )
    os.close(terminal)
    said: list[bytes] = []
    reader = threading.Thread(target=_read, args=(ours, said), daemon=True)
    reader.start()
    try:
        yield app, ours, said
    finally:
        app.kill()
        app.wait()
        reader.join(PATIENCE)
        os.close(ours)


def _read(descriptor: int, said: list[bytes]) -> None:
    while True:
        try:
            said.append(os.read(descriptor, 4096))
        except OSError:  # the app has ended
            return


@pytest.mark.long
@pytest.mark.parametrize("stopped", ["while it runs", "before it begins"])
def test_a_blocked_terminal_delays_no_start_and_no_end(site, robot, stopped):
    with on_a_terminal(site) as (app, terminal, said):
        if stopped == "while it runs":
            wait_for(lambda: b"ready" in b"".join(said), what="ready")
        os.write(terminal, XOFF)
        check_it_schedules(site, robot)
        assert b"Now added" not in b"".join(said)
        check_it_ends(app)


@pytest.mark.long
def test_lines_that_a_terminal_missed_come_when_it_continues(site, robot):
    with on_a_terminal(site) as (app, terminal, said):
        wait_for(lambda: b"ready" in b"".join(said), what="ready")
        os.write(terminal, XOFF)
        check_it_schedules(site, robot)
        os.write(terminal, XON)
        wait_for(lambda: b"Home" in b"".join(said), what="the line about it")
        check_it_ends(app)


@pytest.mark.long
def test_a_log_file_on_a_disk_that_hangs_delays_nothing(site, robot):
    """A pipe that is full stands for it."""
    logs = site / "logs"
    logs.mkdir(mode=0o700, exist_ok=True)
    os.mkfifo(logs / "amr-scheduler.log", 0o600)
    descriptor = os.open(logs / "amr-scheduler.log", os.O_RDWR | os.O_NONBLOCK)
    while True:
        try:
            os.write(descriptor, b"x" * 4096)
        except BlockingIOError:
            break
    app = subprocess.Popen(
        command(site, "--headless"), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment(), cwd=ROOT
    )
    try:
        assert app.stdout.readline() == b"ready\n"
        import_configuration(site, {"schedules": [once_now("Łaźnia 東", "Home", "Now")]})
        wait_for(lambda: started(robot) == 1, what="the robot to get its start")
        check_it_ends(app)
    finally:
        app.kill()
        app.communicate()
        os.close(descriptor)
