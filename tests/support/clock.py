"""A clock that tests move by hand; wall, monotonic and true time can part, as on a tablet whose clock is set or that sleeps."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta


class VirtualClock:
    def __init__(self, now: datetime = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)) -> None:  # a Monday
        self._now, self._mono, self._true = now, 1000.0, 0.0
        self.jumps = 0  # times that wall and monotonic time have parted

    def now(self) -> datetime:
        return self._now

    def monotonic(self) -> float:
        return self._mono

    def elapsed(self) -> float:
        """Seconds that have truly passed since the clock was made: robots live by them."""
        return self._true

    def sleep(self, seconds: float) -> None:
        self.advance(seconds)

    def advance(self, seconds: float) -> None:
        """Time passes."""
        self._now += timedelta(seconds=seconds)
        self._mono += seconds
        self._true += seconds

    def step(self, seconds: float) -> None:
        """The wall clock is set; monotonic and true time do not change."""
        self._now += timedelta(seconds=seconds)
        self.jumps += 1

    def suspend(self, seconds: float) -> None:
        """The tablet sleeps: wall and true time continue, the monotonic clock stops."""
        self._now += timedelta(seconds=seconds)
        self._true += seconds
        self.jumps += 1
