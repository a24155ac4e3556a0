"""How Fleet Enterprise words its orders and its robots: answers of ``/api/v1`` as the app's values."""

from __future__ import annotations

import re
import uuid
from collections.abc import Sequence
from datetime import datetime
from types import MappingProxyType
from typing import Any

from app.domain.message import message
from app.domain.robot import (
    MissionInfo,
    MissionParameter,
    QueueItem,
    QueueState,
    RobotProblem,
    RobotState,
    RobotStatus,
    UserPrompt,
    Vehicle,
)
from app.mir import parse
from app.mir.errors import Unreadable
from app.mir.texts import clean, resolve

OWN_BITS = 2**53 - 1  # of a token's UUID: the largest number that the database keeps

_STATES = MappingProxyType(  # of orders and of their events; "Updated" is none
    {
        **dict.fromkeys(("created", "waiting", "pending", "outbound"), QueueState.PENDING),
        **dict.fromkeys(("executing", "paused", "waitingforinput"), QueueState.EXECUTING),
        "aborting": QueueState.ABORTING,
        "finished": QueueState.DONE,
        **dict.fromkeys(("aborted", "invalid"), QueueState.ABORTED),
    }
)
_END_STATES = MappingProxyType(  # of robots, other than those in which they work
    {
        "manual control": RobotState.MANUAL_CONTROL,
        "key state: manual": RobotState.MANUAL_CONTROL,
        "error": RobotState.ERROR,
        "paused": RobotState.PAUSE,
        "protective stop": RobotState.EMERGENCY_STOP,
        "emergency stop": RobotState.EMERGENCY_STOP,
        "starting": RobotState.STARTING,
        "shutting down": RobotState.SHUTTING_DOWN,
    }
)
_IDLE = "idle"
_AT_WORK = (_IDLE, "operational")
_CHARGES, _STAGES = (
    ("autocharging", "charging"),
    ("autostaging", "staging"),
)  # types of orders that give way, in events and lists
PRIORITIES = ("Low", "Medium", "High")
_SPAN = re.compile(r"(?:(\d{1,4})\.)?(\d{1,6}):(\d{2}):(\d{2})(?:\.\d+)?")
_KINDS = {"position": "position", "markertype": ""}  # of arguments: the parameter of an action that they set


def number_of(token: str) -> int:
    """The app's number for the order with this id. Raises ValueError if it is no UUID."""
    return uuid.UUID(token).int & OWN_BITS or 1


def phase_of(token: str) -> str:
    """The id that the app gives to the order's only phase."""
    return str(uuid.uuid5(uuid.UUID(token), "phase 0"))


def seconds(span: Any) -> float | None:
    """A ``date-span``: hours, minutes and seconds, perhaps with days."""
    found = _SPAN.fullmatch(span) if isinstance(span, str) else None
    if found is None:
        return None
    days, hours, minutes, rest = (int(part or 0) for part in found.groups())
    return float(((days * 24 + hours) * 60 + minutes) * 60 + rest)


def wrapped(found: Any, name: str) -> list[parse.Object]:
    """The objects of a list that is wrapped in an object. Raises Unreadable."""
    return parse.objects(parse.object_(found, message("the answer")).get(name), message("the answer"))


# ---------------------------------------------------------------------- orders
def state_of(word: Any) -> QueueState:
    return _STATES.get(clean(word, 40).replace(" ", "").casefold(), QueueState.UNKNOWN)


def item_of_order(token: str, order: parse.Object, said: str) -> QueueItem:
    """``said``: the message that the order's events had. Raises Unreadable without a state."""
    if not clean(order.get("order-status"), 40):
        raise Unreadable(problem=message("the queue item has no state"))
    return QueueItem(
        id=number_of(token),
        state=state_of(order.get("order-status")),
        state_text=clean(order.get("order-status"), 40),
        mission_id=parse.text_or_none(order.get("mission-id")),
        message=said or _why(order),
        description=token,
        ordered=parse.instant(order.get("order-created")),
        started=parse.instant(order.get("order-started")),
        finished=parse.instant(order.get("order-finished")),
        created_by_name=clean(order.get("api-key-name") or order.get("user-name"), 80),
        vehicle=clean(order.get("robot-id"), 80),
        vehicle_name=clean(order.get("robot-name"), 80),
    )


def _why(order: parse.Object) -> str:
    """The text of the last action, where the order did not end well."""
    if state_of(order.get("order-status")) is not QueueState.ABORTED:
        return ""
    texts = (resolve(action.get("action-text")) for action in reversed(parse.some_objects(order.get("actions"))))
    return next(filter(None, texts), "")


