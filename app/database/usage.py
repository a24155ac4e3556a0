"""How long robots have run."""
from __future__ import annotations

import sqlite3
from datetime import datetime

from app.database.values import to_text


class UsageRepository:
    def seconds_run(self, c: sqlite3.Connection, since: datetime) -> dict[int, float]:
        """Seconds of runs of at most a day that ended since then, by the robot's id; robots without any are left out. One whose clock was
        set meanwhile says decades."""
        rows = c.execute("""SELECT robot_id, total(duration_s) FROM executions INDEXED BY executions_by_day
                            WHERE ended_at >= ? AND robot_id IS NOT NULL AND duration_s BETWEEN 0 AND 86400 GROUP BY robot_id""",
                         (to_text(since),))
        return dict(map(tuple, rows))
