"""Closed days from an .ics file, such as a company's calendar or a list of school holidays.

All-day events, those with times of day, and yearly repetitions are taken; what is over since last year or repeats in another way is left
out and counted.
"""
from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, time, timedelta
from itertools import islice
from pathlib import Path
from zoneinfo import ZoneInfo

from app.database.calendar import CalendarRepository
from app.database.settings import SettingsRepository
from app.domain import names
from app.domain.models import DayException, InvalidInput
from app.services.catalogue import validation
from app.services.files import ics
from app.services.files.exports import DataFiles
from app.services.planning.recurrence import Frequency, Recurrence
from app.services.planning.recurrence.dates import dates

MOST_EVENTS = 20_000
YEARS_AHEAD = 10                         # of a yearly rule that is more than the same day again

_DATE = re.compile(r"(\d{4})(\d\d)(\d\d)(?:T(\d\d)(\d\d)(\d\d)(Z?))?", re.ASCII)
_DURATION = re.compile(r"\+?P(?:(\d{1,5})W)?(?:(\d{1,5})D)?(?:T(?:(\d{1,6})H)?(?:(\d{1,6})M)?(?:(\d{1,6})S)?)?", re.ASCII)


@dataclass(frozen=True)
class Found:
    """What a file holds. ``left_out`` counts events that can't be taken, ``past`` those that were over before this year."""
    exceptions: Sequence[DayException] = ()
    left_out: int = 0
    past: int = 0


@dataclass(frozen=True)
class Imported:
    """What came of an import: the entries that are new, how many there were already."""
    path: Path
    added: Sequence[DayException]
    known: int
    left_out: int
    past: int

    @property
    def days(self) -> int:
        """Closed days that are new; of yearly ones those of one year."""
        return sum((exception.last_day - exception.first_day).days + 1 for exception in self.added)


class CalendarFiles(DataFiles):
    """Calendars that people bring along."""

    def newest_calendar(self) -> Path | None:
        """The .ics file that was put into ``directory`` last: most likely the one to import."""
        return self._newest("*.ics")

    def import_days(self, path: str) -> Imported:
        """Take the days of a file as closed ones, whole or not at all. Raises InvalidInput("path", …) with one sentence."""
        source = self._resolved(path)
        content = self._content(source)
        c = self._db.read()
        zone = ZoneInfo(SettingsRepository().load(c).timezone)
        try:
            found = read_days(content, source.stem, zone, self._clock.now().astimezone(zone).date())
        except ics.NotACalendar:
            raise InvalidInput("path", "{path} is not a calendar file (.ics)", path=source) from None
        if not found.exceptions:
            raise InvalidInput("path", "{path} has no days to take", path=source)
        there = {_identity(exception) for exception in CalendarRepository().all(c)}
        new = [replace(exception, source=source.name) for exception in found.exceptions if _identity(exception) not in there]
        return Imported(source, self._catalogue.add_days(new) if new else (), len(found.exceptions) - len(new), found.left_out, found.past)


def _identity(exception: DayException) -> tuple[object, ...]:
    return exception.name, exception.first_day, exception.last_day, exception.is_working, exception.yearly


def read_days(content: bytes, name: str, zone: ZoneInfo, today: date) -> Found:
    """Closed days of an .ics file; ``name`` stands for events without one, ``zone`` is that of the plant. Raises ics.NotACalendar."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ics.NotACalendar("is not UTF-8") from error
    taken: dict[tuple[object, ...], DayException] = {}
    left_out = past = 0
    for number, event in enumerate(ics.events(text)):
        if number == MOST_EVENTS:
            raise ics.NotACalendar("has too many events")
        try:
            found = list(_exceptions(event, name, zone, today))
        except (ValueError, OverflowError):
            left_out += 1
            continue
        for exception in found:
            if exception.yearly or exception.last_day.year >= today.year:
                taken.setdefault(_identity(exception), exception)
        past += not any(exception.yearly or exception.last_day.year >= today.year for exception in found)
    in_order = sorted(taken.values(), key=lambda exception: (exception.first_day, exception.last_day))
    return Found(in_order, left_out, past)


def _exceptions(event: ics.Event, name: str, zone: ZoneInfo, today: date) -> Iterator[DayException]:
    """The days of one event. Raises ValueError (InvalidInput among them) for one that can't be taken."""
    if "DTSTART" not in event or ("STATUS" in event and event["STATUS"].value.strip().upper() == "CANCELLED"):
        raise ValueError("no date")
    first, last = _span(event, zone)
    title = event["SUMMARY"].text if "SUMMARY" in event else ""
    once = validation.day_exception(DayException(names.cleaned(title) or names.cleaned(name) or "ics", first, last))
    if "RRULE" not in event:
        yield once
        return
    rule = _rule(event["RRULE"].value)
    if rule in (Recurrence(Frequency.YEARLY), Recurrence(Frequency.YEARLY, months=(first.month,), month_days=(first.day,)),
                Recurrence(Frequency.YEARLY, months=(first.month,)), Recurrence(Frequency.YEARLY, month_days=(first.day,))):
        yield replace(once, yearly=True)
        return
    length = last - first
    horizon = date(today.year + YEARS_AHEAD, 12, 31)
    until = horizon if rule.until is None else min(horizon, rule.until.date())
    for day in islice(dates(rule, first, first, until), rule.count):
        if day.year >= today.year - 1:
            yield replace(once, first_day=day, last_day=day + length)


def _rule(value: str) -> Recurrence:
    parts = [part for part in value.strip().upper().split(";") if not part.startswith("WKST=")]      # no meaning by date
    rule = Recurrence.parse(";".join(parts))
    if rule.frequency is not Frequency.YEARLY:
        raise ValueError("a rule of every week or month is no exception")
    return rule


def _span(event: ics.Event, zone: ZoneInfo) -> tuple[date, date]:
    """First and last day; DTEND itself is not included any more (RFC 5545, section 3.6.1)."""
    start = _moment(event["DTSTART"], zone)
    if "DTEND" in event:
        end = _moment(event["DTEND"], zone)
    elif "DURATION" in event:
        end = _later(start, event["DURATION"].value)
    else:
        return start.date(), start.date()
    last = end.date() - timedelta(days=1) if end.time() == time() else end.date()
    return start.date(), max(last, start.date())


def _moment(given: ics.Property, zone: ZoneInfo) -> datetime:
    """Naive local time, midnight of a plain date. A time in UTC becomes the plant's; one of another zone stays as it is written."""
    match = _DATE.fullmatch(given.value.strip())
    if match is None:
        raise ValueError(given.value)
    year, month, day, hour, minute, second = (int(part or 0) for part in match.groups()[:6])
    moment = datetime(year, month, day, hour, minute, min(second, 59))       # a leap second is the minute's last  # noqa: DTZ001
    return moment.replace(tzinfo=UTC).astimezone(zone).replace(tzinfo=None) if match[7] else moment


def _later(start: datetime, duration: str) -> datetime:
    match = _DURATION.fullmatch(duration.strip().upper())
    if match is None:
        raise ValueError(duration)
    weeks, days, hours, minutes, seconds = (int(part or 0) for part in match.groups())
    return start + timedelta(weeks=weeks, days=days, hours=hours, minutes=minutes, seconds=seconds)
