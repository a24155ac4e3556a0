"""The times of day of a sub-daily rule, in seconds after midnight, computed for a whole day at once."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator
from datetime import UTC, date, datetime, time, timedelta
from functools import lru_cache
from math import gcd
from typing import NamedTuple
from zoneinfo import ZoneInfo

from app.domain.clock import DAY
from app.services.planning.recurrence.rule import Frequency, Recurrence

SECOND = timedelta(seconds=1)
HOUR_S, DAY_S = 3600, 86400
BEGINNING = datetime.min.replace(tzinfo=UTC)


class Stretch(NamedTuple):
    """A part of a local day in which the clock isn't changed."""

    offset: int  # seconds ahead of UTC
    low: int  # its first second after midnight
    high: int  # the first one after it


def seconds_of(instant: datetime) -> int:
    """On a scale, in UTC, on which midnights are ordinals of dates times ``DAY_S``."""
    return (instant - BEGINNING) // SECOND + DAY_S


def stretches(zone_name: str, day: date) -> tuple[Stretch, ...]:
    """The parts of a local day, in order: one, or two around a clock change."""
    offset = _offset_in_month(zone_name, day.year, day.month)
    return _around_change(zone_name, day) if offset is None else (Stretch(offset, 0, DAY_S),)


@lru_cache(maxsize=4096)
def _offset_in_month(zone_name: str, year: int, month: int) -> int | None:
    """Seconds ahead of UTC; None if the clock changes in this month or close to its ends. Changes are weeks apart."""
    zone, middle = ZoneInfo(zone_name), datetime.combine(date(year, month, 15), time(12))
    offsets = {_offset(middle + days * DAY, zone) for days in (-16, -8, 0, 8, 18)}
    return offsets.pop() if len(offsets) == 1 else None


def _offset(local: datetime, zone: ZoneInfo) -> int:
    return (local.replace(tzinfo=zone).utcoffset() or timedelta()) // SECOND


@lru_cache(maxsize=4096)
def _around_change(zone_name: str, day: date) -> tuple[Stretch, ...]:
    zone, midnight = ZoneInfo(zone_name), datetime.combine(day, time())
    ends = [_offset(moment.replace(fold=fold), zone) for moment in (midnight, midnight + DAY) for fold in (0, 1)]
    before, after = ends[0], ends[-1]
    if ends.count(before) == len(ends):
        return (Stretch(before, 0, DAY_S),)
    low, in_utc = -max(before, after), midnight.replace(tzinfo=UTC)
    seconds = range(low, DAY_S - min(before, after))  # after midnight by UTC: one of these is the change
    change = low + bisect_left(
        seconds, True, key=lambda second: _offset((in_utc + second * SECOND).astimezone(zone), zone) == after
    )
    parts = Stretch(before, 0, min(DAY_S, change + before)), Stretch(after, max(0, change + after), DAY_S)
    return tuple(part for part in parts if part.low < part.high)


def step_of(rule: Recurrence) -> int:
    """In seconds."""
    return rule.interval * (60 if rule.frequency is Frequency.MINUTELY else HOUR_S)


def times(rule: Recurrence, origin: int, low: int, high: int) -> Iterator[int]:
    """Times in [low, high) at whole steps from ``origin``, in order."""
    if rule.minutes:
        yield from _by_minute(rule, origin, low, high)
        return
    step = step_of(rule)
    for begin, end in [(hour * HOUR_S, (hour + 1) * HOUR_S) for hour in rule.hours] or [(0, DAY_S)]:
        begin = max(begin, low)
        yield from range(begin + (origin - begin) % step, min(end, high), step)


@lru_cache(maxsize=4096)
def number_of_times(rule: Recurrence, origin: int, low: int, high: int) -> int:
    return sum(1 for _ in times(rule, origin, low, high))


def _by_minute(rule: Recurrence, origin: int, low: int, high: int) -> Iterator[int]:
    """With BYMINUTE: a selection of the steps, or for an hourly rule each of these minutes in an hour with a step."""
    step, is_hourly = step_of(rule), rule.frequency is Frequency.HOURLY
    if is_hourly:
        origin -= origin % HOUR_S
    seconds = [minute * 60 + origin % 60 for minute in rule.minutes]
    if not is_hourly:
        seconds = [
            second for second in seconds if (second - origin) % gcd(step, HOUR_S) == 0
        ]  # the others never meet a step
    for hour in range(max(0, low) // HOUR_S, -(-high // HOUR_S)) if seconds else ():
        begin = hour * HOUR_S
        if (rule.hours and hour not in rule.hours) or (is_hourly and (begin - origin) % step):
            continue
        for second in seconds:
            if low <= begin + second < high and (is_hourly or (begin + second - origin) % step == 0):
                yield begin + second


def days_of(rule: Recurrence, origin: int) -> Callable[[int], bool]:
    """Whether there are times of a rule without a daily part on a day, given its ordinal. ``origin`` is counted from ordinal 0."""
    step, hours = step_of(rule), rule.hours or tuple(range(24))
    minutes = () if rule.frequency is Frequency.HOURLY else rule.minutes or tuple(range(60))
    if rule.frequency is Frequency.HOURLY and rule.minutes:
        origin -= origin % HOUR_S
    if step < DAY_S:
        known = _cycle(step, hours, minutes, origin % step, origin % 60)
        return lambda ordinal: bool(known[ordinal % len(known)])

    def has_times(ordinal: int) -> bool:
        at = (origin - ordinal * DAY_S) % step
        return at < DAY_S and at // HOUR_S in hours and (not minutes or at // 60 % 60 in minutes)

    return has_times


@lru_cache(maxsize=4096)
def _cycle(step: int, hours: tuple[int, ...], minutes: tuple[int, ...], origin: int, second: int) -> bytes:
    """Of the days until the steps repeat: which have one in these hours and minutes (empty: all)."""
    common = gcd(step, DAY_S)
    found = bytearray(step // common)
    inverse = pow(DAY_S // common, -1, len(found))
    for hour in hours:
        for past in [minute * 60 + second for minute in minutes] or [origin % HOUR_S]:
            days, rest = divmod(origin - hour * HOUR_S - past, common)
            if not rest:
                found[days * inverse % len(found)] = True
    return bytes(found)
