"""Trials on robots in use: in gaps of the plan, recorded in the database, and undone in every case."""

from __future__ import annotations

import contextlib
import logging
import uuid
from collections.abc import Mapping
from datetime import timedelta
from functools import cached_property
from zoneinfo import ZoneInfo

from app.database.groups import GroupRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.domain.check_up import LeftBehind, Topic, Trial
from app.domain.execution import State
from app.domain.message import Message, message
from app.domain.models import InvalidInput, Robot
from app.domain.robot import RobotState
from app.mir.client import RobotClient
from app.mir.errors import RobotError
from app.mir.target import Target
from app.services.check_up import load_probes, trial
from app.services.check_up.base import CheckUpsOf, mission_called
from app.services.check_up.journal import Journal, Outcome, put_back
from app.services.check_up.session import CheckUpSession, Found, amber, green, red
from app.services.check_up.trial_probes import look_at_trial

log = logging.getLogger(__name__)

READY_FOR, READY_WITHIN = 3.0, 120.0  # s that a robot must have stood ready; that is waited for
REQUESTS = 120  # of a trial, about: each takes so much longer where the robot is slow
TRIES, AGAIN_AFTER = 4, 3.0  # to put a robot back at the end, s between them
RELEASED_WITHIN = timedelta(
    minutes=10
)  # after the begin of a trial, in which its person expects the robot to be released
KEEP_FREE = timedelta(minutes=3)  # between the end of a check-up and the next planned start


