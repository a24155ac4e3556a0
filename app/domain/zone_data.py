"""Which time zone data count: the system's or those that come with the app (``tzdata``), whichever are newer.

Python prefers the system's, and a tablet's system is updated less often than the app.
"""

from __future__ import annotations

import re
import zoneinfo
from pathlib import Path

try:
    from tzdata import IANA_VERSION
except ModuleNotFoundError:  # --help works without what the app depends on
    IANA_VERSION = ""

_VERSION = re.compile(r"\b(\d{4})([a-z]+)")  # 2026f; the z of a year would be followed by za


def use_newest() -> None:
    """From now on ``ZoneInfo`` reads the app's own data, and the system's only where they are known to be as new or newer."""
    own = _comparable(IANA_VERSION)
    zoneinfo.reset_tzpath(to=[path for path in zoneinfo.TZPATH if own <= _comparable(_version_in(Path(path)))])
    zoneinfo.ZoneInfo.clear_cache()


def _comparable(version: str) -> tuple[str, int, str]:
    """Less than any other where it says nothing."""
    found = _VERSION.search(version)
    return (found[1], len(found[2]), found[2]) if found else ("", 0, "")


def _version_in(directory: Path) -> str:
    """As the files say that come with zone data; "" where none does."""
    for name in ("+VERSION", "tzdata.zi"):
        try:
            with (directory / name).open(encoding="ascii", errors="replace") as file:
                return file.readline(100)
        except OSError:
            continue
    return ""
