"""What robots and fleets have in common: simulated time with its events, faults of their network, and being offline for a time.

Times are simulated seconds since the model began unless a name says otherwise.
"""

from __future__ import annotations

import heapq
import itertools
import threading
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from typing import Any, ClassVar

from mir_sim.clock import RobotClock
from mir_sim.faults import FaultList

MONDAY = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)

Event = tuple[float, Callable[[], object]]


class Machine:
    """A robot or a fleet.

    Args:
        name: what people call it.
        clock: shows its time.
        faults: of its network.
        time_source: returns simulated seconds; without one, time advances only by ``advance_to``.
        time_scale: simulated seconds per real second; matters only for /sim and for faults, which count real seconds.
    """

    base: ClassVar[str] = "/api/v2.0.0"  # of the paths of its REST API
    serial_number: str

    def __init__(
        self,
        name: str,
        clock: RobotClock,
        faults: FaultList,
        time_source: Callable[[], float] | None = None,
        time_scale: float = 1.0,
    ) -> None:
        self.name, self.clock, self.faults, self.time_scale = name, clock, faults, time_scale
        self.time_source = time_source
        self.lock = threading.RLock()
        self.now = 0.0
        self.shutting_down = False
        self.offline_until: float | None = None
        self.api_down_until = 0.0
        self.goes_offline: Callable[[], object] = lambda: None  # called just before that
        self._calls: list[tuple[float, int, Callable[[], object]]] = []
        self._call_order = itertools.count()

    def catch_up(self) -> None:
        """Advance to the clock's time; without a clock, only process events that are due."""
        self.advance_to(self.time_source() if self.time_source is not None else self.now)

    def advance_to(self, seconds: float) -> None:
        """Process all events up to a simulated second. A time in the past does nothing."""
        with self.lock:
            while (event := min(self._events(), key=lambda event: event[0], default=None)) and event[0] <= seconds:
                self.now = max(self.now, event[0])
                event[1]()
                self._settle()
            self.now = max(self.now, seconds)

    def call_at(self, seconds: float, call: Callable[[], object]) -> None:
        """Call a function when simulated time reaches ``seconds``."""
        with self.lock:
            heapq.heappush(self._calls, (seconds, next(self._call_order), call))

    def in_real(self, seconds: float) -> float:
        """The simulated second that is this many real seconds ahead."""
        return self.now + seconds * self.time_scale

    def stamp(self) -> str:
        """The machine's local time, as its records show it."""
        return self.clock.stamp(self.now)

    @property
    def online(self) -> bool:
        return self.offline_until is None

    def _events(self) -> Iterator[Event]:
        """What is due, as (simulated second, function to call)."""
        if self._calls:
            yield self._calls[0][0], self._make_call
        if self.offline_until is not None:
            yield self.offline_until, self._come_online

    def _make_call(self) -> None:
        heapq.heappop(self._calls)[2]()

    def _settle(self) -> None:
        """Called after every event."""

    def snapshot(self) -> dict[str, Any]:
        """What ``GET /sim`` shows: the state of the model, independent of the API."""
        raise NotImplementedError

    def reboot(self, real_seconds: float) -> None:
        """Be offline for a time."""
        self._go_offline(real_seconds)

    def _go_offline(self, real_seconds: float) -> None:
        self.goes_offline()
        self.shutting_down = False
        self.offline_until = self.in_real(real_seconds)

    def _come_online(self) -> None:
        self.offline_until = None
