"""Validation of robots, missions, schedules and settings (docs/interfaces.md has the ranges). Each check returns the value in its normal
form or raises InvalidInput, which names the field and says in one sentence how to mend it."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import date, datetime, timedelta
from functools import lru_cache
from types import MappingProxyType
from typing import Any, TypeVar
from zoneinfo import ZoneInfo

from app.domain import names
from app.domain.clock import zone_names
from app.domain.message import message
from app.domain.models import (
    FONT_SCALES,
    KEYBOARDS,
    THEMES,
    WEEKDAYS,
    Between,
    DayException,
    Group,
    HandOver,
    InvalidInput,
    Overlap,
    Place,
    Robot,
    Schedule,
    Settings,
)
from app.i18n import languages
from app.mir.address import Address, machine
from app.mir.credentials import normalise_fingerprint
from app.mir.parameters import MOST_PARAMETERS
from app.services.planning.recurrence import Recurrence, check_has_instants
from app.services.planning.working_days import WorkingCalendar

T = TypeVar("T")
YEARS = range(1970, 2200)
LONGEST_EXCEPTION = timedelta(days=366)
MOST_DAY_EXCEPTIONS = 2000
LONGEST_PARAMETER = 1000  # characters of a value
LARGEST_NUMBER = 2**63 - 1
FEWEST_TO_KEEP_FREE = (
    4  # robots of a group; with fewer, everything else waits too long (tests/benchmarks/bench_allocation.py)
)
LONGEST_RECURRENCE = 500  # characters; all months, days, hours and minutes together have fewer
WHOLE_NUMBERS: Mapping[str, tuple[int, int]] = MappingProxyType(
    {
        "poll_interval_seconds": (1, 3600),
        "retry_limit": (0, 20),
        "start_window_minutes": (0, 1440),
        "unknown_outcome_quiet_seconds": (5, 600),
        "history_limit": (1, 2**63 - 1),
        "after_minutes": (5, 30),
        "priority": (-(2**31), 2**31 - 1),
        "usual_minutes": (1, 1440),
        "finish_by_minutes": (1, 1440),
        "keep_free": (0, 99),
        "most": (1, 999),
    }
)
_GUID = re.compile(r"[0-9A-Za-z_-]{1,64}", re.ASCII)
_UNPRINTABLE = ("Cc", "Cs", "Zl", "Zp")  # control characters, halves of characters, line ends


def shown(value: object) -> str:
    """The rejected value, short enough for a sentence."""
    text = repr(value)
    return text if len(text) <= 60 else text[:60] + "…"


def name(text: object, field: str = "name") -> str:
    """1 to 80 characters that can be seen, in composed form; blanks around it don't count."""
    if not isinstance(text, str):
        raise InvalidInput(field, "a name has to be a text")
    normal = names.normal(text)
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


def _has_control_characters(text: str) -> bool:
    return any(unicodedata.category(character) in _UNPRINTABLE for character in text)


def whole_number(value: object, field: str, range_of: str | None = None) -> int:
    """Inside the range of ``range_of`` (default: of the field itself)."""
    low, high = WHOLE_NUMBERS[range_of or field]
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise InvalidInput(field, "enter a whole number from {low} to {high}", low=low, high=high)
    return value


def battery(value: object, field: str = "minimum_battery_percent") -> float | None:
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


def flag(value: object, field: str) -> bool:
    if not isinstance(value, bool):
        raise InvalidInput(field, "enter true or false")
    return value


def one_of(choices: Sequence[T], value: object, field: str) -> T:
    for choice in choices:
        if choice == value and type(choice) is type(value):
            return choice
    raise InvalidInput(field, "enter {choices}", choices=" or ".join(map(str, choices)))


def timezone(value: object, field: str = "timezone") -> str:
    """An IANA name that this system knows."""
    if not isinstance(value, str) or not is_zone(value):
        raise InvalidInput(field, "{zone} is no time zone; use an IANA name such as Europe/Helsinki", zone=shown(value))
    return value


@lru_cache(maxsize=1024)
def is_zone(value: str) -> bool:
    """Whether it is the IANA name of a time zone that can be used here."""
    try:
        return value in zone_names() and bool(ZoneInfo(value))
    except (ValueError, OSError):
        return False


def working_days(value: object, field: str = "working_days") -> tuple[str, ...]:
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


