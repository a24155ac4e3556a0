"""Brings an older database up to date, step by step; ``PRAGMA user_version`` counts the steps taken."""

from __future__ import annotations

import sqlite3
from datetime import datetime
from pathlib import Path

from app.database.backups import BACKUPS, back_up
from app.database.schema import APPLICATION_ID


def migrate(connection: sqlite3.Connection, path: Path, migrations: tuple[str, ...], now: datetime) -> None:
    """Apply missing steps, each in one transaction with a backup before it.

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
