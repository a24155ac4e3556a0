"""Whether cells hold values that the app could have written: impossible numbers would only fail at the next addition,
much later. And objects that are stored as JSON, read by the annotations of their dataclass."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Callable, Iterable, Mapping
from dataclasses import is_dataclass
from datetime import UTC, date, datetime
from enum import Enum
from functools import cache, partial
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

from app.database.values import to_instant
from app.domain.activity import ACTIVITIES
from app.domain.message import Message, is_message, message

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
LONGEST = 10_000  # characters of a text in a stored object


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


# ---------------------------------------------------------------------- objects
def decoded(kind: Any, value: Any, **known: Any) -> Any:
    """From JSON as ``to_json`` writes it: a value of this annotation, such as a dataclass. ``known``: attributes that are
    not read. Those that are missing, as in rows of earlier versions, have their defaults. Raises ValueError, TypeError or
    LookupError."""
    return _reader(kind)(value, **known)


@cache
def _reader(kind: Any) -> Callable[..., Any]:
    """Of values of this annotation. Made once: to look into an annotation takes longer than to read a value."""
    of, origin = get_args(kind), get_origin(kind)
    if isinstance(kind, UnionType):
        first = _reader(of[0])
        return lambda value: (
            value if (value is None and NoneType in of) or (kind == Message and is_message(value)) else first(value)
        )
    if isinstance(kind, type) and is_dataclass(kind):
        fields = {name: _reader(each) for name, each in get_type_hints(kind).items()}
        return lambda value, **known: kind(
            **{name: fields[name](each) for name, each in _plain(dict, value).items() if name not in known}, **known
        )
    if origin is Mapping:
        key, entry = map(_reader, of)
        return lambda value: {key(name): entry(each) for name, each in _plain(dict, value).items()}
    if origin is tuple and of[-1] is not Ellipsis:
        each_of = [_reader(each) for each in of]
        return lambda value: tuple(read(each) for read, each in zip(each_of, _plain(list, value), strict=True))
    if origin in (tuple, frozenset):
        read = _reader(of[0])
        return lambda value: origin(map(read, _plain(list, value)))
    if kind is datetime:
        return _instant
    if kind is Any:
        return lambda value: value
    if kind is float:
        return lambda value: _plain(float, float(value) if type(value) is int else value)
    return kind if issubclass(kind, Enum) else partial(_plain, kind)


def _plain(kind: Any, value: Any) -> Any:
    """A value that JSON has: of this type and no other."""
    if type(value) is not kind:
        raise TypeError(f"{value!r:.40} is no {kind.__name__}")
    if (kind is str and len(value) > LONGEST) or (kind is float and not math.isfinite(value)):
        raise ValueError(f"{value!r:.40} is out of range")
    return value


def _instant(text: str) -> datetime:
    found = datetime.fromisoformat(text)
    if found.tzinfo is None or found.year not in YEARS:
        raise ValueError(f"instant {found}")
    return found.astimezone(UTC)
