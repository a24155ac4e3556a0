"""The threads: one for the engine, one for each robot's worker. They only wait, and hand on what was posted."""

from __future__ import annotations

import contextlib
import logging
import math
import sqlite3
import threading
from collections.abc import Callable

from app.database.connection import Database, DatabaseDamaged, DatabaseError
from app.domain.clock import Clock
from app.services.dispatch import messages
from app.services.dispatch.engine import Engine
from app.services.dispatch.timing import AFTER_A_FAILURE, LONGEST_WAIT, STOP_WITHIN
from app.services.dispatch.worker import RobotWorker
from app.services.live.alarms import Alarms

log = logging.getLogger(__name__)

SCHEDULER = "scheduler"  # name of the engine's thread


class _WorkerThread:
    """``before``: the thread of the robot's former worker, which may wait for an answer and then still send or give
    back its starts."""

    def __init__(
        self,
        worker: RobotWorker,
        works: Callable[[str], None],
        failed: Callable[[Exception, str], None],
        before: threading.Thread | None,
    ) -> None:
        self.worker, self._works, self._failed, self._before = worker, works, failed, before
        self.wake = threading.Condition()  # has the lock of the inbox
        self.inbox: list[messages.Message] = []
        self._is_stopping = False
        self.thread = threading.Thread(target=self._run, name=f"worker-{worker.robot.name}", daemon=True)
        self.thread.start()

    def stop(self) -> None:
        with self.wake:
            self._is_stopping = True
            self.wake.notify()

    def _run(self) -> None:
        if self._before is not None:
            self._before.join()
            self._before = None
        while True:
            with self.wake:
                if self._is_stopping:
                    break
                inbox, self.inbox = self.inbox, []
            try:
                for message in inbox:
                    self.worker.handle(message)
                wait = self.worker.advance()
                self._works(self.thread.name)
            except (
                Exception
            ) as error:  # of the database: no durable intent, no POST; with one robot: it affects no other
                if not self._is_stopping:
                    self._failed(error, self.thread.name)
                self.worker.handle(self.worker.expect_recovery())  # the next round finds unfinished work in the ledger
                wait = AFTER_A_FAILURE
            with self.wake:
                if not (self._is_stopping or self.inbox):
                    self.wake.wait(None if math.isinf(wait) else wait)
        untaken = [message.intent for message in self.inbox if isinstance(message, messages.Start)]
        with contextlib.suppress(
            DatabaseError, sqlite3.Error
        ):  # a request outlived the stop: a minute of observed time is lost
            self.worker.close(untaken)


class Runner:
    """Gives the engine and its workers their threads. ``damage`` is set when the database is found damaged: then
    nothing is sent, and ``on_damage`` is called on some thread."""

    def __init__(self, db: Database, engine: Engine, clock: Clock, alarms: Alarms) -> None:
        self._db, self._engine, self._clock, self._alarms = db, engine, clock, alarms
        self._threads: dict[int, _WorkerThread] = {}
        self._closing: dict[int, threading.Thread] = {}  # of robots whose worker is not needed any more
        self._failing: set[str] = set()  # names of threads whose last round met an unexpected error
        self._lock = threading.Lock()
        self._wake = threading.Condition()
        self._is_woken = self._is_stopping = False
        self._thread: threading.Thread | None = None
        self.rounds = 0  # of the engine that have ended, well or not
        self.damage: DatabaseDamaged | None = None
        self.on_damage: Callable[[DatabaseDamaged], None] = lambda damage: None
        engine.attach(self, self.wake)

    def start(self) -> None:
        self._engine.start()
        self._thread = threading.Thread(target=self._run, name=SCHEDULER, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop all threads; a request under way is abandoned to its time-out, its execution is looked for at the next start."""
        with self._wake:
            self._is_stopping = True
            self._wake.notify()
        deadline = self._clock.monotonic() + STOP_WITHIN
        with self._lock:
            workers = list(self._threads.values())
        for worker in workers:
            worker.stop()
        for thread in [self._thread, *(worker.thread for worker in workers)]:
            if thread:
                thread.join(max(0.0, deadline - self._clock.monotonic()))

    def wake(self) -> None:
        with self._wake:
            self._is_woken = True
            self._wake.notify()

    # ------------------------------------------------------------------ mailboxes
    def open(self, worker: RobotWorker) -> None:
        with self._lock:
            before = self._closing.pop(worker.robot.id, None)
            self._threads[worker.robot.id] = _WorkerThread(worker, self._works, self._failed, before)

    def close(self, robot_id: int) -> None:
        with self._lock:
            closed = self._threads.pop(robot_id)
            self._closing = {key: thread for key, thread in self._closing.items() if thread.is_alive()} | {
                robot_id: closed.thread
            }
        closed.stop()

    def post(self, robot_id: int, message: messages.Message) -> None:
        with self._lock:
            worker = self._threads.get(robot_id)
        if worker and not (isinstance(message, messages.LedgerChanged) and threading.current_thread() is worker.thread):
            with worker.wake:
                worker.inbox.append(message)
                worker.wake.notify()

    # ------------------------------------------------------------------ the scheduler's thread
    def _run(self) -> None:
        while not self._is_stopping:
            try:
                wait = self._engine.advance()
                self._works(SCHEDULER)
            except Exception as error:  # the scheduler must not stop for anything
                self._failed(error, SCHEDULER)
                wait = LONGEST_WAIT
            self.rounds += 1
            with self._wake:
                if not (self._is_woken or self._is_stopping):
                    self._wake.wait(wait)
                self._is_woken = False
        with contextlib.suppress(DatabaseError, sqlite3.Error):
            self._engine.stop()

    def _works(self, thread: str) -> None:
        if thread in self._failing:
            self._alarms.clear("chore_failed", f"thread:{thread}")
            self._failing.discard(thread)

    def _failed(self, error: Exception, thread: str) -> None:
        if self._is_stopping:  # the round outlived the stop: what it wanted is closed
            return
        known = self._db.known(error)
        if isinstance(known, DatabaseError):
            self._alarms.database_fails(known.message)
            if isinstance(known, DatabaseDamaged):
                self._end_for(known)
            return
        log.exception("The thread %s met an unexpected error and goes on", thread)
        if thread not in self._failing:
            with contextlib.suppress(DatabaseError, sqlite3.Error):  # the next round says it
                self._alarms.raise_(
                    "chore_failed", f"thread:{thread}", problem=f"{thread}: {type(error).__name__}: {error}"
                )
                self._failing.add(thread)

    def _end_for(self, damage: DatabaseDamaged) -> None:
        """Nothing is sent any more, nor tried."""
        with self._lock:
            is_first, self.damage = self.damage is None, damage
            workers = list(self._threads.values())
        self._is_stopping = True
        for worker in workers:
            worker.stop()
        if is_first:
            self.on_damage(damage)
