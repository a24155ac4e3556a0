"""Each robot's observed activity in spans; and, for days whose spans are too old or too many, the sum of each
activity."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from datetime import date, datetime, timedelta
from zoneinfo import ZoneInfo

from app.database.values import to_instant, to_text
from app.domain.activity import ActivitySpan, seconds_by_day
from app.domain.clock import midnight

KEPT_FOR = timedelta(days=90)
KEPT_ROWS = 20_000  # of each robot; a day that has not ended keeps all of its own
DAY = timedelta(days=1)


class ActivityRepository:
    def save(self, c: sqlite3.Connection, robot_id: int, spans: Iterable[ActivitySpan]) -> None:
        """Add spans; one that began at the same instant as a stored one takes its place: it has become longer."""
        c.executemany(
            """INSERT INTO activity_spans (robot_id, started_at, ended_at, activity) VALUES (?, ?, ?, ?)
                         ON CONFLICT (robot_id, started_at) DO UPDATE SET ended_at = excluded.ended_at, activity = excluded.activity""",
            [(robot_id, to_text(start), to_text(end), activity) for activity, start, end in spans],
        )

    def between(self, c: sqlite3.Connection, robot_id: int, start: datetime, end: datetime) -> list[ActivitySpan]:
        """Spans that touch [start, end), oldest first."""
        rows = c.execute(
            """SELECT activity, started_at, ended_at FROM activity_spans
                            WHERE robot_id = ? AND started_at >= coalesce(
                                (SELECT max(started_at) FROM activity_spans WHERE robot_id = ? AND started_at < ?), '')
                            AND started_at < ? AND ended_at > ? ORDER BY started_at""",
            (robot_id, robot_id, to_text(start), to_text(end), to_text(start)),
        )
        return [ActivitySpan(row[0], to_instant(row[1]), to_instant(row[2])) for row in rows]

    def seconds(
        self, c: sqlite3.Connection, robot_id: int, start: datetime, end: datetime, zone: ZoneInfo
    ) -> dict[date, dict[str, float]]:
        """The observed time of each activity, by local day. A day with sums instead of spans counts wholly, or not at
        all if the period cuts it."""
        last = self._last_summed(c, robot_id, _day(end, zone))
        whole_from = _day(start, zone) if start == midnight(_day(start, zone), zone) else _day(start, zone) + DAY
        found: dict[date, dict[str, float]] = {}
        rows = c.execute(
            "SELECT day, activity, seconds FROM activity_days WHERE robot_id = ? AND day >= ? AND day < ? ORDER BY day",
            (robot_id, whole_from.isoformat(), _day(end, zone).isoformat()),
        )
        for day, activity, seconds in rows:
            found.setdefault(date.fromisoformat(day), {})[activity] = seconds
        since = start if last is None else max(start, midnight(last + DAY, zone))
        return (
            {**found, **seconds_by_day(self.between(c, robot_id, since, end), since, end, zone)}
            if since < end
            else found
        )

    def hours_executing(self, c: sqlite3.Connection, since: datetime, now: datetime) -> dict[int, float]:
        """Hours that each robot was seen executing between two instants whose spans are not summed yet, in hours to the
        nearest minute (the second of a poll must not matter), by the robot's id; robots without any are omitted.
        Overlapping spans (the clock had been set back) both count."""
        rows = c.execute(
            """
            SELECT s.robot_id, round(total(max(0, julianday(min(s.ended_at, :now)) - julianday(max(s.started_at, :since)))) * 1440) / 60
            FROM current_robots r CROSS JOIN activity_spans s ON s.robot_id = r.id AND s.started_at < :now AND s.started_at >= coalesce(
                (SELECT max(started_at) FROM activity_spans WHERE robot_id = r.id AND started_at < :since), :since)
            WHERE s.activity = 'executing' GROUP BY r.id""",
            {"since": to_text(since), "now": to_text(now)},
        )
        return {robot_id: hours for robot_id, hours in rows if hours}

    # ------------------------------------------------------------------ what becomes too old or too many
    def prune(self, c: sqlite3.Connection, robot_id: int, now: datetime, zone: ZoneInfo) -> None:
        """Put sums in the place of spans older than 90 days (of removed robots too) or beyond the newest 20,000 of a robot, day by day."""
        removed = c.execute(
            "SELECT DISTINCT robot_id FROM activity_spans WHERE robot_id NOT IN (SELECT id FROM robots)"
        ).fetchall()
        for one in {robot_id, *(row[0] for row in removed)}:
            self._sum_up(c, one, self._kept_from(c, one, now, zone), zone)

    def _kept_from(self, c: sqlite3.Connection, robot_id: int, now: datetime, zone: ZoneInfo) -> datetime:
        """The midnight from which spans stay."""
        first = _day(now - KEPT_FOR, zone)
        surplus = c.execute(
            "SELECT started_at FROM activity_spans WHERE robot_id = ? ORDER BY started_at DESC LIMIT 1 OFFSET ?",
            (robot_id, KEPT_ROWS),
        ).fetchone()
        if surplus:
            first = max(first, min(_day(to_instant(surplus[0]), zone) + DAY, _day(now, zone)))
        return midnight(first, zone)

    def _sum_up(self, c: sqlite3.Connection, robot_id: int, end: datetime, zone: ZoneInfo) -> None:
        """The last span that began before ``end`` stays: it may reach beyond."""
        first, last = (
            to_instant(text) if text else end
            for text in c.execute(
                "SELECT min(started_at), max(started_at) FROM activity_spans WHERE robot_id = ? AND started_at < ?",
                (robot_id, to_text(end)),
            ).fetchone()
        )
        if first == last:
            return
        days = self.seconds(c, robot_id, midnight(_day(first, zone), zone), end, zone)
        c.executemany(
            "INSERT OR IGNORE INTO activity_days (robot_id, day, activity, seconds) VALUES (?, ?, ?, ?)",
            [
                (robot_id, day.isoformat(), activity, seconds)
                for day, activities in days.items()
                for activity, seconds in activities.items()
            ],
        )
        c.execute("DELETE FROM activity_spans WHERE robot_id = ? AND started_at < ?", (robot_id, to_text(last)))

    @staticmethod
    def _last_summed(c: sqlite3.Connection, robot_id: int, until: date) -> date | None:
        """The last day up to ``until`` that has sums; later days have spans. A clock that was ahead may have left sums
        of future days."""
        text = c.execute(
            "SELECT max(day) FROM activity_days WHERE robot_id = ? AND day <= ?", (robot_id, until.isoformat())
        ).fetchone()[0]
        return date.fromisoformat(text) if text else None


def _day(instant: datetime, zone: ZoneInfo) -> date:
    return instant.astimezone(zone).date()
