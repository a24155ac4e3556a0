"""The execution ledger's rows."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import datetime, timedelta
from operator import attrgetter
from types import MappingProxyType
from typing import Any, NamedTuple

from app.database.schedules import OPEN_OF_WHOLE
from app.database.values import (
    from_json,
    placeholders,
    to_instant,
    to_json,
    to_optional_instant,
    to_optional_text,
    to_text,
)
from app.domain.models import OPEN_STATES, Execution, Reason, ReasonCode, State, Trigger, Wait

OPEN = "state IN ('waiting', 'submitting', 'queued', 'executing')"
NEVER_SENT = """(attempts = 0 OR (queue_floor IS NULL AND NOT EXISTS (         -- Execution.was_never_sent
    SELECT 1 FROM json_each(iif(json_valid(tried), tried, '{}')) WHERE json_extract(value, '$.floor') IS NOT NULL)))"""
_RUN = "state IN ('completed', 'failed', 'cancelled')"
_NOT_RUN = "state IN ('skipped', 'missed')"
UNBOUND: dict[str, Any] = {
    "robot_id": None,
    "robot": "",
    "bound_at": None,
    "choice": {},
    "queue_floor": None,
    "robot_address": None,
    "robot_serial": None,
}
_ADDED_AT_ONCE = 100  # rows in one statement
PRUNED_AT_ONCE = 100  # of each kind, so that due executions never wait long for the writer

_INSTANTS = (
    "listed_until",
    "finish_by",
    "bound_at",
    "begun_at",
    "planned_at",
    "moved_from",
    "closes_at",
    "created_at",
    "submitted_at",
    "started_at",
    "ended_at",
)
_OBJECTS = ("parameters", "wait_details", "choice", "tried")
_FIELDS = tuple(field.name for field in fields(Execution) if field.name != "id")
_PLAIN = tuple(name for name in _FIELDS if name != "reason")  # one column each
_COLUMN_OF = {"listed_until": "hold_until", "withdrawn": "revoked"}  # where it has another name than its field
_COLUMNS = (*(_COLUMN_OF.get(name, name) for name in _PLAIN), "reason_code", "reason_details")


class Replacement(NamedTuple):
    """The start ``id`` was in doubt on ``robot``, and a person had ``other`` run in its place ``at`` an instant: on ``other_robot``, or any
    of that group."""

    id: int
    robot: str
    other: int
    other_robot: str
    at: datetime


PIECE = 1000  # rows that are read at a time
IDENTIFIER_LENGTH = 36  # characters of a position's guid: people can't read it


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


class Unsent(NamedTuple):
    """The stored facts that decide whether an execution without a robot must be handled now."""

    id: int
    state: str
    closes_at: str
    is_cancelled: int
    wait: str


class Surplus(NamedTuple):
    """How many ended rows exceed the history limit: those that ran, and those that did not."""

    ran: int
    not_ran: int


class ExecutionRepository:
    # ------------------------------------------------------------------ writing
    def add(self, c: sqlite3.Connection, execution: Execution) -> Execution:
        """Returns it with its id. Raises sqlite3.IntegrityError when the occurrence or the token is in the ledger already."""
        row = c.execute(f"{_INSERT} RETURNING *", _row_of(execution)).fetchone()
        return execution_of(row)

    def add_once(self, c: sqlite3.Connection, execution: Execution) -> Execution | None:
        """The same, but None if the instant or the token is in the ledger already."""
        return next(iter(self.add_each_once(c, [execution])), None)

    def add_each_once(self, c: sqlite3.Connection, executions: Sequence[Execution]) -> list[Execution]:
        """Those that were not in the ledger yet, with their ids."""
        added: list[Execution] = []
        for start in range(0, len(executions), _ADDED_AT_ONCE):
            batch = executions[start : start + _ADDED_AT_ONCE]
            values = [value for execution in batch for value in _row_of(execution)]
            new = c.execute(
                f"{_INSERT}{f', {_PLACES}' * (len(batch) - 1)} ON CONFLICT DO NOTHING RETURNING token, id", values
            )
            ids = dict(map(tuple, new))
            added += [_with(execution, id=ids[execution.token]) for execution in batch if execution.token in ids]
        return added

    def add_many(self, c: sqlite3.Connection, executions: Iterable[Execution]) -> int:
        """Thousands at once, skipping those in the ledger already; returns how many were new."""
        return max(0, c.executemany(f"{_INSERT} ON CONFLICT DO NOTHING", map(_row_of, executions)).rowcount)

    def change(
        self,
        c: sqlite3.Connection,
        execution_id: int,
        expected: Sequence[State],
        of_robot: int | None = -1,
        **columns: Any,
    ) -> Execution | None:
        """Change columns of a row that is still in one of the expected states and, with ``of_robot``, still has that
        robot (None: no robot). Returns the row after the change, or None if its state was different: then nothing was
        changed. Values are those of ``Execution`` (``reason`` sets or, with None, clears code and details).
        """
        values = stored_values(columns)
        assignments = ", ".join(f"{name} = ?" for name in values)
        row = c.execute(
            f"""UPDATE executions SET {assignments} WHERE id = ? AND state IN ({placeholders(expected)})
                            AND (? = -1 OR robot_id IS ?) RETURNING *""",
            (*values.values(), execution_id, *expected, of_robot, of_robot),
        ).fetchone()
        return row and execution_of(row)

    def change_owned(
        self, c: sqlite3.Connection, execution: Execution, expected: Sequence[State], **columns: Any
    ) -> Execution | None:
        """The same for a row that only the caller and operators change: only what operators change is read again."""
        values = stored_values(columns)
        assignments = ", ".join(f"{name} = ?" for name in values)
        where = f"id = ? AND state IN ({placeholders(expected)})"
        row = c.execute(
            f"UPDATE executions SET {assignments} WHERE {where} RETURNING cancel_code, revoked, held",
            (*values.values(), execution.id, *expected),
        ).fetchone()
        if row is None:
            return None
        wishes = {
            "cancel_code": row[0] and ReasonCode(row[0]),
            "withdrawn": _text_to_reason(row[1]),
            "held": bool(row[2]),
        }
        return _with(execution, **{**wishes, **columns})

    def waiting_of_group(self, c: sqlite3.Connection, group_id: int) -> list[Execution]:
        """A group's starts that no robot has, oldest first."""
        return self._list(
            c,
            f"""INDEXED BY executions_open WHERE {OPEN} AND state = 'waiting' AND group_id = ?
                                 ORDER BY planned_at, id""",
            group_id,
        )

    def open_of_schedule(
        self, c: sqlite3.Connection, schedule_id: int, states: Sequence[State] = OPEN_STATES
    ) -> list[Execution]:
        """What is not over, or in some of these states, oldest first."""
        return self._list(
            c,
            f"""INDEXED BY executions_open_of_schedule WHERE schedule_id = ? AND {OPEN}
                                 AND state IN ({placeholders(states)}) ORDER BY planned_at""",
            schedule_id,
            *states,
        )

    def unplanned_after(self, c: sqlite3.Connection, instant: datetime) -> list[Execution]:
        """Starts without a schedule that no robot has yet, from a later time."""
        return self._list(
            c,
            f"""WHERE {OPEN} AND state IN ('waiting', 'submitting') AND schedule_id IS NULL AND planned_at > ?""",
            to_text(instant),
        )

    def drop_withdrawn(self, c: sqlite3.Connection, schedule_id: int, since: datetime) -> None:
        """Delete the unsent, withdrawn row of an instant that is planned again."""
        c.execute(
            f"""DELETE FROM executions WHERE schedule_id = ? AND planned_at >= ? AND state = 'cancelled' AND {NEVER_SENT}
                      AND reason_code IN ('schedule_changed', 'robot_removed')""",
            (schedule_id, to_text(since)),
        )

    def drop_skipped(self, c: sqlite3.Connection, schedule_id: int, planned_at: datetime) -> None:
        """Delete the row of a skipped start that a person wants again: nothing of it was sent."""
        c.execute(
            f"""DELETE FROM executions WHERE schedule_id = ? AND planned_at = ? AND state = 'skipped' AND reason_code = 'hold'
                      AND {NEVER_SENT}""",
            (schedule_id, to_text(planned_at)),
        )

    def make_room_after(self, c: sqlite3.Connection, schedule_id: int, through: datetime, now: datetime) -> datetime:
        """The clock has been set back: delete rows with nothing ever sent whose instants are planned again, so that no
        row waits for an instant to come. Starts that a person cancelled are skipped then, and held starts are held
        again. Returns up to when there are still rows: before ``through`` where a row that left stood for starts before
        it, too."""
        values = schedule_id, to_text(through)
        unsent = f"""schedule_id = ? AND planned_at > ? AND state NOT IN ('submitting', 'queued', 'executing', 'completed')
                     AND {NEVER_SENT}"""
        is_unwanted = "(cancel_code IS NOT NULL OR reason_code IN ('user_cancelled', 'queue_cleared'))"
        c.execute(
            f"""INSERT OR REPLACE INTO skips SELECT schedule_id, planned_at, 0 FROM executions
                      WHERE {unsent} AND {is_unwanted}""",
            values,
        )
        c.execute(
            f"""INSERT OR IGNORE INTO skips SELECT schedule_id, planned_at, 1 FROM executions
                      WHERE {unsent} AND state = 'waiting' AND executions.held = 1""",
            values,
        )
        is_skip = "planned_at IN (SELECT planned_at FROM skips WHERE skips.schedule_id = executions.schedule_id AND skips.held = 0)"
        columns = stored_values(
            {
                "state": State.SKIPPED,
                "reason": Reason(ReasonCode.HOLD, {"skipped_at": now.isoformat()}),
                "cancel_code": None,
            }
        )
        assignments = ", ".join(f"{name} = ?" for name in columns)
        c.execute(
            f"""UPDATE executions SET {assignments}, ended_at = planned_at WHERE {unsent} AND {is_skip}
                      AND (state <> 'skipped' OR reason_code <> 'hold' OR reason_details ->> 'skipped_at' IS NULL)""",
            (*columns.values(), *values),
        )
        gone = c.execute(
            f"""DELETE FROM executions WHERE {unsent} AND NOT {is_skip}
                             RETURNING iif(starts > 1, reason_details ->> '$.first', NULL)""",
            values,
        ).fetchall()
        return min(
            [through, *(datetime.fromisoformat(first) - timedelta(microseconds=1) for (first,) in gone if first)]
        )

    def late(self, c: sqlite3.Connection, since: datetime, now: datetime) -> list[Execution]:
        """What waits and fell due in an absence that began ``since``."""
        return self._list(
            c,
            f"WHERE {OPEN} AND state = 'waiting' AND planned_at <= ? AND closes_at > ?",
            to_text(now),
            to_text(since),
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
        if not number:
            return 0
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

    # ------------------------------------------------------------------ reading
    def get(self, c: sqlite3.Connection, execution_id: int) -> Execution | None:
        return self._one(c, "WHERE id = ?", execution_id)

    def by_token(self, c: sqlite3.Connection, token: str) -> Execution | None:
        return self._one(c, "WHERE token = ?", token)

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

    def open_for(self, c: sqlite3.Connection, robot_id: int, states: Sequence[State] = OPEN_STATES) -> list[Execution]:
        """Open ones of a robot, or those of them in some states, oldest first."""
        return self._list(
            c,
            f"WHERE robot_id = ? AND {OPEN} AND state IN ({placeholders(states)}) ORDER BY planned_at, id",
            robot_id,
            *states,
        )

    def unsent_of(self, c: sqlite3.Connection, robot_id: int) -> list[Unsent]:
        """Starts that wait for a robot or are being sent to it, in no order. Read as one row: between any two, other
        threads may take the interpreter, and for an unreachable robot hundreds wait."""
        found: str = c.execute(
            f"""SELECT json_group_array(json_array(id, state, closes_at, cancel_code IS NOT NULL, wait)) FROM executions
                                   WHERE robot_id = ? AND {OPEN} AND state IN ('waiting', 'submitting')""",
            (robot_id,),
        ).fetchone()[0]
        return [Unsent(*each) for each in from_json(found)]

    def in_states(self, c: sqlite3.Connection, ids: Sequence[int], states: Sequence[State]) -> list[Execution]:
        """Those of these rows that are in one of the states, in no order."""
        if not ids:
            return []
        return self._list(c, f"WHERE id IN ({placeholders(ids)}) AND state IN ({placeholders(states)})", *ids, *states)

    def has_sent(self, c: sqlite3.Connection, robot_id: int) -> bool:
        """Whether anything open of a robot is with it, or may be."""
        found = c.execute(
            f"""SELECT 1 FROM executions WHERE robot_id = ? AND {OPEN} AND state IN ('submitting', 'queued', 'executing')
                              LIMIT 1""",
            (robot_id,),
        ).fetchone()
        return found is not None

    def waited_for(self, c: sqlite3.Connection, robot_ids: Collection[int]) -> set[int]:
        """Those of these robots for which something waits."""
        rows = c.execute(
            f"""SELECT DISTINCT robot_id FROM executions
                             WHERE robot_id IN ({placeholders(robot_ids)}) AND {OPEN} AND state = 'waiting'""",
            (*robot_ids,),
        )
        return {row[0] for row in rows}

    def open_all(self, c: sqlite3.Connection) -> list[Execution]:
        """Open ones of all robots, oldest first."""
        return self._list(c, f"INDEXED BY executions_open WHERE {OPEN} ORDER BY planned_at, id")

    def open_of_schedules(self, c: sqlite3.Connection, whole_ids: Collection[int]) -> dict[int, datetime | None]:
        """Of those of these schedules whose runs must not overlap: the instant of the newest open start, a moved one
        included; None: none is open."""
        if not whole_ids:
            return {}  # SQLite finds no way to look up nothing in that index
        rows = c.execute(
            f"""SELECT whole.id, max(planned_at) FROM {OPEN_OF_WHOLE}
                WHERE whole.id IN ({placeholders(whole_ids)}) AND whole.overlap = 'skip' GROUP BY whole.id""",
            (*whole_ids,),
        )
        return {whole_id: to_optional_instant(planned_at) for whole_id, planned_at in rows}

    def has_instant(self, c: sqlite3.Connection, schedule_id: int, planned_at: datetime) -> bool:
        """Whether there is a row for that instant of a schedule."""
        return (
            c.execute(
                "SELECT 1 FROM executions WHERE schedule_id = ? AND planned_at = ?", (schedule_id, to_text(planned_at))
            ).fetchone()
            is not None
        )

    def last_of_schedule(self, c: sqlite3.Connection, schedule_id: int) -> Execution | None:
        """The one with the latest planned instant."""
        return self._one(c, "WHERE schedule_id = ? ORDER BY planned_at DESC LIMIT 1", schedule_id)

    def low_batteries(self, c: sqlite3.Connection, robot_id: int, since: datetime) -> list[datetime]:
        """Planned instants of a robot's scheduled runs that were skipped since then because its battery stayed too low."""
        rows = c.execute(
            """SELECT planned_at FROM executions WHERE state = 'skipped' AND reason_code = 'battery_low' AND ended_at >= ?
                            AND robot_id = ? AND trigger = 'scheduled'""",
            (to_text(since), robot_id),
        )
        return [to_instant(row[0]) for row in rows]

    def is_claimed(self, c: sqlite3.Connection, robot_id: int, queue_id: int, since: datetime | None = None) -> bool:
        """Whether a queue item of a robot, or an order of its fleet, belongs to a row that had not ended at ``since``
        (None: to any): before, the number may have been another's. Asked only for those that forget descriptions, about
        items newer than a request of unknown outcome; their rows are kept that long."""
        found = c.execute(
            """SELECT 1 FROM executions WHERE queue_id = ?2 AND coalesce(ended_at >= ?3, TRUE) AND (robot_id = ?1 OR robot_id IN
                   (SELECT others.id FROM current_robots AS others JOIN current_robots AS own USING (fleet_id) WHERE own.id = ?1))
               LIMIT 1""",
            (robot_id, queue_id, to_optional_text(since)),
        ).fetchone()
        return found is not None

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
        return self._list(
            c,
            f"""WHERE robot_id IN ({its}) AND mission_guid = ? AND ended_at >= ? AND {_RUN}
                AND (submitted_at IS NOT NULL OR reason_code = 'unknown_outcome')""",
            *robot_ids,
            mission_guid,
            at,
        )

    # ------------------------------------------------------------------ history
    def page(
        self, c: sqlite3.Connection, wanted: ExecutionFilter, before: PageKey | None, limit: int
    ) -> list[Execution]:
        """Newest first by planned instant; those behind ``before``, or the first."""
        where, values = _condition(wanted)
        if before is not None:
            where, values = f"{where} AND (planned_at, id) < (?, ?)", [*values, to_text(before.planned_at), before.id]
        return self._list(c, f"WHERE {where} ORDER BY planned_at DESC, id DESC LIMIT ?", *values, limit)

    def last_ended(self, c: sqlite3.Connection, robot_id: int, now: datetime, limit: int) -> list[Execution]:
        """Of one robot, the last one to end first, without what was planned for later."""
        of_it, ids = of_robots([robot_id])
        rest = f"WHERE {of_it} AND ended_at IS NOT NULL AND planned_at < ? ORDER BY ended_at DESC, id DESC LIMIT ?"
        return self._list(c, rest, *ids, to_text(now), limit)

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

    @staticmethod
    def _one(c: sqlite3.Connection, rest: str, value: object) -> Execution | None:
        row = c.execute(f"SELECT * FROM executions {rest}", (value,)).fetchone()
        return row and execution_of(row)

    @staticmethod
    def _list(c: sqlite3.Connection, rest: str, *values: object) -> list[Execution]:
        return [execution_of(row) for row in c.execute(f"SELECT * FROM executions {rest}", values)]


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

    def demand(part: str, *given: object) -> None:
        parts.append(part)
        values.extend(given)

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


_PLACES = f"(?, {', '.join('?' for _ in _COLUMNS)})"
_INSERT = f"INSERT INTO executions (id, {', '.join(_COLUMNS)}) VALUES {_PLACES}"


def _with(execution: Execution, **values: Any) -> Execution:
    """The same with other values. ``dataclasses.replace`` takes six times as long, three times for each start."""
    made = object.__new__(Execution)
    made.__dict__.update(execution.__dict__, **values)
    return made


def _reason_to_text(reason: Reason) -> str:
    return to_json({"code": reason.code, "details": reason.details})


def _text_to_reason(text: str | None) -> Reason | None:
    if text is None:
        return None
    stored = from_json(text)
    return Reason(ReasonCode(stored["code"]), stored["details"])


_TO_COLUMN: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {**dict.fromkeys(_INSTANTS, to_text), **dict.fromkeys(_OBJECTS, to_json), "withdrawn": _reason_to_text}
)
_CONVERTERS = tuple(_TO_COLUMN.get(name) for name in _PLAIN)
_plain_values = attrgetter(*_PLAIN)


