"""The orders of Fleet Enterprise: a serial order has phases, each a mission, which one robot runs one after the other."""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from zoneinfo import ZoneInfo

from mir_sim.fleets.orders import Order, OrderState, Vehicle
from mir_sim.mission_queue import USER_ABORT, QueueAction
from mir_sim.site import Row

PRIORITIES = {"Low": -1, "Medium": 0, "High": 1}
ORDER_STATUS = {
    OrderState.WAITING: "Pending",
    OrderState.SENT: "Outbound",
    OrderState.RUNNING: "Executing",
    OrderState.STOPPING: "Aborting",
    OrderState.DONE: "Finished",
    OrderState.ABORTED: "Aborted",
    OrderState.INVALID: "Invalid",
}
API_KEYS = {"mir_scheduler": "Scheduler", "mir_other": "Other system"}  # the key, and the name that it has in the fleet
Stamp = Callable[[float], str]


@dataclass(frozen=True)
class Origin:
    """Who has made an order, and what kind of order it is: User, Staging, Charging, Evacuation or GoTo."""

    api_key_guid: str | None = None
    api_key_name: str | None = None
    user_guid: str | None = None
    user_name: str | None = None
    kind: str = "User"

    @classmethod
    def of_key(cls, name: str) -> Origin:
        """A client, by the name of its API key."""
        return cls(api_key_guid=str(uuid.uuid5(uuid.NAMESPACE_OID, name)), api_key_name=name)

    @property
    def event_type(self) -> str:
        """``order-type`` of events, which have words of their own (seen in a client)."""
        if self.kind == "User":
            return "Ui" if self.api_key_name is None else "Api"
        return {"Staging": "Autostaging", "Charging": "Autocharging"}.get(self.kind, self.kind)


@dataclass(eq=False)
class Phase:
    """One mission of a serial order.

    Attributes:
        order_id: the key of GET /order/{id}; also the ``fleet_schedule_guid`` of the robot's item.
        order: in the fleet's book; None until the phase before has ended.
        fallback: the order for the fallback mission, once this phase was aborted.
        event: the last state that events have said, and since when it is so.
        at_end: as GET /order/{id} shows it once the whole order has ended.
    """

    mission_id: str | None
    arguments: list[Row]
    fallback_mission_id: str | None
    order_id: str
    order: Order | None = None
    fallback: Order | None = None
    event: tuple[str, float] = ("Created", 0.0)
    at_end: Row | None = None

    def shown(self) -> Row:
        """As it was posted."""
        return {
            "mission-id": self.mission_id,
            "arguments": self.arguments,
            "fallback-mission-id": self.fallback_mission_id,
            "order-id": self.order_id,
        }


@dataclass(eq=False)
class SerialOrder:
    """An order as clients make it.

    Attributes:
        index: of the phase whose turn it is.
        earliest: simulated second before which it doesn't begin, and the time that was posted.
        is_aborting: somebody has asked for its end.
        ended: when its last mission had ended.
    """

    id: str
    priority: str
    earliest: tuple[float, str | None]
    wanted: Vehicle | None
    phases: list[Phase]
    created: float
    origin: Origin = field(default_factory=Origin)
    index: int = 0
    is_aborting: bool = False
    ended: float | None = None
    event: tuple[str, float] = ("Created", 0.0)

    @property
    def phase(self) -> Phase:
        """The one whose turn it is, or that was the last."""
        return self.phases[self.index]

    @property
    def vehicle(self) -> Vehicle | None:
        """Its robot: the one that it is for, or that has had a phase of it."""
        return next((one.order.vehicle for one in self.phases if one.order and one.order.vehicle), self.wanted)

    def status(self, phase: Phase, now: float) -> str:
        """``order-status`` of a phase."""
        order = phase.order
        if order is None:  # of an order that has ended, a phase that didn't come any more
            return "Waiting" if self.ended is None else "Aborted"
        if order.state.is_end:
            return ORDER_STATUS[order.state]
        if self.is_aborting:
            return "Aborting"
        return "Waiting" if order.state is OrderState.WAITING and order.earliest > now else ORDER_STATUS[order.state]

    def finished(self, phase: Phase) -> float | None:
        """When a phase has ended; one that didn't come any more, with the order."""
        return phase.order.ended if phase.order is not None else self.ended

    def state(self, phase: Phase, now: float) -> str:
        """``state`` of a phase in events, which have other words: the robot's pauses and questions are among them."""
        status = self.status(phase, now)
        if phase.mission_id is None and phase is self.phase and status == "Waiting":
            return "WaitingForInput"  # in MiR's example, with the message below
        if status == "Executing" and phase.order is not None and phase.order.vehicle is not None:
            robot = phase.order.vehicle.robot
            return "WaitingForInput" if robot.prompt is not None else "Paused" if robot.paused else status
        return {"Waiting": "Created" if phase.order is None else "Pending", "Invalid": "Aborted"}.get(status, status)

    def note(self, now: float) -> None:
        """Remember since when the states of events are as they are."""
        for phase in self.phases:
            phase.event = _since(phase.event, self.state(phase, now), now)
        falls_back = self.phase.fallback is not None  # until that has ended too
        self.event = _since(self.event, "Aborting" if falls_back else self.phase.event[0], now)

    def shown(self) -> Row:
        """As GET /serial-order/{id} shows it: what was posted, without any state."""
        return {
            "id": self.id,
            "priority": self.priority,
            "earliest-start-time": self.earliest[1],
            "robot-id": self.wanted.guid if self.wanted is not None else None,
            "phases": [phase.shown() for phase in self.phases],
        }

    def events(self, stamp: Stamp) -> Iterator[Row]:
        """Its last events: of the whole order, of each phase, and of a fallback mission that runs."""
        yield self._event(None, self.phase.mission_id, self.event, None, None, stamp)
        for index, phase in enumerate(self.phases):
            message = "Missing MissionId" if phase.mission_id is None else (phase.order and phase.order.message) or None
            yield self._event(index, phase.mission_id, phase.event, message, False, stamp)
            if phase.fallback is not None:
                state = ORDER_STATUS[phase.fallback.state]
                since = phase.fallback.started or phase.fallback.ordered
                yield self._event(index, phase.fallback_mission_id, (state, since), None, True, stamp)

    def _event(
        self,
        index: int | None,
        mission_id: str | None,
        event: tuple[str, float],
        message: str | None,
        is_fallback: bool | None,
        stamp: Stamp,
    ) -> Row:
        return {
            "serial-order-id": self.id,
            "phase-index": index,
            "mission-id": mission_id,
            "state": event[0],
            "state-change-timestamp": stamp(event[1]),
            "robot-id": self.vehicle.guid if self.vehicle is not None else "",  # the definition has no null here
            "message": message,
            "is-fallback": is_fallback,
            "order-type": self.origin.event_type,
        }


