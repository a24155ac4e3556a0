"""The clock that services use, and time zones.

Everything that knows the time takes a ``Clock``, so a year of operation runs in seconds under a virtual one.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import UTC, date, datetime
from datetime import time as time_of_day
from functools import lru_cache
from typing import Protocol
from zoneinfo import ZoneInfo, available_timezones

EARLIEST = datetime(2026, 1, 1, tzinfo=UTC)  # before that there was no app: a clock that shows such a time is wrong


class Clock(Protocol):
    """Wall-clock time for people and plans, monotonic time for waits and ages (the wall clock may be set at any moment)."""

    def now(self) -> datetime:
        """The present instant, timezone-aware UTC."""

    def monotonic(self) -> float:
        """Seconds since some fixed point; never goes back and does not count the time the tablet slept."""

    def sleep(self, seconds: float) -> None:
        """Let this much time pass."""


@dataclass(frozen=True)
class ClockReading:
    """A robot's clock minus the tablet's in seconds, and when that was read on the monotonic clock."""

    offset: float
    read_at: float


class SystemClock:
    """The tablet's clocks."""

    def now(self) -> datetime:
        return datetime.now(UTC)

    def monotonic(self) -> float:
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds)


def midnight(day: date, zone: ZoneInfo) -> datetime:
    """The instant, in UTC, at which a local day begins; where a clock change skips its midnight, the instant of the change."""
    local = datetime.combine(day, time_of_day(), zone)
    return min(local.astimezone(UTC), local.replace(fold=1).astimezone(UTC))


@lru_cache(maxsize=1)
def zone_names() -> frozenset[str]:
    """The IANA names of time zones that this system knows; kept, because asking for them reads hundreds of files. Systems list
    some files among them that are no zones (zic(8)): a copy of the machine's own zone, and a placeholder for "not set"."""
    return frozenset(available_timezones() - {"localtime", "posixrules", "Factory"})
