"""How a request travels to a robot: over HTTP (app.mir.http), or straight into a simulated robot in simulations.

And how often one is sent: some robots stop answering, or boot, when they are asked too much.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from app.domain.check_up import Rest

API = "/api/v2.0.0"
LONGEST_ANSWER = 30.0  # s: the longest wait for a robot
# Shares of the robot's limit. The rest is for other clients, and for requests that take longer than the next.
OF_READS = 0.5
OF_STATUS = 0.6  # without which nothing starts
OF_ALL = 0.75
LONGEST = 60.0  # s: the longest time looked back
STEP = 0.05  # s between looks whether something else is due


@dataclass(frozen=True)
class Timeouts:
    """Seconds: to connect, between two parts of an answer, and for everything together."""

    connect: float = 3.0
    read: float = 5.0
    total: float = 10.0

    def at_least(self, seconds: float | None) -> Timeouts:
        """The same, but with at least this time for an answer, for a robot that needs it; never longer than
        ``LONGEST_ANSWER``."""
        wanted = min(seconds or 0.0, LONGEST_ANSWER)
        return Timeouts(self.connect, max(self.read, wanted), max(self.total, wanted))


@dataclass(frozen=True)
class Response:
    """A complete answer. Names of headers are as MiR's, or matched in any case."""

    status: int
    body: bytes = field(default=b"", repr=False)
    headers: Mapping[str, str] = field(default_factory=dict, repr=False)


class Transport(Protocol):
    """Carries one request at a time. Used by one thread at a time."""

    def send(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        json: Any = None,
        timeout: Timeouts,
        is_wanted: Callable[[], bool] | None = None,
        with_credentials: bool = True,
    ) -> Response:
        """Send and return the answer, with any status. ``path`` is below the base of the API, for robots
        ``/api/v2.0.0``; ``json`` None means no body. ``is_wanted``, for what changes something, is asked once the
        connection is open. ``with_credentials``: with the credentials.

        Raises Unreachable or NotWanted when nothing was sent, TimedOut, ConnectionLost or Unreadable when something
        was.
        """

    def read_connection(self) -> object:
        """The open connection shared by reads, None if their last answer ended it, False if the robot has hung up
        since."""

    def close(self) -> None:
        """Close the connections. A later ``send`` opens new ones."""


class Pace:
    """The request limit of one robot, for all clients and threads of the app. ``clock``: monotonic, in seconds;
    ``pause`` waits that long. ``rest``: the load that it does not bear; None: no limit."""

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, pause: Callable[[float], None] = time.sleep
    ) -> None:
        self.rest: Rest | None = None
        self._clock, self._pause = clock, pause
        self._asked: deque[float] = deque()
        self._lock = threading.Lock()

    def wait(self, share: float | None, on_wait: Callable[[], None] = lambda: None) -> None:
        """Wait until this share of the robot's limit has room for one more request, which then counts. ``on_wait`` is
        called while waiting. ``share`` None: what a person orders is not delayed, but delays what follows."""
        while (seconds := self._until_free(share)) > 0:
            on_wait()
            self._pause(max(0.001, min(seconds, STEP)))

    def _until_free(self, share: float | None) -> float:
        with self._lock:
            rest, now = self.rest, self._clock()
            if rest is None:
                self._asked.clear()
                return 0.0
            seconds = min(rest.seconds, LONGEST)
            while self._asked and self._asked[0] <= now - seconds:
                self._asked.popleft()
            too_many = -1 if share is None else len(self._asked) - max(1, int(share * rest.requests))
            if too_many >= 0:
                return self._asked[too_many] + seconds - now
            self._asked.append(now)
            return 0.0
