"""Whether cells hold values that the app could have written: impossible numbers would only fail at the next addition,
much later."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from datetime import date

from app.database.values import to_instant
from app.domain.activity import ACTIVITIES
from app.domain.message import Message, message

LARGEST_IN_BACKUP = 2**53  # of every number of a backup, either way: exact as a float too
LARGEST_IN_USE = 2**62  # of those in use, which have grown since: still far from an overflow
YEARS = range(1970, 9000)  # of instants: far from where adding to one fails
FLAGS = {
    "enabled",
    "needs_password",
    "off_with_fleet",
    "favourite",
    "on_low_battery",
    "charges",
    "respect_working_days",
    "held",
    "is_working",
    "yearly",
}
_INSTANT = len("2026-11-23T04:30:00.000000Z")


def unusable(table: str, problem: Message) -> Message:
    return message("its table {table} has a value that can't be used: {problem}", table=table, problem=problem)


def tables(c: sqlite3.Connection) -> list[str]:
    """All but SQLite's own, by name."""
    return [
        name
        for (name,) in c.execute(
            "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite%' ORDER BY name"
        )
    ]


def wrong_number(c: sqlite3.Connection, table: str, largest: int, rows: str = "") -> str | None:
    """The first column with a number beyond that, positive or negative, and the number; a flag is 0 or 1. ``rows``: a
    WHERE clause; default all. Tables are STRICT: a column of numbers has only numbers."""
    columns = [row[1] for row in c.execute(f"PRAGMA table_info({table})") if row[2] in ("INTEGER", "REAL")]
    ends = ", ".join(f"min({name}), max({name})" for name in columns)
    found = (
        c.execute(f"SELECT {ends} FROM (SELECT {', '.join(columns)} FROM {table} {rows})").fetchone() if columns else ()
    )
    for name, low, high in zip(columns, found[::2], found[1::2], strict=True):
        least, most = (0, 1) if name in FLAGS else (-largest, largest)
        if low is not None and not least <= low <= high <= most:
            return f"{name} {high if high > most else low}"
    return None


def problem_in_backup(c: sqlite3.Connection) -> Message | None:
    """For a backup of any version: numbers of all tables, and activity spans. Counts (``ended_days``) are computed
    again at a restore."""
    for table in tables(c):
        problem = None if table == "ended_days" else wrong_number(c, table, LARGEST_IN_BACKUP)
        if problem is None and table in ("observed", "activity_days", "activity_spans"):
            problem = _wrong_activity(c, table)
        if problem is not None:
            return unusable(table, problem)
    return None


def _wrong_activity(c: sqlite3.Connection, table: str) -> str | None:
    """The first impossible activity span."""
    is_spans = table == "activity_spans"
    times = "started_at, ended_at" if is_spans else "day, day"
    for start, end, activity in c.execute(f"SELECT {times}, activity FROM {table}"):
        if activity not in ACTIVITIES or not (_are_instants((start, end)) if is_spans else _is_day(start)):
            return f"{start} {end} {activity}"[:200]
    return None


def _are_instants(texts: Iterable[str]) -> bool:
    """As the app writes them: of one length, so that their order is that of time."""
    try:
        return all(len(text) == _INSTANT and text[-1] == "Z" and to_instant(text).year in YEARS for text in texts)
    except ValueError:
        return False


def _is_day(text: str) -> bool:
    try:
        return len(text) == len("2026-11-23") and date.fromisoformat(text).year in YEARS
    except ValueError:
        return False