def item_of_event(event: parse.Object) -> QueueItem | None:
    """None for an order whose id is not one of ours could be: no UUID."""
    token = clean(event.get("serial-order-id"), 80)
    try:
        number = number_of(token)
    except ValueError:
        return None
    return QueueItem(
        id=number,
        state=state_of(event.get("state")),
        state_text=clean(event.get("state"), 40) or "?",
        mission_id=parse.text_or_none(event.get("mission-id")),
        message=resolve(event.get("message")),
        description=token,
        vehicle=clean(event.get("robot-id"), 80),
    )


def one_of_each_order(events: Sequence[parse.Object]) -> dict[str, parse.Object]:
    """By the orders' ids the event of the whole order, or else of its first phase."""
    found: dict[str, parse.Object] = {}
    for event in events:
        token = clean(event.get("serial-order-id"), 80)
        if token and (event.get("phase-index") is None or token not in found):
            found[token] = event
    return found


def gives_way(event: parse.Object) -> bool:
    """An order that the fleet has made itself, and that ends when another comes."""
    return clean(event.get("order-type"), 40).casefold() in (*_CHARGES, *_STAGES)


# ---------------------------------------------------------------------- robots
def vehicle(identity: parse.Object) -> Vehicle:
    return Vehicle(
        clean(identity.get("robot-id"), 80),
        clean(identity.get("name"), 80),
        parse.text_or_none(identity.get("serial-number")),
        clean(identity.get("model"), 80) or None,
        clean(identity.get("ip"), 80),
    )


def status(
    robot: parse.Object, running: Sequence[parse.Object], prompt: UserPrompt | None, date: datetime | None, took: float
) -> RobotStatus:
    """``running``: events of the orders that the robot has begun: some give way to others."""
    identity, runtime = (parse.part(robot, name) for name in ("robot-identity", "runtime-data"))
    word = clean(robot.get("robot-end-state"), 80)
    return RobotStatus(
        state=_state(word.casefold(), running),
        state_text=word,
        battery_percentage=parse.battery(runtime.get("battery-percentage")),
        battery_time_remaining_s=seconds(runtime.get("battery-time-remaining")),
        robot_name=clean(identity.get("name"), 80),
        robot_model=clean(identity.get("model"), 80),
        serial_number=parse.text_or_none(identity.get("serial-number")),
        errors=tuple(_problem(entry) for entry in parse.some_objects(robot.get("errors"))),
        user_prompt=prompt,
        moved=parse.not_negative(runtime.get("moved")),
        uptime_s=seconds(runtime.get("uptime")),
        software=clean(identity.get("software-version"), 40) or None,
        date=date,
        elapsed_s=took,
    )


def heard_at(robot: parse.Object) -> str:
    """When the fleet has last heard of it; "" if it never has."""
    return clean(parse.part(robot, "runtime-data").get("timestamp"), 40)


def _state(word: str, running: Sequence[parse.Object]) -> RobotState:
    if word not in _AT_WORK:
        return _END_STATES.get(word, RobotState.UNKNOWN)
    types = {clean(event.get("order-type"), 40).casefold() for event in running}
    if types - {*_CHARGES, *_STAGES}:
        return RobotState.EXECUTING
    if types:
        return RobotState.DOCKED if types & {*_CHARGES} else RobotState.READY
    return RobotState.READY if word == _IDLE else RobotState.EXECUTING  # of something that is not the fleet's


def _problem(value: parse.Object) -> RobotProblem:
    return RobotProblem(
        parse.int_or_none(value.get("code")), resolve(value.get("description")), clean(value.get("module"), 80)
    )


def prompt(event: parse.Object) -> UserPrompt | None:
    return parse.user_prompt({**event, "guid": event.get("id"), "question": event.get("title")})


# ---------------------------------------------------------------------- missions
def mission(row: parse.Object) -> MissionInfo | None:
    guid = parse.text_or_none(row.get("id"))
    return MissionInfo(guid, clean(row.get("name"), 255) or guid) if guid else None


def parameter(argument: parse.Object) -> MissionParameter | None:
    name = clean(argument.get("name"), 255)
    kind = clean(argument.get("type"), 40)
    sets = _KINDS.get(kind.casefold(), "")
    return MissionParameter(name, type=kind, default=argument.get("default-value") or None, sets=sets) if name else None
