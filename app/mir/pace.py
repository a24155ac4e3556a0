"""How often one robot is asked by the app: some stop answering, or boot, when they are asked too much."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

from app.domain.check_up import Rest

# Shares of what the robot bears. The rest of it is for others that ask it, and for requests that are longer under way than the next.
OF_READS = 0.5
OF_STATUS = 0.6  # without which nothing starts
OF_ALL = 0.75
LONGEST = 60.0  # s that are looked back, whatever was measured
STEP = 0.05  # s between looks whether something else is due


class Pace:
    """Of one robot, for all clients and threads of the app that ask it. ``clock``: monotonic, in seconds; ``pause`` lets so many pass.
    ``rest``: what it does not bear; None: it is asked as often as is wanted."""

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, pause: Callable[[float], None] = time.sleep
    ) -> None:
        self.rest: Rest | None = None
        self._clock, self._pause = clock, pause
        self._asked: deque[float] = deque()
        self._lock = threading.Lock()

    def wait(self, share: float, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Until so much of what it bears has room for one more request, which then counts. ``meanwhile`` is called while it has not."""
        while (seconds := self._until_free(share)) > 0:
            meanwhile()
            self._pause(max(0.001, min(seconds, STEP)))

    def count(self) -> None:
        """A request that does not wait: what a person orders. What comes after it waits longer."""
        with self._lock:
            if self.rest is not None:
                self._asked.append(self._clock())

    def _until_free(self, share: float) -> float:
        with self._lock:
            rest, now = self.rest, self._clock()
            if rest is None:
                self._asked.clear()
                return 0.0
            seconds = min(rest.seconds, LONGEST)
            while self._asked and self._asked[0] <= now - seconds:
                self._asked.popleft()
            too_many = len(self._asked) - max(1, int(share * rest.requests))
            if too_many >= 0:
                return self._asked[too_many] + seconds - now
            self._asked.append(now)
            return 0.0
