"""The dates of a rule. Whole months are included or skipped, so that a date decades away is found in few steps."""

from __future__ import annotations

from calendar import isleap, monthrange
from collections.abc import Iterator
from datetime import date
from typing import NamedTuple

from app.domain.clock import DAY
from app.services.planning.recurrence.rule import Frequency, Recurrence

LAST_DAY = date(2199, 12, 31)  # nothing is looked for beyond


def dates(rule: Recurrence, start: date, first: date, last: date = LAST_DAY) -> Iterator[date]:
    """Dates of a rule that began at ``start``, from ``first`` to ``last``; of a sub-daily one those that BYMONTH, BYMONTHDAY and BYDAY
    leave. Costs the same however long ago the start was."""
    last = start if rule.frequency is Frequency.ONCE else last
    for before, days in _months(rule, start, max(first, start), last):
        for day in days:
            yield date.fromordinal(before + day)


def months_of(rule: Recurrence, start: date) -> list[int]:
    """The months (from 1) with days of a monthly or yearly rule."""
    of_month = range(
        start.month - 1, start.month - 1 + 12 * _interval(rule, Frequency.MONTHLY), _interval(rule, Frequency.MONTHLY)
    )
    reached = {month % 12 + 1 for month in of_month}
    return sorted(reached & set(_months_of(rule, start) or reached))


def _months(rule: Recurrence, start: date, first: date, last: date) -> Iterator[tuple[int, list[int]]]:
    """Month by month the days in it, and what to add to them to have ordinals of dates."""
    days_in, every, months = _DaysInMonth(rule, start), _Every.of(rule, start), _months_of(rule, start)
    of_month, of_year = _interval(rule, Frequency.MONTHLY), _interval(rule, Frequency.YEARLY)
    begun, beginning, end = _number(start), _number(first), _number(last)
    number = beginning - 1
    while (number := number + 1) <= end:
        if every.period > 31:
            number = max(number, _number(every.next(date(number // 12, number % 12 + 1, 1))))
        year, month = number // 12, number % 12 + 1
        if (
            (months and month not in months)
            or (number - begun) % of_month
            or (year - start.year) % of_year
            or number > end
        ):
            continue
        before = date(year, month, 1).toordinal() - 1
        days = every.of_these(before, days_in(year, month))
        if number in (beginning, end):
            days = [day for day in days if first.toordinal() <= before + day <= last.toordinal()]
        if days:
            yield before, days


def _number(day: date) -> int:
    """Of its month."""
    return day.year * 12 + day.month - 1


def _interval(rule: Recurrence, frequency: Frequency) -> int:
    return rule.interval if rule.frequency is frequency else 1


def _names_days(rule: Recurrence) -> bool:
    return bool(rule.weekdays or rule.month_days)


def _months_of(rule: Recurrence, start: date) -> tuple[int, ...]:
    """Empty: all. A yearly rule that names neither days nor months is for the day of its start."""
    return rule.months if rule.months or rule.frequency is not Frequency.YEARLY or _names_days(rule) else (start.month,)


class _Every(NamedTuple):
    """The interval of a daily or weekly rule: ``width`` days of each ``period`` that is counted from ``origin``."""

    width: int
    period: int
    origin: int

    @classmethod
    def of(cls, rule: Recurrence, start: date) -> _Every:
        """Weeks are counted from the Monday of the week in which the rule begins."""
        if rule.frequency is Frequency.WEEKLY:
            return cls(7, 7 * rule.interval, start.toordinal() - start.weekday())
        return cls(1, _interval(rule, Frequency.DAILY), start.toordinal())

    def next(self, day: date) -> date:
        """The day itself or the next one of these."""
        ahead = (self.origin - day.toordinal()) % self.period
        return day if self.period - ahead < self.width else day + ahead * DAY

    def of_these(self, before: int, days: list[int]) -> list[int]:
        if self.width == self.period:
            return days
        return [day for day in days if (before + day - self.origin) % self.period < self.width]


class _DaysInMonth:
    """The days of a month that BYMONTHDAY and BYDAY, or the start in their place, leave. Months of one shape have the same."""

    def __init__(self, rule: Recurrence, start: date) -> None:
        self._month_days, self._weekdays = rule.month_days, rule.weekdays
        if rule.frequency is Frequency.WEEKLY:
            self._weekdays = self._weekdays or ((0, start.weekday()),)
        elif rule.frequency in (Frequency.MONTHLY, Frequency.YEARLY) and not _names_days(rule):
            self._month_days = (start.day,)
        self._counts_in_year = (
            rule.frequency is Frequency.YEARLY and not rule.months and any(n for n, _ in rule.weekdays)
        )
        self._known: dict[tuple[int, ...], list[int]] = {}

    def __call__(self, year: int, month: int) -> list[int]:
        weekday, length = monthrange(year, month)
        earlier, whole = 0, length  # BYDAY with a number counts in the month, or in the year
        if self._counts_in_year:
            earlier, whole = date(year, month, 1).timetuple().tm_yday - 1, 365 + isleap(year)
        shape = weekday, length, earlier, whole
        if shape not in self._known:
            self._known[shape] = [
                day
                for day in range(1, length + 1)
                if (not self._month_days or day in self._month_days or day - length - 1 in self._month_days)
                and (not self._weekdays or self._is_named((weekday + day - 1) % 7, earlier + day, whole))
            ]
        return self._known[shape]

    def _is_named(self, weekday: int, day: int, whole: int) -> bool:
        return any(
            weekday == named and n in (0, (day - 1) // 7 + 1, -((whole - day) // 7 + 1)) for n, named in self._weekdays
        )
