"""What takes the missions of a simulated site: its robots themselves, or a fleet above them (``pytest --target classic``)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import pytest

from app.mir.enterprise_vocabulary import number_of
from mir_sim import SimulatedRobot
from mir_sim.fleets import KINDS, ClassicKnobs, SimulatedFleet, make_fleet
from mir_sim.fleets.classic import ClassicFleet
from mir_sim.fleets.enterprise import EnterpriseFleet
from mir_sim.fleets.orders import Order, Vehicle
from mir_sim.machine import Machine
from mir_sim.mission_queue import ItemState, QueueItem
from mir_sim.site import Row

ROBOT = "robot"
TARGETS = (ROBOT, *KINDS)
chosen = ROBOT  # of tests that don't say which

# Where fleets have what a robot has elsewhere: what a test plans for a request holds for every target.
_WHERE = (
    ("/mission_scheduler", "/mission_queue"),
    ("/serial-order-status/snapshot", "/mission_queue/search"),
    ("/serial-order", "/mission_queue"),
    ("/order", "/mission_queue"),
    ("/site/mission", "/missions"),
    ("/robots", "/status"),
    ("/system/version", "/users/me"),
)


def as_robots_have_it(path: str, machine: Machine) -> str:
    """The path of a robot for a request with the same meaning. Orders have their numbers in it."""
    for own, robots in _WHERE:
        if path == own or path.startswith(f"{own}/"):
            return robots if robots == "/status" else robots + _with_number(path[len(own) :], machine)
    return path


def _with_number(rest: str, machine: Machine) -> str:
    order = isinstance(machine, EnterpriseFleet) and _order_with(machine, rest.removeprefix("/"))
    if order:
        return f"/{order.number}"
    if isinstance(machine, EnterpriseFleet):
        return "/search" if rest else rest  # it is asked for what may not be there
    number = rest.removeprefix("/")
    return f"/{int(number) - 1}" if number.isdecimal() else rest  # the first is its check-up's


def _order_with(fleet: EnterpriseFleet, id_: str) -> Order | None:
    """Also by the id of its phase."""
    serial = fleet.order(id_) or next(iter(fleet.phase(id_) or ()), None)
    return serial.phases[0].order if serial is not None else None


_EVENTS = "serial-order-status-events"
_ROBOTS_WORDS = {"Finished": "Done"}


def numbers(number: int, machine: Machine) -> set[int]:
    """That of an item, and the app's."""
    order = machine.book.get(number) if isinstance(machine, EnterpriseFleet) else None
    return {number} | ({OrderItem(machine, order).id} if order is not None else set())


def each_item(answer: Any, machine: Machine, change: Callable[[int, dict], dict]) -> Any:
    """An answer about items or orders, with those fields changed that ``change`` returns for an item with this number, by a robot's
    names and words."""
    if isinstance(answer, list):
        return [each_item(entry, machine, change) for entry in answer]
    if not isinstance(answer, dict):
        return answer
    if _EVENTS in answer:
        return answer | {_EVENTS: each_item(answer[_EVENTS], machine, change)}
    if not isinstance(machine, EnterpriseFleet):
        return answer | change(answer.get("id", 0) - isinstance(machine, ClassicFleet), answer)  # as in paths
    state = "order-status" if "order-status" in answer else "state"
    order = _order_with(machine, answer.get("serial-order-id") or answer.get("order-id") or "")
    if state not in answer or order is None:
        return answer
    word = _ROBOTS_WORDS.get(answer[state], answer[state])
    found = change(order.number, {"state": word})
    return answer | ({state: found["state"]} if found.get("state", word) != word else {})


def order(fleet: SimulatedFleet, robot: SimulatedRobot, mission_id: str, person: Row, description: str) -> int:
    """Somebody orders a mission for a robot at its fleet; returns the order's number."""
    vehicle = next(each for each in fleet.vehicles if each.robot is robot)
    if isinstance(fleet, EnterpriseFleet):
        made = fleet.order_of_somebody(mission_id, vehicle, id_=description).phase.order
        return OrderItem(fleet, made).id
    own = {"wanted": vehicle, "description": description}
    return fleet.book.submit(fleet.new_guid(), mission_id, person, fleet.now, **own).number


def cancel_all(fleet: SimulatedFleet, robot: SimulatedRobot) -> None:
    """Somebody cancels all orders for a robot."""
    for order in fleet.book.open:
        if order.wanted is not None and order.wanted.robot is robot:
            fleet.book.cancel(order, fleet.now)


__all__ = [
    "CHARGED",
    "DESCRIBED",
    "NUMBERED",
    "OWN_ADDRESS",
    "OWN_CLOCK",
    "OWN_MISSIONS",
    "OWN_NETWORK",
    "OWN_QUEUE",
    "OWN_WORDS",
    "READ_AT_ONCE",
    "SHOWS_CHARGING",
    "SORTED",
    "UNSORTED",
]  # for stories

