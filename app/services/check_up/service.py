"""Check-ups of robots: find out a robot's real behaviour before relying on it. The robot's worker continues on its
own connection; while missions are queued for a check-up, a hold stops the plan's starts.
"""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace

from app.domain.check_up import Level, Report, RobotProfile, Trial
from app.domain.check_up import Topic as CheckUpTopic
from app.domain.message import Message, message
from app.domain.models import InvalidInput, Robot, existing
from app.domain.robot import Identity, RobotStatus
from app.mir.client import RobotClient
from app.mir.raw_client import PATIENT
from app.mir.transport import Pace
from app.services.check_up.base import IsWanted, Keep, OnProgress
from app.services.check_up.probes import read_robot
from app.services.check_up.session import Cancelled, CheckUpSession
from app.services.check_up.trial import NAME
from app.services.check_up.trials import Trials

log = logging.getLogger(__name__)

TRIED = (
    "token_field",
    "item_states",
    "cancelled_message",
    "gives_id",
    "order_status",
    "priority_counts",
)  # fields of the profile


class CheckUps(Trials):
    WHAT = "robot"

    def report(self, id_: int) -> Report | None:
        """Of the last one."""
        return self._check_ups.report(self._db.read(), id_)

    @staticmethod
    def moves(name: str, trial: Trial) -> Message:
        """Exactly what happens in a trial, for a person to agree to."""
        if trial.mission is None:
            return message(
                "{robot} gets a mission that waits a second, four times. One of them is cancelled before it runs. The robot is "
                "paused twice for a few seconds and resumed. The mission is removed afterwards. Nothing drives.",
                robot=name,
            )
        return message(
            "{mission} is queued four times on {robot}. One of them is cancelled before it runs, so the robot runs the "
            "mission three times and may drive. It is paused twice for a few seconds and resumed.",
            mission=trial.mission,
            robot=name,
        )

    def _keep(self, c: sqlite3.Connection, robot: Robot, report: Report) -> None:
        """With which machine it was: a profile counts for that with this software."""
        found = {
            "serial_number": report.profile.serial_number,
            "software": report.profile.software,
            "model": report.model,
        }
        self._robots.note_identity(c, robot, **{name: value for name, value in found.items() if value})
        self._check_ups.put(c, robot.id, report)

    def _run(self, it: Robot, trial: Trial | None, on_progress: OnProgress, is_wanted: IsWanted) -> tuple[Report, Keep]:
        with self._client(it) as client:
            if trial is not None:
                self._check(it, client, trial)
            report = self._look(it, client, trial, on_progress, is_wanted)
        return report, lambda c: self._keep(c, it, report)

    def _look(
        self, robot: Robot, client: RobotClient, trial: Trial | None, on_progress: OnProgress, is_wanted: IsWanted
    ) -> Report:
        began_at, began = self._clock.now(), self._clock.monotonic()
        session = self._session(
            client,
            is_wanted=is_wanted,
            on_progress=on_progress,
            length_s=self.length_s(trial),
            other_robots=[each for each in self._robots.all(self._db.read()) if each.id != robot.id],
            identity=Identity(
                RobotStatus(robot_model=robot.model or "", serial_number=robot.serial_number), software=robot.software
            ),
        )
        if robot.known is not None and robot.known.rest is not None:
            session.robot.spare(robot.known.rest.requests, robot.known.rest.seconds)
        is_complete = False
        try:
            is_complete = read_robot(session) and (trial is None or self._try(session, robot, trial))
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

    # ------------------------------------------------------------------ inside
    @contextmanager
    def _client(self, it: Robot) -> Iterator[RobotClient]:
        """Without the profile of an earlier check-up; with its own request limit, to measure the robot's."""
        if it.needs_password or not it.token:
            raise InvalidInput(
                "robot", "{robot} is switched off until its password is entered in Settings", robot=it.name
            )
        with closing(self._make_client(replace(it, profile=None))) as client:
            if not isinstance(client, RobotClient):
                raise InvalidInput("robot", "{robot} belongs to a fleet: check the fleet up instead", robot=it.name)
            client.timeouts, client.pace = PATIENT, Pace(self._clock.monotonic, self._clock.sleep)
            yield client

    def _get(self, id_: int) -> Robot:
        return existing(self._robots.get(self._db.read(), id_), "robot", "this robot has been removed")


def _with_known(session: CheckUpSession, known: RobotProfile | None) -> RobotProfile:
    """The findings, and those of an earlier trial of the same machine with the same software."""
    found = RobotProfile(session.identity.serial_number, session.identity.software, **session.facts)
    if known is None or not known.is_of(found.serial_number, found.software):
        return found
    has_borne = any(each.topic is CheckUpTopic.LOAD and each.level is Level.GREEN for each in session.findings)
    kept = {name: getattr(known, name) for name in TRIED if name not in session.facts}
    return replace(found, **kept, rest=found.rest if has_borne or found.rest else known.rest)
