"""Trials on robots that the app schedules on: in room that the plan leaves, noted in the database, and put back whatever happens."""

from __future__ import annotations

import logging
import sqlite3
import uuid
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import timedelta

from app.database.check_ups import CheckUpRepository
from app.database.connection import Database
from app.database.robots import RobotRepository
from app.domain.check_up import LeftBehind, Topic, Trial
from app.domain.clock import Clock
from app.domain.message import Message, message
from app.domain.models import InvalidInput, Robot, Settings, State
from app.domain.robot import Identity, RobotState
from app.mir.client import RobotClient
from app.mir.errors import RobotError
from app.services.check_up import reading, trial
from app.services.check_up.judge import judge, judge_taken_over
from app.services.check_up.look import Look
from app.services.check_up.restore import Note, Outcome, put_back
from app.services.check_up.room import check_is_no_copy, check_room
from app.services.dispatch.ledger import Ledger
from app.services.live.alarms import Alarms
from app.services.live.holds import Holds

log = logging.getLogger(__name__)

READY_FOR, READY_WITHIN = 3.0, 120.0  # s that a robot must have stood ready; that is waited for
REQUESTS = 120  # of a trial, about: each takes so much longer where the robot is slow
TRIES, AGAIN_AFTER = 4, 3.0  # to put a robot back at the end, s between them
MINUTES = timedelta(minutes=10)  # after a trial began, in which whoever agreed to it expects the robot to be released
HOLD = message("Check-up")[
    "msgid"
]  # reason of the hold that keeps the plan's starts back meanwhile, translated where it is shown
NONE = 0  # the id of no hold
ALARM = "check_up_left"
BUILT_IN = "mirconst"  # guids of the missions that every robot has begin so


