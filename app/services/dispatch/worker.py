"""Everything that is done with one robot, step by step on its own worker: read it, follow its executions, idle automation, dispatch.

A worker has no thread of its own (poll_loop gives it one; the simulation steps it directly). A robot that hangs or is gone therefore delays
nobody but itself.
"""
from __future__ import annotations

import logging
import math
import sqlite3
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from zoneinfo import ZoneInfo

from app.database.activities import ActivityRepository
from app.database.connection import Database
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.domain import rules
from app.domain.activity import SpanRecorder, activity_of
from app.domain.clock import Clock
from app.domain.message import Message, message, message_of, render
from app.domain.models import Connection, Execution, Robot, Settings, Trigger
from app.domain.robot import RobotState, RobotStatus
from app.mir.client import RobotClient
from app.mir.errors import NotAMir, Rejected, RobotError, TimedOut, Unauthorized, Unreadable
from app.services.dispatch.dispatcher import Dispatcher, Ready, WrongRobot
from app.services.dispatch.idle import IdleSituation, IdleWatch, idle_mission_is_due, is_idle
from app.services.dispatch.intents import Intents
from app.services.dispatch.ledger import Ledger
from app.services.dispatch.tracker import Tracker, is_ours
from app.services.live.alarms import Alarms
from app.services.live.gaps import Downtime
from app.services.live.holds import Holds
from app.services.live.snapshots import STALE_POLLS, Snapshots
from app.services.planning.working_days import WorkingCalendar

log = logging.getLogger(__name__)

LIVE_EVERY = 2.0                # s between status reads while it is on screen or something of ours runs
GOLDEN_RATIO = 0.618034         # multiples of it fill a circle evenly, however many they are
PREFETCH_SPREAD = 0.4           # s over which the status reads before something due soon are spread
SLOW_ANSWER = 2.0               # s; a slower answer counts, and is shown as slow
SAVE_SPANS_EVERY = 60.0         # s between writes of what the robot is seen doing
PRUNE_EVERY = 200               # such writes, between dropping what is too old


@dataclass
class Services:
    """What every worker shares."""
    db: Database
    clock: Clock
    ledger: Ledger
    holds: Holds
    alarms: Alarms
    downtime: Downtime
    snapshots: Snapshots
    robots: RobotRepository
    missions: MissionRepository
    schedules: ScheduleRepository
    settings: Callable[[], Settings]
    calendar: Callable[[], WorkingCalendar]
    restored_at: datetime | None           # who goes back to a backup opens everything anew
    activities: ActivityRepository = field(default_factory=ActivityRepository)


def phase_of(robot_id: int) -> float:
    """From 0 to 1, different for each robot and well distributed: spreads what many robots' workers would do in one moment."""
    return robot_id * GOLDEN_RATIO % 1


