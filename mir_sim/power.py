"""The battery: a level that changes linearly between events."""

from __future__ import annotations

from dataclasses import dataclass

# Percent per second. A full battery lasts ten hours of driving or a day and a half of standing, and charges in two hours (guesses).
DRIVING = -10 / 3600
STANDING = -2.7 / 3600
CHARGING = 50 / 3600


@dataclass
class Battery:
    """State of charge in percent, independent of how often it is read."""

    level: float
    rate: float = STANDING
    since: float = 0.0

    def at(self, now: float) -> float:
        return min(100.0, max(0.0, self.level + self.rate * (now - self.since)))

    def set_level(self, level: float, now: float) -> None:
        self.level, self.since = level, now

    def set_rate(self, rate: float, now: float) -> None:
        if rate != self.rate:
            self.level, self.since, self.rate = self.at(now), now, rate

    def time_of(self, level: float) -> float | None:
        """Simulated second at which the level is reached, or None when the present rate doesn't lead there."""
        if self.rate == 0:
            return None
        when = self.since + (level - self.level) / self.rate
        return when if when >= self.since else None

    def seconds_left(self, now: float) -> int:
        """Seconds of driving left, as ``battery_time_remaining`` shows them."""
        return int(self.at(now) / -DRIVING)
