"""Opens the database; each error is one line."""

from __future__ import annotations

from app.container import Container
from app.database.connection import Database, DatabaseDamaged, DatabaseRefused, DatabaseUnavailable
from app.failures import BadInput, Failure
from app.process.data_directory import DataDirectory


def open_container(directory: DataDirectory, *, with_window: bool = False) -> Container:
    """Open for writing; the caller holds the lock. Raises BadInput or Failure."""
    try:
        return Container.open(directory.path, with_window=with_window)
    except (DatabaseDamaged, DatabaseRefused) as error:
        raise BadInput(str(error)) from error
    except DatabaseUnavailable as error:
        raise Failure(str(error)) from error


def open_for_reading(directory: DataDirectory) -> Database:
    """Open beside a running app; nothing is written. Raises BadInput or Failure."""
    try:
        return Database.open_for_reading(directory.database)
    except (DatabaseDamaged, DatabaseRefused) as error:
        raise BadInput(str(error)) from error
    except DatabaseUnavailable as error:
        raise Failure(str(error)) from error
