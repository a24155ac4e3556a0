"""The execution ledger's rows."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterable, Sequence
from datetime import datetime, timedelta
from typing import Any, NamedTuple

from app.database.execution_rows import (
    INSERT,
    OPEN,
    PLACES,
    execution_of,
    row_of,
    select,
    stored_values,
    text_to_reason,
    with_values,
)
from app.database.schedules import OPEN_OF_WHOLE
from app.database.values import from_json, placeholders, to_optional_instant, to_optional_text, to_text
from app.domain.execution import OPEN_STATES, Execution, Reason, ReasonCode, State

NEVER_SENT = """(attempts = 0 OR (queue_floor IS NULL AND NOT EXISTS (         -- Execution.was_never_sent
    SELECT 1 FROM json_each(iif(json_valid(tried), tried, '{}')) WHERE json_extract(value, '$.floor') IS NOT NULL)))"""
_ADDED_AT_ONCE = 100  # rows in one statement


class Unsent(NamedTuple):
    """The stored facts that decide whether an execution without a robot must be handled now."""

    id: int
    state: str
    closes_at: str
    is_cancelled: int
    wait: str


class ExecutionRepository:
    # ------------------------------------------------------------------ writing
    def add_once(self, c: sqlite3.Connection, execution: Execution) -> Execution | None:
        """Returns it with its id; None if the instant or the token is in the ledger already."""
        return next(iter(self.add_each_once(c, [execution])), None)

    def add_each_once(self, c: sqlite3.Connection, executions: Sequence[Execution]) -> list[Execution]:
        """Those that were not in the ledger yet, with their ids."""
        added: list[Execution] = []
        for start in range(0, len(executions), _ADDED_AT_ONCE):
            batch = executions[start : start + _ADDED_AT_ONCE]
            values = [value for execution in batch for value in row_of(execution)]
            new = c.execute(
                f"{INSERT}{f', {PLACES}' * (len(batch) - 1)} ON CONFLICT DO NOTHING RETURNING token, id", values
            )
            ids = dict(map(tuple, new))
            added += [with_values(execution, id=ids[execution.token]) for execution in batch if execution.token in ids]
        return added

    def add_many(self, c: sqlite3.Connection, executions: Iterable[Execution]) -> int:
        """Thousands at once, skipping those in the ledger already; returns how many were new."""
        return max(0, c.executemany(f"{INSERT} ON CONFLICT DO NOTHING", map(row_of, executions)).rowcount)

    def change(
        self, c: sqlite3.Connection, execution: Execution, expected: Sequence[State], **columns: Any
    ) -> Execution | None:
        """Change columns of a row that is still in one of the expected states and still has that robot, or none. Returns
        the row after the change, or None if nothing was changed. Values are those of ``Execution`` (``reason`` sets or,
        with None, clears code and details).
        """
        values = stored_values(columns)
        assignments = ", ".join(f"{name} = ?" for name in values)
        row = c.execute(
            f"""UPDATE executions SET {assignments} WHERE id = ? AND state IN ({placeholders(expected)})
                            AND robot_id IS ? RETURNING *""",
            (*values.values(), execution.id, *expected, execution.robot_id),
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
            "withdrawn": text_to_reason(row[1]),
            "held": bool(row[2]),
        }
        return with_values(execution, **{**wishes, **columns})

    def waiting_of_group(self, c: sqlite3.Connection, group_id: int) -> list[Execution]:
        """A group's starts that no robot has, oldest first."""
        return select(
            c,
            f"""INDEXED BY executions_open WHERE {OPEN} AND state = 'waiting' AND group_id = ?
                                 ORDER BY planned_at, id""",
            group_id,
        )

    def open_of_schedule(
        self, c: sqlite3.Connection, schedule_id: int, states: Sequence[State] = OPEN_STATES
    ) -> list[Execution]:
        """What is not over, or in some of these states, oldest first."""
        return select(
            c,
            f"""INDEXED BY executions_open_of_schedule WHERE schedule_id = ? AND {OPEN}
                                 AND state IN ({placeholders(states)}) ORDER BY planned_at""",
            schedule_id,
            *states,
        )

    def unplanned_after(self, c: sqlite3.Connection, instant: datetime) -> list[Execution]:
        """Starts without a schedule that no robot has yet, from a later time."""
        return select(
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
        return select(
            c,
            f"WHERE {OPEN} AND state = 'waiting' AND planned_at <= ? AND closes_at > ?",
            to_text(now),
            to_text(since),
        )

    # ------------------------------------------------------------------ reading
    def get(self, c: sqlite3.Connection, execution_id: int) -> Execution | None:
        return _one(c, "WHERE id = ?", execution_id)

    def by_token(self, c: sqlite3.Connection, token: str) -> Execution | None:
        return _one(c, "WHERE token = ?", token)

    def open_for(self, c: sqlite3.Connection, robot_id: int, states: Sequence[State] = OPEN_STATES) -> list[Execution]:
        """Open ones of a robot, or those of them in some states, oldest first."""
        return select(
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
        return select(c, f"WHERE id IN ({placeholders(ids)}) AND state IN ({placeholders(states)})", *ids, *states)

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
        return select(c, f"INDEXED BY executions_open WHERE {OPEN} ORDER BY planned_at, id")

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
        return _one(c, "WHERE schedule_id = ? ORDER BY planned_at DESC LIMIT 1", schedule_id)

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


def _one(c: sqlite3.Connection, rest: str, value: object) -> Execution | None:
    return next(iter(select(c, rest, value)), None)
