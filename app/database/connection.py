"""The database of one data directory: opened, checked and migrated; one writer, a read-only connection per thread.

Journal settings that lose no committed row at a power cut (WAL with synchronous=FULL), and readers that never write.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
import threading
from datetime import datetime
from pathlib import Path

from app.database import files
from app.database.backups import BACKUPS, back_up, backups_of, carry_on_restore, is_restoring, newest_good_backup
from app.database.errors import (
    DatabaseDamaged,
    DatabaseError,
    DatabaseRefused,
    DatabaseUnavailable,
    primary_code,
    translated,
)
from app.database.schema import APPLICATION_ID, MIGRATIONS, configured
from app.database.writer import InlineWriter, NoWriter, ThreadedWriter, Writer
from app.domain.clock import Clock, SystemClock
from app.domain.message import Message, message, message_of_system

DATABASE_NAME = "amr-scheduler.db"
BUSY_TIMEOUT = 5.0  # s
STATEMENTS = 48  # prepared in each connection, 6 KB each: there are 30 connections, and 128 would be usual
PAGES_KIB = (
    256  # of the file cached by each reader. 2,000 would be usual, but the system caches them too, for all readers
)

__all__ = ["DATABASE_NAME", "Database", "DatabaseDamaged", "DatabaseError", "DatabaseRefused", "DatabaseUnavailable"]


class Database:
    """Made by ``open`` or ``open_for_reading``; everything else in ``app.database`` gets one of its connections.
    ``write`` is its writer's: one transaction (``app.database.writer.Writer``)."""

    def __init__(self, path: Path, writer: Writer) -> None:
        self.path, self._writer = path, writer
        self.write = writer.write
        self._readers = threading.local()
        self._closed = False

    @property
    def rounds(self) -> int:
        """Transactions of the writer that were begun."""
        return self._writer.rounds

    @classmethod
    def open(
        cls,
        path: Path,
        *,
        clock: Clock | None = None,
        threaded: bool = True,
        durable: bool = True,
        migrations: tuple[str, ...] = MIGRATIONS,
    ) -> Database:
        """Open for writing, creating or migrating as needed. Only the process that holds the instance lock may call
        this.

        ``threaded=False`` writes on the caller's thread; ``durable=False`` leaves flushing to the system (simulations
        only). Raises DatabaseDamaged (the file is then renamed and kept, and later calls raise too until a backup is
        restored), DatabaseRefused, DatabaseUnavailable.
        """
        clock = clock or SystemClock()
        path = path.absolute()
        files.make_directory(path.parent)
        carry_on_restore(path)
        _refuse_marked(path, clock)
        if _is_lost(path):
            raise _keep_aside(path, message("its content is missing"), clock)
        files.make_private(path)

        def connect() -> sqlite3.Connection:
            return _open_checked(path, clock, durable, migrations)

        try:
            writer = ThreadedWriter(connect, path) if threaded else InlineWriter(connect, path)
        except sqlite3.Error as error:
            if isinstance(known := translated(error, path), DatabaseDamaged):
                raise _keep_aside(path, known.problem, clock) from error
            raise known from error
        except OSError as error:
            raise DatabaseUnavailable(
                "{path} can't be used: {problem}", path=path, problem=message_of_system(error)
            ) from error
        return cls(path, writer)

    @classmethod
    def open_for_reading(cls, path: Path) -> Database:
        """Open read-only, with or without a running app: for exports. ``write`` then raises DatabaseUnavailable."""
        path = path.absolute()
        if is_restoring(path):
            raise DatabaseUnavailable(
                "A restore was interrupted in {path}: start the app once so that it is finished", path=path.parent
            )
        if files.is_marked_damaged(path):
            raise DatabaseDamaged(
                path, message("found at an earlier start"), files.kept_as(path), newest_good_backup(path)
            )
        if not path.exists():
            raise DatabaseUnavailable("There is no database in {path}: check --data-dir", path=path.parent)
        db = cls(path, NoWriter(path))
        try:
            _check_identity(db.read(), path, len(MIGRATIONS))
            version = db.read().execute("PRAGMA user_version").fetchone()[0]
        except sqlite3.Error as error:
            wal = files.sibling(path, "-wal")
            if primary_code(error) in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY) and files.size_of(wal):
                raise DatabaseUnavailable(
                    "The newest changes lie in {path}, which can't be read where nothing can be written: copy the "
                    "data directory elsewhere and name the copy with --data-dir",
                    path=wal,
                ) from error
            raise translated(error, path) from error
        if version < len(MIGRATIONS):
            db.close()
            raise DatabaseRefused(
                "{path} was written by an older version: start the app once so that it is brought up to date", path=path
            )
        return db

    def read(self) -> sqlite3.Connection:
        """This thread's read-only connection. It sees everything that was committed before each statement began."""
        if self._closed:
            raise DatabaseUnavailable("{path} is closed", path=self.path)
        reader: _Reader | None = getattr(self._readers, "reader", None)
        if reader is None:
            try:
                reader = self._readers.reader = _Reader(connect_for_reading(self.path))
            except sqlite3.Error as error:
                raise translated(error, self.path) from error
        return reader.connection

    def known(self, error: BaseException) -> BaseException:
        """The DatabaseError for an error of SQLite, with its remedy; any other error unchanged."""
        known = translated(error, self.path) if isinstance(error, sqlite3.Error) else error
        if isinstance(known, DatabaseDamaged) and known.backup is None:
            return DatabaseDamaged(self.path, known.problem, backup=newest_good_backup(self.path))
        return known

    def check_in_place(self) -> None:
        """Raises DatabaseDamaged when its file was deleted or emptied: anything written now would be lost after a
        restart."""
        if files.size_of(self.path) == 0:
            raise DatabaseDamaged(self.path, message("its content is missing"), backup=newest_good_backup(self.path))

    def close(self) -> None:
        """Finish what is being written. The connections of other threads end with their threads."""
        self._closed = True
        self._readers.__dict__.pop("reader", None)
        self._writer.close()


