"""What an interrupted trial has left on robots or at fleets is undone later, one by one."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager

from app.database.errors import DatabaseError
from app.domain.clock import Clock
from app.domain.message import Message
from app.domain.models import InvalidInput
from app.mir.errors import RobotError

log = logging.getLogger(__name__)

RETRY_EVERY = 30.0  # s, for what a trial left behind


class Remains:
    """Of the robots, or the fleets, that can be checked up, by their ids."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock, self._under_way = threading.Lock(), set[int]()
        self._retry_at = -math.inf  # monotonic
        self._thread: threading.Thread | None = None

    def _left(self) -> Iterable[int]:
        """Where a trial has changed something that is not undone yet."""
        raise NotImplementedError

    def put_back(self, id_: int) -> Message | None:
        """Undo an interrupted trial there. Returns what could not be undone; None: everything is restored. Raises
        InvalidInput or RobotError."""
        raise NotImplementedError

    def left_behind(self) -> Collection[int]:
        """Where changes of an interrupted trial have not been undone."""
        return [id_ for id_ in self._left() if id_ not in self._under_way]

    def tick(self) -> None:
        """A chore: undo remains of a trial on a separate thread. Returns at once."""
        now = self._clock.monotonic()
        if now < self._retry_at or (self._thread and self._thread.is_alive()):
            return
        self._retry_at = now + RETRY_EVERY
        if left := list(self.left_behind()):
            self._thread = threading.Thread(
                target=self.put_back_all, args=(left,), name="after a check-up", daemon=True
            )
            self._thread.start()

    def put_back_all(self, ids: Sequence[int]) -> None:
        """One that does not answer is asked again later."""
        for id_ in ids:
            try:
                self.put_back(id_)
            except (RobotError, InvalidInput, DatabaseError) as problem:
                log.info("What a check-up left there (%d) could not be put back yet: %s", id_, problem)

    @contextmanager
    def _alone_with(self, id_: int, name: str) -> Iterator[None]:
        with self._lock:
            if id_ in self._under_way:
                raise InvalidInput("robot", "{robot} is being checked up already", robot=name)
            self._under_way.add(id_)
        try:
            yield
        finally:
            self._under_way.discard(id_)
