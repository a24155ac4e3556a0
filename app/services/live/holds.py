"""Holds: nothing is sent to any robot, or to one. Set by the operator, because of the clock, or while a queue is cleared."""

from __future__ import annotations

import logging
import sqlite3
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime

from app.database.connection import Database
from app.database.robots import HoldRepository, RobotRepository, StoredHold
from app.domain.activity import CLOCK_STEP_S
from app.domain.clock import Clock
from app.domain.message import Message, render
from app.domain.models import Execution, InvalidInput
from app.services.live.changes import Changes, Topic

LONGEST_REASON = 200  # characters

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Hold:
    """``since`` is when a person set it; None for the clock's."""

    reason: str = ""
    until: datetime | None = None  # None: until it is released
    since: datetime | None = None
    clock: bool = False
    is_copy: bool = False  # the data was copied from another tablet
    robot_id: int | None = None
    id: int = 0

    def is_over(self, now: datetime) -> bool:
        return self.until is not None and self.until <= now

    def covers(self, robot_id: int | None, at: datetime) -> bool:
        """Whether nothing is sent to that robot at that instant. Only a hold of all robots covers None."""
        return self.robot_id in (None, robot_id) and not self.is_over(at) and (self.since is None or self.since <= at)


class Holds:
    """Stored holds survive a restart; the clock's hold is this run's own. Read by every robot worker at every try, so kept in memory."""

    def __init__(self, db: Database, repository: HoldRepository, clock: Clock, changes: Changes) -> None:
        self._db, self._repository, self._clock, self._changes = db, repository, clock, changes
        self._lock = threading.Lock()
        self._clock_problem: Message | None = None
        self._is_clock_confirmed = False
        self.is_copy: Message | None = None  # why nothing may be sent from this tablet
        self._clock_checked_at: tuple[datetime, float] | None = None
        self._stored: list[StoredHold] = []
        self.reload()

    def reload(self) -> None:
        stored = self._repository.all(self._db.read())
        with self._lock:
            self._stored = stored

    def check_is_no_copy(self) -> None:
        """Raises InvalidInput where the data was copied from another tablet."""
        if self.is_copy is not None:
            raise InvalidInput(
                "robot", "this data was copied from another tablet: nothing is sent from here before it moves here"
            )

    def active(self, robot_id: int | None = None) -> Hold | None:
        """The hold that applies to this robot now (None: the one of all robots)."""
        return next((hold for hold in self.all_active() if hold.robot_id in (None, robot_id)), None)

    def all_active(self) -> list[Hold]:
        """The tablet's own, if there is one, and those that an operator set."""
        return [*filter(None, [self._tablet_hold()]), *self.current()]

    def _tablet_hold(self) -> Hold | None:
        now, mono = self._clock.now(), self._clock.monotonic()
        with self._lock:
            if self.is_copy is not None:
                return Hold(render(self.is_copy), is_copy=True)
            if self._clock_problem is not None:
                return Hold(render(self._clock_problem), clock=True)
            if (
                self._clock_checked_at is not None
                and abs((now - self._clock_checked_at[0]).total_seconds() - (mono - self._clock_checked_at[1]))
                > CLOCK_STEP_S
            ):
                return Hold(clock=True)  # it has moved, or the tablet slept, and that has not been judged yet
        return None

    def current(self) -> list[Hold]:
        """Those that an operator set and that have not expired, oldest first."""
        now = self._clock.now()
        with self._lock:
            stored = self._stored
        return [hold for hold in map(_hold, stored) if not hold.is_over(now)]

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

        def put(c: sqlite3.Connection, before: Sequence[StoredHold]) -> Sequence[StoredHold]:
            if robot_id is not None and RobotRepository().get(c, robot_id) is None:
                raise InvalidInput("robot", "there is no such robot any more")
            self._repository.remove(c, robot_id)
            stored = self._repository.add(c, StoredHold(reason=reason, until=until, robot_id=robot_id, started_at=now))
            also(c, _hold(stored))
            return [stored]

        [stored] = self._change(robot_id, put)
        return _hold(stored)

    def release(
        self,
        robot_id: int | None = None,
        only: int | None = None,
        *,
        also: Callable[[sqlite3.Connection], object] = lambda c: None,
    ) -> None:
        """Of all robots, or of one; ``only`` a hold with this id, where another one has taken its place since. ``also`` is done in any
        case, in the same transaction."""

        def remove(c: sqlite3.Connection, before: Sequence[StoredHold]) -> Sequence[StoredHold]:
            also(c)
            if only is not None and only not in [hold.id for hold in before]:
                return before
            self._repository.remove(c, robot_id)
            return []

        self._change(robot_id, remove)

    def _change(
        self,
        robot_id: int | None,
        change: Callable[[sqlite3.Connection, Sequence[StoredHold]], Sequence[StoredHold]],
    ) -> Sequence[StoredHold]:
        """``change`` the hold of all robots, or of one: from what is stored to what is returned."""

        def work(c: sqlite3.Connection) -> tuple[str, str, Sequence[StoredHold]]:
            robot = None if robot_id is None else RobotRepository().get(c, robot_id)
            before = [hold for hold in self._repository.all(c) if hold.robot_id == robot_id]
            return f"robot {robot.name!r}" if robot else "all robots", _in_words(before), change(c, before)

        held, before, stored = self._db.write(work)
        if before != (now := _in_words(stored)):
            log.info("hold of %s: %s → %s", held, before, now)
        self.reload()
        self.announce()
        return stored

    def doubt_clock(self, problem: Message | None) -> None:
        """Nothing is sent while the clock is not plausible; None when it is again."""
        with self._lock:
            if problem == self._clock_problem:
                return
            self._clock_problem = problem
        self.announce()

    def clock_checked(self, now: datetime, mono: float) -> None:
        """At that time, wall and monotonic."""
        self._clock_checked_at = (now, mono)

    @property
    def clock_problem(self) -> Message | None:
        """Why the clock is not plausible, or is still being judged; None: it is trusted."""
        return self._clock_problem

    def confirm_clock(self) -> None:
        """A person says that the tablet's clock is right, whatever robots say."""
        with self._lock:
            self._clock_problem, self._is_clock_confirmed = None, True
        self.announce()

    def take_clock_confirmation(self) -> bool:
        """Whether a person has said so since this was asked last."""
        with self._lock:
            confirmed, self._is_clock_confirmed = self._is_clock_confirmed, False
        return confirmed

    def announce(self) -> None:
        """Somebody changed what holds."""
        self._changes.publish(Topic.HOLDS)


