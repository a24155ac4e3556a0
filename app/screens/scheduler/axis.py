"""The background of the timeline: the hours read, their ticks, closed and held time. Pure; hours as in timeline.py."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import NamedTuple
from zoneinfo import ZoneInfo

from app.database.robots import Hold
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.scheduler.facts import SchedulerFacts
from app.screens.scheduler.view import day_begins

FOLDED_FROM = 6.0  # hours without work and without bars
QUARTERS = 4  # of an hour: clocks are changed at one

Span = tuple[float, float]  # from and to


class Band(NamedTuple):
    """A time when nothing is started: "closed", drawn "folded" if it is long and empty, or "held" by a person."""

    start: float
    end: float
    text: str
    kind: str = "closed"


class Tick(NamedTuple):
    """A line of the axis; a strong one begins a day."""

    hour: float
    label: str
    strong: bool


@dataclass(frozen=True)
class Range:
    """The hours that are read: from ``low`` to ``high``."""

    origin: datetime
    low: float
    high: float

    def at(self, instant: datetime) -> float:
        return (instant - self.origin).total_seconds() / 3600

    def instant(self, hour: float) -> datetime:
        return self.origin + timedelta(hours=hour)


def closed(facts: SchedulerFacts, read: Range, taken: Iterable[Span], unfolded: Iterable[datetime]) -> Iterable[Band]:
    """Days without work. ``taken``: times of bars; between them days off are folded, except around ``unfolded``."""
    zone, days = facts.zone, []  # type: ZoneInfo, list[Band]
    first = read.instant(read.low).astimezone(zone).date()
    for n in range(int((read.high - read.low) / 24) + 3):
        day = first + timedelta(days=n)
        begins, ends = (
            max(read.low, read.at(day_begins(day, zone))),
            min(read.high, read.at(day_begins(day + timedelta(days=1), zone))),
        )
        status = facts.calendar.day_status(day)
        if begins < ends and not status.is_working:
            name = status.name or formats.current().weekdays[day.weekday()]
            days.append(Band(begins, ends, _("{weekday}: day off").format(weekday=name[:1].upper() + name[1:])))
    shown = [read.at(instant) for instant in unfolded]
    folds = [
        Band(start, end, _days_off(read.instant(start).astimezone(zone), read.instant(end).astimezone(zone)), "folded")
        for start, end in _between(joined(day[:2] for day in days), sorted(taken))
        if end - start > FOLDED_FROM and not any(start <= hour < end for hour in shown)
    ]
    yield from folds
    for one in days:
        yield from (
            one._replace(start=start, end=end) for start, end in _between([one[:2]], [fold[:2] for fold in folds])
        )


def joined(spans: Iterable[Span]) -> tuple[Span, ...]:
    """Those that touch as one."""
    found: list[Span] = []
    for start, end in sorted(spans):
        if found and start <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], end)
        else:
            found.append((start, end))
    return tuple(found)


def _between(spans: Iterable[Span], taken: Sequence[Span]) -> Iterable[Span]:
    """What is left of the spans."""
    for at, end in spans:
        for begins, ends in taken:
            if ends > at and begins < end:
                if begins > at:
                    yield at, begins
                at = ends
        if at < end:
            yield at, end


def _days_off(start: datetime, end: datetime) -> str:
    first, last = start.date(), (end - timedelta(seconds=1)).date()
    words = formats.current().weekdays_date
    if last - first < timedelta(days=7):
        days = [words[day.weekday()] for day in sorted({first, last})]
    else:
        days = [formats.wall_day(first), formats.wall_day(last)]
    return ngettext("{days}, day off", "{days}, days off", len(days)).format(days="–".join(days))


def held(facts: SchedulerFacts, now: datetime, read: Range) -> Iterable[Band]:
    """The time in which nothing is sent to any robot."""
    for hold in facts.holds:
        begins = max(read.low, read.at(hold.since)) if hold.since else read.low
        ends = min(read.high, read.at(hold.until)) if hold.until else read.high
        if hold.robot_id is None and begins < ends:
            yield Band(
                begins,
                ends,
                " · ".join(filter(None, (held_until(hold, facts, now), hold.reason and _(hold.reason)))),
                "held",
            )


def held_until(hold: Hold | None, facts: SchedulerFacts, now: datetime) -> str:
    """Empty for no hold."""
    if hold is None or hold.until is None:
        return _("On hold") if hold else ""
    return _("On hold until {time}").format(time=formats.day_or_time(hold.until, facts.settings.timezone, now))


def ticks(zone: ZoneInfo, read: Range, step: int) -> Iterable[Tick]:
    """A tick every ``step`` local hours, strong at midnight, with the year on 1 January; and one at each clock change,
    even of half an hour."""
    begins = int(read.low * QUARTERS) - 1
    before = read.instant(begins / QUARTERS).astimezone(zone).utcoffset()
    for hour in (n / QUARTERS for n in range(begins + 1, int(read.high * QUARTERS) + 1)):
        local = read.instant(hour).astimezone(zone)
        if local.utcoffset() != before:
            before = local.utcoffset()
            yield Tick(hour, _("Clock change"), True)
        elif local.minute:
            continue
        elif local.hour == 0:
            yield Tick(hour, formats.wall_day(local.date(), year=(local.month, local.day) == (1, 1)), True)
        elif step < 24 and local.hour % step == 0:
            yield Tick(hour, formats.wall_time(local), False)