class Trials:
    def __init__(
        self,
        db: Database,
        *,
        clock: Clock,
        ledger: Ledger,
        holds: Holds,
        alarms: Alarms,
        settings: Callable[[], Settings],
    ) -> None:
        self._db, self._clock, self._ledger, self._holds, self._alarms, self._settings = (
            db,
            clock,
            ledger,
            holds,
            alarms,
            settings,
        )
        self._robots, self._check_ups = RobotRepository(), CheckUpRepository()
        self._stays_paused = set[int]()  # robots on which a person has pressed Pause since their trial began

    @staticmethod
    def length_s(agreed: Trial | None) -> float:
        """Of the whole check-up, about."""
        return reading.length_s() + (0.0 if agreed is None else trial.length_s(agreed.mission))

    def check(self, robot: Robot, client: RobotClient, agreed: Trial) -> None:
        """Before the robot is read for a minute; one that doesn't answer is told by reading it. Raises InvalidInput with what is in the
        way."""
        self._check_room(robot, agreed)
        try:
            is_in_the_way = not _is_ready(client)
            _mission(client, agreed)
        except RobotError:
            return
        if is_in_the_way:
            raise _not_ready(robot)

    def run(self, look: Look, robot: Robot, agreed: Trial, identity: Identity) -> bool:
        """Whether it was tried to the end; if not, a finding says why. Raises NotWanted."""
        if (rest := look.seen.get("rest")) is not None:
            look.probe.spare(rest.requests, rest.seconds)
        slow_s = REQUESTS * (look.seen.get("latency") or (0.0,))[-1]
        try:
            self._check_room(robot, agreed, slow_s)
            queued = _mission(look.probe.client, agreed)
            self._wait_until_ready(look, robot)
            floor = look.probe.client.highest_queue_id() or 0
            self._check_room(
                robot, agreed, slow_s
            )  # a person may have held it or started something while it was waited for
        except (InvalidInput, RobotError) as refused:
            look.amber(
                Topic.ORDER, message("Not tried: {problem}", problem=refused.message), message("Check up again.")
            )
            return False
        made = None if queued else str(uuid.uuid4())
        left = self._hold(
            robot, LeftBehind(identity.serial_number or robot.serial_number, made, trial.tokens(), floor, queued=queued)
        )
        is_wanted = look.is_wanted
        look.is_wanted = lambda: is_wanted() and robot.id not in self._stays_paused
        self._stays_paused.discard(robot.id)
        run = trial.TrialRun(look, left, self._noting(robot, left.hold), reading.length_s(), self.length_s(agreed))
        try:
            judge(look, seen := run.run(), identity.user_name)
        except trial.TakenOver as end:
            judge_taken_over(look, end.sign)
            return False
        finally:
            self._finish(look, robot, run.left, identity.user_name)
        return seen.problem is None and not seen.may_not_make

    def _hold(self, robot: Robot, left: LeftBehind) -> LeftBehind:
        """Both or neither is on the disk: the note of what a trial is about to change, and the hold. It has no end, as nothing may be sent
        to the robot before it is as it was; a person may release it. Raises InvalidInput where the robot has been removed or replaced."""
        hold = self._holds.hold(
            HOLD, robot_id=robot.id, also=lambda c, hold: self._note(c, robot, replace(left, hold=hold.id))
        )
        return replace(left, hold=hold.id)

    def _wait_until_ready(self, look: Look, robot: Robot) -> None:
        """After so many questions it may have booted, and what others queued may run. Raises InvalidInput, RobotError or NotWanted."""
        began = ready_since = self._clock.monotonic()
        while self._clock.monotonic() - ready_since < READY_FOR:
            look.at(message("Waiting until it stands ready"), reading.length_s(), self.length_s(None))
            if not _is_ready(look.probe.client):
                ready_since = self._clock.monotonic()
            if ready_since - began > READY_WITHIN:
                raise _not_ready(robot)
            self._clock.sleep(1.0)

    def _finish(self, look: Look, robot: Robot, left: LeftBehind, user: str) -> None:
        """Everything as it was, and a finding of it."""
        outcome = Outcome(None)
        for tries_left in reversed(range(TRIES)):
            left = self.left_behind().get(robot.id, left)
            try:
                outcome = self._put_back(look, robot, left, user)
                break
            except RobotError as error:
                outcome = Outcome(error.message)
            if tries_left:  # a command that ends now leaves it so until the app is started
                self._clock.sleep(AGAIN_AFTER)
        if outcome.problem is not None:
            self._tell(robot, outcome.problem)
            look.red(
                Topic.LEFT,
                message("It is not as it was before: {problem}", problem=outcome.problem),
                message(
                    "The app puts it back as soon as it can, and keeps the plan's starts back until then: look at the robot."
                ),
            )
        elif outcome.is_in_error:
            look.red(
                Topic.LEFT,
                message("Nothing of the trial is left on it, but it stands with an error"),
                message("Look at the robot, then reset the error there or in the app."),
            )
        elif robot.id in self._stays_paused:
            look.green(
                Topic.LEFT, message("Nothing of the trial is left on it; it stands in Pause, as somebody wanted")
            )
        elif outcome.stays_paused:
            look.amber(
                Topic.LEFT,
                message("Nothing of the trial is left on it; it stands in Pause"),
                message("Release it at the robot or in the app when it may go on."),
            )
        else:
            look.green(
                Topic.LEFT, message("It is as it was before: nothing is queued, no mission was left, it is not paused")
            )

    def leave_paused(self, robot_id: int) -> None:
        """A person presses Pause: it is theirs from now on, and a trial under way ends."""
        if robot_id in self.left_behind():
            self._stays_paused.add(robot_id)
            self._db.write(lambda c: self._check_ups.leave_paused(c, robot_id))

    # ------------------------------------------------------------------ what was cut off
    def left_behind(self) -> Mapping[int, LeftBehind]:
        return self._check_ups.left_behind(self._db.read())

    def tidy(self, look: Look, robot: Robot) -> Message | None:
        """Put back what a trial that was cut off left there. Returns what could not be. Raises RobotError, and InvalidInput on a copy."""
        left = self.left_behind().get(robot.id)
        if left is None:
            return None
        check_is_no_copy(self._holds)
        try:
            if _is_of_another(left, robot.serial_number) or _is_of_another(
                left, (identity := look.probe.identity()).serial_number
            ):
                log.warning(
                    "robot %r: what a check-up left is on the machine with serial number %s",
                    robot.name,
                    left.serial_number,
                )
                self._noting(robot, left.hold)(None)
                return None
            problem = self._put_back(look, robot, left, identity.user_name, is_late=self._is_late(robot, left)).problem
        except RobotError as error:
            self._tell(robot, error.message)
            raise
        if problem is not None:
            self._tell(robot, problem)
        log.info(
            "robot %r: what a check-up left there is %s", robot.name, "put back" if problem is None else "still there"
        )
        return problem

    def _is_late(self, robot: Robot, left: LeftBehind) -> bool:
        """Whether a person may have taken the robot since: the trial began long ago, or its hold was let go."""
        now = self._clock.now()
        return not any(
            hold.id == left.hold
            and hold.robot_id == robot.id
            and hold.since
            and timedelta() <= now - hold.since <= MINUTES
            for hold in self._holds.current()
        )

    def _tell(self, robot: Robot, problem: Message) -> None:
        self._alarms.raise_about_robot(ALARM, robot, problem=problem)

    def _put_back(self, look: Look, robot: Robot, left: LeftBehind, user: str, *, is_late: bool = False) -> Outcome:
        is_idle_period = self._robots.idle_queue_id(self._db.read(), robot.id) == left.queue_floor
        highest = look.probe.client.highest_queue_id() if is_idle_period else None
        outcome = put_back(
            look,
            left,
            self._noting(robot, left.hold),
            user,
            lambda queue_id: self._is_of_plan(robot, queue_id),
            is_late=is_late,
            is_ours=lambda: self.left_behind().get(robot.id, left).is_paused,
        )
        if outcome.problem is None and highest is not None and highest <= left.queue_floor + len(left.tokens):
            self._ledger.note_idle_copy(robot.id, highest, runs=True)  # nobody has used the robot meanwhile
        return outcome

    # ------------------------------------------------------------------ inside
    def _is_of_plan(self, robot: Robot, queue_id: int) -> bool:
        """Or may be: what is on its way has no number yet."""
        return self._ledger.is_claimed(robot.id, queue_id) or bool(self._ledger.open_for(robot.id, (State.SUBMITTING,)))

    def _check_room(self, robot: Robot, agreed: Trial, slow_s: float = 0.0) -> None:
        check_room(
            self._db.read(),
            robot,
            self._ledger,
            self._holds,
            self._settings(),
            self._clock.now(),
            timedelta(seconds=self.length_s(agreed) + slow_s),
        )

    def _noting(self, robot: Robot, hold_id: int | None) -> Note:
        """On the disk when it returns. With the note or its hold taken back the plan's starts are held back no longer, unless a person has
        set another hold meanwhile. Raises InvalidInput where the robot has been removed or replaced."""

        def note(left: LeftBehind | None) -> None:
            if left is None or left.hold is None:
                self._holds.release(robot.id, hold_id or NONE, also=lambda c: self._note(c, robot, left))
            else:
                self._db.write(lambda c: self._note(c, robot, left))
            if left is None:
                self._alarms.clear(ALARM, f"robot:{robot.id}")

        return note

    def _note(self, c: sqlite3.Connection, robot: Robot, left: LeftBehind | None) -> None:
        self._check_ups.note_left_behind(c, robot.id, left)
        if left is not None and self._check_ups.left_behind(c).get(robot.id) != left:
            raise InvalidInput("robot", "this robot has been removed")


