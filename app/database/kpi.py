"""The sums behind the KPIs, each from one index, over whole days from the table that keeps them;
``app.services.history.kpi`` says what they mean.

Instants are text as in the columns, so that a period is a range of an index. An empty robot list means none, None means all.
"""

from __future__ import annotations

import heapq
import sqlite3
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from itertools import islice
from typing import NamedTuple

from app.database.executions import execution_of
from app.database.values import placeholders
from app.domain.models import Execution

ENDED = ("completed", "failed", "cancelled", "skipped", "missed")
EARLIEST, LATEST = "", "~"  # before and after every instant as text
NOBODY = (-1,)  # INDEXED BY can't be met with an empty list
_MIDNIGHT = "T00:00:00.000000Z"


@dataclass(frozen=True)
class Span:
    """Executions that ended in [start, end), of some robots or of all; ``group``: of these the ones that any robot of it could take, by its
    name then."""

    start: str = EARLIEST
    end: str = LATEST
    robot_ids: Sequence[int] | None = None
    group: str | None = None


@dataclass(frozen=True)
class RobotSum:
    """Starts of one robot that ended in one state. ``seconds`` sums the durations that are known, ``timed`` counts them."""

    robot_id: int
    state: str
    number: int
    timed: int
    seconds: float


Outcome = tuple[str, str | None, bool]  # state, reason code, only those that the robot had accepted


class Timing(NamedTuple):
    """Seconds of one run: planned to submitted, in the robot's queue, on the robot (None: not known)."""

    app_s: float
    queue_s: float
    run_s: float | None


def _parted(span: Span) -> tuple[Span | None, list[Span]]:
    """The whole UTC days in a span (None: there is none), as days, and what is left of it at its ends, as instants."""
    if span.group is not None:  # days are not counted by group
        return None, [span]
    first = span.start
    if first != EARLIEST and not first.endswith(_MIDNIGHT):
        first = f"{date.fromisoformat(first[:10]) + timedelta(days=1):%Y-%m-%d}"
    first, end = first[:10], span.end if span.end == LATEST else span.end[:10]
    if first >= end:
        return None, [span]
    ends = [Span(span.start, first, span.robot_ids), Span(end, span.end, span.robot_ids)]
    return Span(first, end, span.robot_ids), [part for part in ends if part.start < part.end]


class KpiRepository:
    def by_robot(self, c: sqlite3.Connection, span: Span) -> list[RobotSum]:
        """One sum per robot and state; robot 0: what ended while any of a group was to take it."""
        days, ends = _parted(span)
        found = {(one.robot_id, one.state): one for one in self._by_robot_of_days(c, days)} if days else {}
        for one in (one for end in ends for one in self._by_robot_of_rows(c, end)):
            key = one.robot_id, one.state
            known = found.get(key) or RobotSum(*key, 0, 0, 0.0)
            found[key] = RobotSum(*key, known.number + one.number, known.timed + one.timed, known.seconds + one.seconds)
        return list(found.values())

    def _by_robot_of_days(self, c: sqlite3.Connection, days: Span) -> Iterator[RobotSum]:
        robots, values = self._of_robots(days)
        rows = c.execute(
            f"""SELECT robot_id, state, sum(starts), sum(timed), sum(microseconds) / 1e6 FROM ended_days
                             WHERE day >= ? AND day < ? {robots} GROUP BY robot_id, state""",
            (days.start, days.end, *values),
        )
        return (RobotSum(*row) for row in rows)

    def _by_robot_of_rows(self, c: sqlite3.Connection, span: Span) -> list[RobotSum]:
        found: list[RobotSum] = []
        for where, values in self._whose(c, span):
            rows = c.execute(
                f"""SELECT coalesce(robot_id, 0), state, sum(starts), count(duration_s), total(duration_s)
                                 FROM executions INDEXED BY executions_by_robot
                                 WHERE {where} AND state IN ({placeholders(ENDED)}) AND ended_at >= ? AND ended_at < ?
                                 GROUP BY robot_id, state""",
                (*values, *ENDED, span.start, span.end),
            )
            found += [RobotSum(*row) for row in rows]
        return found

    def _whose(
        self, c: sqlite3.Connection, span: Span, robots: Sequence[int] = ()
    ) -> list[tuple[str, Sequence[object]]]:
        """Conditions which together let through what a span has, each as the indexes by robot answer it; the second one what no robot had.
        ``robots``: those with history, where they have been read."""
        robots = robots or self._robots_of(c, span)
        found: list[tuple[str, Sequence[object]]] = [(f"robot_id IN ({placeholders(robots)})", robots)]
        if span.robot_ids is None:
            found.append(("robot_id IS NULL", ()))
        return (
            found
            if span.group is None
            else [(f"{where} AND robot_group = ?", (*values, span.group)) for where, values in found]
        )

    def _robots_of(self, c: sqlite3.Connection, span: Span) -> Sequence[int]:
        """Never empty, so that INDEXED BY can be met."""
        return (span.robot_ids if span.robot_ids is not None else self.robots(c)) or NOBODY

    @staticmethod
    def robots(c: sqlite3.Connection) -> list[int]:
        """Robots with history, removed ones too. Skips through the index instead of reading all of it."""
        return [
            row[0]
            for row in c.execute("""
            WITH RECURSIVE found (id) AS (
                SELECT min(robot_id) FROM executions WHERE ended_at IS NOT NULL
                UNION ALL
                SELECT (SELECT min(robot_id) FROM executions WHERE ended_at IS NOT NULL AND robot_id > found.id)
                FROM found WHERE id IS NOT NULL
            ) SELECT id FROM found WHERE id IS NOT NULL""")
        ]

    def name_of_removed(self, c: sqlite3.Connection, robot_id: int) -> str:
        """What a robot that is no longer configured was called."""
        row = c.execute(
            "SELECT robot FROM executions WHERE robot_id = ? AND ended_at IS NOT NULL LIMIT 1", (robot_id,)
        ).fetchone()
        return row[0] if row else ""

    def first_and_last(self, c: sqlite3.Connection, span: Span) -> tuple[str, str] | None:
        """When the first and the last of them ended."""
        robots, values = self._of_robots(span)
        ends = []
        for order in ("ASC", "DESC"):
            row = c.execute(
                f"""SELECT ended_at FROM executions INDEXED BY executions_by_day WHERE ended_at >= ? AND ended_at < ? {robots}
                                ORDER BY ended_at {order} LIMIT 1""",
                (span.start, span.end, *values),
            ).fetchone()
            if row is None:
                return None
            ends.append(row[0])
        return ends[0], ends[1]

    def kept_since(self, c: sqlite3.Connection) -> str | None:
        """When the first of the kept runs ended. Those that did not run are kept apart, and may go further back."""
        ends = [
            c.execute(
                """SELECT min(ended_at) FROM executions INDEXED BY executions_by_robot
                             WHERE robot_id = ? AND state = ? AND ended_at >= ?""",
                (robot, state, EARLIEST),
            ).fetchone()[0]
            for robot in self.robots(c)
            for state in ("completed", "failed", "cancelled")
        ]
        return min((end for end in ends if end), default=None)

    def has_any(self, c: sqlite3.Connection, span: Span) -> bool:
        robots, values = self._of_robots(span)
        row = c.execute(
            f"SELECT 1 FROM executions INDEXED BY executions_by_day WHERE ended_at >= ? AND ended_at < ? {robots} LIMIT 1",
            (span.start, span.end, *values),
        ).fetchone()
        return row is not None

    def by_state(
        self, c: sqlite3.Connection, span: Span, robots: Sequence[int] = ()
    ) -> dict[str, tuple[int, int, float]]:
        """(number, number with a known duration, seconds) by state; states without any are left out. ``robots``: as ``robots`` has them or
        the span, for whoever asks about many days."""
        found: dict[str, tuple[int, int, float]] = {}
        for where, values in self._whose(c, span, robots):
            for state in ENDED:  # one by one: grouping them would cost twice as much as counting them
                number, timed, seconds = c.execute(
                    f"""
                    SELECT coalesce(sum(starts), 0), count(duration_s), total(duration_s) FROM executions INDEXED BY executions_by_robot
                    WHERE {where} AND state = ? AND ended_at >= ? AND ended_at < ?""",
                    (*values, state, span.start, span.end),
                ).fetchone()
                if number:
                    known = found.get(state, (0, 0, 0.0))
                    found[state] = known[0] + number, known[1] + timed, known[2] + seconds
        return found

    def outcomes(self, c: sqlite3.Connection, span: Span, wanted: Iterable[Outcome]) -> dict[Outcome, int]:
        """How many scheduled ones ended so."""
        days, ends = _parted(span)
        of_days = self._outcomes_of_days(c, days) if days else Counter[Outcome]()
        return {
            outcome: of_days[outcome] + sum(self._outcome_of_rows(c, end, *outcome) for end in ends)
            for outcome in wanted
        }

    def _outcomes_of_days(self, c: sqlite3.Connection, days: Span) -> Counter[Outcome]:
        robots, values = self._of_robots(days)
        rows = c.execute(
            f"""SELECT state, reason_code, is_submitted, sum(starts) FROM ended_days
                             WHERE day >= ? AND day < ? AND is_scheduled = 1 {robots} GROUP BY state, reason_code, is_submitted""",
            (days.start, days.end, *values),
        )
        found = Counter[Outcome]()
        for state, code, is_submitted, number in rows:
            found[state, code or None, False] += number
            if is_submitted:
                found[state, code or None, True] += number
        return found

    def _outcome_of_rows(self, c: sqlite3.Connection, span: Span, state: str, code: str | None, submitted: bool) -> int:
        robots, values = self._of_robots(span)
        only = "AND submitted_at IS NOT NULL" if submitted else ""
        number: int = c.execute(
            f"""
            SELECT coalesce(sum(starts), 0) FROM executions INDEXED BY executions_by_outcome
            WHERE ended_at IS NOT NULL AND trigger = 'scheduled' AND state = ? AND reason_code IS ? AND ended_at >= ? AND ended_at < ?
            {robots} {only}""",
            (state, code, span.start, span.end, *values),
        ).fetchone()[0]
        return number

    def timings(self, c: sqlite3.Connection, span: Span, limit: int) -> list[Timing]:
        """Of the newest scheduled ones that started on the robot, newest first."""
        robots, values = self._of_robots(span)
        return [
            Timing(*row)
            for row in c.execute(
                f"""
            SELECT (julianday(submitted_at) - julianday(planned_at)) * 86400.0, robot_delay_s, duration_s
            FROM executions INDEXED BY executions_timings
            WHERE ended_at >= ? AND ended_at < ? {robots}
            AND trigger = 'scheduled' AND submitted_at IS NOT NULL AND robot_delay_s IS NOT NULL
            ORDER BY ended_at DESC LIMIT ?""",
                (span.start, span.end, *values, limit),
            )
        ]

    def failures(self, c: sqlite3.Connection, span: Span) -> list[tuple[str | None, str | None, int]]:
        """(reason code, the robot's message, number) of everything that failed, whatever had triggered it."""
        return [
            tuple(row)
            for where, values in self._whose(c, span)
            for row in c.execute(
                f"""
            SELECT reason_code, json_extract(reason_details, '$.message'), count(*) FROM executions INDEXED BY executions_by_robot
            WHERE {where} AND state = 'failed' AND ended_at >= ? AND ended_at < ? GROUP BY 1, 2""",
                (*values, span.start, span.end),
            )
        ]

    def not_completed(self, c: sqlite3.Connection, span: Span, limit: int) -> list[Execution]:
        """Those that ended in any state but completed, newest first."""
        robots, values = self._of_robots(span)
        return [
            execution_of(row)
            for row in c.execute(
                f"""
            SELECT * FROM executions INDEXED BY executions_by_day
            WHERE ended_at >= ? AND ended_at < ? {robots} AND state <> 'completed' ORDER BY ended_at DESC, id DESC LIMIT ?""",
                (span.start, span.end, *values, limit),
            )
        ]

    # ------------------------------------------------------------------ per mission
    def missions(self, c: sqlite3.Connection, span: Span) -> dict[str, tuple[int, float]]:
        """(completed runs with a known duration, their seconds) by the mission's guid, of missions that have any."""
        robots, (where, values) = self._robots_of(c, span), self._whose(c, span)[0]
        guids = {guid for robot in robots for guid in self._guids(c, robot)}
        found = {}
        for guid in sorted(guids):
            number, seconds = c.execute(
                f"""
                SELECT count(duration_s), total(duration_s) FROM executions INDEXED BY executions_by_mission
                WHERE state = 'completed' AND {where} AND mission_guid = ? AND ended_at >= ? AND ended_at < ?""",
                (*values, guid, span.start, span.end),
            ).fetchone()
            if number:
                found[guid] = (number, seconds)
        return found

    @staticmethod
    def _guids(c: sqlite3.Connection, robot_id: int) -> list[str]:
        """Missions that a robot ever completed, by skips like ``robots``."""
        return [
            row[0]
            for row in c.execute(
                """
            WITH RECURSIVE found (guid) AS (
                SELECT min(mission_guid) FROM executions WHERE state = 'completed' AND robot_id = :robot
                UNION ALL
                SELECT (SELECT min(mission_guid) FROM executions
                        WHERE state = 'completed' AND robot_id = :robot AND mission_guid > found.guid)
                FROM found WHERE guid IS NOT NULL
            ) SELECT guid FROM found WHERE guid IS NOT NULL""",
                {"robot": robot_id},
            )
        ]

    def durations(self, c: sqlite3.Connection, span: Span, guid: str) -> list[tuple[str, float]]:
        """(ended_at, seconds) of a mission's completed runs, in no order."""
        where, values = self._whose(c, span)[0]
        return c.execute(
            f"""SELECT ended_at, duration_s FROM executions INDEXED BY executions_by_mission
                             WHERE state = 'completed' AND {where} AND mission_guid = ? AND ended_at >= ?
                             AND ended_at < ? AND duration_s IS NOT NULL""",
            (*values, guid, span.start, span.end),
        ).fetchall()

    def newest_durations(self, c: sqlite3.Connection, span: Span, guid: str, limit: int) -> list[tuple[str, float]]:
        """The same, only the newest, newest first."""
        only, values = ("", ()) if span.group is None else ("AND robot_group = ?", (span.group,))
        newest = [
            c.execute(
                f"""SELECT ended_at, duration_s FROM executions INDEXED BY executions_by_mission
                                WHERE state = 'completed' AND robot_id = ? AND mission_guid = ? AND ended_at >= ? AND ended_at < ?
                                AND duration_s IS NOT NULL {only} ORDER BY ended_at DESC LIMIT ?""",
                (robot, guid, span.start, span.end, *values, limit),
            )
            for robot in self._robots_of(c, span)
        ]
        merged = heapq.merge(*(map(tuple, rows) for rows in newest), reverse=True)  # reads no more than is wanted
        return list(islice(merged, limit))

    def name_of_mission(self, c: sqlite3.Connection, guid: str, robot_ids: Sequence[int] | None) -> str:
        """What it was called when it was last completed."""
        robots = self._robots_of(c, Span(robot_ids=robot_ids))
        found = [
            c.execute(
                """SELECT ended_at, mission FROM executions INDEXED BY executions_by_mission
                              WHERE state = 'completed' AND robot_id = ? AND mission_guid = ? ORDER BY ended_at DESC LIMIT 1""",
                (robot, guid),
            ).fetchone()
            for robot in robots
        ]
        name: str = max((tuple(row) for row in found if row), default=("", ""))[1]
        return name

    @staticmethod
    def _of_robots(span: Span) -> tuple[str, list[object]]:
        if span.group is not None:
            return "AND robot_group = ?", [span.group]
        if span.robot_ids is None:
            return "", []
        robots = span.robot_ids or NOBODY
        return f"AND robot_id IN ({placeholders(robots)})", list(robots)
