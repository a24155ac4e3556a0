"""A mission's parameters as fields to fill in, and the fields as values for the robot. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from app.domain.message import render
from app.domain.models import InvalidInput
from app.domain.parameters import DURATION, kind_of, range_of, value_for, written, yes_or_no
from app.domain.robot import MissionParameter
from app.i18n import _

CHIPS = 6  # choices that are shown side by side; more are a list to choose from
NOTHING: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True)
class ParameterField:
    """A field of the widget ParameterFields. ``kind``: text, int, count (an int from 0), steps (an int between ``limits``), decimal,
    choice or list (positions, and many choices); ``choices`` are (value, word)."""

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
        super().__init__(" · ".join(by_name.values()))


def fields_of(parameters: Sequence[MissionParameter], entered: Mapping[str, Any] = NOTHING) -> list[ParameterField]:
    """In the robot's order; their first values are those ``entered`` before, as ``ParameterFields`` returns them."""
    return [
        ParameterField(
            p.name,
            p.label or p.name,
            _field(p),
            _entered(p, entered[p.name]) if p.name in entered else _shown(p),
            _help(p),
            _choices(p),
            _limits(p),
        )
        for p in parameters
    ]


def changed(parameters: Sequence[MissionParameter], values: Mapping[str, Any]) -> dict[str, Any]:
    """Of the ``values`` in their fields those that a person has entered."""
    found = {field.name: _written(field.default) for field in fields_of(parameters)}
    return {name: value for name, value in values.items() if _written(value) != found.get(name)}


def values_of(parameters: Sequence[MissionParameter], entered: Mapping[str, Any]) -> dict[str, Any]:
    """Name -> value as the robot wants it. Raises Problems."""
    values, problems = {}, {}
    for parameter in parameters:
        try:
            values[parameter.name] = value_for(parameter, entered.get(parameter.name))
        except InvalidInput as problem:
            problems[parameter.name] = render(problem.message, _)
    if problems:
        raise Problems(problems)
    return values


def _written(value: Any) -> str:
    """As its field shows it."""
    return "" if value is None else str(value)


def _field(parameter: MissionParameter) -> str:
    kind = kind_of(parameter)
    if kind == "choice" and (parameter.is_position or len(parameter.choices) > CHIPS):
        return "list"
    if _limits(parameter) is not None:
        return "steps"
    if kind == "int" and parameter.minimum is not None and parameter.minimum >= 0:
        return "count"
    return "text" if kind == "duration" else kind


def _limits(parameter: MissionParameter) -> tuple[int, int] | None:
    """Of a whole number with both limits known."""
    low, high = parameter.minimum, parameter.maximum
    if kind_of(parameter) != "int" or low is None or high is None or not (math.isfinite(low) and math.isfinite(high)):
        return None
    return math.ceil(low), math.floor(high)


def _shown(parameter: MissionParameter) -> Any:
    """What its field begins with. A position on another map has to be chosen by a person."""
    default = parameter.default
    if parameter.choices:
        return replace(parameter, on_other_maps=()).value_of(default)
    if _limits(parameter) is not None:
        return _whole(default)
    kind = kind_of(parameter)
    if kind == "choice":
        return yes_or_no(default)
    if kind == "duration" and (found := DURATION.fullmatch(str(default))):
        return written(found).rstrip("0").removesuffix(".") if int(found[4] or 0) else written(found)[: -len(".000000")]
    return (
        int(default) if kind == "int" and isinstance(default, bool | float) and float(default).is_integer() else default
    )


def _entered(parameter: MissionParameter, value: Any) -> Any:
    """What is not in the robot's newest list is no longer chosen."""
    if kind_of(parameter) == "choice":
        return _shown(replace(parameter, default=value))
    return _whole(value) if _limits(parameter) is not None and not isinstance(value, str) else value


def _whole(value: Any) -> int | None:
    """None if it is not one."""
    try:
        return int(value) if int(value) == float(value) else None
    except (TypeError, ValueError, OverflowError):
        return None


def _help(parameter: MissionParameter) -> str:
    if kind_of(parameter) == "duration":
        return _("hours:minutes:seconds")
    if parameter.is_position and not parameter.choices:
        return _("the identifier of a position on the robot")
    return render(range_of(parameter), _) if kind_of(parameter) in ("int", "decimal") else ""


def _choices(parameter: MissionParameter) -> tuple[tuple[Any, str], ...]:
    if parameter.choices:
        return tuple(parameter.choices)
    return ((True, _("Yes")), (False, _("No"))) if kind_of(parameter) == "choice" else ()
