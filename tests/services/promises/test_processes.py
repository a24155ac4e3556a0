"""What only the real threads and processes show: damage while running, chores and robots that fail, ready, commands at one instant."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import mir_sim
from app.container import Container
from app.domain.models import Connection, Robot
from app.process.data_directory import DataDirectory
from app.process.host import host
from app.services.catalogue import configuration
from tests.support.process import (
    PATIENCE,
    ROOT,
    begun,
    configuration_of,
    environment,
    once_now,
    prepared,
    run,
    running,
    wait_for,
    write_configuration,
)


@pytest.fixture
def fleet() -> Iterator[mir_sim.Fleet]:
    with mir_sim.serve(robots=2) as fleet:
        yield fleet


@pytest.fixture
def data(tmp_path, fleet) -> Path:
    """A data directory that knows both robots, and polls them every second."""
    directory = DataDirectory.prepare(tmp_path / "data")
    container = Container.open(directory.path)
    container.catalogue.change_settings(poll_interval_seconds=1)
    for robot in fleet.robots:
        container.catalogue.save_robot(Robot(robot.name, robot.url, "distributor"), password="distributor")
    container.close()
    return directory.path


def alarms(container) -> list[str]:
    """The open ones; none as long as they can't be read."""
    with contextlib.suppress(Exception):
        return [alarm.code for alarm in container.alarms.open()]
    return []


def is_read_again(container, robot_id: int) -> bool:
    """Whether the robot is still polled."""
    for _ in range(3):
        seen = container.snapshots.get(robot_id).read_at
        wait_for(lambda seen=seen: container.snapshots.get(robot_id).read_at != seen, what="the robot to be polled")
    return True


# ---------------------------------------------------------------------- damage while it runs
def damage(directory: Path) -> None:
    """The storage returns nonsense from now on."""
    for path in directory.glob("amr-scheduler.db*"):
        if not path.name.endswith("-shm"):
            with open(path, "r+b") as file:
                file.write(b"\x55" * path.stat().st_size)


def delete(directory: Path) -> None:
    """Somebody deletes the file: everything the app writes from now on would be lost when it ends."""
    (directory / "amr-scheduler.db").unlink()


def due_now(directory: Path, fleet: mir_sim.Fleet) -> Path:
    """A configuration with a start that is due this minute: it makes the app read and write."""
    content = configuration_of(fleet, schedules=[once_now(fleet.robots[0].name, "Home", "Now")])
    return write_configuration(directory.with_name("due.json"), content)


@pytest.mark.parametrize("harm", [pytest.param(damage, marks=pytest.mark.long), delete])
def test_headless_ends_when_its_database_is_damaged_and_names_the_backup(data, fleet, harm):
    """Exit 2 with the one line that a damaged database has at the start; nothing is sent, no error is met again and again."""
    with running(data) as app:
        backup = wait_for(lambda: next((data / "backups").glob("*.db"), None), what="the daily backup")
        harm(data)
        importing = begun(data, "--import-config", due_now(data, fleet))
        try:
            assert app.process.wait(PATIENCE) == 2
        finally:
            importing.kill()
            importing.communicate()
        assert (
            len([line for line in app.stderr if f"--restore-backup {backup}" in line and line.startswith("main.py: ")])
            == 1
        )
        assert not app.said("unexpected error")
        assert [robot.state()["queue"] for robot in fleet.robots] == [[], []]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_with_a_window_a_damaged_database_is_an_alarm(data, fleet):
    """It is shown from memory, and nothing is sent."""
    content = due_now(data, fleet).read_bytes()
    with host(DataDirectory(data), with_window=True) as container:
        wait_for(lambda: container.snapshots.get(1).read_at, what="the first poll")
        damage(data)
        with contextlib.suppress(Exception):
            configuration.import_configuration(container.catalogue, content)
        wait_for(lambda: "database" in alarms(container), what="the alarm")
        assert [robot.state()["queue"] for robot in fleet.robots] == [[], []]