# Of stories that can't be about a fleet, and of those about what only one kind of fleet may do.
OWN_QUEUE = pytest.mark.only_for(
    ROBOT, reason="no robot of a fleet has a queue of its own that the app reads or clears"
)
READ_AT_ONCE = pytest.mark.only_for(ROBOT, reason="the next call continues a search among a fleet's orders")
OWN_ADDRESS = pytest.mark.only_for(ROBOT, reason="a robot of a fleet has no address, password or machine of its own")
OWN_MISSIONS = pytest.mark.only_for(ROBOT, reason="robots of a fleet have the same missions")
OWN_CLOCK = pytest.mark.only_for(ROBOT, reason="robots of a fleet have one time for the app, the fleet's")
CHARGED = pytest.mark.only_for(ROBOT, "enterprise", reason="a classic fleet gives no order to a robot with low battery")
_NEWEST = "a classic fleet's newest order of a robot is not known where it neither sorts nor searches"
SORTED = pytest.mark.only_for(ROBOT, "enterprise", reason=_NEWEST)
UNSORTED = pytest.mark.only_for("classic", reason=_NEWEST)
OWN_NETWORK = pytest.mark.only_for(ROBOT, reason="a fleet is reached for all of its robots or for none")
OWN_WORDS = pytest.mark.only_for(ROBOT, reason="its check-up has found what a fleet gives back, before the first start")
DESCRIBED = pytest.mark.only_for(
    ROBOT, "classic", reason="orders of Fleet Enterprise are known by ids, not descriptions"
)
SHOWS_CHARGING = pytest.mark.only_for(
    ROBOT, "classic", reason="Fleet Enterprise does not show that a robot charges in a mission of the app"
)
NUMBERED = pytest.mark.only_for(ROBOT, "classic", reason="Fleet Enterprise has no numbers, and takes an id only once")


def above(robots: Sequence[SimulatedRobot], target: str) -> SimulatedFleet | None:
    """A fleet whose robots show in their own queues what an order was sent with, so that what ran is seen there for every target."""
    if target == ROBOT or not robots:
        return None
    if target == "classic":
        return make_fleet(target, list(robots), knobs=ClassicKnobs(description_on_robot="posted"))
    fleet = make_fleet(target, list(robots))

    def id_of(order: Order) -> str:
        found = fleet.phase(order.guid)
        return found[0].id if found else ""

    fleet.book._description_on_robot = id_of
    return fleet


def give_identity(fleet: SimulatedFleet, user: str) -> str:
    """What tells it from other fleets; that ``user`` is the app's own."""
    if isinstance(fleet, EnterpriseFleet):
        return fleet.name
    users = fleet.site.table("/users")
    row = next(row for row in users if row["username"] == user)
    users.remove(row["guid"])
    return str(users.add({**row, "guid": fleet.new_guid()})["guid"])


@dataclass(eq=False)
class OrderItem:
    """An order of a fleet, as the robot's item that it becomes: what a test looks at for every target."""

    fleet: SimulatedFleet
    order: Order

    @property
    def id(self) -> int:
        """As the app knows it, if it does."""
        with suppress(ValueError):  # somebody else's id
            return number_of(self.description) if isinstance(self.fleet, EnterpriseFleet) else self.order.number
        return self.order.number

    @property
    def description(self) -> str:
        return self.fleet.book._description_on_robot(self.order)

    @property
    def mission_id(self) -> str:
        return self.order.mission_id

    @property
    def parameters(self) -> list[Row]:
        return self.order.parameters

    @property
    def priority(self) -> int:
        """1 before others."""
        return int(self.order.is_urgent or self.order.priority)

    @property
    def item(self) -> QueueItem | None:
        return self.order.item

    @property
    def state(self) -> ItemState:
        found = self.fleet.phase(self.order.guid) if isinstance(self.fleet, EnterpriseFleet) else None
        if found is not None and found[0].is_aborting and not self.order.state.is_end:
            return ItemState.ABORT
        if self.item is not None:
            return self.item.state
        return ItemState.ABORTED if self.order.state.is_end else ItemState.PENDING

    @property
    def ordered(self) -> str:
        """At the fleet: the robot gets it when it is free."""
        return self.fleet.clock.stamp(self.order.ordered)

    @property
    def started(self) -> str | None:
        return self.item and self.item.started

    @started.setter
    def started(self, stamp: str) -> None:
        """By the clock of the fleet, whose times are the order's."""
        fleet, moment = self.fleet, datetime.fromisoformat(stamp).replace(tzinfo=self.fleet.clock.tz)
        self.order.started = fleet.now + (moment - fleet.clock.utc(fleet.now)).total_seconds()

    @property
    def finished(self) -> str | None:
        """By the clock of the robot, also of what it never had."""
        if self.item is not None:
            return self.item.finished
        return None if self.order.ended is None else self.fleet.clock.stamp(self.order.ended)


def number_in_paths(item: OrderItem | QueueItem) -> int:
    """As ``as_robots_have_it`` and ``each_item`` have it: a classic fleet's are counted from the app's first."""
    if isinstance(item, OrderItem):
        return item.order.number - isinstance(item.fleet, ClassicFleet)
    return item.id


class OrdersOf:
    """What a fleet was ordered for one robot, oldest first, and what is in the robot's queue besides. Nothing leaves it."""

    def __init__(self, fleet: SimulatedFleet, vehicle: Vehicle) -> None:
        self._fleet, self._vehicle = fleet, vehicle
        self._found: list[OrderItem | QueueItem] = []
        self._orders, self._items = 0, 0  # looked at

    def _look(self) -> list[OrderItem | QueueItem]:
        orders = [order for order in self._fleet.book if order.number > self._orders]
        self._found += [OrderItem(self._fleet, order) for order in orders if order.wanted is self._vehicle]
        self._orders = max((order.number for order in orders), default=self._orders)
        items = [item for item in self._vehicle.robot.queue if item.id > self._items]
        self._found += [item for item in items if not item.fleet_schedule_guid]
        self._items = max((item.id for item in items), default=self._items)
        return self._found

    def __iter__(self) -> Iterator[OrderItem | QueueItem]:
        return iter(self._look())

    def __len__(self) -> int:
        return len(self._look())
