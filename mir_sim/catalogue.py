"""The actions that missions are made of, as /actions shows them: those that are simulated."""

from __future__ import annotations

from typing import Any

from mir_sim.missions import DEFAULT_GROUP

# Action type → name, help and parameters as (id, name, type, default).
_ACTIONS: dict[str, tuple[str, str, tuple[tuple[str, str, str, Any], ...]]] = {
    "move": (
        "Move",
        "Drive to a position",
        (
            ("position", "Position", "Reference", None),
            ("cart_entry_position", "Cart entry position", "Selection", "main"),
            ("main_or_entry_position", "Main or entry position", "Selection", "main"),
            ("marker_entry_position", "Marker entry position", "Selection", "entry"),
            ("retries", "Retries", "Integer", 10),
            ("distance_threshold", "Distance threshold", "Float", 0.1),
        ),
    ),
    "move_to_position": (
        "Move to coordinate",
        "Drive to a coordinate",
        (
            ("x", "X", "Float", 0.0),
            ("y", "Y", "Float", 0.0),
            ("orientation", "Orientation", "Float", 0.0),
            ("retries", "Retries", "Integer", 10),
            ("distance_threshold", "Distance threshold", "Float", 0.1),
        ),
    ),
    "docking": (
        "Docking",
        "Dock to a marker",
        (
            ("marker", "Marker", "Reference", None),
            ("marker_type", "Marker type", "Reference", "mirconst-guid-0000-0001-marker000001"),
            ("retries", "Retries", "Integer", 10),
            ("max_linear_speed", "Maximum speed", "Float", 0.25),
        ),
    ),
    "charging": (
        "Charging",
        "Charge the battery",
        (
            ("minimum_time", "Minimum time", "Duration", "00:10:00.000000"),
            ("minimum_percentage", "Minimum percentage", "Integer", 10),
            ("charge_until_new_mission", "Charge until new mission in queue", "Boolean", True),
        ),
    ),
    "wait": ("Wait", "Wait for a time", (("time", "Time", "Duration", "00:00:05.000000"),)),
    "set_plc_register": (
        "Set PLC register",
        "Write a PLC register",
        (
            ("register", "Register", "Integer", 1),
            ("action", "Action", "Selection", "set"),
            ("value", "Value", "Float", 0.0),
        ),
    ),
    "prompt_user": (
        "Prompt user",
        "Ask a person and wait for the answer",
        (
            ("question", "Question", "String", ""),
            ("user_group", "User group", "Reference", None),
            ("timeout", "Timeout", "Duration", "00:10:00.000000"),
        ),
    ),
}


def parameter(identifier: str, name: str, kind: str, default: Any) -> dict[str, Any]:
    return {
        "id": identifier,
        "name": name,
        "type": kind,
        "help": "",
        "constraints": {"default": default},
        "dependencies": {},
    }


def parameter_type(action_type: str, identifier: str) -> str:
    """The type of an action's parameter; "String" when the action or the parameter is unknown."""
    for one, _, kind, _ in _ACTIONS.get(action_type, ("", "", ()))[2]:
        if one == identifier:
            return kind
    return "String"


def definition(action_type: str) -> dict[str, Any] | None:
    """The definition of an action, or None when there is no such action."""
    if action_type not in _ACTIONS:
        return None
    name, text, parameters = _ACTIONS[action_type]
    return {
        "action_type": action_type,
        "name": name,
        "description": text,
        "help": text,
        "mission_group_id": DEFAULT_GROUP,
        "descriptions": [],
        "parameters": [parameter(*one) for one in parameters],
    }


def definitions() -> list[dict[str, Any]]:
    return [found for action_type in _ACTIONS if (found := definition(action_type)) is not None]
