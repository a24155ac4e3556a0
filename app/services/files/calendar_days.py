"""The days that the events of a calendar file (.ics) name.

Whole days are those of the zone in which they are written. Appointments, which have times of day, are listed
separately: work continues on those days, unless a person decides otherwise.
"""

from __future__ import annotations

from bisect import bisect_right
from calendar import isleap
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, time, timedelta, tzinfo
from enum import StrEnum
from zoneinfo import ZoneInfo

from app.domain import names
from app.domain.clock import DAY
from app.domain.models import DayException, InvalidInput
from app.services.catalogue import checks, validation
from app.services.files import ics
from app.services.files.ics_events import UNREADABLE, Event, Series, series_of
from app.services.files.ics_times import MIDNIGHT, Moment, Rule, moment, since_midnight, values
from app.services.files.ics_zones import Zones

YEARS_AHEAD = 10  # of a rule that is more than the same day every year
MOST_DATES = 100_000  # that are looked at, past and excepted ones included
LONGEST_READING_S = 20.0
MINUTE = timedelta(minutes=1)


class LeftOut(StrEnum):
    """Why an event isn't taken."""

    UNREADABLE = "unreadable"  # no date, or one that can't be read
    ENDLESS = "endless"  # repeats without end more often than yearly
    OUT_OF_RANGE = "out_of_range"  # longer than a year, or after 2199


@dataclass(frozen=True)
class FoundDays:
    """The days of one event; ``whole``: it has no times of day."""

    days: tuple[DayException, ...]
    whole: bool

    @property
    def name(self) -> str:
        return self.days[0].name


@dataclass(frozen=True)
class Found:
    """What a file holds, in order of days. ``past`` counts events that were over before this year; ``is_whole``: the file doesn't end in
    the middle."""

    events: Sequence[FoundDays] = ()
    left_out: Mapping[LeftOut, int] = field(default_factory=dict)
    past: int = 0
    is_whole: bool = True


class _Endless(Exception):
    """It repeats without end more often than yearly."""


def read_days(content: bytes, name: str, plant: ZoneInfo, today: date) -> Found:
    """Days off of an .ics file; ``name`` is for events without one, ``plant`` the zone of the plant. Raises ics.NotACalendar and
    ics.TooMuch."""
    budget = ics.Budget(MOST_DATES, LONGEST_READING_S)
    found, is_whole = ics.components(content)
    zones = Zones(plant, date(today.year + YEARS_AHEAD, 12, 31), budget)
    for component in found:
        if component.name == "VTIMEZONE":
            zones.add(component)
    reader = _Reader(zones, name, today, budget)
    events: list[Event] = []
    for component in budget.each(each for each in found if each.name == "VEVENT"):
        try:
            events.append(Event.read(component))
        except UNREADABLE:
            if not component.is_cancelled:
                reader.left_out[LeftOut.UNREADABLE] += 1
    for series in series_of(events, zones):
        reader.read(series)
    return Found(
        sorted(reader.found, key=lambda each: (each.days[0].first_day, each.days[-1].last_day)),
        reader.left_out,
        reader.past,
        is_whole,
    )


# ---------------------------------------------------------------------- the days that they name
def _last_day(end: datetime) -> date:
    """An end itself is not included any more (section 3.6.1)."""
    return (end - DAY).date() if since_midnight(end) <= MINUTE else end.date()


def _is_whole(begins: datetime, ends: datetime) -> bool:
    """From midnight to midnight, or as written by programs without whole days: to 23:59, from 00:01, or without a
    length."""
    if begins == ends:
        return since_midnight(begins) == MIDNIGHT
    return since_midnight(begins) <= MINUTE and _is_edge(ends) and begins.date() <= _last_day(ends)


def _is_edge(at: datetime) -> bool:
    """Whether a whole day begins or ends at this time."""
    return since_midnight(at) <= MINUTE or since_midnight(at) >= DAY - MINUTE


def _edge_of_utc(at: datetime) -> datetime:
    """The midnight, or the last minute of a day, meant by a time of UTC, in an unnamed zone."""
    if at.minute == 59:
        return _edge_of_utc(at + MINUTE - timedelta(seconds=at.second)) - MINUTE
    return datetime.combine((at + DAY / 2 - timedelta(seconds=1)).date(), time())


