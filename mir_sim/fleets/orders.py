"""The orders of a fleet, and how they reach its robots: through the robots' own mission queues.

Times are simulated seconds of the fleet.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from mir_sim.mission_queue import ItemState, QueueItem
from mir_sim.robot import SimulatedRobot
from mir_sim.site import Row
from mir_sim.state import StateId
from mir_sim.steps import ChargeStep


class OrderState(Enum):
    """Where an order is. Each fleet has its own words for these."""

    WAITING = "waiting"  # at the fleet: for its time, or for a robot
    SENT = "sent"  # in the queue of its robot, which hasn't begun yet
    RUNNING = "running"
    STOPPING = "stopping"  # cancelled while it ran
    DONE = "done"
    ABORTED = "aborted"  # cancelled or failed
    INVALID = "invalid"  # its mission doesn't exist any more when its turn comes

    @property
    def is_end(self) -> bool:
        return self in (OrderState.DONE, OrderState.ABORTED, OrderState.INVALID)


STATE_OF_ITEM = {
    ItemState.PENDING: OrderState.SENT,
    ItemState.EXECUTING: OrderState.RUNNING,
    ItemState.ABORT: OrderState.STOPPING,
    ItemState.DONE: OrderState.DONE,
    ItemState.ABORTED: OrderState.ABORTED,
}


@dataclass(eq=False)
class Vehicle:
    """A robot of a fleet.

    Attributes:
        number: from 1.
        guid: the fleet's own for it.
        address: host and port at which it is reached.
        is_active: whether the fleet may use it.
        has_contact: whether the fleet hears it while it is online.
        free_since: when its last order ended.
        staging: the last of its queue's items by which the fleet sent it to where it waits.
    """

    number: int
    guid: str
    robot: SimulatedRobot
    address: str
    is_active: bool = True
    has_contact: bool = True
    group: int = 1
    description: str = ""
    free_since: float = 0.0
    staging: QueueItem | None = None

    @property
    def is_online(self) -> bool:
        """Whether the fleet reaches it."""
        return self.has_contact and self.robot.online

    @property
    def is_free(self) -> bool:
        """Whether it would begin an order now (guess): it is online and ready, and has no mission, or one that gives way to others."""
        robot = self.robot
        is_ready = robot.state in (StateId.READY, StateId.COMPLETED, StateId.ABORTED)
        gives_way = self.is_charging or self.is_staging
        is_ready = is_ready or (gives_way and robot.state in (StateId.DOCKED, StateId.EXECUTING))
        has_work = (robot.run is not None and not gives_way) or bool(robot.queue.pending())
        return self.is_active and self.is_online and is_ready and not has_work

    @property
    def is_charging(self) -> bool:
        """Whether it is on a charger until it gets a mission."""
        run = self.robot.run
        return run is not None and isinstance(run.step, ChargeStep) and run.step.until_new_mission

    @property
    def is_staging(self) -> bool:
        """Whether it drives to where it waits; any order ends that."""
        run = self.robot.run
        return run is not None and run.item is self.staging


@dataclass(eq=False)
class Order:
    """One mission for one robot.

    Attributes:
        number: counts the orders of all clients.
        guid: stands on the robot's queue item as ``fleet_schedule_guid``.
        created_by: row of the user.
        wanted: the robot that it is for; None: any.
        earliest: when it may begin.
        vehicle: the robot that has it; once set, it stays.
        item: what is in that robot's queue.
        is_cancelled: whether somebody has asked for its end.
        is_staging: whether the fleet made it to send an idle robot to where it waits.
    """

    number: int
    guid: str
    mission_id: str
    created_by: Row
    ordered: float
    parameters: list[Row] = field(default_factory=list)
    wanted: Vehicle | None = None
    description: str = ""
    priority: int = 0
    is_urgent: bool = False
    earliest: float = 0.0
    state: OrderState = OrderState.WAITING
    vehicle: Vehicle | None = None
    item: QueueItem | None = None
    started: float | None = None
    ended: float | None = None
    is_cancelled: bool = False
    is_staging: bool = False

    @property
    def message(self) -> str:
        """Why it ended, in the robot's words."""
        return self.item.message if self.item is not None else ""


