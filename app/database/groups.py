"""Groups of robots, and places that they share."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import replace

from app.database.robots import RobotRepository
from app.database.table import Table
from app.database.values import from_json
from app.domain.models import FEWEST_TO_KEEP_FREE, Group, HandOver, Place, Robot, Schedule


class GroupRepository(Table[Group]):
    name, columns = "robot_groups", ("name", "hand_over", "keep_free")
    query = """SELECT *, (SELECT json_group_array(robot_id) FROM (
                   SELECT robot_id FROM current_group_members WHERE group_id = robot_groups.id ORDER BY robot_id)) AS members
               FROM current_robot_groups AS robot_groups"""

    @classmethod
    def read(cls, row: sqlite3.Row) -> Group:
        """Its members in order of their ids."""
        members = tuple(from_json(row["members"]))
        keep_free = cls._can_keep_free(members, row["keep_free"])
        return Group(row["name"], members, HandOver(row["hand_over"]), keep_free, row["id"])

    @staticmethod
    def _can_keep_free(members: Sequence[int], keep_free: int) -> int:
        """A group that lost too many robots keeps none free, until they are put back."""
        return keep_free if len(members) >= max(FEWEST_TO_KEEP_FREE, keep_free + 1) else 0

    def add(self, c: sqlite3.Connection, group: Group) -> Group:
        added = super().add(c, group)
        self._put_members(c, added)
        return added

    def update(self, c: sqlite3.Connection, group: Group) -> None:
        (stored,) = c.execute("SELECT keep_free FROM robot_groups WHERE id = ?", (group.id,)).fetchone()
        if self._can_keep_free(group.members, stored) == group.keep_free:
            group = replace(group, keep_free=stored)
        super().update(c, group)
        c.execute(
            "DELETE FROM group_members WHERE group_id = ? AND robot_id IN (SELECT id FROM current_robots)", (group.id,)
        )
        self._put_members(c, group)

    def of_robot(self, c: sqlite3.Connection, robot_id: int) -> list[Group]:
        """Those that it is in."""
        return [group for group in self.all(c) if robot_id in group.members]

    @staticmethod
    def _put_members(c: sqlite3.Connection, group: Group) -> None:
        for robot_id in group.members:
            c.execute("INSERT INTO group_members (group_id, robot_id) VALUES (?, ?)", (group.id, robot_id))


def target_of(c: sqlite3.Connection, schedule: Schedule) -> Robot | Group | None:
    """The robot that a schedule names, or its group; None: it has been removed."""
    if schedule.robot_id is not None:
        return RobotRepository().get(c, schedule.robot_id)
    return None if schedule.group_id is None else GroupRepository().get(c, schedule.group_id)


class PlaceRepository(Table[Place]):
    name, columns = "places", ("name", "most")
    query = """SELECT *, (SELECT json_group_array(mission_id) FROM current_mission_places WHERE place_id = places.id) AS missions
               FROM current_places AS places"""

    @staticmethod
    def read(row: sqlite3.Row) -> Place:
        return Place(row["name"], row["most"], tuple(sorted(from_json(row["missions"]))), row["id"])

    def ids(self, c: sqlite3.Connection) -> dict[str, int]:
        """Of all places, by name."""
        return dict(c.execute("SELECT name, id FROM current_places").fetchall())

    def add(self, c: sqlite3.Connection, place: Place) -> Place:
        added = super().add(c, place)
        _use(c, "place_id", added.id, {(mission_id, added.id) for mission_id in added.missions})
        return added

    def update(self, c: sqlite3.Connection, place: Place) -> None:
        super().update(c, place)
        _use(c, "place_id", place.id, {(mission_id, place.id) for mission_id in place.missions})

    def used_by(self, c: sqlite3.Connection, mission_id: int) -> set[int]:
        """The ids of the places that a mission uses."""
        return {place_id for _mission_id, place_id in _uses(c, "mission_id", mission_id)}

    def use(self, c: sqlite3.Connection, mission_id: int, place_ids: Iterable[int]) -> None:
        """These, and no others."""
        _use(c, "mission_id", mission_id, {(mission_id, place_id) for place_id in place_ids})


def _uses(c: sqlite3.Connection, column: str, id_: int) -> set[tuple[int, int]]:
    """Which mission uses which place, for one of either."""
    rows = c.execute(f"SELECT mission_id, place_id FROM current_mission_places WHERE {column} = ?", (id_,))
    return {(row[0], row[1]) for row in rows}


def _use(c: sqlite3.Connection, column: str, id_: int, wanted: set[tuple[int, int]]) -> None:
    used = _uses(c, column, id_)
    c.executemany("DELETE FROM mission_places WHERE mission_id = ? AND place_id = ?", used - wanted)
    c.executemany("INSERT INTO mission_places (mission_id, place_id) VALUES (?, ?)", wanted - used)
