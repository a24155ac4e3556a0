"""The configuration's fields: the keys of the configuration file (docs/interfaces.md), how each value is checked, and
which attribute holds it. Files are read and written, entries checked and changes named by these tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import date, datetime
from typing import Any, TypeVar

from app.domain.message import Message, message
from app.domain.models import FONT_SCALES, KEYBOARDS, THEMES, Between, FleetKind, HandOver, InvalidInput, Overlap
from app.services.catalogue import checks
from app.services.catalogue.checks import Check, Number, choice, optional

T = TypeVar("T")
_NOTHING = object()


class Field:
    """``key``: its name in a file. ``label``: its name in sentences, as a form names it. ``attribute``: of the object, by default the key;
    "": none.

    ``check`` takes a value and the field to name in a refusal, and returns its normal form; ``parse`` comes before it
    where a file writes the value in another way. ``required``: "yes", or "new": of a new object only. ``special``:
    names of other objects and similar, which import and export translate themselves. ``omit``: the value that an export
    omits.
    """

    def __init__(
        self,
        key: str,
        check: Check,
        attribute: str | None = None,
        *,
        label: Message = "",
        parse: Check | None = None,
        required: str = "",
        special: bool = False,
        omit: object = _NOTHING,
    ) -> None:
        self.key, self.label, self.check, self.parse = key, label, check, parse
        self.attribute = key if attribute is None else attribute
        self.required, self.special, self.omit = required, special, omit


Fields = tuple[Field, ...]


@dataclass(frozen=True)
class Item:
    """One object of a file: its place in the file, and its values by key, in their normal form."""

    path: str
    values: Mapping[str, Any]
    fields: Fields

    @property
    def changes(self) -> dict[str, Any]:
        """The values that are stored as they are, by attribute."""
        return {
            field.attribute: self.values[field.key]
            for field in self.fields
            if field.key in self.values and not field.special
        }

    def of(self, stored: T | None) -> T | None:
        """The object that it is about. Raises InvalidInput for a new one that lacks a required field."""
        if stored is None:
            _check_has(self.path, self.values, [field for field in self.fields if field.required])
        return stored


# ---------------------------------------------------------------------- readers of the tables
def attributes(fields: Fields) -> list[str]:
    """Those that are stored as they are."""
    return [field.attribute for field in fields if not field.special]


def checked(entity: T, fields: Fields, *only: str) -> T:
    """With each value in its normal form, or ``only`` those of some attributes; raises InvalidInput for the first that can't be."""
    values = {
        field.attribute: field.check(getattr(entity, field.attribute), field.attribute)
        for field in fields
        if not field.special and (not only or field.attribute in only)
    }
    return replace(entity, **values)  # type: ignore[type-var]


def differing(before: object, after: object, fields: Fields) -> list[Field]:
    """The fields in which two objects differ, with references to other objects last."""
    return [
        field
        for field in sorted(fields, key=lambda field: field.special)
        if hasattr(after, field.attribute) and getattr(before, field.attribute) != getattr(after, field.attribute)
    ]


def written(entity: object, fields: Fields, **values: Any) -> dict[str, Any]:
    """For a file, in the order of the table; ``values`` by key replace those of the object."""
    found = {
        field.key: values[field.key] if field.key in values else _plain(getattr(entity, field.attribute))
        for field in fields
        if field.key in values or not field.special
    }
    return {field.key: found[field.key] for field in fields if field.key in found and found[field.key] != field.omit}


def _plain(value: object) -> object:
    """For JSON."""
    match value:
        case Between(start, end):
            return {"from": f"{start:%H:%M}", "to": f"{end:%H:%M}"}
        case datetime():
            return value.isoformat(timespec="minutes")
        case date():
            return value.isoformat()
        case float():
            return int(value) if value.is_integer() else value
        case Mapping():
            return dict(value)
    return value


def read_object(path: str, found: Any, fields: Fields) -> Item:
    """One object of a file. Raises InvalidInput with its place in the file."""
    if not isinstance(found, dict):
        raise InvalidInput(path, "{path}: an object with names and values is needed here", path=path)
    by_key = {field.key: field for field in fields}
    check_keys(path, found, by_key)
    _check_has(path, found, [field for field in fields if field.required == "yes"])
    return Item(path, {key: _value(f"{path}.{key}", value, by_key[key]) for key, value in found.items()}, fields)