@dataclass
class _Place:
    """Where an event lies: its first start and its length, in the zone whose dates its whole days are. ``shift`` takes
    the times of whole days that are not at midnight to the nearest one. ``usual``: the zone that the calendar names, or
    the plant's."""

    zones: Zones
    zone: tzinfo
    usual: tzinfo
    begins: datetime
    length: timedelta
    whole: bool
    is_bound: bool  # to a zone, by its start
    shift: timedelta = MIDNIGHT

    @classmethod
    def of(cls, event: Event, zones: Zones) -> _Place:
        start, end = event.start, event.end or event.start
        plant, own, usual = zones.plant, zones.get(start.zone), zones.get(event.written.usual_zone)
        place = cls(zones, plant, usual, start.at, MIDNIGHT, True, bool(start.zone))
        if start.is_date:
            last = _last_day(place._edge(end) or zones.local(end, plant)) if event.end else start.at.date()
            return place._for(start.at.date(), last)
        there = [
            (zone, zones.local(start, zone), zones.local(end, zone))
            for zone in (own, zones.get(end.zone), plant, usual)
        ]
        for zone, begins, ends in ((own, start.at, end.at), *there):
            if _is_whole(begins, ends):
                return replace(place, zone=zone)._for(
                    begins.date(), begins.date() if begins == ends else _last_day(ends)
                )
        if event.is_marked_whole:
            begins, ends = (zones.local(each, own) + DAY / 2 for each in (start, end))
            return replace(place, zone=own, shift=DAY / 2)._for(begins.date(), (ends - DAY).date())
        return replace(place, zone=own, length=zones.local(end, own) - start.at, whole=False)

    def _for(self, first: date, last: date) -> _Place:
        return replace(self, begins=datetime.combine(first, time()), length=max(last - first, MIDNIGHT))

    def _edge(self, moment: Moment) -> datetime | None:
        """The local time if a whole day begins or ends at this moment: as written, in the zone of the event, of the
        plant, or of the calendar, or in UTC; a time of UTC together with dates may mean any zone. None if it is no such
        time."""
        written = [] if moment.zone == "UTC" else [moment.at]
        there = (self.zones.local(moment, zone) for zone in (self.zone, self.zones.plant, self.usual, UTC))
        beside_dates = [_edge_of_utc(moment.at)] if moment.zone == "UTC" and not self.is_bound else []
        return next((at for at in (*written, *there, *beside_dates) if _is_edge(at)), None)

    def at(self, moment: Moment) -> datetime:
        """In the zone of the event, which also applies to times without a zone; for whole days, the date that is
        meant."""
        if not moment.zone and not moment.is_date and not self.whole:
            return moment.at
        if moment.is_date or not moment.zone:
            return datetime.combine(moment.at.date(), self.begins.time())
        if self.whole and (edge := self._edge(moment)):
            return datetime.combine(edge.date(), time())
        if self.whole and not self.is_bound:
            return datetime.combine(moment.at.date(), time())
        return self.zones.local(moment, self.zone) + self.shift

    def last_start(self, until: Moment) -> date:
        """The last date on which a rule with this UNTIL lets it start."""
        if until.is_date or (self.whole and not self.is_bound):
            return self.at(until).date()
        at = self.zones.local(until, self.zone) + self.shift if until.zone else until.at
        return at.date() if self.whole or self.begins.time() <= at.time() else (at - DAY).date()

    def span(self, begins: datetime) -> tuple[date, date]:
        """First and last day at the plant, when it begins then."""
        if self.whole:
            return begins.date(), (begins + self.length).date()
        there = begins.replace(tzinfo=self.zone).astimezone(self.zones.plant).replace(tzinfo=None)
        return there.date(), max(_last_day(there + self.length), there.date())


