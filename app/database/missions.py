"""Missions: names for the robots' guids, for all robots or for one whose guid differs."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection
from dataclasses import replace

from app.database.values import placeholders
from app.domain.models import Mission


class MissionRepository:
    def all(self, c: sqlite3.Connection) -> list[Mission]:
        """In order of name; the one for all robots before those of single robots."""
        return [_mission(row) for row in c.execute("SELECT * FROM missions ORDER BY name, coalesce(robot_id, 0)")]

    def count(self, c: sqlite3.Connection) -> int:
        found: int = c.execute("SELECT count(*) FROM missions").fetchone()[0]
        return found

    def get(self, c: sqlite3.Connection, mission_id: int) -> Mission | None:
        row = c.execute("SELECT * FROM missions WHERE id = ?", (mission_id,)).fetchone()
        return row and _mission(row)

    def by_ids(self, c: sqlite3.Connection, ids: Collection[int]) -> dict[int, Mission]:
        """Those with these ids, by id."""
        return {
            row["id"]: _mission(row)
            for row in c.execute(f"SELECT * FROM missions WHERE id IN ({placeholders(ids)})", (*ids,))
        }

    def by_name(self, c: sqlite3.Connection, name: str, robot_id: int | None = None) -> Mission | None:
        """Only the robot's own one or, for None, only the one for all robots."""
        row = c.execute(
            "SELECT * FROM missions WHERE name = ? AND coalesce(robot_id, 0) = ?", (name, robot_id or 0)
        ).fetchone()
        return row and _mission(row)

    def for_robot(self, c: sqlite3.Connection, name: str, robot_id: int) -> Mission | None:
        """What the name means on that robot: its own mission if it has one, else the one for all."""
        return self.by_name(c, name, robot_id) or self.by_name(c, name)

    def with_guid(self, c: sqlite3.Connection, guid: str, robot_id: int) -> Mission | None:
        """The mission with that guid on that robot: of several the robot's own, then one whose duration is typed."""
        row = c.execute(
            """SELECT * FROM missions WHERE guid = ? AND (robot_id = ? OR robot_id IS NULL)
                           ORDER BY robot_id IS NULL, usual_minutes IS NULL, name LIMIT 1""",
            (guid, robot_id),
        ).fetchone()
        return row and _mission(row)

    def used_on(self, c: sqlite3.Connection, mission_id: int) -> set[int]:
        """Robots on which a schedule or an idle rule has it."""
        return {
            row[0]
            for row in c.execute(
                """SELECT robot_id FROM schedules WHERE mission_id = ?
                                               UNION SELECT robot_id FROM idle_rules WHERE mission_id = ?""",
                (mission_id, mission_id),
            )
        }

    def planned(self, c: sqlite3.Connection) -> dict[int, list[str]]:
        """Guids of what schedules and idle rules start, by the robot's id; of a robot of a group all that it may be given."""
        found: dict[int, list[str]] = {}
        for robot_id, guid in c.execute("""
                SELECT DISTINCT used.robot_id, missions.guid FROM missions JOIN (
                    SELECT robot_id, mission_id FROM schedules WHERE enabled = 1 AND robot_id IS NOT NULL
                    UNION SELECT robot_id, mission_id FROM idle_rules WHERE enabled = 1
                    UNION SELECT members.robot_id, id FROM (SELECT DISTINCT robot_id FROM group_members) AS members
                          JOIN missions ON coalesce(missions.robot_id, members.robot_id) = members.robot_id) AS used
                    ON used.mission_id = missions.id
                ORDER BY used.robot_id, missions.id"""):
            found.setdefault(robot_id, []).append(guid)
        return found

    def available_on(self, c: sqlite3.Connection, robot_id: int) -> list[Mission]:
        """Every mission that can be chosen for that robot, in order of name; its own hide those for all of the same name."""
        meant = {mission.name: mission for mission in self.all(c) if mission.robot_id in (None, robot_id)}
        return list(meant.values())

    def add(self, c: sqlite3.Connection, mission: Mission) -> Mission:
        """Returns it with its id; one that is given (an undone removal) is kept."""
        cursor = c.execute(
            """INSERT INTO missions (id, name, guid, robot_id, favourite, usual_minutes, on_low_battery, charges)
                              VALUES (?, ?, ?, ?, ?, ?, ?, ?)""",
            (mission.id or None, *_values(mission)),
        )
        return replace(mission, id=cursor.lastrowid or mission.id)

    def update(self, c: sqlite3.Connection, mission: Mission) -> None:
        c.execute(
            """UPDATE missions SET name = ?, guid = ?, robot_id = ?, favourite = ?, usual_minutes = ?, on_low_battery = ?, charges = ?
                     WHERE id = ?""",
            (*_values(mission), mission.id),
        )

    def remove(self, c: sqlite3.Connection, mission_id: int) -> None:
        """Schedules and idle rules that use it go with it; history stays."""
        c.execute("DELETE FROM missions WHERE id = ?", (mission_id,))


def _values(mission: Mission) -> tuple[str | int | None, ...]:
    return (
        mission.name,
        mission.guid,
        mission.robot_id,
        mission.favourite,
        mission.usual_minutes,
        mission.on_low_battery,
        mission.charges,
    )


def _mission(row: sqlite3.Row) -> Mission:
    return Mission(
        row["name"],
        row["guid"],
        row["id"],
        row["robot_id"],
        bool(row["favourite"]),
        row["usual_minutes"],
        bool(row["on_low_battery"]),
        bool(row["charges"]),
    )
