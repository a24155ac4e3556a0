"""Every instant of a schedule's rule, in UTC, in order, each once.

Rules that name dates (daily and longer) are wall-clock time. A time skipped by a clock change is shifted by the gap
(03:30 becomes 04:30), a repeated one counts the first time: RFC 5545, section 3.3.5, which is ``datetime.combine(day,
time, zone)`` with fold=0. An interval of minutes or hours that divides the day keeps its times of day too: one of more
than an hour is treated like the times of a daily rule; for a shorter one a repeated hour counts twice and a missing one
is skipped. All others step in elapsed time.
"""

from __future__ import annotations

import heapq
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from functools import cached_property, lru_cache
from itertools import groupby, islice
from typing import NamedTuple
from zoneinfo import ZoneInfo

from app.domain.clock import DAY
from app.domain.models import Between, InvalidInput, Schedule
from app.services.planning.recurrence.dates import LAST_DAY, dates
from app.services.planning.recurrence.rule import Recurrence
from app.services.planning.recurrence.times import (
    DAY_S,
    HOUR_S,
    SECOND,
    days_of,
    number_of_times,
    seconds_of,
    step_of,
    stretches,
    times,
)
from app.services.planning.working_days import WorkingCalendar

LONG_AGO = datetime.min.replace(tzinfo=UTC)
LONG_STEP = timedelta(days=100)
LAST_MOMENT = datetime.combine(LAST_DAY, time.max, UTC)
SEARCHED = 10_000  # dates of a rule, one after the other, on which it has no time
# Dates of a rule that are no working days, and the time that they take
CLOSED, LONG_CLOSED = 100, timedelta(days=10 * 365)
MICROSECOND = timedelta(microseconds=1)
COUNTED = 4_000  # dates, at most, on which COUNT of a sub-daily rule is used up: eleven years of days

_Counted = tuple[datetime, int, datetime | None]  # of days in a row: the first instant, how many, the last one


@dataclass(frozen=True, order=True)
class Occurrence:
    """One planned instant."""

    instant: datetime  # UTC
    nominal: datetime  # naive wall-clock time of the rule, in the schedule's zone
    moved: bool = False  # by a clock change: that wall-clock time does not exist on that day


class Passed(NamedTuple):
    """The number of instants in a period, and the last of them (None: none)."""

    number: int
    last: datetime | None


def occurrences(schedule: Schedule, after: datetime, calendar: WorkingCalendar) -> Iterator[Occurrence]:
    """Every occurrence strictly after ``after``, oldest first. Costs the same however long ago the schedule began.

    Recurring schedules that respect working days skip the other days; a one-time one was checked when it was saved. Whether the
    schedule is switched on, paused or changed since plays no part here. Raises InvalidInput for an invalid rule.
    """
    return _rule_of(schedule).after(after, _respected(schedule, calendar))


def passed_occurrences(schedule: Schedule, after: datetime, until: datetime, calendar: WorkingCalendar) -> Passed:
    """Those of ``occurrences`` up to and including ``until``. Whole days are counted without stepping: a year takes about
    1 ms, of 1,440 times of day 30 ms."""
    return _rule_of(schedule).passed(after, until, _respected(schedule, calendar))


def next_occurrence(schedule: Schedule, after: datetime, calendar: WorkingCalendar) -> datetime | None:
    """The first instant strictly after ``after``; None if there are no more."""
    found = next(occurrences(schedule, after, calendar), None)
    return None if found is None else found.instant


def check_has_instants(schedule: Schedule) -> None:
    """Raises InvalidInput if the rule has no instant at all, not even a past one (an impossible date, an UNTIL before
    the start), or if finding the first or the last one would take too long."""
    rule = _rule_of(schedule)
    try:
        first = next(rule.search(LONG_AGO, None), None)
    except _TooRare:
        raise InvalidInput(
            "recurrence",
            "the recurrence is too rare to be searched: no time fits on {days} of its days in a row",
            days=SEARCHED,
        ) from None
    if first is None:
        raise InvalidInput("recurrence", "the recurrence has no start: no date and time fits all its parts")
    count = rule.recurrence.count
    if count and not rule.names_times and _counted_end(rule) is None:
        raise InvalidInput(
            "recurrence",
            "COUNT={count} takes more than {days} of its days to be used up: end the recurrence with UNTIL instead",
            count=count,
            days=COUNTED,
        )


