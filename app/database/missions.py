"""Missions: names for the robots' guids, for all robots or for one whose guid differs; and what is known of each guid:
its parameters, its positions, its durations.

How long the newest completed runs took on each robot is kept by triggers of the database, in
the statement that completes one, apart from the history, which may be pruned to nothing.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import groupby
from math import ceil
from statistics import median

from app.database.table import Table
from app.database.value_checks import decoded
from app.domain.execution import DurationEstimate
from app.domain.models import Mission
from app.domain.robot import MissionParameter, Spot, Stop


class MissionRepository(Table[Mission]):
    name = "missions"
    columns = ("name", "guid", "robot_id", "favourite", "usual_minutes", "on_low_battery", "charges")
    query, order = "SELECT * FROM current_missions AS missions", "name, coalesce(robot_id, 0)"

    @staticmethod
    def read(row: sqlite3.Row) -> Mission:
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

    def by_name(self, c: sqlite3.Connection, name: str, robot_id: int | None = None) -> Mission | None:
        """Only the robot's own one or, for None, only the one for all robots."""
        return self.select_one(c, "WHERE name = ? AND coalesce(robot_id, 0) = ?", name, robot_id or 0)

    def for_robot(self, c: sqlite3.Connection, name: str, robot_id: int) -> Mission | None:
        """The mission with that name on that robot: its own if it has one, else the one for all."""
        return self.select_one(
            c, "WHERE name = ? AND coalesce(robot_id, 0) IN (0, ?) ORDER BY robot_id DESC LIMIT 1", name, robot_id
        )

    def own_of_name(self, c: sqlite3.Connection, name: str) -> list[tuple[int, int]]:
        """The robots with a mission of that name of their own: the robot's id, and the mission's."""
        found = c.execute("SELECT robot_id, id FROM current_missions WHERE name = ? AND robot_id IS NOT NULL", (name,))
        return [(row[0], row[1]) for row in found]

    def with_guid(self, c: sqlite3.Connection, guid: str, robot_id: int) -> Mission | None:
        """The mission with that guid on that robot: of several, the robot's own, then one with a typed duration."""
        return self.select_one(
            c,
            """WHERE guid = ? AND (robot_id = ? OR robot_id IS NULL)
               ORDER BY robot_id IS NULL, usual_minutes IS NULL, name LIMIT 1""",
            guid,
            robot_id,
        )

    def used_on(self, c: sqlite3.Connection, mission_id: int) -> set[int]:
        """Robots on which a schedule or an idle rule has it."""
        return {
            row[0]
            for row in c.execute(
                """SELECT robot_id FROM current_schedules WHERE mission_id = ?
                                               UNION SELECT robot_id FROM current_idle_rules WHERE mission_id = ?""",
                (mission_id, mission_id),
            )
        }

    def planned(self, c: sqlite3.Connection) -> dict[int, list[str]]:
        """Guids of missions of schedules and idle rules, by the robot's id; for a robot of a group all that it may
        get."""
        found: dict[int, list[str]] = {}
        for robot_id, guid in c.execute("""
                SELECT DISTINCT used.robot_id, missions.guid FROM current_missions AS missions JOIN (
                    SELECT robot_id, mission_id FROM current_schedules WHERE enabled = 1 AND robot_id IS NOT NULL
                    UNION SELECT robot_id, mission_id FROM current_idle_rules WHERE enabled = 1
                    UNION SELECT members.robot_id, id FROM (SELECT DISTINCT robot_id FROM current_group_members) AS members
                          JOIN current_missions AS missions ON coalesce(missions.robot_id, members.robot_id) = members.robot_id) AS used
                    ON used.mission_id = missions.id
                ORDER BY used.robot_id, missions.id"""):
            found.setdefault(robot_id, []).append(guid)
        return found

    def available_on(self, c: sqlite3.Connection, robot_id: int) -> list[Mission]:
        """Every mission that can be chosen for that robot, in order of name; its own hide those for all of the same name."""
        meant = {mission.name: mission for mission in self.all(c) if mission.robot_id in (None, robot_id)}
        return list(meant.values())


