"""Every instant of a schedule's rule, in UTC, in order, each once.

Rules that name dates (daily and longer) are wall-clock time. A time that a clock change leaves out is shifted by the gap (03:30 becomes
04:30), one that comes twice is taken the first time: RFC 5545, section 3.3.5, which is ``datetime.combine(day, time, zone)`` with fold=0.
Sub-daily rules step in elapsed time, so a repeated hour runs on and a missing one is skipped.
"""
from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from functools import lru_cache
from itertools import islice
from zoneinfo import ZoneInfo

from app.domain.clock import midnight
from app.domain.models import Between, InvalidInput, Schedule
from app.services.planning.recurrence.dates import DAY, LAST_DAY, dates, fits
from app.services.planning.recurrence.rule import Frequency, Recurrence
from app.services.planning.working_days import WorkingCalendar

MINUTE, HOUR = timedelta(minutes=1), timedelta(hours=1)
NEVER = datetime.min.replace(tzinfo=UTC)
SEARCHED = 100_000                     # steps without a result after which a sub-daily rule is taken to have no (more) instants


@dataclass(frozen=True, order=True)
class Occurrence:
    """One planned instant."""
    instant: datetime                  # UTC
    nominal: datetime                  # naive wall-clock time of the rule, in the schedule's zone
    moved: bool = False                # by a clock change: that wall-clock time does not exist on that day


def occurrences(schedule: Schedule, after: datetime, calendar: WorkingCalendar) -> Iterator[Occurrence]:
    """Every occurrence strictly after ``after``, oldest first. Costs the same however long ago the schedule began.

    Recurring schedules that respect working days skip the other days; a one-time one was checked when it was saved. Whether the
    schedule is switched on, paused or changed since plays no part here. Raises InvalidInput for an invalid rule.
    """
    rule = _rule_of(schedule)
    respects = schedule.respect_working_days and rule.recurrence.frequency is not Frequency.ONCE
    return rule.after(after, calendar if respects else None)


def next_occurrence(schedule: Schedule, after: datetime, calendar: WorkingCalendar) -> datetime | None:
    """The first instant strictly after ``after``; None when there is none left."""
    found = next(occurrences(schedule, after, calendar), None)
    return None if found is None else found.instant


def check_has_instants(schedule: Schedule) -> None:
    """Raises InvalidInput when the rule has no instant at all, past ones included (an impossible date, an UNTIL before the start)."""
    if not _has_instants(_rule_of(schedule)):
        raise InvalidInput("recurrence", "the recurrence has no start: no date and time fits all its parts")


def to_utc(local: datetime, zone: ZoneInfo) -> datetime:
    """The instant of a naive wall-clock time: shifted by the gap, or the first of two."""
    return local.replace(tzinfo=zone, fold=0).astimezone(UTC)


def _rule_of(schedule: Schedule) -> _Rule:
    return _Rule(Recurrence.parse(schedule.recurrence), schedule.start, schedule.timezone, schedule.between)


