"""A copy of a database in memory: to check a backup on it, and to try out a change while others keep writing."""

from __future__ import annotations

import sqlite3

from app.database.schema import MIGRATIONS, configured

COPIED = 100_001  # rows of a table at most: of a backup, which may hold anything
_HISTORY = {"observed", "activity_spans", "activity_days", "ended_days"}  # read for figures and curves only
_SOME = {
    "executions": f"""WHERE state IN ('waiting', 'submitting', 'queued', 'executing')
                           OR id IN (SELECT id FROM executions ORDER BY planned_at DESC, id DESC LIMIT 1000) LIMIT {COPIED}"""
}


def copy_in_memory(source: sqlite3.Connection, version: int = len(MIGRATIONS)) -> sqlite3.Connection:
    """A copy of the present version, of a database of that ``version``: everything but the history, with the open and the newest
    executions. ``source`` is in no transaction; the caller closes the copy."""
    copy = sqlite3.connect(":memory:", isolation_level=None)
    try:
        for script in MIGRATIONS[:version]:
            copy.executescript(script)
        _copy_rows(source, copy)
        for script in MIGRATIONS[version:]:
            copy.executescript(script)
        copy.execute("PRAGMA foreign_keys = ON")
        return configured(copy)
    except BaseException:
        copy.close()
        raise


def _copy_rows(source: sqlite3.Connection, copy: sqlite3.Connection) -> None:
    """All as they are at one moment."""
    tables = {name for (name,) in copy.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}
    source.execute("BEGIN")
    try:
        for table in (*(tables - _HISTORY - {"sqlite_sequence"}), "sqlite_sequence"):
            rows = source.execute(f"SELECT * FROM {table} {_SOME.get(table, f'LIMIT {COPIED}')}")
            copy.execute(f"DELETE FROM {table}")  # until then the sequences follow from the rows
            copy.executemany(f"INSERT INTO {table} VALUES ({', '.join('?' for _ in rows.description)})", rows)
    finally:
        if source.in_transaction:  # not where SQLite has ended it (I/O error, no memory)
            source.execute("ROLLBACK")
