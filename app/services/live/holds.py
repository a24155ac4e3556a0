"""Holds: nothing is sent to any robot, or to one. Set by the operator, because of the clock, or while a queue is cleared."""

from __future__ import annotations

import logging
import sqlite3
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime

from app.database.connection import Database
from app.database.robots import Hold, HoldRepository, RobotRepository
from app.domain.activity import CLOCK_STEP_S
from app.domain.clock import Clock
from app.domain.execution import Execution
from app.domain.message import Message, render
from app.domain.models import InvalidInput, existing
from app.services.live.changes import CachedUntilChanged, Changes, Topic

LONGEST_REASON = 200  # characters

log = logging.getLogger(__name__)


class Holds:
    """Stored holds survive a restart; the clock's hold is this run's own. Read by every robot worker at every try, so kept in memory."""

    def __init__(self, db: Database, clock: Clock, changes: Changes) -> None:
        self._db, self._repository, self._clock, self._changes = db, HoldRepository(), clock, changes
        self._lock = threading.Lock()
        # Why the clock is not plausible, or is still being checked; None: it is trusted.
        self.clock_problem: Message | None = None
        self._is_clock_confirmed = False
        self.is_copy: Message | None = None  # why nothing may be sent from this tablet
        self._wall_ahead: float | None = None  # of the monotonic clock, in s, when the wall clock was judged last
        # A robot's hold goes with the robot, and comes back with it.
        self._stored = CachedUntilChanged(lambda: self._repository.all(db.read()), changes, Topic.HOLDS, Topic.ROBOTS)

    def check_is_no_copy(self) -> None:
        """Raises InvalidInput where the data is a copy."""
        if self.is_copy is not None:
            raise InvalidInput("robot", "this data is a copy: nothing is sent from here before it moves here")

    def active(self, robot_id: int | None = None) -> Hold | None:
        """The hold that applies to this robot now (None: the one of all robots)."""
        return next((hold for hold in self.all_active() if hold.robot_id in (None, robot_id)), None)

    def all_active(self) -> list[Hold]:
        """The tablet's own, if any, and those set by an operator."""
        return [*filter(None, [self._tablet_hold()]), *self.current()]

    def _tablet_hold(self) -> Hold | None:
        copy, problem, checked = self.is_copy, self.clock_problem, self._wall_ahead
        if copy is not None:
            return Hold(render(copy), is_copy=True)
        if problem is not None:
            return Hold(render(problem), clock=True)
        ahead = self._clock.now().timestamp() - self._clock.monotonic()
        # else the clock has moved, or the tablet slept, and that has not been judged yet
        return None if checked is None or abs(ahead - checked) <= CLOCK_STEP_S else Hold(clock=True)

    def current(self) -> list[Hold]:
        """Those that an operator set and that have not expired, oldest first."""
        now = self._clock.now()
        return [hold for hold in self._stored() if not hold.is_over(now)]

    def hold(
        self,
        reason: str = "",
        until: datetime | None = None,
        robot_id: int | None = None,
        *,
        also: Callable[[sqlite3.Connection, Hold], object] = lambda c, hold: None,
    ) -> Hold:
        """Replace the hold of all robots, or of one; ``also`` is done in the same transaction. Raises InvalidInput for an end that has
        passed, a reason too long and a robot that was removed."""
        now = self._clock.now()
        if until is not None and until <= now:
            raise InvalidInput("until", "choose a time in the future")
        reason = " ".join(reason.split())
        if len(reason) > LONGEST_REASON:
            raise InvalidInput(
                "reason",
                "a reason has at most {most} characters, this one has {length}",
                most=LONGEST_REASON,
                length=len(reason),
            )

        def put(c: sqlite3.Connection, before: Sequence[Hold]) -> Sequence[Hold]:
            if robot_id is not None:
                existing(RobotRepository().get(c, robot_id), "robot", "this robot no longer exists")
            self._repository.remove(c, robot_id)
            hold = self._repository.add(c, Hold(reason, until, now, robot_id=robot_id))
            also(c, hold)
            return [hold]

        [hold] = self._change(robot_id, put)
        return hold

    def release(
        self,
        robot_id: int | None = None,
        only: int | None = None,
        *,
        also: Callable[[sqlite3.Connection], object] = lambda c: None,
    ) -> None:
        """Of all robots, or of one; ``only`` a hold with this id, as another may have replaced it since. ``also`` is
        done in any case, in the same transaction."""

        def remove(c: sqlite3.Connection, before: Sequence[Hold]) -> Sequence[Hold]:
            also(c)
            if only is not None and only not in [hold.id for hold in before]:
                return before
            self._repository.remove(c, robot_id)
            return []

        self._change(robot_id, remove)

    def _change(
        self,
        robot_id: int | None,
        change: Callable[[sqlite3.Connection, Sequence[Hold]], Sequence[Hold]],
    ) -> Sequence[Hold]:
        """``change`` the hold of all robots, or of one: from the stored to the returned one."""

        def work(c: sqlite3.Connection) -> tuple[str, str, Sequence[Hold]]:
            robot = None if robot_id is None else RobotRepository().get(c, robot_id)
            before = [hold for hold in self._repository.all(c) if hold.robot_id == robot_id]
            return f"robot {robot.name!r}" if robot else "all robots", _in_words(before), change(c, before)

        held, before, stored = self._db.write(work)
        if before != (now := _in_words(stored)):
            log.info("hold of %s: %s → %s", held, before, now)
        self.announce()
        return stored

    def doubt_clock(self, problem: Message | None) -> None:
        """Nothing is sent while the clock is not plausible; None: it is again."""
        if problem != self.clock_problem:
            self.clock_problem = problem
            self.announce()

    def clock_checked(self, now: datetime, mono: float) -> None:
        """At that time, wall and monotonic."""
        self._wall_ahead = now.timestamp() - mono

    def confirm_clock(self) -> None:
        """A person says that the tablet's clock is right, even if robots differ."""
        with self._lock:
            self.clock_problem, self._is_clock_confirmed = None, True
        self.announce()

    def take_clock_confirmation(self) -> bool:
        """Whether a person has said so since this was asked last."""
        with self._lock:
            confirmed, self._is_clock_confirmed = self._is_clock_confirmed, False
        return confirmed

    def announce(self) -> None:
        """Somebody changed what holds."""
        self._changes.publish(Topic.HOLDS)


