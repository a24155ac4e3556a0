"""Facts from the actions of missions: which bring a robot to its charger (they are for a low battery, so the minimum
battery does not stop them), and which positions they drive to."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from typing import NamedTuple

from app.database.connection import Database
from app.database.errors import DatabaseError
from app.database.missions import MissionRepository, StopRepository
from app.database.robots import RobotRepository
from app.domain.clock import Clock
from app.domain.models import Connection, InvalidInput, Mission, Robot
from app.domain.robot import ENTRIES, Stop
from app.mir.errors import Rejected, RobotError, Unreadable
from app.mir.target import Target
from app.services.catalogue import mission_edit
from app.services.catalogue.catalogue import Catalogue
from app.services.live.snapshots import Snapshots

log = logging.getLogger(__name__)

CHECK_EVERY = 60.0  # s
ASK_AGAIN_AFTER = 600.0  # s, for a robot that does not say what a mission does
VALID_FOR = 12 * 3600.0  # s of an answer: an integrator may edit a mission, or move a position


class _Actions(NamedTuple):
    """``at`` on the monotonic clock."""

    at: float
    charges: bool
    stops: tuple[Stop, ...]


class MissionActionsReader:
    """Asks robots for the actions of each of their missions, until one has answered. ``tick`` is called regularly (a
    chore of the poll loop) and returns at once; robots are asked on a separate thread."""

    def __init__(
        self,
        db: Database,
        catalogue: Catalogue,
        snapshots: Snapshots,
        make_client: Callable[[Robot], Target],
        clock: Clock,
    ) -> None:
        self._db, self._catalogue, self._snapshots = db, catalogue, snapshots
        self._make_client, self._clock = make_client, clock
        self._robots, self._missions, self._stops = RobotRepository(), MissionRepository(), StopRepository()
        self._known = dict[str, _Actions]()  # by guid
        self._ask_at = dict[tuple[int, str], float]()  # monotonic, if a robot does not answer about a guid
        self._check_at = -math.inf  # monotonic
        self._thread: threading.Thread | None = None

    def tick(self) -> None:
        now = self._clock.monotonic()
        if now < self._check_at or (self._thread and self._thread.is_alive()):
            return
        self._check_at = now + CHECK_EVERY
        wanted = self.to_ask()
        if wanted or self._changed(self._missions.all(self._db.read())) or self._stops_to_keep():
            self._thread = threading.Thread(target=self.ask, args=(wanted,), name="mission actions", daemon=True)
            self._thread.start()

    def ask(self, wanted: Sequence[tuple[Robot, list[str]]]) -> None:
        """Guids by robot. A robot that does not answer, or does not say, is asked again later; known ones stay."""
        try:
            for robot, guids in wanted:
                self._ask(robot, guids)
                self._store()
            self._store()
        except DatabaseError as problem:  # stored the next time
            log.info("What missions do could not be stored: %s", problem)

    def _ask(self, robot: Robot, guids: Sequence[str]) -> None:
        try:
            with closing(self._make_client(robot)) as client:
                positions = dict[str, Stop]()
                for guid in guids:
                    if self._catalogue.robot(robot.id) is None:
                        return  # removed in the meantime
                    if self._knows(guid):
                        continue  # another robot has answered since
                    try:
                        found = client.actions(guid)
                        stops = tuple(_stops(client, found.drives_to, positions))
                        self._known[guid] = _Actions(self._clock.monotonic(), found.charges, stops)
                    except (Rejected, Unreadable):  # it lacks the mission, or does not show its actions
                        self._ask_at[robot.id, guid] = self._clock.monotonic() + ASK_AGAIN_AFTER
        except (RobotError, InvalidInput) as error:
            log.info("What its missions do was not told by %r: %s", robot.name, error)

    def to_ask(self) -> list[tuple[Robot, list[str]]]:
        """Guids of missions that answering robots may get."""
        c, now = self._db.read(), self._clock.monotonic()
        answering = [
            robot
            for robot in self._robots.all(c)
            if robot.enabled and self._snapshots.get(robot.id).connection in (Connection.CONNECTED, Connection.SLOW)
        ]
        planned = self._missions.planned(c) if answering else {}
        wanted = (
            (
                robot,
                [
                    guid
                    for guid in planned.get(robot.id, ())
                    if not self._knows(guid) and self._ask_at.get((robot.id, guid), now) <= now
                ],
            )
            for robot in answering
        )
        return [(robot, guids) for robot, guids in wanted if guids]

    def _knows(self, guid: str) -> bool:
        return guid in self._known and self._clock.monotonic() - self._known[guid].at < VALID_FOR

    def _changed(self, missions: Iterable[Mission]) -> list[Mission]:
        """Those that charge the robot, or don't, otherwise than is stored; as they are."""
        known = ((mission, self._known.get(mission.guid)) for mission in missions)
        return [
            replace(mission, charges=found.charges)
            for mission, found in known
            if found is not None and found.charges != mission.charges
        ]

    def _stops_to_keep(self) -> dict[str, tuple[Stop, ...]]:
        """Of configured missions, if they have changed."""
        c = self._db.read()
        kept, guids = self._stops.all(c), {mission.guid for mission in self._missions.all(c)}
        return {
            guid: found.stops
            for guid, found in self._known.items()
            if guid in guids and found.stops != kept.get(guid, ())
        }

    def _store(self) -> None:
        if self._changed(self._missions.all(self._db.read())):
            self._catalogue.edit(
                lambda edit: [mission_edit.save(edit, mission) for mission in self._changed(edit.missions.all(edit.c))]
            )
        if stops := self._stops_to_keep():
            self._db.write(lambda c: self._stops.keep(c, stops))


def _stops(client: Target, drives_to: Sequence[str], known: dict[str, Stop]) -> Iterator[Stop]:
    for guid in drives_to:
        if guid and guid not in known:
            try:
                position = client.position(guid)
                known[guid] = Stop(guid, "" if position.type_id in ENTRIES else position.name, position.spot)
            except (Rejected, Unreadable):  # it lacks the position, or does not show it
                known[guid] = Stop(guid)
        yield known[guid] if guid else Stop()
