"""Dates, times and rules of calendar files (RFC 5545), as written in the file. Unreadable ones raise ValueError."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from typing import Any

from app.domain.models import WEEKDAYS
from app.services.files.ics import Property

FREQUENCIES = ("YEARLY", "MONTHLY", "WEEKLY", "DAILY")  # those that name days; in dateutil's order
FIRST_YEAR, LAST_YEAR = 1600, 8999  # far from where a change of the zone fails
EARLIEST, LATEST = date(FIRST_YEAR, 1, 1), date(LAST_YEAR, 12, 31)
MIDNIGHT = timedelta()
CYCLE = 400  # years after which dates fall on the same weekdays again

_MOMENT = re.compile(r"(\d{4})-?(\d\d)-?(\d\d)(?:T(\d\d)(\d\d)(\d\d)?(?:\.\d+)?(Z?))?", re.ASCII | re.IGNORECASE)
_DURATION = re.compile(
    r"([+-])?P(?:(\d{1,5})W)?T?(?:(\d{1,5})D)?T?(?:(\d{1,7})H)?(?:(\d{1,7})M)?(?:(\d{1,9})S)?", re.ASCII | re.IGNORECASE
)
_WEEKDAY = re.compile(rf"([+-]?\d{{1,2}})?({'|'.join(WEEKDAYS)})", re.ASCII)
_NUMBER = re.compile(r"[+-]?\d{1,7}", re.ASCII)
_RANGES = {"BYMONTH": 12, "BYMONTHDAY": 31, "BYYEARDAY": 366, "BYWEEKNO": 53, "BYSETPOS": 366}
_OF_NO_EFFECT = {"BYHOUR", "BYMINUTE", "BYSECOND"}  # on the days
_USUAL = {("RSCALE", "GREGORIAN"), ("SKIP", "OMIT")}  # what holds without them (RFC 7529)


@dataclass(frozen=True)
class Moment:
    """A date, or a time of day in a zone: its TZID, UTC, or "" for the reader's local time. ``at`` is naive."""

    at: datetime
    is_date: bool = True
    zone: str = ""

    @property
    def is_far(self) -> bool:
        return self.at.date() in (EARLIEST, LATEST)


def since_midnight(at: datetime) -> timedelta:
    return timedelta(hours=at.hour, minutes=at.minute, seconds=at.second)


def values(found: Property) -> Iterator[Property]:
    """Those of a property with dates or times, one by one."""
    before, colon, listed = found.value.rpartition(":")  # a name of a zone with a colon and no quotes
    for value in filter(None, map(str.strip, listed.split(","))):
        yield Property(found.parameters + colon + before, value)


def moment(found: Property) -> Moment:
    """The first of these values; of a period its start."""
    first = next(values(found), found)
    return _moment(first.value.partition("/")[0], first.parameter("TZID"), first.parameter("VALUE").upper() == "DATE")


def _moment(text: str, zone: str, as_date: bool) -> Moment:
    match = _MOMENT.fullmatch(text.strip())
    if not match:
        raise ValueError(f"{text[:40]} is no date")
    year, month, day, hour, minute, second = (int(part or 0) for part in match.groups()[:6])
    at = datetime.combine(_date(year, month, day), time())
    if match[4] is None or as_date:
        return Moment(at)
    if hour > 24 or minute > 59 or second > 60:
        raise ValueError(f"{text} is no time")
    return Moment(at + timedelta(hours=hour, minutes=minute, seconds=second), False, "UTC" if match[7] else zone)


def _date(year: int, month: int, day: int) -> date:
    """What is far away, as programs write "always" and "never" (year 1, year 9999), is the first or the last date."""
    if FIRST_YEAR <= year <= LAST_YEAR:
        return date(year, month, day)
    return EARLIEST if year < FIRST_YEAR else LATEST


def duration(text: str) -> timedelta:
    match = _DURATION.fullmatch(text.strip())
    if not match or not any(match.groups()[1:]):
        raise ValueError(f"{text[:40]} is no duration")
    weeks, days, hours, minutes, seconds = (int(part or 0) for part in match.groups()[1:])
    length = timedelta(days=7 * weeks + days, hours=hours, minutes=minutes, seconds=seconds)
    return -length if match[1] == "-" else length