class Clearing:
    """Until the robot has answered, nothing is sent to it, its starts go to no other robot, and the outcome of its
    items is not decided. Read by every worker at every try."""

    def __init__(self, changes: Changes) -> None:
        self._changes, self._lock = changes, threading.Lock()
        self._now: tuple[tuple[int, set[int]], ...] = ()  # robots, and ids of the executions that are cleared

    @contextmanager
    def of(self, robot_id: int) -> Iterator[set[int]]:
        """Its queue is being cleared as long as this is open, with the executions whose ids are put into the set."""
        cleared = robot_id, set[int]()
        with self._lock:
            self._now = (*self._now, cleared)
        try:
            yield cleared[1]
        finally:
            with self._lock:
                self._now = tuple(each for each in self._now if each is not cleared)
            self._changes.publish(Topic.EXECUTIONS)  # blocked starts continue

    def is_of(self, robot_id: int) -> bool:
        return any(cleared == robot_id for cleared, _rows in self._now)

    def blocks(self, row: Execution) -> bool:
        return any(row.robot_id == robot_id or row.id in rows for robot_id, rows in self._now)


def _in_words(holds: Sequence[Hold]) -> str:
    return (
        "".join(
            f"until {hold.until.isoformat(timespec='minutes') if hold.until else 'it is released'}"
            f"{f', {hold.reason!r}' if hold.reason else ''}"
            for hold in holds
        )
        or "none"
    )
