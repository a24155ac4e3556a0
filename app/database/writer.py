"""The one connection that writes, and the thread that owns it.

Several threads writing or checkpointing one WAL database can lose pages on SQLite before 3.51.3, so exactly one does both
(https://sqlite.org/wal.html, "WAL-reset bug"). Work items that wait at the same time share one transaction, each inside its own savepoint:
a burst costs one flush of the disk instead of one per item. A patient item waits a few ms for others to share with.
"""

from __future__ import annotations

import logging
import queue
import sqlite3
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeVar

from app.database.errors import DatabaseUnavailable, translated

log = logging.getLogger(__name__)

T = TypeVar("T")
Work = Callable[[sqlite3.Connection], T]
_Task = tuple[Work[Any], Future[Any], bool]  # the last: whether it is patient

AT_ONCE = 256  # works in one transaction at most
PATIENCE = 0.005  # s that a patient work waits for another to share its transaction
WRITE_BACK_EVERY = 100  # transactions after which the WAL is written back
WAL_KEPT = 16 << 20  # bytes to which a longer one is cut when it starts again


class Writer(Protocol):
    rounds: int  # transactions that were begun; after an answer its own is counted

    def write(self, work: Work[T], patient: bool = False) -> T:
        """Run ``work`` inside one transaction and return its result after the commit; a ``patient`` one may wait some ms to share one.

        When it raises, everything it did is undone and the exception is raised here; disk full, read-only and I/O errors as
        DatabaseUnavailable. Never call ``write`` from inside a work: RuntimeError.
        """

    def close(self) -> None: ...


class _WritingConnection:
    """Transactions and checkpoints on the read-write connection; used by one thread only."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        self.connection, self._path = connection, path
        self._transactions = 0  # since the WAL was written back
        connection.execute(f"PRAGMA journal_size_limit = {WAL_KEPT}")

    def do(self, tasks: Sequence[_Task]) -> None:
        """All works in one transaction; one that raises undoes only itself. If the transaction is lost, every work
        failed. Their callers hear of it after the commit."""
        c, notices = self.connection, list[Callable[[], None]]()
        try:
            self._begin()
            for work, outcome, _patient in tasks:
                c.execute("SAVEPOINT work")
                try:
                    notices.append(partial(outcome.set_result, work(c)))
                except BaseException as error:
                    if not c.in_transaction:  # SQLite gave up the whole transaction (disk full, I/O error)
                        raise
                    c.execute("ROLLBACK TO work")
                    notices.append(partial(outcome.set_exception, self._translated(error)))
                c.execute("RELEASE work")
            c.execute("COMMIT")
            self._transactions += 1
        except BaseException as error:
            self._roll_back()
            notices = [partial(outcome.set_exception, self._translated(error)) for _, outcome, _ in tasks]
        for notice in notices:
            notice()

    def _translated(self, error: BaseException) -> BaseException:
        """With SQLite's own error as its cause, for the log."""
        known = translated(error, self._path)
        if known is not error:
            known.__cause__ = error
        return known

    def _begin(self) -> None:
        self._roll_back()  # should the last one still be open
        if self.connection.in_transaction:
            raise DatabaseUnavailable("The storage reports an error at {path}: check the disk", path=self._path)
        self.connection.execute("BEGIN IMMEDIATE")

    def _roll_back(self) -> None:
        """If it can't be rolled back now, it is when the next transaction begins, which fails until then."""
        try:
            if self.connection.in_transaction:
                self.connection.execute("ROLLBACK")
        except sqlite3.Error:
            log.warning("A transaction of %s could not be rolled back yet", self._path, exc_info=True)

    def checkpoint_when_due(self) -> None:
        """Write the WAL back once there is enough of it. The next write begins at its head again, over blocks that the
        file has already: which is a quarter faster than into an emptied file. It does not wait for readers; the next
        time writes the rest."""
        try:
            if self._transactions >= WRITE_BACK_EVERY:
                self._transactions = 0
                self.connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone()
        except sqlite3.Error:  # no space to write back: the WAL keeps everything until there is
            log.warning("The write-ahead log of %s can't be written back yet", self._path, exc_info=True)

    def checkpoint(self) -> bool:
        """Write it back and empty it; whether all of it went into the database file."""
        timeout = self.connection.execute("PRAGMA busy_timeout").fetchone()[0]
        self.connection.execute("PRAGMA busy_timeout = 0")
        try:
            busy: int = self.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0]
            return busy == 0
        finally:
            self.connection.execute(f"PRAGMA busy_timeout = {timeout}")

    def close(self) -> None:
        try:
            self._roll_back()
            self.checkpoint()
        except sqlite3.Error:  # what is committed stays in the WAL
            log.warning("The write-ahead log of %s could not be written back", self._path, exc_info=True)
        finally:
            self.connection.close()


