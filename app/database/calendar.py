"""The exceptions to the weekly working days, as they were entered or came with a file."""

from __future__ import annotations

import sqlite3
from dataclasses import replace
from datetime import date

from app.domain.models import DayException


class CalendarRepository:
    def all(self, c: sqlite3.Connection) -> list[DayException]:
        """In order of their first day."""
        return [_exception(row) for row in c.execute("SELECT * FROM calendar_days ORDER BY first_day, last_day, id")]

    def get(self, c: sqlite3.Connection, exception_id: int) -> DayException | None:
        row = c.execute("SELECT * FROM calendar_days WHERE id = ?", (exception_id,)).fetchone()
        return row and _exception(row)

    def count(self, c: sqlite3.Connection) -> int:
        found: int = c.execute("SELECT count(*) FROM calendar_days").fetchone()[0]
        return found

    def add(self, c: sqlite3.Connection, exception: DayException) -> DayException:
        """Returns it with its id; one that is given (an undone removal) is kept."""
        cursor = c.execute(
            """INSERT INTO calendar_days (id, name, first_day, last_day, is_working, yearly, source)
                              VALUES (?, ?, ?, ?, ?, ?, ?)""",
            (exception.id or None, *_values(exception)),
        )
        return replace(exception, id=cursor.lastrowid or exception.id)

    def update(self, c: sqlite3.Connection, exception: DayException) -> None:
        c.execute(
            "UPDATE calendar_days SET name = ?, first_day = ?, last_day = ?, is_working = ?, yearly = ?, source = ? WHERE id = ?",
            (*_values(exception), exception.id),
        )

    def remove(self, c: sqlite3.Connection, exception_id: int) -> None:
        c.execute("DELETE FROM calendar_days WHERE id = ?", (exception_id,))


def _values(exception: DayException) -> tuple[object, ...]:
    return (
        exception.name,
        exception.first_day.isoformat(),
        exception.last_day.isoformat(),
        exception.is_working,
        exception.yearly,
        exception.source,
    )


def _exception(row: sqlite3.Row) -> DayException:
    return DayException(
        row["name"],
        date.fromisoformat(row["first_day"]),
        date.fromisoformat(row["last_day"]),
        bool(row["is_working"]),
        bool(row["yearly"]),
        row["source"],
        row["id"],
    )
