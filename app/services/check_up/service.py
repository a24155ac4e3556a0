"""Check-ups of robots: find out a robot's real behaviour before relying on it. ``run`` blocks for a minute or two and
belongs on a background thread, or in a command. The robot's worker continues on its own connection; while missions are
queued for a check-up, a hold stops the plan's starts.
"""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from typing import Any

from app.database.check_ups import CheckUpRepository
from app.database.connection import Database
from app.database.robots import RobotRepository
from app.domain.check_up import Level, Progress, Report, RobotProfile, Trial
from app.domain.check_up import Topic as CheckUpTopic
from app.domain.clock import Clock
from app.domain.message import Message, message
from app.domain.models import InvalidInput, Robot, Settings, existing
from app.domain.robot import Identity, RobotStatus
from app.mir.client import RobotClient
from app.mir.errors import RobotError
from app.mir.raw_client import PATIENT, RawClient
from app.mir.target import Target
from app.mir.transport import Pace
from app.services.check_up.probes import read_robot
from app.services.check_up.remains import Remains
from app.services.check_up.session import Cancelled, CheckUpSession
from app.services.check_up.trial import NAME
from app.services.check_up.trials import Trials, length_s, missions_of
from app.services.dispatch.ledger import Ledger
from app.services.live.alarms import Alarms
from app.services.live.changes import Changes, Topic
from app.services.live.holds import Holds

log = logging.getLogger(__name__)

TRIED = (
    "token_field",
    "item_states",
    "cancelled_message",
    "gives_id",
    "order_status",
    "priority_counts",
)  # fields of the profile


