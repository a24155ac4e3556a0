"""Reads a configuration file and checks its form; comparing it with what is stored is done by the import.

Every problem is an InvalidInput whose field is the place in the file, such as ``schedules[2].start``.
"""

from __future__ import annotations

import json
import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, time
from types import MappingProxyType
from typing import Any, NoReturn

from app.domain.json_parts import has_too_many_parts
from app.domain.models import Between, InvalidInput
from app.mir.address import Address
from app.mir.credentials import normalise_fingerprint
from app.services.catalogue import validation

FORMAT = "amr-scheduler/1"
LARGEST_FILE = 5 * 1024 * 1024  # bytes

Read = Callable[[Any, str], Any]


@dataclass(frozen=True)
class Item:
    """One object of the file: the keys given, in their normal form, and its place in the file."""

    path: str
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Document:
    settings: Item
    display: Item
    calendar: Item  # its "days" are a list of Item
    robots: Sequence[Item]
    groups: Sequence[Item]
    places: Sequence[Item]
    missions: Sequence[Item]
    schedules: Sequence[Item]


def read(content: bytes) -> Document:
    """Raises InvalidInput at the first thing that is wrong with its form."""
    root = _parsed(content)
    if not isinstance(root, dict):
        raise InvalidInput("file", "the file has to hold one JSON object")
    _check_format(root)
    _check_keys(
        "", root, {"format", "settings", "display", "calendar", "robots", "groups", "places", "missions", "schedules"}
    )
    return Document(
        _item("settings", root.get("settings", {}), SETTINGS),
        _item("display", root.get("display", {}), DISPLAY),
        _item("calendar", root.get("calendar", {}), CALENDAR),
        _items("robots", root.get("robots", []), ROBOT),
        _items("groups", root.get("groups", []), GROUP),
        _items("places", root.get("places", []), PLACE),
        _items("missions", root.get("missions", []), MISSION),
        _items("schedules", root.get("schedules", []), SCHEDULE),
    )


def at(path: str, error: InvalidInput) -> InvalidInput:
    """The same problem, preceded by the place in the file."""
    return InvalidInput(path, "{path}: {problem}", path=path, problem=error.message)


# ---------------------------------------------------------------------- JSON
def _parsed(content: bytes) -> Any:
    if len(content) > LARGEST_FILE:
        raise InvalidInput("file", "the file is larger than 5 MiB")
    try:
        text = content.decode("utf-16" if content.startswith((BOM_UTF16_LE, BOM_UTF16_BE)) else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(
            "file", "the file is not UTF-8 text (byte {byte}): save it as UTF-8", byte=error.start
        ) from None
    if has_too_many_parts(text.encode()):
        raise InvalidInput("file", "the file has too many parts")
    try:
        return json.loads(text, object_pairs_hook=_object, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        raise InvalidInput(
            "file",
            "the file is not JSON: line {line}, column {column}: {problem}",
            line=error.lineno,
            column=error.colno,
            problem=error.msg,
        ) from None
    except RecursionError:
        raise InvalidInput("file", "the file is nested too deeply") from None
    except InvalidInput:
        raise
    except ValueError:  # a number of thousands of digits
        raise InvalidInput("file", "the file has a number that can't be read") from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        key = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise InvalidInput("file", "{key} appears twice in one object", key=validation.shown(key))
    return found


def _no_constant(text: str) -> NoReturn:
    raise InvalidInput("file", "{text} is no number that can be used", text=text)


def _check_format(root: Mapping[str, Any]) -> None:
    if "format" not in root:
        raise InvalidInput(
            "format", 'the file is no configuration of this app: it lacks "format": "{format}"', format=FORMAT
        )
    if root["format"] != FORMAT:
        raise InvalidInput(
            "format",
            "format: the file says {found}, this app reads {format}",
            found=validation.shown(root["format"]),
            format=FORMAT,
        )


# ---------------------------------------------------------------------- objects
def _items(section: str, objects: Any, readers: Mapping[str, Read]) -> list[Item]:
    if not isinstance(objects, list):
        raise InvalidInput(section, "{path}: a list is wanted here", path=section)
    return [_item(f"{section}[{number}]", given, readers, IDENTITY[section]) for number, given in enumerate(objects)]


def _item(path: str, given: Any, readers: Mapping[str, Read], required: Sequence[str] = ()) -> Item:
    if not isinstance(given, dict):
        raise InvalidInput(path, "{path}: an object with names and values is wanted here", path=path)
    _check_keys(path, given, set(readers))
    _check_has(path, given, required)
    return Item(path, {key: _value(f"{path}.{key}", value, readers[key]) for key, value in given.items()})


def check_new(section: str, item: Item) -> None:
    """Raises InvalidInput for one that is to be added and lacks what cannot be left out then."""
    _check_has(item.path, item.values, REQUIRED[section])


def _check_has(path: str, given: Mapping[str, Any], required: Sequence[str]) -> None:
    for key in required:
        if key not in given:
            raise InvalidInput(f"{path}.{key}", "{path}: {key!r} is missing", path=path, key=key)


def _check_keys(path: str, given: Mapping[str, Any], known: set[str]) -> None:
    if unknown := sorted(given.keys() - known):
        raise InvalidInput(
            path or "file",
            "{where}unknown key {keys}; known are {known}",
            where=f"{path}: " if path else "",
            keys=", ".join(map(validation.shown, unknown[:5])),
            known=", ".join(sorted(known)),
        )


def _value(path: str, value: Any, reader: Read) -> Any:
    try:
        return reader(value, path)
    except InvalidInput as error:
        if error.text.startswith(path):  # from inside an object of its own
            raise
        raise at(path, error) from None


def _or_none(reader: Read) -> Read:
    return lambda value, path: None if value is None else reader(value, path)


def _number(range_of: str) -> Read:
    return lambda value, path: validation.whole_number(value, path, range_of)


def _setting(name: str) -> Read:
    return lambda value, path: validation.settings({name: value})[name]


def _text(value: Any, path: str) -> str:
    if not isinstance(value, str):
        raise InvalidInput(path, "a text is wanted here")
    return value


def _password(value: Any, path: str) -> str:
    if not _text(value, path):
        raise InvalidInput(path, "a password can't be empty; leave it out to keep the present one")
    return str(value)


def _address(value: Any, path: str) -> str:
    return Address.parse(_text(value, path)).url


def _fingerprint(value: Any, path: str) -> str:
    return normalise_fingerprint(_text(value, path))


def _recurrence(value: Any, path: str) -> str:
    return validation.recurrence(_text(value, path))


def _names(value: Any, path: str) -> tuple[str, ...]:
    """Each once."""
    if not isinstance(value, list):
        raise InvalidInput(path, "a list of names is wanted here")
    found = tuple(validation.name(each, path) for each in value)
    if len(set(found)) < len(found):
        raise InvalidInput(path, "a name appears twice")
    return found


def _idle(value: Any, path: str) -> Mapping[str, Any]:
    return _item(path, value, _IDLE).values


def _between(value: Any, path: str) -> Between:
    given = _item(path, value, _BETWEEN, required=("from", "to")).values
    return validation.between(Between(given["from"], given["to"]))


def _time_of_day(value: Any, path: str) -> time:
    text = _text(value, path)
    if (
        len(text) == 5
        and text[2] == ":"
        and text[:2].isdecimal()
        and text[3:].isdecimal()
        and text.isascii()
        and int(text[:2]) < 24
        and int(text[3:]) < 60
    ):
        return time(int(text[:2]), int(text[3:]))
    raise InvalidInput(path, "write a time of day such as 08:30, not {value}", value=validation.shown(text))


def _days(value: Any, path: str) -> list[Item]:
    return _items(path, value, DAY)


def _day(value: Any, path: str) -> date:
    text = _text(value, path)
    if re.fullmatch(r"\d{4}-\d\d-\d\d", text, re.ASCII):
        try:
            return date.fromisoformat(text)
        except ValueError:
            raise InvalidInput(path, "there is no such date or time: {value}", value=text) from None
    raise InvalidInput(path, "write a date such as 2026-12-24, not {value}", value=validation.shown(text))


# What each object of the file may hold, and how it is read.
SETTINGS: Mapping[str, Read] = MappingProxyType(
    {
        "poll_interval_seconds": _number("poll_interval_seconds"),
        "retry_limit": _number("retry_limit"),
        "minimum_battery_percent": validation.battery,
        "working_days": validation.working_days,
        "timezone": validation.timezone,
        "start_window_minutes": _number("start_window_minutes"),
        "unknown_outcome_quiet_seconds": _number("unknown_outcome_quiet_seconds"),
        "history_limit": _or_none(_number("history_limit")),
    }
)
DISPLAY: Mapping[str, Read] = MappingProxyType(
    {key: _setting(key) for key in ("language", "theme", "gloves", "font_scale_percent", "keyboard", "alarm_sound")}
)
CALENDAR: Mapping[str, Read] = MappingProxyType(
    {
        "country": _or_none(validation.name),
        "region": _or_none(validation.name),
        "days": _days,
    }
)
DAY: Mapping[str, Read] = MappingProxyType(
    {
        "name": validation.name,
        "first_day": _day,
        "last_day": _day,
        "working": validation.flag,
        "yearly": validation.flag,
        "source": _or_none(validation.name),
    }
)
ROBOT: Mapping[str, Read] = MappingProxyType(
    {
        "name": validation.name,
        "address": _address,
        "username": validation.username,
        "password": _or_none(_password),
        "enabled": validation.flag,
        "certificate_sha256": _or_none(_fingerprint),
        "idle": _or_none(_idle),
        "hand_over": validation.hand_over,
    }
)
GROUP: Mapping[str, Read] = MappingProxyType(
    {
        "name": validation.name,
        "robots": _names,
        "hand_over": validation.hand_over,
        "keep_free": _number("keep_free"),
    }
)
PLACE: Mapping[str, Read] = MappingProxyType(
    {
        "name": validation.name,
        "most": _number("most"),
    }
)
_IDLE: Mapping[str, Read] = MappingProxyType(
    {
        "mission": validation.name,
        "after_minutes": _number("after_minutes"),
        "enabled": validation.flag,
    }
)
MISSION: Mapping[str, Read] = MappingProxyType(
    {
        "name": validation.name,
        "guid": validation.guid,
        "robot": _or_none(validation.name),
        "usual_minutes": _or_none(_number("usual_minutes")),
        "favourite": validation.flag,
        "on_low_battery": validation.flag,
        "places": _names,
    }
)
SCHEDULE: Mapping[str, Read] = MappingProxyType(
    {
        "name": _or_none(validation.name),
        "robot": validation.name,
        "group": validation.name,
        "mission": validation.name,
        "start": validation.starts_text,
        "timezone": validation.timezone,
        "recurrence": _or_none(_recurrence),
        "enabled": validation.flag,
        "minimum_battery_percent": validation.battery,
        "respect_working_days": validation.flag,
        "between": _or_none(_between),
        "start_window_minutes": _or_none(_number("start_window_minutes")),
        "finish_by_minutes": _or_none(_number("finish_by_minutes")),
        "overlap": validation.overlap,
        "priority": _number("priority"),
        "parameters": validation.parameters,
    }
)
_BETWEEN: Mapping[str, Read] = MappingProxyType({"from": _time_of_day, "to": _time_of_day})
# What each object has to name: by that it is found among those that exist, whose other keys may be left out.
IDENTITY: Mapping[str, Sequence[str]] = MappingProxyType(
    {
        "robots": ("name",),
        "groups": ("name",),
        "places": ("name",),
        "missions": ("name",),
        "schedules": (),
        "calendar.days": ("name", "first_day"),
    }
)
# What a new one needs.
REQUIRED: Mapping[str, Sequence[str]] = MappingProxyType(
    {
        "robots": ("name", "address"),
        "groups": ("name", "robots"),
        "places": ("name", "most"),
        "missions": ("name", "guid"),
        "schedules": ("mission", "start"),
        "calendar.days": ("name", "first_day"),
    }
)
