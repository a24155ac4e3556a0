"""A simulated Fleet Enterprise: takes serial orders, and gives their missions to its robots one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from typing import Any

from mir_sim import api
from mir_sim.errors import ApiError
from mir_sim.fleets import enterprise_api, enterprise_definition, enterprise_robots, knobs
from mir_sim.fleets.base import LOOKS_EVERY, SimulatedFleet
from mir_sim.fleets.enterprise_orders import PRIORITIES, Origin, Phase, SerialOrder, utc_text
from mir_sim.fleets.knobs import EnterpriseKnobs
from mir_sim.fleets.orders import Order, OrderState, Vehicle
from mir_sim.messages import Request, Response
from mir_sim.robot import SimulatedRobot
from mir_sim.site import Row


class EnterpriseFleet(SimulatedFleet):
    """One Fleet Enterprise.

    Args:
        name: ``fleet-name``.
        knobs: how it differs from the faithful one.
        options: as of other fleets.
    """

    base = "/api/v1"
    knobs: EnterpriseKnobs

    def __init__(
        self, name: str, robots: Sequence[SimulatedRobot], *, knobs: EnterpriseKnobs | None = None, **options: Any
    ) -> None:
        super().__init__(name, robots, **options)
        self.knobs = knobs or EnterpriseKnobs()
        self._orders: dict[str, SerialOrder] = {}  # by their ids; of two with the same, the newer one
        self._phases: dict[str, tuple[SerialOrder, Phase]] = {}
        self.active: list[SerialOrder] = []
        self.last_shown: dict[int, Row] = {}  # by number of the robot: the last before it went offline

    def keep_last(self, vehicle: Vehicle) -> None:
        self.last_shown[vehicle.number] = enterprise_robots.shown(vehicle, self.text_of)

    @property
    def definition(self) -> enterprise_definition.Definition:
        return enterprise_definition.load(self.knobs.version)

    def text_of(self, seconds: float) -> str:
        """A time as the API writes it: UTC."""
        return utc_text(self.clock.utc(seconds))

    def seconds_of(self, moment: datetime) -> float:
        """The simulated second at which the fleet's clock shows a time."""
        return self.now + (moment - self.clock.utc(self.now)).total_seconds()

    def vehicle(self, guid: str | None) -> Vehicle | None:
        return next((one for one in self.vehicles if one.guid == guid), None)

    def at_robots(self, seconds: float, call: Callable[[], object]) -> None:
        """Call a function at a simulated second to which the robots have advanced too, or once the fleet is online again."""

        def at_the_same_time() -> None:
            if self.offline_until is None:
                self._advance_robots()
                call()
            else:
                self.at_robots(self.offline_until + LOOKS_EVERY, call)

        self.call_at(seconds, at_the_same_time)

    # Finding orders

    def order(self, order_id: str) -> SerialOrder | None:
        """The serial order with this id, unless it ended too long ago."""
        serial = self._orders.get(order_id)
        return serial if serial is not None and self._is_kept(serial, self.knobs.orders_kept) else None

    def phase(self, order_id: str) -> tuple[SerialOrder, Phase] | None:
        """The phase with this order id, unless its order ended too long ago."""
        found = self._phases.get(order_id)
        return found if found is not None and self._is_kept(found[0], self.knobs.orders_kept) else None

    def phases(self) -> Iterator[tuple[SerialOrder, Phase]]:
        """All phases that are kept, oldest first."""
        return (found for found in self._phases.values() if self._is_kept(found[0], self.knobs.orders_kept))

    def _is_kept(self, serial: SerialOrder, seconds: float | None) -> bool:
        return serial.ended is None or seconds is None or self.now < serial.ended + seconds

    def is_known(self, serial: SerialOrder) -> bool:
        """Whether its id or the order id of one of its phases is in use already."""
        same = [self._orders[serial.id]] if serial.id in self._orders else []
        same += [self._phases[one.order_id][0] for one in serial.phases if one.order_id in self._phases]
        return any(self._is_kept(one, self.knobs.ids_kept) for one in same)

    # What clients request

    def add(self, serial: SerialOrder) -> None:
        """Take an order, unless it is known."""
        if self.is_known(serial):
            return
        self._orders[serial.id] = serial
        self._phases.update({phase.order_id: (serial, phase) for phase in serial.phases})
        self.active.append(serial)
        self._begin(serial)
        serial.note(self.now)

    def add_later(self, serial: SerialOrder) -> None:
        """Take an order in some seconds; until then nothing knows of it."""
        self.at_robots(self.now + self.rng.uniform(*self.knobs.appears_seconds), lambda: self.add(serial))

    def order_of_somebody(
        self, mission_id: str, robot: Vehicle | None = None, kind: str = "User", *, id_: str = ""
    ) -> SerialOrder:
        """An order that a person makes at the fleet's own screen, or of another kind one that the fleet itself makes. ``id_``: else a
        new one."""
        origin = (
            Origin(user_guid=self.new_guid(), user_name="Operator", kind=kind) if kind == "User" else Origin(kind=kind)
        )
        phase = Phase(mission_id, [], None, self.new_guid())
        serial = SerialOrder(id_ or self.new_guid(), "Medium", (self.now, None), robot, [phase], self.now, origin)
        self.add(serial)
        return serial

    def abort(self, serial: SerialOrder) -> None:
        """End an order on request, which takes a while. What has ended by then stays as it is."""
        serial.is_aborting = True
        serial.note(self.now)
        self.at_robots(self.now + self.knobs.abort_seconds, lambda: self._stop(serial))

    def abort_fallback(self, serial: SerialOrder) -> bool:
        """End the fallback mission that runs; False when none does."""
        order = serial.phase.fallback
        if order is None or order.state.is_end:
            return False
        self.book.cancel(order, self.now)
        self._continue(serial)
        return True

    def change(
        self, serial: SerialOrder, priority: str, earliest: tuple[float, str | None], robot: Vehicle | None
    ) -> bool:
        """Change an order that no robot has; False when one has, or it has ended."""
        if not self._waits(serial, serial.phases[0]):
            return False
        serial.priority, serial.earliest, serial.wanted = priority, earliest, robot
        if (order := serial.phases[0].order) is not None:
            order.priority, order.earliest, order.wanted = PRIORITIES[priority], earliest[0], robot
        return True

    def change_phase(self, serial: SerialOrder, index: int, new: Phase) -> bool:
        """Change a phase that no robot has; False when one has, when the order has ended, or when a due phase would lose its mission."""
        if not 0 <= index < len(serial.phases) or not self._waits(serial, phase := serial.phases[index]):
            return False
        if phase.order is not None and new.mission_id is None:
            return False
        phase.mission_id, phase.arguments, phase.fallback_mission_id = (
            new.mission_id,
            new.arguments,
            new.fallback_mission_id,
        )
        if phase.order is not None:
            phase.order.mission_id, phase.order.parameters = new.mission_id or "", parameters_of(phase)
        elif phase is serial.phase:
            self._begin(serial)
        serial.note(self.now)
        return True

    @staticmethod
    def _waits(serial: SerialOrder, phase: Phase) -> bool:
        is_waiting = phase.order is None or phase.order.state is OrderState.WAITING
        return is_waiting and serial.ended is None and not serial.is_aborting

    # What happens to orders

    @property
    def charging_below(self) -> float | None:
        return self.knobs.charging_below

    def charge(self, vehicle: Vehicle, mission_id: str) -> None:
        self.order_of_somebody(mission_id, vehicle, "Charging")

    def _stop(self, serial: SerialOrder) -> None:
        order = serial.phase.order
        if serial.ended is None and order is not None:
            self.book.cancel(order, self.now)
            self._continue(serial)
        elif serial.ended is None:
            self._end(serial)

    def look(self) -> None:
        """Learn what the robots have done, and let what follows come before other orders."""
        self.book.look(self.now, assigns=False)
        for serial in list(self.active):
            self._continue(serial)
        super().look()
        for serial in self.active:
            serial.note(self.now)

    def _begin(self, serial: SerialOrder) -> None:
        """Bring the phase whose turn it is to the book. One without mission waits for it."""
        phase = serial.phase
        if phase.mission_id is not None:
            phase.order = self._submit(serial, phase, is_next=serial.index > 0)

    def _submit(self, serial: SerialOrder, phase: Phase, *, is_next: bool) -> Order:
        """``is_next``: the order has its robot already, which gets this before all else."""
        return self.book.submit(
            phase.order_id,
            phase.mission_id or "",
            next(iter(self.site.table("/users"))),
            self.now,
            parameters=parameters_of(phase),
            wanted=serial.vehicle,
            priority=PRIORITIES[serial.priority],
            is_urgent=is_next,
            earliest=self.now if is_next else serial.earliest[0],
        )

    def _continue(self, serial: SerialOrder) -> None:
        """After a mission has ended, begin the next one, or end the order."""
        phase = serial.phase
        order = phase.fallback or phase.order
        if order is None or not order.state.is_end:
            return
        is_fallback = order is phase.fallback
        if order.state is OrderState.ABORTED and not is_fallback and order.item and phase.fallback_mission_id:
            fallback = Phase(phase.fallback_mission_id, [], None, self.new_guid())
            phase.fallback = self._submit(serial, fallback, is_next=True)
        elif (
            order.state is OrderState.DONE
            and not is_fallback
            and phase is not serial.phases[-1]
            and not serial.is_aborting
        ):
            serial.index += 1
            self._begin(serial)
        else:
            self._end(serial)

    def _end(self, serial: SerialOrder) -> None:
        serial.ended = self.now
        self.active.remove(serial)

    # Restarts, and what /sim shows

    def reboot(self, real_seconds: float) -> None:
        self.restart(real_seconds, forgets_waiting=self.knobs.waiting_after_reboot == "lost")

    def restart(self, real_seconds: float, *, forgets_waiting: bool = False, reuses_numbers: bool = False) -> None:
        super().restart(real_seconds, forgets_waiting=forgets_waiting, reuses_numbers=reuses_numbers)
        for serial in list(self.active) if forgets_waiting else ():
            order = serial.phase.fallback or serial.phase.order
            if order is None or self.book.get(order.number) is None:
                self._lose(serial)

    def _lose(self, serial: SerialOrder) -> None:
        """Forget what no robot has: the rest of an order, or an order that has not begun."""
        if serial.phase.fallback is None:
            serial.phase.order = None
        serial.phase.fallback = None
        self._end(serial)
        if all(phase.order is None for phase in serial.phases):
            self._orders.pop(serial.id)
            for phase in serial.phases:
                self._phases.pop(phase.order_id)

    def snapshot(self) -> dict[str, Any]:
        with self.lock:
            self.catch_up()
            return {
                "name": self.name,
                "kind": "enterprise",
                "now": self.text_of(self.now),
                "seconds": round(self.now, 3),
                "online": self.online,
                "orders": [enterprise_api.shown_order(self, *found) for found in self._phases.values()],
                "robots": [enterprise_robots.shown(vehicle, self.text_of) for vehicle in self.vehicles],
                "knobs": knobs.shown(self.knobs),
                "faults": self.faults.full(),
            }


def parameters_of(phase: Phase) -> list[Row]:
    """The arguments of a phase as robots take them."""
    return [{"input_name": one["name"], "value": one["value"]} for one in phase.arguments]


@api.answer.register
def _(fleet: EnterpriseFleet, request: Request) -> Response:
    return enterprise_api.answer(fleet, request)


@api.refuse.register
def _(fleet: EnterpriseFleet, error: ApiError) -> Response:
    return enterprise_api.refuse(enterprise_api.Problem(error.status), {}, "")
