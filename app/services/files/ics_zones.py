"""The time zones that events of a calendar file are written in: known by their name, or by the rules that the file brings along."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta, tzinfo
from functools import cache
from itertools import islice
from typing import NamedTuple
from zoneinfo import ZoneInfo

from app.domain.clock import zone_names
from app.services.catalogue import checks
from app.services.files.ics import Budget, Component
from app.services.files.ics_times import Moment, Rule, moment, offset, values

MOST_CHANGES = 3_000  # of one zone: real ones have changed some hundred times
FIRST = datetime.combine(date(1970, 1, 1), time())  # where a part says none
SECOND = timedelta(seconds=1)
SELDOM = ("YEARLY", "MONTHLY")  # how often a zone may change


class Change(NamedTuple):
    """Of the offset from UTC, at a local time that is counted as before it."""

    at: datetime
    before: timedelta
    after: timedelta


class FileZone(tzinfo):
    """A zone by the changes that a file lists."""

    def __init__(self, changes: Iterable[Change]) -> None:
        self._changes = sorted(changes)
        self._local = [change.at for change in self._changes]
        self._in_utc = [change.at - change.before for change in self._changes]

    def _offset(self, of_changes: list[datetime], at: datetime) -> timedelta:
        number = bisect_right(of_changes, at.replace(tzinfo=None))
        return self._changes[number - 1].after if number else self._changes[0].before

    def utcoffset(self, at: datetime | None, /) -> timedelta | None:
        return None if at is None else self._offset(self._local, at)

    def dst(self, _at: datetime | None, /) -> None:
        """Not known."""

    def tzname(self, _at: datetime | None, /) -> None:
        """Not known."""

    def fromutc(self, at: datetime, /) -> datetime:
        return at + self._offset(self._in_utc, at)


@dataclass
class Zones:
    """By TZID. One that is unknown and can't be used is taken as that of the plant."""

    plant: ZoneInfo
    last: date  # until when rules are followed
    budget: Budget

    def __post_init__(self) -> None:
        self._in_file: dict[str, Component] = {}  # by its name as ``_plain`` makes it
        self._known: dict[str, tzinfo] = {"": self.plant, "UTC": UTC}

    def add(self, zone: Component) -> None:
        """One that the file defines. Of several with one name the first that has parts counts."""
        name = _plain(zone.text("TZID"))
        if name not in self._in_file or not self._in_file[name].parts:
            self._in_file[name] = zone

    def get(self, name: str) -> tzinfo:
        if name not in self._known:
            self._known[name] = self._find(name) or self.plant
        return self._known[name]

    def local(self, moment: Moment, zone: tzinfo) -> datetime:
        """Naive time in a zone; a date is its local midnight. The first instant of a date is its midnight too, where a
        change of the clocks skips that."""
        if moment.is_date:
            return moment.at
        at = moment.at.replace(tzinfo=self.get(moment.zone))
        local, before = (each.astimezone(zone).replace(tzinfo=None) for each in (at, at.astimezone(UTC) - SECOND))
        return local if local.date() == before.date() else datetime.combine(local.date(), time())

    def _find(self, name: str) -> tzinfo | None:
        """The file's own rules count for a name that is only its own, or short for several zones ("EST", "GMT")."""
        defined = self._in_file.get(_plain(name))
        if defined is None or _is_whole_name(name):
            return named(name)
        return named(defined.text("X-LIC-LOCATION")) or self._by_rules(defined) or named(name)

    def _by_rules(self, zone: Component) -> tzinfo | None:
        """By the parts that can be read."""
        changes: set[Change] = set()
        for part in zone.parts:
            with suppress(ValueError, OverflowError):
                changes.update([*self.budget.each(islice(self._changes(part), MOST_CHANGES + 1))])
        return FileZone(changes) if 0 < len(changes) <= MOST_CHANGES else None

    def _changes(self, part: Component) -> Iterator[Change]:
        starts, to = part.first("DTSTART"), offset(part.text("TZOFFSETTO"))
        before = part.text("TZOFFSETFROM")
        start, of = moment(starts).at if starts else FIRST, offset(before) if before else to
        yield Change(start, of, to)
        for found in part.all("RDATE"):
            for each in values(found):
                yield Change(moment(each).at, of, to)
        for found in part.all("RRULE"):
            self.budget.spend()
            rule = Rule.parse(found.value)
            if rule.frequency not in SELDOM:
                raise ValueError("changes too often")
            # UNTIL is in UTC, where the last change may be on the day before
            last = min(self.last, rule.until.at.date() + timedelta(days=1)) if rule.until else self.last
            for day in rule.days(start.date(), last):
                yield Change(datetime.combine(day, start.time()), of, to)


def named(name: str) -> tzinfo | None:
    """By a name as programs write them, in capitals or not: "Europe/Helsinki", "/mozilla.org/20050126_1/Europe/Helsinki", "FLE Standard
    Time"."""
    parts = _plain(name).strip("/").split("/")
    if parts[-1] in ("utc", "gmt", "z"):
        return UTC
    for tried in ["/".join(parts[-number:]) for number in (3, 2, 1)]:
        if checks.is_zone(known := _names().get(tried, "")):
            return ZoneInfo(known)
    return None


def _plain(name: str) -> str:
    """Of a zone, to compare: without escapes, quotes and the difference of capitals."""
    return re.sub(r"\\(.)", r"\1", name).strip(" \t\"'").casefold()


def _is_whole_name(name: str) -> bool:
    """Whether it is the name of one zone for everybody: "Europe/Helsinki", "FLE Standard Time", "UTC"."""
    return _plain(name) in ("utc", "z") or (("/" in name or " " in name) and _plain(name) in _names())


@cache
def _names() -> dict[str, str]:
    """IANA names by these and by Windows' names, all as ``_plain`` makes them."""
    from icalendar.timezone.windows_to_olson import WINDOWS_TO_OLSON  # half a second, which only imports need

    return {
        _plain(name): known for name, known in (*WINDOWS_TO_OLSON.items(), *((name, name) for name in zone_names()))
    }
