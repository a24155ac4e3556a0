"""Dates, times, durations and numbers as each language writes them. Explicit tables instead of the process's locale,
which a kiosk rarely sets; no kivy. The functions write in the language of the app; instants are aware datetimes, shown
in an IANA zone.

    duration(200)                        "3 min 20 s"
    until(at, now, zone)                 "in 2 h 10 min"; further off than a day "Mon 23 Nov 06:30"
    ago(20)                              "20 s ago"
    clock_time(at, zone)                 "14:38"
    day(at, zone, year=True)             "Fri 20 Nov 2026"
    number(98.13, 1, "%")                "98.1 %"

Unknown values (None) are "–", never 0.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import date, datetime, time, tzinfo
from functools import lru_cache

from app.domain import writing
from app.domain.models import WEEKDAYS
from app.domain.reasons import known_zone
from app.i18n import SOURCE_LANGUAGE, _, translator
from app.services.planning import sentences

NOTHING = "–"
DAY = 86400.0
LONGEST_QUESTION = 240  # characters of a robot's question, so that the answers are in sight


@dataclass(frozen=True)
class Table:
    """How one language writes dates and numbers. Patterns are ``str.format`` templates."""

    months: tuple[str, ...]
    months_short: tuple[str, ...]
    weekdays: tuple[str, ...]  # from Monday
    weekdays_short: tuple[str, ...]  # two letters, for chips and calendars
    weekdays_date: tuple[str, ...]  # before a date
    date_pattern: str  # with the year
    day_pattern: str  # without
    time_separator: str
    decimal: str
    in_pattern: str
    ago_pattern: str
    now_word: str
    units: tuple[str, str, str, str] = ("s", "min", "h", "d")


LANGUAGES = {
    "en": Table(
        months=sentences.MONTHS,
        months_short=("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"),
        weekdays=("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday"),
        weekdays_short=("Mo", "Tu", "We", "Th", "Fr", "Sa", "Su"),
        weekdays_date=sentences.WEEKDAYS,
        date_pattern="{weekday} {day} {month} {year}",
        day_pattern="{weekday} {day} {month}",
        time_separator=":",
        decimal=".",
        in_pattern="in {}",
        ago_pattern="{} ago",
        now_word="now",
    ),
    "fi": Table(
        months=(
            "tammikuu",
            "helmikuu",
            "maaliskuu",
            "huhtikuu",
            "toukokuu",
            "kesäkuu",
            "heinäkuu",
            "elokuu",
            "syyskuu",
            "lokakuu",
            "marraskuu",
            "joulukuu",
        ),
        months_short=(
            "tammi",
            "helmi",
            "maalis",
            "huhti",
            "touko",
            "kesä",
            "heinä",
            "elo",
            "syys",
            "loka",
            "marras",
            "joulu",
        ),
        weekdays=("maanantai", "tiistai", "keskiviikko", "torstai", "perjantai", "lauantai", "sunnuntai"),
        weekdays_short=("ma", "ti", "ke", "to", "pe", "la", "su"),
        weekdays_date=("ma", "ti", "ke", "to", "pe", "la", "su"),
        date_pattern="{weekday} {day}.{number}.{year}",
        day_pattern="{weekday} {day}.{number}.",
        time_separator=".",
        decimal=",",
        in_pattern="{} kuluttua",
        ago_pattern="{} sitten",
        now_word="nyt",
        units=("s", "min", "h", "pv"),
    ),
}


def of(language: str) -> Table:
    """The table of ``language``, or the English one."""
    return LANGUAGES.get(language, LANGUAGES[SOURCE_LANGUAGE])


def current() -> Table:
    """The table of the language of the app."""
    return of(translator.language)


# ---------------------------------------------------------------------- instants
@lru_cache(maxsize=32)
def _zone(name: str) -> tzinfo:
    return known_zone(name)


def local(moment: datetime, zone: str) -> datetime:
    """The wall-clock time of ``moment`` (aware) in ``zone``."""
    return moment.astimezone(_zone(zone))


def wall_time(moment: datetime | time | None, seconds: bool = False) -> str:
    """14:38, with ``seconds`` 14:38:05, of a time that is a wall-clock time already."""
    if moment is None:
        return NOTHING
    parts = [moment.hour, moment.minute, *([moment.second] if seconds else [])]
    return current().time_separator.join(f"{part:02d}" for part in parts)


def clock_time(moment: datetime | None, zone: str) -> str:
    """14:38 in ``zone``."""
    return NOTHING if moment is None else wall_time(local(moment, zone))


def wall_day(when: date | None, year: bool = False) -> str:
    """Fri 20 Nov, with ``year`` Fri 20 Nov 2026, of a date that is a local one already."""
    return NOTHING if when is None else _written(when, current().date_pattern if year else current().day_pattern)


def _written(when: date, pattern: str) -> str:
    table = current()
    return pattern.format(
        weekday=table.weekdays_date[when.weekday()],
        day=when.day,
        month=table.months_short[when.month - 1],
        number=when.month,
        year=when.year,
    )


def day(moment: datetime | None, zone: str, year: bool = False) -> str:
    """Fri 20 Nov in ``zone``, with ``year`` Fri 20 Nov 2026."""
    return NOTHING if moment is None else wall_day(local(moment, zone), year)


def day_and_time(moment: datetime | None, zone: str, now: datetime | None = None) -> str:
    """Thu 19 Nov 14:38. With ``now`` only as much as is needed: 14:38 of today, and the year of another one."""
    if moment is None:
        return NOTHING
    there = local(moment, zone)
    if now is None:
        return f"{wall_day(there)} {wall_time(there)}"
    today = local(now, zone).date()
    return (
        wall_time(there)
        if there.date() == today
        else f"{wall_day(there, year=there.year != today.year)} {wall_time(there)}"
    )


def day_or_time(at: datetime, zone: str, now: datetime) -> str:
    """The day alone when a day begins then: "Mon 23 Nov" rather than "Mon 23 Nov 00:00"."""
    there = local(at, zone)
    if (there.hour, there.minute) == (0, 0):
        return wall_day(there.date(), year=there.year != local(now, zone).year)
    return day_and_time(at, zone, now)


def weekdays(days: Collection[str]) -> str:
    """Mon–Fri, Sun or ma–pe, su, of RFC 5545's two letters in any order."""
    words, runs = current().weekdays_date, list[list[int]]()
    for n in (n for n, day in enumerate(WEEKDAYS) if day in days):
        if runs and runs[-1][-1] == n - 1:
            runs[-1].append(n)
        else:
            runs.append([n])
    return ", ".join(
        f"{words[run[0]]}–{words[run[-1]]}" if len(run) > 2 else ", ".join(words[n] for n in run) for run in runs
    )


