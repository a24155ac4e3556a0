"""The threads: one for the scheduler, one worker for each robot. They only wait and call; the work is done in scheduler and worker.

With a window, Kivy's Clock asks for a cycle every poll interval; headless, or when the window has not asked for
two intervals, the scheduler thread does.
"""
from __future__ import annotations

import contextlib
import logging
import math
import threading
from collections.abc import Callable

from app.database.connection import Database, DatabaseUnavailable
from app.domain.clock import Clock
from app.domain.message import Message
from app.domain.models import Execution, Robot
from app.services.dispatch.dispatcher import Ready
from app.services.dispatch.scheduler import LONGEST_WAIT, Scheduler
from app.services.dispatch.worker import RobotWorker
from app.services.live.alarms import Alarms
from app.services.live.changes import Changes, Topic

log = logging.getLogger(__name__)

STOP_WITHIN = 4.0           # s: a stop has to end within 5 s; a request under way is left to its time-out
FIRST_POLL_WITHIN = 5.0     # s until "ready" whatever the robots do
CYCLE_TAKES = 2.0           # s within which every robot has its turn
TURN_EVERY = 0.08           # s between turns
POLLED_AT_ONCE = 2          # robots in a turn at least
CHORES_EVERY = 0.1          # s at least between chores
AFTER_A_CRASH = 5.0         # s before a worker that met an unexpected error goes on


class _WorkerThread:
    """One robot's worker on its thread."""

    def __init__(self, worker: RobotWorker, database_fails: Callable[[Message], None]) -> None:
        self.worker, self._database_fails = worker, database_fails
        self._wake = threading.Condition()
        self._poll_wanted = self._due_soon = self._changed = self._something_new = self._stopping = False
        self._intents: list[Execution] = []
        self._thread = threading.Thread(target=self._run, name=f"worker-{worker.robot.name}", daemon=True)
        self._thread.start()

    def kick(self, poll: bool = False, due_soon: bool = False) -> None:
        """A cycle is wanted, or something is due in a moment, or, without either, something in the ledger is new. A cycle still running
        is not started twice."""
        with self._wake:
            self._poll_wanted |= poll
            self._due_soon |= due_soon
            self._changed |= not (poll or due_soon)
            self._something_new = True
            self._wake.notify()

    def hand_over(self, intent: Execution) -> None:
        """An intent to be sent at its instant, before anything else."""
        with self._wake:
            self._intents.append(intent)
            self._something_new = True
            self._wake.notify()

    @property
    def is_current(self) -> bool:
        return threading.current_thread() is self._thread

    def stop(self) -> None:
        with self._wake:
            self._stopping = True
            self._wake.notify()

    def join(self, timeout: float) -> None:
        self._thread.join(timeout)

    def _run(self) -> None:
        while True:
            with self._wake:
                if self._stopping:
                    break
                poll, due_soon, changed = self._poll_wanted, self._due_soon, self._changed
                intents, self._intents = self._intents, []
                self._poll_wanted = self._due_soon = self._changed = self._something_new = False
            try:
                wait = self.worker.step(poll, due_soon, intents, changed)
            except DatabaseUnavailable as error:      # no durable intent, no POST
                if not self._stopping:
                    self._database_fails(error.message)
                wait = self._start_over()
            except Exception:                # an error with one robot must not end its worker, nor affect others
                log.exception("The worker of %r met an unexpected error and goes on", self.worker.robot.name)
                wait = self._start_over()
            with self._wake:
                if not (self._stopping or self._something_new):
                    self._wake.wait(None if math.isinf(wait) else wait)
        with contextlib.suppress(DatabaseUnavailable):        # a request outlived the stop: at most a minute of observed time is lost
            self.worker.close(self._intents)

    def _start_over(self) -> float:
        """The next round finds in the ledger what this one left undone. Returns the seconds until then."""
        with self._wake:
            self._changed = True
        return AFTER_A_CRASH