@dataclass(frozen=True)
class _Rule:
    """A recurrence with what it is counted from."""
    recurrence: Recurrence
    start: datetime                    # naive
    zone_name: str
    between: Between | None

    @property
    def zone(self) -> ZoneInfo:
        return ZoneInfo(self.zone_name)

    def after(self, after: datetime, calendar: WorkingCalendar | None) -> Iterator[Occurrence]:
        until = _counted_end(self) if self.recurrence.count else self.recurrence.until
        latest = after
        for occurrence in self.endless(after, calendar, until):
            is_within = until is None or (occurrence.instant if until.tzinfo else occurrence.nominal) <= until
            if is_within and occurrence.instant > latest:         # so never two at the same instant either
                latest = occurrence.instant
                yield occurrence

    def endless(self, after: datetime, calendar: WorkingCalendar | None, until: datetime | None = None) -> Iterator[Occurrence]:
        """All from about ``after`` on, in order; not much further than ``until``."""
        last_day = LAST_DAY if until is None else min(LAST_DAY, until.date() + DAY if until.date() < LAST_DAY else LAST_DAY)
        if self.recurrence.frequency is Frequency.ONCE:
            return iter((self._at(self.start),))
        if self.recurrence.frequency.is_sub_daily:
            return self._by_steps(after, calendar, last_day)
        return self._by_date(after, calendar, last_day)

    def _at(self, nominal: datetime) -> Occurrence:
        instant = to_utc(nominal, self.zone)
        return Occurrence(instant, nominal, instant.astimezone(self.zone).replace(tzinfo=None, fold=0) != nominal)

    # ------------------------------------------------------------------ daily and longer
    @property
    def times_of_day(self) -> list[time]:
        return [time(hour, minute) for hour in self.recurrence.hours or (self.start.hour,)
                for minute in self.recurrence.minutes or (self.start.minute,)]

    def _by_date(self, after: datetime, calendar: WorkingCalendar | None, last_day: date) -> Iterator[Occurrence]:
        """A shifted time may come after a later one of the same or the next day, so each waits until no earlier one can follow."""
        start, zone, times = self.start, self.zone, self.times_of_day
        first = start.date() if after <= to_utc(start, zone) else after.astimezone(zone).date() - 2 * DAY
        waiting: list[Occurrence] = []
        for day in dates(self.recurrence, start.date(), first, last_day):
            if waiting:
                earliest = midnight(day, self.zone)
                while waiting and waiting[0].instant < earliest:
                    yield heapq.heappop(waiting)
            if calendar is None or calendar.is_working_day(day):
                for moment in times:
                    if (nominal := datetime.combine(day, moment)) >= start:
                        heapq.heappush(waiting, self._at(nominal))
        while waiting:
            yield heapq.heappop(waiting)

    # ------------------------------------------------------------------ minutes and hours
    @property
    def step(self) -> timedelta:
        return self.recurrence.interval * (MINUTE if self.recurrence.frequency is Frequency.MINUTELY else HOUR)

    @property
    def takes_every_step(self) -> bool:
        return self.between is None and self.recurrence == Recurrence(self.recurrence.frequency, self.recurrence.interval,
                                                                      count=self.recurrence.count)

    def _by_steps(self, after: datetime, calendar: WorkingCalendar | None, last_day: date) -> Iterator[Occurrence]:
        """Ends after too many steps without a result."""
        start, in_vain = to_utc(self.start, self.zone), 0
        for occurrence in self._stepped(start, max(after, start), calendar, last_day):
            if occurrence is not None and occurrence.instant >= start:
                in_vain = 0
                yield occurrence
            elif (in_vain := in_vain + 1) > SEARCHED:
                return

    def _stepped(self, start: datetime, after: datetime, calendar: WorkingCalendar | None,
                 last_day: date) -> Iterator[Occurrence | None]:
        """Steps from ``start``, or each day from the beginning of the daily part. None: a step without a result."""
        if self.between is None:
            yield from self._steps(start, after, calendar, last_day)
            return
        zone, day = self.zone, max(self.start.date(), after.astimezone(self.zone).date() - DAY)
        while day <= last_day:
            if self._day_fits(day, calendar):
                yield from self._steps_of_day(day, self.between, after, zone)
            else:
                yield None
            day += DAY

    def _day_fits(self, day: date, calendar: WorkingCalendar | None) -> bool:
        return fits(self.recurrence, day) and (calendar is None or calendar.is_working_day(day))

    def _steps_of_day(self, day: date, between: Between, after: datetime, zone: ZoneInfo) -> Iterator[Occurrence | None]:
        """What lies in the daily part by the wall clock, both ends included; its last moment may come twice."""
        begin, end = to_utc(datetime.combine(day, between.start), zone), datetime.combine(day, between.end, zone)
        last = max(end.astimezone(UTC), end.replace(fold=1).astimezone(UTC))
        number = max(0, (after - begin) // self.step)
        while (instant := begin + number * self.step) <= last + HOUR:      # the last step may include earlier minutes of its hour
            for occurrence in self._within_step(instant, zone):
                is_inside = occurrence is not None and occurrence.instant >= begin and (
                    occurrence.nominal.date() == day and between.start <= occurrence.nominal.time() <= between.end)
                yield occurrence if is_inside else None
            number += 1

    def _steps(self, start: datetime, after: datetime, calendar: WorkingCalendar | None, last_day: date) -> Iterator[Occurrence | None]:
        """Skips over days and hours that don't fit."""
        zone, step, hours = self.zone, self.step, self.recurrence.hours
        number = (after - start) // step
        while (local := (instant := start + number * step).astimezone(zone)).date() <= last_day:
            number += 1
            if not self._day_fits(local.date(), calendar):
                yield None
                number = max(number, -((start - midnight(local.date() + DAY, self.zone)) // step))
            elif hours and local.hour not in hours:
                yield None
                number = max(number, -((start - (instant + HOUR - local.minute * MINUTE)) // step))
            else:
                yield from self._within_step(instant, zone)

    def _within_step(self, instant: datetime, zone: ZoneInfo) -> Iterator[Occurrence | None]:
        """The instants of one step: itself, or with BYMINUTE of an hourly rule each of these minutes of its hour."""
        rule, local = self.recurrence, instant.astimezone(zone)
        if rule.hours and local.hour not in rule.hours:
            yield None
        elif not rule.minutes or (rule.frequency is Frequency.MINUTELY and local.minute in rule.minutes):
            yield Occurrence(instant, local.replace(tzinfo=None, fold=0))
        elif rule.frequency is Frequency.MINUTELY:
            yield None
        else:
            for minute in rule.minutes:
                there = (found := instant + (minute - local.minute) * MINUTE).astimezone(zone)
                yield Occurrence(found, there.replace(tzinfo=None, fold=0)) if there.minute == minute else None


@lru_cache(maxsize=1024)
def _has_instants(rule: _Rule) -> bool:
    return next(rule.after(NEVER, None), None) is not None


@lru_cache(maxsize=1024)
def _counted_end(rule: _Rule) -> datetime | None:
    """Where COUNT is used up, skipped days counted too, in the manner of UNTIL; None when that is beyond the last day."""
    count = rule.recurrence.count or 1
    if not rule.recurrence.frequency.is_sub_daily:
        moments = (datetime.combine(day, moment) for day in dates(rule.recurrence, rule.start.date(), rule.start.date())
                   for moment in rule.times_of_day)
        return next(islice((moment for moment in moments if moment >= rule.start), count - 1, None), None)
    if rule.takes_every_step:
        return to_utc(rule.start, rule.zone) + (count - 1) * rule.step
    last = next(islice(rule.endless(NEVER, None), count - 1, None), None)
    return None if last is None else last.instant
