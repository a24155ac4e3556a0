"""Alarms: one open row per code and key, counted when it happens again. Those of a robot are read with its present name."""

from __future__ import annotations

import sqlite3
from datetime import datetime

from app.database.values import from_json, to_instant, to_json, to_optional_instant, to_optional_text, to_text
from app.domain.models import Alarm, Priority

_STANDING = "(cleared_at IS NULL OR acknowledged_at IS NULL)"
_PAST_OF_A_KIND = 50  # past alarms of one kind that are kept in any case
OPEN_OF_A_KIND = 20  # events of one kind that stay open side by side; further ones are counted by the newest
# A kind: the same code of the same robot, or of the same object without a robot.
_KIND = "code, coalesce('robot:' || json_extract(details, '$.robot_id'), key)"
_SELECT = """SELECT *, (SELECT name FROM current_robots AS robots WHERE alarms.key = 'robot:' || robots.id
                                               OR robots.id = json_extract(alarms.details, '$.robot_id')) AS robot FROM alarms"""


class AlarmRepository:
    def raise_once(self, c: sqlite3.Connection, alarm: Alarm) -> bool:
        """Returns whether it is new. An open alarm of the same code and key is counted up: an event (which is cleared
        from the start) always, a condition only if it had cleared; while a condition lasts, only its details are
        updated. If many events of a kind are open, the newest of them counts another one."""
        row = c.execute(
            f"SELECT id, cleared_at, details FROM alarms WHERE code = ? AND key = ? AND {_STANDING}",
            (alarm.code, alarm.key),
        ).fetchone()
        details, last_at = to_json(alarm.details), to_text(alarm.last_at or alarm.raised_at)
        if row is None and alarm.cleared_at is not None:
            row = self._newest_of_many(c, alarm, last_at)
        if row is None:
            c.execute(
                """INSERT INTO alarms (code, key, priority, details, raised_at, last_at, count, cleared_at, shelved_until)
                         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)""",
                (
                    alarm.code,
                    alarm.key,
                    alarm.priority,
                    details,
                    to_text(alarm.raised_at),
                    last_at,
                    alarm.count,
                    to_optional_text(alarm.cleared_at),
                    self._shelf_of_the_last(c, alarm, last_at),
                ),
            )
            return True
        lasts = row["cleared_at"] is None and alarm.cleared_at is None
        if not lasts:
            c.execute(
                "UPDATE alarms SET key = ?, count = count + 1, last_at = ?, cleared_at = ?, details = ?, acknowledged_at = NULL "
                "WHERE id = ?",
                (alarm.key, last_at, to_optional_text(alarm.cleared_at), details, row["id"]),
            )
        elif row["details"] != details:
            c.execute("UPDATE alarms SET details = ? WHERE id = ?", (details, row["id"]))
        return False

    @staticmethod
    def _newest_of_many(c: sqlite3.Connection, alarm: Alarm, now: str) -> sqlite3.Row | None:
        """If too many events of this kind are open: the newest, which takes over this one and counts it."""
        rows = c.execute(
            f"""SELECT id, cleared_at, details FROM alarms WHERE code = ? AND {_STANDING}
                             AND json_extract(details, '$.robot_id') = ? AND coalesce(shelved_until, '') <= ?
                             ORDER BY last_at DESC, id DESC LIMIT {OPEN_OF_A_KIND}""",
            (alarm.code, alarm.details.get("robot_id"), now),
        ).fetchall()
        return rows[0] if len(rows) == OPEN_OF_A_KIND else None

    @staticmethod
    def _shelf_of_the_last(c: sqlite3.Connection, alarm: Alarm, now: str) -> str | None:
        """Shelving applies to the code and key, not to one row: it lasts even if the alarm was cleared in between."""
        row = c.execute(
            "SELECT shelved_until FROM alarms WHERE code = ? AND key = ? ORDER BY id DESC LIMIT 1",
            (alarm.code, alarm.key),
        ).fetchone()
        until: str | None = row["shelved_until"] if row is not None else None
        return until if until is not None and until > now else None

    def is_asked(self, c: sqlite3.Connection, robot_id: int) -> bool:
        """Whether that robot exists and is switched on: conditions of other robots would never be cleared."""
        return c.execute("SELECT 1 FROM current_robots WHERE id = ? AND enabled", (robot_id,)).fetchone() is not None

    def clear(self, c: sqlite3.Connection, code: str, key: str, now: datetime) -> bool:
        """Note that the cause has ended. Returns whether there was something to clear."""
        return (
            c.execute(
                "UPDATE alarms SET cleared_at = ? WHERE code = ? AND key = ? AND cleared_at IS NULL",
                (to_text(now), code, key),
            ).rowcount
            > 0
        )

    def withdraw(self, c: sqlite3.Connection, code: str, key: str, at: datetime, now: datetime) -> bool:
        """Remove an event from around ``at`` that has turned out to be wrong, so that it is not read. One that counts
        others stays. Returns whether there was one."""
        return (
            c.execute(
                """UPDATE alarms SET acknowledged_at = ? WHERE code = ? AND key = ? AND cleared_at IS NOT NULL
                            AND acknowledged_at IS NULL AND count = 1 AND abs(julianday(last_at) - julianday(?)) < 60 / 86400.0""",
                (to_text(now), code, key, to_text(at)),
            ).rowcount
            > 0
        )

    def note_answer(self, c: sqlite3.Connection, key: str, guid: str, answer: str, now: datetime) -> bool:
        """To the question of a robot with this guid, which a person has seen then. Returns whether there is such an alarm."""
        return (
            c.execute(
                """UPDATE alarms SET details = json_set(details, '$.answer', ?), acknowledged_at = coalesce(acknowledged_at, ?)
                   WHERE code = 'question' AND key = ? AND json_extract(details, '$.guid') = ?""",
                (answer, to_text(now), key, guid),
            ).rowcount
            > 0
        )

    def clear_of_robot(self, c: sqlite3.Connection, robot_id: int, now: datetime) -> bool:
        """All its conditions. Returns whether there was something to clear."""
        return (
            c.execute(
                "UPDATE alarms SET cleared_at = ? WHERE key = ? AND cleared_at IS NULL",
                (to_text(now), f"robot:{robot_id}"),
            ).rowcount
            > 0
        )

    def acknowledge(self, c: sqlite3.Connection, alarm_id: int, now: datetime, note: str = "") -> None:
        """Note that a person has seen it; only the first time counts."""
        c.execute(
            "UPDATE alarms SET acknowledged_at = ?, note = ? WHERE id = ? AND acknowledged_at IS NULL",
            (to_text(now), note, alarm_id),
        )

    def unacknowledge(self, c: sqlite3.Connection, alarm_id: int) -> None:
        """It stays acknowledged where the same alarm has come again and is open."""
        c.execute("UPDATE OR IGNORE alarms SET acknowledged_at = NULL, note = '' WHERE id = ?", (alarm_id,))

    def shelve(self, c: sqlite3.Connection, alarm_id: int, until: datetime | None) -> None:
        """Hide it until then; None shows it again."""
        c.execute("UPDATE alarms SET shelved_until = ? WHERE id = ?", (to_optional_text(until), alarm_id))

    def active(self, c: sqlite3.Connection, code: str, key: str) -> Alarm | None:
        """The alarm whose cause persists."""
        row = c.execute(f"{_SELECT} WHERE code = ? AND key = ? AND cleared_at IS NULL", (code, key)).fetchone()
        return row and _alarm(row)

    def open(self, c: sqlite3.Connection) -> list[Alarm]:
        """Not yet both cleared and acknowledged, newest first."""
        return [_alarm(row) for row in c.execute(f"{_SELECT} WHERE {_STANDING} ORDER BY last_at DESC, id DESC")]

    def past(self, c: sqlite3.Connection, limit: int) -> list[Alarm]:
        """Cleared and acknowledged, newest first."""
        rows = c.execute(f"{_SELECT} WHERE NOT {_STANDING} ORDER BY last_at DESC, id DESC LIMIT ?", (limit,))
        return [_alarm(row) for row in rows]

    def count_past(self, c: sqlite3.Connection) -> int:
        """How many are cleared and acknowledged."""
        return int(c.execute(f"SELECT count(*) FROM alarms WHERE NOT {_STANDING}").fetchone()[0])

    def prune(self, c: sqlite3.Connection, limit: int) -> int:
        """Keep N of the past ones, the newest, but only a few of one that was repeated often; returns how many were
        dropped."""
        return c.execute(
            f"""DELETE FROM alarms WHERE id IN (
                                 SELECT id FROM (SELECT id, last_at, row_number() OVER (PARTITION BY {_KIND} ORDER BY last_at DESC) AS nth
                                                 FROM alarms WHERE NOT {_STANDING})
                                 ORDER BY nth > {_PAST_OF_A_KIND}, last_at DESC, id DESC LIMIT -1 OFFSET ?)""",
            (limit,),
        ).rowcount


def _alarm(row: sqlite3.Row) -> Alarm:
    details = from_json(row["details"])
    if row["robot"] is not None:
        details["robot"] = row["robot"]
    return Alarm(
        code=row["code"],
        key=row["key"],
        priority=Priority(row["priority"]),
        raised_at=to_instant(row["raised_at"]),
        details=details,
        id=row["id"],
        last_at=to_instant(row["last_at"]),
        count=row["count"],
        cleared_at=to_optional_instant(row["cleared_at"]),
        acknowledged_at=to_optional_instant(row["acknowledged_at"]),
        note=row["note"],
        shelved_until=to_optional_instant(row["shelved_until"]),
    )
