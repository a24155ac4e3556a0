"""The clock that services use, and time zones.

Everything that knows the time takes a ``Clock``, so a year of operation runs in seconds under a virtual one.
"""

from __future__ import annotations

import ctypes
import re
import sys
import time
import zoneinfo
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from datetime import time as time_of_day
from functools import lru_cache
from pathlib import Path
from typing import Protocol
from zoneinfo import ZoneInfo, available_timezones

DAY = timedelta(days=1)
MOMENT = timedelta(microseconds=1)
EARLIEST = datetime(2026, 1, 1, tzinfo=UTC)  # before the app existed: a clock with an earlier time is wrong


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


if sys.platform == "win32":

    def awake_seconds() -> float:
        """Python's own monotonic clock counts the time that a machine with Windows slept."""
        ticks = ctypes.c_ulonglong()  # of 100 ns
        ctypes.windll.kernel32.QueryUnbiasedInterruptTime(ctypes.byref(ticks))
        return ticks.value / 1e7
else:
    awake_seconds = time.monotonic


class SystemClock:
    """The tablet's clocks."""

    def now(self) -> datetime:
        return datetime.now(UTC)

    def monotonic(self) -> float:
        return awake_seconds()

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds)


def days_between(first: date, last: date) -> Iterator[date]:
    """Both included, in order."""
    return (first + number * DAY for number in range((last - first).days + 1))


def midnight(day: date, zone: ZoneInfo) -> datetime:
    """The instant, in UTC, at which a local day begins; where a clock change skips its midnight, the instant of the change."""
    local = datetime.combine(day, time_of_day(), zone)
    return min(local.astimezone(UTC), local.replace(fold=1).astimezone(UTC))


@lru_cache(maxsize=1)
def zone_names() -> frozenset[str]:
    """The IANA names of time zones that this system knows; kept, because asking for them reads hundreds of files.
    Systems list some files that are not zones (zic(8)): a copy of the machine's own zone, and a placeholder for "not
    set"."""
    return frozenset(available_timezones() - {"localtime", "posixrules", "Factory"})


try:
    from tzdata import IANA_VERSION
except ModuleNotFoundError:  # --help works without what the app depends on
    IANA_VERSION = ""

_VERSION = re.compile(r"\b(\d{4})([a-z]+)")  # 2026f; the z of a year would be followed by za


def use_newest_zone_data() -> None:
    """From now on ``ZoneInfo`` reads the app's own data, and the system's only where they are known to be as new or newer."""
    own = _comparable(IANA_VERSION)
    zoneinfo.reset_tzpath(to=[path for path in zoneinfo.TZPATH if own <= _comparable(_version_in(Path(path)))])
    zoneinfo.ZoneInfo.clear_cache()


def _comparable(version: str) -> tuple[str, int, str]:
    """Less than any other if it is missing."""
    found = _VERSION.search(version)
    return (found[1], len(found[2]), found[2]) if found else ("", 0, "")


def _version_in(directory: Path) -> str:
    """From the files with the zone data; "" if none has it."""
    for name in ("+VERSION", "tzdata.zi"):
        try:
            with (directory / name).open(encoding="ascii", errors="replace") as file:
                return file.readline(100)
        except OSError:
            continue
    return ""
