"""One scheduler per data directory: an operating-system lock, which a killed process loses by itself."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import IO

from app.database.files import NO_LINK
from app.failures import BadInput

COMMAND = "a command in "  # a holder that answers nobody and ends soon


class AlreadyRunning(Exception):
    """Another process schedules on this data directory."""

    def __init__(self, directory: Path, holder: str) -> None:
        self.holder = holder
        super().__init__(f"{directory} is in use by {holder}; close it first")


class InstanceLock:
    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self.path = directory / "scheduler.lock"
        self._file: IO[str] | None = None
        self.is_held_by_command = False

    def acquire(self, *, serves: bool = True) -> None:
        """Take the lock and write down who holds it: a process that ``serves`` commands, or a command. Raises AlreadyRunning, and BadInput
        when there is no way to lock."""
        try:
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | NO_LINK, 0o600)
        except OSError as error:
            raise BadInput(
                f"{self.path} can't be opened: {error.strerror}; remove it, or choose another --data-dir"
            ) from None
        file = os.fdopen(descriptor, "r+", encoding="utf-8")
        if not _lock(file):
            holder = file.read(200).strip() or "another process"
            file.close()
            raise AlreadyRunning(self._directory, holder)
        file.seek(0)
        file.truncate()
        file.write(f"{'' if serves else COMMAND}process {os.getpid()} ({Path(sys.argv[0]).name or 'python'})")
        file.flush()
        self._file = file

    def try_acquire(self) -> bool:
        """As a command does that will end soon; ``is_held_by_command`` says by whom it is held otherwise."""
        try:
            self.acquire(serves=False)
        except AlreadyRunning as error:
            self.is_held_by_command = error.holder.startswith(COMMAND)
            return False
        return True

    @property
    def is_in_place(self) -> bool:
        """Whether the file that is locked is still the one in the directory: else another process can lock that."""
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


if sys.platform == "win32":
    import msvcrt

    _FAR = 1 << 30  # a byte beyond the text, so that the holder's name stays readable

    def _lock(file: IO[str]) -> bool:
        file.seek(_FAR)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        finally:
            file.seek(0)
        return True
else:
    import fcntl

    def _lock(file: IO[str]) -> bool:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        return True
