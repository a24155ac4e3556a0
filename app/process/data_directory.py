"""The directory of all data: database, backups, logs, lock, inbox; readable only by its owner. One process at a time
schedules on it, by a lock of the operating system, which a killed process loses automatically.
"""

from __future__ import annotations

import contextlib
import os
import stat
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import platformdirs

from app.container import DATABASE_NAME, Container
from app.database.backups import restore
from app.database.connection import Database, DatabaseDamaged, DatabaseRefused, DatabaseUnavailable
from app.database.errors import DatabaseError
from app.database.files import NO_LINK
from app.domain.clock import SystemClock
from app.failures import BadInput, Failure
from app.process.log_file import FILE_NAME as LOG_NAME
from app.services.catalogue.database_check import find_problem

_LOCK = "scheduler.lock"
_OURS = (DATABASE_NAME, _LOCK)
_DIRECTORIES = ("backups", "before-update", "inbox", "logs", "maps")  # the second one by updates of the .deb


@dataclass(frozen=True)
class DataDirectory:
    """``read_only``: it may be on a read-only disk."""

    path: Path
    read_only: bool = False

    @classmethod
    def prepare(cls, path: Path | None, *, read_only: bool = False, has_data: bool = False) -> DataDirectory:
        """Make the directory, or take the existing one. Raises BadInput for one of another user, for one that is
        neither empty nor the app's, that can't be written unless it is ``read_only``, or without a database if it
        ``has_data``: a mistyped name makes no directory."""
        path = path or platformdirs.user_data_path("amr-scheduler", appauthor=False)
        try:
            if has_data and not path.exists():
                raise BadInput(f"there is no data directory {path}; check --data-dir")
            path.mkdir(mode=0o700, parents=True, exist_ok=True)
            _refuse_shared(path)
            if not _is_ours(path):
                raise BadInput(f"{path} holds other files; give an empty directory or one of {DATABASE_NAME}")
            if has_data and not any(entry.name.startswith(DATABASE_NAME) for entry in path.iterdir()):
                raise BadInput(f"{path} holds no data yet; check --data-dir, or start the app there first")
            if not read_only:
                path.chmod(0o700)
            elif path.stat().st_mode & 0o077:
                with contextlib.suppress(OSError):
                    path.chmod(path.stat().st_mode & 0o700)
        except FileExistsError:
            raise BadInput(f"{path} is not a directory; give a directory with --data-dir") from None
        except OSError as error:
            raise BadInput(f"{path} can't be used: {error.strerror}; give another directory with --data-dir") from None
        return cls(path.resolve(), read_only)

    @property
    def database(self) -> Path:
        return self.path / DATABASE_NAME

    @property
    def logs(self) -> Path:
        return self.path / "logs"


def _refuse_shared(path: Path) -> None:
    """Files that others can put there would be read as the app's own, and their links followed to files of this user. A
    directory of root where no other user can write is safe: a mounted one, for example."""
    found = path.stat()
    if os.name != "posix":
        return
    is_closed = not (found.st_mode & 0o022 and os.access(path, os.W_OK))
    if found.st_uid != os.geteuid() and not (found.st_uid == 0 and is_closed):
        raise BadInput(
            f"{path} belongs to another user; give a directory of your own with --data-dir, or run this as that user"
        )
    if found.st_mode & stat.S_ISVTX and found.st_mode & 0o022:
        raise BadInput(
            f"{path} is shared by several users; give a directory of your own with --data-dir, such as one in it"
        )


def _is_ours(path: Path) -> bool:
    """Whether it is empty or has files of this app; after a command that failed early, only its log."""
    names = {entry.name for entry in path.iterdir()}
    if names == {"logs"}:
        return all(file.name.startswith(LOG_NAME) for file in (path / "logs").iterdir())
    return not names or any(name.startswith(_OURS) for name in names)


def refuse_own_file(path: Path) -> None:
    """Raises BadInput if an export would overwrite a file of the app, in this or any other data directory."""
    for directory in path.parents:
        name = path.relative_to(directory).parts[0]
        if (name.startswith(_OURS) or name in _DIRECTORIES) and any((directory / ours).exists() for ours in _OURS):
            raise BadInput(f"{path} belongs to the data of the app; give another file to write to")


