"""Robots whose queue is being cleared. Kept in memory: it lasts as long as the request, and nothing on the disk tells of it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from app.domain.models import Execution
from app.services.live.changes import Changes, Topic


class Cleared:
    """What is to go: ``rows`` are ids, whichever robot has them by now."""

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
            self._changes.publish(Topic.EXECUTIONS)  # what was kept back goes on

    def is_of(self, robot_id: int) -> bool:
        return any(each.robot_id == robot_id for each in self._now)

    def keeps_back(self, row: Execution) -> bool:
        return any(row.robot_id == each.robot_id or row.id in each.rows for each in self._now)
