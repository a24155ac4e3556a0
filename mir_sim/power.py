"""The battery: a level that falls or rises along straight lines between events."""
from __future__ import annotations

from dataclasses import dataclass

# Percent per second. A robot drives about ten hours, stands about a day and a half, and charges in about two hours (guesses).
DRIVING = -10 / 3600
STANDING = -2.7 / 3600
CHARGING = 50 / 3600


@dataclass
class Battery:
    """State of charge in percent, exact at any instant however often it is read."""

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
        """Simulated second at which the level is reached, or None when it isn't on this line."""
        if self.rate == 0:
            return None
        when = self.since + (level - self.level) / self.rate
        return when if when >= self.since else None

    def seconds_left(self, now: float) -> int:
        """Running time left in normal operation, as ``battery_time_remaining`` shows it."""
        return int(self.at(now) / -DRIVING)
