"""Groups of robots, and places that they share."""
from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import replace

from app.database.robots import RobotRepository
from app.domain.models import Group, HandOver, Place, Robot, Schedule


class GroupRepository:
    def all(self, c: sqlite3.Connection) -> list[Group]:
        """In order of name, each with its members in order of their ids."""
        members: dict[int, list[int]] = {}
        for group_id, robot_id in c.execute("SELECT group_id, robot_id FROM group_members ORDER BY robot_id"):
            members.setdefault(group_id, []).append(robot_id)
        rows = c.execute("SELECT id, name, hand_over, keep_free FROM robot_groups ORDER BY name")
        return [Group(name, tuple(members.get(id_, ())), HandOver(hand_over), keep_free, id_) for id_, name, hand_over, keep_free in rows]

    def count(self, c: sqlite3.Connection) -> int:
        found: int = c.execute("SELECT count(*) FROM robot_groups").fetchone()[0]
        return found

    def get(self, c: sqlite3.Connection, group_id: int) -> Group | None:
        return next((group for group in self.all(c) if group.id == group_id), None)

    def by_name(self, c: sqlite3.Connection, name: str) -> Group | None:
        return next((group for group in self.all(c) if group.name == name), None)

    def add(self, c: sqlite3.Connection, group: Group) -> Group:
        """Returns it with its id; one that is given (an undone removal) is kept."""
        cursor = c.execute("INSERT INTO robot_groups (id, name, hand_over, keep_free) VALUES (?, ?, ?, ?)",
                           (group.id or None, group.name, group.hand_over, group.keep_free))
        added = replace(group, id=cursor.lastrowid or group.id)
        self._put_members(c, added)
        return added

    def update(self, c: sqlite3.Connection, group: Group) -> None:
        c.execute("UPDATE robot_groups SET name = ?, hand_over = ?, keep_free = ? WHERE id = ?",
                  (group.name, group.hand_over, group.keep_free, group.id))
        c.execute("DELETE FROM group_members WHERE group_id = ?", (group.id,))
        self._put_members(c, group)

    def remove(self, c: sqlite3.Connection, group_id: int) -> None:
        """Its schedules go with it; history stays."""
        c.execute("DELETE FROM robot_groups WHERE id = ?", (group_id,))

    def keep_fewer_free(self, c: sqlite3.Connection, fewest: int) -> None:
        """A robot was removed: groups of fewer than this keep none free any more."""
        c.execute("""UPDATE robot_groups SET keep_free = 0 WHERE keep_free > 0 AND (
                         SELECT count(*) FROM group_members WHERE group_id = robot_groups.id) < max(?, keep_free + 1)""", (fewest,))

    def of_robot(self, c: sqlite3.Connection, robot_id: int) -> list[Group]:
        """Those that it is in."""
        return [group for group in self.all(c) if robot_id in group.members]

    def join(self, c: sqlite3.Connection, robot_id: int, groups: Sequence[Group]) -> None:
        """A robot that was removed is back in those of these groups that there still are, which keep free again what they did."""
        for group in groups:
            c.execute("INSERT OR IGNORE INTO group_members SELECT id, ? FROM robot_groups WHERE id = ?", (robot_id, group.id))
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


class PlaceRepository:
    def all(self, c: sqlite3.Connection) -> list[Place]:
        """In order of name."""
        missions: dict[int, list[int]] = {}
        for mission_id, place_id in c.execute("SELECT mission_id, place_id FROM mission_places ORDER BY mission_id"):
            missions.setdefault(place_id, []).append(mission_id)
        rows = c.execute("SELECT id, name, most FROM places ORDER BY name")
        return [Place(name, most, tuple(missions.get(id_, ())), id_) for id_, name, most in rows]

    def count(self, c: sqlite3.Connection) -> int:
        found: int = c.execute("SELECT count(*) FROM places").fetchone()[0]
        return found

    def get(self, c: sqlite3.Connection, place_id: int) -> Place | None:
        return next((place for place in self.all(c) if place.id == place_id), None)

    def by_name(self, c: sqlite3.Connection, name: str) -> Place | None:
        return next((place for place in self.all(c) if place.name == name), None)

    def add(self, c: sqlite3.Connection, place: Place) -> Place:
        """Returns it with its id; one that is given (an undone removal) is kept."""
        cursor = c.execute("INSERT INTO places (id, name, most) VALUES (?, ?, ?)", (place.id or None, place.name, place.most))
        added = replace(place, id=cursor.lastrowid or place.id)
        self._put_missions(c, added)
        return added

    def update(self, c: sqlite3.Connection, place: Place) -> None:
        c.execute("UPDATE places SET name = ?, most = ? WHERE id = ?", (place.name, place.most, place.id))
        c.execute("DELETE FROM mission_places WHERE place_id = ?", (place.id,))
        self._put_missions(c, place)

    def uses_of(self, c: sqlite3.Connection, mission_ids: Iterable[int]) -> list[tuple[int, int]]:
        """The id of each of these missions with that of a place that it uses."""
        wanted = set(mission_ids)
        return [(mission_id, place.id) for place in self.all(c) for mission_id in place.missions if mission_id in wanted]

    def use_again(self, c: sqlite3.Connection, uses: Iterable[tuple[int, int]]) -> None:
        """What ``uses_of`` returned, of places that there still are."""
        c.executemany("INSERT OR IGNORE INTO mission_places (mission_id, place_id) SELECT ?, id FROM places WHERE id = ?", uses)

    def remove(self, c: sqlite3.Connection, place_id: int) -> None:
        c.execute("DELETE FROM places WHERE id = ?", (place_id,))

    @staticmethod
    def _put_missions(c: sqlite3.Connection, place: Place) -> None:
        for mission in place.missions:
            c.execute("INSERT INTO mission_places (mission_id, place_id) VALUES (?, ?)", (mission, place.id))
