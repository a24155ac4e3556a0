"""Data for suggestions, and people's answers to them. Past instants are seconds since 1970 here, as many are
compared."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

from app.database.values import from_json, to_instant, to_json, to_text

ACCEPTED, DISMISSED = "accepted", "dismissed"
KEPT_FOR = timedelta(days=180)


class PastRun(NamedTuple):
    """An ended row of the ledger. ``schedule``, ``robot`` 0: none; ``started`` None: it never ran."""

    id: int
    schedule: int
    robot: int
    trigger: str
    reason: str
    mission: str
    planned: float
    started: float | None
    ended: float | None


_PLANNED = PastRun._fields.index("planned")  # None if a database from elsewhere has no instant there


@dataclass(frozen=True)
class Answer:
    """The answer to a finding about a schedule, with its numbers then: ``late`` of ``starts``. ``option``: the accepted
    one."""

    schedule_id: int
    answer: str
    at: datetime
    late: int
    starts: int
    option: Mapping[str, Any] = field(default_factory=dict)
    id: int = 0


class SuggestionRepository:
    # ------------------------------------------------------------------ the past
    def runs(self, c: sqlite3.Connection, since: datetime) -> list[PastRun]:
        """Ended starts planned since then, in order of time."""
        rows = c.execute(
            f"""{_RUNS} INDEXED BY executions_planned WHERE planned_at >= ? AND ended_at IS NOT NULL ORDER BY planned_at""",
            (to_text(since),),
        )
        return [PastRun(*row) for row in rows if row[_PLANNED] is not None]

    def runs_of(self, c: sqlite3.Connection, schedule_id: int, since: datetime) -> list[PastRun]:
        """The same of one schedule."""
        rows = c.execute(
            f"{_RUNS} WHERE schedule_id = ? AND planned_at >= ? AND ended_at IS NOT NULL ORDER BY planned_at",
            (schedule_id, to_text(since)),
        )
        return [PastRun(*row) for row in rows if row[_PLANNED] is not None]

    def activity_at(self, c: sqlite3.Connection, robot_id: int, instant: float) -> str:
        """A robot's activity at that time; empty: unknown."""
        at = to_text(datetime.fromtimestamp(instant, UTC))
        row = c.execute(
            """SELECT activity, ended_at FROM activity_spans WHERE robot_id = ? AND started_at <= ?
               ORDER BY started_at DESC LIMIT 1""",
            (robot_id, at),
        ).fetchone()
        return row[0] if row and row[1] > at else ""

    # ------------------------------------------------------------------ answers
    def answers(self, c: sqlite3.Connection) -> list[Answer]:
        """Oldest first. One that can't be read, in a database from elsewhere, is omitted: it only suppresses a
        suggestion."""
        rows = c.execute(
            "SELECT schedule_id, answer, answered_at, late, starts, option, id FROM suggestion_answers ORDER BY id"
        )
        return [answer for row in rows if (answer := _answer(row)) is not None]

    def answer(self, c: sqlite3.Connection, new: Answer) -> Answer:
        """Returns it with its id. Those of long ago are deleted."""
        c.execute("DELETE FROM suggestion_answers WHERE answered_at < ?", (to_text(new.at - KEPT_FOR),))
        cursor = c.execute(
            """INSERT INTO suggestion_answers (schedule_id, answer, answered_at, late, starts, option)
                              VALUES (?, ?, ?, ?, ?, ?)""",
            (new.schedule_id, new.answer, to_text(new.at), new.late, new.starts, to_json(new.option)),
        )
        return replace(new, id=cursor.lastrowid or 0)

    def remove(self, c: sqlite3.Connection, answer_id: int) -> None:
        c.execute("DELETE FROM suggestion_answers WHERE id = ?", (answer_id,))


def _answer(row: sqlite3.Row) -> Answer | None:
    try:
        at, option = to_instant(row[2]), from_json(row[5])
    except (ValueError, RecursionError):
        return None
    is_sound = at.tzinfo is not None and row[4] > 0 and isinstance(option, dict)
    return Answer(row[0], row[1], at, row[3], row[4], option, row[6]) if is_sound else None


def _seconds(column: str) -> str:
    return f"(julianday({column}) - 2440587.5) * 86400.0"


# By the tablet's clock, like key figures: accepted, plus the robot's own waiting time in its queue.
_RUNS = f"""SELECT id, coalesce(schedule_id, 0), coalesce(robot_id, 0), trigger, coalesce(reason_code, ''), mission,
                   {_seconds("planned_at")}, coalesce({_seconds("submitted_at")} + robot_delay_s, {_seconds("started_at")}),
                   {_seconds("ended_at")} FROM executions"""
