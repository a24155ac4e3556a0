"""The configuration's fields: the keys of the configuration file (docs/interfaces.md), how each value is checked, and
which attribute holds it. Files are read and written, entries checked and changes named by these tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import date, datetime
from typing import Any, TypeVar

from app.domain.message import Message, message, render
from app.domain.models import FONT_SCALES, KEYBOARDS, THEMES, Between, FleetKind, HandOver, InvalidInput, Overlap
from app.services.catalogue import checks
from app.services.catalogue.checks import Check, Number, choice, optional

T = TypeVar("T")
_NOTHING = object()


class Field:
    """``name``: the key in words, as a message if sentences name it. ``attribute``: of the object, by default the key; "": none.

    ``check`` takes a value and the field to name in a refusal, and returns its normal form; ``parse`` comes before it
    where a file writes the value in another way. ``required``: "yes", or "new": of a new object only. ``special``:
    names of other objects and similar, which import and export translate themselves. ``omit``: the value that an export
    omits.
    """

    def __init__(
        self,
        name: Message,
        check: Check,
        attribute: str | None = None,
        *,
        parse: Check | None = None,
        required: str = "",
        special: bool = False,
        omit: object = _NOTHING,
    ) -> None:
        self.name, self.check, self.parse = name, check, parse
        self.key = render(name).replace(" ", "_")
        self.attribute = self.key if attribute is None else attribute
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

    def check_new(self) -> None:
        """Raises InvalidInput for a new one that lacks a required field."""
        _check_has(self.path, self.values, [field for field in self.fields if field.required])


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
    Field(message("poll interval seconds"), Number(1, 3600)),
    Field(message("retry limit"), Number(0, 20)),
    Field(message("minimum battery percent"), checks.battery),
    Field(message("working days"), checks.working_days),
    Field(message("timezone"), checks.timezone),
    Field(message("start window minutes"), Number(0, 1440)),
    Field(message("unknown outcome quiet seconds"), Number(5, 600)),
    Field(message("history limit"), optional(Number(1, 2**63 - 1))),
)
DISPLAY: Fields = (
    Field(message("language"), checks.language),
    Field(message("theme"), choice(*THEMES)),
    Field(message("gloves"), checks.flag),
    Field(message("font scale percent"), choice(*FONT_SCALES)),
    Field(message("keyboard"), choice(*KEYBOARDS)),
    Field(message("alarm sound"), checks.flag),
    Field(message("dim from"), optional(Number(0, 23))),
    Field(message("dim until"), Number(0, 23)),
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
    Field(message("country"), checks.name_or_empty, "holiday_country", parse=optional(checks.name)),
    Field(message("region"), checks.name_or_empty, "holiday_subdivision", parse=optional(checks.name)),
    Field("days", lambda value, path: read_objects(path, value, DAY), "", special=True),
)
IDLE: Fields = (
    Field(message("mission"), checks.name, "mission_id", special=True),
    Field("after_minutes", Number(5, 30)),
    Field(message("enabled"), checks.flag),
)
FLEET: Fields = (
    Field("name", checks.name, required="yes"),
    Field(message("address"), checks.address, parse=checks.text, required="new"),
    Field(message("kind"), choice(*FleetKind)),
    Field(message("username"), checks.username),
    Field(message("password"), optional(checks.password), "", special=True),
    Field(message("enabled"), checks.flag),
    Field(message("certificate sha256"), checks.fingerprint, parse=optional(checks.fingerprint_text), omit=None),
)
ROBOT: Fields = (
    Field("name", checks.name, required="yes"),
    Field(message("address"), checks.address, parse=checks.text, required="new"),
    Field(message("username"), checks.username),
    Field(message("password"), optional(checks.password), "", special=True),
    Field(message("enabled"), checks.flag),
    Field(message("certificate sha256"), checks.fingerprint, parse=optional(checks.fingerprint_text), omit=None),
    Field(message("idle"), optional(lambda value, path: read_object(path, value, IDLE)), special=True),
    Field(message("hand over"), choice(*HandOver), omit=HandOver.AT_ONCE),
    Field(message("fleet"), checks.name, special=True, omit=None),
    Field("vehicle", checks.vehicle, omit=""),
)
# What a robot has of its fleet, so that no file says it of the robot.
OF_FLEET = ("address", "username", "password", "certificate_sha256")
GROUP: Fields = (
    Field("name", checks.name, required="yes"),
    Field(message("robots"), checks.name_list, "members", required="new", special=True),
    Field(message("hand over"), choice(*HandOver)),
    Field(message("keep free"), Number(0, 99)),
)
PLACE: Fields = (
    Field("name", checks.name, required="yes"),
    Field(message("most"), Number(1, 999), required="new"),
)
MISSION: Fields = (
    Field("name", checks.name, required="yes"),
    Field(message("guid"), checks.guid, required="new"),
    Field(message("robot"), optional(checks.name), "robot_id", special=True, omit=None),
    Field(message("usual minutes"), optional(Number(1, 1440)), omit=None),
    Field(message("favourite"), checks.flag, omit=False),
    Field(message("on low battery"), checks.flag, omit=False),
    Field(message("places"), checks.name_list, "", special=True, omit=[]),
)
BETWEEN: Fields = (
    Field("from", checks.time_of_day, "start", required="yes"),
    Field("to", checks.time_of_day, "end", required="yes"),
)
SCHEDULE: Fields = (
    Field("name", optional(checks.name), special=True),
    Field(message("robot"), checks.name, "robot_id", special=True, omit=None),
    Field(message("group"), checks.name, "group_id", special=True, omit=None),
    Field(message("mission"), checks.name, "mission_id", required="new", special=True),
    Field(message("start"), checks.start, parse=checks.start_text, required="new"),
    Field(message("timezone"), checks.timezone),
    Field(message("recurrence"), optional(checks.recurrence), parse=optional(checks.text)),
    Field(message("enabled"), checks.flag),
    Field(message("minimum battery percent"), checks.battery),
    Field(message("respect working days"), checks.flag),
    Field(message("between"), optional(checks.between), parse=optional(_between)),
    Field(message("start window minutes"), optional(Number(0, 1440))),
    Field(message("finish by minutes"), optional(Number(1, 1440))),
    Field(message("overlap"), choice(*Overlap)),
    Field(message("priority"), Number(-(2**31), 2**31 - 1)),
    Field(message("parameters"), checks.parameters),
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
