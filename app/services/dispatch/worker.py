"""Everything that is done with one robot: read it, follow its executions, start what is due on it.

A worker has no thread of its own (the runner gives it one; the simulation calls it directly). It gets messages
(``handle``) and continues its work (``advance``). So a robot that hangs or is absent delays only itself.

What happens to a start is in ``sending``: its row is ``waiting``, then ``submitting`` while its POST is under way or
its outcome unknown, then ``queued``. After ``submitting`` it is sent again only when the robot's queue, read after the
quiet time, does not have it.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import math
import uuid
from collections.abc import Sequence
from datetime import timedelta

from app.domain import rules
from app.domain.execution import Execution, Trigger
from app.domain.models import HandOver, Robot
from app.domain.robot import RobotStatus
from app.mir.errors import NO_LIST, AnotherRobot, Rejected, RobotError
from app.mir.target import Target
from app.services.dispatch import messages
from app.services.dispatch.context import Context
from app.services.dispatch.duplicates import Duplicates
from app.services.dispatch.idle import KEEP_FREE_BEFORE_PLANNED, IdleSituation, IdleWatch, idle_mission_is_due, is_idle
from app.services.dispatch.observation import Observation
from app.services.dispatch.sending import Sending
from app.services.dispatch.timing import LIVE_EVERY, PREFETCH_SPREAD, PUT_OFF_AT_MOST, ROUND_TAKES, STATUS_IS_FRESH
from app.services.dispatch.tracking import Tracking
from app.services.live.snapshots import STALE_POLLS

log = logging.getLogger(__name__)

SOON = timedelta(seconds=10)  # what is due within it is prepared
GOLDEN_RATIO = 0.618034  # multiples of it fill a circle evenly, however many they are


def phase_of(robot_id: int) -> float:
    """From 0 to 1, different for each robot and well distributed: spreads what many robots' workers would do in one moment."""
    return robot_id * GOLDEN_RATIO % 1


