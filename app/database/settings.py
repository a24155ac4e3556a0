"""Settings with the exceptions to the weekly working days, and a few facts about this installation."""

from __future__ import annotations

import sqlite3
import uuid
from dataclasses import fields
from datetime import date, datetime
from typing import Any

from app.database.table import Table
from app.database.values import from_json, to_instant, to_json, to_text
from app.domain.models import DayException, Settings

NAMES = frozenset(field.name for field in fields(Settings))
WRONG_PINS = "settings_pin_wrong"  # name of the row that counts the wrong PINs for Settings in a row
BACKUP_HEARTBEAT = "backup_heartbeat"  # of a restored backup: the app may have been on after it
DECLINED_PLACES = "declined_places"  # of the row with the guids of positions that shall not be proposed as places again
STEPS_LEFT_OUT = "steps_left_out"  # of the row with the steps of the set-up that somebody does not want
CLOCK_CONFIRMED_AT = (
    "clock_confirmed_at"  # of the row with the time when a command confirmed the clock while no app ran
)


class SettingsRepository:
    def load(self, c: sqlite3.Connection) -> Settings:
        """What is stored; defaults for the rest."""
        stored = {
            row["name"]: from_json(row["value"])
            for row in c.execute("SELECT name, value FROM settings")
            if row["name"] in NAMES
        }
        if "working_days" in stored:
            stored["working_days"] = tuple(stored["working_days"])
        return Settings(**stored)

    def save(self, c: sqlite3.Connection, **changes: Any) -> Settings:
        """Store some settings, as named in ``Settings``."""
        if unknown := changes.keys() - NAMES:
            raise ValueError(f"no such settings: {sorted(unknown)}")
        for name, value in changes.items():
            self.put(c, name, value)
        return self.load(c)

    def is_stored(self, c: sqlite3.Connection, name: str) -> bool:
        """Whether it was ever set (the zone, for one, is taken from the tablet at the first start)."""
        return c.execute("SELECT 1 FROM settings WHERE name = ?", (name,)).fetchone() is not None

    def get(self, c: sqlite3.Connection, name: str, default: Any = None) -> Any:
        """Any value by name."""
        row = c.execute("SELECT value FROM settings WHERE name = ?", (name,)).fetchone()
        return default if row is None else from_json(row["value"])

    def put(self, c: sqlite3.Connection, name: str, value: Any) -> None:
        """Any JSON value by name."""
        c.execute(
            "INSERT INTO settings (name, value) VALUES (?, ?) ON CONFLICT (name) DO UPDATE SET value = excluded.value",
            (name, to_json(value)),
        )

    def install_id(self, c: sqlite3.Connection) -> str:
        """The UUID of this installation: made by the first call, which needs a writing connection; restored with a
        backup."""
        found: str | None = self.get(c, "install_id")
        if found is None:
            found = str(uuid.uuid4())
            self.put(c, "install_id", found)
        return found

    def heartbeat(self, c: sqlite3.Connection) -> datetime | None:
        """When the app was last known to be running."""
        text = self.get(c, "heartbeat")
        return None if text is None else to_instant(text)

    def set_heartbeat(self, c: sqlite3.Connection, now: datetime) -> None:
        self.put(c, "heartbeat", to_text(now))

    def restored_at(self, c: sqlite3.Connection) -> datetime | None:
        """When a backup was last restored: starts planned before may have run although the ledger does not know."""
        text = self.get(c, "restored_at")
        return None if text is None else to_instant(text)

    def former_ran_until(self, c: sqlite3.Connection) -> datetime | None:
        """Until when the app ran on the database that a restore replaced, or had tried starts: those planned up to then
        may have run too, also if the clock was set back since."""
        text = self.get(c, "former_ran_until")
        return None if text is None else to_instant(text)


class CalendarRepository(Table[DayException]):
    """The exceptions, as entered or imported from a file."""

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