def _since(event: tuple[str, float], state: str, now: float) -> tuple[str, float]:
    return event if event[0] == state else (state, now)


def order_shown(serial: SerialOrder, phase: Phase, now: float, mission_name: str, stamp: Stamp) -> Row:
    """A phase as GET /order/{id} shows it."""
    order, origin, vehicle = phase.order, serial.origin, serial.vehicle

    def at(seconds: float | None) -> str | None:
        return None if seconds is None else stamp(seconds)

    return {
        "order-id": phase.order_id,
        "order-type": origin.kind,
        "mission-id": phase.mission_id,
        "mission-name": mission_name,
        "mission-arguments": json.dumps(phase.arguments) if phase.arguments else None,
        "order-status": serial.status(phase, now),
        "order-created": stamp(serial.created),
        "order-queued": at(order.ordered if order is not None else None),
        "order-started": at(order.started if order is not None else None),
        "order-finished": at(serial.finished(phase)),
        "robot-id": vehicle.guid if vehicle is not None else None,
        "robot-name": vehicle.robot.name if vehicle is not None else None,
        "order-priority": serial.priority,
        "user-guid": origin.user_guid,
        "user-name": origin.user_name,
        "api-key-guid": origin.api_key_guid,
        "api-key-name": origin.api_key_name,
        "actions": list(_actions(order)),
    }


def _actions(order: Order | None) -> Iterator[Row]:
    if order is None or order.item is None or order.vehicle is None:
        return
    zone = ZoneInfo(order.vehicle.robot.clock.zone)
    for action in order.item.actions:
        began, ended = _utc(action.started, zone), _utc(action.finished, zone)
        is_last = action is order.item.actions[-1]
        yield {
            "action-id": action.id,
            "action-type": action.action_type,
            "action-status": _action_status(action, order.state if is_last else OrderState.DONE),
            "action-text": action.message or None,
            "action-start-time": _text(began),
            "action-end-time": _text(ended),
            "action-duration": span((ended - began).total_seconds()) if began and ended else None,
        }


def _action_status(action: QueueAction, state: OrderState) -> str:
    if action.finished is None:
        return "Executing"
    if state is not OrderState.ABORTED or not action.message:
        return "Succeeded"
    return "Aborted" if action.message == USER_ABORT else "Failed"


def _utc(local: str | None, zone: ZoneInfo) -> datetime | None:
    """A time of the robot's own records."""
    return None if local is None else datetime.fromisoformat(local).replace(tzinfo=zone).astimezone(UTC)


def _text(moment: datetime | None) -> str | None:
    return None if moment is None else utc_text(moment)


def utc_text(moment: datetime) -> str:
    """With as many digits after the second as it has, as .NET writes times."""
    whole, _, digits = moment.replace(tzinfo=None).isoformat().partition(".")
    return f"{whole}.{digits.rstrip('0')}Z" if digits else f"{whole}Z"


def span(seconds: float) -> str:
    """A ``date-span``: hours, minutes and seconds, after a day with the days in front, as .NET writes them (guess)."""
    days, rest = divmod(max(0, int(seconds)), 86_400)
    return f"{f'{days}.' if days else ''}{rest // 3600:02d}:{rest // 60 % 60:02d}:{rest % 60:02d}"
