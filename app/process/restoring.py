"""A backup is put in the place of the database while no app runs on it: at the rescue page, in Settings, by command."""

from __future__ import annotations

from pathlib import Path

from app.database.backups import restore
from app.database.errors import DatabaseError
from app.domain.clock import SystemClock
from app.failures import BadInput
from app.process.data_directory import DataDirectory
from app.process.lock import AlreadyRunning, InstanceLock
from app.services.catalogue.stored import problem_in


def restore_backup(directory: DataDirectory, backup: Path) -> Path | None:
    """Returns where the former database is kept, None when there was none. Raises BadInput with one sentence."""
    lock = InstanceLock(directory.path)
    try:
        lock.acquire()
    except AlreadyRunning as error:
        raise BadInput(str(error)) from None
    try:
        return restore(backup, directory.database, SystemClock().now(), problem_in)
    except DatabaseError as error:
        raise BadInput(error.text) from error
    finally:
        lock.release()
