"""A clock that tests move by hand; wall and monotonic time can part, as on a tablet whose clock is set or that sleeps."""
from __future__ import annotations

from datetime import UTC, datetime, timedelta


class VirtualClock:
    def __init__(self, now: datetime = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)) -> None:      # a Monday
        self._now, self._mono = now, 1000.0

    def now(self) -> datetime:
        return self._now

    def monotonic(self) -> float:
        return self._mono

    def sleep(self, seconds: float) -> None:
        self.advance(seconds)

    def advance(self, seconds: float) -> None:
        """Time passes."""
        self._now += timedelta(seconds=seconds)
        self._mono += seconds

    def step(self, seconds: float) -> None:
        """The wall clock is set, or the tablet slept: monotonic time does not know."""
        self._now += timedelta(seconds=seconds)
