"""The RFC 5545 RRULE values that the app takes, as plain numbers."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, time
from enum import StrEnum
from functools import lru_cache
from types import MappingProxyType

from app.domain.models import WEEKDAYS, InvalidInput

MOST_INTERVAL = 100_000
MOST_COUNT = 1_000_000  # instants have to be counted one by one where the rule is irregular

_UNTIL = re.compile(r"(\d{8})(?:T(\d{6})(Z?))?", re.ASCII)
_NUMBER = re.compile(r"[+-]?\d{1,9}", re.ASCII)
_WEEKDAY = re.compile(rf"([+-]?\d{{1,2}})?({'|'.join(WEEKDAYS)})", re.ASCII)


class Frequency(StrEnum):
    ONCE = "ONCE"
    MINUTELY = "MINUTELY"
    HOURLY = "HOURLY"
    DAILY = "DAILY"
    WEEKLY = "WEEKLY"
    MONTHLY = "MONTHLY"
    YEARLY = "YEARLY"

    @property
    def is_sub_daily(self) -> bool:
        """Every so many minutes or hours."""
        return self in (Frequency.MINUTELY, Frequency.HOURLY)


@dataclass(frozen=True)
class Recurrence:
    """A rule as numbers; empty tuples and None for parts it does not have."""

    frequency: Frequency = Frequency.ONCE
    interval: int = 1
    months: tuple[int, ...] = ()  # BYMONTH
    month_days: tuple[int, ...] = ()  # BYMONTHDAY, negative ones count from the end of the month
    weekdays: tuple[tuple[int, int], ...] = ()  # BYDAY as (n, weekday): n-th, 0 = each; Monday is 0
    hours: tuple[int, ...] = ()
    minutes: tuple[int, ...] = ()
    count: int | None = None
    until: datetime | None = None  # included; naive wall-clock time, or UTC

    @classmethod
    def parse(cls, rule: str | None) -> Recurrence:
        """None means once. Raises InvalidInput with a sentence."""
        return cls() if rule is None else _parse(rule)


def _wrong(msgid: str, **details: object) -> InvalidInput:
    return InvalidInput("recurrence", msgid, **{name: _shortened(value) for name, value in details.items()})


def _shortened(value: object) -> object:
    return value[:60] + "…" if isinstance(value, str) and len(value) > 120 else value


def _numbers(low: int, high: int, negative: bool = False) -> Callable[[str, str], tuple[int, ...]]:
    def read(name: str, text: str) -> tuple[int, ...]:
        found = set()
        for item in text.split(","):
            number = int(item) if _NUMBER.fullmatch(item) else None
            if number is None or not (low <= (abs(number) if negative else number) <= high):
                raise _wrong(
                    "{part} takes {range}, not {value!r}",
                    part=name,
                    value=item,
                    range=f"{low} to {high}" + (f" and -{high} to -{low}" if negative else ""),
                )
            found.add(number)
        return tuple(sorted(found))

    return read


def _number(low: int, high: int) -> Callable[[str, str], int]:
    read_all = _numbers(low, high)

    def read(name: str, text: str) -> int:
        numbers = read_all(name, text)
        if len(numbers) != 1 or "," in text:
            raise _wrong("{part} takes one number", part=name)
        return numbers[0]

    return read


def _frequency(name: str, text: str) -> Frequency:
    try:
        if text == Frequency.ONCE:
            raise ValueError
        return Frequency(text)
    except ValueError:
        raise _wrong(
            "FREQ takes MINUTELY, HOURLY, DAILY, WEEKLY, MONTHLY or YEARLY, not {value!r}", value=text
        ) from None


def _weekdays(name: str, text: str) -> tuple[tuple[int, int], ...]:
    found = set()
    for item in text.split(","):
        match = _WEEKDAY.fullmatch(item)
        if not match or (match[1] and not 1 <= abs(int(match[1])) <= 53):
            raise _wrong(
                "BYDAY takes weekdays such as MO, or 2MO and -1FR with MONTHLY and YEARLY, not {value!r}", value=item
            )
        found.add((int(match[1] or 0), WEEKDAYS.index(match[2])))
    return tuple(sorted(found))


def _until(name: str, text: str) -> datetime:
    """Naive wall-clock time, or UTC where a Z follows it. A bare date means that whole day."""
    match = _UNTIL.fullmatch(text)
    try:
        if not match:
            raise ValueError
        day = date(int(text[:4]), int(text[4:6]), int(text[6:8]))
        moment = time(int(match[2][:2]), int(match[2][2:4]), int(match[2][4:])) if match[2] else time.max
    except ValueError:
        raise _wrong(
            "UNTIL takes a date such as 20261231 or a time such as 20261231T160000, not {value!r}", value=text
        ) from None
    return datetime.combine(day, moment, UTC if match[3] else None)


_PARTS: MappingProxyType[str, tuple[str, Callable[[str, str], object]]] = MappingProxyType(
    {
        "FREQ": ("frequency", _frequency),
        "INTERVAL": ("interval", _number(1, MOST_INTERVAL)),
        "BYDAY": ("weekdays", _weekdays),
        "BYMONTHDAY": ("month_days", _numbers(1, 31, negative=True)),
        "BYMONTH": ("months", _numbers(1, 12)),
        "BYHOUR": ("hours", _numbers(0, 23)),
        "BYMINUTE": ("minutes", _numbers(0, 59)),
        "COUNT": ("count", _number(1, MOST_COUNT)),
        "UNTIL": ("until", _until),
    }
)


@lru_cache(maxsize=4096)
def _parse(rule: str) -> Recurrence:
    text = rule.strip().upper()
    if not text:
        raise _wrong("a recurrence can't be empty: leave it out (null) for once")
    if text.startswith("RRULE"):
        raise _wrong("write the recurrence without RRULE: in front")
    values: dict[str, object] = {}
    for part in text.split(";"):
        name, equals, value = part.partition("=")
        if name not in _PARTS or not equals:
            raise _wrong(
                "{part!r} can't be used in a recurrence: it takes {names}",
                part=name if equals else part,
                names=", ".join(_PARTS),
            )
        field, read = _PARTS[name]
        if field in values:
            raise _wrong("{part} appears twice in the recurrence", part=name)
        values[field] = read(name, value)
    if "frequency" not in values:
        raise _wrong("a recurrence needs FREQ, for example FREQ=DAILY")
    parsed = replace(Recurrence(), **values)  # type: ignore[arg-type]
    _check_together(parsed)
    return parsed


def _check_together(rule: Recurrence) -> None:
    """Combinations that RFC 5545 forbids, though each part is valid alone."""
    if rule.count is not None and rule.until is not None:
        raise _wrong("a recurrence ends by COUNT or by UNTIL, not by both")
    if rule.frequency is Frequency.WEEKLY and rule.month_days:
        raise _wrong("BYMONTHDAY can't be used with FREQ=WEEKLY")
    nth = max((abs(n) for n, _ in rule.weekdays), default=0)
    if nth and rule.frequency not in (Frequency.MONTHLY, Frequency.YEARLY):
        raise _wrong("BYDAY with a number (such as 2MO) needs FREQ=MONTHLY or FREQ=YEARLY")
    if nth > 5 and (rule.frequency is Frequency.MONTHLY or rule.months):
        raise _wrong("a month has no {number}th weekday of a kind", number=nth)
