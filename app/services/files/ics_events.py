"""Events of a calendar file as they are written, and which of their versions counts."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from datetime import date, datetime, time
from typing import TypeVar

from app.services.files.ics import Component, Property
from app.services.files.ics_times import Moment, duration, moment
from app.services.files.ics_zones import Zones

NEVER = datetime.combine(date.min, time())
UNREADABLE = (ValueError, OverflowError)
Read = TypeVar("Read")
Version = tuple[int, datetime, datetime]


@dataclass(eq=False)
class Event:
    """One VEVENT; ``end`` is None where only the start is written."""

    written: Component
    start: Moment
    end: Moment | None
    replaces: Moment | None  # RECURRENCE-ID
    version: Version

    @classmethod
    def read(cls, written: Component) -> Event:
        """Raises one of UNREADABLE for an event without dates."""
        instead = _first(written, "RECURRENCE-ID", moment)
        start, end = _first(written, "DTSTART", moment), _first(written, "DTEND", moment)
        if start is None:
            if instead is None or not written.is_cancelled:
                raise ValueError("has no start")
            start = instead  # a notice may name the day by that alone
        if start.is_far:
            raise ValueError("is too far away")
        if end is None and (lasts := _first(written, "DURATION", lambda found: duration(found.text))) is not None:
            end = replace(start, at=start.at + lasts, is_date=False)
        return cls(written, start, end, instead, _version(written))

    @property
    def is_cancelled(self) -> bool:
        return self.written.is_cancelled

    @property
    def moves_following(self) -> bool:
        found = self.written.first("RECURRENCE-ID")
        return found is not None and found.parameter("RANGE").upper() == "THISANDFUTURE"

    @property
    def is_marked_whole(self) -> bool:
        """As Microsoft's programs mark whole days."""
        return any(
            self.written.text(f"X-MICROSOFT-{name}-ALLDAYEVENT").upper() == "TRUE" for name in ("CDO", "MSNCALENDAR")
        )


def _first(written: Component, name: str, read: Callable[[Property], Read]) -> Read | None:
    """Of the first of these properties that can be read: a text with a raw line end may hold what looks like one. None
    without such a property; raises one of UNREADABLE if none can be read."""
    problem: Exception | None = None
    for found in written.all(name):
        try:
            return read(found)
        except UNREADABLE as error:
            problem = error
    if problem is not None:
        raise problem
    return None


def _version(written: Component) -> Version:
    number = re.match(r"\d{1,9}", written.text("SEQUENCE"))
    return int(number[0]) if number else 0, _stamp(written, "DTSTAMP"), _stamp(written, "LAST-MODIFIED")


def _stamp(written: Component, name: str) -> datetime:
    found = written.first(name)
    try:
        return moment(found).at if found else NEVER
    except UNREADABLE:
        return NEVER


@dataclass
class Series:
    """The newest version of an event, or several equally new copies, and replacements of single days of it."""

    masters: list[Event] = field(default_factory=list)
    instead: list[Event] = field(default_factory=list)


def series_of(events: Iterable[Event], zones: Zones) -> Iterator[Series]:
    """By UID; those without one are on their own."""
    by_uid: dict[object, dict[datetime | None, list[Event]]] = defaultdict(lambda: defaultdict(list))
    for event in events:
        replaces = zones.local(event.replaces, zones.plant) if event.replaces else None
        by_uid[event.written.text("UID") or event][replaces].append(event)
    for versions in by_uid.values():
        series = Series()
        for replaces, found in versions.items():
            newest = max(event.version for event in found)
            counting = [event for event in found if event.version == newest]
            if any(event.is_cancelled for event in counting):
                counting = [event for event in counting if event.is_cancelled]
            (series.masters if replaces is None else series.instead).extend(counting)
        if any(event.is_cancelled for event in series.masters):  # all of it, except what has been planned again since
            cancelled = series.masters[0].version[0]
            series.instead = [event for event in series.instead if event.version[0] > cancelled]
        yield series
