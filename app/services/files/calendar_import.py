"""Closed days from an .ics file, such as a company's calendar or a list of school holidays.

All-day events and yearly repetitions are taken, without the days that they except; what is over since last year or repeats in another
way is left out and counted. Appointments, which have times of day, close nothing unless a person says so; cancelled events are none.
"""
from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, timedelta
from datetime import time as clock_time
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

from app.database.calendar import CalendarRepository
from app.database.settings import SettingsRepository
from app.domain import names
from app.domain.models import DayException, InvalidInput
from app.services.catalogue import validation
from app.services.files import ics
from app.services.files.exports import DataFiles
from app.services.files.reading import read_file
from app.services.planning.recurrence import Frequency, Recurrence
from app.services.planning.recurrence.dates import LAST_DAY, dates

if TYPE_CHECKING:
    from icalendar import Event

YEARS_AHEAD = 10                         # of a yearly rule that is more than the same day again
MOST_LOOKED_AT = 50_000                  # days of repetitions, past ones included
LONGEST_READING_S = 20.0                 # a rule that never comes takes a second, and so does a time in a zone that has changed for ages
UNREADABLE = (ValueError, OverflowError, LookupError, AttributeError, TypeError)      # what icalendar raises for what an event holds
MIDNIGHT = clock_time()


@dataclass(frozen=True)
class Found:
    """What a file holds. ``left_out`` counts events that can't be taken, ``past`` those that were over before this year; ``timed`` are the
    days of those with times of day."""
    exceptions: Sequence[DayException] = ()
    left_out: int = 0
    past: int = 0
    timed: Sequence[DayException] = ()


@dataclass(frozen=True)
class Imported:
    """What came of an import: the entries that are new, how many there were already, and the days of appointments that stay open."""
    path: Path
    added: Sequence[DayException]
    known: int
    left_out: int
    past: int
    timed: Sequence[DayException] = ()

    @property
    def days(self) -> int:
        """Closed days that are new; of yearly ones those of one year."""
        return sum((exception.last_day - exception.first_day).days + 1 for exception in self.added)


class CalendarFiles(DataFiles):
    """Imports calendar files."""

    def import_days(self, path: str, *, with_timed: bool = False) -> Imported:
        """Take the days of a file as closed ones, whole or not at all; those of appointments only ``with_timed``. Raises
        InvalidInput("path", …) with one sentence."""
        source = self._resolved(path)
        content = read_file(source)
        c = self._db.read()
        zone = ZoneInfo(SettingsRepository().load(c).timezone)
        try:
            found = read_days(content, source.stem, zone, self._clock.now().astimezone(zone).date(),
                              with_timed=with_timed)
        except ics.NotACalendar:
            raise InvalidInput("path", "{path} is not a calendar file (.ics)", path=source) from None
        except ics.TooMuch:
            raise InvalidInput("path", "{path} holds too much for a calendar of closed days: export those alone, and not for many years",
                               path=source) from None
        if not found.exceptions and not found.timed and found.left_out:
            raise InvalidInput("path", "{path} has no days to take: only whole days are taken that are single, last a while or come every "
                               "year", path=source)
        if not found.exceptions and not found.timed:
            raise InvalidInput("path", "{path} has no days to take", path=source)
        there = {_identity(exception) for exception in CalendarRepository().all(c)}
        new = [replace(exception, source=source.name) for exception in found.exceptions if _identity(exception) not in there]
        return Imported(source, self._catalogue.add_days(new) if new else (), len(found.exceptions) - len(new), found.left_out, found.past,
                        [exception for exception in found.timed if _identity(exception) not in there])


def _identity(exception: DayException) -> tuple[object, ...]:
    return exception.name, exception.first_day, exception.last_day, exception.is_working, exception.yearly


def read_days(content: bytes, name: str, zone: ZoneInfo, today: date, *, with_timed: bool = False) -> Found:
    """Closed days of an .ics file, those with times of day among them or beside them; ``name`` is given to events without one, ``zone`` is
    that of the plant. Raises ics.NotACalendar and ics.TooMuch."""
    events, plant = ics.events(content), _Plant(zone, today, time.monotonic() + LONGEST_READING_S)
    replaced: dict[str, set[date]] = {}              # single days of a repetition that events of their own stand for
    for event in events:
        with contextlib.suppress(*UNREADABLE):
            instead: Any = event.get("RECURRENCE-ID")
            if instead is not None:
                replaced.setdefault(str(event.get("UID")), set()).add(plant.local(instead.dt).date())
    taken: dict[tuple[object, ...], DayException] = {}
    timed: dict[tuple[object, ...], DayException] = {}
    looked_at = left_out = past = 0
    for event in events:
        if str(event.get("STATUS", "")).strip().upper() == "CANCELLED":
            continue
        is_past = True
        try:
            into = timed if not with_timed and _has_times(event, plant) else taken
            for exception in _exceptions(event, name, plant, replaced.get(str(event.get("UID")), set())):
                looked_at += 1
                if exception is not None and (exception.yearly or exception.last_day.year >= today.year):
                    is_past = False
                    into.setdefault(_identity(exception), exception)
                if looked_at > MOST_LOOKED_AT or len(taken) + len(timed) > validation.MOST_DAY_EXCEPTIONS:
                    raise ics.TooMuch("has too many days")
        except ics.TooMuch:
            raise
        except UNREADABLE:
            left_out += 1
            continue
        past += is_past
    return Found(_in_order(taken.values()), left_out, past, _in_order(timed.values()))