class CheckUps(Remains):
    def __init__(
        self,
        db: Database,
        *,
        clock: Clock,
        ledger: Ledger,
        holds: Holds,
        alarms: Alarms,
        changes: Changes,
        settings: Callable[[], Settings],
        make_client: Callable[[Robot], Target],
    ) -> None:
        super().__init__(clock)
        self._db, self._changes = db, changes
        self._settings, self._make_client = settings, make_client
        self._robots, self._check_ups = RobotRepository(), CheckUpRepository()
        self.trials = Trials(db, clock=clock, ledger=ledger, holds=holds, alarms=alarms, settings=settings)

    # ------------------------------------------------------------------ before
    def report(self, robot_id: int) -> Report | None:
        """Of the last one."""
        return self._check_ups.report(self._db.read(), robot_id)

    @staticmethod
    def length_s(trial: Trial | None) -> float:
        """Of the whole check-up, about."""
        return length_s(trial)

    def moves(self, robot_id: int, trial: Trial) -> Message:
        """Exactly what happens on the robot in a trial, for a person to agree to."""
        return moves(self._robot(robot_id).name, trial)

    def harmless_missions(self, robot_id: int) -> Sequence[str]:
        """Names of the robot's missions, to choose a harmless one for a trial. Asks the robot. Raises RobotError or
        InvalidInput."""
        with self._client(self._robot(robot_id)) as client:
            return sorted(missions_of(client), key=str.casefold)

    # ------------------------------------------------------------------ the check-up
    def run(
        self,
        robot_id: int,
        trial: Trial | None = None,
        on_progress: Callable[[Progress], None] = lambda progress: None,
        is_wanted: Callable[[], bool] = lambda: True,
    ) -> Report:
        """Read the robot and, with a ``trial``, queue missions on it. ``on_progress`` is called with the progress.
        ``is_wanted`` is called between questions, and changes are undone in any case. A silent robot is a finding, not
        an error. An incomplete check-up is not stored.

        Raises InvalidInput for a robot that is being checked up, and for a trial that can't be now, with the reason.
        """
        robot = self._robot(robot_id)
        with self._alone_with(robot.id, robot.name), self._client(robot) as client:
            problem: Message | None
            try:  # first: remains of the last one may block this one
                problem = self.trials.put_back(self._session(client), robot)
            except (RobotError, InvalidInput) as error:
                problem = error.message
            if problem is not None and trial is not None:
                raise InvalidInput("robot", "the last check-up has not been undone yet: {problem}", problem=problem)
            if trial is not None:
                self.trials.check(robot, client, trial)
            report = self._run(robot, client, trial, on_progress, is_wanted)
        if report.is_complete:
            self._db.write(lambda c: self._keep(c, robot, report))
            self._changes.publish(Topic.ROBOTS)
        log.info(
            "robot %r was checked up%s: %s%s",
            robot.name,
            f" with {report.mission!r}" if report.mission else "",
            report.level,
            "" if report.is_complete else ", not complete",
        )
        return report

    def _keep(self, c: sqlite3.Connection, robot: Robot, report: Report) -> None:
        """With which machine it was: a profile counts for that with this software."""
        found = {
            "serial_number": report.profile.serial_number,
            "software": report.profile.software,
            "model": report.model,
        }
        self._robots.note_identity(c, robot, **{name: value for name, value in found.items() if value})
        self._check_ups.put(c, robot.id, report)

    def _run(
        self,
        robot: Robot,
        client: RobotClient,
        trial: Trial | None,
        on_progress: Callable[[Progress], None],
        is_wanted: Callable[[], bool],
    ) -> Report:
        began_at, began = self._clock.now(), self._clock.monotonic()
        session = self._session(
            client,
            is_wanted=is_wanted,
            on_progress=on_progress,
            length_s=length_s(trial),
            other_robots=[each for each in self._robots.all(self._db.read()) if each.id != robot.id],
            identity=Identity(
                RobotStatus(robot_model=robot.model or "", serial_number=robot.serial_number), software=robot.software
            ),
        )
        if robot.known is not None and robot.known.rest is not None:
            session.robot.spare(robot.known.rest.requests, robot.known.rest.seconds)
        is_complete = False
        try:
            is_complete = read_robot(session) and (trial is None or self.trials.run(session, robot, trial))
        except Cancelled:
            log.info("The check-up of %r was ended by a person", robot.name)
        was_tried = any(finding.topic is CheckUpTopic.LEFT for finding in session.findings)
        return Report(
            robot.name,
            robot.address,
            session.identity.model or "",
            began_at,
            self._clock.monotonic() - began,
            tuple(session.findings),
            _with_known(session, robot.profile),
            (trial.mission or NAME) if trial is not None and was_tried else "",
            is_complete,
        )

    # ------------------------------------------------------------------ what a trial left
    def _left(self) -> Iterable[int]:
        return self.trials.left_behind()

    def put_back(self, robot_id: int) -> Message | None:
        """Undo an interrupted trial on the robot. Returns what could not be undone; None: everything is restored.
        Raises InvalidInput or RobotError."""
        robot = self._robot(robot_id)
        with self._alone_with(robot.id, robot.name), self._client(robot) as client:
            return self.trials.put_back(self._session(client), robot)

    # ------------------------------------------------------------------ inside
    def _session(self, client: RobotClient, **values: Any) -> CheckUpSession:
        return CheckUpSession(RawClient(client, self._clock), self._clock, self._settings().timezone, **values)

    @contextmanager
    def _client(self, robot: Robot) -> Iterator[RobotClient]:
        """A separate client with long time-outs, without the profile of an earlier check-up; with its own request
        limit, to measure the robot's."""
        if robot.needs_password or not robot.token:
            raise InvalidInput(
                "robot", "{robot} is switched off until its password is entered in Settings", robot=robot.name
            )
        with closing(self._make_client(replace(robot, profile=None))) as client:
            if not isinstance(client, RobotClient):
                raise InvalidInput("robot", "{robot} belongs to a fleet: check the fleet up instead", robot=robot.name)
            client.timeouts, client.pace = PATIENT, Pace(self._clock.monotonic, self._clock.sleep)
            yield client

    def _robot(self, robot_id: int) -> Robot:
        return existing(self._robots.get(self._db.read(), robot_id), "robot", "this robot has been removed")


def moves(robot: str, trial: Trial) -> Message:
    """What happens on the robot of this name."""
    if trial.mission is None:
        return message(
            "{robot} gets a mission that waits a second, four times. One of them is cancelled before it runs. The robot is "
            "paused twice for a few seconds and resumed. The mission is removed afterwards. Nothing drives.",
            robot=robot,
        )
    return message(
        "{mission} is queued four times on {robot}. One of them is cancelled before it runs, so the robot runs the "
        "mission three times and may drive. It is paused twice for a few seconds and resumed.",
        mission=trial.mission,
        robot=robot,
    )


def _with_known(session: CheckUpSession, known: RobotProfile | None) -> RobotProfile:
    """The findings, and those of an earlier trial of the same machine with the same software."""
    found = RobotProfile(session.identity.serial_number, session.identity.software, **session.facts)
    if known is None or not known.is_of(found.serial_number, found.software):
        return found
    has_borne = any(each.topic is CheckUpTopic.LOAD and each.level is Level.GREEN for each in session.findings)
    kept = {name: getattr(known, name) for name in TRIED if name not in session.facts}
    return replace(found, **kept, rest=found.rest if has_borne or found.rest else known.rest)
