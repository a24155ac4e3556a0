"""UTC instants as people in a zone read them, in the language the app speaks now."""
from __future__ import annotations

from datetime import datetime
from zoneinfo import ZoneInfo

from app.screens import formats

DAY = 24 * 3600


def local(at: datetime, zone: str) -> datetime:
    return at.astimezone(ZoneInfo(zone))


def time_of(at: datetime, zone: str) -> str:
    """14:38"""
    return formats.current().time(local(at, zone))


def moment(at: datetime, now: datetime, zone: str) -> str:
    """14:38 when it is today there, else with the date."""
    return formats.current().moment(local(at, zone), local(now, zone))


def date(at: datetime, zone: str) -> str:
    """Fri 20 Nov 2026"""
    return formats.current().date(local(at, zone).date())


def until(at: datetime, now: datetime, zone: str) -> str:
    """in 2 h 10 min; from a day on the date."""
    seconds = (at - now).total_seconds()
    return formats.current().until(seconds) if seconds < DAY else formats.current().day(local(at, zone).date())


def ago(at: datetime, now: datetime) -> str:
    """2 s ago; a clock that was set back makes nothing lie in the future."""
    return formats.current().ago(max(0.0, (now - at).total_seconds()))


def duration(seconds: float | None) -> str:
    return formats.current().duration(seconds)


def number(value: float | None, digits: int = 0, unit: str = "") -> str:
    """98.1 m; "–" of nothing, without its unit."""
    text = formats.current().number(value, digits)
    return f"{text} {unit}" if unit and value is not None else text
