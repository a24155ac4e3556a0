"""Check-ups of robots: what a robot really does, found out before it is relied on.

``run`` blocks for a minute or two and belongs on a background thread, or in a command. The robot's worker goes on meanwhile, on a
connection of its own; while missions are queued for a check-up, a hold keeps the plan's starts back.
"""
from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from datetime import timedelta

from app.database.check_ups import CheckUpRepository
from app.database.connection import Database
from app.database.robots import RobotRepository
from app.domain.check_up import LeftBehind, Progress, Report, Trial
from app.domain.clock import Clock
from app.domain.message import Message, message
from app.domain.models import InvalidInput, Robot, Settings
from app.domain.robot import Identity
from app.mir.client import RobotClient
from app.mir.probe import PATIENT, Probe
from app.services.check_up import reading
from app.services.check_up.look import Look, NotWanted
from app.services.check_up.room import check_room, check_usable
from app.services.dispatch.ledger import Ledger
from app.services.live.changes import Changes, Topic
from app.services.live.holds import Holds

log = logging.getLogger(__name__)


class CheckUps:
    def __init__(self, db: Database, *, clock: Clock, ledger: Ledger, holds: Holds, changes: Changes, settings: Callable[[], Settings],
                 make_client: Callable[[Robot], RobotClient]) -> None:
        self._db, self._clock, self._ledger, self._holds, self._changes = db, clock, ledger, holds, changes
        self._settings, self._make_client = settings, make_client
        self._robots, self._check_ups = RobotRepository(), CheckUpRepository()
        self._lock, self._under_way = threading.Lock(), set[int]()

    # ------------------------------------------------------------------ before
    def report(self, robot_id: int) -> Report | None:
        """Of the last one."""
        return self._check_ups.report(self._db.read(), robot_id)

    def length_s(self, trial: Trial | None = None) -> float:
        """How long it takes, about."""
        return reading.length_s()

    def moves(self, robot_id: int, trial: Trial) -> Message:
        """Exactly what happens on the robot in a trial, for a person to agree to."""
        robot = self._robot(robot_id).name
        if trial.mission is None:
            return message("{robot} gets a mission that waits a second, four times; one of them is cancelled before it runs. The robot is "
                           "paused twice for about 3 s and released. The mission is removed afterwards. Nothing drives.", robot=robot)
        return message("{mission} is queued four times on {robot}; one of them is cancelled before it runs, so the robot does three times "
                       "what the mission does, and it may drive. It is paused twice for about 3 s and released.", mission=trial.mission,
                       robot=robot)

    def harmless_missions(self, robot_id: int) -> Sequence[str]:
        """Names of the robot's missions that a person may choose for a trial. Asks the robot. Raises RobotError or InvalidInput."""
        with self._client(self._robot(robot_id)) as client:
            return sorted({mission.name for mission in client.missions() if not mission.guid.startswith("mirconst")}, key=str.casefold)

    # ------------------------------------------------------------------ the check-up
    def run(self, robot_id: int, trial: Trial | None = None, told: Callable[[Progress], None] = lambda progress: None,
            is_wanted: Callable[[], bool] = lambda: True) -> Report:
        """Read the robot and, with a ``trial``, queue missions on it. ``told`` is called with how far it is; ``is_wanted`` is asked between
        questions, and what was changed is put back in any case. A robot that does not answer is a finding, not an error.

        Raises InvalidInput for a robot that is being checked up, and for a trial that can't be now, with the reason.
        """
        robot = self._robot(robot_id)
        check_usable(robot)
        with self._alone_with(robot), self._client(robot) as client:
            self._check_room(robot, trial)
            return self._run(robot, client, trial, told, is_wanted)

    def _run(self, robot: Robot, client: RobotClient, trial: Trial | None, told: Callable[[Progress], None],
             is_wanted: Callable[[], bool]) -> Report:
        began_at, began, whole = self._clock.now(), self._clock.monotonic(), self.length_s(trial)
        look = Look(Probe(client, self._clock.monotonic, self._clock.sleep), self._settings().timezone, self._clock.now, self._clock.sleep,
                    is_wanted, lambda progress: told(replace(progress, of=whole)))
        identity: Identity | None = None
        is_complete = False
        try:
            identity = reading.read_robot(look)
            is_complete = identity is not None
        except NotWanted:
            log.info("The check-up of %r was ended by a person", robot.name)
        serial, software = (identity.serial_number, identity.software) if identity else (robot.serial_number, robot.software)
        report = Report(robot.name, robot.address, (identity.model if identity else robot.model) or "", began_at,
                        self._clock.monotonic() - began, tuple(look.findings), look.profile(serial, software), is_complete=is_complete)
        if is_complete:
            self._db.write(lambda c: self._check_ups.put(c, robot.id, report))
            self._changes.publish(Topic.ROBOTS)
        log.info("robot %r was checked up: %s", robot.name, report.level)
        return report

    # ------------------------------------------------------------------ what a trial left
    def left_behind(self) -> Mapping[int, LeftBehind]:
        """By robot: what a trial that was cut off has changed there and nobody has put back yet."""
        return {key: left for key, left in self._check_ups.left_behind(self._db.read()).items() if key not in self._under_way}

    # ------------------------------------------------------------------ inside
    def _check_room(self, robot: Robot, trial: Trial | None) -> None:
        if trial is not None:
            check_room(self._db.read(), robot, self._ledger, self._holds, self._settings(), self._clock.now(),
                       timedelta(seconds=self.length_s(trial)))

    @contextmanager
    def _alone_with(self, robot: Robot) -> Iterator[None]:
        with self._lock:
            if robot.id in self._under_way:
                raise InvalidInput("robot", "{robot} is being checked up already", robot=robot.name)
            self._under_way.add(robot.id)
        try:
            yield
        finally:
            self._under_way.discard(robot.id)

    @contextmanager
    def _client(self, robot: Robot) -> Iterator[RobotClient]:
        """A patient connection of its own."""
        check_usable(robot)
        with closing(self._make_client(robot)) as client:
            client.timeouts = PATIENT
            yield client

    def _robot(self, robot_id: int) -> Robot:
        if robot := self._robots.get(self._db.read(), robot_id):
            return robot
        raise InvalidInput("robot", "this robot has been removed")