class RobotWorker:
    def __init__(self, robot: Robot, client: RobotClient, services: Services) -> None:
        self.robot, self.client, self._s = robot, client, services
        self.polled = False                     # the first poll is over, with or without an answer
        self.clock_offset: float | None = None  # s, the robot's HTTP Date minus the tablet's clock
        self.watched = False                    # on screen
        self._dispatcher = Dispatcher(
            robot, client, ledger=services.ledger, clock=services.clock, holds=services.holds, alarms=services.alarms,
            downtime=services.downtime, settings=services.settings, restored_at=services.restored_at,
            read_status=self.read_status, queue_floor=lambda: self._highest)
        self._tracker = Tracker(robot, client, services.ledger, self._dispatcher)
        self._idle = IdleWatch()
        self._highest: int | None = None        # highest queue id seen on this robot
        self._identified = False
        self._refused = False                   # answers, but not to this user; /status alone answers anybody
        self._failures = 0
        self._evaluated: set[str] = set()         # codes judged since the start
        self._alarmed: set[str] = set()         # codes of this robot's alarms that are active
        self._has_sent = False                  # something of ours is with the robot, or may be: as the last step left it
        self._intents = Intents(services.clock)
        self._poll_asked = self._changed = False
        self._next_live = self._dispatch_at = -math.inf
        self._prepare_at = math.inf
        self._spans = SpanRecorder()
        self._spans_saved_at = services.clock.monotonic()
        self._writes_to_prune = 0               # writes of spans until the next pruning

    # ------------------------------------------------------------------ the steps
    def step(self, poll: bool, due_soon: bool = False, intents: Sequence[Execution] = (), changed: bool = True) -> float:
        """Send those of the ``intents`` that are due. Then, unless the next of them is due in a moment, do a round: a full poll when asked
        (and the first time), else what is live, due, or due soon. ``changed``: ledger or plan may have something new; without it the
        ledger is read only when that is due, and after reading the robot. Returns the seconds until the next step is wanted."""
        now = self._s.clock.monotonic
        self._intents.take(intents)
        self._poll_asked |= poll or not self.polled
        if changed:
            self._changed = True
            self._intents.invalidate()
        if due_soon and self.robot.enabled:
            self._prepare_at = now() + PREFETCH_SPREAD * phase_of(self.robot.id)
        for intent in self._intents.pop_due():
            if self._dispatcher.send(intent, self._intents.needs_recheck(intent)):
                self._note_sent(True)
            else:
                self._changed = True
        if not self._intents.leave_time():
            return max(0.0, self._intents.next_at() - now())
        self._round()
        next_read = self._next_live if self._is_live else math.inf
        return max(0.0, min(self._intents.next_at(), self._dispatch_at, self._prepare_at, next_read) - now())

    def _round(self) -> None:
        """Everything that can wait until nothing is due in a moment."""
        now = self._s.clock.monotonic
        self._dispatcher.note()
        poll, self._poll_asked = self._poll_asked, False
        changed, self._changed = self._changed, False
        reads = poll or (self._is_live and now() >= self._next_live)
        if self.polled and reads:
            self._dispatch()            # what is due does not wait for the robot to be read
        if poll:
            self._poll()
        elif reads:
            self._read_robot(full=False)
        if now() >= self._prepare_at:
            self._prepare_at = math.inf
            self._dispatcher.prepare()
        if changed or reads or now() >= self._dispatch_at:
            self._dispatch()
            self._note_sent(self.robot.enabled and self._s.ledger.has_sent(self.robot.id))

    def _note_sent(self, has_sent: bool) -> None:
        """Whether something of ours is with the robot. After a submission the first read is put off: it would delay what others send."""
        was_live, self._has_sent = self._is_live, has_sent
        if self._is_live and not was_live:
            self._next_live = max(self._next_live, self._s.clock.monotonic() + self._apart(LIVE_EVERY))

    def _dispatch(self) -> None:
        wait = self._dispatcher.run()
        self._dispatch_at = self._s.clock.monotonic() + wait

    def ready(self) -> Ready | None:
        """What the planner has to know to write the intent of what falls due together with its row; None: the worker does that itself."""
        return self._dispatcher.ready() if self.polled and self.robot.enabled else None

    def dispatch_only(self, execution_id: int) -> float:
        """Only this execution: a one-shot command sends nothing else."""
        return self._dispatcher.run(only=execution_id)

    def close(self, untaken: Sequence[Execution] = ()) -> None:
        """``untaken``: intents for this worker that no step was given."""
        try:
            self._dispatcher.note()
            self._s.ledger.release_unsent([*self._intents.held, *untaken])
            self._save_spans()
        finally:
            self.client.close()

    @property
    def _is_live(self) -> bool:
        return self.robot.enabled and (self.watched or self._has_sent)

    def _poll(self) -> None:
        """One cycle of this robot: status, queue, tracking, idle automation. Dispatch follows in ``step``."""
        try:
            if self.robot.enabled:
                self._read_robot(full=True)
                if self._failures == 0:
                    self._trigger_idle()
            else:
                self._s.snapshots.update(self.robot.id, connection=Connection.DISABLED, queue=(), status=None)
        finally:
            self.polled = True
        if self._spans.has_changed or self._s.clock.monotonic() - self._spans_saved_at >= SAVE_SPANS_EVERY:
            self._save_spans()

    def _read_robot(self, *, full: bool) -> None:
        """Read the robot and follow what runs on it; between polls (``full`` False) its queue only when it is on screen. What can't be read
        stays as it was, with its age."""
        mono = self._s.clock.monotonic()
        try:
            status = self.read_status()
            self._identify()
            if full or self.watched:
                self._read_queue(status, full)
            self._tracker.follow()
        except (RobotError, WrongRobot) as error:
            if self._failures == 0:
                self._note_failure(error)
        pause = LIVE_EVERY * 2 ** min(self._failures, 5)
        pause = min(pause, max(LIVE_EVERY, self._s.settings().poll_interval_seconds))
        self._next_live = mono + (self._apart(pause) if full else pause)

    def _apart(self, pause: float) -> float:
        """About ``pause``, different for each robot, so that robots polled or sent to in one moment are not read in one moment again and
        again, which would delay what falls due then. Exactly ``pause`` for the one on screen."""
        return pause if self.watched else pause * (0.5 + phase_of(self.robot.id))

    # ------------------------------------------------------------------ reading
    def read_status(self) -> RobotStatus:
        """Ask for the status; the snapshot and the alarms follow. Raises RobotError, or WrongRobot when another machine answers."""
        try:
            status = self.client.status()
            self._check_serial(status)
        except (RobotError, WrongRobot) as error:
            self._note_failure(error)
            raise
        self._note_answer(status)
        return status

    def _check_serial(self, status: RobotStatus) -> None:
        expected = self.robot.serial_number
        if expected and status.serial_number and status.serial_number != expected:
            raise WrongRobot(expected, status.serial_number)

    def _identify(self) -> None:
        """Once per start: does the password hold (``/status`` answers without one), and which machine is it?"""
        if self._identified:
            return
        identity = self.client.identify()
        found = {"serial_number": identity.serial_number, "model": identity.model, "software": identity.software}
        if any(value and value != getattr(self.robot, name) for name, value in found.items()):
            changes = {name: value for name, value in found.items() if value}
            self._s.db.write(lambda c: self._s.robots.note_identity(c, self.robot.id, **changes))
            stored = self._s.robots.get(self._s.db.read(), self.robot.id)
            self.robot = stored or self.robot
        self._identified, self._refused = True, False
        self._dispatcher.user_name = identity.user_name
        self._set_alarm("unauthorized", False)
        self._change_connection(Connection.CONNECTED, "")

    def _read_queue(self, status: RobotStatus, full: bool) -> None:
        items = tuple(sorted(self.client.open_items(), key=lambda item: (item.is_pending, item.id)))
        if full:
            self._highest = self.client.highest_queue_id() or 0
        now, mono = self._s.clock.now(), self._s.clock.monotonic()
        longest_gap = STALE_POLLS * self._s.settings().poll_interval_seconds
        self._idle.saw(is_idle(status, bool(items)), mono, longest_gap)
        self._s.snapshots.update(self.robot.id, queue=items, queue_read_at=now)
        self._tracker.cancel_duplicates(items)

    # ------------------------------------------------------------------ what a reading means
    @property
    def _key(self) -> str:
        return f"robot:{self.robot.id}"

    def _note_answer(self, status: RobotStatus) -> None:
        now = self._s.clock.now()
        self._failures = 0
        connection = Connection.SLOW if status.elapsed_s > SLOW_ANSWER else Connection.CONNECTED
        problem: Message = ""
        if self._refused:
            connection, problem = Connection.UNAUTHORIZED, self._s.snapshots.get(self.robot.id).problem
        if status.date is not None:
            self.clock_offset = (status.date - now).total_seconds()
        self._observe(activity_of(status))
        self._change_connection(connection, problem, status=status, read_at=now)
        self._robot_alarms(status)

    def _note_failure(self, error: RobotError | WrongRobot) -> None:
        self._failures += 1
        self._idle.not_seen()
        self._observe("offline")
        match error:
            case WrongRobot():
                self._set_alarm("wrong_robot", True, expected=error.expected, found=error.found)
                connection = Connection.WRONG_ROBOT
            case Unauthorized():
                self._identified, self._refused = False, True
                self._set_alarm("unauthorized", True)
                connection = Connection.UNAUTHORIZED
            case NotAMir() | Unreadable():
                connection = Connection.NOT_A_ROBOT
            case TimedOut() if self._failures == 1:
                connection = Connection.SLOW          # one slow answer is slow, not unreachable
            case _:
                connection = Connection.UNREACHABLE
        problem = message_of(error)
        if connection in (Connection.UNREACHABLE, Connection.NOT_A_ROBOT) and self._failures == 2:
            code = "unreachable" if connection is Connection.UNREACHABLE else "not_a_robot"
            self._set_alarm(code, True, problem=problem)
        self._change_connection(connection, problem)

    def _change_connection(self, connection: Connection, problem: Message, **values: object) -> None:
        before = self._s.snapshots.get(self.robot.id)
        if before.connection is not connection:
            values["since"] = self._s.clock.now()
            level = logging.INFO if connection in (Connection.CONNECTED, Connection.SLOW) else logging.WARNING
            log.log(level, "%s: %s%s", self.robot.name, connection, f" ({render(problem)})" if problem else "")
        if connection is Connection.CONNECTED:
            for code in ("unreachable", "not_a_robot", "wrong_robot"):
                self._set_alarm(code, False)
        self._s.snapshots.update(self.robot.id, connection=connection, problem=problem, **values)

    def _robot_alarms(self, status: RobotStatus) -> None:
        problem: Message = "; ".join(error.description for error in status.errors) or status.mission_text or message("an error")
        self._set_alarm("emergency_stop", status.state is RobotState.EMERGENCY_STOP)
        self._set_alarm("robot_error", status.state is RobotState.ERROR, problem=problem)

    def _set_alarm(self, code: str, on: bool, **details: object) -> None:
        """Raise or clear the alarm of a condition when it changes (and clear, once after a start, what an earlier run left active)."""
        if on and code not in self._alarmed:
            self._alarmed.add(code)
            self._s.alarms.raise_(code, self._key, robot=self.robot.name, **details)
        elif not on and (code in self._alarmed or code not in self._evaluated):
            self._alarmed.discard(code)
            self._s.alarms.clear(code, self._key)
        self._evaluated.add(code)

    # ------------------------------------------------------------------ idle automation
    def _trigger_idle(self) -> None:
        rule, status = self.robot.idle, self._s.snapshots.get(self.robot.id).status
        if rule is None or status is None or self._highest is None or self._s.holds.active(self.robot.id):
            return
        db, now, settings = self._s.db.read(), self._s.clock.now(), self._s.settings()
        last = self._s.ledger.last_idle(self.robot.id)
        if last is not None and self._queue_was_reset(last, self._highest):
            last = None
        situation = IdleSituation(self._idle.seconds(self._s.clock.monotonic()), status, self._highest, last,
                                  self._s.schedules.next_due(db, self.robot.id))
        if not idle_mission_is_due(rule, situation, settings, self._s.calendar(), now):
            return
        if mission := self._s.missions.get(db, rule.mission_id):
            token = str(uuid.uuid4())
            self._s.ledger.add(rules.one_off(Trigger.IDLE, self.robot, mission, settings, now, token, queue_floor=self._highest))

    def _queue_was_reset(self, last: Execution, highest: int) -> bool:
        """Whether the robot lost its queue (a reset, another machine) since its last idle mission: then that queue id means nothing."""
        if last.state.is_open or last.queue_id is None or highest >= last.queue_id:
            return False
        try:
            return not is_ours(last, self.client.queue_item(last.queue_id))
        except Rejected as error:
            return error.status in (404, 410)
        except RobotError:
            return False

    # ------------------------------------------------------------------ what it is seen doing
    def _observe(self, activity: str) -> None:
        """Records what the robot does; a gap longer than 3 polls leaves a hole."""
        mono, now, settings = self._s.clock.monotonic(), self._s.clock.now(), self._s.settings()
        longest_gap = STALE_POLLS * max(settings.poll_interval_seconds, LIVE_EVERY)
        self._spans.saw(activity, now, mono, longest_gap)

    def _save_spans(self) -> None:
        """At most once a poll, when it does something else, and otherwise once a minute."""
        spans = self._spans.take()
        self._spans_saved_at = self._s.clock.monotonic()
        if not spans:
            return
        prunes = self._writes_to_prune == 0
        self._writes_to_prune = PRUNE_EVERY if prunes else self._writes_to_prune - 1

        def work(c: sqlite3.Connection) -> None:
            self._s.activities.save(c, self.robot.id, spans)
            if prunes:
                self._s.activities.prune(c, self.robot.id, self._s.clock.now(), ZoneInfo(self._s.settings().timezone))

        self._s.db.write(work)