class RobotWorker:
    def __init__(self, robot: Robot, client: Target, context: Context) -> None:
        self._client, self._s, self._clock = client, context, context.clock
        self.polled = False  # the first poll is over, with or without an answer
        self.seen = Observation(robot, client, context)
        self._duplicates = Duplicates(client, context, self.seen)
        self._sending = Sending(
            client, context, self.seen, self._duplicates, self._is_still_idle, lambda: self._note_sent(True)
        )
        self._tracking = Tracking(client, context, self.seen, self._duplicates, self._sending.send_due)
        client.on_pause = self._sending.send_due
        self._idle = IdleWatch()
        self._watched = self._sought = False
        self._recoveries = itertools.count(1)
        # Rows may be without a worker: messages that arrived, and all that will.
        self._to_recover, self._expected = {0}, {0}
        self._poll_wanted = True
        self._ledger_changed = True
        self._unanswered = 0  # attempts in a row to read its items while it is switched off
        self._has_sent = False  # something of ours is with the robot, or may be
        self._next_live = -math.inf  # all on the monotonic clock
        self._prefetch_at = self._put_off_since = math.inf
        self._round_ended_at = -math.inf

    @property
    def robot(self) -> Robot:
        return self.seen.robot

    # ------------------------------------------------------------------ messages
    def handle(self, message: messages.Message) -> None:
        """Take note; nothing is done before ``advance``."""
        match message:
            case messages.Start(intent, plan_version):
                self._sending.take_over(intent, plan_version)
            case messages.Poll():
                self._poll_wanted = True
            case messages.Prefetch():
                self._prefetch_at = self._clock.monotonic() + PREFETCH_SPREAD * phase_of(self.robot.id)
            case messages.LedgerChanged():
                self._ledger_changed = True
            case messages.RobotEdited(robot):
                was = self.robot
                self._poll_wanted |= (robot.enabled, robot.serial_number) != (was.enabled, was.serial_number)
                self.seen.robot = robot
                self._ledger_changed = True
            case messages.OnScreen(is_watched):
                self._watched = is_watched
            case messages.NeededByGroup(is_sought):
                self._sought = is_sought
                if is_sought:  # read at once, unless a start is about to be sent there
                    is_sending = math.isfinite(self._sending.attempts.next_ready_at())
                    self._next_live = self._clock.monotonic() + self._staggered(LIVE_EVERY) if is_sending else -math.inf
            case messages.Recover(number):
                self._to_recover.add(number)
                self._ledger_changed = True
            case messages.ClockJumped():
                self._idle.not_seen()
                self._ledger_changed = True

    def expect_recovery(self) -> messages.Recover:
        """The message for rows that no worker may have. Until the worker has looked for them it accepts nothing, so
        that a row it finds is not being sent to it. Any thread may call."""
        number = next(self._recoveries)
        self._expected.add(number)
        return messages.Recover(number)

    def readiness(self) -> messages.Readiness | None:
        """The facts that the planner needs to write a start together with its intent; None: nothing can be sent at
        once. Any thread may call."""
        status, floor = self.seen.fresh_status, self.seen.highest
        if not self.polled or status is None or floor is None or self._expected:
            return None
        if not self.robot.enabled or self.robot.needs_check_up:
            return None
        if self._s.holds.active(self.robot.id) or self._s.clearing.is_of(self.robot.id):
            return None
        if self.robot.hand_over is HandOver.WHEN_FREE:  # seen at the instant
            return None
        return messages.Readiness(self.robot.battery(status), floor, self._s.restored_starts.uncertain_until)

    # ------------------------------------------------------------------ the steps
    def advance(self) -> float:
        """Send due starts; then, unless another is due in a moment, do the other work. Returns the seconds until the
        next call, without a message before."""
        self._sending.send_due()  # as between two reads of a robot that answers slowly
        if (wake_at := self._busy_until()) is None:
            self._round()
            self._round_ended_at = self._clock.monotonic()
            next_read = self._next_live if self._is_live else math.inf
            wake_at = min(self._sending.attempts.next_at(), self._prefetch_at, next_read)
        return max(0.0, wake_at - self._clock.monotonic())

    def _busy_until(self) -> float | None:
        """Until when rounds are postponed; None: no longer. While the robot does not answer, its messages are handled
        together, as one read serves all; a read ahead is not postponed."""
        mono, held_at = self._clock.monotonic(), self._sending.attempts.next_ready_at()
        if held_at - mono <= ROUND_TAKES:
            self._put_off_since = min(self._put_off_since, mono)
            if mono - self._put_off_since < PUT_OFF_AT_MOST:
                return held_at
        self._put_off_since = math.inf
        is_silent = self.seen.failures > 0 and not self.seen.answers_in_part and not self._poll_wanted
        together_at = min(self._round_ended_at + PUT_OFF_AT_MOST, self._prefetch_at)
        return min(held_at, together_at) if is_silent and mono < together_at else None

    def _round(self) -> None:
        mono = self._clock.monotonic()
        self._recover()
        poll, self._poll_wanted = self._poll_wanted, False
        changed, self._ledger_changed = self._ledger_changed, False
        reads = poll or (self._is_live and mono >= self._next_live)
        if self.polled and reads:
            self._sending.run()  # what is due does not wait for the robot to be read
        else:
            self._sending.outcomes.note()
        try:
            if poll:
                self._poll()
            elif reads:
                self._read(full=False)
        finally:
            self.polled |= poll
        if mono >= self._prefetch_at:
            self._prefetch()
        if changed or reads or self._clock.monotonic() >= self._sending.attempts.next_at():
            self._sending.run()
            self._note_sent(self._sending.attempts.may_be_with_the_robot() or self._s.ledger.has_sent(self.robot.id))

    def _recover(self) -> None:
        if self._to_recover:
            self._sending.doubt.recover()
            self._expected -= self._to_recover
            self._to_recover = set()

    def start_only(self, execution_id: int) -> float:
        """A one-shot command sends only this execution. Returns the seconds until the next call."""
        self._recover()
        self._sending.run(only=execution_id)
        return max(0.0, self._sending.attempts.next_at() - self._clock.monotonic())

    def close(self, untaken: Sequence[Execution] = ()) -> None:
        """``untaken``: intents for this worker that it was not given."""
        try:
            self._sending.close(untaken)
            self.seen.save(at_once=True)
        finally:
            self._client.close()

    # ------------------------------------------------------------------ reading
    @property
    def _is_live(self) -> bool:
        return (
            self._has_sent
            or self._duplicates.is_watching
            or self._s.restored_starts.wants(self.robot)
            or (self.robot.enabled and (self._watched or self._is_sought))
        )

    @property
    def _is_sought(self) -> bool:
        return self._sought or self._sending.waits_for_free_robot

    def _note_sent(self, has_sent: bool) -> None:
        """Whether the robot has something of the app. After a submission the first read is postponed: it would delay
        other requests."""
        was_live, self._has_sent = self._is_live, has_sent
        if self._is_live and not was_live:
            self._next_live = max(self._next_live, self._clock.monotonic() + self._staggered(LIVE_EVERY))

    def _poll(self) -> None:
        """One cycle of this robot. A robot that is switched off is read only while it may have something of the app."""
        if not self.robot.enabled:
            self.seen.is_off()
        self._read(full=True)
        if self.robot.enabled and self.seen.failures == 0:
            self._start_idle_mission()
        self.seen.save()

    def _read(self, *, full: bool) -> None:
        """Read the robot and follow what runs on it; between polls (``full`` False) its queue only if it is on screen,
        or a request that was given up may still arrive. Unreadable parts stay unchanged, with their age."""
        mono = self._clock.monotonic()
        if not self.robot.enabled:
            self._follow_switched_off()
        else:
            try:
                status = self.seen.read_status()
                self._sending.send_due()
                self.seen.identify()
                open_ids, unread = self._open_ids(status, full)
                self._tracking.follow(status.serial_number, open_ids)
                self._duplicates.own.answer()
                if unread is not None:
                    self.seen.note_failure(unread)
                elif open_ids is not None:
                    self.seen.note_all_read()
            except AnotherRobot as error:
                self._tracking.give_up_moved(error.params["found"])
            except RobotError as error:
                self.seen.note_failure(error)
        failures = max(self.seen.failures, self._unanswered)
        pause = min(LIVE_EVERY * 2 ** min(failures, 5), max(LIVE_EVERY, self._s.settings().poll_interval_seconds))
        self._next_live = mono + (self._staggered(pause) if full else pause)

    def _open_ids(self, status: RobotStatus, full: bool) -> tuple[set[int] | None, RobotError | None]:
        """Items of its queue, if that is read now; or why it can't be, though the robot answers: the app's items are
        still asked for by number."""
        looks = full or self._watched or self._is_sought or self._duplicates.is_watching or self.seen.answers_in_part
        try:
            return self._read_queue(status, full) if looks else None, None
        except NO_LIST as problem:
            return None, problem

    def _follow_switched_off(self) -> None:
        """Without a password nothing can be asked: running missions stay unchanged until it is entered."""
        if self.robot.needs_password:
            return
        self._duplicates.own.answer()
        try:
            self._tracking.follow(None)
            if self._duplicates.is_watching:  # what comes now is not wanted
                self._duplicates.remove_duplicates(self._client.open_items())
        except RobotError as error:
            if not self._unanswered:
                log.info("What runs on %r, which is switched off, could not be read: %s", self.robot.name, error.text)
            self._unanswered += 1
        else:
            self._unanswered = 0

    def _prefetch(self) -> None:
        self._prefetch_at = math.inf
        if not self.robot.enabled:
            return
        with contextlib.suppress(RobotError):  # asked again at the instant itself, and only that counts
            if self.seen.age > STATUS_IS_FRESH / 2:
                self.seen.read_status()
            if self.seen.highest is None:  # its queue could not be read yet
                self.seen.read_highest()
            for guid, mission, entered in self._s.schedules.with_parameters(
                self._s.db.read(), self.robot.id, self._clock.now() + SOON
            ):
                if self._s.parameters.to_send(self.robot.id, guid, mission, entered) is None:
                    self._s.parameters.ask_for_start(self.robot.id, guid, self._client)

    def _staggered(self, pause: float) -> float:
        """About ``pause``, different for each robot, so that robots polled at one moment are not always read at one
        moment, which would delay starts due then. Exactly ``pause`` for the one on screen."""
        return pause if self._watched else pause * (0.5 + phase_of(self.robot.id))

    def _read_queue(self, status: RobotStatus, full: bool) -> set[int]:
        items = tuple(sorted(self._client.open_items(), key=lambda item: (item.is_pending, item.id)))
        self._sending.send_due()
        if full:
            self.seen.read_highest()
            if not self._client.capabilities.own_queue and self.robot.idle is not None:
                self.seen.newest = self._newest()
            self._sending.send_due()
        longest_gap = STALE_POLLS * self._s.settings().poll_interval_seconds
        if self.seen.was_lost:
            self._idle.not_seen()
            self.seen.was_lost = False
        self._idle.saw(is_idle(status, bool(items)), self.seen.last_use, self._clock.monotonic(), longest_gap)
        self._s.snapshots.update(self.robot.id, queue=items, queue_read_at=self._clock.now())
        self._duplicates.remove_duplicates(items)
        return {item.id for item in items}

    # ------------------------------------------------------------------ idle automation
    def _start_idle_mission(self) -> None:
        rule, db = self.robot.idle, self._s.db.read()
        if rule is None or self.robot.needs_check_up:
            return
        last = self._s.robots.idle_queue_id(db, self.robot.id)
        if (
            not self._idle_mission_is_due(last, self._idle.seconds(self._clock.monotonic()))
            or any(row.trigger is Trigger.IDLE for row in self._s.ledger.open_for(self.robot.id))
            or self._queue_was_reset(last)
        ):
            return
        try:
            if (copy := self._duplicates.own.newest_of_idle_mission(last, self.seen.last_use)) is not None:
                self._s.ledger.note_last_use(self.robot.id, copy)
                return
        except RobotError:
            return
        if (mission := self._s.missions.get(db, rule.mission_id)) and self._s.holds.active(self.robot.id) is None:
            settings, now, token = self._s.settings(), self._clock.now(), str(uuid.uuid4())
            row = rules.one_off(Trigger.IDLE, self.robot, mission, settings, now, token, queue_floor=self.seen.highest)
            self._s.ledger.add_idle(row, self.robot, self.seen.last_use)
            self._ledger_changed = True

    def _queue_was_reset(self, last_queue_id: int | None) -> bool:
        """Whether the robot's numbers seem to have begun again, though its last idle mission still exists or can't be
        read: a list that ends too early gives too low a number. A fleet's does not have to end with this robot's newest."""
        highest, own_queue = self.seen.highest, self._client.capabilities.own_queue
        if not own_queue or last_queue_id is None or highest is None or highest >= last_queue_id:
            return False
        try:
            self._client.queue_item(last_queue_id)
        except Rejected:
            return False
        except RobotError:
            pass
        return True

    def _is_kept_free(self) -> bool:
        """Of a group with k starts planned in the next minutes, the k free robots with the fullest batteries stay where they are."""
        soon = self._clock.now() + KEEP_FREE_BEFORE_PLANNED
        for members, starts in self._s.schedules.next_of_groups(self._s.db.read(), self.robot.id, soon).items():
            free = []
            for snapshot in map(self._s.snapshots.get, members):
                status, robot_id = snapshot.status, snapshot.robot_id
                if status is not None and is_idle(status, bool(snapshot.queue)) and not self._s.holds.active(robot_id):
                    free.append((-(status.battery_percentage or 0.0), robot_id))
            if self.robot.id in [robot_id for _battery, robot_id in sorted(free)[:starts]]:
                return True
        return False

    def _is_still_idle(self, row: Execution) -> bool:
        """An idle mission is checked again before it is sent: nothing else may have run. Raises RobotError."""
        self.seen.read_highest()
        is_wanted = self._s.ledger.wanted(row).why is None
        is_unused = self.seen.highest == row.queue_floor
        if not self._client.capabilities.own_queue:
            self.seen.newest = self._newest()
            is_unused = self.seen.newest == self._s.robots.idle_queue_id(self._s.db.read(), self.robot.id)
        return is_wanted and is_unused and self._idle_mission_is_due(None, math.inf)

    def _newest(self) -> int:
        """The newest order of a fleet's robot. While it is not known, the robot counts as not used since its last idle
        mission."""
        db = self._s.db.read()
        last = self._s.robots.last_accepted(db, self.robot.id)
        newest = self._client.newest_id(last.token if last else "")
        return newest if newest is not None else self._s.robots.idle_queue_id(db, self.robot.id) or 0

    def _idle_mission_is_due(self, last_queue_id: int | None, idle_seconds: float) -> bool:
        """``last_queue_id``: of the last idle mission; ids above it have ended its idle period."""
        status, last_use = self._s.snapshots.get(self.robot.id).status, self.seen.last_use
        if status is None or last_use is None or self._s.holds.active(self.robot.id):
            return False
        db, rule, settings = self._s.db.read(), self.robot.idle, self._s.settings()
        mission = self._s.missions.get(db, rule.mission_id) if rule is not None else None
        next_at, minimum = (
            self._s.schedules.next_to_run(db, self.robot.id),
            rules.minimum_battery(None, mission, settings),
        )
        situation = IdleSituation(idle_seconds, status, last_use, last_queue_id, next_at, minimum)
        is_due = idle_mission_is_due(rule, situation, settings, self._s.calendar(), self._clock.now())
        return is_due and not self._is_kept_free()