# ---------------------------------------------------------------------- each by itself
def test_a_chore_that_fails_stops_no_polling_and_is_reported_and_tried_again(data):
    """Somebody deletes the directory for requests: robots are polled on, and when it is there again commands are served."""
    with host(DataDirectory(data)) as container:
        wait_for(lambda: container.snapshots.get(1).read_at, what="the first poll")
        shutil.rmtree(data / "inbox")
        assert is_read_again(container, 1)
        wait_for(lambda: alarms(container), what="an alarm")
        done = run(data, "--remove-pin", timeout=PATIENCE)
        assert (done.returncode, done.stdout) == (0, "there was no PIN for Settings\n")


def test_a_robot_that_can_t_be_made_delays_no_other_and_is_reported_and_tried_again(data, fleet):
    """One robot's address makes no sense, as after a damage or with another version: the others work, and it does once it is mended."""
    container = Container.open(data)
    first, second = container.catalogue.robots()
    container.db.write(lambda c: c.execute("UPDATE robots SET address = 'http://[' WHERE id = ?", (first.id,)))
    container.close()
    with host(DataDirectory(data)) as container:
        wait_for(lambda: container.snapshots.get(second.id).connection is Connection.CONNECTED, what="the other robot")
        wait_for(lambda: alarms(container), what="an alarm")
        container.catalogue.save_robot(replace(first, token=None), password="distributor")
        wait_for(lambda: container.snapshots.get(first.id).connection is Connection.CONNECTED, what="the mended robot")


# ---------------------------------------------------------------------- ready
def test_ready_is_said_after_the_first_poll_and_not_before(data, fleet):
    """The robots' first answers are waited for, up to 5 s."""
    fleet.robots[0].control({"fault": {"kind": "delay", "path": "/status", "seconds": 2.5}})
    began = time.monotonic()
    with running(data):
        assert time.monotonic() - began >= 2.5


def test_ready_does_not_wait_for_a_robot_that_can_t_be_made(data, fleet):
    """The others have answered, and that one never will."""
    container = Container.open(data)
    container.db.write(lambda c: c.execute("UPDATE robots SET address = 'http://[' WHERE id = 1"))
    container.close()
    with host(DataDirectory(data)) as container:
        wait_for(lambda: container.engine.is_ready, what="the other robot's first answer")
        assert container.snapshots.get(2).read_at is not None


# ---------------------------------------------------------------------- two commands
def started_with_little_patience(data: Path, *arguments: object) -> subprocess.Popen[str]:
    """A command that waits a second instead of two minutes for the process that holds the data directory."""
    program = (
        "import sys; from app.process import commands; commands.CHANGED_WITHIN = 1.0; import main; sys.argv[0] = 'main.py'; "
        "sys.exit(main.main(sys.argv[1:]))"
    )
    return subprocess.Popen(
        [sys.executable, "-c", program, "--data-dir", str(data), *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        env=environment(),
        cwd=ROOT,
    )


@pytest.mark.long
def test_a_change_that_meets_another_command_takes_over_when_that_one_has_ended(data, fleet):
    """The app waits for a silent command and then makes the change: never "may have been done or not"."""
    content = configuration_of(fleet)
    prepared(data, content)
    fleet.robots[0].control({"fault": {"kind": "hang", "count": None}})
    first = begun(data, "--run-now", fleet.robots[0].name, "Home")
    lock = data / "scheduler.lock"
    wait_for(lambda: lock.exists() and lock.read_text(encoding="utf-8"), what="the first command to begin")
    later = started_with_little_patience(
        data,
        "--import-config",
        write_configuration(data.with_name("later.json"), content | {"settings": {"retry_limit": 7}}),
    )
    try:
        with contextlib.suppress(subprocess.TimeoutExpired):
            later.wait(3.0)
        fleet.robots[0].control({"fault": None})
        said, problem = later.communicate(timeout=PATIENCE)
        assert (later.returncode, problem) == (0, "")
        assert said == "Retries when a robot can't be reached: 10 → 7\n"
        assert first.wait(PATIENCE) == 0
        assert len(fleet.robots[0].state()["queue"]) == 1
    finally:
        for process in (first, later):
            process.kill()
            process.communicate()


def test_a_command_starts_its_mission_despite_the_robots_clock(fleet, data):
    """No round judges the clock here, so that waiting for one would be for nothing."""
    prepared(data, configuration_of(fleet))
    fleet.robots[0].model.clock.offset = -86400.0
    done = run(data, "--run-now", fleet.robots[0].name, "Home", timeout=PATIENCE)
    assert (done.returncode, done.stderr) == (0, "")
