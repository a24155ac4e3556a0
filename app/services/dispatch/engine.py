"""What happens once a second, or when something falls due: due starts, turns of polls, housekeeping, chores.

No thread of its own and no request to a robot: the runner calls ``advance`` on the scheduler's thread, the simulation
calls it directly, and ``Mailboxes`` bring what it says to the robots' workers. With a window, Kivy's Clock requests a
cycle every poll interval; headless, or if the window has missed two intervals, the engine does so itself.
"""

from __future__ import annotations

import logging
import math
import sqlite3
import threading
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Protocol

from app.database.connection import DatabaseError
from app.domain.clock import Clock
from app.domain.message import message_of
from app.domain.models import Robot
from app.services.dispatch import messages
from app.services.dispatch.allocator import Allocator
from app.services.dispatch.chores import Chores
from app.services.dispatch.clock_guard import ClockGuard, Judgement, Readings
from app.services.dispatch.ledger import Ledger
from app.services.dispatch.planner import Planner
from app.services.dispatch.restored_starts import RestoredStarts
from app.services.dispatch.timing import (
    AFTER_A_FAILURE,
    CYCLE_TAKES,
    DECIDES_AGAIN,
    DECIDES_EVERY,
    DOUBT_POLLS_EVERY,
    FIRST_POLL_WITHIN,
    INTENT_EVERY,
    INTENT_LEAD,
    LONGEST_WAIT,
    MIN_IDLE,
    PREFETCH_LEAD,
    PREFETCH_TOGETHER,
    PRUNE_EVERY,
    TIDIES_WITHIN,
    TIDY_EVERY,
    TURN_EVERY,
)
from app.services.dispatch.worker import RobotWorker
from app.services.live.alarms import Alarms
from app.services.live.changes import NO_ROBOT, Changes, Topic

log = logging.getLogger(__name__)

POLLED_AT_ONCE = 2  # robots in a turn at least
# Changes of them may change or withdraw what is about to be sent, and the choice of a robot.
_REDEFINING = (Topic.HOLDS, Topic.SCHEDULES, Topic.ROBOTS, Topic.MISSIONS, Topic.SETTINGS)


class Mailboxes(Protocol):
    """How workers are reached. What is posted to one arrives in that order."""

    def open(self, worker: RobotWorker) -> None: ...

    def close(self, robot_id: int) -> None:
        """Its worker is not needed any more; it releases what it holds."""

    def post(self, robot_id: int, message: messages.Message) -> None:
        """A worker gets no message about a change of the ledger that it has just made itself."""