class _Reader:
    def __init__(self, zones: Zones, name: str, today: date, budget: ics.Budget) -> None:
        self.found: list[FoundDays] = []
        self.left_out, self.past = Counter[LeftOut](), 0
        self._zones, self._name, self._year, self._budget = zones, name, today.year, budget
        self._seen: set[DayException] = set()
        self._whole_days = 0

    def read(self, series: Series) -> None:
        later: dict[Event, set[timedelta]] = {event: {MIDNIGHT} for event in series.instead}  # days after its start
        for event in [*series.masters, *series.instead]:
            if event.is_cancelled:
                continue
            try:
                place = _Place.of(event, self._zones)
                if event.replaces is None:
                    self._take_master(event, place, series.instead, later)
                else:
                    self._take(event, place, (place.begins + days for days in later[event]))
            except _Endless:
                self.left_out[LeftOut.ENDLESS] += 1
            except InvalidInput:
                self.left_out[LeftOut.OUT_OF_RANGE] += 1
            except UNREADABLE:
                self.left_out[LeftOut.UNREADABLE] += 1

    def _take_master(
        self, event: Event, place: _Place, instead: Sequence[Event], later: dict[Event, set[timedelta]]
    ) -> None:
        rules = [_rule(found.value, {place.begins.day, event.start.at.day}) for found in event.written.all("RRULE")]
        without = {place.at(excepted).date() for excepted in self._moments(event, "EXDATE")}
        without.update(*(self._days(event, place, Rule.parse(found.value)) for found in event.written.all("EXRULE")))
        more = [place.at(added) for added in self._moments(event, "RDATE")]
        starts = [*self._starts(event, place, rules), *more]
        if (
            len(rules) == 1
            and not (rules[0].ends or without or more or instead)
            and _is_same_day_each_year(starts, self._last(place))
        ):
            first = next((start for start in starts if start.year in checks.YEARS), starts[0])
            self._add(event, [place.span(first)], place.whole, yearly=True)
            return
        replaced = self._replaced(place, instead)
        following = sorted(day for day, other in replaced.items() if other.moves_following)
        kept = []
        for start in starts:
            day = start.date()
            if day in without or (day in replaced and not replaced[day].moves_following):
                continue
            if number := bisect_right(following, day):
                since = following[number - 1]
                later[replaced[since]].add(day - since)
            else:
                kept.append(start)
        self._take(event, place, kept)

    def _replaced(self, place: _Place, instead: Sequence[Event]) -> dict[date, Event]:
        events = self._budget.each(instead)
        return {place.at(event.replaces).date(): event for event in events if event.replaces is not None}

    def _moments(self, event: Event, name: str) -> Iterator[Moment]:
        """Those that can be read, and are not far away."""
        for found in event.written.all(name):
            for value in self._budget.each(values(found)):
                try:
                    found_at = moment(value)
                except UNREADABLE:
                    continue
                if not found_at.is_far:
                    yield found_at

    def _starts(self, event: Event, place: _Place, rules: Sequence[Rule]) -> Iterator[datetime]:
        if not rules:
            yield place.begins
        for rule in rules:
            for day in self._days(event, place, rule):
                yield datetime.combine(day, place.begins.time())

    def _last(self, place: _Place) -> date:
        """The end of rules, also of those that begin in many years."""
        return max(self._zones.last, date(place.begins.year + YEARS_AHEAD, 12, 31))

    def _days(self, event: Event, place: _Place, rule: Rule) -> Iterator[date]:
        """A rule's days are those of the start's zone. If the start isn't one of them, the program meant days at the
        plant."""
        self._budget.spend()
        first, last = place.begins.date(), self._last(place)
        if rule.until:
            last = min(last, place.last_start(rule.until))
        written = event.start.at.date()
        apart = first - written if rule.parts else MIDNIGHT
        if apart and next(rule.days(written, written), None) != written:
            apart = MIDNIGHT
        for day in self._budget.each(rule.days(first - apart, last - apart)):
            yield day + apart

    def _take(self, event: Event, place: _Place, starts: Iterable[datetime]) -> None:
        """Runs of days are put together from last year on, and so they are the same next year."""
        spans, is_past = [], False
        for start in self._budget.each(starts):
            first, last = place.span(start)
            is_past = is_past or last.year < self._year
            if last.year >= self._year - 1:
                spans.append((first, last))
            if len(spans) > validation.MOST_DAY_EXCEPTIONS and not place.whole:
                raise _Endless
            self._whole_days += place.whole and last.year >= self._year
            if self._whole_days > validation.MOST_DAY_EXCEPTIONS:
                raise ics.TooMuch("has too many days")
        current = [(first, last) for first, last in _runs(spans) if last.year >= self._year]
        self.past += is_past and not current
        self._add(event, current, place.whole)

    def _add(self, event: Event, spans: Sequence[tuple[date, date]], whole: bool, yearly: bool = False) -> None:
        name = names.cleaned(event.written.text("SUMMARY")) or names.cleaned(self._name) or "ics"
        days = [validation.day_exception(DayException(name, first, last, yearly=yearly)) for first, last in spans]
        new = tuple(day for day in days if day not in self._seen)
        self._seen.update(new)
        if new:
            self.found.append(FoundDays(new, whole))


def _rule(text: str, days: Iterable[int]) -> Rule:
    """An end beyond the calendar's last day counts as none. ``days``: of the month, on which it starts, in its zone and
    as written."""
    rule = Rule.parse(text)
    if rule.until and rule.until.at.year >= checks.YEARS.stop:
        rule = replace(rule, until=None)
    if not (rule.ends or rule.is_yearly):
        raise _Endless
    if rule.frequency == "YEARLY" and rule.parts in ({"BYMONTHDAY": (day,)} for day in days):
        return replace(rule, parts={})  # the day of its start, as programs mean it that write no BYMONTH
    return rule


def _is_same_day_each_year(starts: Sequence[datetime], last: date) -> bool:
    """29 February is in leap years only."""
    if not starts:
        return False
    first = starts[0]
    years = (year for year in range(first.year, last.year + 1) if (first.month, first.day) != (2, 29) or isleap(year))
    return [(start.year, start.month, start.day) for start in starts] == [
        (year, first.month, first.day) for year in years
    ]


def _runs(spans: Iterable[tuple[date, date]]) -> Iterator[tuple[date, date]]:
    """In order, with adjacent ones joined up to the longest entry of the calendar."""
    run: tuple[date, date] | None = None
    for first, last in sorted(set(spans)):
        if run and first <= run[1] + DAY and last - run[0] < validation.LONGEST_EXCEPTION:
            run = run[0], max(run[1], last)
        else:
            if run:
                yield run
            run = first, last
    if run:
        yield run
