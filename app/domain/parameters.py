"""Which values a mission's parameters accept, wherever they are entered. Pure.

A value that fits becomes what is sent to the robot: a choice by its value, a position by its guid, a number of the
parameter's own type.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from app.domain.message import Message, message
from app.domain.models import InvalidInput
from app.domain.robot import MissionParameter

WHOLE = ("integer", "int")
DECIMAL = ("float", "double", "number", "decimal")
YES_NO = ("bool", "boolean")
DURATIONS = ("duration", "time", "minimum_time", "timeout")
YES, NO = ("true", "1", "yes"), ("false", "0", "no")  # as robots' own values may say it
MOST_NAMED = 12  # choices or parameters in one sentence
DURATION = re.compile(r"(?:(\d{1,3}):)?([0-5]?\d):([0-5]?\d)(?:[.,](\d*))?", re.ASCII)
IDENTIFIER = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", re.IGNORECASE)


THOUSANDS = re.compile(r"[^.,]*[.,]\d{3}")  # as a whole number 1,000 may be one or a thousand


def values_for(mission: str, parameters: Sequence[MissionParameter], typed: Mapping[str, Any]) -> dict[str, Any]:
    """The values to send with a mission of this name that asks for ``parameters``. Raises InvalidInput, which names mission and parameter:
    for one that it does not have, for a value that it can't take, and for one that is missing and has no default."""
    by_name = {parameter.name: parameter for parameter in parameters}
    if unknown := next((name for name in typed if name not in by_name), None):
        raise _unknown(mission, unknown, list(by_name))
    values = {}
    for parameter in parameters:
        entered = typed.get(parameter.name, parameter.default)
        if entered is None or entered == "":
            raise InvalidInput(
                "parameters",
                "{name} is missing: the robot does not start {mission} without it",
                name=parameter.name,
                mission=mission,
            )
        if parameter.name in typed:
            try:
                values[parameter.name] = value_for(parameter, entered)
            except InvalidInput as problem:
                raise InvalidInput(
                    "parameters",
                    "{mission} can't take {value} for {name}: {problem}",
                    mission=mission,
                    value=f"{entered!s:.60}",
                    name=parameter.name,
                    problem=problem.message,
                ) from None
    return values


def has_position_by_name(parameters: Sequence[MissionParameter], entered: Mapping[str, Any]) -> bool:
    """Whether a value has to be looked up among the robot's positions. A guid means the same position on every map."""
    return any(
        parameter.is_position and parameter.name in entered and not _is_guid(entered[parameter.name])
        for parameter in parameters
    )


def _is_guid(entered: Any) -> bool:
    return IDENTIFIER.fullmatch(str(entered).strip()) is not None


def missing(parameters: Sequence[MissionParameter]) -> list[str]:
    """Labels of required parameters, which have no usable default."""
    return [parameter.label or parameter.name for parameter in parameters if not _has_default(parameter)]


def _has_default(parameter: MissionParameter) -> bool:
    try:
        value_for(parameter, parameter.default)
    except InvalidInput:
        return False
    return True


def _unknown(mission: str, name: str, known: Sequence[str]) -> InvalidInput:
    if not known:
        return InvalidInput(
            "parameters", "{mission} has no parameter {name}: it takes none", mission=mission, name=name
        )
    return InvalidInput(
        "parameters",
        "{mission} has no parameter {name}, it takes {known}",
        mission=mission,
        name=name,
        known=_listed(known),
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:MOST_NAMED]) + (" …" if len(names) > MOST_NAMED else "")


def value_for(parameter: MissionParameter, entered: Any) -> Any:
    """Raises InvalidInput."""
    kind = kind_of(parameter)
    if kind == "choice":
        return _chosen(parameter, entered)
    text = str("" if entered is None else entered).strip()
    if kind == "text":
        if not text:
            raise InvalidInput("value", "Enter a value")
        return text if isinstance(entered, str) else entered
    if kind == "duration":
        if (found := DURATION.fullmatch(text)) is None:
            raise InvalidInput("value", "Enter hours, minutes and seconds, such as 00:05:00")
        return written(found)
    number = _number(text, is_whole=kind == "int")
    if (parameter.minimum is not None and number < parameter.minimum) or (
        parameter.maximum is not None and number > parameter.maximum
    ):
        raise InvalidInput("value", "It must be {range}", range=range_of(parameter))
    if not isinstance(entered, str):
        return number if kind == "int" else entered
    was_whole = (
        type(parameter.default) is int and parameter.type.casefold() not in DECIMAL
    )  # the robot may not take 3.0 for 3
    return int(number) if was_whole and float(number).is_integer() else number


def _chosen(parameter: MissionParameter, entered: Any) -> Any:
    if entered is None or entered == "":
        raise InvalidInput("value", "Choose one")
    if not parameter.choices:
        if (answer := yes_or_no(entered)) is None:
            raise InvalidInput("value", "Choose one")
        return answer
    if (meant := parameter.value_of(entered)) is not None:
        return meant
    if parameter.is_position and _is_guid(entered):  # one that the robot doesn't list, such as an entry
        return str(entered).strip()
    labels = [label for _value, label in parameter.choices]
    raise InvalidInput("value", "Choose one of {choices}", choices=_listed(labels))


def kind_of(parameter: MissionParameter) -> str:
    """choice, int, decimal, duration or text."""
    name = parameter.type.casefold()
    if parameter.choices or name in YES_NO or (isinstance(parameter.default, bool) and name not in (*WHOLE, *DECIMAL)):
        return "choice"
    if name in WHOLE or parameter.sets in ("retries", "minimum_percentage", "register"):
        return "int"
    if name in DECIMAL or parameter.unit or isinstance(parameter.default, int | float):
        return "decimal"
    return "duration" if name in DURATIONS else "text"


def yes_or_no(value: Any) -> bool | None:
    """None: neither."""
    word = (
        str(int(value) if isinstance(value, bool | float) and float(value).is_integer() else value).strip().casefold()
    )
    return True if word in YES else False if word in NO else None


def written(duration: re.Match[str]) -> str:
    """As the robot does, to the microsecond."""
    hours, minutes, seconds = (int(part or 0) for part in duration.groups()[:3])
    return f"{hours:02d}:{minutes:02d}:{seconds:02d}.{(duration[4] or '')[:6]:0<6}"


def range_of(parameter: MissionParameter) -> Message:
    """Of a number, with its unit; empty where it has neither."""
    low, high, unit = parameter.minimum, parameter.maximum, parameter.unit
    limits: Message = ""
    if low is not None and high is not None:
        limits = message("{low} to {high}", low=low, high=high)
    elif low is not None:
        limits = message("{low} or more", low=low)
    elif high is not None:
        limits = message("{high} or less", high=high)
    return message("{limits} {unit}", limits=limits, unit=unit) if limits and unit else limits or unit


def _number(text: str, *, is_whole: bool) -> int | float:
    """3.0 is a whole number, too. Python would read 1_5 as 15."""
    try:
        if "_" in text or (is_whole and THOUSANDS.fullmatch(text)):
            raise ValueError(text)
        number: int | float = int(text) if text.isdecimal() and is_whole else float(text.replace(",", "."))
    except ValueError:
        wanted = "A whole number is needed" if is_whole and text else "A number is needed"
        raise InvalidInput("value", wanted) from None
    if isinstance(number, float) and not math.isfinite(number):
        raise InvalidInput("value", "A number is needed")
    if is_whole and not float(number).is_integer():
        raise InvalidInput("value", "A whole number is needed")
    return int(number) if is_whole else number
