"""The observation of one robot: its connection, its status, its queue's highest id; and the resulting alarms and
history."""

from __future__ import annotations

import logging
import math
import sqlite3
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any
from zoneinfo import ZoneInfo

from app.domain import rules
from app.domain.activity import SpanRecorder, activity_of, can_work, is_charging
from app.domain.capabilities import FindBy
from app.domain.check_up import RobotProfile
from app.domain.clock import ClockReading
from app.domain.execution import Execution
from app.domain.message import Message, message, message_of, render
from app.domain.models import Connection, Robot
from app.domain.robot import RobotState, RobotStatus, problems_in_words
from app.mir.errors import (
    AnotherFleet,
    AnotherRobot,
    CertificateMismatch,
    CertificateProblem,
    NotAMir,
    RobotError,
    SerialNumberHidden,
    TimedOut,
    Unauthorized,
    Unreadable,
    VehicleUnavailable,
)
from app.mir.target import Target
from app.services.dispatch.context import Context
from app.services.dispatch.timing import (
    CLOCKS_PART,
    IN_PART_AT_MOST,
    LEAVES_WITHIN,
    LIVE_EVERY,
    SAVE_SPANS_EVERY,
    SLOW_ANSWER,
    STATUS_IS_FRESH,
)
from app.services.live.snapshots import STALE_POLLS

log = logging.getLogger(__name__)

LATEST = datetime(2200, 1, 1, tzinfo=UTC).timestamp()  # higher floors are numbers of orders that were adopted
WRITES_TO_PRUNE = 200  # writes of its activity between two deletions of old ones


