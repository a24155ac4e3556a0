"""Calendar files as text, and the days that are read from them."""

from __future__ import annotations

from datetime import date
from pathlib import Path
from zoneinfo import ZoneInfo

from app.services.files.calendar_days import Found, read_days

FILES = Path(__file__).parent / "calendars"
HELSINKI, NEW_YORK, TODAY = ZoneInfo("Europe/Helsinki"), ZoneInfo("America/New_York"), date(2026, 11, 23)
HEAD = ("BEGIN:VCALENDAR", "VERSION:2.0")


def read(content: bytes, plant: ZoneInfo = HELSINKI) -> Found:
    return read_days(content, "plant", plant, TODAY)


def calendar(*lines: str, head: tuple[str, ...] = HEAD) -> bytes:
    return "\r\n".join([*head, *lines, "END:VCALENDAR", ""]).encode()


def event(*lines: str) -> list[str]:
    return ["BEGIN:VEVENT", "SUMMARY:Stop", *lines, "END:VEVENT"]


def whole(found: Found) -> list[str]:
    """The whole days, such as "2027-07-05" or "2027-07-05/2027-07-07", with "yearly" behind those that are."""
    return sorted(text(day) for each in found.events for day in each.days if each.whole)


def timed(found: Found) -> list[str]:
    return sorted(text(day) for each in found.events for day in each.days if not each.whole)


def text(day) -> str:
    days = f"{day.first_day}" if day.first_day == day.last_day else f"{day.first_day}/{day.last_day}"
    return f"{days} yearly" if day.yearly else days


def days_of(*lines: str) -> list[str]:
    """The whole days of an event of these lines."""
    return whole(read(calendar(*event(*lines))))