def stored_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Columns and their stored values, of fields and their values."""
    stored: dict[str, Any] = {}
    for name, value in values.items():
        if name == "reason":
            stored["reason_code"] = value and value.code
            stored["reason_details"] = to_json(value.details if value else {})
        elif name not in _FIELDS:
            raise ValueError(f"an execution has no {name!r}")
        else:
            convert = _TO_COLUMN.get(name)
            stored[_COLUMN_OF.get(name, name)] = value if convert is None or value is None else convert(value)
    return stored


def _row_of(execution: Execution) -> tuple[Any, ...]:
    reason = execution.reason
    plain = [
        value if convert is None or value is None else convert(value)
        for convert, value in zip(_CONVERTERS, _plain_values(execution), strict=True)
    ]
    return execution.id or None, *plain, reason and reason.code, to_json(reason.details) if reason else "{}"


_FROM_COLUMN: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {
        **dict.fromkeys(_INSTANTS, to_instant),
        **dict.fromkeys(_OBJECTS, from_json),
        "trigger": Trigger,
        "state": State,
        "wait": Wait,
        "cancel_code": ReasonCode,
        "withdrawn": _text_to_reason,
        "held": bool,
    }
)


def execution_of(row: sqlite3.Row) -> Execution:
    """The execution in a row of all columns."""
    values = dict(zip(row.keys(), row, strict=True))  # a row looks for each name among all of them
    code, details = values.pop("reason_code"), values.pop("reason_details")
    values["reason"] = Reason(ReasonCode(code), from_json(details)) if code else None
    for name, column in _COLUMN_OF.items():
        values[name] = values.pop(column)
    for name, convert in _FROM_COLUMN.items():
        if (stored := values[name]) is not None:
            values[name] = convert(stored)
    made = object.__new__(Execution)  # as in ``_with``
    made.__dict__.update(values)
    return made
