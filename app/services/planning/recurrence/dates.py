"""The dates that a rule names, from shortly before where they are wanted: of months and years expanded by dateutil, of days and weeks by
a plain sum, which is many times as quick.

What only limits (BYMONTH of a daily rule, say) is applied here: a rule that never comes would keep dateutil searching to the year 9999.
"""
from __future__ import annotations

from calendar import monthrange
from collections.abc import Iterator
from datetime import date, datetime, time, timedelta

from dateutil.rrule import MONTHLY, YEARLY, rrule
from dateutil.rrule import weekday as weekday_of

from app.services.planning.recurrence.rule import Frequency, Recurrence

LAST_DAY = date(2199, 12, 31)          # nothing is looked for beyond
DAY = timedelta(days=1)


def dates(rule: Recurrence, start: date, first: date, last: date = LAST_DAY) -> Iterator[date]:
    """Dates of a daily or longer rule that began at ``start``, from ``first`` to ``last``. Costs the same however long ago that was."""
    first = max(first, start)
    match rule.frequency:
        case Frequency.DAILY:
            found = _every(rule.interval * DAY, start, first)
            limits = Recurrence(months=rule.months, month_days=rule.month_days, weekdays=rule.weekdays)
        case Frequency.WEEKLY:
            found, limits = _weekly(rule, start, first), Recurrence(months=rule.months)
        case Frequency.MONTHLY:
            found, limits = map(datetime.date, _monthly(rule, start, first)), Recurrence(months=rule.months, month_days=rule.month_days)
        case Frequency.YEARLY:
            found, limits = map(datetime.date, _yearly(rule, start, first)), Recurrence()
        case _:
            raise ValueError(f"{rule.frequency} names no dates")
    for day in found:
        if day > last:
            return
        if day >= first and fits(limits, day):
            yield day


def fits(rule: Recurrence, day: date) -> bool:
    """Whether a date passes BYMONTH, BYMONTHDAY and BYDAY (without numbers)."""
    if rule.months and day.month not in rule.months:
        return False
    if rule.weekdays and (0, day.weekday()) not in rule.weekdays:
        return False
    if rule.month_days:
        from_end = day.day - monthrange(day.year, day.month)[1] - 1
        return day.day in rule.month_days or from_end in rule.month_days
    return True


def _every(step: timedelta, start: date, first: date) -> Iterator[date]:
    """The last one not after ``first``, then all that follow, without end: callers stop long before the last date there is."""
    day = start + (first - start) // step * step
    while True:
        yield day
        day += step


def _weekly(rule: Recurrence, start: date, first: date) -> Iterator[date]:
    """Weeks are counted from the Monday of the week in which the rule begins."""
    weekdays = [day for _, day in rule.weekdays] or [start.weekday()]         # in order
    for monday in _every(7 * rule.interval * DAY, start - start.weekday() * DAY, first):
        yield from (monday + weekday * DAY for weekday in weekdays)


def _monthly(rule: Recurrence, start: date, first: date) -> rrule:
    passed = ((first.year - start.year) * 12 + first.month - start.month) // rule.interval * rule.interval
    year, month = divmod(start.year * 12 + start.month - 1 + passed, 12)
    beginning = _midnight(date(year, month + 1, 1))
    if rule.weekdays:
        return rrule(MONTHLY, interval=rule.interval, dtstart=beginning, byweekday=_weekdays(rule))
    return rrule(MONTHLY, interval=rule.interval, dtstart=beginning, bymonthday=rule.month_days or (start.day,))


def _yearly(rule: Recurrence, start: date, first: date) -> rrule:
    """Without BYDAY and BYMONTHDAY it is the day of ``start``, and without BYMONTH too its month."""
    passed = (first.year - start.year) // rule.interval * rule.interval
    names_days = bool(rule.weekdays or rule.month_days)
    return rrule(YEARLY, interval=rule.interval, dtstart=_midnight(date(start.year + passed, 1, 1)),
                 bymonth=rule.months or (None if names_days else (start.month,)),
                 bymonthday=rule.month_days or (None if names_days else (start.day,)),
                 byweekday=_weekdays(rule) if rule.weekdays else None)


def _weekdays(rule: Recurrence) -> list[weekday_of]:
    return [weekday_of(day, n) if n else weekday_of(day) for n, day in rule.weekdays]


def _midnight(day: date) -> datetime:
    return datetime.combine(day, time())
