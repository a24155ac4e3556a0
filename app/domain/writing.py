"""Dates and times of day inside the services' sentences, in the format of the language of ``translate``. English ones are ISO 8601, for
files and logs, except those ``in_words``, which only people read."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date, datetime, time
from typing import Any

Translate = Callable[[str], str]


class Dashes(dict[str, Any]):
    """The value in a sentence: a dash if unknown."""

    def __missing__(self, key: str) -> str:
        return "–"


def time_of_day(at: datetime | time, translate: Translate) -> str:
    """06:30"""
    return translate("{hour:02}:{minute:02}").format(hour=at.hour, minute=at.minute)


def times(first: time, last: time, translate: Translate) -> str:
    """06:30–10:05"""
    return f"{time_of_day(first, translate)}–{time_of_day(last, translate)}"


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


def span(first: datetime, last: datetime, translate: Translate) -> str:
    """1–14 July, 28 June – 3 July, with the years where they differ; 23 November, 06:05–10:05 within a day"""
    months = translate("January February March April May June July August September October November December").split()

    def day_and_month(at: datetime) -> str:
        return translate("{day} {month_in_full}").format(day=at.day, month_in_full=months[at.month - 1])

    if first.date() == last.date():
        return translate("{day}, {first}–{last}").format(
            day=day_and_month(first), first=time_of_day(first, translate), last=time_of_day(last, translate)
        )
    if (first.year, first.month) == (last.year, last.month):
        return translate("{first_day}–{last}").format(first_day=first.day, last=day_and_month(last))
    if first.year == last.year:
        return translate("{first} – {last}").format(first=day_and_month(first), last=day_and_month(last))
    ends = (
        translate("{day_and_month} {year}").format(day_and_month=day_and_month(at), year=at.year)
        for at in (first, last)
    )
    return translate("{first} – {last}").format(first=next(ends), last=next(ends))


def count(number: int, translate: Translate) -> str:
    """2,016"""
    return f"{number:,}".replace(",", translate(","))