def guid(value: object, field: str = "guid") -> str:
    if not isinstance(value, str) or not _GUID.fullmatch(value.strip()):
        raise InvalidInput(
            field, "a mission's guid has letters, digits and hyphens only, such as 3d7c7c40-ce85-11ef-904a-000e8e9884eb"
        )
    return value.strip()


def username(value: object, field: str = "username") -> str:
    """May be empty: then the robot needs a password before it can be used."""
    if not isinstance(value, str):
        raise InvalidInput(field, "a user name has to be a text")
    if ":" in value:
        raise InvalidInput(field, "a user name can't contain a colon")
    return name(value, field) if value.strip() else ""


def settings(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Changes of settings, each in its normal form."""
    return {field: _setting(field, value) for field, value in changes.items()}


def _setting(field: str, value: Any) -> Any:
    match field:
        case "minimum_battery_percent":
            return battery(value)
        case "working_days":
            return working_days(value)
        case "timezone":
            return timezone(value)
        case "history_limit" if value is None:
            return None
        case "language":
            return one_of(languages(), value, field)
        case "theme":
            return one_of(THEMES, value, field)
        case "holiday_country" | "holiday_subdivision":
            return name(value, field) if value else ""
        case "gloves" | "alarm_sound":
            return flag(value, field)
        case "keyboard":
            return one_of(KEYBOARDS, value, field)
        case "font_scale_percent":
            return one_of(FONT_SCALES, value, field)
        case "selected_robot_id" if value is None or (isinstance(value, int) and not isinstance(value, bool)):
            return value
    if field not in WHOLE_NUMBERS or not hasattr(Settings, field):
        raise InvalidInput(field, "there is no setting {name!r}", name=field)
    return whole_number(value, field)


def robot(given: Robot) -> Robot:
    """Checks its own values; relations to others are checked by the catalogue."""
    fingerprint = given.certificate_sha256
    return replace(
        given,
        name=name(given.name),
        address=Address.parse(given.address).url,
        username=username(given.username),
        certificate_sha256=normalise_fingerprint(fingerprint) if fingerprint else None,
    )


def group(given: Group, *, may_be_empty: bool = False) -> Group:
    """Checks its own values; names and members are checked by the catalogue."""
    members = tuple(sorted(set(given.members)))
    if not members and not may_be_empty:
        raise InvalidInput("members", "choose the robots of the group")
    keep_free = whole_number(given.keep_free, "keep_free")
    if keep_free and (len(members) < FEWEST_TO_KEEP_FREE or keep_free >= len(members)):
        raise InvalidInput(
            "keep_free",
            "robots can be kept free in a group of {fewest} robots or more, and not all of them",
            fewest=FEWEST_TO_KEEP_FREE,
        )
    return replace(
        given, name=name(given.name), members=members, keep_free=keep_free, hand_over=hand_over(given.hand_over)
    )


def place(given: Place) -> Place:
    """Checks its own values; its name and its missions are checked by the catalogue."""
    return replace(
        given, name=name(given.name), most=whole_number(given.most, "most"), missions=tuple(sorted(set(given.missions)))
    )


def hand_over(value: object, field: str = "hand_over") -> HandOver:
    if not isinstance(value, str) or value not in tuple(HandOver):
        raise InvalidInput(field, "enter {choices}", choices=" or ".join(HandOver))
    return HandOver(value)


def _machine(address: str) -> object:
    """One that makes no sense, after a damage, is no other's."""
    try:
        return machine(address)
    except InvalidInput:
        return address


def check_is_no_other(given: Robot, others: Iterable[Robot]) -> None:
    """Raises InvalidInput for the address when one of ``others`` with another id is the same machine."""
    at = _machine(given.address)
    for other in others:
        if other.id == given.id:
            continue
        if _machine(other.address) == at:
            raise InvalidInput(
                "address", "this is the address of {robot}, which is configured already", robot=other.name
            )
        if given.serial_number and other.serial_number == given.serial_number:
            raise InvalidInput(
                "address",
                "this is {robot}, which is configured already: serial number {serial}",
                robot=other.name,
                serial=other.serial_number,
            )


def schedule(given: Schedule) -> Schedule:
    """Checks its own values; robot, mission, name and working days are checked by the catalogue."""
    if given.start.tzinfo is not None or given.start.second or given.start.microsecond:
        raise InvalidInput("start", "a start is wall-clock time in whole minutes, without a zone")
    if given.start.year not in YEARS:
        raise InvalidInput("start", "enter a year from {first} to {last}", first=YEARS[0], last=YEARS[-1])
    window, finish_by = given.start_window_minutes, given.finish_by_minutes
    normal = replace(
        given,
        timezone=timezone(given.timezone),
        start=given.start.replace(fold=0),
        recurrence=None if given.recurrence is None else recurrence(given.recurrence),
        minimum_battery_percent=battery(given.minimum_battery_percent),
        start_window_minutes=None if window is None else whole_number(window, "start_window_minutes"),
        finish_by_minutes=None if finish_by is None else whole_number(finish_by, "finish_by_minutes"),
        overlap=overlap(given.overlap),
        priority=whole_number(given.priority, "priority"),
        parameters=parameters(given.parameters),
    )
    if normal.group_id is None and normal.finish_by_minutes is not None:
        raise InvalidInput(
            "finish_by_minutes", "a time by which it has to be done can be given for a group of robots only"
        )
    if normal.group_id is None and normal.overlap is Overlap.PARALLEL:
        raise InvalidInput("overlap", "one beside the other can run on a group of robots only")
    rule = Recurrence.parse(normal.recurrence)
    if normal.between is not None:
        if not rule.frequency.is_sub_daily:
            raise InvalidInput(
                "between", "a part of the day can be chosen for a recurrence every so many minutes or hours only"
            )
        between(normal.between)
    check_has_instants(normal)
    return normal


def recurrence(value: str) -> str:
    """An RRULE that the app can take, in capitals."""
    if len(value) > LONGEST_RECURRENCE:
        raise InvalidInput("recurrence", "a recurrence has at most {most} characters", most=LONGEST_RECURRENCE)
    Recurrence.parse(value)
    return value.strip().upper()


def overlap(value: object, field: str = "overlap") -> Overlap:
    if not isinstance(value, str) or value not in tuple(Overlap):
        raise InvalidInput(field, "enter {choices}", choices=" or ".join(Overlap))
    return Overlap(value)


def between(value: Between) -> Between:
    for moment in (value.start, value.end):
        if moment.tzinfo is not None or moment.second or moment.microsecond:
            raise InvalidInput("between", "times of day are in whole minutes")
    if value.start > value.end:
        raise InvalidInput("between", "the part of the day has to end after it begins, on the same day")
    return value


def parameters(value: object, field: str = "parameters") -> dict[str, Any]:
    """A mission's inputs by name: texts, numbers, true, false or null. The names are the robot's and sent back unchanged. Each run keeps a
    copy of them."""
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


def one_time_on_working_day(given: Schedule, calendar: WorkingCalendar) -> None:
    """A one-time schedule that respects working days can't lie on another day: it would never run."""
    if given.recurrence is not None or not given.respect_working_days:
        return
    day = given.start.date()
    status = calendar.day_status(day)
    if status.is_working:
        return
    if status.name:
        raise InvalidInput(
            "start",
            "{day} is no working day: {name}; choose another day or do not respect working days",
            day=f"{day:%Y-%m-%d}",
            name=status.name,
        )
    raise InvalidInput(
        "start",
        "{day} is a {weekday}, which is not a working day; choose another day or do not respect working days",
        day=f"{day:%Y-%m-%d}",
        weekday=_WEEKDAY_NAMES[day.weekday()],
    )


def day_exception(given: DayException) -> DayException:
    """Closed days or extra working days."""
    for field, day in (("first_day", given.first_day), ("last_day", given.last_day)):
        if not isinstance(day, date) or day.year not in YEARS:
            raise InvalidInput(field, "enter a year from {first} to {last}", first=YEARS[0], last=YEARS[-1])
    if given.last_day < given.first_day:
        raise InvalidInput("last_day", "the last day is before the first")
    if given.last_day - given.first_day >= LONGEST_EXCEPTION:
        raise InvalidInput("last_day", "at most a year can be entered at once")
    return replace(given, name=name(given.name))


_WEEKDAY_NAMES = (
    message("Monday"),
    message("Tuesday"),
    message("Wednesday"),
    message("Thursday"),
    message("Friday"),
    message("Saturday"),
    message("Sunday"),
)


def starts_text(value: object, field: str = "start") -> datetime:
    """``2026-11-23T06:30``, as files write it."""
    if isinstance(value, str) and re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d(:00)?", value, re.ASCII):
        try:
            return datetime.fromisoformat(value)
        except ValueError:
            raise InvalidInput(field, "there is no such date or time: {value}", value=value) from None
    raise InvalidInput(
        field,
        "write local time in whole minutes without a zone, such as 2026-11-23T06:30, not {value}",
        value=shown(value),
    )
