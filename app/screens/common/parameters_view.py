"""The parameters that a mission asks for, as fields to fill in, and back as the values that are sent to the robot. Pure."""
from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from app.domain.robot import MissionParameter
from app.i18n import _
from app.screens.common import formats

WHOLE = ("integer", "int")
DECIMAL = ("float", "double", "number", "decimal")
YES_NO = ("bool", "boolean")
DURATIONS = ("duration", "time", "minimum_time", "timeout")
CHIPS = 6                                # choices that are shown side by side; more are a list to choose from
NOTHING: Mapping[str, Any] = MappingProxyType({})
YES, NO = ("true", "1", "yes"), ("false", "0", "no")         # as robots' own values may say it
_DURATION = re.compile(r"(?:(\d{1,3}):)?([0-5]?\d):([0-5]?\d)(?:[.,](\d*))?", re.ASCII)


@dataclass(frozen=True)
class ParameterField:
    """A field of the widget ParameterFields. ``kind``: text, int, steps (an int between ``limits``), decimal, choice, list (of many) or
    position; ``choices`` are (value, word)."""
    name: str
    label: str
    kind: str
    default: Any
    help: str
    choices: tuple[tuple[Any, str], ...]
    limits: tuple[int, int] | None = None


class Problems(ValueError):
    """What was entered can't be used: ``by_name`` has one sentence per parameter."""

    def __init__(self, by_name: Mapping[str, str]) -> None:
        self.by_name = by_name
        super().__init__("; ".join(by_name.values()))


def fields_of(parameters: Sequence[MissionParameter], entered: Mapping[str, Any] = NOTHING) -> list[ParameterField]:
    """In the order in which the robot has them; they begin with what was ``entered`` before, as ``ParameterFields`` tells it."""
    return [ParameterField(p.name, p.label or p.name, _field(p), _entered(p, entered[p.name]) if p.name in entered else _shown(p), _help(p),
                           _choices(p), _limits(p)) for p in parameters]


def values_of(parameters: Sequence[MissionParameter], entered: Mapping[str, Any]) -> dict[str, Any]:
    """Name -> value as the robot wants it. Raises Problems."""
    values, problems = {}, {}
    for parameter in parameters:
        try:
            values[parameter.name] = _value(parameter, entered.get(parameter.name))
        except ValueError as problem:
            problems[parameter.name] = str(problem)
    if problems:
        raise Problems(problems)
    return values


def problems_of(parameters: Sequence[MissionParameter]) -> Mapping[str, str]:
    """What the robot's own values leave to be entered."""
    try:
        values_of(parameters, {field.name: field.default for field in fields_of(parameters)})
    except Problems as problems:
        return dict(problems.by_name)
    return {}


def _kind(parameter: MissionParameter) -> str:
    name = parameter.type.casefold()
    if parameter.choices or name in YES_NO or (isinstance(parameter.default, bool) and name not in (*WHOLE, *DECIMAL)):
        return "choice"
    if name in WHOLE or parameter.sets in ("retries", "minimum_percentage", "register"):
        return "int"
    if name in DECIMAL or parameter.unit or isinstance(parameter.default, int | float):
        return "decimal"
    return "duration" if name in DURATIONS else "text"


def _field(parameter: MissionParameter) -> str:
    kind = _kind(parameter)
    if kind == "choice" and parameter.is_position:
        return "position"
    if kind == "choice" and len(parameter.choices) > CHIPS:
        return "list"
    if _limits(parameter) is not None:
        return "steps"
    return "text" if kind == "duration" else kind


def _limits(parameter: MissionParameter) -> tuple[int, int] | None:
    """Of a whole number of which both are known."""
    low, high = parameter.minimum, parameter.maximum
    if _kind(parameter) != "int" or low is None or high is None or not (math.isfinite(low) and math.isfinite(high)):
        return None
    return math.ceil(low), math.floor(high)


