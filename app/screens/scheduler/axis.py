"""What lies behind the bars of the timeline: the hours that are read, their ticks, closed and held time. Pure; hours as in timeline.py."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import NamedTuple
from zoneinfo import ZoneInfo

from app.i18n import _
from app.screens.common import formats
from app.screens.scheduler.facts import SchedulerFacts
from app.screens.scheduler.view import day_begins
from app.services.live.holds import Hold

NEAR_NOW = 0.03                          # of what is seen, around the now-line, where ticks have no label


class Band(NamedTuple):
    """A time when nothing is started: "closed", or "held" by a person."""
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


def closed(facts: SchedulerFacts, read: Range) -> Iterable[Band]:
    zone = facts.zone
    first = read.instant(read.low).astimezone(zone).date()
    for n in range(int((read.high - read.low) / 24) + 3):
        day = first + timedelta(days=n)
        begins, ends = max(read.low, read.at(day_begins(day, zone))), min(read.high, read.at(day_begins(day + timedelta(days=1), zone)))
        status = facts.calendar.day_status(day)
        if begins < ends and not status.is_working:
            name = status.name or formats.current().weekdays[day.weekday()]
            yield Band(begins, ends, _("{weekday}: not a working day").format(weekday=name[:1].upper() + name[1:]))


def held(facts: SchedulerFacts, now: datetime, read: Range) -> Iterable[Band]:
    """As long as nothing is sent to any robot."""
    for hold in facts.holds:
        begins = max(read.low, read.at(hold.since)) if hold.since else read.low
        ends = min(read.high, read.at(hold.until)) if hold.until else read.high
        if hold.robot_id is None and begins < ends:
            yield Band(begins, ends, " · ".join(filter(None, (held_until(hold, facts, now), hold.reason and _(hold.reason)))), "held")


def held_until(hold: Hold | None, facts: SchedulerFacts, now: datetime) -> str:
    """Empty for no hold."""
    if hold is None or hold.until is None:
        return _("Held until released") if hold else ""
    return _("Held until {time}").format(time=formats.day_or_time(hold.until, facts.settings.timezone, now))


def ticks(zone: ZoneInfo, read: Range, now: float, step: int, seen: float) -> Iterable[Tick]:
    """A tick every ``step`` local hours, strong at midnight, and one where the clock is changed."""
    begins = int(read.low) - 1
    before = read.instant(begins).astimezone(zone).utcoffset()
    for n in range(begins + 1, int(read.high) + 1):
        local = read.instant(n).astimezone(zone)
        if local.utcoffset() != before:
            before = local.utcoffset()
            yield Tick(n, _("Clock change"), True)
        elif local.hour == 0:
            yield Tick(n, formats.wall_day(local.date()), True)
        elif step < 24 and local.hour % step == 0:
            yield Tick(n, "" if abs(n - now) < seen * NEAR_NOW else formats.wall_time(local), False)
