"""Positions where robots may queue: several missions drive there, on several robots. They are only proposed as
places."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass

from app.database.connection import Database
from app.database.groups import PlaceRepository
from app.database.missions import MissionRepository, StopRepository
from app.database.robots import RobotRepository
from app.database.settings import DECLINED_PLACES, SettingsRepository
from app.domain.models import Mission

FEWEST = 2  # missions, and robots


@dataclass(frozen=True)
class ProposedPlace:
    """``position``: its guid; ``missions``: ids of those that drive there."""

    position: str
    name: str
    missions: tuple[int, ...]


class ProposedPlaces:
    def __init__(self, db: Database) -> None:
        self._db, self._settings = db, SettingsRepository()

    def all(self) -> list[ProposedPlace]:
        """Those with the most missions first; without those that are places already, by name or by missions."""
        c = self._db.read()
        declined, places = set(self._settings.get(c, DECLINED_PLACES, ())), PlaceRepository().all(c)
        robots = {robot.id for robot in RobotRepository().all(c)}
        names, used = {place.name.casefold() for place in places}, [set(place.missions) for place in places]
        found = []
        for (position, name), missions in _driven_to(c).items():
            there = set[int]().union(
                *(robots if mission.robot_id is None else {mission.robot_id} for mission in missions.values())
            )
            is_known = name.casefold() in names or any(missions.keys() <= those for those in used)
            if min(len(missions), len(there)) >= FEWEST and not is_known and position not in declined:
                found.append(ProposedPlace(position, name, tuple(missions)))
        return sorted(found, key=lambda place: (-len(place.missions), place.name.casefold()))

    def decline(self, position: str) -> None:
        """It is not proposed again."""

        def work(c: sqlite3.Connection) -> None:
            self._settings.put(c, DECLINED_PLACES, sorted({*self._settings.get(c, DECLINED_PLACES, ()), position}))

        self._db.write(work)


def _driven_to(c: sqlite3.Connection) -> dict[tuple[str, str], dict[int, Mission]]:
    """By guid and name of each position that has one: the missions that drive there, by id."""
    found: dict[tuple[str, str], dict[int, Mission]] = {}
    stops = StopRepository().all(c)
    for mission in MissionRepository().all(c):
        for stop in stops.get(mission.guid, ()):
            if stop.position and stop.name:
                found.setdefault((stop.position, stop.name), {})[mission.id] = mission
    return found