class NoWriter:
    """Of a database that is open for reading only."""

    rounds = 0

    def __init__(self, path: Path) -> None:
        self._path = path

    def write(self, work: Work[T], patient: bool = False) -> T:
        raise DatabaseUnavailable("{path} is open for reading only", path=self._path)

    def close(self) -> None:
        """There is nothing to finish."""


class InlineWriter:
    """Writes on the caller's thread, always the one that opened the database: for deterministic simulation and one-shot commands."""

    def __init__(self, connect: Callable[[], sqlite3.Connection], path: Path) -> None:
        self.rounds = 0
        self._path = path
        self._writing: _WritingConnection | None = _WritingConnection(connect(), path)

    def write(self, work: Work[T], patient: bool = False) -> T:
        if self._writing is None:
            raise DatabaseUnavailable("{path} is closed", path=self._path)
        if self._writing.connection.in_transaction:
            raise RuntimeError("write() inside a write: use the connection at hand")
        outcome: Future[T] = Future()
        self.rounds += 1
        self._writing.do([(work, outcome, patient)])
        self._writing.checkpoint_when_due()
        return outcome.result()

    def close(self) -> None:
        writing, self._writing = self._writing, None
        if writing:
            writing.close()


class ThreadedWriter:
    """A thread of its own takes works from a queue. ``connect`` runs on that thread; what it raises is raised by the constructor."""

    def __init__(self, connect: Callable[[], sqlite3.Connection], path: Path) -> None:
        self.rounds = 0
        self._connect, self._path = connect, path
        self._tasks: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._closing = threading.Lock()
        self._closed = False
        opened: Future[None] = Future()
        self._thread = threading.Thread(target=self._live, args=(opened,), name="database", daemon=True)
        self._thread.start()
        opened.result()

    def write(self, work: Work[T], patient: bool = False) -> T:
        if threading.current_thread() is self._thread:
            raise RuntimeError("write() inside a write: use the connection at hand")
        outcome: Future[T] = Future()
        with self._closing:  # so that nothing is queued after the end
            if self._closed:
                raise DatabaseUnavailable("{path} is closed", path=self._path)
            self._tasks.put((work, outcome, patient))
        return outcome.result()

    def close(self) -> None:
        """Finish what is queued, then end."""
        with self._closing:
            if not self._closed:
                self._closed = True
                self._tasks.put(None)
        self._thread.join()

    def _live(self, opened: Future[None]) -> None:
        try:
            writing = _WritingConnection(self._connect(), self._path)
        except BaseException as error:
            opened.set_exception(error)
            return
        opened.set_result(None)
        try:
            while tasks := self._next_tasks():
                self.rounds += 1
                writing.do(tasks)
                if self._tasks.empty():
                    writing.checkpoint_when_due()
        finally:
            writing.close()
            self._refuse_the_rest()

    def _refuse_the_rest(self) -> None:
        """Should this thread end unexpectedly, no caller waits for ever."""
        with self._closing:
            self._closed = True
            while not self._tasks.empty():
                if task := self._tasks.get():
                    task[1].set_exception(DatabaseUnavailable("{path} is closed", path=self._path))

    def _next_tasks(self) -> list[_Task]:
        """Wait for one, and take all that are waiting; empty at the end."""
        task = self._tasks.get()
        tasks: list[_Task] = []
        held_until = time.monotonic() + PATIENCE
        while task is not None:
            tasks.append(task)
            if len(tasks) == AT_ONCE:
                return tasks
            try:
                are_patient = all(patient for _work, _outcome, patient in tasks)
                task = self._tasks.get(timeout=max(0.0, held_until - time.monotonic()) if are_patient else 0.0)
            except queue.Empty:
                return tasks
        if tasks:
            self._tasks.put(None)  # the end again, after these
        return tasks
