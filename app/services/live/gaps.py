"""Times in which nothing was observed: the app was off, the tablet slept, or its clock could not be trusted."""
from __future__ import annotations

import threading
from dataclasses import dataclass
from datetime import datetime, timedelta

HEARTBEAT_EVERY = 15.0                        # s; a power cut is known to about this precision
NOTEWORTHY = timedelta(seconds=60)            # a shorter gap is a restart or a slow moment, not an absence


@dataclass(frozen=True)
class Gap:
    start: datetime
    end: datetime
    clock: bool = False                       # the clock was not plausible, rather than the app off or asleep


class Downtime:
    """The gaps of this run of the app, newest last; written by the scheduler thread, read by all robot workers."""

    KEPT = 100

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._gaps: list[Gap] = []

    def add(self, gap: Gap) -> None:
        with self._lock:
            self._gaps = [*self._gaps, gap][-self.KEPT:]

    def forget_beyond(self, now: datetime) -> None:
        """The clock has been set back: what it showed since says nothing about times still to come."""
        with self._lock:
            self._gaps = [Gap(gap.start, min(gap.end, now), gap.clock) for gap in self._gaps if gap.start < now]

    def at(self, instant: datetime) -> Gap | None:
        """The gap that this instant fell into."""
        with self._lock:
            return next((gap for gap in reversed(self._gaps) if gap.start <= instant <= gap.end), None)

    def overlaps(self, start: datetime, end: datetime) -> bool:
        """Whether a gap lies across any of this time."""
        with self._lock:
            return any(gap.start < end and start < gap.end for gap in self._gaps)
