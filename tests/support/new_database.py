"""New databases as copies of the first one that this process has migrated."""

from __future__ import annotations

import sqlite3
from datetime import datetime
from functools import cache
from pathlib import Path
from threading import Lock

from app.database.connection import migrate as migrate_really

_copying = Lock()


def migrate(connection: sqlite3.Connection, path: Path, migrations: tuple[str, ...], now: datetime) -> None:
    """As ``app.database.connection.migrate``, which does the work for databases that are not empty."""
    if connection.execute(
        "SELECT (SELECT count(*) FROM sqlite_schema) + user_version FROM pragma_user_version"
    ).fetchone()[0]:
        migrate_really(connection, path, migrations, now)
        return
    with _copying:
        _migrated(migrations).backup(connection)
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()


@cache
def _migrated(migrations: tuple[str, ...]) -> sqlite3.Connection:
    database = sqlite3.connect(":memory:", isolation_level=None, check_same_thread=False)
    migrate_really(database, Path(), migrations, datetime.min)
    return database
