"""Robots, their idle rules, and holds."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, NamedTuple

from app.database.check_ups import profile_of
from app.database.fleets import COLUMNS_OF_FLEET, fleet_of
from app.database.table import Table, to_column
from app.database.values import placeholders, to_instant, to_optional_instant, to_optional_text
from app.domain.models import HandOver, IdleRule, Robot
from app.domain.robot import IdentifiedBy

_IDENTITY = ("serial_number", "model", "software", "identified_by")
_NOT_OF_FLEET: dict[str, Any] = {
    "address": "",
    "username": "",
    "token": None,
    "certificate_sha256": None,
    "needs_password": False,
}
_MACHINE = ("id", "address", "username", "certificate_sha256", "serial_number")  # whom we ask, and as whom


class Accepted(NamedTuple):
    """A queue item of ours, the token that was sent as its description, and its mission's guid."""

    queue_id: int
    token: str
    mission_guid: str = ""


class RobotRepository(Table[Robot]):
    name = "robots"
    columns = (
        "name",
        "address",
        "username",
        "token",
        "certificate_sha256",
        "enabled",
        "needs_password",
        "hand_over",
        *_IDENTITY,
        "fleet_id",
        "vehicle",
        "off_with_fleet",
    )
    query = f"""SELECT robots.*, idle.mission_id AS idle_mission_id, idle.after_minutes AS idle_after_minutes, idle.enabled AS idle_enabled,
                      check_ups.profile, {COLUMNS_OF_FLEET}
               FROM current_robots AS robots LEFT JOIN current_idle_rules AS idle ON idle.robot_id = robots.id
                           LEFT JOIN check_ups ON check_ups.robot_id = robots.id
                           LEFT JOIN fleets ON fleets.id = robots.fleet_id"""
    order = "robots.name"

    @staticmethod
    def read(row: sqlite3.Row) -> Robot:
        idle = None
        if row["idle_mission_id"] is not None:
            idle = IdleRule(row["idle_mission_id"], row["idle_after_minutes"], bool(row["idle_enabled"]))
        values = {name: row[name] for name in RobotRepository.columns if name != "fleet_id"} | {
            "enabled": bool(row["enabled"]),
            "hand_over": HandOver(row["hand_over"]),
            "needs_password": bool(row["needs_password"]),
            "identified_by": row["identified_by"] and IdentifiedBy(row["identified_by"]),
            "off_with_fleet": bool(row["off_with_fleet"]),
        }
        profile = None if row["profile"] is None else profile_of(row["profile"])
        robot = Robot(id=row["id"], idle=idle, **values, profile=profile)
        return robot if row["fleet_id"] is None else robot.within(fleet_of(row, "fleet_"))

    def values(self, robot: Robot) -> list[object]:
        """What a robot of a fleet has of it stays with that."""
        own = robot if robot.fleet is None else replace(robot, **_NOT_OF_FLEET)
        fleet_id = robot.fleet and robot.fleet.id
        return [fleet_id if name == "fleet_id" else to_column(getattr(own, name)) for name in self.columns]

    def add(self, c: sqlite3.Connection, robot: Robot) -> Robot:
        added = super().add(c, robot)
        self._put_idle(c, added)
        return added

    def update(self, c: sqlite3.Connection, robot: Robot) -> None:
        """Store all of it, including its idle rule. Facts learned about another machine (another serial number) are
        deleted."""
        c.execute(
            """DELETE FROM check_ups WHERE robot_id = ? AND left_behind IS NULL
                     AND (SELECT serial_number FROM current_robots WHERE id = robot_id) <> coalesce(?, '')""",
            (robot.id, robot.serial_number),
        )
        c.execute(
            """DELETE FROM mission_parameters WHERE robot_id = ?
                     AND (SELECT serial_number FROM current_robots WHERE id = robot_id) <> coalesce(?, '')""",
            (robot.id, robot.serial_number),
        )
        c.execute(
            """UPDATE robots SET failures = 0
                     WHERE id = ? AND serial_number <> coalesce(?, '')""",
            (robot.id, robot.serial_number),
        )
        super().update(c, robot)
        self._put_idle(c, robot)

    def remove(self, c: sqlite3.Connection, id_: int, now: datetime) -> None:
        """The token stays with the deletion, for an undo."""
        super().remove(c, id_, now)
        c.execute("UPDATE robots SET token = NULL WHERE id = ?", (id_,))

    def note_identity(self, c: sqlite3.Connection, asked: Robot, **found: str) -> bool:
        """Store the machine's own data: serial_number, model, software; identified_by. Returns whether it was stored:
        not if ``asked`` has been edited since so that it may be another machine. A known serial number stays."""
        if unknown := found.keys() - set(_IDENTITY):
            raise ValueError(f"not part of a robot's identity: {sorted(unknown)}")
        stored = self.get(c, asked.id)
        if stored is None or any(getattr(stored, name) != getattr(asked, name) for name in _MACHINE):
            return False
        known = {"serial_number": "coalesce(serial_number, ?)"}
        changes = ", ".join(f"{name} = {known.get(name, '?')}" for name in found)
        c.execute(f"UPDATE robots SET {changes} WHERE id = ?", (*found.values(), asked.id))
        return True

    def of_one_machine(self, c: sqlite3.Connection) -> dict[str, list[str]]:
        """Serial numbers that several robots have which are switched on, and the names of these."""
        found: dict[str, list[str]] = {}
        for number, name in c.execute(
            "SELECT serial_number, name FROM current_robots WHERE enabled AND serial_number <> '' ORDER BY name"
        ):
            found.setdefault(number, []).append(name)
        return {number: names for number, names in found.items() if len(names) > 1}

    # ------------------------------------------------------------------ facts for dispatch
    def last_accepted(self, c: sqlite3.Connection, robot_id: int) -> Accepted | None:
        """The newest item that it took from the app; None: none yet."""
        row = c.execute(
            "SELECT last_queue_id, last_token, coalesce(last_mission, '') FROM current_robots WHERE id = ?", (robot_id,)
        ).fetchone()
        return None if row is None or row[0] is None else Accepted(*row)

    def last_of_each(self, c: sqlite3.Connection, robot_id: int) -> list[Accepted]:
        """The same of this robot, then of the others of its fleet, by falling number."""
        rows = c.execute(
            """SELECT last_queue_id, last_token, coalesce(last_mission, '') FROM current_robots WHERE last_queue_id IS NOT NULL
                      AND (id = ?1 OR fleet_id = (SELECT fleet_id FROM current_robots WHERE id = ?1))
               ORDER BY id = ?1 DESC, last_queue_id DESC""",
            (robot_id,),
        )
        return [Accepted(*row) for row in rows]

    def note_accepted(self, c: sqlite3.Connection, robot_id: int, accepted: Accepted) -> None:
        columns = "last_queue_id = ?, last_token = ?, last_mission = ?"
        c.execute(f"UPDATE robots SET {columns} WHERE id = ?", (*accepted, robot_id))

    def idle_queue_id(self, c: sqlite3.Connection, robot_id: int) -> int | None:
        """The queue item of its last idle mission, or the highest id known when that was started; None: it may run."""
        row = c.execute("SELECT idle_queue_id FROM current_robots WHERE id = ?", (robot_id,)).fetchone()
        return None if row is None else row[0]

    def note_idle(self, c: sqlite3.Connection, robot_id: int, queue_id: int | None) -> None:
        c.execute("UPDATE robots SET idle_queue_id = ? WHERE id = ?", (queue_id, robot_id))

    def failures(self, c: sqlite3.Connection, ids: Collection[int]) -> dict[int, int]:
        """How many starts these failed since their last success, by id."""
        return {
            row[0]: row[1]
            for row in c.execute(f"SELECT id, failures FROM current_robots WHERE id IN ({placeholders(ids)})", (*ids,))
        }

    def note_outcome(self, c: sqlite3.Connection, robot_id: int, went_well: bool) -> None:
        """It has completed a start, or failed one."""
        if went_well:
            c.execute("UPDATE robots SET failures = 0 WHERE id = ? AND failures > 0", (robot_id,))
        else:
            c.execute("UPDATE robots SET failures = failures + 1 WHERE id = ?", (robot_id,))

    @staticmethod
    def _put_idle(c: sqlite3.Connection, robot: Robot) -> None:
        if robot.idle is None:
            c.execute(
                "DELETE FROM idle_rules WHERE robot_id = ? AND mission_id IN (SELECT id FROM current_missions)",
                (robot.id,),
            )
            return
        c.execute(
            """INSERT INTO idle_rules (robot_id, mission_id, after_minutes, enabled) VALUES (?, ?, ?, ?)
                     ON CONFLICT (robot_id) DO UPDATE SET mission_id = excluded.mission_id, after_minutes = excluded.after_minutes,
                                                          enabled = excluded.enabled""",
            (robot.id, robot.idle.mission_id, robot.idle.after_minutes, robot.idle.enabled),
        )