class Observation:
    def __init__(self, robot: Robot, client: Target, context: Context) -> None:
        self._robot, self._client, self._s = robot, client, context
        self.clock: ClockReading | None = None
        self.gives_time = True  # as far as is known; robots behind some proxies don't
        self.highest: int | None = None  # queue id seen
        self._highest_answer = 0  # the last; what a search has shown since may be higher
        self.began_again_at = -math.inf  # when a fleet's highest id was seen to be lower than before; monotonic
        self.newest: int | None = None  # of a fleet's robot: id of its own newest order, as fleets count for all
        self.user_name = ""  # who we are to the robot, once it has been asked
        self.failures = 0  # since the last answer
        self._silences = 0  # failures that are not the tablet's own, since the last answer
        self._failing_fleet: str | None = None  # the name of its fleet, where that fails and not the robot alone
        self.was_lost = False  # did not answer, since somebody set this back
        self._status: RobotStatus | None = None
        self._read_at = -math.inf  # -inf while it is asked for, and after anything went wrong
        self._answered_at = -math.inf  # when it was last read; -inf once anything went wrong
        self._answered_on = context.clock.now()  # and by the wall clock
        self._identified = False
        self._refused = False  # answers, but not to this user; only /status needs none
        self._in_part_since = math.inf  # its status can be read, but not its queue; on the monotonic clock
        self._evaluated: set[str] = set()  # codes judged since the start
        self._alarmed: set[str] = set()  # codes of this robot's alarms that are active
        self._spans = SpanRecorder()
        self._spans_saved_at = context.clock.monotonic()
        self._writes_to_prune = 0  # writes of spans until the next pruning

    @property
    def robot(self) -> Robot:
        return self._robot

    @robot.setter
    def robot(self, robot: Robot) -> None:
        """Takes over the robot as configured now. With another serial number it is another machine, still unknown;
        switched off or on, it has no alarms until it is asked again (the catalogue has ended them)."""
        if robot.enabled is not self._robot.enabled:
            self.failures, self._alarmed, self._evaluated, self._in_part_since = 0, set(), set(), math.inf
            self._silences = 0
        if self._robot.serial_number not in (None, robot.serial_number):
            self.highest, self.newest, self._identified = None, None, False
            self.invalidate_status()
        self._robot = robot
        self._client.serial_number, self._client.identified_by = robot.serial_number, robot.identified_by
        self._client.use_profile(robot.known)

    @property
    def last_use(self) -> int | None:
        """The id that is another one once the robot has more to do."""
        return self.highest if self._client.capabilities.own_queue else self.newest

    def read_highest(self, floor: int = 0) -> int:
        """The highest queue id. Lower than the last answer or the ``floor``: the fleet has begun its numbers again."""
        highest = self._client.highest_queue_id() or 0
        if self._client.capabilities.shares_numbers and highest < max(self._highest_answer, floor):
            self.began_again_at = self._s.clock.monotonic()
        self.highest = self._highest_answer = highest
        return highest

    @property
    def time(self) -> datetime:
        """By the fleet's own clock where that is its floor, as the tablet's may be set while the app is off."""
        if self._client.capabilities.find_by is not FindBy.ID:
            return self._s.clock.now()
        return self.time_of(self._client.highest_queue_id()) or self._s.clock.now()

    def time_of(self, floor: int | None) -> datetime | None:
        """None: this floor is no time."""
        if not floor or floor > LATEST or self._client.capabilities.find_by is not FindBy.ID:
            return None
        return datetime.fromtimestamp(floor, UTC)

    def saw_id(self, queue_id: int) -> None:
        """Missions of others from now on have higher ids, unless the app chooses the ids."""
        if self.highest is not None and self._client.capabilities.find_by is not FindBy.ID:
            self.highest = max(self.highest, queue_id)

    @property
    def known(self) -> RobotProfile | None:
        """The results of its check-up, if certainly still valid: its software was read since it booted."""
        return self.robot.known if self._identified else None

    @property
    def quiet_seconds(self) -> float:
        return rules.quiet_seconds(self._s.settings(), self.robot)

    # ------------------------------------------------------------------ reading
    def read_status(self) -> RobotStatus:
        """Ask for the status; snapshot and alarms follow. Raises RobotError, AnotherRobot when another machine answers."""
        self._read_at = -math.inf
        try:
            status = self._client.status()
        except RobotError as error:
            self._note_failure(error)
            raise
        if self.robot.profile is not None and _may_have_changed(self._status, status, self.robot):
            self._identified = False
        self._status, self._answered_on = status, self._s.clock.now()
        self._answered_at = self._read_at = self._s.clock.monotonic()  # last, as other threads read ``fresh_status``
        self._note_answer(status)
        return status

    def identify(self) -> None:
        """Once per start, and after each boot of a robot with a profile: check the password (``/status`` needs none),
        and read which machine it is, if unknown."""
        if self._identified:
            return
        identity = self._client.identify()
        names = ("serial_number", "model", "software", "identified_by")
        found: dict[str, Any] = {name: value for name in names if (value := getattr(identity, name))}
        if any(value != getattr(self.robot, name) for name, value in found.items()):
            if not self._s.db.write(lambda c: self._s.robots.note_identity(c, self.robot, **found)):
                return  # edited since: asked again with the new values
            self.robot = replace(self.robot, **found)
        self._identified, self._refused = True, False
        self.user_name = identity.user_name
        self._set_alarm("unauthorized", False)
        self._change_connection(Connection.CONNECTED, "")

    def recent_status(self) -> RobotStatus:
        """One read serves all that fall due together: reachability, serial number and battery are judged on it. Raises RobotError."""
        return self.fresh_status or self.read_status()

    def trouble(self) -> RobotError | None:
        """Why it can't be asked now; None when it answers, or did a moment ago."""
        try:
            self.recent_status()
        except RobotError as error:
            return error
        return None

    @property
    def fresh_status(self) -> RobotStatus | None:
        """The status read a moment ago; None if it is too old, there was no answer, or the tablet has slept since.
        Changes nothing: any thread may call."""
        return self._status if self.age <= STATUS_IS_FRESH and not self._has_slept else None

    @property
    def may_be_sent_by(self) -> bool:
        """Whether a start that was ready by that status may still be sent, also with a slow robot or connection."""
        return self.age <= LEAVES_WITHIN and not self._has_slept

    @property
    def _has_slept(self) -> bool:
        """Whether its clocks have run differently since it was read. A tablet whose clock was set looks the same."""
        passed = (self._s.clock.now() - self._answered_on).total_seconds()
        return abs(passed - (self._s.clock.monotonic() - self._answered_at)) > CLOCKS_PART

    @property
    def is_awaiting_answer(self) -> bool:
        """Whether it answered at its last reading, which is too old now or is being repeated. Any thread may call."""
        return self.robot.enabled and self.fresh_status is None and self.answered_ago < math.inf

    @property
    def seems_free(self) -> bool:
        """Whether it may take a start of a group at once, by its status read a moment ago. Any thread may call."""
        status = self.fresh_status
        return (
            status is not None
            and can_work(status)
            and (status.state is not RobotState.EXECUTING or is_charging(status))
        )

    @property
    def contradicts_clock(self) -> bool:
        """Whether the tablet's unproven clock may be wrong, according to this robot."""
        return self.clock is not None and self._s.is_contradicted(self.robot.id, self.clock)

    @property
    def age(self) -> float:
        """Seconds since the status was read."""
        return self._s.clock.monotonic() - self._read_at

    @property
    def answered_ago(self) -> float:
        """The same, also while it is being read; infinite after any error since. Any thread may call."""
        return self._s.clock.monotonic() - self._answered_at

    def invalidate_status(self) -> None:
        """A request went wrong, or it is another machine: the next start reads the robot first."""
        self._answered_at = self._read_at = -math.inf

    def is_off(self) -> None:
        """Switched off in Settings."""
        self._s.snapshots.update(self.robot.id, connection=Connection.DISABLED, queue=(), status=None)

    # ------------------------------------------------------------------ what a reading means
    def _note_answer(self, status: RobotStatus) -> None:
        now, before = self._s.clock.now(), self._s.snapshots.get(self.robot.id)
        self.failures, self._silences, self._failing_fleet = 0, 0, None
        connection = Connection.SLOW if status.elapsed_s > SLOW_ANSWER else Connection.CONNECTED
        problem: Message = ""
        if self._refused:
            connection, problem = Connection.UNAUTHORIZED, before.problem
        elif self.answers_in_part:
            connection, problem = before.connection, before.problem
        self.gives_time = status.date is not None
        if status.date is not None:
            self.clock = ClockReading((status.date - now).total_seconds(), self._s.clock.monotonic())
        self._observe(activity_of(status))
        self._change_connection(connection, problem, status=status, read_at=now, capabilities=self._client.capabilities)
        trouble = problems_in_words(status.errors) or status.mission_text or message("an error")
        self._set_alarm("emergency_stop", status.state is RobotState.EMERGENCY_STOP)
        self._set_alarm("robot_error", status.state is RobotState.ERROR, problem=trouble)
        if self._identified:
            self._judge_check_up()

    def note_failure(self, error: RobotError) -> None:
        """A read failed, perhaps at its status. If only the status was answered, the robot counts as partly silent
        until all requests are answered."""
        if self._read_at > -math.inf:
            self._in_part_since = min(self._in_part_since, self._s.clock.monotonic())
            self._note_failure(error)

    @property
    def answers_in_part(self) -> bool:
        """Whether it gave its status last, and something else could not be read."""
        return self._in_part_since < math.inf

    def note_all_read(self) -> None:
        """Its queue was read too."""
        if self.answers_in_part:
            self._in_part_since = math.inf
            self._change_connection(Connection.CONNECTED, "")

    def _note_failure(self, error: RobotError) -> None:
        self.failures += 1
        self._silences = 0 if self._s.tablet.has_no_network else self._silences + 1
        self.was_lost = True
        self._answered_at = -math.inf
        self._observe("offline")
        self._failing_fleet = self.robot.fleet.name if self.robot.fleet and _is_of_fleet(error) else None
        in_part_for = self._s.clock.monotonic() - self._in_part_since
        match error:
            case AnotherRobot():
                self._set_alarm(
                    "wrong_robot", True, expected=error.params["expected"], found=self._named(error.params["found"])
                )
                connection = Connection.WRONG_ROBOT
            case SerialNumberHidden():
                self._set_alarm("serial_hidden", True, expected=error.params["expected"])
                connection = Connection.WRONG_ROBOT
            case CertificateMismatch():
                self._set_alarm("certificate_changed", True)
                connection = Connection.OTHER_CERTIFICATE
            case CertificateProblem(code="certificate_untrusted"):
                self._set_alarm("certificate_untrusted", True)
                connection = Connection.UNTRUSTED
            case Unauthorized():
                self._identified, self._refused = False, True
                self._set_alarm("unauthorized", True)
                connection = Connection.UNAUTHORIZED
            case NotAMir() | Unreadable():
                connection = Connection.NOT_A_ROBOT
            case TimedOut() if self.failures == 1 and in_part_for < IN_PART_AT_MOST:
                connection = Connection.SLOW  # one slow answer is slow, not unreachable
            case _:
                connection = Connection.UNREACHABLE
        problem = message_of(error)
        is_its_own = self._silences == 2 or (in_part_for >= IN_PART_AT_MOST and not self._s.tablet.has_no_network)
        if connection in (Connection.UNREACHABLE, Connection.NOT_A_ROBOT) and is_its_own:
            self._set_alarm(
                "unreachable" if connection is Connection.UNREACHABLE else "not_a_robot", True, problem=problem
            )
        if connection not in (Connection.UNREACHABLE, Connection.SLOW):
            self._set_alarm("unreachable", False)
        self._change_connection(connection, problem, fleet_failed=self._failing_fleet is not None)

    def _named(self, serial_number: str) -> Message:
        """With the name of the configured robot that has it: robots may have changed places."""
        owner = next(
            (robot for robot in self._s.robots.all(self._s.db.read()) if robot.serial_number == serial_number), None
        )
        return message("{number} ({robot})", number=serial_number, robot=owner.name) if owner else serial_number

    def _change_connection(self, connection: Connection, problem: Message, **values: object) -> None:
        before = self._s.snapshots.get(self.robot.id)
        if before.connection is not connection:
            values["since"] = self._s.clock.now()
            level = logging.INFO if connection in (Connection.CONNECTED, Connection.SLOW) else logging.WARNING
            log.log(level, "%s: %s%s", self.robot.name, connection, f" ({render(problem)})" if problem else "")
        if connection is Connection.CONNECTED:
            for code in (
                "unreachable",
                "not_a_robot",
                "wrong_robot",
                "serial_hidden",
                "certificate_changed",
                "certificate_untrusted",
            ):
                self._set_alarm(code, False)
        self._s.snapshots.update(self.robot.id, connection=connection, problem=problem, **values)

    def _set_alarm(self, code: str, on: bool, **details: object) -> None:
        """Raise or clear the alarm of a condition when it changes (and, once after a start, clear those of an earlier
        run)."""
        if on and code not in self._alarmed:
            self._alarmed.add(code)
            whose = {"fleet": self._failing_fleet} if self._failing_fleet else {}
            self._s.alarms.raise_about_robot(code, self.robot, **whose, **details)
        elif not on and (code in self._alarmed or code not in self._evaluated):
            self._alarmed.discard(code)
            self._s.alarms.clear(code, f"robot:{self.robot.id}")
        self._evaluated.add(code)

    def _judge_check_up(self) -> None:
        """An alarm says that a profile does not count any more."""
        profile, robot = self.robot.profile, self.robot
        change: Message = ""
        if profile is not None and robot.serial_number != profile.serial_number:
            change = message(
                "it is another machine now, with serial number {number}", number=robot.serial_number or "?"
            )
        elif profile is not None and robot.software != profile.software:
            change = message("its software is {software} now", software=robot.software or "?")
        self._set_alarm("check_up_outdated", bool(change), change=change)

    def raise_about(self, row: Execution, code: str, **details: object) -> None:
        """An alarm of an execution on this robot."""
        self._s.alarms.raise_(
            code, f"execution:{row.id}", robot=self.robot.name, robot_id=self.robot.id, mission=row.mission, **details
        )

    # ------------------------------------------------------------------ what it is seen doing
    def _observe(self, activity: str) -> None:
        """Records what the robot does; a gap longer than 3 polls leaves a hole. Any robot of a fleet does nothing itself."""
        if self.robot.is_any:
            return
        longest_gap = STALE_POLLS * max(self._s.settings().poll_interval_seconds, LIVE_EVERY)
        self._spans.saw(activity, self._s.clock.now(), self._s.clock.monotonic(), longest_gap)

    def save(self, *, at_once: bool = False) -> None:
        """At most once a poll, when the robot does something else, and otherwise once a minute."""
        mono = self._s.clock.monotonic()
        if not (at_once or self._spans.has_changed or mono - self._spans_saved_at >= SAVE_SPANS_EVERY):
            return
        spans = self._spans.take()
        self._spans_saved_at = mono
        if not spans:
            return
        prunes = self._writes_to_prune == 0
        self._writes_to_prune = WRITES_TO_PRUNE if prunes else self._writes_to_prune - 1

        def work(c: sqlite3.Connection) -> None:
            self._s.activities.save(c, self.robot.id, spans)
            if prunes:
                self._s.activities.prune(c, self.robot.id, self._s.clock.now(), ZoneInfo(self._s.settings().timezone))

        self._s.db.write(work)


def _is_of_fleet(error: RobotError) -> bool:
    """Whether a fleet fails, and not only one of its robots."""
    return isinstance(error, AnotherFleet) or not isinstance(error, AnotherRobot | VehicleUnavailable)


def _may_have_changed(before: RobotStatus | None, status: RobotStatus, robot: Robot) -> bool:
    """Whether its software may have changed: it says so, or has booted."""
    has_booted = before is not None and status.has_booted_since(before.uptime_s)
    return has_booted or status.software not in (None, robot.software)
