"""Robots of the list that are one machine: their starts meet in one queue, and a group counts it twice."""
from __future__ import annotations

from collections.abc import Mapping

from app.database.connection import Database
from app.database.robots import RobotRepository
from app.services.live.alarms import Alarms

CODE = "same_machine"


class SameMachine:
    """A chore: an alarm for each serial number that several robots have, as long as they have it."""

    def __init__(self, db: Database, robots: RobotRepository, alarms: Alarms) -> None:
        self._db, self._robots, self._alarms = db, robots, alarms
        self._known: Mapping[str, list[str]] | None = None       # names by serial number; None: the list of alarms has those of before

    def tick(self) -> None:
        found = self._robots.of_one_machine(self._db.read())
        if found == self._known:
            return
        known = self._before() if self._known is None else self._known
        for number in known.keys() - found.keys():
            self._alarms.clear(CODE, _key(number))
        for number, names in found.items():
            if names != known.get(number):
                self._alarms.raise_(CODE, _key(number), robot=names[0], robots=", ".join(names), number=number)
        self._known = found

    def _before(self) -> dict[str, list[str]]:
        active = [alarm for alarm in self._alarms.open() if alarm.code == CODE and alarm.cleared_at is None]
        return {alarm.key.removeprefix(_key("")): str(alarm.details.get("robots", "")).split(", ") for alarm in active}


def _key(serial_number: str) -> str:
    return f"serial:{serial_number}"