class Cleared:
    """What is removed: ``rows`` are ids, whichever robot has them now."""

    def __init__(self, robot_id: int) -> None:
        self.robot_id, self.rows = robot_id, frozenset[int]()


class Clearing:
    """Until the robot has answered nothing is sent to it, nor what was to go to it to another robot, and what becomes of its items is not
    judged. Read by every worker at every try."""

    def __init__(self, changes: Changes) -> None:
        self._changes, self._lock = changes, threading.Lock()
        self._now: tuple[Cleared, ...] = ()

    @contextmanager
    def of(self, robot_id: int) -> Iterator[Cleared]:
        """Its queue is being cleared as long as this is open."""
        cleared = Cleared(robot_id)
        with self._lock:
            self._now = (*self._now, cleared)
        try:
            yield cleared
        finally:
            with self._lock:
                self._now = tuple(each for each in self._now if each is not cleared)
            self._changes.publish(Topic.EXECUTIONS)  # what was blocked goes on

    def is_of(self, robot_id: int) -> bool:
        return any(each.robot_id == robot_id for each in self._now)

    def blocks(self, row: Execution) -> bool:
        return any(row.robot_id == each.robot_id or row.id in each.rows for each in self._now)


def _in_words(holds: Sequence[StoredHold]) -> str:
    return (
        "".join(
            f"until {hold.until.isoformat(timespec='minutes') if hold.until else 'it is released'}"
            f"{f', {hold.reason!r}' if hold.reason else ''}"
            for hold in holds
        )
        or "none"
    )


def _hold(stored: StoredHold) -> Hold:
    return Hold(stored.reason, stored.until, stored.started_at, robot_id=stored.robot_id, id=stored.id)