def to_utc(local: datetime, zone: ZoneInfo) -> datetime:
    """The instant of a naive wall-clock time: shifted by the gap, or the first of two."""
    return local.replace(tzinfo=zone, fold=0).astimezone(UTC)


def _rule_of(schedule: Schedule) -> _Rule:
    return _Rule(Recurrence.parse(schedule.recurrence), schedule.start, schedule.timezone, schedule.between)


def _respected(schedule: Schedule, calendar: WorkingCalendar) -> WorkingCalendar | None:
    return calendar if schedule.respect_working_days and schedule.recurrence is not None else None


class _Part(NamedTuple):
    """Of a day with one ``offset``, in seconds ahead of UTC. ``within``: seconds after midnight of any step, of the
    first allowed one, and of the end."""

    day: date
    offset: int
    within: tuple[int, int, int]

    def instant(self, seconds: int) -> datetime:
        return datetime.combine(self.day, time(), UTC) + (seconds - self.offset) * SECOND


class _TooRare(Exception):
    """The search for the next instant was given up."""


@dataclass(frozen=True)
class _Rule:
    """A recurrence with what it is counted from."""

    recurrence: Recurrence
    start: datetime  # naive
    zone_name: str
    between: Between | None

    @property
    def zone(self) -> ZoneInfo:
        return ZoneInfo(self.zone_name)

    def after(self, after: datetime, calendar: WorkingCalendar | None) -> Iterator[Occurrence]:
        """All that can be found."""
        try:
            yield from self.search(after, calendar)
        except _TooRare:
            return

    def search(self, after: datetime, calendar: WorkingCalendar | None) -> Iterator[Occurrence]:
        """Raises _TooRare."""
        until, latest = self._end, after
        walk = self._by_date if self.names_times else self._by_steps
        for occurrence in walk(after, calendar, self._last_day(until)):
            is_within = until is None or (occurrence.instant if until.tzinfo else occurrence.nominal) <= until
            if is_within and occurrence.instant > latest:  # so never two at the same instant either
                latest = occurrence.instant
                yield occurrence
            elif not is_within and until is not None and until.tzinfo:
                return

    @cached_property
    def _end(self) -> datetime | None:
        """By COUNT or UNTIL: naive wall-clock time, or UTC."""
        return _counted_end(self) if self.recurrence.count else self.recurrence.until

    def _last_day(self, until: datetime | None) -> date:
        """By the wall clock; with an end in UTC a day more, as the clock may be set back at midnight."""
        if until is None or until.date() >= LAST_DAY:
            return LAST_DAY
        return min(LAST_DAY, until.astimezone(self.zone).date() + DAY if until.tzinfo else until.date())

    def _at(self, nominal: datetime) -> Occurrence:
        instant = to_utc(nominal, self.zone)
        return Occurrence(instant, nominal, instant.astimezone(self.zone).replace(tzinfo=None, fold=0) != nominal)

    def passed(self, after: datetime, until: datetime, calendar: WorkingCalendar | None) -> Passed:
        """Whole days are counted; what is between and after them is walked."""
        number, last = 0, None
        last_day = min(self._last_day(self._end) - DAY, until.astimezone(self.zone).date()) - DAY
        count = self._count_by_date if self.names_times else self._count_by_steps
        for first, counted, newest in (*count(after, calendar, last_day), (until + MICROSECOND, 0, None)):
            for each in self.after(last or after, calendar):
                if each.instant >= first:
                    break
                number, last = number + 1, each.instant
            number, last = number + counted, newest or last
        return Passed(number, last)

    @cached_property
    def keeps_times(self) -> bool:
        """The steps are at the same times of each day, despite clock changes."""
        return self.between is None and DAY_S % step_of(self.recurrence) == 0

    # ------------------------------------------------------------------ times of days
    @cached_property
    def names_times(self) -> bool:
        """Daily and longer, or so many times a day."""
        return not self.recurrence.frequency.is_sub_daily or (self.keeps_times and step_of(self.recurrence) > HOUR_S)

    @cached_property
    def times_of_day(self) -> tuple[time, ...]:
        if self.recurrence.frequency.is_sub_daily:
            found = times(self.recurrence, _seconds(self.start.time()), 0, DAY_S)
            return tuple(time(second // HOUR_S, second // 60 % 60) for second in found)
        hours, minutes = self.recurrence.hours or (self.start.hour,), self.recurrence.minutes or (self.start.minute,)
        return tuple(time(hour, minute) for hour in hours for minute in minutes)

    def _by_date(self, after: datetime, calendar: WorkingCalendar | None, last_day: date) -> Iterator[Occurrence]:
        """A time shifted by a clock change may come after a later one, so it waits until no earlier one can follow."""
        low, waiting = self._wall_clock_at(after), list[Occurrence]()
        if not self.times_of_day:
            return
        for day in _working(dates(self.recurrence, self.start.date(), low.date(), last_day), calendar):
            moments = self.times_of_day
            for moment in moments[bisect_left(moments, low.time()) :] if day == low.date() else moments:
                occurrence = self._at(datetime.combine(day, moment))
                if occurrence.moved:
                    heapq.heappush(waiting, occurrence)
                    continue
                while waiting and waiting[0] < occurrence:
                    yield heapq.heappop(waiting)
                yield occurrence
        while waiting:
            yield heapq.heappop(waiting)

    def _count_by_date(self, after: datetime, calendar: WorkingCalendar | None, last_day: date) -> Iterator[_Counted]:
        """Of days between clock changes."""
        moments, first = self.times_of_day, self._wall_clock_at(after).date() + 2 * DAY
        days = _working(dates(self.recurrence, self.start.date(), first, last_day), calendar)
        for is_even, group in groupby(days, self._is_even):
            if is_even and moments:
                even = list(group)
                ends = datetime.combine(even[0], moments[0]), datetime.combine(even[-1], moments[-1])
                yield to_utc(ends[0], self.zone), len(even) * len(moments), to_utc(ends[1], self.zone)

    def _is_even(self, day: date) -> bool:
        """The clock is changed neither on this day nor on those next to it."""
        around = (day - DAY, day, day + DAY)
        return len({stretch for each in around for stretch in stretches(self.zone_name, each)}) == 1

    def _wall_clock_at(self, after: datetime) -> datetime:
        """The earliest time of the rule that may be after an instant."""
        if after <= to_utc(self.start, self.zone):
            return self.start
        offsets = [(after + days * DAY).astimezone(self.zone).utcoffset() or timedelta() for days in (-2, 0, 2)]
        return max(self.start, after.replace(tzinfo=None) + min(offsets))

    # ------------------------------------------------------------------ minutes and hours
    @property
    def takes_every_step(self) -> bool:
        return self.between is None and self.recurrence == Recurrence(
            self.recurrence.frequency, self.recurrence.interval, count=self.recurrence.count
        )

    def _by_steps(self, after: datetime, calendar: WorkingCalendar | None, last_day: date) -> Iterator[Occurrence]:
        low, misses, have_times = max(after, to_utc(self.start, self.zone)), 0, dict[int, Callable[[int], bool]]()
        earliest = seconds_of(low)
        for day in _working(self._dates(low, last_day), calendar):
            if (misses := misses + 1) > SEARCHED:
                raise _TooRare
            found = stretches(self.zone_name, day)
            if len(found) == 1:  # else the clock is changed on this day
                if (offset := found[0].offset) not in have_times:
                    have_times[offset] = self._have_times(offset)
                if not have_times[offset](day.toordinal()):
                    continue
            for part in self._parts((day,), earliest):
                for seconds in times(self.recurrence, *part.within):
                    misses = 0
                    nominal = datetime.combine(day, time()) + seconds * SECOND
                    yield Occurrence(nominal.replace(tzinfo=UTC) - part.offset * SECOND, nominal)

    def _dates(self, low: datetime, last_day: date = LAST_DAY) -> Iterator[date]:
        """From the day before an instant on, as the clock may be set back at midnight; with months between steps only about the steps."""
        begin, step = to_utc(self.start, self.zone), step_of(self.recurrence) * SECOND
        is_long = self.between is None and step > LONG_STEP
        near = begin + (low - begin) // step * step if is_long else low
        while (first := near.astimezone(self.zone).date() - DAY) <= last_day:
            yield from dates(self.recurrence, first, first, min(last_day, first + 2 * DAY) if is_long else last_day)
            if not is_long:
                return
            near += step

    def _have_times(self, offset: int) -> Callable[[int], bool]:
        """Whether there are times on a day with this offset, given its ordinal."""
        if self.between is None:
            return days_of(self.recurrence, self._begin_on_clock if self.keeps_times else self._begin + offset)
        begin = _seconds(self.between.start)
        found = any(True for _ in times(self.recurrence, begin, begin, _seconds(self.between.end) + 1))
        return lambda _ordinal: found

    @cached_property
    def _begin(self) -> int:
        return seconds_of(to_utc(self.start, self.zone))

    @cached_property
    def _begin_on_clock(self) -> int:
        return seconds_of(self.start.replace(tzinfo=UTC))

    def _parts(self, days: Iterable[date], earliest: int) -> Iterator[_Part]:
        """Of these days. Steps begin with the rule, or each day with the daily part, including both its ends; none is
        before ``earliest``."""
        between, begin = self.between, self._begin
        for day in days:
            midnight = day.toordinal() * DAY_S
            if between:
                begin = seconds_of(to_utc(datetime.combine(day, between.start), self.zone))
            for offset, first, end in stretches(self.zone_name, day):
                first, origin = max(first, earliest + offset - midnight), begin + offset - midnight
                if self.keeps_times:
                    origin = self._begin_on_clock - midnight
                if between:
                    first, end = max(first, origin, _seconds(between.start)), min(end, _seconds(between.end) + 1)
                yield _Part(day, offset, (origin % step_of(self.recurrence), first, end))

    def _count_by_steps(self, after: datetime, calendar: WorkingCalendar | None, last_day: date) -> Iterator[_Counted]:
        """Of all days at once."""
        days = _working(self._dates(max(after, to_utc(self.start, self.zone)), last_day), calendar)
        parts = self._parts(days, max(seconds_of(after) + 1, self._begin))
        if counted := [(each, n) for each in parts if (n := number_of_times(self.recurrence, *each.within))]:
            newest, _ = counted[-1]
            last = newest.instant(max(times(self.recurrence, *newest.within)))
            yield after, sum(n for _, n in counted), last

    def count_steps(self, count: int) -> datetime | None:
        """The time of that many instants of the rule; None if that takes more than ``COUNTED`` dates."""
        begin = to_utc(self.start, self.zone)
        if self.takes_every_step and not self.keeps_times:
            step = step_of(self.recurrence) * SECOND
            return begin + min(count - 1, (LAST_MOMENT - begin) // step) * step
        days = islice(self._dates(begin), None if self.takes_every_step else COUNTED)
        for part in self._parts(days, self._begin):
            if count <= (number := number_of_times(self.recurrence, *part.within)):
                return part.instant(next(islice(times(self.recurrence, *part.within), count - 1, None)))
            count -= number
        return LAST_MOMENT if self.takes_every_step else None


def _seconds(moment: time) -> int:
    return moment.hour * 3600 + moment.minute * 60


def _working(days: Iterator[date], calendar: WorkingCalendar | None) -> Iterator[date]:
    """Working days only. Ends when for years none of many dates is one."""
    since, misses = None, 0
    for day in days:
        if calendar is None or calendar.is_working_day(day):
            since, misses = None, 0
            yield day
            continue
        since, misses = since or day, misses + 1
        if misses > CLOSED and day - since > LONG_CLOSED:
            return


@lru_cache(maxsize=8192)
def _counted_end(rule: _Rule) -> datetime | None:
    """The end of COUNT, including days off, as an UNTIL; None if that is too far away to matter."""
    count = rule.recurrence.count or 1
    if not rule.names_times:
        return rule.count_steps(count)
    moments, start = rule.times_of_day, rule.start
    if not moments:
        return None
    first = next(dates(rule.recurrence, start.date(), start.date()), None)
    passed = bisect_left(moments, start.time()) if first == start.date() else 0
    number, of_day = divmod(passed + count - 1, len(moments))
    day = next(islice(dates(rule.recurrence, start.date(), start.date()), number, None), None)
    return None if day is None else datetime.combine(day, moments[of_day])
