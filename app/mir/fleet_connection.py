"""What the clients of one fleet's robots share: the pace of requests, and answers about all of its robots, so that a
hundred workers ask one question a second instead of a hundred."""

from __future__ import annotations

import threading
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from app.mir.errors import RobotError
from app.mir.transport import Pace

if TYPE_CHECKING:
    from app.mir.credentials import Token
    from app.mir.enterprise_past import Sent

FRESH = 1.0  # s for which an answer about all robots serves every one of them

T = TypeVar("T")


def since_boot() -> float:
    """Seconds, those included in which the tablet sleeps: what was answered before is old then."""
    return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()


class Pausing(Protocol):
    """A client; ``on_pause`` is called between the requests of a long read."""

    on_pause: Callable[[], None]


@dataclass
class Notes:
    """What a fleet's clients remember for each other. By robots' ids: their ``names``, whether their own API can be
    ``reached``, and when the fleet has ``heard`` of them, with since when it says so. ``time``: the fleet's, when it was
    asked last. By tokens: what was ``said`` of orders, the ids of their ``phases``, and how they were ``sent``; by
    robots' ids the ``newest`` number, and the token of the last order before (``sent_before``). ``own_keys``: how orders
    show the app's key."""

    names: Mapping[str, str] = field(default_factory=dict)
    reached: dict[str, bool] = field(default_factory=dict)
    heard: dict[str, tuple[str, float]] = field(default_factory=dict)
    version: tuple[int, ...] = ()
    time: datetime | None = None
    said: dict[str, str] = field(default_factory=dict)
    phases: dict[str, str] = field(default_factory=dict)
    sent: dict[str, Sent] = field(default_factory=dict)
    newest: dict[str, int] = field(default_factory=dict)
    sent_before: dict[str, str] = field(default_factory=dict)
    own_keys: dict[Token, str] = field(default_factory=dict)


class FleetConnection:
    """Used by many threads. ``clock``: monotonic, in seconds."""

    def __init__(self, clock: Callable[[], float] = since_boot, pace: Pace | None = None) -> None:
        self.clock, self.pace = clock, pace or Pace(clock)
        self.notes = Notes()
        self._answers: dict[str, tuple[float, Any]] = {}  # by question: when it was asked, and the value or error
        self._forgotten: dict[str, int] = defaultdict(int)  # by question: how often
        self._locks: dict[str, threading.Lock] = defaultdict(threading.Lock)
        self._lock = threading.Lock()

    def shared(self, client: Pausing, question: str, ask: Callable[[], T], within: float = FRESH) -> T:
        """An answer that was at most ``within`` seconds old at this call, or else that of ``ask``. A thread that comes
        while another one asks waits, and gets the same answer. Raises the RobotError of ``ask``, which serves only those
        that waited for it. In that ``client`` does not pause: what it did then might need the same answer."""
        came = self.clock()
        with self._lock:
            lock = self._locks[question]
        with lock:
            asked_at, answer = self._answers.get(question, (-1e9, None))
            if asked_at < came - (0.0 if isinstance(answer, RobotError) else within):
                began, on_pause, forgotten = self.clock(), client.on_pause, self._forgotten[question]
                client.on_pause = lambda: None
                try:
                    answer = ask()
                except RobotError as error:
                    answer = error
                finally:
                    client.on_pause = on_pause
                ended = self.clock() if isinstance(answer, RobotError) else began  # a failure may have taken longer
                with self._lock:
                    if self._forgotten[question] == forgotten:
                        self._answers[question] = (ended, answer)
        if isinstance(answer, RobotError):
            raise answer
        found: T = answer
        return found

    def forget(self, *questions: str) -> None:
        """The answers to these may be others now, also to those that are being asked."""
        with self._lock:
            for question in questions:
                self._forgotten[question] += 1
                self._answers.pop(question, None)