def offset(text: str) -> timedelta:
    """From UTC, of a time zone."""
    match = re.fullmatch(r"([+-]?)(\d\d):?(\d\d)?:?(\d\d)?", text.strip(), re.ASCII)
    if not match:
        raise ValueError(f"{text[:40]} is no offset")
    length = timedelta(hours=int(match[2]), minutes=int(match[3] or 0), seconds=int(match[4] or 0))
    if length >= timedelta(days=1):
        raise ValueError(f"{text} is no offset")
    return -length if match[1] == "-" else length


@dataclass(frozen=True)
class Rule:
    """An RRULE that names days; times of day in it are passed over, and an end far away. ``parts`` hold its BY… as numbers,
    BYDAY as (n, weekday)."""

    frequency: str
    interval: int
    count: int | None
    until: Moment | None
    week_starts: int
    parts: dict[str, tuple[Any, ...]]

    @classmethod
    def parse(cls, text: str) -> Rule:
        named = dict(part.strip().partition("=")[::2] for part in text.upper().split(";"))
        named = {name.strip(): value.strip() for name, value in named.items() if value.strip()}
        frequency = named.pop("FREQ", "")
        if frequency not in FREQUENCIES:
            raise ValueError(f"{frequency[:40]} names no days")
        interval, count = named.pop("INTERVAL", "1"), named.pop("COUNT", None)
        until, week_starts = named.pop("UNTIL", None), named.pop("WKST", "MO")
        ends = None if until is None else _moment(until, "", False)
        parts = {
            name: _part(name, value)
            for name, value in named.items()
            if name not in _OF_NO_EFFECT and (name, value) not in _USUAL and not name.startswith("X-")
        }
        return cls(
            frequency,
            _positive(interval),
            None if count is None else _positive(count),
            None if ends is None or ends.is_far else ends,
            WEEKDAYS.index(week_starts),
            parts,
        )

    @property
    def ends(self) -> bool:
        return self.count is not None or self.until is not None

    @property
    def is_yearly(self) -> bool:
        """Whether it names days of the year, and not of each week or month."""
        months = self.parts.get("BYMONTH", ())
        return (
            self.frequency == "YEARLY"
            or (self.frequency == "MONTHLY" and self.interval % 12 == 0)
            or 0 < len(months) < 12
        )

    def days(self, start: date, last: date) -> Iterator[date]:
        """From ``start`` to ``last``, by the library dateutil, which searches until the year 9999: moved close to it,
        to years with the same weekdays, a rule without any day takes one second instead of many."""
        from dateutil.rrule import rrule, weekday

        parts = {name.lower().replace("byday", "byweekday"): value for name, value in self.parts.items()}
        if "byweekday" in parts:
            parts["byweekday"] = tuple(weekday(day, number or None) for number, day in parts["byweekday"])
        if start > last:
            return
        later = max(date.max.year - last.year, 0) // CYCLE * CYCLE
        begins = datetime.combine(start.replace(year=start.year + later), time())
        for found in rrule(
            FREQUENCIES.index(self.frequency), begins, self.interval, self.week_starts, self.count, **parts
        ):
            day = date(found.year - later, found.month, found.day)
            if day > last:
                return
            yield day


def _positive(text: str) -> int:
    if not _NUMBER.fullmatch(text) or int(text) < 1:
        raise ValueError(f"{text[:40]} is no number")
    return int(text)


def _part(name: str, value: str) -> tuple[Any, ...]:
    values = [each.strip() for each in value.split(",")]
    if name == "BYDAY":
        found = [_WEEKDAY.fullmatch(each) for each in values]
        if not all(found):
            raise ValueError(f"{value[:40]} are no weekdays")
        return tuple(sorted({(int(match[1] or 0), WEEKDAYS.index(match[2])) for match in found if match}))
    if name not in _RANGES or not all(
        _NUMBER.fullmatch(each) and 1 <= abs(int(each)) <= _RANGES[name] for each in values
    ):
        raise ValueError(f"{name[:40]} can't be used with {value[:40]}")
    return tuple(sorted({int(each) for each in values}))
