"""Starts of groups while they wait for a robot, places in use, and requests that were given up but may still arrive."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection
from datetime import datetime
from typing import NamedTuple

from app.database.execution_rows import OPEN, select, stored_values
from app.database.schedules import OPEN_OF_WHOLE
from app.database.values import placeholders, to_instant, to_optional_instant, to_text
from app.domain.choice import LEAVES_ROBOT_FREE
from app.domain.execution import Execution

# What a choice rests on.
_BOUND_BY = ("mission", "parameters", "priority", "minimum_battery_percent", "closes_at", "finish_by", "tried")


class Watch(NamedTuple):
    """Until then, a request that was given up, or a second copy, may still arrive at that robot or run there."""

    execution_id: int
    robot_id: int
    queue_floor: int
    until: datetime


class Watched(NamedTuple):
    """The same with the token of its start."""

    token: str
    queue_floor: int
    until: datetime


class FullPlace(NamedTuple):
    """A full place, and the mission that came first: its robot, and since when it runs."""

    name: str
    robot: str
    robot_id: int
    mission_guid: str
    started_at: datetime | None


class Room(NamedTuple):
    """How many more of these missions, by name, may use a place."""

    place: str
    missions: frozenset[str]
    left: int


class GroupExecutionRepository:
    # ------------------------------------------------------------------ waiting for a robot
    def unbound(self, c: sqlite3.Connection) -> list[Execution]:
        """What waits for a robot of a group, oldest first."""
        return select(
            c, "INDEXED BY executions_unbound WHERE state = 'waiting' AND robot_id IS NULL ORDER BY planned_at, id"
        )

    def count_waiting(self, c: sqlite3.Connection, group_id: int) -> int:
        """Starts of a group that no robot has yet."""
        found: int = c.execute(
            f"SELECT count(*) FROM executions WHERE {OPEN} AND state = 'waiting' AND group_id = ?", (group_id,)
        ).fetchone()[0]
        return found

    def bound(self, c: sqlite3.Connection) -> list[int]:
        """Robots for which something of a group waits to be sent."""
        return [
            row[0]
            for row in c.execute(f"""SELECT DISTINCT robot_id FROM executions WHERE {OPEN} AND state = 'waiting'
                                                AND group_id IS NOT NULL AND robot_id IS NOT NULL""")
        ]

    def earlier_open(self, c: sqlite3.Connection, start: Execution) -> datetime | None:
        """The instant of an earlier start of its schedule, moved or not, that is still open, as its runs must not
        overlap; None if there is none."""
        found = c.execute(
            f"""SELECT max(planned_at) FROM {OPEN_OF_WHOLE}
                WHERE whole.id = (SELECT coalesce(moved_of, id) FROM current_schedules WHERE id = ?)
                    AND whole.overlap <> 'parallel' AND (planned_at, executions.id) < (?, ?)""",
            (start.schedule_id, to_text(start.planned_at), start.id),
        ).fetchone()
        return to_optional_instant(found[0])

    def may_be_bound(self, c: sqlite3.Connection, execution: Execution, robot_id: int, into_queue: bool) -> bool:
        """Whether a start of a group is unchanged and this robot may still get it: it is switched on, of the group, has
        no other start of the app (except with ``into_queue``; idle missions and starts that wait for something other
        than the robot do not count), and there is room at every place that the mission uses."""
        read = stored_values({name: getattr(execution, name) for name in _BOUND_BY})
        found = c.execute(
            f"""
            SELECT 1 FROM executions AS e JOIN current_group_members AS member USING (group_id)
                JOIN current_robots AS r ON r.id = member.robot_id
            WHERE e.id = ? AND e.state = 'waiting' AND e.robot_id IS NULL AND e.cancel_code IS NULL AND e.revoked IS NULL AND NOT e.held
                AND {" AND ".join(f"e.{name} IS ?" for name in read)} AND r.id = ? AND r.enabled AND NOT r.needs_password
                AND (? OR NOT EXISTS (SELECT 1 FROM executions WHERE robot_id = r.id AND {OPEN} AND trigger <> 'idle'
                                      AND NOT (state = 'waiting' AND wait IN ({placeholders(LEAVES_ROBOT_FREE)}))))""",
            (execution.id, *read.values(), robot_id, into_queue, *LEAVES_ROBOT_FREE),
        ).fetchone()
        return found is not None and self.full_place(c, execution) is None

    def may_get(self, c: sqlite3.Connection, execution: Execution) -> bool:
        """Whether the robot of a group's start may still get it."""
        return (
            c.execute(
                """SELECT 1 FROM current_group_members JOIN current_robots ON id = robot_id
                            WHERE group_id = ? AND robot_id = ? AND enabled""",
                (execution.group_id, execution.robot_id),
            ).fetchone()
            is not None
        )

    # ------------------------------------------------------------------ places
    def with_places(self, c: sqlite3.Connection) -> set[str]:
        """Names of the missions that use a place."""
        rows = c.execute("SELECT DISTINCT name FROM current_mission_places JOIN current_missions ON id = mission_id")
        return {row[0] for row in rows}

    def full_place(self, c: sqlite3.Connection, execution: Execution) -> FullPlace | None:
        """A full place of its mission, and its occupant; None: none is full. A start counts from its assignment to a
        robot, or from sending, to its end."""
        places = c.execute(
            """SELECT DISTINCT places.id, places.name, most FROM current_mission_places
                              JOIN current_missions AS missions ON missions.id = mission_id
                              JOIN current_places AS places ON places.id = place_id
                              WHERE missions.name = ? ORDER BY places.name""",
            (execution.mission,),
        ).fetchall()
        for place_id, name, most in places:
            there = self._at_place(c, place_id, but=execution.id)
            if len(there) >= most:
                _id, robot, robot_id, guid, started_at = there[0]
                return FullPlace(name, robot, robot_id, guid, to_optional_instant(started_at))
        return None

    def room(self, c: sqlite3.Connection) -> list[Room]:
        """At each place that missions use."""
        missions: dict[tuple[int, str, int], set[str]] = {}
        for (
            *place,
            mission,
        ) in c.execute("""SELECT places.id, places.name, most, missions.name FROM current_mission_places
                                            JOIN current_missions AS missions ON missions.id = mission_id
                                            JOIN current_places AS places ON places.id = place_id"""):
            missions.setdefault((place[0], place[1], place[2]), set()).add(mission)
        return [
            Room(name, frozenset(used_by), most - len(self._at_place(c, place_id)))
            for (place_id, name, most), used_by in missions.items()
        ]

    @staticmethod
    def _at_place(c: sqlite3.Connection, place_id: int, but: int = 0) -> list[sqlite3.Row]:
        """By name or by guid: a mission may be renamed, or changed on the robot, in the meantime. A start that a person
        assigned to a robot and that waits for something else does not count yet."""
        return c.execute(
            f"""
            WITH here AS (SELECT name, guid FROM current_missions WHERE name IN (
                SELECT name FROM current_mission_places JOIN current_missions ON id = mission_id WHERE place_id = ?))
            SELECT id, robot, robot_id, mission_guid, started_at FROM executions INDEXED BY executions_open
            WHERE {OPEN} AND robot_id IS NOT NULL AND (state <> 'waiting' OR group_id IS NOT NULL) AND id <> ?
                AND NOT (state = 'waiting' AND wait IN ({placeholders(LEAVES_ROBOT_FREE)}))
                AND (mission IN (SELECT name FROM here) OR mission_guid IN (SELECT guid FROM here))
            ORDER BY planned_at, id""",
            (place_id, but, *LEAVES_ROBOT_FREE),
        ).fetchall()

    # ------------------------------------------------------------------ given up
    def watch(self, c: sqlite3.Connection, watch: Watch) -> None:
        """It stays until the robot was searched after its time, or is purged; its execution stays with it."""
        c.execute(
            """INSERT INTO watches VALUES (?, ?, ?, ?) ON CONFLICT DO UPDATE SET until = excluded.until""",
            (*watch[:3], to_text(watch.until)),
        )

    def watches_of(self, c: sqlite3.Connection, robot_id: int) -> list[Watched]:
        rows = c.execute(
            """SELECT token, watches.queue_floor, until FROM watches JOIN executions ON executions.id = execution_id
                            WHERE watches.robot_id = ?""",
            (robot_id,),
        )
        return [Watched(token, floor, to_instant(until)) for token, floor, until in rows]

    def drop_watches(self, c: sqlite3.Connection, robot_id: int, tokens: Collection[str]) -> None:
        """Those that are over."""
        c.execute(
            f"""DELETE FROM watches WHERE robot_id = ? AND execution_id IN (
                      SELECT id FROM executions WHERE token IN ({placeholders(tokens)}))""",
            (robot_id, *tokens),
        )
