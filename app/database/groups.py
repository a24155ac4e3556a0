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
        return [_group(row, members.get(row[0], ())) for row in c.execute(f"{_GROUPS} ORDER BY name")]

    def count(self, c: sqlite3.Connection) -> int:
        found: int = c.execute("SELECT count(*) FROM robot_groups").fetchone()[0]
        return found

    def get(self, c: sqlite3.Connection, group_id: int) -> Group | None:
        return self._one(c, "id = ?", group_id)

    def by_name(self, c: sqlite3.Connection, name: str) -> Group | None:
        return self._one(c, "name = ?", name)

    @staticmethod
    def _one(c: sqlite3.Connection, where: str, value: object) -> Group | None:
        row = c.execute(f"{_GROUPS} WHERE {where}", (value,)).fetchone()
        return row and _group(
            row, _ids(c, "SELECT robot_id FROM group_members WHERE group_id = ? ORDER BY robot_id", row[0])
        )

    def add(self, c: sqlite3.Connection, group: Group) -> Group:
        """Returns it with its id; one that is given (an undone removal) is kept."""
        cursor = c.execute(
            "INSERT INTO robot_groups (id, name, hand_over, keep_free) VALUES (?, ?, ?, ?)",
            (group.id or None, group.name, group.hand_over, group.keep_free),
        )
        added = replace(group, id=cursor.lastrowid or group.id)
        self._put_members(c, added)
        return added

    def update(self, c: sqlite3.Connection, group: Group) -> None:
        c.execute(
            "UPDATE robot_groups SET name = ?, hand_over = ?, keep_free = ? WHERE id = ?",
            (group.name, group.hand_over, group.keep_free, group.id),
        )
        c.execute("DELETE FROM group_members WHERE group_id = ?", (group.id,))
        self._put_members(c, group)

    def remove(self, c: sqlite3.Connection, group_id: int) -> None:
        """Its schedules go with it; history stays."""
        c.execute("DELETE FROM robot_groups WHERE id = ?", (group_id,))

    def keep_fewer_free(self, c: sqlite3.Connection, fewest: int) -> None:
        """A robot was removed: groups of fewer than this keep none free any more."""
        c.execute(
            """UPDATE robot_groups SET keep_free = 0 WHERE keep_free > 0 AND (
                         SELECT count(*) FROM group_members WHERE group_id = robot_groups.id) < max(?, keep_free + 1)""",
            (fewest,),
        )

    def of_robot(self, c: sqlite3.Connection, robot_id: int) -> list[Group]:
        """Those that it is in."""
        return [group for group in self.all(c) if robot_id in group.members]

    def join(self, c: sqlite3.Connection, robot_id: int, groups: Sequence[Group]) -> None:
        """A robot that was removed is back in those of these groups that there still are, which keep free again what they did."""
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


class PlaceRepository:
    def all(self, c: sqlite3.Connection) -> list[Place]:
        """In order of name."""
        missions: dict[int, list[int]] = {}
        for mission_id, place_id in c.execute("SELECT mission_id, place_id FROM mission_places ORDER BY mission_id"):
            missions.setdefault(place_id, []).append(mission_id)
        return [_place(row, missions.get(row[0], ())) for row in c.execute(f"{_PLACES} ORDER BY name")]

    def count(self, c: sqlite3.Connection) -> int:
        found: int = c.execute("SELECT count(*) FROM places").fetchone()[0]
        return found

    def get(self, c: sqlite3.Connection, place_id: int) -> Place | None:
        return self._one(c, "id = ?", place_id)

    def by_name(self, c: sqlite3.Connection, name: str) -> Place | None:
        return self._one(c, "name = ?", name)

    @staticmethod
    def _one(c: sqlite3.Connection, where: str, value: object) -> Place | None:
        row = c.execute(f"{_PLACES} WHERE {where}", (value,)).fetchone()
        return row and _place(row, _ids(c, _MISSIONS_OF_PLACE, row[0]))

    def ids(self, c: sqlite3.Connection) -> dict[str, int]:
        """Of all places, by name."""
        return dict(c.execute("SELECT name, id FROM places").fetchall())

    def add(self, c: sqlite3.Connection, place: Place) -> Place:
        """Returns it with its id; one that is given (an undone removal) is kept."""
        cursor = c.execute(
            "INSERT INTO places (id, name, most) VALUES (?, ?, ?)", (place.id or None, place.name, place.most)
        )
        added = replace(place, id=cursor.lastrowid or place.id)
        _add_uses(c, ((mission_id, added.id) for mission_id in added.missions))
        return added

    def update(self, c: sqlite3.Connection, place: Place) -> None:
        c.execute("UPDATE places SET name = ?, most = ? WHERE id = ?", (place.name, place.most, place.id))
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

    def remove(self, c: sqlite3.Connection, place_id: int) -> None:
        c.execute("DELETE FROM places WHERE id = ?", (place_id,))


_GROUPS, _PLACES = "SELECT id, name, hand_over, keep_free FROM robot_groups", "SELECT id, name, most FROM places"
_MISSIONS_OF_PLACE = "SELECT mission_id FROM mission_places WHERE place_id = ? ORDER BY mission_id"


def _group(row: sqlite3.Row, members: Iterable[int]) -> Group:
    id_, name, hand_over, keep_free = row
    return Group(name, tuple(members), HandOver(hand_over), keep_free, id_)


def _place(row: sqlite3.Row, missions: Iterable[int]) -> Place:
    id_, name, most = row
    return Place(name, most, tuple(missions), id_)


def _ids(c: sqlite3.Connection, query: str, of: int) -> list[int]:
    return [row[0] for row in c.execute(query, (of,))]


def _add_uses(c: sqlite3.Connection, uses: Iterable[tuple[int, int]]) -> None:
    c.executemany("INSERT INTO mission_places (mission_id, place_id) VALUES (?, ?)", uses)


def _drop_uses(c: sqlite3.Connection, uses: Iterable[tuple[int, int]]) -> None:
    c.executemany("DELETE FROM mission_places WHERE mission_id = ? AND place_id = ?", uses)