@dataclass(frozen=True)
class Hold:
    """Nothing is sent to the robot (None: to any) until ``until`` (None: until it is released). ``since`` is when a
    person set it; None: the tablet set it itself, because of its ``clock`` or of copied data."""

    reason: str = ""
    until: datetime | None = None
    since: datetime | None = None
    clock: bool = False
    is_copy: bool = False
    robot_id: int | None = None
    id: int = 0

    def is_over(self, now: datetime) -> bool:
        return self.until is not None and self.until <= now

    def covers(self, robot_id: int | None, at: datetime) -> bool:
        """Whether nothing is sent to that robot at that instant. Only a hold of all robots covers None."""
        return self.robot_id in (None, robot_id) and not self.is_over(at) and (self.since is None or self.since <= at)


class HoldRepository:
    """Holds of all robots or of one, as the operator set them; they survive a restart."""

    def all(self, c: sqlite3.Connection) -> list[Hold]:
        """Oldest first, expired ones included."""
        return [
            Hold(
                row["reason"],
                to_optional_instant(row["until"]),
                to_instant(row["started_at"]),
                robot_id=row["robot_id"],
                id=row["id"],
            )
            for row in c.execute("SELECT * FROM current_holds ORDER BY id")
        ]

    def add(self, c: sqlite3.Connection, hold: Hold) -> Hold:
        """Returns it with its id."""
        cursor = c.execute(
            "INSERT INTO holds (robot_id, reason, started_at, until) VALUES (?, ?, ?, ?)",
            (hold.robot_id, hold.reason, to_optional_text(hold.since), to_optional_text(hold.until)),
        )
        return replace(hold, id=cursor.lastrowid or 0)

    def remove(self, c: sqlite3.Connection, robot_id: int | None) -> None:
        """The hold of that robot, or (None) the one of all robots."""
        c.execute("DELETE FROM holds WHERE robot_id IS ?", (robot_id,))