class Engine:
    def __init__(
        self,
        *,
        planner: Planner,
        guard: ClockGuard,
        ledger: Ledger,
        clock: Clock,
        alarms: Alarms,
        changes: Changes,
        robots: Callable[[], list[Robot]],
        make_worker: Callable[[Robot], RobotWorker],
        poll_interval: Callable[[], float],
        probe: Callable[[], object],
        restored_starts: RestoredStarts,
        allocator: Allocator,
    ) -> None:
        self._planner, self._guard, self._ledger, self._clock = planner, guard, ledger, clock
        self._alarms, self._robots, self._make_worker = alarms, robots, make_worker
        self._restored_starts, self._allocator = restored_starts, allocator
        allocator.post = lambda robot_id, start: self._mailboxes.post(robot_id, start)
        self._poll_interval = poll_interval
        self._probe = probe  # writes something; raises while nothing can be written
        self._mailboxes: Mailboxes
        self._wake: Callable[[], None] = lambda: None
        self._workers: dict[int, RobotWorker] = {}
        self._watched: int | None = None
        self._allocate_at = self._allocated_at = -math.inf
        self._allocating: int | None = None  # the thread that gives starts to robots
        self._sought: frozenset[int] = frozenset()  # robots that a start waits for
        self._lock = threading.Lock()  # for other threads: workers, and the robots whose turn it is
        self._inserting: int | None = None  # the thread that is writing due starts
        self.plan_version = 1  # counts changes that may withdraw a start
        self._was_trusted = self._may_send = False  # the clock: ever, and now
        self._robots_version = 1  # counts changes of the robots
        self._matched_version = 0  # of the robots that have their workers
        self._match_again_at = math.inf  # a worker could not be made
        self._first_at = clock.monotonic()
        self._cycle_at = self._turn_at = -math.inf
        self._to_poll: list[int] = []  # robots of this cycle whose turn has not come yet
        self._in_turn = POLLED_AT_ONCE
        self._window_drives = False
        self._announced_until = datetime.min.replace(tzinfo=UTC)  # of what is due soon
        self._chores = Chores(clock, alarms)
        self._pruned_at = self._looked_at = self._tidied_at = -math.inf
        self._unsubscribe = changes.subscribe(self._on_change)

    # ------------------------------------------------------------------ life
    def attach(self, mailboxes: Mailboxes, wake: Callable[[], None]) -> None:
        """``wake``: asks for ``advance`` now."""
        self._mailboxes, self._wake = mailboxes, wake

    def add_chore(self, name: str, chore: Callable[[], None]) -> None:
        """Something small to do every second or when something falls due, not more often than ten times a second."""
        self._chores.add(name, chore)

    def start(self) -> None:
        """Once, before the first ``advance``. Raises DatabaseUnavailable."""
        self._ledger.unassign()  # of a process that has ended: nothing was sent of these
        self._guard.start()

    def stop(self) -> None:
        self._unsubscribe()
        self._guard.stop()

    @property
    def is_ready(self) -> bool:
        """Whether every robot has answered (or failed to answer) its first poll."""
        with self._lock:
            return self._matched_version == self._robots_version and all(
                worker.polled for worker in self._workers.values()
            )

    @property
    def seconds_to_cycle(self) -> float:
        """Time until every robot is polled again, without other requests."""
        every = self._poll_interval() * (2 if self._window_drives else 1)
        pause = min(every, DOUBT_POLLS_EVERY) if self._guard.is_in_doubt else every
        return self._cycle_at + pause - self._clock.monotonic()

    @property
    def seconds_to_decision(self) -> float:
        """Time until the next choice of robots for waiting starts of groups; infinite: none waits, or nothing may be
        sent."""
        return max(0.0, self._allocate_at - self._clock.monotonic()) if self._may_send else math.inf

    # ------------------------------------------------------------------ asked by others, on any thread
    def request_cycle(self, by_window: bool = False) -> None:
        """Poll every robot now; many in short turns, so that neither the window nor due starts have to wait."""
        self._window_drives |= by_window
        self._cycle_at = self._clock.monotonic()
        with self._lock:
            self._to_poll += self._workers.keys() - set(self._to_poll)
            self._in_turn = max(POLLED_AT_ONCE, math.ceil(len(self._to_poll) * TURN_EVERY / CYCLE_TAKES))
        self._poll_some()
        if self._to_poll:
            self._wake()

    def poll(self, robot_id: int) -> None:
        """Something was done on this robot."""
        self._mailboxes.post(robot_id, messages.Poll())

    def watch(self, robot_id: int | None) -> None:
        """The robot on screen, whose status is read every 2 s; None: no robot."""
        with self._lock:
            before, self._watched = self._watched, robot_id
        if before is not None and before != robot_id:
            self._mailboxes.post(before, messages.OnScreen(False))
        if robot_id is not None:
            self._mailboxes.post(robot_id, messages.OnScreen(True))

    def _on_change(self, topic: Topic, about: int | None) -> None:
        if topic in (Topic.EXECUTIONS, Topic.SCHEDULES) and self._inserting == threading.get_ident():
            return  # the round itself knows what must be sent, and reads the plan after it
        if topic is Topic.ROBOTS:
            self._robots_version += 1
        if topic in _REDEFINING or (topic is Topic.EXECUTIONS and about is None):
            self.plan_version += 1
        if topic in (Topic.EXECUTIONS, Topic.HOLDS, Topic.SCHEDULES, Topic.ROBOTS):
            if about is None:
                self._post_to_all(messages.LedgerChanged())
            elif about != NO_ROBOT:
                self._mailboxes.post(about, messages.LedgerChanged())
        if self._allocating != threading.get_ident() and self._may_unblock_group_start(topic, about):
            self._allocate_soon()
        elif topic in (Topic.ROBOTS, Topic.SCHEDULES, Topic.SETTINGS, Topic.HOLDS):
            self._wake()

    def _may_unblock_group_start(self, topic: Topic, about: int | None) -> bool:
        """Whether a start of a group may find a robot because of this change."""
        if topic is Topic.EXECUTIONS and about in (None, NO_ROBOT):  # it may be new
            return True
        if topic is Topic.SNAPSHOT:
            worker = self._workers.get(about or 0)
            return about in self._sought and worker is not None and worker.seen.seems_free
        return bool(self._sought) and (topic in _REDEFINING or (topic is Topic.EXECUTIONS and about in self._sought))

    def _allocate_soon(self) -> None:
        """Called on any thread."""
        self._allocate_at = min(self._allocate_at, self._allocated_at + DECIDES_AGAIN)
        self._wake()

    def _post_to_all(self, message: messages.Message) -> None:
        with self._lock:
            robot_ids = list(self._workers)
        for robot_id in robot_ids:
            self._mailboxes.post(robot_id, message)

    # ------------------------------------------------------------------ a round
    def advance(self) -> float:
        """One round. Returns the seconds until the next one. Raises DatabaseError, after which the next round tries
        again."""
        mono = self._clock.monotonic()
        if self._matched_version != self._robots_version or mono >= self._match_again_at:
            self._match_workers()
        if not self.is_ready and mono - self._first_at < FIRST_POLL_WITHIN:
            return 0.02
        if self._alarms.is_database_failing:
            self._probe()  # raises as long as it does
            self._recover()
            if (alarm := self._alarms.database_works()) is not None:
                self._planner.note_unwritable(alarm)
        judgement = self._judge_clock()
        self._may_send = judgement.is_trusted
        if self._may_send:
            self._start_what_is_due()
            if self._clock.monotonic() >= self._allocate_at:
                self._allocate()
        self._chores.do()
        self._take_turns()
        if self._may_send:
            self._tidy()
        return min(self._seconds_to_next(TURN_EVERY if self._to_poll else LONGEST_WAIT), self.seconds_to_decision)

    def _recover(self) -> None:
        """What was written last while the database failed is not known: each worker looks for it before anything more is written for it."""
        with self._lock:
            workers = dict(self._workers)
        for robot_id, worker in workers.items():
            self._mailboxes.post(robot_id, worker.expect_recovery())

    def _judge_clock(self) -> Judgement:
        was_in_doubt = self._guard.is_in_doubt
        can_ask = any(worker.robot.enabled and worker.seen.gives_time for worker in self._workers.values())
        judgement = self._guard.judge(self._readings(), can_ask)
        if self._may_send and not judgement.is_trusted:
            self._allocator.wait_for_the_clock()
        if self._guard.is_in_doubt and not was_in_doubt:
            self.request_cycle(self._window_drives)  # the robots' clocks decide
            self._post_to_all(messages.ClockJumped())
        if judgement.absent_since is not None:
            self._planner.list_late_starts(judgement.absent_since)
            self._post_to_all(messages.ClockJumped())
        if judgement.went_back:
            self._planner.replan_after_clock_step(judgement.step, judgement.wrong)
        if judgement.is_trusted:
            self._planner.close_expired_run_nows()
            self._guard.acted()
            if was_in_doubt or not self._was_trusted:
                self._restored_starts.clock_is_right(self._guard.is_proven)
                self._was_trusted = True
        return judgement

    def _readings(self) -> Readings:
        with self._lock:
            return {key: worker.seen.clock for key, worker in self._workers.items() if worker.seen.clock is not None}

    def _start_what_is_due(self) -> None:
        self._inserting, version = threading.get_ident(), self.plan_version  # of before the intents are written
        try:
            batch = self._planner.insert_due(
                self._readiness,
                lambda row: self._mailboxes.post(row.robot_id or NO_ROBOT, messages.Start(row, version)),
            )
        finally:
            self._inserting = None
        if batch.has_unbound:
            self._allocate_soon()
        for robot_id in batch.robot_ids:
            self._mailboxes.post(robot_id, messages.LedgerChanged())
        for robot_id in self._due_soon():
            self._mailboxes.post(robot_id, messages.Prefetch())

    def _allocate(self) -> None:
        """Starts of groups to robots that are free; robots that one waits for are read often."""
        self._allocated_at = self._clock.monotonic()
        self._allocate_at = latest = self._allocated_at + DECIDES_EVERY  # also if this fails
        with self._lock:
            workers = dict(self._workers)
        self._allocating = threading.get_ident()
        try:
            wait = self._allocator.advance(workers)
        finally:
            self._allocating = None
        if self._allocate_at == latest:  # it was not asked for since
            self._allocate_at = self._allocated_at + wait
        before, self._sought = self._sought, self._allocator.members
        for robot_id in before ^ self._sought:
            self._mailboxes.post(robot_id, messages.NeededByGroup(robot_id in self._sought))

    def _readiness(self, robot_id: int) -> messages.Readiness | None:
        return worker.readiness() if (worker := self._workers.get(robot_id)) else None

    def _due_soon(self) -> set[int]:
        """Robots with something due in a moment, announced once for each instant."""
        now, announced = self._clock.now(), self._announced_until
        until = now + timedelta(seconds=PREFETCH_LEAD)
        if now <= announced <= until and (until - announced).total_seconds() < PREFETCH_TOGETHER:
            return set()
        self._announced_until = until
        return self._planner.robots_due(announced if now < announced < until else now, until)

    def _seconds_to_next(self, longest: float) -> float:
        due = self._planner.next_due()
        if due is None or self._guard.is_in_doubt:
            return longest
        left = (due - self._clock.now()).total_seconds()
        return min(max(left, 0.0), max(left - INTENT_LEAD, INTENT_EVERY), longest)

    # ------------------------------------------------------------------ robots and their turns
    def _match_workers(self) -> None:
        """One worker for each configured robot. One that can't be made is tried again, without delaying others."""
        version = self._robots_version  # another change since then needs another round
        self._match_again_at = math.inf
        wanted = {robot.id: robot for robot in self._robots()}
        for key in list(self._workers):
            if key not in wanted or _connection_of(self._workers[key].robot) != _connection_of(wanted[key]):
                with self._lock:
                    del self._workers[key]
                self._mailboxes.close(key)
        for key, robot in wanted.items():
            if key not in self._workers:
                self._open(robot)
            elif self._workers[key].robot != robot:
                self._mailboxes.post(key, messages.RobotEdited(robot))
        self._matched_version = version

    def _open(self, robot: Robot) -> None:
        try:
            worker = self._make_worker(robot)
        except (DatabaseError, sqlite3.Error):
            raise
        except Exception as error:
            log.exception("Robot %r can't be asked", robot.name)
            self._alarms.raise_about_robot("unreachable", robot, problem=message_of(error))
            self._match_again_at = self._clock.monotonic() + AFTER_A_FAILURE
            return
        with self._lock:
            self._workers[robot.id] = worker
        self._mailboxes.open(worker)
        if robot.id == self._watched:
            self._mailboxes.post(robot.id, messages.OnScreen(True))
        if robot.id in self._sought:
            self._mailboxes.post(robot.id, messages.NeededByGroup(True))

    def _take_turns(self) -> None:
        if self.seconds_to_cycle <= 0:
            self.request_cycle()
        elif self._to_poll and self._clock.monotonic() >= self._turn_at:
            self._poll_some()

    def _poll_some(self) -> None:
        self._turn_at = self._clock.monotonic() + TURN_EVERY
        with self._lock:
            turn, self._to_poll = self._to_poll[: self._in_turn], self._to_poll[self._in_turn :]
        for robot_id in turn:
            self._mailboxes.post(robot_id, messages.Poll())

    # ------------------------------------------------------------------ what can wait
    def _tidy(self) -> None:
        """Prune history and alarms to their limits, after due starts were sent. Waits while more starts are due, a
        minute at most."""
        mono = self._clock.monotonic()
        if mono - self._pruned_at >= PRUNE_EVERY:
            self._pruned_at = mono
            self._ledger.grew = True  # the limit may be lower now
            self._alarms.prune()
        if not self._ledger.grew or mono - self._looked_at < TIDY_EVERY:
            return
        self._looked_at = mono
        if self._has_time() or mono - self._tidied_at >= TIDIES_WITHIN:
            self._tidied_at = mono
            self._ledger.prune(self._has_time)

    def _has_time(self) -> bool:
        return self._seconds_to_next(LONGEST_WAIT) > MIN_IDLE


def _connection_of(robot: Robot) -> tuple[object, ...]:
    """The settings of a worker's connection; when they change, a new worker is made."""
    return robot.address, robot.token, robot.certificate_sha256, robot.fleet and robot.fleet.identity
