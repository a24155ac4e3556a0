"""A place that can't keep commits is refused, and no caller waits for ever for a failed write."""

from __future__ import annotations

import sqlite3
import threading
import time
from collections.abc import Callable

import pytest

from app.database.connection import Database, DatabaseUnavailable
from app.database.errors import DatabaseError
from app.database.writer import ThreadedWriter
from app.domain.execution import ReasonCode, State
from app.domain.reasons import sentence
from tests.support.seen import items, outcomes, reason

PATIENCE = 30.0  # s
TOGETHER = 3


# ---------------------------------------------------------------------- where there is no write-ahead log
def test_a_place_where_no_write_ahead_log_can_be_is_refused_with_a_sentence(tmp_path, monkeypatch):
    """Some network drives can't share memory, and SQLite then silently uses another journal."""
    connect = sqlite3.connect

    def without_shared_memory(place, **options):
        return connect(f"{place}{'&' if '?' in str(place) else '?'}vfs=unix-dotfile", **options)

    monkeypatch.setattr(sqlite3, "connect", without_shared_memory)
    with pytest.raises(DatabaseError) as refused:
        Database.open(tmp_path / "amr-scheduler.db").close()
    assert str(tmp_path) in refused.value.text


# ---------------------------------------------------------------------- a roll-back that fails
class Failing(sqlite3.Connection):
    """From ``fails`` on neither a commit nor a roll-back succeeds, as on a disk that was pulled out."""

    fails = False

    def execute(self, sql: str, *values: object) -> sqlite3.Cursor:
        if self.fails and sql in ("COMMIT", "ROLLBACK"):
            error = sqlite3.OperationalError("disk I/O error")
            error.sqlite_errorcode = sqlite3.SQLITE_IOERR
            raise error
        return super().execute(sql, *values)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_no_caller_waits_for_ever_when_the_roll_back_of_a_shared_transaction_fails(tmp_path):
    """Each caller that shared it gets the error; later writes are refused or work."""
    made: list[Failing] = []

    def connect() -> sqlite3.Connection:
        made.append(sqlite3.connect(tmp_path / "x.db", isolation_level=None, check_same_thread=False, factory=Failing))
        made[0].execute("CREATE TABLE t (x)")
        return made[0]

    writer = ThreadedWriter(connect, tmp_path / "x.db")
    is_busy, may_go_on, ended = threading.Event(), threading.Event(), []

    def first(c: sqlite3.Connection) -> None:
        is_busy.set()
        may_go_on.wait(PATIENCE)

    def ask(work: Callable[[sqlite3.Connection], object]) -> None:
        try:
            writer.write(work)
        except BaseException as error:
            ended.append(error)
        else:
            ended.append(None)

    threads = [threading.Thread(target=ask, args=(first,), daemon=True)]
    threads[0].start()
    assert is_busy.wait(PATIENCE)
    for _ in range(TOGETHER):  # they wait at the same time, so they share one transaction
        threads.append(
            threading.Thread(target=ask, args=(lambda c: c.execute("INSERT INTO t VALUES (1)"),), daemon=True)
        )
        threads[-1].start()
    while writer._tasks.qsize() < TOGETHER:
        may_go_on.wait(0.001)
    made[0].fails = True
    may_go_on.set()
    deadline = time.monotonic() + PATIENCE
    for thread in threads:
        thread.join(max(0.0, deadline - time.monotonic()))
    assert [thread.is_alive() for thread in threads] == [False] * (1 + TOGETHER)
    assert all(isinstance(error, DatabaseUnavailable) for error in ended)


# ---------------------------------------------------------------------- a disk that can't be written for a while
def test_what_was_missed_while_nothing_could_be_written_says_so(site, plan):
    """The app was on: neither the row nor the alarm of it may say that it was off."""
    plan("2026-11-23T06:05", start_window_minutes=1)
    site.run(60)
    mend = site.make_read_only()
    run_through(site, 600)
    mend()
    run_through(site, 60)
    assert items(site) == []
    assert outcomes(site) == [(State.MISSED, ReasonCode.APP_DOWN, 0)]
    [row] = site.executions()
    said = sentence(reason(row), "UTC")
    assert said.startswith("Nothing could be written from 06:0")
    assert "read-only" in said


def run_through(site, seconds):
    """Let time pass as in an app that records the failure of its database and continues."""
    end = site.clock.monotonic() + seconds
    while site.clock.monotonic() < end:
        try:
            site.run(end - site.clock.monotonic())
        except DatabaseUnavailable:
            site.clock.advance(1.0)
