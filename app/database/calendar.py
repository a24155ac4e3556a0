"""The exceptions to the weekly working days, as entered or imported from a file."""

from __future__ import annotations

import sqlite3
from datetime import date

from app.database.table import Table
from app.domain.models import DayException


class CalendarRepository(Table[DayException]):
    name, columns = "calendar_days", ("name", "first_day", "last_day", "is_working", "yearly", "source")
    query, order = "SELECT * FROM current_calendar_days AS calendar_days", "first_day, last_day, id"

    @staticmethod
    def read(row: sqlite3.Row) -> DayException:
        return DayException(
            row["name"],
            date.fromisoformat(row["first_day"]),
            date.fromisoformat(row["last_day"]),
            bool(row["is_working"]),
            bool(row["yearly"]),
            row["source"],
            row["id"],
        )
