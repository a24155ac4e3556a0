"""Dates and times of day inside the services' sentences, in the format of the language of ``translate``. English ones are ISO 8601, for
files and logs, except those ``in_words``, which only people read."""
from __future__ import annotations

from collections.abc import Callable
from datetime import date, datetime, time

Translate = Callable[[str], str]


def time_of_day(at: datetime | time, translate: Translate) -> str:
    """06:30"""
    return translate("{hour:02}:{minute:02}").format(hour=at.hour, minute=at.minute)


def day(at: date, translate: Translate) -> str:
    """2026-11-23"""
    return translate("{year:04}-{month:02}-{day:02}").format(year=at.year, month=at.month, day=at.day)


def day_in_words(at: date, translate: Translate) -> str:
    """23 Nov 2026"""
    months = translate("Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec").split()
    return translate("{day} {month} {year}").format(day=at.day, month=months[at.month - 1], year=at.year)


def end_in_words(at: datetime, translate: Translate) -> str:
    """23 Nov 2026 06:30; the day alone when it begins then"""
    words = day_in_words(at, translate)
    return words if (at.hour, at.minute) == (0, 0) else f"{words} {time_of_day(at, translate)}"


def day_and_time(at: datetime, translate: Translate) -> str:
    """2026-11-23 06:30"""
    return f"{day(at, translate)} {time_of_day(at, translate)}"
