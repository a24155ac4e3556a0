"""What the app says of its own process: a lock that protects no more, and fewer open files than its robots need."""

from __future__ import annotations

import resource
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.database.connection import Database, DatabaseUnavailable
from app.process.data_directory import InstanceLock
from app.process.host import too_few_files
from tests.support.examples import at_night
from tests.support.process import PATIENCE, ROOT, command, configuration_of, environment, prepared, running, wait_for

LOG = Path("logs", "amr-scheduler.log")


# ---------------------------------------------------------------------- the lock
def test_a_lock_is_in_place_as_long_as_its_file_is_the_one_in_the_directory(tmp_path):
    lock = InstanceLock(tmp_path)
    assert not lock.is_in_place
    lock.acquire()
    assert lock.is_in_place
    lock.path.unlink()
    assert not lock.is_in_place
    other = InstanceLock(tmp_path)
    other.acquire()
    assert (lock.is_in_place, other.is_in_place) == (False, True)
    other.release()
    lock.release()


@pytest.mark.parametrize("is_replaced", [True, *at_night(False)])
def test_a_lock_file_that_was_deleted_is_an_alarm_with_and_without_a_second_app(tmp_path, is_replaced):
    data = tmp_path / "data"
    with running(data) as first:
        (data / "scheduler.lock").unlink()
        if is_replaced:
            with running(data) as second:
                wait_for(lambda: first.said("another app could start missions of the same data"), what="the alarm")
                assert not second.said("Traceback")
        wait_for(lambda: first.said("another app could start missions of the same data"), what="the alarm")


# ---------------------------------------------------------------------- open files
@pytest.mark.parametrize(
    ("robots", "allowed", "is_enough"), [(300, 1024, True), (400, 1024, False), (500, 4096, True), (500, None, True)]
)
def test_each_robot_needs_three_open_files(robots, allowed, is_enough):
    assert (too_few_files(robots, allowed) is None) == is_enough


@contextmanager
def limited(data: Path, ulimit: str) -> Iterator[subprocess.Popen[str]]:
    """Headless with twenty robots that don't answer, after this command of the shell."""
    configuration = configuration_of()
    configuration["robots"] = [
        {"name": f"R{n}", "address": f"127.0.0.1:{n}", "username": "u", "password": "p"} for n in range(1, 21)
    ]
    prepared(data, configuration)
    with subprocess.Popen(
        ["sh", "-c", f'{ulimit}; exec "$@"', "sh", *command(data, "--headless")],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=environment(),
        cwd=ROOT,
    ) as app:
        try:
            assert app.stdout.readline() == "ready\n"
            yield app
            app.send_signal(signal.SIGTERM)
            assert app.wait(PATIENCE) == 0
        finally:
            app.kill()


@pytest.mark.long
def test_it_takes_as_many_open_files_as_the_system_lets_it_have(tmp_path):
    with limited(tmp_path / "data", "ulimit -Sn 40; ulimit -Hn 400") as app:
        (line,) = (
            line
            for line in Path(f"/proc/{app.pid}/limits").read_text().splitlines()
            if line.startswith("Max open files")
        )
        assert line.split()[3:5] == ["400", "400"]
        assert "open files" not in (tmp_path / "data" / LOG).read_text()


@pytest.mark.long
def test_where_that_is_too_few_an_alarm_says_so(tmp_path):
    with limited(tmp_path / "data", "ulimit -n 140"):
        wait_for(
            lambda: (
                "alarm: 20 robots need about 160 open files and connections, and the system allows 140: starts may not be sent"
                in (tmp_path / "data" / LOG).read_text()
            ),
            what="the alarm",
        )


def test_a_database_that_can_not_be_opened_for_that_reason_says_so(tmp_path):
    db = Database.open(tmp_path / "amr-scheduler.db")
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, hard))
    try:
        with pytest.raises(
            DatabaseUnavailable, match="can't be opened because too many files are open: raise the limit"
        ):
            db.read()
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        db.close()
