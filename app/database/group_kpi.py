"""What the figures of groups are computed from: their planned starts that ended in a period, from one index; and how long runs took."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from typing import NamedTuple

from app.database.kpi import NOBODY, KpiRepository, Span
from app.database.values import placeholders
from app.domain.models import ReasonCode, State

_DELAY = "(julianday(submitted_at) - julianday(planned_at)) * 86400.0 + robot_delay_s"
# Ended without having been sent because a person wanted it so; or the tablet was off. Neither says anything about the robots.
_LEFT_OUT = (
    ReasonCode.HOLD,
    ReasonCode.USER_CANCELLED,
    ReasonCode.QUEUE_CLEARED,
    ReasonCode.SCHEDULE_CHANGED,
    ReasonCode.ROBOT_REMOVED,
    ReasonCode.APP_DOWN,
    ReasonCode.CLOCK_IMPLAUSIBLE,
)


class GroupSum(NamedTuple):
    """``starts``: those that were to be sent; ``in_time`` of them began on a robot within the given seconds."""

    group_id: int
    starts: int
    in_time: int


class GroupKpiRepository:
    def sums(self, c: sqlite3.Connection, span: Span, within_s: float) -> list[GroupSum]:
        """One for each group with any."""
        where, values = self._where(span)
        rows = c.execute(
            f"""SELECT group_id, count(*), count(*) FILTER (WHERE {_DELAY} <= ?)
                             FROM executions INDEXED BY executions_of_groups
                             WHERE {where} AND (submitted_at IS NOT NULL OR reason_code IS NULL
                                                OR reason_code NOT IN ({placeholders(_LEFT_OUT)}))
                             GROUP BY group_id""",
            (within_s, *values, *_LEFT_OUT),
        )
        return [GroupSum(*row) for row in rows]

    def waits(self, c: sqlite3.Connection, span: Span, group_id: int, limit: int) -> list[float]:
        """Seconds from the planned instant to when the robot was chosen, of the newest ones that were sent."""
        where, values = self._where(span)
        rows = c.execute(
            f"""SELECT max(0.0, (julianday(bound_at) - julianday(planned_at)) * 86400.0)
                             FROM executions INDEXED BY executions_of_groups
                             WHERE group_id = ? AND {where} AND bound_at IS NOT NULL AND submitted_at IS NOT NULL
                             ORDER BY ended_at DESC LIMIT ?""",
            (group_id, *values, limit),
        )
        return [row[0] for row in rows]

    def runs(self, c: sqlite3.Connection, span: Span, group_id: int) -> dict[int, int]:
        """How many of its starts each robot ran, by its id."""
        where, values = self._where(span)
        rows = c.execute(
            f"""SELECT robot_id, count(*) FROM executions INDEXED BY executions_of_groups
                             WHERE group_id = ? AND {where} AND robot_id IS NOT NULL AND state = '{State.COMPLETED}'
                             GROUP BY robot_id""",
            (group_id, *values),
        )
        return dict(map(tuple, rows))

    def name_of_removed(self, c: sqlite3.Connection, group_id: int) -> str:
        """What a group that is no longer configured was called."""
        row = c.execute(
            """SELECT robot_group FROM executions INDEXED BY executions_of_groups WHERE group_id = ? AND ended_at IS NOT NULL
                           AND trigger = 'scheduled' ORDER BY ended_at DESC LIMIT 1""",
            (group_id,),
        ).fetchone()
        return row[0] if row else ""

    @staticmethod
    def _where(span: Span) -> tuple[str, list[object]]:
        where, values = (
            "group_id IS NOT NULL AND ended_at >= ? AND ended_at < ? AND trigger = 'scheduled'",
            [span.start, span.end],
        )
        if span.robot_ids is None:
            return where, list(values)
        robots = span.robot_ids or NOBODY
        return f"{where} AND robot_id IN ({placeholders(robots)})", [*values, *robots]


def timed_runs(
    c: sqlite3.Connection, start: str, end: str, robot_ids: Sequence[int] | None
) -> list[tuple[int, str, str, float]]:
    """(robot, guid, ended, seconds) of completed runs of at most a day: by robot, mission and time."""
    robots = KpiRepository.robots(c) if robot_ids is None else robot_ids
    rows = c.execute(
        f"""SELECT robot_id, mission_guid, ended_at, duration_s FROM executions INDEXED BY executions_by_mission
                         WHERE state = 'completed' AND robot_id IN ({placeholders(robots or NOBODY)}) AND ended_at >= ? AND ended_at < ?
                         AND duration_s BETWEEN 0 AND 86400 ORDER BY robot_id, mission_guid, ended_at""",
        (*(robots or NOBODY), start, end),
    )
    return [(row[0], row[1], row[2], row[3]) for row in rows]
