"""Checks of single values (docs/interfaces.md has the ranges). Each returns the value in its normal form or raises
InvalidInput, which names the field and says in one sentence how to correct it."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import date, datetime, time
from functools import lru_cache
from typing import Any
from zoneinfo import ZoneInfo

from app.domain import names
from app.domain.clock import zone_names
from app.domain.models import WEEKDAYS, Between, InvalidInput
from app.i18n import languages
from app.mir.address import Address
from app.mir.credentials import normalise_fingerprint
from app.mir.parameters import MOST_PARAMETERS
from app.services.planning.recurrence import Recurrence

Check = Callable[[Any, str], Any]  # of a value and the field it is of
YEARS = range(1970, 2200)
LONGEST_PARAMETER = 1000  # characters of a value
LARGEST_NUMBER = 2**63 - 1
LONGEST_RECURRENCE = 500  # characters; all months, days, hours and minutes together have fewer
_GUID = re.compile(r"[0-9A-Za-z_-]{1,64}", re.ASCII)
_UNPRINTABLE = ("Cc", "Cs", "Zl", "Zp")  # control characters, halves of characters, line ends


def shown(value: object) -> str:
    """The rejected value, short enough for a sentence."""
    text = repr(value)
    return text if len(text) <= 60 else text[:60] + "…"


def optional(check: Check) -> Check:
    """The same check, which lets None pass."""
    return lambda value, field: None if value is None else check(value, field)


@dataclass(frozen=True)
class Number:
    """A whole number from ``low`` to ``high``."""

    low: int
    high: int

    def __call__(self, value: object, field: str) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not self.low <= value <= self.high:
            raise InvalidInput(field, "enter a whole number from {low} to {high}", low=self.low, high=self.high)
        return value


def choice(*values: Any) -> Check:
    """One of these."""

    def check(value: object, field: str) -> Any:
        if isinstance(value, str | int) and not isinstance(value, bool) and value in values:
            return values[values.index(value)]
        raise InvalidInput(field, "enter {choices}", choices=" or ".join(map(str, values)))

    return check


def language(value: object, field: str) -> Any:
    return choice(*languages())(value, field)


def text(value: object, field: str) -> str:
    if not isinstance(value, str):
        raise InvalidInput(field, "a text is needed here")
    return value


def flag(value: object, field: str) -> bool:
    if not isinstance(value, bool):
        raise InvalidInput(field, "enter true or false")
    return value


def name(value: object, field: str = "name") -> str:
    """1 to 80 characters that can be seen, in composed form; blanks around it don't count."""
    if not isinstance(value, str):
        raise InvalidInput(field, "a name has to be a text")
    normal = names.normal(value)
    if not normal:
        raise InvalidInput(field, "enter a name")
    if len(normal) > names.LONGEST:
        raise InvalidInput(
            field, "a name has at most {most} characters, this one has {length}", most=names.LONGEST, length=len(normal)
        )
    if _has_control_characters(normal):
        raise InvalidInput(field, "a name can't contain control characters")
    if (unwanted := names.unwanted(normal)) and names.is_mark(unwanted):
        raise InvalidInput(field, "a name can't have more than {most} marks on one letter", most=names.MOST_MARKS)
    if unwanted:
        raise InvalidInput(
            field,
            "a name can't contain an invisible or unknown character: remove {character}",
            character=f"U+{ord(unwanted):04X}",
        )
    if not names.has_visible(normal):
        raise InvalidInput(field, "enter a name")
    return normal


def name_or_empty(value: object, field: str) -> str:
    return name(value, field) if value else ""


def name_list(value: object, field: str) -> tuple[str, ...]:
    """Each once."""
    if not isinstance(value, list):
        raise InvalidInput(field, "a list of names is needed here")
    found = tuple(name(each, field) for each in value)
    if len(set(found)) < len(found):
        raise InvalidInput(field, "a name appears twice")
    return found


def _has_control_characters(text: str) -> bool:
    return any(unicodedata.category(character) in _UNPRINTABLE for character in text)


# ---------------------------------------------------------------------- settings
def battery(value: object, field: str) -> float | None:
    """Percent; None inherits or, as a setting, means none."""
    if value is None:
        return None
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not math.isfinite(value)
        or not 0 <= value <= 100
    ):
        raise InvalidInput(field, "enter a battery percentage from 0 to 100")
    return float(value)


def timezone(value: object, field: str = "timezone") -> str:
    """An IANA name that this system knows."""
    if not isinstance(value, str) or not is_zone(value):
        raise InvalidInput(field, "{zone} is no time zone: use an IANA name such as Europe/Helsinki", zone=shown(value))
    return value


@lru_cache(maxsize=1024)
def is_zone(value: str) -> bool:
    """Whether it is the IANA name of a time zone that can be used here."""
    try:
        return value in zone_names() and bool(ZoneInfo(value))
    except (ValueError, OSError):
        return False


def working_days(value: object, field: str) -> tuple[str, ...]:
    """In the order of the week; None means every day."""
    if value is None:
        return WEEKDAYS
    if not isinstance(value, list | tuple) or any(day not in WEEKDAYS for day in value):
        raise InvalidInput(field, "list working days such as {example}", example=", ".join(WEEKDAYS))
    if not value:
        raise InvalidInput(field, "choose at least one working day, or all seven for every day")
    if len(set(value)) < len(value):
        raise InvalidInput(field, "a working day appears twice")
    return tuple(day for day in WEEKDAYS if day in value)