class OrderBook:
    """All orders of a fleet, oldest first; ended ones stay.

    Args:
        vehicles: the robots of the fleet.
        is_qualified: whether a robot may get an order that is for any.
        has_mission: whether a mission with this guid exists.
        description_on_robot: what the item in the robot's queue has as description.
    """

    def __init__(
        self,
        vehicles: list[Vehicle],
        is_qualified: Callable[[Vehicle, Order], bool],
        has_mission: Callable[[str], bool],
        description_on_robot: Callable[[Order], str] = lambda order: "",
    ) -> None:
        self.vehicles = vehicles
        self._is_qualified, self._has_mission = is_qualified, has_mission
        self._description_on_robot = description_on_robot
        self._orders: dict[int, Order] = {}
        self._open: dict[int, Order] = {}
        self._last_number = 0

    def __iter__(self) -> Iterator[Order]:
        return iter(self._orders.values())

    def __reversed__(self) -> Iterator[Order]:
        return reversed(self._orders.values())

    def __len__(self) -> int:
        return len(self._orders)

    @property
    def open(self) -> list[Order]:
        """The orders that have not ended, oldest first."""
        return list(self._open.values())

    @property
    def has_open(self) -> bool:
        return bool(self._open)

    def get(self, number: int) -> Order | None:
        return self._orders.get(number)

    def submit(self, guid: str, mission_id: str, user: Row, now: float, **fields: Any) -> Order:
        """Take an order, from a client or, in tests, from somebody else. ``fields``: further ones of :class:`Order`.

        It is given to a robot the next time that ``look`` is called.
        """
        self._last_number += 1
        order = Order(self._last_number, guid, mission_id, user, now, **{"earliest": now, **fields})
        self._orders[order.number] = self._open[order.number] = order
        return order

    def remember(self, order: Order) -> None:
        """Add an order that has ended before the others."""
        self._last_number = order.number
        self._orders[order.number] = order

    def cancel(self, order: Order, now: float) -> None:
        """End an order on request: a waiting one at once, any other when its robot is reached and has stopped."""
        if order.state is OrderState.WAITING:
            self._end(order, OrderState.ABORTED, now)
        elif not order.state.is_end:
            order.is_cancelled = True
            self._stop_on_robot(order)

    def forget_waiting(self, *, reuse_numbers: bool = False) -> None:
        """Lose what no robot has yet, as a fleet may that restarts. ``reuse_numbers``: count on from the last one that is left."""
        for order in self.open:
            if order.state is OrderState.WAITING:
                del self._orders[order.number], self._open[order.number]
        if reuse_numbers:
            self._last_number = max(self._orders, default=0)

    def look(self, now: float, *, assigns: bool = True) -> None:
        """Learn what the robots have done, then give waiting orders to free robots. The robots have advanced to ``now``.

        Args:
            assigns: False in times in which the fleet gives no robot anything.
        """
        for order in self.open:
            self._read(order, now)
        if assigns:
            for order in sorted(self.open, key=lambda one: (not one.is_urgent, -one.priority, one.number)):
                if order.state is OrderState.WAITING and order.earliest <= now:
                    self._assign(order, now)

    def _read(self, order: Order, now: float) -> None:
        """Take over the state of the robot's item. Of a robot that is offline the last one stays."""
        if order.item is None or order.vehicle is None or not order.vehicle.is_online:
            return
        if order.is_cancelled:
            self._stop_on_robot(order)
        state = STATE_OF_ITEM[order.item.state]
        if order.started is None and order.item.started is not None:
            order.started = now
        if state.is_end:
            self._end(order, state, now)
        else:
            order.state = state

    def _stop_on_robot(self, order: Order) -> None:
        if order.item is not None and order.vehicle is not None and order.vehicle.is_online:
            order.vehicle.robot.cancel(order.item)

    def _assign(self, order: Order, now: float) -> None:
        """Give a waiting order to its robot, or of all qualified ones to the free one that has been without order for the longest."""
        if not self._has_mission(order.mission_id):
            self._end(order, OrderState.INVALID, now)
            return
        candidates = [
            one
            for one in ([order.wanted] if order.wanted is not None else self.vehicles)
            if one.is_free and (order.wanted is not None or self._is_qualified(one, order))
        ]
        if candidates:
            vehicle = min(candidates, key=lambda one: (one.free_since, one.number))
            if vehicle.is_staging and vehicle.staging is not None:
                vehicle.robot.cancel(vehicle.staging)
            order.vehicle, order.state = vehicle, OrderState.SENT
            order.item = vehicle.robot.order(
                order.mission_id,
                order.created_by,
                description=self._description_on_robot(order),
                parameters=order.parameters,
                fleet_schedule_guid=order.guid,
            )
            if order.is_staging:
                vehicle.staging = order.item

    def _end(self, order: Order, state: OrderState, now: float) -> None:
        order.state, order.ended = state, now
        if order.vehicle is not None:
            order.vehicle.free_since = now
        self._open.pop(order.number, None)
