"""Which parameters a mission wants when it is queued.

MiR's REST definition 3.5.4 has /missions/{guid}/definition, "the mission as an action definition", but not its content,
so its parameters are read like those of /actions/{type}. If that gives nothing, the mission's actions are searched: a
parameter has an ``input_name`` there. Both are guesses, not recorded on a robot. The meaning of a value (a position, a
length, a percentage) follows from the action's parameter that it sets; their names are recorded.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from app.domain.message import message
from app.domain.robot import POSITIONS, MissionActions, MissionParameter
from app.mir.errors import Unreadable
from app.mir.parse import LONGEST_LIST, Object, float_or_none, int_or_none, part, some_objects, text_or_none
from app.mir.texts import clean

MOST_PARAMETERS = 50  # of a mission: each is a field on the screen
MOST_STOPS = 50  # of a mission: positions that it drives to
# Parameter of an action: its unit, and its range if the robot gives none.
_QUANTITIES: Mapping[str, tuple[str, float | None, float | None]] = MappingProxyType(
    {
        "x": ("m", None, None),
        "y": ("m", None, None),
        "orientation": ("°", -180, 180),
        "distance_threshold": ("m", 0, None),
        "minimum_percentage": ("%", 0, 100),
        "max_linear_speed": ("m/s", 0, None),
        "retries": ("", 0, None),
        "blocked_path_timeout": ("s", 0, None),
    }
)

CHARGING = "charging"  # types of actions
WAY_TO_CHARGER = frozenset(
    {CHARGING, "docking", "move", "move_to_position", "relative_move", "adjust_localization", "wait"}
)
_ELSEWHERE = frozenset(
    {"move_to_position", "load_mission"}
)  # drives to coordinates, or to the positions of another mission


def from_definition(value: Any) -> list[MissionParameter]:
    """The parameters named by a mission's definition, which some software wraps into a list of one. Raises Unreadable for too many."""
    definitions = value if isinstance(value, list) else [value]
    return _unique(
        _parameter(entry)
        for definition in definitions[:LONGEST_LIST]
        if isinstance(definition, dict)
        for entry in some_objects(definition.get("parameters"))
    )


def from_actions(value: Any) -> list[MissionParameter]:
    """The parameters of a mission's actions with an input; ``type`` is its meaning for the action ("position", "time"
    …). Raises Unreadable for too many."""
    return _unique(
        _setting(
            _parameter({"id": entry.get("input_name"), "type": entry.get("id"), "default": entry.get("value")}),
            clean(entry.get("id"), 40),
        )
        for action in some_objects(value)
        for entry in some_objects(action.get("parameters"))
    )


def actions(value: Any) -> MissionActions:
    """Whether a mission with these actions charges the robot and does nothing else but go there, and its positions."""
    in_order = sorted(some_objects(value), key=lambda action: int_or_none(action.get("priority")) or 0)
    types = {str(action.get("action_type")) for action in in_order}
    charges = CHARGING in types and types <= WAY_TO_CHARGER and len(value) <= LONGEST_LIST
    return MissionActions(charges, tuple(goal for action in in_order for goal in _goals(action))[:MOST_STOPS])


def _goals(action: Object) -> list[str]:
    if action.get("action_type") in _ELSEWHERE:
        return [""]
    return [
        "" if entry.get("input_name") else text_or_none(entry.get("value")) or ""
        for entry in some_objects(action.get("parameters"))
        if entry.get("id") in POSITIONS
    ][:1]


def with_meaning(defined: Sequence[MissionParameter], of_actions: Sequence[MissionParameter]) -> list[MissionParameter]:
    """Parameters of a definition, completed by the mission's actions. The queue takes the names of the actions: a
    definition without any of them means something else, and then those of the actions count."""
    sets = {parameter.name: parameter.sets for parameter in of_actions}
    if sets and not any(parameter.name in sets for parameter in defined):
        return list(of_actions)
    return [_setting(parameter, sets.get(parameter.name, "")) for parameter in defined]


def _setting(parameter: MissionParameter, sets: str) -> MissionParameter:
    unit, low, high = _QUANTITIES.get(sets, ("", None, None))
    return replace(
        parameter,
        sets=sets,
        unit=unit,
        minimum=low if parameter.minimum is None else parameter.minimum,
        maximum=high if parameter.maximum is None else parameter.maximum,
    )


def _unique(found: Iterable[MissionParameter]) -> list[MissionParameter]:
    by_name: dict[str, MissionParameter] = {}
    for parameter in found:
        if parameter.name:
            by_name.setdefault(parameter.name, parameter)
    if len(by_name) > MOST_PARAMETERS:
        raise Unreadable(
            problem=message(
                "{what} has more than {n} entries", what=message("the list of parameters"), n=MOST_PARAMETERS
            )
        )
    return list(by_name.values())


def _parameter(value: Object) -> MissionParameter:
    constraints = part(value, "constraints")
    choices = constraints.get("choices", value.get("choices"))
    default = next(
        (place[key] for place, key in ((constraints, "default"), (value, "default"), (value, "value")) if key in place),
        None,
    )
    labelled = tuple(
        (_plain(entry.get("value")), clean(entry.get("name") or str(entry.get("value"))))
        for entry in some_objects(choices)
    )
    return MissionParameter(
        name=clean(value.get("input_name")) or clean(value.get("id")),
        label=clean(value.get("name") or value.get("label")),
        type=clean(value.get("type"), 40),
        default=clean(default) if isinstance(default, str) else _plain(default),
        minimum=float_or_none(constraints.get("minimum")),
        maximum=float_or_none(constraints.get("maximum")),
        choices=labelled,
    )


def _plain(value: Any) -> Any:
    if isinstance(value, str):
        return clean(value)
    return value if isinstance(value, bool | int | float) else None
