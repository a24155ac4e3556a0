"""Backups of the database beside it: made by SQLite's backup API, verified by opening, rotated, restored by command.

They hold the robots' tokens, so they are as private as the database itself.
"""
from __future__ import annotations

import contextlib
import functools
import sqlite3
from datetime import datetime
from pathlib import Path

from app.database import files
from app.database.errors import DatabaseRefused, DatabaseUnavailable, translated
from app.database.schema import APPLICATION_ID, MIGRATIONS
from app.database.settings import SettingsRepository
from app.database.values import to_json, to_text
from app.domain.message import Message, message, message_of_system
from app.domain.models import Settings

BACKUPS = "backups"          # the directory, in the data directory
KEPT = 7                     # daily ones
SEQUENCE_GAP = 1000          # ids skipped at a restore: what was made after the backup must not be taken for something new


def daily_backup(path: Path, now: datetime) -> Path | None:
    """Today's backup (by UTC) unless there is one already, and the oldest beyond seven dropped. Raises DatabaseUnavailable.

    Reads through a connection of its own, so it may run on any thread and delays nobody.
    """
    directory = path.parent / BACKUPS
    target = directory / f"daily-{now:%Y-%m-%d}.db"
    if target.exists():
        return None
    back_up(path, target)
    for old in sorted(directory.glob("daily-*.db"))[:-KEPT]:
        old.unlink(missing_ok=True)
    return target


def back_up(path: Path, target: Path) -> None:
    """Copy the database at ``path`` into the file ``target``, which exists only when it is whole and verified."""
    files.make_directory(target.parent)
    part = target.with_name(target.name + ".part")
    try:
        part.unlink(missing_ok=True)
        files.make_private(part)
        with contextlib.closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True, isolation_level=None)) as source, \
                contextlib.closing(sqlite3.connect(part, isolation_level=None)) as copy:
            source.backup(copy)
            copy.execute("PRAGMA journal_mode = DELETE")      # one file, without -wal and -shm
        if problem := problem_of(part, any_version=True):
            raise DatabaseUnavailable("The backup {path} could not be made: {problem}", path=target, problem=problem)
        files.sync_file(part)
        part.replace(target)
        files.sync_directory(target.parent)
    except sqlite3.Error as error:
        raise translated(error, path) from error
    except OSError as error:
        raise DatabaseUnavailable("The backup {path} can't be written: {problem}", path=target, problem=message_of_system(error)) from error


def problem_of(backup: Path, any_version: bool = False) -> Message | None:
    """Why this file can't be restored; None when it can. ``any_version``: only whether it is whole."""
    if not backup.is_file():
        return message("there is no such file")
    try:
        with contextlib.closing(sqlite3.connect(f"{backup.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as connection:
            connection.execute("PRAGMA trusted_schema = OFF")
            if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
                return message("it is not a database of this app")
            version: int = connection.execute("PRAGMA user_version").fetchone()[0]
            if version > len(MIGRATIONS) and not any_version:
                return message("it was written by a newer version")
            if not any_version and _schema(connection) != _schema_of(version):
                return message("its tables were not made by this app")
            verdict: str = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
            return None if verdict == "ok" else verdict.splitlines()[-1]
    except (sqlite3.Error, OSError) as error:
        return message_of_system(error) if isinstance(error, OSError) else str(error)


def _schema(connection: sqlite3.Connection) -> set[tuple[str, ...]]:
    """Tables, indexes, triggers and views with their definitions, but for those of SQLite itself."""
    return set(connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_schema WHERE name NOT LIKE 'sqlite\\_%' ESCAPE '\\'"))


@functools.cache
def _schema_of(version: int) -> set[tuple[str, ...]]:
    """As a new database of that version has it: a trigger or a view more could change what is sent, or keep anything from being written."""
    with contextlib.closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript("".join(MIGRATIONS[:version]))
        return _schema(connection)


def newest_good_backup(path: Path) -> Path | None:
    """The newest backup of the database at ``path`` that can be restored."""
    made = sorted((path.parent / BACKUPS).glob("*.db"), key=lambda file: file.stat().st_mtime_ns, reverse=True)
    return next((backup for backup in made if problem_of(backup) is None), None)


def settings_in(backup: Path) -> Settings:
    """What was set when the backup was made; the defaults when that can't be read."""
    try:
        with contextlib.closing(sqlite3.connect(f"{backup.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as connection:
            connection.row_factory = sqlite3.Row
            return SettingsRepository().load(connection)
    except (sqlite3.Error, OSError, ValueError, TypeError):
        return Settings()


def restore(backup: Path, path: Path, now: datetime) -> Path | None:
    """Replace the database by a backup; the caller holds the instance lock and no connection.

    The replaced file is kept under a new name, which is returned. The installation's id comes back with the backup, so that the same
    occurrences get the same tokens. Raises DatabaseRefused when the backup can't be used; then nothing was changed.
    """
    path = path.absolute()
    if problem := problem_of(backup):
        raise DatabaseRefused("The backup {path} can't be restored: {problem}", path=backup, problem=problem)
    part = path.with_name(path.name + ".restore")
    try:
        files.make_directory(path.parent)
        files.copy_private(backup, part)
        _note_restore(part, now)
        kept = files.put_aside(path, "before-restore", now)
        part.replace(path)
        files.sync_directory(path.parent)
        files.clear_mark(path)
    except sqlite3.Error as error:
        raise translated(error, path) from error
    except OSError as error:
        raise DatabaseUnavailable("The backup {path} can't be restored: {problem}", path=backup,
                                  problem=message_of_system(error)) from error
    return kept


def _note_restore(file: Path, now: datetime) -> None:
    """Record the restore, and continue ids beyond everything that was made since the backup."""
    with contextlib.closing(sqlite3.connect(file, isolation_level=None)) as connection:
        connection.execute("PRAGMA journal_mode = DELETE")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("INSERT OR REPLACE INTO settings (name, value) VALUES ('restored_at', ?)", (to_json(to_text(now)),))
        connection.execute("UPDATE sqlite_sequence SET seq = seq + ?", (SEQUENCE_GAP,))
        connection.execute("COMMIT")
