"""The sums behind the KPIs, each from one index; what they mean is ``app.services.kpi``'s part.

Instants are text as in the columns, so that a period is a range of an index. An empty robot list means none, None means all.
"""
from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass

from app.database.values import marks

ENDED = ("completed", "failed", "cancelled", "skipped", "missed")
EARLIEST, LATEST = "", "~"           # before and after every instant as text
NOBODY = (-1,)                       # INDEXED BY can't be met with an empty list


@dataclass(frozen=True)
class Span:
    """Executions that ended in [start, end), of some robots or of all."""
    start: str = EARLIEST
    end: str = LATEST
    robot_ids: Sequence[int] | None = None


@dataclass(frozen=True)
class RobotSum:
    """Ended executions of one robot in one state. ``seconds`` sums the durations that are known, ``timed`` counts them."""
    robot_id: int
    state: str
    number: int
    timed: int
    seconds: float


class KpiRepository:
    def by_robot(self, c: sqlite3.Connection, span: Span) -> list[RobotSum]:
        """One sum per robot and state."""
        robots = (span.robot_ids if span.robot_ids is not None else self._robots(c)) or NOBODY
        rows = c.execute(f"""SELECT robot_id, state, count(*), count(duration_s), total(duration_s)
                             FROM executions INDEXED BY executions_by_robot
                             WHERE robot_id IN ({marks(robots)}) AND state IN ({marks(ENDED)}) AND ended_at >= ? AND ended_at < ?
                             GROUP BY robot_id, state""", (*robots, *ENDED, span.start, span.end))
        return [RobotSum(*row) for row in rows]

    @staticmethod
    def _robots(c: sqlite3.Connection) -> list[int]:
        """Robots with history, removed ones too: leaps over the index instead of reading it."""
        return [row[0] for row in c.execute("""
            WITH RECURSIVE found (id) AS (
                SELECT min(robot_id) FROM executions WHERE ended_at IS NOT NULL
                UNION ALL
                SELECT (SELECT min(robot_id) FROM executions WHERE ended_at IS NOT NULL AND robot_id > found.id)
                FROM found WHERE id IS NOT NULL
            ) SELECT id FROM found WHERE id IS NOT NULL""")]

    def name_of_removed(self, c: sqlite3.Connection, robot_id: int) -> str:
        """What a robot that is no longer configured was called."""
        row = c.execute("SELECT robot FROM executions WHERE robot_id = ? AND ended_at IS NOT NULL LIMIT 1", (robot_id,)).fetchone()
        return row[0] if row else ""

    def first_and_last(self, c: sqlite3.Connection, span: Span) -> tuple[str, str] | None:
        """When the first and the last of them ended."""
        robots, values = self._of_robots(span)
        ends = []
        for order in ("ASC", "DESC"):
            row = c.execute(f"""SELECT ended_at FROM executions INDEXED BY executions_by_day WHERE ended_at >= ? AND ended_at < ? {robots}
                                ORDER BY ended_at {order} LIMIT 1""", (span.start, span.end, *values)).fetchone()
            if row is None:
                return None
            ends.append(row[0])
        return ends[0], ends[1]

    def has_any(self, c: sqlite3.Connection, span: Span) -> bool:
        robots, values = self._of_robots(span)
        row = c.execute(f"SELECT 1 FROM executions INDEXED BY executions_by_day WHERE ended_at >= ? AND ended_at < ? {robots} LIMIT 1",
                        (span.start, span.end, *values)).fetchone()
        return row is not None

    def by_state(self, c: sqlite3.Connection, span: Span) -> dict[str, tuple[int, int, float]]:
        """(number, number with a known duration, seconds) by state."""
        robots, values = self._of_robots(span)
        rows = c.execute(f"""SELECT state, count(*), count(duration_s), total(duration_s) FROM executions INDEXED BY executions_by_day
                             WHERE ended_at >= ? AND ended_at < ? {robots} GROUP BY state""", (span.start, span.end, *values))
        return {row[0]: (row[1], row[2], row[3]) for row in rows}

    def outcome(self, c: sqlite3.Connection, span: Span, state: str, code: str | None, *, submitted: bool = False) -> int:
        """How many scheduled ones ended in this state for this reason; only those that the robot had accepted, if so wanted."""
        robots, values = self._of_robots(span)
        only = "AND submitted_at IS NOT NULL" if submitted else ""
        number: int = c.execute(f"""
            SELECT count(*) FROM executions INDEXED BY executions_by_outcome
            WHERE ended_at IS NOT NULL AND trigger = 'scheduled' AND state = ? AND reason_code IS ? AND ended_at >= ? AND ended_at < ?
            {robots} {only}""", (state, code, span.start, span.end, *values)).fetchone()[0]
        return number

    def start_delays(self, c: sqlite3.Connection, span: Span, limit: int) -> list[tuple[float, float]]:
        """(submitted − planned, robot's started − ordered) in seconds of the newest that ran, newest first."""
        robots, values = self._of_robots(span)
        return [(row[0], row[1]) for row in c.execute(f"""
            SELECT (julianday(submitted_at) - julianday(planned_at)) * 86400.0, robot_delay_s
            FROM executions INDEXED BY executions_by_day
            WHERE ended_at >= ? AND ended_at < ? {robots}
            AND trigger = 'scheduled' AND submitted_at IS NOT NULL AND robot_delay_s IS NOT NULL
            ORDER BY ended_at DESC LIMIT ?""", (span.start, span.end, *values, limit))]

    def observed(self, c: sqlite3.Connection, first_day: str, last_day: str,
                 robot_ids: Sequence[int] | None) -> dict[tuple[int, str], float]:
        """Seconds by (robot, activity) over these days, both included."""
        robots, values = self._of_robots(Span(robot_ids=robot_ids))
        rows = c.execute(f"""SELECT robot_id, activity, sum(seconds) FROM observed WHERE day BETWEEN ? AND ? {robots}
                             GROUP BY robot_id, activity""", (first_day, last_day, *values))
        return {(row[0], row[1]): row[2] for row in rows}

    @staticmethod
    def _of_robots(span: Span) -> tuple[str, list[int]]:
        if span.robot_ids is None:
            return "", []
        robots = span.robot_ids or NOBODY
        return f"AND robot_id IN ({marks(robots)})", list(robots)