class Trials(CheckUpsOf[Robot, RobotClient, Journal]):
    _robots = RobotRepository()

    @cached_property
    def _stays_paused(self) -> set[int]:
        """Robots on which a person has pressed Pause since their trial began."""
        return set()

    @staticmethod
    def length_s(agreed: Trial | None) -> float:
        """Of the whole check-up, about."""
        if agreed is None:
            return load_probes.LENGTH_S
        return load_probes.LENGTH_S + (trial.TAKES_S if agreed.mission is None else trial.OWN_TAKES_S)

    def _check(self, robot: Robot, client: RobotClient, agreed: Trial) -> None:
        """Before the robot is read for a minute; reading shows if it does not answer. Raises InvalidInput with the
        obstacle."""
        self._check_room(robot, agreed)
        with contextlib.suppress(RobotError):
            _mission(client, agreed)
            if not _is_ready(client):
                raise _not_ready(robot)

    def _try(self, session: CheckUpSession, robot: Robot, agreed: Trial) -> bool:
        """Whether it was tried to the end; if not, a finding says why. Raises Cancelled."""
        try:
            journal = self._begin(session, robot, agreed)
        except (InvalidInput, RobotError) as refused:
            session.add(Topic.ORDER, amber("Not tried: {problem}", "Check up again.", problem=refused.message))
            return False
        journal.begin()
        is_wanted = session.is_wanted
        session.is_wanted = lambda: is_wanted() and robot.id not in self._stays_paused
        self._stays_paused.discard(robot.id)
        try:
            result = trial.TrialRun(session, journal).run()
            look_at_trial(session, result)
        except trial.TakenOver as end:
            session.add(Topic.PAUSE, end.found)
            return False
        finally:
            session.add(Topic.LEFT, self._finish(session, robot, journal))
        return result.problem is None and not result.may_not_make

    def _begin(self, session: CheckUpSession, robot: Robot, agreed: Trial) -> Journal:
        """Record what will be changed. Raises InvalidInput with the obstacle, RobotError or Cancelled."""
        if (rest := session.facts.get("rest")) is not None:
            session.robot.spare(rest.requests, rest.seconds)
        slow_s = REQUESTS * (session.facts.get("latency") or (0.0,))[-1]
        self._check_room(robot, agreed, slow_s)
        queued = _mission(session.robot.client, agreed)
        self._wait_until_ready(session, robot)
        floor = session.robot.client.highest_queue_id() or 0
        self._check_room(robot, agreed, slow_s)  # a person may have held it or started something in that time
        serial_number = session.identity.serial_number or robot.serial_number
        made = None if queued else str(uuid.uuid4())
        return self._journal(robot, LeftBehind(serial_number, made, trial.tokens(), floor, queued=queued))

    def _wait_until_ready(self, session: CheckUpSession, robot: Robot) -> None:
        """After many questions it may have booted, and missions of others may run. Raises InvalidInput, RobotError or
        Cancelled."""
        began = ready_since = self._clock.monotonic()
        while self._clock.monotonic() - ready_since < READY_FOR:
            session.at(message("Waiting until it is ready"), load_probes.LENGTH_S)
            if not _is_ready(session.robot.client):
                ready_since = self._clock.monotonic()
            if ready_since - began > READY_WITHIN:
                raise _not_ready(robot)
            self._clock.sleep(1.0)

    def _finish(self, session: CheckUpSession, robot: Robot, journal: Journal) -> Found:
        """Restore everything, and report it as a finding."""
        outcome = Outcome(None)
        for tries_left in reversed(range(TRIES)):
            try:
                outcome = self._undo_trial(session, robot, journal)
                break
            except RobotError as error:
                outcome = Outcome(error.message)
            if tries_left:  # a command that ends now leaves it so until the app is started
                self._clock.sleep(AGAIN_AFTER)
        if outcome.problem is not None:
            journal.warn(outcome.problem)
            return red(
                "Its state is not the same as before: {problem}",
                "The app restores it as soon as it can and holds the plan's starts until then: look at the robot.",
                problem=outcome.problem,
            )
        if outcome.is_in_error:
            return red(
                "Nothing of the trial is left on it, but it has an error",
                "Look at the robot, then reset the error there or in the app.",
            )
        if robot.id in self._stays_paused:
            return green("Nothing of the trial is left on it. It is paused, as somebody wanted")
        if outcome.stays_paused:
            return amber(
                "Nothing of the trial is left on it. It is paused",
                "Resume it at the robot or in the app when it may continue.",
            )
        return green("Its state is the same as before: nothing is queued, no mission was left, it is not paused")

    def keep_paused(self, robot_id: int) -> None:
        """A person presses Pause: the pause is theirs from now on, and a trial under way ends."""
        if robot_id in self._left():
            self._stays_paused.add(robot_id)
            self._db.write(lambda c: self._check_ups.keep_paused(c, robot_id))

    # ------------------------------------------------------------------ what was cut off
    def _left(self) -> Mapping[int, LeftBehind]:
        return self._check_ups.left_behind(self._db.read())

    def _journal(self, it: Robot, left: LeftBehind) -> Journal:
        return Journal(self._db, self._holds, self._alarms, it, left)

    def _put_back(self, it: Robot, journal: Journal) -> Message | None:
        left = journal.left
        with self._client(it) as client:
            session = self._session(client)
            if _is_another(left, it.serial_number) or _is_another(left, session.identify().serial_number):
                log.warning(
                    "robot %r: what a check-up left is on the machine with serial number %s",
                    it.name,
                    left.serial_number,
                )
                journal.end()
                return None
            problem = self._undo_trial(session, it, journal, is_late=self._is_late(it, left)).problem
        log.info("robot %r: what a check-up left there is %s", it.name, "still there" if problem else "put back")
        return problem

    def _is_late(self, robot: Robot, left: LeftBehind) -> bool:
        """Whether a person may have taken the robot since: the trial began long ago, or its hold was ended."""
        now = self._clock.now()
        return not any(
            hold.id == left.hold
            and hold.robot_id == robot.id
            and hold.since
            and timedelta() <= now - hold.since <= RELEASED_WITHIN
            for hold in self._holds.current()
        )

    def _undo_trial(self, session: CheckUpSession, robot: Robot, journal: Journal, *, is_late: bool = False) -> Outcome:
        left = journal.left
        is_idle_period = self._robots.idle_queue_id(self._db.read(), robot.id) == left.queue_floor
        highest = session.robot.client.highest_queue_id() if is_idle_period else None
        outcome = put_back(session, journal, lambda queue_id: self._is_of_plan(robot, queue_id), is_late=is_late)
        if outcome.problem is None and highest is not None and highest <= left.queue_floor + len(left.tokens):
            self._ledger.note_idle_copy(robot.id, highest, runs=True)  # no one else has used the robot
        return outcome

    # ------------------------------------------------------------------ inside
    def _is_of_plan(self, robot: Robot, queue_id: int) -> bool:
        """Or may be: items being sent have no number yet."""
        return self._ledger.is_claimed(robot.id, queue_id) or bool(self._ledger.open_for(robot.id, (State.SUBMITTING,)))

    def _check_room(self, robot: Robot, agreed: Trial, slow_s: float = 0.0) -> None:
        """Raises InvalidInput with the obstacle to a trial that begins now: the plan and a person's hold go first."""
        c, now = self._db.read(), self._clock.now()
        ends = now + timedelta(seconds=self.length_s(agreed) + slow_s)
        groups = {group.id for group in GroupRepository().all(c) if robot.id in group.members}
        if not robot.enabled:
            raise InvalidInput("robot", "{robot} is switched off in Settings", robot=robot.name)
        self._holds.check_is_no_copy()
        if (hold := self._holds.active(robot.id)) is not None:
            if hold.reason:
                raise InvalidInput(
                    "robot",
                    "{robot} is on hold ({reason}): check up when it is released",
                    robot=robot.name,
                    reason=message(hold.reason),
                )  # those that are offered, and a check-up's, have a translation
            raise InvalidInput("robot", "{robot} is on hold: check up when it is released", robot=robot.name)
        rows = [*self._ledger.open_for(robot.id), *(row for row in self._ledger.unbound() if row.group_id in groups)]
        if rows:
            raise InvalidInput(
                "robot",
                "{mission} waits for {robot} or runs there: check up after it",
                mission=rows[0].mission,
                robot=robot.name,
            )
        schedules = ScheduleRepository()
        planned = [
            *schedules.for_robot(c, robot.id),
            *(each for group in groups for each in schedules.for_group(c, group)),
        ]
        soon = [
            (at, schedule.name)
            for schedule in planned
            if schedule.enabled and (at := schedule.next_at) and at <= ends + KEEP_FREE and not schedule.is_paused(at)
        ]
        if soon:
            at, name = min(soon)
            time = f"{at.astimezone(ZoneInfo(self._settings().timezone)):%H:%M}"
            raise InvalidInput("robot", "{schedule} is planned at {time}: check up after it", schedule=name, time=time)


def _mission(client: Target, agreed: Trial) -> str | None:
    """The guid of the robot's own mission; None: one is made. Raises InvalidInput or RobotError."""
    if agreed.mission is None:
        return None
    missing = InvalidInput("mission", "the robot has no mission {mission}", mission=agreed.mission)
    return mission_called(agreed.mission, client, missing)


def _is_another(left: LeftBehind, serial_number: str | None) -> bool:
    """Whether it was left on another machine than that with this serial number."""
    return None not in (left.serial_number, serial_number) and left.serial_number != serial_number


def _is_ready(client: Target) -> bool:
    """Whether it is ready with an empty queue. Raises RobotError."""
    return client.status().state is RobotState.READY and not client.open_items()


def _not_ready(robot: Robot) -> InvalidInput:
    return InvalidInput("robot", "{robot} is not ready with an empty queue: check up when it is", robot=robot.name)
