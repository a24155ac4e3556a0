"""Which missions bring a robot to its charger: they are for a low battery, so the minimum battery does not hold them up."""
from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace

from app.database.connection import Database
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.domain.clock import Clock
from app.domain.models import Connection, InvalidInput, Robot
from app.mir.client import RobotClient
from app.mir.errors import Rejected, RobotError, Unreadable
from app.services.catalogue.catalogue import Catalogue, Edit
from app.services.live.snapshots import Snapshots

log = logging.getLogger(__name__)

LOOK_EVERY = 60.0            # s


class ChargingMissions:
    """Asks a robot for the actions of each mission that is planned on it, once while the app runs. ``tick`` is called every now and then
    (a chore of the poll loop) and returns at once; robots are asked on a thread of its own."""

    def __init__(self, db: Database, catalogue: Catalogue, snapshots: Snapshots, make_client: Callable[[Robot], RobotClient],
                 clock: Clock) -> None:
        self._db, self._catalogue, self._snapshots, self._make_client, self._clock = db, catalogue, snapshots, make_client, clock
        self._robots, self._missions = RobotRepository(), MissionRepository()
        self._asked = set[str]()                 # guids
        self._look_at = -math.inf                # monotonic
        self._thread: threading.Thread | None = None

    def tick(self) -> None:
        now = self._clock.monotonic()
        if now < self._look_at or (self._thread and self._thread.is_alive()):
            return
        self._look_at = now + LOOK_EVERY
        if wanted := self.not_asked():
            self._thread = threading.Thread(target=self.ask, args=(wanted,), name="charging missions", daemon=True)
            self._thread.start()

    def ask(self, wanted: Sequence[tuple[Robot, list[str]]]) -> None:
        """Guids by robot. A robot that does not answer is asked again later."""
        charging = dict[str, bool]()
        for robot, guids in wanted:
            try:
                with closing(self._make_client(robot)) as client:
                    charging |= {guid: _charges(client, guid) for guid in guids if guid not in charging}
            except (RobotError, InvalidInput) as error:
                log.info("What its missions do was not told by %r: %s", robot.name, error)
        self._asked |= charging.keys()
        if any(mission.charges != charging.get(mission.guid, mission.charges) for mission in self._catalogue.missions()):
            self._catalogue.edit(lambda edit: _note(edit, charging))

    def not_asked(self) -> list[tuple[Robot, list[str]]]:
        """Guids of what is planned on robots that answer."""
        c = self._db.read()
        answering = [robot for robot in self._robots.all(c)
                     if robot.enabled and self._snapshots.get(robot.id).connection in (Connection.CONNECTED, Connection.SLOW)]
        planned = ((robot, [guid for guid in self._missions.planned_on(c, robot.id) if guid not in self._asked]) for robot in answering)
        return [(robot, guids) for robot, guids in planned if guids]


def _charges(client: RobotClient, guid: str) -> bool:
    """False for a mission that the robot lacks, or of which it does not tell the actions. Raises RobotError when it does not answer."""
    try:
        return client.charges(guid)
    except (Rejected, Unreadable):
        return False


def _note(edit: Edit, charging: Mapping[str, bool]) -> None:
    for mission in edit.missions.all(edit.c):
        if mission.charges != (charges := charging.get(mission.guid, mission.charges)):
            edit.save_mission(replace(mission, charges=charges))
            log.info("%r %s", mission.name, "brings the robot to its charger: it runs on a low battery" if charges else "does not charge")
