"""Time zones to choose from."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

from app.screens.common import formats
from app.widgets.items import Option


def zone_options(names: Iterable[str], now: datetime, first: str = "") -> list[Option]:
    """By name, with the present time there and the difference from UTC, without short forms such as EST; the ``first``
    one on top."""
    places = {
        name for name in names if "/" in name and name.partition("/")[0] not in ("Etc", "SystemV", "posix", "right")
    }
    options = []
    for name in sorted(places | {"UTC", first} - {""}, key=lambda name: (name != first, name)):
        minutes = int((now.astimezone(ZoneInfo(name)).utcoffset() or timedelta()).total_seconds() // 60)
        hours, rest = divmod(abs(minutes), 60)
        note = f"{formats.clock_time(now, name)} · UTC{'−' if minutes < 0 else '+'}{hours:02d}:{rest:02d}"
        options.append(Option(name, name.replace("_", " "), note=note))
    return options
