"""Backups of the database, in a directory next to it: made by SQLite's backup API, verified by opening, rotated, restored by command.

They hold the robots' tokens, so they are as private as the database itself.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import os
import sqlite3
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

from app.database import files
from app.database.check_ups import CheckUpRepository
from app.database.copy import copy_in_memory
from app.database.errors import DatabaseRefused, DatabaseUnavailable, primary_code, translated
from app.database.schema import APPLICATION_ID, MIGRATIONS, configured
from app.database.schema_figures import RECOUNT
from app.database.settings import BACKUP_HEARTBEAT, WRONG_PINS, SettingsRepository
from app.database.value_checks import LARGEST_IN_BACKUP, problem_in_backup
from app.database.values import to_instant, to_text
from app.domain.message import Message, message, message_of_system
from app.domain.models import Settings

log = logging.getLogger(__name__)

HEARTBEAT_AGE = timedelta(minutes=1)  # more than the app lets pass between two
NOT_RESTORED = message("The backup {path} can't be restored ({problem}). Nothing was changed, so choose another one")[
    "msgid"
]
CHECK_UP_LEFT = message(
    "Nothing was restored: the check-up of {robots} is not over. Let the app undo it, or delete a robot or fleet that is gone for good"
)["msgid"]
BACKUPS = "backups"  # the directory, in the data directory
KEPT = 7  # daily ones
SEQUENCE_GAP = 1000  # ids skipped at a restore: objects made after the backup must not be taken for new ones


def daily_backup(path: Path, now: datetime) -> Path | None:
    """Make today's backup (by UTC) unless it exists, and delete the oldest beyond seven. Raises DatabaseUnavailable.

    Reads through a connection of its own, so it may run on any thread and delays no one.
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
    """Copy the database at ``path`` into the file ``target``, which exists only once it is complete and verified."""
    files.make_directory(target.parent)
    part = target.with_name(target.name + ".part")
    try:
        part.unlink(missing_ok=True)
        files.make_private(part)
        with (
            contextlib.closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True, isolation_level=None)) as source,
            contextlib.closing(sqlite3.connect(part, isolation_level=None)) as copy,
        ):
            source.backup(copy)
            copy.execute("PRAGMA journal_mode = DELETE")  # one file, without -wal and -shm
        if problem := problem_of(part, any_version=True):
            raise DatabaseUnavailable("The backup {path} could not be made: {problem}", path=target, problem=problem)
        files.sync_file(part)
        part.replace(target)
        files.sync_directory(target.parent)
    except sqlite3.Error as error:
        raise translated(error, path) from error
    except OSError as error:
        raise DatabaseUnavailable(
            "The backup {path} can't be written: {problem}", path=target, problem=message_of_system(error)
        ) from error


Check = Callable[[sqlite3.Connection], Message | None]  # the problem with the rows; None: no problem


