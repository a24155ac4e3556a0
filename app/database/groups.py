"""Groups of robots, and places that they share."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Sequence

from app.database.robots import RobotRepository
from app.database.table import Table
from app.database.values import from_json
from app.domain.models import Group, HandOver, Place, Robot, Schedule


class GroupRepository(Table[Group]):
    name, columns = "robot_groups", ("name", "hand_over", "keep_free")
    query = """SELECT *, (SELECT json_group_array(robot_id) FROM (SELECT robot_id FROM group_members WHERE group_id = robot_groups.id
                                                                 ORDER BY robot_id)) AS members FROM robot_groups"""

    @staticmethod
    def read(row: sqlite3.Row) -> Group:
        """Its members in order of their ids."""
        return Group(
            row["name"], tuple(from_json(row["members"])), HandOver(row["hand_over"]), row["keep_free"], row["id"]
        )

    def add(self, c: sqlite3.Connection, group: Group) -> Group:
        added = super().add(c, group)
        self._put_members(c, added)
        return added

    def update(self, c: sqlite3.Connection, group: Group) -> None:
        super().update(c, group)
        c.execute("DELETE FROM group_members WHERE group_id = ?", (group.id,))
        self._put_members(c, group)

    def keep_fewer_free(self, c: sqlite3.Connection, fewest: int) -> None:
        """A robot was removed: groups with fewer robots than this no longer keep any free."""
        c.execute(
            """UPDATE robot_groups SET keep_free = 0 WHERE keep_free > 0 AND (
                         SELECT count(*) FROM group_members WHERE group_id = robot_groups.id) < max(?, keep_free + 1)""",
            (fewest,),
        )

    def of_robot(self, c: sqlite3.Connection, robot_id: int) -> list[Group]:
        """Those that it is in."""
        return [group for group in self.all(c) if robot_id in group.members]

    def join(self, c: sqlite3.Connection, robot_id: int, groups: Sequence[Group]) -> None:
        """A removed robot returns to those of these groups that still exist, which keep as many free as before."""
        for group in groups:
            c.execute(
                "INSERT OR IGNORE INTO group_members SELECT id, ? FROM robot_groups WHERE id = ?", (robot_id, group.id)
            )
            c.execute("UPDATE robot_groups SET keep_free = max(keep_free, ?) WHERE id = ?", (group.keep_free, group.id))

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
    query = """SELECT places.*, coalesce(missions, '[]') AS missions FROM places
               LEFT JOIN (SELECT place_id, json_group_array(mission_id) AS missions FROM mission_places GROUP BY place_id)
                    ON place_id = places.id"""

    @staticmethod
    def read(row: sqlite3.Row) -> Place:
        return Place(row["name"], row["most"], tuple(sorted(from_json(row["missions"]))), row["id"])

    def ids(self, c: sqlite3.Connection) -> dict[str, int]:
        """Of all places, by name."""
        return dict(c.execute("SELECT name, id FROM places").fetchall())

    def add(self, c: sqlite3.Connection, place: Place) -> Place:
        added = super().add(c, place)
        _add_uses(c, ((mission_id, added.id) for mission_id in added.missions))
        return added

    def update(self, c: sqlite3.Connection, place: Place) -> None:
        super().update(c, place)
        used, wanted = set(_ids(c, _MISSIONS_OF_PLACE, place.id)), set(place.missions)
        _drop_uses(c, ((mission_id, place.id) for mission_id in used - wanted))
        _add_uses(c, ((mission_id, place.id) for mission_id in wanted - used))

    def used_by(self, c: sqlite3.Connection, mission_id: int) -> set[int]:
        """The ids of the places that a mission uses."""
        return set(_ids(c, "SELECT place_id FROM mission_places WHERE mission_id = ?", mission_id))

    def use(self, c: sqlite3.Connection, mission_id: int, place_ids: Iterable[int]) -> None:
        """These, and no others."""
        wanted, used = set(place_ids), self.used_by(c, mission_id)
        _drop_uses(c, ((mission_id, place_id) for place_id in used - wanted))
        _add_uses(c, ((mission_id, place_id) for place_id in wanted - used))

    def uses_of(self, c: sqlite3.Connection, mission_ids: Iterable[int]) -> list[tuple[int, int]]:
        """The id of each of these missions with that of a place that it uses."""
        return [(mission_id, place_id) for mission_id in mission_ids for place_id in self.used_by(c, mission_id)]

    def use_again(self, c: sqlite3.Connection, uses: Iterable[tuple[int, int]]) -> frozenset[tuple[int, int]]:
        """What ``uses_of`` returned, where mission and place are both there; returns the others."""
        uses = frozenset(uses)
        c.executemany(
            """INSERT OR IGNORE INTO mission_places (mission_id, place_id)
                         SELECT missions.id, places.id FROM missions, places WHERE missions.id = ? AND places.id = ?""",
            uses,
        )
        return uses.difference(map(tuple, c.execute("SELECT mission_id, place_id FROM mission_places")))


_MISSIONS_OF_PLACE = "SELECT mission_id FROM mission_places WHERE place_id = ? ORDER BY mission_id"


def _ids(c: sqlite3.Connection, query: str, of: int) -> list[int]:
    return [row[0] for row in c.execute(query, (of,))]


def _add_uses(c: sqlite3.Connection, uses: Iterable[tuple[int, int]]) -> None:
    c.executemany("INSERT INTO mission_places (mission_id, place_id) VALUES (?, ?)", uses)


def _drop_uses(c: sqlite3.Connection, uses: Iterable[tuple[int, int]]) -> None:
    c.executemany("DELETE FROM mission_places WHERE mission_id = ? AND place_id = ?", uses)
