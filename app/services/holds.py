"""What keeps every robot, or one, from being sent anything: the operator's hold, and a clock that can't be trusted."""
from __future__ import annotations

import threading
from dataclasses import dataclass
from datetime import datetime

from app.database.connection import Database
from app.database.holds import HoldRepository, StoredHold
from app.services.changes import Changes, Topic
from app.services.clock import Clock


@dataclass(frozen=True)
class Hold:
    reason: str = ""
    until: datetime | None = None             # None: until it is released
    clock: bool = False
    robot_id: int | None = None
    id: int = 0


class Holds:
    """Stored holds survive a restart; the clock's hold is this run's own. Read by every lane at every try, so kept in memory."""

    def __init__(self, db: Database, repository: HoldRepository, clock: Clock, changes: Changes) -> None:
        self._db, self._repository, self._clock, self._changes = db, repository, clock, changes
        self._lock = threading.Lock()
        self._clock_problem: str | None = None
        self._stored: list[StoredHold] = []
        self.reload()

    def reload(self) -> None:
        stored = self._repository.all(self._db.read())
        with self._lock:
            self._stored = stored

    def active(self, robot_id: int | None = None) -> Hold | None:
        """What holds this robot now (None: what holds all robots)."""
        now = self._clock.now()
        with self._lock:
            if self._clock_problem is not None:
                return Hold(self._clock_problem, clock=True)
            for hold in self._stored:
                if hold.robot_id in (None, robot_id) and (hold.until is None or now < hold.until):
                    return Hold(hold.reason, hold.until, robot_id=hold.robot_id, id=hold.id)
        return None

    def hold(self, reason: str = "", until: datetime | None = None, robot_id: int | None = None) -> None:
        """Replace the hold of all robots, or of one."""
        def work(c) -> None:  # type: ignore[no-untyped-def]
            self._repository.remove(c, robot_id)
            self._repository.add(c, StoredHold(reason=reason, until=until, robot_id=robot_id, started_at=self._clock.now()))
        self._db.write(work)
        self._reloaded()

    def release(self, robot_id: int | None = None) -> None:
        self._db.write(lambda c: self._repository.remove(c, robot_id))
        self._reloaded()

    def distrust_clock(self, problem: str | None) -> None:
        """Nothing is sent while the clock is not plausible; None when it is again."""
        with self._lock:
            if problem == self._clock_problem:
                return
            self._clock_problem = problem
        self._changes.publish(Topic.HOLDS)

    def _reloaded(self) -> None:
        self.reload()
        self._changes.publish(Topic.HOLDS)
