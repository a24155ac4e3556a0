"""How a classic fleet words its orders and its robots, in the words of a robot's own REST API.

Of fleets' software 2.13 to 3.3; other words for states are unknown ones, which are neither an end nor an error.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from types import MappingProxyType
from typing import Any

from app.domain.robot import QueueState, RobotState, RobotStatus, Vehicle
from app.mir import parse
from app.mir.robot_vocabulary import USER_REQUEST
from app.mir.texts import clean

# Sent to a robot counts as waiting, as it does not run yet. Cancelled and failed are one word.
ORDER_STATES = MappingProxyType(
    {
        "Pending": QueueState.PENDING.value,
        "Outbound": QueueState.PENDING.value,
        "Executing": QueueState.EXECUTING.value,
        "Done": QueueState.DONE.value,
        "Aborted": QueueState.ABORTED.value,
        "Invalid": QueueState.ABORTED.value,
    }
)
_NAMES = {"ordered": "order_time", "started": "start_time", "finished": "finish_time"}

# ``fleet_state`` by its number, as its text depends on the language. None: as the robot's own state says.
_FLEET_STATES: Mapping[int, RobotState | None] = {
    4: RobotState.EMERGENCY_STOP,
    5: RobotState.ERROR,
    6: RobotState.STARTING,
    8: RobotState.MANUAL_CONTROL,
    9: RobotState.PAUSE,
    10: RobotState.UNKNOWN,  # low battery: it gets no orders
    11: RobotState.READY,
    12: RobotState.DOCKED,  # charging
    13: RobotState.READY,  # on its way to a place to wait
    14: RobotState.EXECUTING,  # a mission of its own
    15: RobotState.EXECUTING,
    18: RobotState.STARTING,  # synchronizing
    19: RobotState.STARTING,
    20: RobotState.UNKNOWN,  # evacuating
    21: RobotState.UNKNOWN,
}
_FREE, _BUSY = (11, 13), (14, 15)


def order_in_robot_words(order: parse.Object, own_user: str, user_name: str, names: Mapping[str, str]) -> parse.Object:
    """An order as a robot's queue item. ``own_user``: guid of the app's user, who is called ``user_name``; any other
    user is called by the guid. ``names``: of the fleet's robots by their ids."""
    found = order | {own: order[name] for own, name in _NAMES.items() if name in order}
    if "state" in order:
        found["state"] = clean(order["state"], 40).capitalize()
    if found.get("state") == "Aborted" and "start_time" in order and parse.instant(order["start_time"]) is None:
        found["message"] = USER_REQUEST  # what has not begun can't have failed
    parameters = order.get("parameters")
    if isinstance(parameters, dict):
        found["parameters"] = parameters.get("data")
    creator = clean(order.get("created_by_id"), 80)
    name = clean(order.get("created_by_name"), 80)
    found["created_by_name"] = name or (user_name if creator == own_user else creator)
    vehicle = "" if order.get("robot_id") in (0, None) else parse.text_or_none(order["robot_id"]) or ""
    return found | {"vehicle": vehicle, "vehicle_name": names.get(vehicle, "")}


def as_text(value: Any) -> str:
    """A parameter's value, which fleets take as text."""
    return value if isinstance(value, str) else json.dumps(value)


def vehicle(listed: parse.Object) -> Vehicle:
    """A robot as the fleet lists it. The name is not in all answers about one robot; its status has it too."""
    name = listed.get("name") or parse.part(listed, "status").get("robot_name")
    return Vehicle(
        parse.text_or_none(listed.get("id")) or "",
        clean(name, 80),
        parse.text_or_none(listed.get("serial_number")),
        clean(listed.get("robot_model"), 80) or None,
        clean(listed.get("ip"), 80),
    )


def has_contact(listed: parse.Object) -> bool:
    """One that is unavailable keeps its last status, so that shows nothing."""
    return parse.int_or_none(listed.get("fleet_state")) in _FLEET_STATES


def vehicle_status(listed: parse.Object, mode: str, date: datetime | None, elapsed_s: float) -> RobotStatus:
    """``mode``: the fleet's own state if it gives no orders, else "". Raises Unreadable."""
    shown = parse.part(listed, "status")
    own: dict[str, Any] = {
        "state_text": shown.get("state_text") or "",
        "mission_queue_id": None,  # of the robot's own queue
        "user_prompt": _prompt(shown.get("user_prompt")),
        "robot_name": listed.get("name") or shown.get("robot_name"),
        "robot_model": listed.get("robot_model"),
        "serial_number": listed.get("serial_number"),
    }
    software = clean(shown.get("software_version"), 40) or None
    status = parse.status(shown | own, software=software, date=date, elapsed_s=elapsed_s)
    number = parse.int_or_none(listed.get("fleet_state"))
    state = _FLEET_STATES.get(number or 0) or RobotState.UNKNOWN
    if mode and number in (*_FREE, *_BUSY):
        state = RobotState.UNKNOWN
    return replace(status, state=state, state_text=mode or clean(listed.get("fleet_state_text"), 80))


def _prompt(value: Any) -> Any:
    """Always an object, also without a question."""
    if not isinstance(value, dict) or not value.get("has_request"):
        return None
    timeout = value.get("timeout")
    return value | {"timeout": timeout.get("secs") if isinstance(timeout, dict) else timeout}