class MissionParameterRepository:
    """The parameters of missions as each robot last reported them."""

    def get(self, c: sqlite3.Connection, robot_id: int, guid: str) -> Sequence[MissionParameter] | None:
        """None: the robot has not said it, or the stored value can't be used."""
        return _read(
            c.execute(
                "SELECT parameters FROM mission_parameters WHERE robot_id = ? AND mission_guid = ?", (robot_id, guid)
            ).fetchone()
        )

    def of_any(self, c: sqlite3.Connection, guid: str) -> Sequence[MissionParameter] | None:
        """As any robot has said: the same guid is the same mission."""
        return _read(
            c.execute("SELECT parameters FROM mission_parameters WHERE mission_guid = ? LIMIT 1", (guid,)).fetchone()
        )

    def put(self, c: sqlite3.Connection, said: Mapping[tuple[int, str], Sequence[MissionParameter]]) -> None:
        """By robot and guid, replacing earlier ones. Nothing is stored for a removed robot, or for a mission that is
        not configured."""
        c.executemany(
            """INSERT INTO mission_parameters (robot_id, mission_guid, parameters) SELECT id, ?, ? FROM robots WHERE id = ?
                         ON CONFLICT DO UPDATE SET parameters = excluded.parameters""",
            [
                (guid, json.dumps([asdict(parameter) for parameter in parameters]), robot_id)
                for (robot_id, guid), parameters in said.items()
            ],
        )
        c.execute("DELETE FROM mission_parameters WHERE mission_guid NOT IN (SELECT guid FROM missions)")


def _read(row: sqlite3.Row | None) -> Sequence[MissionParameter] | None:
    try:
        found: Sequence[MissionParameter] | None = row and decoded(tuple[MissionParameter, ...], json.loads(row[0]))
        return found
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return None


class StopRepository:
    """Positions that missions drive to: the same guid is the same mission on every robot."""

    def all(self, c: sqlite3.Connection) -> dict[str, tuple[Stop, ...]]:
        """Of missions that drive anywhere."""
        found: dict[str, tuple[Stop, ...]] = {}
        for row in c.execute("SELECT * FROM mission_stops ORDER BY mission_guid, number"):
            found[row["mission_guid"]] = (*found.get(row["mission_guid"], ()), _stop(row))
        return found

    def keep(self, c: sqlite3.Connection, known: Mapping[str, Sequence[Stop]]) -> None:
        """Replaces the known stops of these missions; missions that are no longer configured have none."""
        c.executemany("DELETE FROM mission_stops WHERE mission_guid = ?", [(guid,) for guid in known])
        c.executemany(
            "INSERT INTO mission_stops VALUES (?, ?, ?, ?, ?, ?, ?)",
            [
                (guid, number, stop.position, stop.name, *(stop.spot or (None, None, None)))
                for guid, stops in known.items()
                for number, stop in enumerate(stops)
            ],
        )
        c.execute("DELETE FROM mission_stops WHERE mission_guid NOT IN (SELECT guid FROM missions)")


def _stop(row: sqlite3.Row) -> Stop:
    is_known = None not in (row["map_id"], row["x"], row["y"])
    return Stop(row["position"], row["name"], Spot(row["map_id"], row["x"], row["y"]) if is_known else None)


class DurationRepository:
    """How long runs took."""

    def usual(self, c: sqlite3.Connection, robot_id: int, mission_guid: str) -> DurationEstimate | None:
        """Of that mission's newest 20 completed runs on that robot, of at most a day each; None without any. P90 by
        nearest rank."""
        rows = c.execute(
            "SELECT duration_s FROM run_durations WHERE robot_id = ? AND mission_guid = ?", (robot_id, mission_guid)
        )
        lasted = tuple(sorted(row[0] for row in rows))
        return DurationEstimate(median(lasted), lasted[ceil(0.9 * len(lasted)) - 1], lasted) if lasted else None

    def usual_of_all(self, c: sqlite3.Connection) -> dict[str, float]:
        """The median in seconds by the mission's guid, of its newest runs on all robots together."""
        rows = c.execute("SELECT mission_guid, duration_s FROM run_durations ORDER BY mission_guid")
        return {guid: median(row[1] for row in runs) for guid, runs in groupby(rows, key=lambda row: row[0])}