def missions_of(client: RobotClient) -> Mapping[str, str]:
    """Names of the missions that people made on the robot, with their guids. Raises RobotError."""
    return {mission.name: mission.guid for mission in client.missions() if not mission.guid.startswith(BUILT_IN)}


def _mission(client: RobotClient, agreed: Trial) -> str | None:
    """The guid of the robot's own mission; None: one is made. Raises InvalidInput or RobotError."""
    if agreed.mission is None:
        return None
    guid = missions_of(client).get(agreed.mission)
    if guid is None:
        raise InvalidInput("mission", "the robot has no mission {mission}", mission=agreed.mission)
    if any(parameter.default in (None, "") for parameter in client.parameters(guid) or ()):
        raise InvalidInput(
            "mission", "{mission} asks for values when it is started: choose another mission", mission=agreed.mission
        )
    return guid


def _is_of_another(left: LeftBehind, serial_number: str | None) -> bool:
    """Whether it was left on another machine than that with this serial number."""
    return None not in (left.serial_number, serial_number) and left.serial_number != serial_number


def _is_ready(client: RobotClient) -> bool:
    """Whether it stands ready and nothing is in its queue. Raises RobotError."""
    return client.status().state is RobotState.READY and not client.open_items()


def _not_ready(robot: Robot) -> InvalidInput:
    return InvalidInput(
        "robot", "{robot} does not stand ready with an empty queue: check up when it does", robot=robot.name
    )
