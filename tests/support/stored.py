"""What a database holds, put back for each test of those that share one."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

from app.container import Container
from app.database.connection import Database
from app.database.schema import MIGRATIONS
from app.domain.clock import Clock
from app.services.live.changes import Topic

Rows = list[tuple[object, ...]]


class Stored:
    """The rows of a container's database at the time of this call."""

    def __init__(self, container: Container) -> None:
        self._container = container
        self._rows = dict(_tables(container.db.read()))

    def put_back(self) -> None:
        """Undo every change since, those of settings, plan, history, alarms and holds alike, and publish that they have changed. Nothing
        may be under way at a robot."""
        container = self._container
        container.db.write(self._write)
        for topic in Topic:
            container.changes.publish(topic)

    def _write(self, c: sqlite3.Connection) -> None:
        """In the order in which the tables were made: those that a trigger or a deleted parent changes come after it."""
        for table, rows in _tables(c):
            before = self._rows[table]
            if rows != before:
                c.execute(f"DELETE FROM {table}")
                for row in before:
                    c.execute(f"INSERT INTO {table} VALUES ({', '.join('?' * len(row))})", row)


def _tables(c: sqlite3.Connection) -> Iterator[tuple[str, Rows]]:
    """All but SQLite's own, which see to it that no id comes back."""
    for (table,) in c.execute(
        "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%' ORDER BY rowid"
    ).fetchall():
        yield table, [tuple(row) for row in c.execute(f"SELECT * FROM {table}").fetchall()]


def brought_up_to_date(path: Path, clock: Clock, step: str, fill: Callable[[Database], object]) -> Database:
    """A database of the version before this step, filled, and opened by the present version."""
    before = MIGRATIONS[: MIGRATIONS.index(step)]
    old = Database.open(path, clock=clock, threaded=False, durable=False, migrations=before)
    fill(old)
    old.close()
    return Database.open(path, clock=clock, threaded=False, durable=False)


def bring_over(new: Database, old: Database) -> None:
    """The executions, in the columns that the older database has."""
    names = [row["name"] for row in old.read().execute("PRAGMA table_info(executions)")]
    rows = [tuple(row) for row in new.read().execute(f"SELECT {', '.join(names)} FROM executions")]
    old.write(
        lambda c: c.executemany(
            f"INSERT INTO executions ({', '.join(names)}) VALUES ({', '.join('?' * len(names))})", rows
        )
    )
