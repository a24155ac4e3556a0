"""For how long each robot was seen doing what, per local day: the ground of utilisation."""
from __future__ import annotations

import sqlite3
from collections.abc import Mapping


class ObservedRepository:
    def add_many(self, c: sqlite3.Connection, robot_id: int, seconds: Mapping[tuple[str, str], float]) -> None:
        """Add observed seconds by (day ``YYYY-MM-DD`` in settings.timezone, activity)."""
        c.executemany("""INSERT INTO observed (robot_id, day, activity, seconds) VALUES (?, ?, ?, ?)
                         ON CONFLICT (robot_id, day, activity) DO UPDATE SET seconds = seconds + excluded.seconds""",
                      [(robot_id, day, activity, value) for (day, activity), value in seconds.items()])

    def add(self, c: sqlite3.Connection, robot_id: int, day: str, activity: str, seconds: float) -> None:
        self.add_many(c, robot_id, {(day, activity): seconds})

    def of_robot(self, c: sqlite3.Connection, robot_id: int, first_day: str, last_day: str) -> dict[tuple[str, str], float]:
        """Seconds by (day, activity), both days included."""
        rows = c.execute("SELECT day, activity, seconds FROM observed WHERE robot_id = ? AND day BETWEEN ? AND ?",
                         (robot_id, first_day, last_day))
        return {(row["day"], row["activity"]): row["seconds"] for row in rows}
