"""/mission_scheduler: the orders of a classic fleet."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from mir_sim.errors import ApiError, argument_error
from mir_sim.fleets.classic_view import fleet_of
from mir_sim.fleets.orders import Order, OrderState, Vehicle
from mir_sim.messages import Response
from mir_sim.resources.call import Call, Handlers
from mir_sim.resources.mission_queue import check_parameters

if TYPE_CHECKING:
    from mir_sim.fleets.classic import ClassicFleet

WORDS = {
    OrderState.WAITING: "Pending",
    OrderState.SENT: "Outbound",
    OrderState.RUNNING: "Executing",
    OrderState.STOPPING: "Executing",
    OrderState.DONE: "Done",
    OrderState.ABORTED: "Aborted",  # cancelled or failed: there is no other word, and no message
    OrderState.INVALID: "Invalid",
}


@dataclass(frozen=True)
class Shown:
    """An order as this fleet shows it."""

    fleet: ClassicFleet
    order: Order

    @property
    def state(self) -> str:
        knobs, word = self.fleet.knobs, WORDS[self.order.state]
        word = "Pending" if word == "Outbound" and not knobs.outbound else word
        return knobs.state_words.get(word, word)

    def summary(self) -> dict[str, Any]:
        number = self.order.number
        return {"url": f"/v2.0.0/mission_scheduler/{number}", "state": self.state, "id": number}

    def full(self) -> dict[str, Any]:
        fleet, order = self.fleet, self.order
        mission = fleet.site.table("/missions").get(order.mission_id)
        robot = order.vehicle or order.wanted
        return {
            "id": order.number,
            "state": self.state,
            "mission": f"/v2.0.0/missions/{order.mission_id}",
            "mission_id": order.mission_id,
            "mission_name": mission["name"] if mission else "",
            "order_time": fleet.moment(order.ordered),
            "earliest_start_time": fleet.moment(order.earliest),
            "start_time": fleet.moment(order.started),
            "finish_time": fleet.moment(order.ended),
            "priority": order.priority,
            "high_priority": order.is_urgent,
            "robot_id": robot.number if robot is not None else 0,
            "parameters": self._parameters(),
            "description": fleet.described(order, fleet.knobs.description),
            "fleet_schedule_guid": order.guid,
            "created_by": f"/v2.0.0/users/{order.created_by['guid']}",
            "created_by_id": order.created_by["guid"],
        }

    def _parameters(self) -> Any:
        """An object by the definition; the key is the one in that of 3.x."""
        known = {"object": {"data": self.order.parameters}, "list": self.order.parameters, "none": None}
        return known[self.fleet.knobs.parameters]

    def value(self, name: str) -> Any:
        if name == "id":  # without building the whole order: histories are long
            return self.order.number
        return self.state if name == "state" else (self.full() | self.summary())[name]


def list_orders(call: Call) -> list[Shown]:
    """The whole history, newest first."""
    fleet = fleet_of(call)
    return [Shown(fleet, order) for order in reversed(fleet.book)]


def _order(call: Call) -> Order:
    text = call.params["id"]
    order = fleet_of(call).book.get(int(text)) if text.isdecimal() and len(text) < 16 else None
    if order is None:
        raise ApiError(404)
    return order


def get_order(call: Call) -> dict[str, Any]:
    return Shown(fleet_of(call), _order(call)).full()


def _checked(call: Call, fields: dict[str, Any]) -> dict[str, Any]:
    """The fields of a body as an order has them. An unknown mission or robot is a wrong argument (guess)."""
    fleet = fleet_of(call)
    if "mission_id" in fields and fields["mission_id"] not in fleet.site.table("/missions"):
        raise argument_error("mission_id")
    names = {"mission_id": "mission_id", "priority": "priority", "high_priority": "is_urgent"}
    known = {own: fields[name] for name, own in names.items() if name in fields}
    if "robot_id" in fields:
        known["wanted"] = _wanted(fleet, fields["robot_id"])
    if "earliest_start_time" in fields:
        known["earliest"] = _earliest(fleet, fields["earliest_start_time"])
    return known


def _wanted(fleet: ClassicFleet, number: int) -> Vehicle | None:
    """0 means any robot."""
    found = next((one for one in fleet.vehicles if one.number == number), None)
    if number != 0 and found is None:
        raise argument_error("robot_id")
    return found


def _earliest(fleet: ClassicFleet, text: str) -> float:
    try:
        earliest = fleet.seconds_of(datetime.fromisoformat(text))
    except (ValueError, OverflowError):
        raise argument_error("earliest_start_time") from None
    return fleet.now if fleet.knobs.earliest_start == "ignored" else earliest


def post_order(call: Call) -> dict[str, Any]:
    """``priority``: the higher goes first (guess), and whatever is of ``high_priority`` before all others."""
    fleet, fields = fleet_of(call), call.fields()
    known = _checked(call, fields)
    parameters = fields.get("parameters", [])
    check_parameters(fleet.site, fields["mission_id"], parameters)
    user = fleet.site.table("/users").get(fields.get("created_by_id", call.asker["guid"]))
    if user is None:
        raise argument_error("created_by_id")
    description = fields.get("description", "")
    order = fleet.book.submit(
        fleet.new_guid(),
        known.pop("mission_id"),
        user,
        fleet.now,
        parameters=parameters,
        description=description,
        **known,
    )
    shown = Shown(fleet, order)
    return shown.summary() if fleet.knobs.answer == "short" else shown.full() | shown.summary()


def put_order(call: Call) -> dict[str, Any]:
    """Only a waiting order can be changed (guess: any other is refused)."""
    order, fields = _order(call), call.changes()
    known = _checked(call, fields)
    if order.state is not OrderState.WAITING:
        raise ApiError(400)
    for name, value in known.items():
        setattr(order, name, value)
    return get_order(call)


def delete_order(call: Call) -> Response | None:
    """Abort one order, wherever it is; it stays in the list. What an ended one answers is a knob."""
    fleet, order = fleet_of(call), _order(call)
    if order.state.is_end and fleet.knobs.delete_ended != 204:
        raise ApiError(fleet.knobs.delete_ended)
    fleet.book.cancel(order, fleet.now)
    return None


def delete_waiting(call: Call) -> None:
    """Abort the waiting orders, of all clients. Those that run continue."""
    fleet = fleet_of(call)
    for order in fleet.book.open:
        if order.state is OrderState.WAITING:
            fleet.book.cancel(order, fleet.now)


HANDLERS: Handlers = {
    ("get", "/mission_scheduler"): list_orders,
    ("post", "/mission_scheduler"): post_order,
    ("delete", "/mission_scheduler"): delete_waiting,
    ("get", "/mission_scheduler/{id}"): get_order,
    ("put", "/mission_scheduler/{id}"): put_order,
    ("delete", "/mission_scheduler/{id}"): delete_order,
}
