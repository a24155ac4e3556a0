"""The parameters that a mission asks for, as fields to fill in, and back as the values that are sent to the robot. Pure."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from app.domain.robot import MissionParameter
from app.i18n import _
from app.screens.common import formats

WHOLE = ("integer", "int")
DECIMAL = ("float", "double", "number", "decimal")
YES_NO = ("bool", "boolean")


@dataclass(frozen=True)
class ParameterField:
    """A field of the widget ParameterFields. ``kind``: text, int, decimal or choice; ``choices`` are (value, word)."""
    name: str
    label: str
    kind: str
    default: Any
    help: str
    choices: tuple[tuple[Any, str], ...]


class Problems(ValueError):
    """What was entered can't be used: ``by_name`` has one sentence per parameter."""

    def __init__(self, by_name: Mapping[str, str]) -> None:
        self.by_name = by_name
        super().__init__("; ".join(by_name.values()))


def fields_of(parameters: Sequence[MissionParameter]) -> list[ParameterField]:
    """In the order in which the robot has them."""
    return [ParameterField(p.name, p.label or p.name, _kind(p), p.default, _range(p), _choices(p)) for p in parameters]


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


def _kind(parameter: MissionParameter) -> str:
    name = parameter.type.casefold()
    if parameter.choices or name in YES_NO or isinstance(parameter.default, bool):
        return "choice"
    if name in WHOLE:
        return "int"
    if name in DECIMAL or isinstance(parameter.default, int | float):
        return "decimal"
    return "text"                        # also durations, which the robot writes as 00:01:00.000000


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
        if entered is None:
            raise ValueError(_("Choose one"))
        return entered
    text = str("" if entered is None else entered).strip()
    if kind == "text":
        if not text:
            raise ValueError(_("Enter a value"))
        return text
    try:
        number = int(text) if kind == "int" else float(text.replace(",", "."))
    except ValueError:
        raise ValueError(_("A number is needed")) from None
    if (parameter.minimum is not None and number < parameter.minimum) or (parameter.maximum is not None and number > parameter.maximum):
        raise ValueError(_("It must be {range}").format(range=_range(parameter)))
    return number
