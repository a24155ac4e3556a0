"""What each robot was seen doing, span by span: the ground of its timeline. Bounded in time and in rows."""
from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from datetime import datetime, timedelta

from app.database.values import to_instant, to_text

KEPT_FOR = timedelta(days=90)
KEPT_ROWS = 20_000                   # of each robot

Span = tuple[str, datetime, datetime]    # activity, start, end


class ActivityRepository:
    def save(self, c: sqlite3.Connection, robot_id: int, spans: Iterable[Span]) -> None:
        """Add spans; one that began at the same instant as a stored one takes its place: it has become longer."""
        c.executemany("""INSERT INTO activity_spans (robot_id, started_at, ended_at, activity) VALUES (?, ?, ?, ?)
                         ON CONFLICT (robot_id, started_at) DO UPDATE SET ended_at = excluded.ended_at, activity = excluded.activity""",
                      [(robot_id, to_text(start), to_text(end), activity) for activity, start, end in spans])

    def prune(self, c: sqlite3.Connection, robot_id: int, now: datetime) -> int:
        """Drop what is older than 90 days (that of removed robots too) or beyond the newest 20,000 of a robot; returns how many."""
        before = c.total_changes
        c.execute("DELETE FROM activity_spans WHERE ended_at < ? AND (robot_id = ? OR robot_id NOT IN (SELECT id FROM robots))",
                  (to_text(now - KEPT_FOR), robot_id))
        c.execute("""DELETE FROM activity_spans WHERE robot_id = ? AND started_at < (
                     SELECT started_at FROM activity_spans WHERE robot_id = ? ORDER BY started_at DESC LIMIT 1 OFFSET ?)""",
                  (robot_id, robot_id, KEPT_ROWS - 1))
        return c.total_changes - before

    def between(self, c: sqlite3.Connection, robot_id: int, start: datetime, end: datetime) -> list[Span]:
        """Spans that touch [start, end), oldest first."""
        rows = c.execute("""SELECT activity, started_at, ended_at FROM activity_spans
                            WHERE robot_id = ? AND started_at >= coalesce(
                                (SELECT max(started_at) FROM activity_spans WHERE robot_id = ? AND started_at < ?), '')
                            AND started_at < ? AND ended_at > ? ORDER BY started_at""",
                         (robot_id, robot_id, to_text(start), to_text(end), to_text(start)))
        return [(row[0], to_instant(row[1]), to_instant(row[2])) for row in rows]