def day(value: object, field: str) -> date:
    if not isinstance(value, date) or value.year not in YEARS:
        raise InvalidInput(field, "enter a year from {first} to {last}", first=YEARS[0], last=YEARS[-1])
    return value


def _as_written(pattern: str, parse: Callable[[str], Any], msgid: str) -> Check:
    """Of a text as files write it; ``msgid`` says how, and has the ``value`` that was written."""

    def check(value: object, field: str) -> Any:
        if not isinstance(value, str) or not re.fullmatch(pattern, value, re.ASCII):
            raise InvalidInput(field, msgid, value=shown(value))
        try:
            return parse(value)
        except ValueError:
            raise InvalidInput(field, "there is no such date or time: {value}", value=value) from None

    return check


day_text = _as_written(r"\d{4}-\d\d-\d\d", date.fromisoformat, "write a date such as 2026-12-24, not {value}")


# ---------------------------------------------------------------------- robots and missions
def address(value: str, field: str) -> str:
    return Address.parse(value).url


def username(value: object, field: str) -> str:
    """May be empty: then the robot needs a password before it can be used."""
    if not isinstance(value, str):
        raise InvalidInput(field, "a user name has to be a text")
    if ":" in value:
        raise InvalidInput(field, "a user name can't contain a colon")
    return name(value, field) if value.strip() else ""


def password(value: object, field: str) -> str:
    if not (entered := text(value, field)):
        raise InvalidInput(field, "a password can't be empty: leave it out to keep the present one")
    return entered


def fingerprint(value: str | None, field: str) -> str | None:
    """Of a certificate. None or empty: none is pinned."""
    return normalise_fingerprint(value) if value else None


def fingerprint_text(value: object, field: str) -> str:
    return normalise_fingerprint(text(value, field))


def guid(value: object, field: str) -> str:
    if not isinstance(value, str) or not _GUID.fullmatch(value.strip()):
        raise InvalidInput(
            field, "a mission's guid has letters, digits and hyphens only, such as 3d7c7c40-ce85-11ef-904a-000e8e9884eb"
        )
    return value.strip()


def vehicle(value: object, field: str) -> str:
    """A robot's id at its fleet; empty for one that is reached directly."""
    if value == "" or (isinstance(value, str) and _GUID.fullmatch(value)):
        return value
    raise InvalidInput(field, "a robot's id at its fleet has letters, digits and hyphens only, such as 7 or any")


# ---------------------------------------------------------------------- schedules
def start(value: datetime, field: str) -> datetime:
    if value.tzinfo is not None or value.second or value.microsecond:
        raise InvalidInput(field, "a start is wall-clock time in whole minutes, without a zone")
    if value.year not in YEARS:
        raise InvalidInput(field, "enter a year from {first} to {last}", first=YEARS[0], last=YEARS[-1])
    return value.replace(fold=0)


start_text = _as_written(
    r"\d{4}-\d\d-\d\dT\d\d:\d\d(:00)?",
    datetime.fromisoformat,
    "write local time in whole minutes without a zone, such as 2026-11-23T06:30, not {value}",
)


def recurrence(value: str, field: str) -> str:
    """An RRULE that the app can take, in capitals."""
    if len(value) > LONGEST_RECURRENCE:
        raise InvalidInput(field, "a recurrence has at most {most} characters", most=LONGEST_RECURRENCE)
    Recurrence.parse(value)
    return value.strip().upper()


def between(value: Between, field: str) -> Between:
    for moment in (value.start, value.end):
        if moment.tzinfo is not None or moment.second or moment.microsecond:
            raise InvalidInput(field, "times of day are in whole minutes")
    if value.start > value.end:
        raise InvalidInput(
            field,
            "the part of the day has to end after it begins: over midnight make two schedules, one until 23:59 and one from 00:00",
        )
    return value


time_of_day = _as_written(
    r"([01]\d|2[0-3]):[0-5]\d", time.fromisoformat, "write a time of day such as 08:30, not {value}"
)


def parameters(value: object, field: str = "parameters") -> dict[str, Any]:
    """A mission's inputs by name: texts, numbers, true, false or null. The names are the robot's and are sent back
    unchanged. Each run keeps a copy of them."""
    if not isinstance(value, Mapping):
        raise InvalidInput(field, "parameters are names with a value each")
    if len(value) > MOST_PARAMETERS:
        raise InvalidInput(field, "a mission can be given {most} parameters at most", most=MOST_PARAMETERS)
    for key, item in value.items():
        if not isinstance(key, str) or not 0 < len(key.strip()) <= names.LONGEST or _has_control_characters(key):
            raise InvalidInput(
                field,
                "the name of a parameter has 1 to {most} characters, without control characters",
                most=names.LONGEST,
            )
        is_plain = (
            item is None or isinstance(item, str | bool | int) or (isinstance(item, float) and math.isfinite(item))
        )
        if not is_plain or (isinstance(item, str) and not _is_encodable(item)):
            raise InvalidInput(
                field, "the value of {name} has to be a text, a number, true, false or null", name=shown(key)
            )
        if isinstance(item, str) and len(item) > LONGEST_PARAMETER:
            raise InvalidInput(
                field, "the value of {name} has at most {most} characters", name=shown(key), most=LONGEST_PARAMETER
            )
        if isinstance(item, int) and abs(item) > LARGEST_NUMBER:
            raise InvalidInput(field, "the value of {name} is too large a number", name=shown(key))
    return dict(value)


def _is_encodable(text: str) -> bool:
    return not any(unicodedata.category(character) == "Cs" for character in text)