def problem_of(backup: Path, any_version: bool = False, check: Check | None = None) -> Message | None:
    """Why this file can't be restored; None if it can. ``any_version``: only check whether it is complete. ``check``
    gets a copy of its rows, updated to this version, with only the open and the newest executions: the rest of the
    history is checked for wrong numbers and instants."""
    if not backup.is_file():
        return message("there is no such file")
    try:
        with contextlib.closing(
            sqlite3.connect(f"{backup.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
        ) as connection:
            if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
                return message("it is not a database of this app")
            version: int = connection.execute("PRAGMA user_version").fetchone()[0]
            if version > len(MIGRATIONS) and not any_version:
                return message("it was written by a newer version")
            if not any_version and (version < 1 or _schema(connection) != _schema_of(version)):
                return message("its tables were not made by this app")
            verdict: str = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
            if verdict != "ok":
                return message("it is damaged")
            if check is None:
                return None
            with contextlib.closing(copy_in_memory(connection, version)) as rows:
                return check(rows) or problem_in_backup(connection)
    except OSError as error:
        return message_of_system(error)
    except sqlite3.Error as error:
        is_none = primary_code(error) == sqlite3.SQLITE_NOTADB
        return message("it is not a database of this app") if is_none else message("it is damaged")


def _schema(connection: sqlite3.Connection) -> list[tuple[str, ...]]:
    """Tables, indexes, triggers and views with their definitions, including SQLite's own: names prove nothing."""
    return connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_schema ORDER BY type, name, sql").fetchall()


@functools.cache
def _schema_of(version: int) -> list[tuple[str, ...]]:
    """The schema of a new database of that version: another trigger or view could change starts, or prevent all
    writing."""
    with contextlib.closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript("".join(MIGRATIONS[:version]))
        return _schema(connection)


def newest_good_backup(path: Path, check: Check | None = None) -> Path | None:
    """The newest backup of the database at ``path`` that can be restored."""
    return next((backup for backup in backups_of(path) if problem_of(backup, check=check) is None), None)


def backups_of(path: Path) -> list[Path]:
    """Files in the directory of backups of the database at ``path``, good or not, newest first. A file from elsewhere
    may have its name in capitals; hidden files do not count."""
    found: list[tuple[int, Path]] = []
    with contextlib.suppress(OSError):  # there is no such directory
        for backup in (path.parent / BACKUPS).iterdir():
            if backup.suffix.lower() == ".db" and not backup.name.startswith("."):
                with contextlib.suppress(FileNotFoundError):  # the oldest may just have been deleted
                    found.append((backup.stat().st_mtime_ns, backup))
    return [backup for _changed, backup in sorted(found, reverse=True)]


def settings_in(backup: Path) -> Settings:
    """The settings at the time of the backup; the defaults if they can't be read."""
    try:
        with contextlib.closing(
            sqlite3.connect(f"{backup.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
        ) as connection:
            connection.row_factory = sqlite3.Row
            return SettingsRepository().load(connection)
    except (sqlite3.Error, OSError, ValueError, TypeError):
        return Settings()


def restore(backup: Path, path: Path, now: datetime, check: Check | None = None) -> Path | None:
    """Replace the database by a backup; the caller holds the instance lock and no connection.

    The replaced file is kept under a new name, which is returned. The installation's id is restored too, so that the
    same instants get the same tokens. Raises DatabaseRefused if the backup can't be used, or while a check-up has changes
    on a robot that only the present database can undo; then nothing was changed. Interrupted after its copy is complete,
    it is finished by the next start.
    """
    path = path.absolute()
    left = _left_by(path, check)
    if left.checked_up:
        raise DatabaseRefused(CHECK_UP_LEFT, robots=", ".join(left.checked_up))
    part = _part(path)
    try:
        files.make_directory(path.parent)
        with contextlib.ExitStack() as unfinished:
            unfinished.callback(part.unlink, missing_ok=True)
            if problem := _copied(backup, part, check):
                raise DatabaseRefused(NOT_RESTORED, path=backup, problem=problem)
            _note_restore(part, left, now)
            os.utime(part, (now.timestamp(), now.timestamp()))
            part.replace(_ready(path))
        files.sync_directory(path.parent)
    except sqlite3.Error as error:
        raise translated(error, path) from error
    except OSError as error:
        raise DatabaseUnavailable(NOT_RESTORED, path=backup, problem=message_of_system(error)) from error
    return _finish(path)


def _copied(backup: Path, part: Path, check: Check | None) -> Message | None:
    """Copies it, and then returns why the copy can't be restored: a second reading of the medium may differ."""
    if not backup.is_file():
        return message("there is no such file")
    files.copy_private(backup, part)
    return problem_of(part, check=check)


def _ready(path: Path) -> Path:
    """The copy of a backup that is whole, checked, and to take the place of the database."""
    return files.sibling(path, ".to-restore")


def _part(path: Path) -> Path:
    return files.sibling(path, ".restore")


def is_restoring(path: Path) -> bool:
    """Whether a restore was interrupted that ``carry_on_restore`` will finish."""
    return _ready(path).exists()


def carry_on_restore(path: Path) -> None:
    """At a start: finish an interrupted restore, or remove its partial copy. Raises DatabaseUnavailable."""
    if is_restoring(path):
        kept = _finish(path)
        log.warning("A restore was interrupted and is finished now; the former database is kept as %s", kept)
    with contextlib.suppress(OSError):
        _part(path).unlink(missing_ok=True)


def _finish(path: Path) -> Path | None:
    """Put the copied backup in the place of the database. May be interrupted anywhere and called again. Returns the new
    name of the former database."""
    try:
        began = datetime.fromtimestamp(_ready(path).stat().st_mtime, UTC)
        files.clear_mark(path)
        kept = files.set_aside(path, "before-restore", began)
        _ready(path).replace(path)
        files.sync_directory(path.parent)
    except OSError as error:
        raise DatabaseUnavailable(
            "{path} can't be written: {problem}", path=path, problem=message_of_system(error)
        ) from error
    return kept


def _note_restore(file: Path, left: _Left, now: datetime) -> None:
    """Update it to this version, compute counts again, record the restore, continue ids beyond all that were used since
    the backup, and keep the count of wrong PINs and until when the app ran."""
    settings = SettingsRepository()
    with contextlib.closing(sqlite3.connect(file, isolation_level=None)) as connection:
        configured(connection)
        connection.execute("PRAGMA journal_mode = DELETE")
        connection.execute("PRAGMA synchronous = FULL")
        version: int = connection.execute("PRAGMA user_version").fetchone()[0]
        connection.executescript("".join([*MIGRATIONS[version:], RECOUNT, f"PRAGMA user_version = {len(MIGRATIONS)};"]))
        connection.execute("BEGIN IMMEDIATE")
        settings.put(connection, "restored_at", to_text(now))
        settings.put(connection, BACKUP_HEARTBEAT, settings.get(connection, "heartbeat"))
        settings.put(connection, "former_ran_until", left.ran_until and to_text(left.ran_until))
        settings.put(connection, WRONG_PINS, max(left.wrong_pins, settings.get(connection, WRONG_PINS, 0)))
        connection.execute("UPDATE sqlite_sequence SET seq = seq + ?", (SEQUENCE_GAP,))
        connection.execute("COMMIT")


def _ran_until(former: sqlite3.Connection) -> datetime | None:
    """Until when the app ran on it, or until the latest start that was tried: the clock may have been set back since."""
    found = []
    with contextlib.suppress(sqlite3.Error, ValueError, TypeError, OverflowError):
        if beat := SettingsRepository().heartbeat(former):
            found.append(beat + HEARTBEAT_AGE)
    with contextlib.suppress(sqlite3.Error, ValueError, TypeError, OverflowError):
        (tried,) = former.execute("SELECT max(planned_at) FROM executions WHERE attempts > 0").fetchone()
        if tried:
            found.append(to_instant(tried))
    return max(found, default=None)


class _Left(NamedTuple):
    """Of the former database: how many wrong PINs were entered in a row, until when the app ran by its clock, and on
    which robots and fleets a check-up has left changes."""

    wrong_pins: int = 0
    ran_until: datetime | None = None
    checked_up: Sequence[str] = ()


def _left_by(database: Path, check: Check | None) -> _Left:
    """Nothing where it can't be read."""
    is_whole = not files.size_of(files.sibling(database, "-wal"))  # then SQLite creates no files next to it
    try:
        with contextlib.closing(
            sqlite3.connect(f"{database.as_uri()}?mode=ro{'&immutable=1' * is_whole}", uri=True)
        ) as connection:
            settings, former = SettingsRepository(), configured(connection)
            wrong = min(int(settings.get(former, WRONG_PINS, 0)), LARGEST_IN_BACKUP)
            checked_up: Sequence[str] = ()
            version: int = former.execute("PRAGMA user_version").fetchone()[0]
            with contextlib.suppress(sqlite3.Error), contextlib.closing(copy_in_memory(connection, version)) as rows:
                if check is None or check(rows) is None:  # else the app doesn't start on it, and undoes nothing
                    checked_up = CheckUpRepository().names_left(rows)
            return _Left(wrong, _ran_until(former), checked_up)
    except (sqlite3.Error, ValueError, TypeError, OverflowError):
        return _Left()