def _in_order(exceptions: Iterable[DayException]) -> list[DayException]:
    return sorted(exceptions, key=lambda exception: (exception.first_day, exception.last_day))


@dataclass(frozen=True)
class _Plant:
    """Where and when a file is read, which has to come to an end."""
    zone: ZoneInfo
    today: date
    ends_at: float                       # monotonic

    def local(self, moment: date) -> datetime:
        """Naive time at the plant, midnight of a plain date. A time without a zone, or with an unknown one, is taken as the plant's."""
        self.check()
        if moment.year > LAST_DAY.year:
            raise ValueError("is too far away")
        if not isinstance(moment, datetime):
            return datetime.combine(moment, MIDNIGHT)
        return moment.astimezone(self.zone).replace(tzinfo=None) if moment.tzinfo else moment

    def check(self) -> None:
        """Raises TooMuch when it is late. Before every step that may take a second."""
        if time.monotonic() > self.ends_at:
            raise ics.TooMuch("takes too long")


def _exceptions(event: Event, name: str, plant: _Plant, replaced: set[date]) -> Iterator[DayException | None]:
    """The days of one event, None for each that it excepts. Raises one of UNREADABLE, InvalidInput among them, if it can't be taken."""
    first, last = _span(event, plant)
    titles = event.get("SUMMARY", "")
    title = str(titles[0] if isinstance(titles, list) else titles)
    once = validation.day_exception(DayException(names.cleaned(title) or names.cleaned(name) or "ics", first, last))
    without = {plant.local(moment).date() for moment in event.exdates}
    if "RECURRENCE-ID" not in event:
        without |= replaced
    rules = [_rule(rule.to_ical().decode()) for rule in event.rrules]
    if not without and len(rules) == 1 and rules[0] in (
            Recurrence(Frequency.YEARLY), Recurrence(Frequency.YEARLY, months=(first.month,), month_days=(first.day,)),
            Recurrence(Frequency.YEARLY, months=(first.month,)), Recurrence(Frequency.YEARLY, month_days=(first.day,))):
        yield replace(once, yearly=True)
        rules = []
    elif not rules and first not in without:
        yield once
    more = (plant.local(moment).date() for moment, _end in event.rdates)
    for day in chain(*(_days(rule, first, plant) for rule in rules), more):
        yield None if day in without else replace(once, first_day=day, last_day=day + (last - first))


def _days(rule: Recurrence, start: date, plant: _Plant) -> Iterator[date]:
    """The dates of a rule for the next years; a rule that counts its dates is followed from its beginning."""
    plant.check()
    horizon = date(plant.today.year + YEARS_AHEAD, 12, 31)
    until = horizon if rule.until is None else min(horizon, rule.until.date())
    first = start if rule.count else max(start, date(plant.today.year - 1, 1, 1))
    yield from islice(dates(rule, start, first, until), rule.count)


def _rule(value: str) -> Recurrence:
    parts = [part for part in value.strip().upper().split(";") if not part.startswith("WKST=")]      # no meaning by date
    rule = Recurrence.parse(";".join(parts))
    if rule.frequency is not Frequency.YEARLY:
        raise ValueError("a rule of every week or month is no exception")
    return rule


def _has_times(event: Event, plant: _Plant) -> bool:
    """Whether it is an appointment. From midnight to midnight, as some programs write whole days, it is none."""
    if not isinstance(event.start, datetime):
        return False
    start, end = plant.local(event.start), plant.local(event.end)
    return not (start.time() == end.time() == MIDNIGHT and start < end)


def _span(event: Event, plant: _Plant) -> tuple[date, date]:
    """First and last day; an event's end itself is not included any more (RFC 5545, section 3.6.1)."""
    start, end = plant.local(event.start), plant.local(event.end)
    last = end.date() - timedelta(days=1) if end.time() == MIDNIGHT else end.date()
    return start.date(), max(last, start.date())