# ---------------------------------------------------------------------- spans in seconds
def duration(seconds: float | None) -> str:
    """The two largest units: 20 s, 3 min 20 s, 2 h 10 min, 3 d 4 h. Seconds are rounded down, as clocks do."""
    if seconds is None:
        return NOTHING
    whole = max(0, int(seconds))
    s, minutes, h, d = current().units
    if whole < 60:
        return f"{whole} {s}"
    if whole < 3600:
        return _pair(whole // 60, minutes, whole % 60, s, pad=True)
    if whole < DAY:
        return _pair(whole // 3600, h, whole % 3600 // 60, minutes)
    return _pair(int(whole // DAY), d, int(whole % DAY // 3600), h)


def _pair(large: int, large_unit: str, small: int, small_unit: str, pad: bool = False) -> str:
    if not small:
        return f"{large} {large_unit}"
    return f"{large} {large_unit} {small:02d} {small_unit}" if pad else f"{large} {large_unit} {small} {small_unit}"


def rough_duration(seconds: float | None) -> str:
    """20 s, 3 min, 2 h 10 min, 3 d 4 h: for what is counted down, ages, or is estimated anyway."""
    if seconds is None:
        return NOTHING
    return duration(seconds if seconds < 60 or seconds >= 3600 else int(seconds) // 60 * 60)


def ago(seconds: float | None) -> str:
    """20 s ago, 3 min ago; "now" below ten seconds, then whole tens: a value that is read every few seconds would
    change all the time, and each change draws the window."""
    if seconds is None:
        return NOTHING
    table = current()
    tens = seconds if seconds >= 60 else seconds // 10 * 10
    return table.ago_pattern.format(rough_duration(tens)) if tens else table.now_word


def ahead(seconds: float) -> str:
    """in 22 min, in 2 h 10 min; "now" below a second."""
    table = current()
    return table.now_word if seconds < 1 else table.in_pattern.format(rough_duration(seconds))


def until(moment: datetime | None, now: datetime, zone: str) -> str:
    """How soon within a day ("in 22 min"), when beyond it ("Mon 23 Nov 06:30")."""
    if moment is None:
        return NOTHING
    seconds = (moment - now).total_seconds()
    return ahead(seconds) if seconds < DAY else day_and_time(moment, zone, now)


# ---------------------------------------------------------------------- numbers and names
def number(value: float | None, digits: int = 0, unit: str = "") -> str:
    """46, 98.1 % or 98,1 %"""
    if value is None:
        return NOTHING
    whole, point, part = f"{value:,.{digits}f}".partition(".")
    text = whole.replace(",", _(",")) + (current().decimal if point else "") + part
    return f"{text} {unit}" if unit else text


def count(value: int) -> str:
    """2,016 or 2 016"""
    return writing.count(value, _)


def plain(value: float) -> str:
    """12 or 12.5 or 12,5: as many decimals as it has, at most six digits."""
    return f"{value:g}".replace(".", current().decimal)


def file_size(size: int) -> str:
    """3 kB or 80 MB of that many bytes, at least 1 kB."""
    kilobytes = max(1, round(size / 1000))
    return _("{n} kB").format(n=kilobytes) if kilobytes < 1000 else _("{n} MB").format(n=round(kilobytes / 1000))


def percent(value: float | None, digits: int = 0) -> str:
    """78 % of a value that is in percent already."""
    return number(value, digits, "%")


def address(url: str) -> str:
    """The address of a robot without the scheme that is usual: 10.40.12.21, robot.local:8080, https://robot.local."""
    return url.removeprefix("http://").rstrip("/")


def language_name(language: str) -> str:
    """In that language, so that a wrong choice can be corrected."""
    return {"en": "English", "fi": "Suomi"}.get(language, language)
