"""The executions of the past: read in pages, counted, searched, and held to the limit of the history."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple

from app.database.execution_rows import OPEN, execution_of, select
from app.database.values import placeholders, to_instant, to_text
from app.domain.execution import Execution, ReasonCode, State, Trigger

_RUN = "state IN ('completed', 'failed', 'cancelled')"
_NOT_RUN = "state IN ('skipped', 'missed')"
PRUNED_AT_ONCE = 100  # of each kind, so that due executions never wait long for the writer
PIECE = 1000  # rows that are read at a time
IDENTIFIER_LENGTH = 36  # characters of a position's guid: people can't read it


class Replacement(NamedTuple):
    """The start ``id`` was in doubt on ``robot``, and a person had ``other`` run in its place ``at`` an instant: on ``other_robot``, or any
    of that group."""

    id: int
    robot: str
    other: int
    other_robot: str
    at: datetime


@dataclass(frozen=True)
class ExecutionFilter:
    """Filters of executions; None or an empty text: any."""

    robot_ids: Sequence[int] | None = None
    mission: str | None = None  # its name
    states: Sequence[State] | None = None
    triggers: Sequence[Trigger] | None = None
    start: datetime | None = None  # of the planned instant, included
    end: datetime | None = None  # not included
    text: str = ""  # somewhere in the names of mission, schedule or robot, in the robot's message, or in a text that
    # the mission was given, ignoring case
    group: str | None = None  # the group's name then, for starts that any of its robots could take
    reasons: Sequence[ReasonCode] = ()  # or that ended for one of these, where a text is wanted
    values: Sequence[str] = ()  # or whose mission has one of these guids as a value, if a text is searched


@dataclass(frozen=True)
class PageKey:
    """Where a page ends: the next one begins after it, even if rows were added or deleted since."""

    planned_at: datetime
    id: int

    @classmethod
    def of(cls, execution: Execution) -> PageKey:
        return cls(execution.planned_at, execution.id)


class Surplus(NamedTuple):
    """How many ended rows exceed the history limit: those that ran, and those that did not."""

    ran: int
    not_ran: int


class ExecutionHistory:
    def page(
        self, c: sqlite3.Connection, wanted: ExecutionFilter, before: PageKey | None, limit: int
    ) -> list[Execution]:
        """Newest first by planned instant; those behind ``before``, or the first."""
        where, values = _condition(wanted)
        if before is not None:
            where, values = f"{where} AND (planned_at, id) < (?, ?)", [*values, to_text(before.planned_at), before.id]
        return select(c, f"WHERE {where} ORDER BY planned_at DESC, id DESC LIMIT ?", *values, limit)

    def last_ended(self, c: sqlite3.Connection, robot_id: int, now: datetime, limit: int) -> list[Execution]:
        """Of one robot, the last one to end first, without what was planned for later."""
        of_it, ids = of_robots([robot_id])
        rest = f"WHERE {of_it} AND ended_at IS NOT NULL AND planned_at < ? ORDER BY ended_at DESC, id DESC LIMIT ?"
        return select(c, rest, *ids, to_text(now), limit)

    def counts(self, c: sqlite3.Connection, wanted: ExecutionFilter) -> dict[State, int]:
        """How many rows there are in each state."""
        where, values = _condition(wanted)
        found = c.execute(f"SELECT state, count(*) FROM executions WHERE {where} GROUP BY state", values)
        return {State(state): number for state, number in found}

    def stream(self, c: sqlite3.Connection, wanted: ExecutionFilter | None = None) -> Iterator[Execution]:
        """Oldest first by planned instant, including open ones; never all in memory.

        Read in pieces: a statement that stays open while the reader is blocked would keep the write-ahead log growing.
        """
        where, values = _condition(wanted or ExecutionFilter())
        query = f"SELECT * FROM executions WHERE {where} AND (planned_at, id) > (?, ?) ORDER BY planned_at, id LIMIT ?"
        behind: list[object] = ["", 0]
        while piece := c.execute(query, [*values, *behind, PIECE]).fetchall():
            yield from map(execution_of, piece)
            behind = [piece[-1]["planned_at"], piece[-1]["id"]]

    def replacements(self, c: sqlite3.Connection, start: datetime, end: datetime) -> list[Replacement]:
        """Of the starts that were planned in [start, end], newest first."""
        rows = c.execute(
            """SELECT mine.id, mine.robot, other.id, coalesce(nullif(other.robot, ''), other.robot_group), other.created_at
                            FROM executions mine INDEXED BY executions_planned JOIN executions other ON other.id <> mine.id
                                AND other.token = iif(json_valid(mine.revoked), mine.revoked, '{}') ->> '$.details.instead'
                            WHERE mine.planned_at >= ? AND mine.planned_at <= ? AND mine.revoked IS NOT NULL
                            ORDER BY mine.planned_at DESC, mine.id DESC""",
            (to_text(start), to_text(end)),
        )
        return [
            Replacement(number, robot, other, other_robot, to_instant(at))
            for number, robot, other, other_robot, at in rows
        ]

    def ended_since(
        self,
        c: sqlite3.Connection,
        robot_ids: Sequence[int],
        mission_guid: str,
        since: datetime,
        history_limit: int | None,
    ) -> list[Execution] | None:
        """Those of this mission on these robots that were there, or may have been. None: the history may have dropped some."""
        at, its = to_text(since), placeholders(robot_ids)
        before = c.execute(
            f"SELECT DISTINCT robot_id FROM executions WHERE robot_id IN ({its}) AND {_RUN} AND ended_at < ?",
            (*robot_ids, at),
        ).fetchall()  # the oldest of a robot are dropped first
        if history_limit is not None and len(before) < len(robot_ids):
            kept = c.execute(f"SELECT coalesce(sum(number), 0) FROM ended_days WHERE {_RUN}").fetchone()[0]
            if kept >= history_limit:
                return None
        return select(
            c,
            f"""WHERE robot_id IN ({its}) AND mission_guid = ? AND ended_at >= ? AND {_RUN}
                AND (submitted_at IS NOT NULL OR reason_code = 'unknown_outcome')""",
            *robot_ids,
            mission_guid,
            at,
        )

    def surplus(self, c: sqlite3.Connection, history_limit: int) -> Surplus:
        """What is beyond the newest N that ran (completed, failed, cancelled) and, counted apart, the newest N that did not (skipped,
        missed). Counted from the days, not from the rows."""
        ran, not_ran = c.execute(f"""SELECT coalesce(sum(number) FILTER (WHERE {_RUN}), 0),
                                            coalesce(sum(number) FILTER (WHERE {_NOT_RUN}), 0) FROM ended_days""").fetchone()
        return Surplus(max(0, ran - history_limit), max(0, not_ran - history_limit))

    def drop_oldest(self, c: sqlite3.Connection, surplus: Surplus) -> Surplus:
        """Delete the oldest of that many ended rows of each kind, 100 at most; returns how many are left to delete.
        Never deletes open rows, rows on a robot with another start that is not decided yet, rows that may still arrive
        at a robot, or replacements of rows in doubt."""
        return Surplus(
            *(
                number - self._drop_oldest(c, kind, number)
                for kind, number in zip((_RUN, _NOT_RUN), surplus, strict=True)
            )
        )

    @staticmethod
    def _drop_oldest(c: sqlite3.Connection, kind: str, number: int) -> int:
        return c.execute(
            f"""DELETE FROM executions WHERE id IN (SELECT id FROM executions WHERE ended_at IS NOT NULL AND {kind}
                             AND (queue_id IS NULL OR coalesce(robot_id, 0) NOT IN (
                                 SELECT robot_id FROM executions WHERE {OPEN} AND state = 'submitting'
                                 UNION ALL SELECT robot_id FROM executions
                                 WHERE {OPEN} AND state = 'waiting' AND robot_id IS NOT NULL AND queue_floor IS NOT NULL
                                 UNION ALL SELECT CAST(key AS INTEGER) FROM executions, json_each(iif(json_valid(tried), tried, '[]'))
                                 WHERE {OPEN} AND state = 'waiting' AND group_id IS NOT NULL))
                             AND id NOT IN (SELECT execution_id FROM watches)
                             AND token NOT IN (
                                 SELECT revoked ->> '$.details.instead' AS instead FROM executions
                                 WHERE {OPEN} AND state = 'submitting' AND instead IS NOT NULL
                                 UNION ALL SELECT revoked ->> '$.details.instead' AS instead FROM watches
                                 JOIN executions ON executions.id = execution_id WHERE instead IS NOT NULL)
                             ORDER BY ended_at, id LIMIT ?)""",
            (min(number, PRUNED_AT_ONCE),),
        ).rowcount


def of_robots(ids: Sequence[int]) -> tuple[str, list[object]]:
    """A condition and its values: the runs that were asked of these robots, and those asked of any robot of their fleet
    that one of them took."""
    its = placeholders(ids)
    return (
        f"""(robot_id IN ({its}) OR robot_id IN (SELECT id FROM current_robots WHERE vehicle = 'any') AND (robot_id, taken_by) IN (
        SELECT whichever.id, taker.name FROM current_robots AS taker JOIN current_robots AS whichever USING (fleet_id)
        WHERE whichever.vehicle = 'any' AND taker.id IN ({its})))""",
        [*ids, *ids],
    )


def _condition(wanted: ExecutionFilter) -> tuple[str, list[object]]:
    """The WHERE of a filter and its values."""
    parts, values = ["1"], []  # type: list[str], list[object]

    def demand(part: str, *bound: object) -> None:
        parts.append(part)
        values.extend(bound)

    if wanted.robot_ids is not None:
        of_them, ids = of_robots(wanted.robot_ids)
        demand(of_them, *ids)
    if wanted.group is not None:
        demand("robot_group = ?", wanted.group)
    if wanted.mission is not None:
        demand("mission = ?", wanted.mission)
    if wanted.states is not None:
        demand(f"state IN ({placeholders(wanted.states)})", *wanted.states)
    if wanted.triggers is not None:
        demand(f"trigger IN ({placeholders(wanted.triggers)})", *wanted.triggers)
    if wanted.start is not None:
        demand("planned_at >= ?", to_text(wanted.start))
    if wanted.end is not None:
        demand("planned_at < ?", to_text(wanted.end))
    if text := wanted.text.strip():
        demand(
            f"""(instr(casefold(mission || char(10) || schedule || char(10) || robot || char(10)
                               || coalesce(json_extract(reason_details, '$.message'), '')), ?)
                    OR reason_code IN ({placeholders(wanted.reasons)})
                    OR parameters <> '{{}}' AND EXISTS (SELECT 1 FROM json_each(parameters) WHERE type = 'text'
                        AND (value IN ({placeholders(wanted.values)})
                             OR length(value) < {IDENTIFIER_LENGTH} AND instr(casefold(value), ?))))""",
            text.casefold(),
            *wanted.reasons,
            *wanted.values,
            text.casefold(),
        )
    return " AND ".join(parts), values
