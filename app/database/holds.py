"""Holds of all robots or of one, as the operator set them; they survive a restart."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass, replace
from datetime import datetime

from app.database.values import to_instant, to_optional_instant, to_optional_text, to_text


@dataclass(frozen=True)
class StoredHold:
    """Nothing is sent to the robot (None: to any) until ``until`` (None: until it is released)."""

    started_at: datetime
    reason: str = ""
    until: datetime | None = None
    robot_id: int | None = None
    id: int = 0


class HoldRepository:
    def all(self, c: sqlite3.Connection) -> list[StoredHold]:
        """Oldest first, expired ones included."""
        return [
            StoredHold(
                to_instant(row["started_at"]),
                row["reason"],
                to_optional_instant(row["until"]),
                row["robot_id"],
                row["id"],
            )
            for row in c.execute("SELECT * FROM holds ORDER BY id")
        ]

    def add(self, c: sqlite3.Connection, hold: StoredHold) -> StoredHold:
        """Returns it with its id; one that is given (of a robot whose removal is undone) is kept."""
        cursor = c.execute(
            "INSERT INTO holds (id, robot_id, reason, started_at, until) VALUES (?, ?, ?, ?, ?)",
            (hold.id or None, hold.robot_id, hold.reason, to_text(hold.started_at), to_optional_text(hold.until)),
        )
        return replace(hold, id=cursor.lastrowid or 0)

    def remove(self, c: sqlite3.Connection, robot_id: int | None) -> None:
        """The hold of that robot, or (None) the one of all robots."""
        c.execute("DELETE FROM holds WHERE robot_id IS ?", (robot_id,))