def read_objects(path: str, found: Any, fields: Fields) -> list[Item]:
    if not isinstance(found, list):
        raise InvalidInput(path, "{path}: a list is needed here", path=path)
    return [read_object(f"{path}[{number}]", each, fields) for number, each in enumerate(found)]


def check_keys(path: str, found: Mapping[str, Any], known: Iterable[str]) -> None:
    """Raises InvalidInput for keys that are not known here; ``path`` is empty for the whole file."""
    if unknown := sorted(found.keys() - set(known)):
        raise InvalidInput(
            path or "file",
            "{where}unknown key {keys}, known are {known}",
            where=f"{path}: " if path else "",
            keys=", ".join(map(checks.shown, unknown[:5])),
            known=", ".join(sorted(known)),
        )


def _check_has(path: str, found: Mapping[str, Any], required: Sequence[Field]) -> None:
    for field in required:
        if field.key not in found:
            raise InvalidInput(f"{path}.{field.key}", "{path}: {key!r} is missing", path=path, key=field.key)


def _value(path: str, value: Any, field: Field) -> Any:
    try:
        return field.check(field.parse(value, path) if field.parse else value, path)
    except InvalidInput as error:
        if error.text.startswith(path):  # from inside an object of its own
            raise
        raise at(path, error) from None


def at(path: str, error: InvalidInput) -> InvalidInput:
    """The same problem, preceded by the place in the file."""
    return InvalidInput(path, "{path}: {problem}", path=path, problem=error.message)


# ---------------------------------------------------------------------- the tables
def _between(value: Any, path: str) -> Between:
    return Between(**read_object(path, value, BETWEEN).changes)