class _Reader:
    """Closes its connection when its thread ends or the database is no longer referenced."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self.connection = connection

    def __del__(self) -> None:
        self.connection.close()


def connect_for_reading(path: Path) -> sqlite3.Connection:
    # Each connection is handed to one thread only; the check is off because the collector may close it on another.
    mode = "mode=ro&immutable=1" if _is_immutable(path) else "mode=ro"
    connection = sqlite3.connect(
        f"{path.as_uri()}?{mode}",
        uri=True,
        isolation_level=None,
        timeout=BUSY_TIMEOUT,
        check_same_thread=False,
        cached_statements=STATEMENTS,
    )
    connection.execute("PRAGMA query_only = ON")
    with contextlib.suppress(
        sqlite3.Error
    ):  # it reads the file: the caller that needs something from it gets the error
        connection.execute(f"PRAGMA cache_size = -{PAGES_KIB}")
    return configured(connection)


def _is_immutable(path: Path) -> bool:
    """Whether it is in a read-only place and complete in its one file: then SQLite must not create files next to it
    (sqlite.org/wal.html, "Read-Only Databases"). Where an app has been killed they are there already."""
    return (
        not os.access(path.parent, os.W_OK)
        and not files.sibling(path, "-shm").exists()
        and files.size_of(files.sibling(path, "-wal")) == 0
    )


def _open_checked(path: Path, clock: Clock, durable: bool, migrations: tuple[str, ...]) -> sqlite3.Connection:
    connection = sqlite3.connect(f"{path.as_uri()}?mode=rw", uri=True, isolation_level=None, timeout=BUSY_TIMEOUT)
    try:
        configured(connection)
        _check_identity(connection, path, len(migrations))
        if (mode := connection.execute("PRAGMA journal_mode = WAL").fetchone()[0]) != "wal":
            raise DatabaseUnavailable(
                "{path} is in a place that can't keep a write-ahead log (journal mode {mode}): choose another data "
                "directory, on a disk of this machine",
                path=path,
                mode=mode,
            )
        connection.execute(f"PRAGMA synchronous = {'FULL' if durable else 'OFF'}")
        connection.execute("PRAGMA wal_autocheckpoint = 0")  # the writer does it
        problem = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
        if problem != "ok":
            raise _damage(problem)
        migrate(connection, path, migrations, clock.now())
        connection.execute("PRAGMA foreign_keys = ON")
        # Otherwise undo data of statements with triggers are kept in a temporary file, created for each transaction: that was
        # half of the time of a write. Set after the migrations, which may have to sort a million rows.
        connection.execute("PRAGMA temp_store = MEMORY")
    except BaseException:
        connection.close()
        raise
    return connection


def _damage(problem: str) -> sqlite3.DatabaseError:
    error = sqlite3.DatabaseError(problem.splitlines()[-1])
    error.sqlite_errorcode = sqlite3.SQLITE_CORRUPT
    return error


def _check_identity(connection: sqlite3.Connection, path: Path, newest: int) -> None:
    application_id = connection.execute("PRAGMA application_id").fetchone()[0]
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    is_empty = version == 0 and connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0] == 0
    if is_empty and _has_backups(path):
        raise _damage("its content is missing")
    if not is_empty and application_id != APPLICATION_ID:
        raise DatabaseRefused("{path} is a database of another program: choose another data directory", path=path)
    if version > newest:
        raise DatabaseRefused(
            "{path} was written by a newer version (database version {version}, here {newest}): update the app",
            path=path,
            version=version,
            newest=newest,
        )


def _has_backups(path: Path) -> bool:
    return bool(backups_of(path))


def _is_lost(path: Path) -> bool:
    """Whether a database that was here is missing: an empty one must not replace it."""
    return files.size_of(path) == 0 and (_has_backups(path) or files.size_of(files.sibling(path, "-wal")) > 0)


def _keep_aside(path: Path, problem: Message, clock: Clock) -> DatabaseDamaged:
    kept = files.put_aside(path, "damaged", clock.now())
    return DatabaseDamaged(path, problem, kept, newest_good_backup(path))


def _refuse_marked(path: Path, clock: Clock) -> None:
    """Damage that was found earlier persists until a backup has replaced the file."""
    if not files.is_marked_damaged(path):
        return
    if not path.exists():
        raise DatabaseDamaged(path, message("found at an earlier start"), files.kept_as(path), newest_good_backup(path))
    if not files.is_aside(path):
        raise _keep_aside(path, message("found at an earlier start"), clock)
    files.clear_mark(path)  # a restore was interrupted before its last step


# ---------------------------------------------------------------------- older databases
def migrate(connection: sqlite3.Connection, path: Path, migrations: tuple[str, ...], now: datetime) -> None:
    """Bring an older database up to date: each missing step in one transaction, with a backup of what there was before
    it. ``PRAGMA user_version`` counts the steps taken.

    Foreign keys are off during a step, so that a step may rebuild a table.
    """
    version: int = connection.execute("PRAGMA user_version").fetchone()[0]
    if version == len(migrations):
        return
    for number in range(version, len(migrations)):
        if version > 0:  # a new database has nothing to back up
            back_up(path, path.parent / BACKUPS / f"before-version-{number + 1}-{now:%Y%m%dT%H%M%SZ}.db")
        _apply(connection, migrations[number], number + 1)
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()


def _apply(connection: sqlite3.Connection, script: str, version: int) -> None:
    try:
        connection.executescript(f"""BEGIN IMMEDIATE;
            {script}
            PRAGMA application_id = {APPLICATION_ID};
            PRAGMA user_version = {version};
            COMMIT;""")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise
