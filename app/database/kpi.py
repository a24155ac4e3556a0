"""Data for key figures; ``app.services.history.figures`` defines them.

Instants are text as in the columns, so that a period is a range of an index. An empty robot list means none, None means
all.
"""

from __future__ import annotations

import heapq
import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from itertools import islice
from typing import NamedTuple
from zoneinfo import ZoneInfo

from app.database.execution_history import of_robots
from app.database.execution_rows import execution_of
from app.database.values import placeholders, to_instant, to_text
from app.domain.clock import midnight
from app.domain.execution import Execution, ReasonCode

EARLIEST = ""  # before every instant as text
DAY = timedelta(days=1)
_ENDED = "executions INDEXED BY executions_by_day WHERE ended_at >= ? AND ended_at < ?"
_TAKEN = """current_robots AS whichever CROSS JOIN executions INDEXED BY executions_by_day ON robot_id = whichever.id
    JOIN current_robots AS taker ON taker.fleet_id = whichever.fleet_id AND taker.name = taken_by
    WHERE whichever.vehicle = 'any' AND state IN ('completed', 'failed', 'cancelled') AND ended_at >= ? AND ended_at < ?"""
_OF_GROUPS = """executions INDEXED BY executions_of_groups
    WHERE group_id IS NOT NULL AND trigger = 'scheduled' AND ended_at >= ? AND ended_at < ?"""
_KEY = "robot_id, robot_group, is_scheduled, state, reason_code, is_submitted"
# Ended without having been sent because a person wanted it so; or the tablet was off. Neither says anything about the robots.
_NOT_OF_ROBOTS = (
    ReasonCode.HOLD,
    ReasonCode.USER_CANCELLED,
    ReasonCode.QUEUE_CLEARED,
    ReasonCode.SCHEDULE_CHANGED,
    ReasonCode.ROBOT_REMOVED,
    ReasonCode.APP_DOWN,
    ReasonCode.CLOCK_IMPLAUSIBLE,
)


@dataclass(frozen=True)
class Span:
    """Executions that ended in [start, end), of some robots or of all; ``group``: only those that any of its robots
    could take, by its name then."""

    start: str
    end: str
    robot_ids: Sequence[int] | None = None
    group: str | None = None

    @property
    def condition(self) -> str:
        return self.of_group + ("" if self.robot_ids is None else f" AND {of_robots(self._robots)[0]}")

    @property
    def of_group(self) -> str:
        return "" if self.group is None else " AND robot_group = ?"

    @property
    def values(self) -> list[object]:
        return [*self.but_robots, *of_robots(self._robots)[1]]

    @property
    def but_robots(self) -> list[object]:
        return [self.start, self.end, *([] if self.group is None else [self.group])]

    @property
    def _robots(self) -> Sequence[int]:
        """No index can be used with an empty list."""
        return () if self.robot_ids is None else self.robot_ids or (-1,)


class Count(NamedTuple):
    """Starts that ended alike. ``timed`` of them have a known duration, together ``microseconds``."""

    robot_id: int  # 0: none
    robot_group: str
    is_scheduled: int
    state: str
    reason_code: str  # "": none
    is_submitted: int
    starts: int
    timed: int
    microseconds: int


class Timing(NamedTuple):
    """Seconds of one run: planned to submitted, in the robot's queue, on the robot (None: not known)."""

    app_s: float
    queue_s: float
    run_s: float | None


class MissionRuns(NamedTuple):
    """A mission's completed runs on one robot in a period: ``number`` with a known duration, ``seconds`` of these together. ``last_at``:
    when it was completed last, at any time, as ``name``."""

    guid: str
    robot_id: int
    last_at: str
    name: str
    number: int
    seconds: float


class GroupStarts(NamedTuple):
    """Planned starts of a group: ``in_time`` of them began on a robot within the allowed delay."""

    group_id: int
    starts: int
    in_time: int
    name: str  # as the newest of them has it
    robots: str  # ids of those that completed any, as JSON


class KpiRepository:
    def counts(self, c: sqlite3.Connection, start: str, end: str, asked: Sequence[int] = ()) -> list[Count]:
        """Everything that ended in [start, end): the UTC days nearest to it as they are kept, and the rows between its ends and the
        midnights of these, added or taken away. What any robot of a fleet was asked for counts for the robot that took
        it, unless any robot is among the ``asked`` ones."""
        first, last = _nearest_day(start), _nearest_day(end)
        ends = [(start, first, 1), (first, start, -1), (last, end, 1), (end, last, -1)]
        if first >= last:
            first, last, ends = "", "", [(start, end, 1)]
        taken = f"{_TAKEN} AND whichever.id NOT IN ({placeholders(asked)})"
        of_rows, to_taker, from_any = (
            f"""UNION ALL SELECT {robot}, robot_group, trigger = 'scheduled', state, coalesce(reason_code, ''),
                submitted_at IS NOT NULL, ? * starts, ? * (duration_s IS NOT NULL),
                ? * coalesce(CAST(round(duration_s * 1000000) AS INTEGER), 0) FROM {rows}"""
            for robot, rows in (("coalesce(robot_id, 0)", _ENDED), ("taker.id", taken), ("robot_id", taken))
        )
        rows = c.execute(
            f"""SELECT {_KEY}, sum(starts) AS number, sum(timed), sum(microseconds) FROM (
                SELECT {_KEY}, starts, timed, microseconds FROM ended_days WHERE day >= ? AND day < ?
                {of_rows * len(ends)} {to_taker} {from_any})
                GROUP BY {_KEY} HAVING number <> 0""",
            (
                *(first, last, *(value for low, high, sign in ends for value in (sign, sign, sign, low, high))),
                *(value for sign in (1, -1) for value in (sign, sign, sign, start, end, *asked)),
            ),
        )
        return [Count(*row) for row in rows]

    def recorded_days(self, c: sqlite3.Connection, span: Span, zone: ZoneInfo) -> list[date]:
        """Local days on which something ended, in order."""
        days: list[date] = []
        while row := c.execute(
            f"SELECT ended_at FROM {_ENDED} {span.condition} ORDER BY ended_at LIMIT 1", span.values
        ).fetchone():
            days.append(to_instant(row[0]).astimezone(zone).date())
            span = Span(to_text(midnight(days[-1] + DAY, zone)), span.end, span.robot_ids, span.group)
        return days

    def kept_since(self, c: sqlite3.Connection) -> str | None:
        """When the first stored run ended. Starts that did not run are stored separately, and may go further back."""
        ran = "state IN ('completed', 'failed', 'cancelled')"
        row = c.execute(
            f"""SELECT ended_at FROM executions INDEXED BY executions_by_day
                WHERE ended_at >= (SELECT day FROM ended_days WHERE {ran} ORDER BY day LIMIT 1) AND {ran}
                ORDER BY ended_at LIMIT 1"""
        ).fetchone()
        return row[0] if row else None

    def name_of_robot(self, c: sqlite3.Connection, span: Span, robot_id: int) -> str:
        """The name in the period of a robot that is no longer configured."""
        row = c.execute(
            f"SELECT robot FROM {_ENDED} AND robot_id = ? LIMIT 1", (span.start, span.end, robot_id)
        ).fetchone()
        return row[0] if row else ""

    def timings(self, c: sqlite3.Connection, span: Span, limit: int) -> list[Timing]:
        """Of the newest scheduled ones that started on the robot, newest first."""
        rows = c.execute(
            f"""SELECT (julianday(submitted_at) - julianday(planned_at)) * 86400.0, robot_delay_s, duration_s
                FROM executions INDEXED BY executions_timings WHERE ended_at >= ? AND ended_at < ? {span.condition}
                AND trigger = 'scheduled' AND submitted_at IS NOT NULL AND robot_delay_s IS NOT NULL
                ORDER BY ended_at DESC LIMIT ?""",
            (*span.values, limit),
        )
        return [Timing(*row) for row in rows]

    def failures(self, c: sqlite3.Connection, span: Span) -> list[tuple[str | None, str | None, int]]:
        """(reason code, the robot's message, number) of all failed runs."""
        rows = c.execute(
            f"""SELECT reason_code, json_extract(reason_details, '$.message'), count(*) FROM {_ENDED} {span.condition}
                AND state = 'failed' GROUP BY 1, 2""",
            span.values,
        )
        return [tuple(row) for row in rows]

    def not_completed(self, c: sqlite3.Connection, span: Span, limit: int) -> list[Execution]:
        """Those that ended, except completed ones, newest first."""
        rows = c.execute(
            f"SELECT * FROM {_ENDED} {span.condition} AND state <> 'completed' ORDER BY ended_at DESC, id DESC LIMIT ?",
            (*span.values, limit),
        )
        return [execution_of(row) for row in rows]

    # ------------------------------------------------------------------ per mission
    def missions(self, c: sqlite3.Connection, span: Span) -> list[MissionRuns]:
        """One for each mission that a robot ever completed. Each pair is looked up in the index, instead of reading all of it."""
        completed = "executions INDEXED BY executions_by_mission WHERE state = 'completed'"
        runs = f"FROM {completed} AND robot_id = of_robot AND mission_guid = guid AND ended_at >= ? AND ended_at < ? {span.of_group}"
        rows = c.execute(
            f"""WITH RECURSIVE pairs (of_robot, guid) AS (
                    SELECT * FROM (SELECT robot_id, mission_guid FROM {completed} AND robot_id > 0 ORDER BY 1, 2 LIMIT 1)
                    UNION ALL SELECT next.robot_id, next.mission_guid FROM pairs JOIN executions next ON next.id = coalesce(
                        (SELECT id FROM {completed} AND robot_id = of_robot AND mission_guid > guid ORDER BY mission_guid LIMIT 1),
                        (SELECT id FROM {completed} AND robot_id > of_robot ORDER BY robot_id, mission_guid LIMIT 1)))
                SELECT guid, of_robot, last.ended_at, last.mission, (SELECT count(duration_s) {runs}), (SELECT total(duration_s) {runs})
                FROM pairs JOIN executions last ON last.id = (
                    SELECT id FROM {completed} AND robot_id = of_robot AND mission_guid = guid ORDER BY ended_at DESC LIMIT 1)""",
            span.but_robots * 2,
        )
        found = (MissionRuns(*row) for row in rows)
        return [one for one in found if span.robot_ids is None or one.robot_id in span.robot_ids]

    def newest_durations(
        self, c: sqlite3.Connection, span: Span, guid: str, robots: Iterable[int], limit: int
    ) -> list[tuple[str, float]]:
        """(ended_at, seconds) of a mission's newest completed runs on these robots, newest first."""
        newest = [
            c.execute(
                f"""SELECT ended_at, duration_s FROM executions INDEXED BY executions_by_mission
                    WHERE ended_at >= ? AND ended_at < ? {span.of_group} AND state = 'completed' AND robot_id = ? AND mission_guid = ?
                    AND duration_s IS NOT NULL ORDER BY ended_at DESC LIMIT ?""",
                (*span.but_robots, robot, guid, limit),
            )
            for robot in robots
        ]
        merged = heapq.merge(*(map(tuple, rows) for rows in newest), reverse=True)  # reads no more than needed
        return list(islice(merged, limit))

    # ------------------------------------------------------------------ groups
    def group_starts(self, c: sqlite3.Connection, span: Span, within_s: float) -> list[GroupStarts]:
        """One for each group with planned starts that were to be sent."""
        rows = c.execute(
            f"""SELECT group_id, count(*), count(*) FILTER (WHERE
                    (julianday(submitted_at) - julianday(planned_at)) * 86400.0 + robot_delay_s <= ?), robot_group,
                    json_group_array(DISTINCT robot_id) FILTER (WHERE state = 'completed'), max(ended_at)
                FROM {_OF_GROUPS} {span.condition}
                AND (submitted_at IS NOT NULL OR reason_code IS NULL OR reason_code NOT IN ({placeholders(_NOT_OF_ROBOTS)}))
                GROUP BY group_id""",
            (within_s, *span.values, *_NOT_OF_ROBOTS),
        )
        return [GroupStarts(*row[:5]) for row in rows]

    def group_waits(self, c: sqlite3.Connection, span: Span, group_id: int, limit: int) -> list[float]:
        """Seconds from the planned instant to when the robot was chosen, of the newest ones that were sent."""
        rows = c.execute(
            f"""SELECT max(0.0, (julianday(bound_at) - julianday(planned_at)) * 86400.0) FROM {_OF_GROUPS} {span.condition}
                AND group_id = ? AND bound_at IS NOT NULL AND submitted_at IS NOT NULL ORDER BY ended_at DESC LIMIT ?""",
            (*span.values, group_id, limit),
        )
        return [row[0] for row in rows]


def _nearest_day(instant: str) -> str:
    """The UTC day whose midnight is nearest, as text."""
    return f"{to_instant(instant) + DAY / 2:%Y-%m-%d}" if instant > EARLIEST else EARLIEST