SETTINGS: Fields = (
    Field("poll_interval_seconds", Number(1, 3600), label=message("Ask the robots every")),
    Field("retry_limit", Number(0, 20), label=message("Retries when a robot can't be reached")),
    Field("minimum_battery_percent", checks.battery, label=message("Minimum battery")),
    Field("working_days", checks.working_days, label=message("Working days")),
    Field("timezone", checks.timezone, label=message("Time zone")),
    Field("start_window_minutes", Number(0, 1440), label=message("A mission may start late by")),
    Field("unknown_outcome_quiet_seconds", Number(5, 600), label=message("Wait after an unknown outcome")),
    Field("history_limit", optional(Number(1, 2**63 - 1)), label=message("Runs kept")),
)
DISPLAY: Fields = (
    Field("language", checks.language, label=message("Language")),
    Field("theme", choice(*THEMES), label=message("Theme")),
    Field("gloves", checks.flag, label=message("Glove mode")),
    Field("font_scale_percent", choice(*FONT_SCALES), label=message("Text size")),
    Field("keyboard", choice(*KEYBOARDS), label=message("On-screen keyboard")),
    Field("alarm_sound", checks.flag, label=message("Sound at alarms")),
    Field("dim_from", optional(Number(0, 23)), label=message("Dim the screen from")),
    Field("dim_until", Number(0, 23), label=message("Bright again from")),
)
DAY: Fields = (
    Field("name", checks.name, required="yes"),
    Field("first_day", checks.day, parse=checks.day_text, required="yes"),
    Field("last_day", checks.day, parse=checks.day_text),
    Field("working", checks.flag, "is_working"),
    Field("yearly", checks.flag),
    Field("source", lambda value, _field: value or "", parse=optional(checks.name), omit=""),
)
CALENDAR: Fields = (
    Field(
        "country",
        checks.name_or_empty,
        "holiday_country",
        parse=optional(checks.name),
        label=message("Public holidays"),
    ),
    Field("region", checks.name_or_empty, "holiday_subdivision", parse=optional(checks.name), label=message("Region")),
    Field("days", lambda value, path: read_objects(path, value, DAY), "", special=True),
)
IDLE: Fields = (
    Field("mission", checks.name, "mission_id", special=True, label=message("Mission")),
    Field("after_minutes", Number(5, 30)),
    Field("enabled", checks.flag, label=message("In use")),
)
ACCESS: Fields = (
    Field("username", checks.username, label=message("User")),
    Field("password", optional(checks.password), "", special=True, label=message("Password")),
    Field("enabled", checks.flag, label=message("In use")),
    Field(
        "certificate_sha256",
        checks.fingerprint,
        parse=optional(checks.fingerprint_text),
        omit=None,
        label=message("Certificate fingerprint (SHA-256)"),
    ),
)
FLEET: Fields = (
    Field("name", checks.name, required="yes"),
    Field("address", checks.address, parse=checks.text, required="new", label=message("Address")),
    Field("kind", choice(*FleetKind), label=message("Kind")),
    *ACCESS,
)
ROBOT: Fields = (
    Field("name", checks.name, required="yes"),
    Field("address", checks.address, parse=checks.text, required="new", label=message("Address")),
    *ACCESS,
    Field(
        "idle", optional(lambda value, path: read_object(path, value, IDLE)), special=True, label=message("When idle")
    ),
    Field("hand_over", choice(*HandOver), omit=HandOver.AT_ONCE, label=message("Starts go to the robot")),
    Field("fleet", checks.name, special=True, omit=None, label=message("Fleet")),
    Field("vehicle", checks.vehicle, label=message("Id at the fleet"), omit=""),
)
# What a robot has of its fleet, so that no file says it of the robot.
OF_FLEET = ("address", "username", "password", "certificate_sha256")
GROUP: Fields = (
    Field("name", checks.name, required="yes"),
    Field("robots", checks.name_list, "members", required="new", special=True, label=message("Robots")),
    Field("hand_over", choice(*HandOver), label=message("Starts go to a robot")),
    Field("keep_free", Number(0, 99), label=message("Kept free for urgent")),
)
PLACE: Fields = (
    Field("name", checks.name, required="yes"),
    Field("most", Number(1, 999), required="new", label=message("Robots at a time")),
)
MISSION: Fields = (
    Field("name", checks.name, required="yes"),
    Field("guid", checks.guid, required="new", label=message("GUID")),
    Field("robot", optional(checks.name), "robot_id", special=True, omit=None, label=message("Robots")),
    Field("usual_minutes", optional(Number(1, 1440)), omit=None, label=message("Usual")),
    Field("favourite", checks.flag, omit=False, label=message("Favourite")),
    Field("on_low_battery", checks.flag, omit=False, label=message("May start on a low battery")),
    Field("places", checks.name_list, "", special=True, omit=[], label=message("Places")),
)
BETWEEN: Fields = (
    Field("from", checks.time_of_day, "start", required="yes"),
    Field("to", checks.time_of_day, "end", required="yes"),
)
SCHEDULE: Fields = (
    Field("name", optional(checks.name), special=True),
    Field("robot", checks.name, "robot_id", special=True, omit=None, label=message("Robot")),
    Field("group", checks.name, "group_id", special=True, omit=None, label=message("Group")),
    Field("mission", checks.name, "mission_id", required="new", special=True, label=message("Mission")),
    Field("start", checks.start, parse=checks.start_text, required="new", label=message("First start")),
    Field("timezone", checks.timezone, label=message("Time zone")),
    Field("recurrence", optional(checks.recurrence), parse=optional(checks.text), label=message("Repeats")),
    Field("enabled", checks.flag, label=message("Switched on")),
    Field("minimum_battery_percent", checks.battery, label=message("Min. battery")),
    Field("respect_working_days", checks.flag, label=message("Any day")),
    Field("between", optional(checks.between), parse=optional(_between), label=message("Between")),
    Field("start_window_minutes", optional(Number(0, 1440)), label=message("May start late")),
    Field("finish_by_minutes", optional(Number(1, 1440)), label=message("Must be done")),
    Field("overlap", choice(*Overlap), label=message("If still running")),
    Field("priority", Number(-(2**31), 2**31 - 1), label=message("Priority")),
    Field("parameters", checks.parameters, label=message("Values")),
)
UNLISTED: Fields = (Field("selected_robot_id", optional(Number(-(2**63), 2**63 - 1))),)  # a setting that no file has
SECTIONS: Mapping[str, Fields] = {
    "settings": SETTINGS,
    "display": DISPLAY,
    "calendar": CALENDAR,
    "fleets": FLEET,
    "robots": ROBOT,
    "groups": GROUP,
    "places": PLACE,
    "missions": MISSION,
    "schedules": SCHEDULE,
}
KEY_OF = {
    field.attribute: field.key for fields in (*SECTIONS.values(), DAY, IDLE) for field in fields if field.attribute
}


@contextmanager
def placed(item: Item) -> Iterator[None]:
    """Problems found while applying get the place in the file, too."""
    try:
        yield
    except InvalidInput as error:
        if error.text.startswith(item.path):
            raise
        raise at(f"{item.path}.{KEY_OF.get(error.field, error.field)}", error) from None