COMMAND = "a command in "  # a holder that serves no commands and ends soon


class AlreadyRunning(BadInput):
    """Another process schedules on this data directory."""

    def __init__(self, directory: Path, holder: str) -> None:
        self.holder = holder
        super().__init__(f"{directory} is in use by {holder}; close it first")


class InstanceLock:
    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self.path = directory / _LOCK
        self._file: IO[str] | None = None
        self.is_held_by_command = False

    def acquire(self, *, serves: bool = True) -> None:
        """Take the lock and write down who holds it: a process that ``serves`` commands, or a command. Raises
        AlreadyRunning, and BadInput if the file system can't lock."""
        try:
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | NO_LINK, 0o600)
        except OSError as error:
            raise BadInput(
                f"{self.path} can't be opened: {error.strerror}; remove it, or choose another --data-dir"
            ) from None
        file = os.fdopen(descriptor, "r+", encoding="utf-8")
        try:
            _lock(file)
        except OSError:
            holder = file.read(200).strip() or "another process"
            file.close()
            raise AlreadyRunning(self._directory, holder) from None
        file.seek(0)
        file.truncate()
        name = f"{'' if serves else COMMAND}process {os.getpid()} ({Path(sys.argv[0]).name or 'python'})"
        with contextlib.suppress(OSError):  # on a full disk the lock holds without it
            os.write(descriptor, name.encode(errors="backslashreplace"))  # a buffer would fail again when closed
        self._file = file

    def try_acquire(self) -> bool:
        """Take the lock for a short command; ``is_held_by_command`` says whether a command holds it."""
        try:
            self.acquire(serves=False)
        except AlreadyRunning as error:
            self.is_held_by_command = error.holder.startswith(COMMAND)
            return False
        return True

    @property
    def is_in_place(self) -> bool:
        """Whether the locked file is still the one in the directory: otherwise another process can lock that one."""
        try:
            return self._file is not None and os.path.samestat(os.fstat(self._file.fileno()), os.stat(self.path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        if self._file:
            self._file.seek(0)
            self._file.truncate()
            self._file.close()  # closing gives the lock back
            self._file = None


def is_in_use(directory: Path) -> bool:
    """Whether a process has the lock of another data directory, where nothing is changed."""
    try:
        file = os.fdopen(os.open(directory / _LOCK, os.O_RDWR | NO_LINK), "r+", encoding="utf-8")
    except OSError:
        return False
    with file:
        try:
            _lock(file)
        except OSError:
            return True
    return False


if sys.platform == "win32":
    import msvcrt

    _FAR = 1 << 30  # a byte beyond the text, so that the holder's name stays readable

    def _lock(file: IO[str]) -> None:
        file.seek(_FAR)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        finally:
            file.seek(0)
else:
    import fcntl

    def _lock(file: IO[str]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def open_container(directory: DataDirectory, *, with_window: bool = False) -> Container:
    """Open for writing; the caller holds the lock. Raises BadInput or Failure."""
    with _failing_in_words():
        container = Container.open(directory.path, with_window=with_window)
    container.tablet.is_in_use = is_in_use
    return container


def open_for_reading(directory: DataDirectory) -> Database:
    """Open while an app may run; nothing is written. Raises BadInput or Failure."""
    with _failing_in_words():
        return Database.open_for_reading(directory.database)


@contextlib.contextmanager
def _failing_in_words() -> Iterator[None]:
    """A database that can't be opened ends the command."""
    try:
        yield
    except (DatabaseDamaged, DatabaseRefused) as error:
        raise BadInput(str(error)) from error
    except DatabaseUnavailable as error:
        raise Failure(str(error)) from error


def restore_backup(directory: DataDirectory, backup: Path) -> Path | None:
    """Returns the new path of the former database, None without one. Raises BadInput with one sentence."""
    lock = InstanceLock(directory.path)
    lock.acquire()
    try:
        return restore(backup, directory.database, SystemClock().now(), find_problem)
    except DatabaseError as error:
        raise BadInput(error.text) from error
    finally:
        lock.release()