class PollLoop:
    def __init__(self, db: Database, *, scheduler: Scheduler, clock: Clock, alarms: Alarms, changes: Changes,
                 robots: Callable[[], list[Robot]], make_worker: Callable[[Robot], RobotWorker],
                 poll_interval: Callable[[], float]) -> None:
        self._db, self._scheduler, self._clock, self._alarms = db, scheduler, clock, alarms
        self._robots, self._make_worker, self._poll_interval = robots, make_worker, poll_interval
        self._workers: dict[int, _WorkerThread] = {}
        self._watched: int | None = None
        self._lock = threading.Lock()
        self._wake = threading.Condition()
        self._woken = self._stopping = self._in_tick = False
        self._cycle_at = self._turn_at = -math.inf
        self._to_poll: list[int] = []             # robots of this cycle whose turn has not come yet
        self._in_turn = POLLED_AT_ONCE
        self._window_drives = False
        self._thread: threading.Thread | None = None
        self._chores: list[Callable[[], None]] = []
        self._chores_at = -math.inf
        self._robots_version = 1                  # counts changes of the robots
        self._matched_version = 0                 # of the robots that have their workers
        self._unsubscribe = changes.subscribe(self._on_change)

    # ------------------------------------------------------------------ life
    def add_chore(self, chore: Callable[[], None]) -> None:
        """Something small to do every second or when something falls due, not more often than ten times a second (the inbox of one-shot
        commands)."""
        self._chores.append(chore)

    def start(self) -> None:
        self._scheduler.start()
        self._thread = threading.Thread(target=self._run, name="scheduler", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop all threads; a request under way is abandoned to its time-out, its execution is looked for at the next start."""
        self._unsubscribe()
        with self._wake:
            self._stopping = True
            self._wake.notify()
        deadline = self._clock.monotonic() + STOP_WITHIN
        with self._lock:
            workers = list(self._workers.values())
        for worker in workers:
            worker.stop()
        for thread in [self._thread, *workers]:
            if thread:
                thread.join(max(0.0, deadline - self._clock.monotonic()))

    @property
    def is_ready(self) -> bool:
        """Whether every robot has answered (or failed to answer) its first poll."""
        with self._lock:
            return self._matched_version == self._robots_version and all(thread.worker.polled for thread in self._workers.values())

    def clock_offsets(self) -> list[float | None]:
        with self._lock:
            return [thread.worker.clock_offset for thread in self._workers.values()]

    # ------------------------------------------------------------------ asked by others
    def request_cycle(self, by_window: bool = False) -> None:
        """Poll every robot now, in parallel; many in short turns, so that neither the window nor what falls due has to wait."""
        self._window_drives |= by_window
        self._cycle_at = self._clock.monotonic()
        with self._lock:
            self._to_poll += self._workers.keys() - set(self._to_poll)
            self._in_turn = max(POLLED_AT_ONCE, math.ceil(len(self._to_poll) * TURN_EVERY / CYCLE_TAKES))
        self._poll_some()
        if self._to_poll:
            self.wake()

    def _poll_some(self) -> None:
        self._turn_at = self._clock.monotonic() + TURN_EVERY
        with self._lock:
            turn, self._to_poll = self._to_poll[:self._in_turn], self._to_poll[self._in_turn:]
            threads = [self._workers[key] for key in turn if key in self._workers]
        for thread in threads:
            thread.kick(poll=True)

    def kick(self, robot_id: int, poll: bool = False, due_soon: bool = False) -> None:
        """Something is new for this robot (a manual run, a cancellation), or will be soon."""
        with self._lock:
            thread = self._workers.get(robot_id)
        if thread:
            thread.kick(poll, due_soon)

    def ready(self, robot_id: int) -> Ready | None:
        """See ``RobotWorker.ready``; None for a robot without a worker."""
        with self._lock:
            thread = self._workers.get(robot_id)
        return thread.worker.ready() if thread else None

    def hand_over(self, intent: Execution) -> None:
        """Its intent was written when it fell due. One whose worker is gone meanwhile is looked for on the robot, as after a crash."""
        with self._lock:
            thread = self._workers.get(intent.robot_id or 0)
        if thread:
            thread.hand_over(intent)

    def watch(self, robot_id: int | None) -> None:
        """The robot on screen has its status read every 2 s."""
        with self._lock:
            self._watched = robot_id
            for key, thread in self._workers.items():
                thread.worker.watched = key == robot_id
                if key == robot_id:
                    thread.kick()

    def wake(self) -> None:
        """The plan changed: tick now."""
        with self._wake:
            self._woken = True
            self._wake.notify()

    def _on_change(self, topic: Topic, about: int | None) -> None:
        if topic in (Topic.EXECUTIONS, Topic.SCHEDULES) and self._in_tick and threading.current_thread() is self._thread:
            return                            # the tick itself returns what is to be sent, and reads the plan after it
        if topic is Topic.ROBOTS:
            self._robots_version += 1
        if topic in (Topic.ROBOTS, Topic.SCHEDULES, Topic.SETTINGS):
            self.wake()
        if topic in (Topic.EXECUTIONS, Topic.HOLDS, Topic.SCHEDULES, Topic.ROBOTS):
            with self._lock:
                threads = list(self._workers.values()) if about is None else [self._workers[about]] if about in self._workers else []
            for thread in threads:
                if not thread.is_current:     # a worker knows what it has just done itself
                    thread.kick()

    # ------------------------------------------------------------------ the scheduler thread
    def _run(self) -> None:
        first_look = self._clock.monotonic()
        while not self._stopping:
            try:
                self._round(first_look)
                wait = self._scheduler.seconds_to_next(longest=TURN_EVERY if self._to_poll else LONGEST_WAIT)
            except DatabaseUnavailable as error:
                self._alarms.database_fails(error.message)
                wait = LONGEST_WAIT
            except Exception:                # the scheduler must not stop for anything
                log.exception("The scheduler met an unexpected error and goes on")
                wait = LONGEST_WAIT
            with self._wake:
                if not (self._woken or self._stopping):
                    self._wake.wait(wait)
                self._woken = False
        with contextlib.suppress(DatabaseUnavailable):
            self._scheduler.stop()

    def _round(self, first_look: float) -> None:
        if self._matched_version != self._robots_version:
            self._match_workers()
        if not self.is_ready and self._clock.monotonic() - first_look < FIRST_POLL_WITHIN:
            self._quickly()
            return
        database_failed = self._alarms.is_database_failing
        if database_failed:
            self._scheduler.probe()          # raises as long as it does
        self._in_tick = True
        try:
            batch = self._scheduler.tick()
        finally:
            self._in_tick = False
        for robot_id in batch.robot_ids:
            self.kick(robot_id)
        for robot_id in self._scheduler.due_soon():
            self.kick(robot_id, due_soon=True)
        self._scheduler.tidy()
        if database_failed:
            self._alarms.database_works()
        if self._clock.monotonic() - self._chores_at >= CHORES_EVERY:
            self._chores_at = self._clock.monotonic()
            for chore in self._chores:
                chore()
        due = self._poll_interval() * (2 if self._window_drives else 1)
        if self._clock.monotonic() - self._cycle_at >= due:
            self.request_cycle()
        elif self._to_poll and self._clock.monotonic() >= self._turn_at:
            self._poll_some()

    def _quickly(self) -> None:
        """Not every robot has answered yet: check again soon."""
        with self._wake:
            self._wake.wait(0.02)
            self._woken = True

    def _match_workers(self) -> None:
        """One worker for each robot as it is configured now."""
        version = self._robots_version            # another change meanwhile asks for another round
        wanted = {robot.id: robot for robot in self._robots()}
        with self._lock:
            for key in list(self._workers):
                if key not in wanted or _settings_of(self._workers[key].worker.robot) != _settings_of(wanted[key]):
                    self._workers.pop(key).stop()
            for key, robot in wanted.items():
                if key in self._workers:
                    self._workers[key].worker.robot = robot       # name, idle rule
                else:
                    worker = self._make_worker(robot)
                    worker.watched = key == self._watched
                    self._workers[key] = _WorkerThread(worker, self._alarms.database_fails)
            self._matched_version = version


def _settings_of(robot: Robot) -> tuple[object, ...]:
    """What a worker's connection is made of; when it changes, the worker is made anew."""
    return robot.address, robot.token, robot.certificate_sha256, robot.enabled