def _shown(parameter: MissionParameter) -> Any:
    """What its field begins with."""
    default = parameter.default
    if parameter.choices:
        return parameter.value_of(default)
    if _limits(parameter) is not None:
        return _whole(default)
    kind = _kind(parameter)
    if kind == "choice":
        return _yes_or_no(default)
    if kind == "duration" and (found := _DURATION.fullmatch(str(default))):
        return _written(found).rstrip("0").removesuffix(".") if int(found[4] or 0) else _written(found)[:-len(".000000")]
    return int(default) if kind == "int" and isinstance(default, bool | float) and float(default).is_integer() else default


def _entered(parameter: MissionParameter, value: Any) -> Any:
    return _whole(value) if _limits(parameter) is not None else value


def _whole(value: Any) -> int | None:
    """None: it is none."""
    try:
        return int(value) if int(value) == float(value) else None
    except (TypeError, ValueError, OverflowError):
        return None


def _yes_or_no(value: Any) -> bool | None:
    """None: neither."""
    word = str(int(value) if isinstance(value, bool | float) and float(value).is_integer() else value).strip().casefold()
    return True if word in YES else False if word in NO else None


def _written(duration: re.Match[str]) -> str:
    """As the robot does, to the microsecond."""
    hours, minutes, seconds = (int(part or 0) for part in duration.groups()[:3])
    return f"{hours:02d}:{minutes:02d}:{seconds:02d}.{(duration[4] or '')[:6]:0<6}"


def _help(parameter: MissionParameter) -> str:
    if _kind(parameter) == "duration":
        return _("hours:minutes:seconds")
    if parameter.is_position and not parameter.choices:
        return _("the identifier of a position on the robot")
    return " ".join(filter(None, (_range(parameter), parameter.unit))) if _kind(parameter) in ("int", "decimal") else ""


def _choices(parameter: MissionParameter) -> tuple[tuple[Any, str], ...]:
    if parameter.choices:
        return tuple(parameter.choices)
    return ((True, _("Yes")), (False, _("No"))) if _kind(parameter) == "choice" else ()


def _range(parameter: MissionParameter) -> str:
    low, high = (None if limit is None else formats.plain(limit) for limit in (parameter.minimum, parameter.maximum))
    if low is not None and high is not None:
        return _("{low} to {high}").format(low=low, high=high)
    if low is not None:
        return _("{low} or more").format(low=low)
    return _("{high} or less").format(high=high) if high is not None else ""


def _value(parameter: MissionParameter, entered: Any) -> Any:
    kind = _kind(parameter)
    if kind == "choice":
        meant = parameter.value_of(entered) if parameter.choices else _yes_or_no(entered)
        if meant is None:
            raise ValueError(_("Choose one"))
        return meant
    text = str("" if entered is None else entered).strip()
    if kind == "text":
        if not text:
            raise ValueError(_("Enter a value"))
        return text
    if kind == "duration":
        if (found := _DURATION.fullmatch(text)) is None:
            raise ValueError(_("Enter hours, minutes and seconds, such as 00:05:00"))
        return _written(found)
    number = _number(text, is_whole=kind == "int")
    if (parameter.minimum is not None and number < parameter.minimum) or (parameter.maximum is not None and number > parameter.maximum):
        raise ValueError(_("It must be {range}").format(range=_help(parameter)))
    was_whole = type(parameter.default) is int and parameter.type.casefold() not in DECIMAL       # the robot may not take 3.0 for 3
    return int(number) if was_whole and float(number).is_integer() else number


def _number(text: str, *, is_whole: bool) -> int | float:
    """3.0 is a whole number, too."""
    try:
        number: int | float = int(text) if text.isdecimal() and is_whole else float(text.replace(",", "."))
    except ValueError:
        raise ValueError(_("A whole number is needed") if is_whole and text else _("A number is needed")) from None
    if isinstance(number, float) and not math.isfinite(number):
        raise ValueError(_("A number is needed"))
    if is_whole and not float(number).is_integer():
        raise ValueError(_("A whole number is needed"))
    return int(number) if is_whole else number
