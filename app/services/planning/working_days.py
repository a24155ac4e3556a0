"""Working days: the weekly rule of the settings, and the exceptions that take precedence over it.

Exceptions beat the weekly rule: own days, and below them the public holidays of the chosen country. Of two own
exceptions on one day the shorter one counts, then the newer one, so that a working Saturday can be inside closed summer
weeks.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from enum import StrEnum

from app.database.settings import CalendarRepository
from app.domain.clock import days_between
from app.domain.models import WEEKDAYS, DayException, Settings
from app.services.planning import public_holidays


class Ground(StrEnum):
    """What decides whether a day is a working day."""

    WEEK = "week"
    HOLIDAY = "holiday"
    OWN = "own"


@dataclass(frozen=True)
class DayStatus:
    """One day. ``name`` is that of the exception; empty where the weekly rule holds."""

    is_working: bool
    name: str = ""
    ground: Ground = Ground.WEEK
    exception_id: int | None = None


class WorkingCalendar:
    """Answers for any local date whether a schedule that respects working days may run on it, and why not."""

    def __init__(self, settings: Settings, exceptions: Iterable[DayException] = ()) -> None:
        self._weekdays = frozenset(WEEKDAYS.index(name) for name in settings.working_days)
        self._national = (settings.holiday_country, settings.holiday_subdivision)
        self._language = settings.language
        # later ones replace earlier ones
        self.exceptions: Sequence[DayException] = sorted(exceptions, key=lambda e: (e.first_day - e.last_day, e.id))
        self._years: dict[int, dict[date, DayStatus]] = {}

    @property
    def has_exceptions(self) -> bool:
        """Whether there is more than the weekly rule."""
        return bool(self.exceptions) or bool(self._national[0])

    def is_working_day(self, day: date) -> bool:
        found = self._of_year(day.year).get(day)
        return day.weekday() in self._weekdays if found is None else found.is_working

    def working_weekday(self, weekday: int) -> int:
        """This day of the week or, where it is none by the weekly rule, the next working one. Monday is 0."""
        return next(day % 7 for day in range(weekday, weekday + 7) if day % 7 in self._weekdays)

    def next_working_day(self, day: date) -> date | None:
        """The first one after that day; None: none within a year."""
        days = days_between(day + timedelta(days=1), day + timedelta(days=366))
        return next(filter(self.is_working_day, days), None)

    def day_status(self, day: date) -> DayStatus:
        """Whether it is a working day, and the name of the exception that decides it."""
        return self._of_year(day.year).get(day) or DayStatus(day.weekday() in self._weekdays)

    def exceptional(self, first: date, last: date) -> Iterator[tuple[date, DayStatus]]:
        """The days from first to last, both included, that have an exception, in order."""
        for year in range(first.year, last.year + 1):
            yield from ((day, status) for day, status in sorted(self._of_year(year).items()) if first <= day <= last)

    def _of_year(self, year: int) -> dict[date, DayStatus]:
        days = self._years.get(year)
        if days is None:
            days = {
                day: DayStatus(False, name, Ground.HOLIDAY)
                for day, name in public_holidays.of_year(*self._national, year, self._language).items()
            }
            for exception in self.exceptions:
                status = DayStatus(exception.is_working, exception.name, Ground.OWN, exception.id)
                days.update((day, status) for day in days_of(exception, year))
            self._years[year] = days
        return days


def days_of(exception: DayException, year: int) -> Iterator[date]:
    """The days of that year on which it holds, in order."""
    for first, last in spans(exception, year):
        yield from days_between(max(first, date(year, 1, 1)), min(last, date(year, 12, 31)))


def spans(exception: DayException, year: int) -> Iterator[tuple[date, date]]:
    """Its days around that year: for a yearly one also of the previous year, which may extend into it."""
    first, last = exception.first_day, exception.last_day
    if not exception.yearly:
        yield first, last
        return
    for begun in (year - 1, year):
        if begun >= first.year and (start := _in_year(first, begun)) is not None:
            end = _in_year(last, begun + last.year - first.year)
            yield start, end if end is not None else date(begun + last.year - first.year, 2, 28)


def _in_year(day: date, year: int) -> date | None:
    """The same day of another year; None for 29 February in a common year."""
    try:
        return day.replace(year=year)
    except ValueError:
        return None


def working_calendar(c: sqlite3.Connection, settings: Settings) -> WorkingCalendar:
    """The calendar as stored at present."""
    return WorkingCalendar(settings, CalendarRepository().all(c))
