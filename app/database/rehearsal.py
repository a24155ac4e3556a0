"""Many changes in a short transaction: they are made on a copy in memory first, while others keep writing, and then
repeated."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Mapping
from typing import Any

from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.schema import configured
from app.database.settings import NAMES

_TABLES = (
    "settings",
    "fleets",
    "robots",
    "robot_groups",
    "group_members",
    "missions",
    "idle_rules",
    "places",
    "mission_places",
    "schedules",
    "skips",
    "calendar_days",
    "alarms",
    "sqlite_sequence",
)
# Executions that no robot has yet; in terms of the index of open ones, without which the whole history would be read.
_UNSENT = """executions WHERE state IN ('waiting', 'submitting', 'queued', 'executing') AND state IN ('waiting', 'submitting')"""
_WAITING = f"SELECT id, schedule_id, robot_id, * FROM {_UNSENT}"
# What the copy has to have in common with the database still, as a key and the rest of a row. Not what is noted while missions are started:
# how far a schedule has been planned (unless the schedule is changed), what a robot accepted last.
_COMPARED = {
    "settings": f"SELECT name, value FROM settings WHERE name IN ({', '.join(map(repr, NAMES))})",
    "robots": f"SELECT id, {', '.join(RobotRepository.columns)} FROM robots",
    "fleets": "SELECT * FROM fleets",
    "groups": "SELECT * FROM robot_groups",
    "members": "SELECT group_id || ' ' || robot_id FROM group_members",
    "missions": "SELECT * FROM missions",
    "places": "SELECT * FROM places",
    "uses": "SELECT mission_id || ' ' || place_id FROM mission_places",
    "idle_rules": "SELECT * FROM idle_rules",
    "calendar_days": "SELECT * FROM calendar_days",
    "ids": """SELECT name, seq FROM sqlite_sequence
              WHERE name IN ('robots', 'fleets', 'robot_groups', 'missions', 'places', 'schedules', 'calendar_days')""",
    "skips": "SELECT schedule_id || ' ' || planned_at, held FROM skips",
}
_PLANNED = ("next_at", "planned_through", "started_through")
_SCHEDULES = f"SELECT id, {', '.join((*_PLANNED, *(name for name in ScheduleRepository.columns if name not in _PLANNED)))} FROM schedules"

Rows = Mapping[Any, tuple[Any, ...]]


class _Recording(sqlite3.Connection):
    """Records every write of the app."""

    done: list[tuple[str, Any]]

    def execute(self, statement: str, values: Any = (), /) -> sqlite3.Cursor:
        if not statement.lstrip().startswith("SELECT"):
            self.done.append((statement, values))
        return super().execute(statement, values)

    def executemany(self, statement: str, rows: Iterable[Any], /) -> sqlite3.Cursor:
        rows = list(rows)
        self.done += [(statement, values) for values in rows]
        return super().executemany(statement, rows)

    def executescript(self, script: str, /) -> sqlite3.Cursor:
        raise NotImplementedError("a script commits, so it can't be part of a transaction")


class Rehearsal:
    """``copy`` has the schema, what is configured and what waits to be sent, as ``c`` sees them, but not the history."""

    def __init__(self, c: sqlite3.Connection) -> None:
        self.copy = sqlite3.connect(":memory:", isolation_level=None, factory=_Recording)
        self.copy.done = []
        configured(self.copy)
        c.execute("BEGIN")
        try:
            for (
                statement,
            ) in c.execute("""SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL AND name NOT LIKE 'sqlite%'
                                             ORDER BY type <> 'table'"""):
                self.copy.execute(statement)
            for table, query in [
                *((table, f"SELECT * FROM {table}") for table in _TABLES),
                ("executions", f"SELECT * FROM {_UNSENT}"),
            ]:
                self.copy.execute(
                    f"DELETE FROM {table}"
                )  # of ids what SQLite has noted of the rows just copied, which may be less
                rows = c.execute(query)
                marks = ", ".join("?" for _ in rows.description)
                self.copy.executemany(f"INSERT INTO {table} VALUES ({marks})", map(tuple, rows))
        finally:
            c.execute("COMMIT")
        self.copy.execute("PRAGMA foreign_keys = ON")
        self._before = {name: _rows(self.copy, query) for name, query in _COMPARED.items()}
        self._schedules, self._waiting = _rows(self.copy, _SCHEDULES), _rows(self.copy, _WAITING)
        self.copy.done.clear()

    def close(self) -> None:
        """Give the copy back; ``repeat`` needs only what was written."""
        self._changed = _changed(self._schedules, _rows(self.copy, _SCHEDULES))
        self._changed_waiting = _changed(self._waiting, _rows(self.copy, _WAITING))
        self._changed_robots = _changed(self._before["robots"], _rows(self.copy, _COMPARED["robots"]))
        self._done = self.copy.done
        self.copy.close()

    def repeat(self, c: sqlite3.Connection) -> bool:
        """Repeat the writes, unless their basis has changed since: then nothing is written, and it returns False."""
        if not (
            all(_rows(c, query) == self._before[name] for name, query in _COMPARED.items())
            and self._same_schedules(_rows(c, _SCHEDULES))
        ):
            return False
        if any("executions" in statement for statement, _values in self._done) and self._touched(
            _rows(c, _WAITING)
        ) != self._touched(self._waiting):
            return False
        for statement, values in self._done:
            c.execute(statement, values)
        return True

    def _same_schedules(self, now: Rows) -> bool:
        return now.keys() == self._schedules.keys() and all(
            row == before if key in self._changed else row[len(_PLANNED) + 1 :] == before[len(_PLANNED) + 1 :]
            for (key, row), before in zip(now.items(), self._schedules.values(), strict=True)
        )

    def _touched(self, waiting: Rows) -> Rows:
        """What waits of schedules or for robots that were changed, or was itself: only that was read or written."""
        return {
            key: row
            for key, row in waiting.items()
            if key in self._changed_waiting or row[1] in self._changed or row[2] in self._changed_robots
        }


def _changed(before: Rows, after: Rows) -> set[int]:
    """The keys of rows that have changed or were deleted."""
    return {key for key, row in before.items() if after.get(key) != row}


def _rows(c: sqlite3.Connection, query: str) -> Rows:
    """By their first column, in a fixed order."""
    return {row[0]: tuple(row) for row in c.execute(f"{query} ORDER BY 1")}
