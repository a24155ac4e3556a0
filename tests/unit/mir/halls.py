"""Simulated fleets of two robots, and clients of them that share a connection."""

from __future__ import annotations

import uuid
from typing import Any

from app.domain.check_up import RobotProfile
from app.domain.robot import QueueState
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.errors import ConnectionLost, Delivery
from app.mir.fleet_connection import FleetConnection
from mir_sim import SimulatedRobot
from mir_sim.faults import Fault, FaultKind
from mir_sim.fleets.base import SimulatedFleet
from mir_sim.fleets.classic import ClassicFleet
from mir_sim.fleets.enterprise import EnterpriseFleet
from mir_sim.fleets.knobs import ClassicKnobs, EnterpriseKnobs, changed
from tests.support.errors import raises
from tests.support.fleets import ADDRESS, KEY, TOKEN, MachineTransport
from tests.unit.sim.asking import GUIDS

CHECKED_UP = RobotProfile(None, None, has_search=True, token_field="description")
NAMES = ("Aino", "Veikko")


def token() -> str:
    return str(uuid.uuid4())


class Hall:
    """``ids``: of its robots at the fleet."""

    def __init__(self, fleet: SimulatedFleet, robots: list[SimulatedRobot], ids: list[str]) -> None:
        self.fleet, self.robots, self.ids = fleet, robots, ids
        self.restart_app()

    def restart_app(self) -> None:
        self.connection = FleetConnection(clock=lambda: self.fleet.now)
        self.transport = MachineTransport(self.fleet, self.credentials)

    def vehicle(self, vehicle: int | str = 0, **options: Any) -> Any:
        id_ = vehicle if isinstance(vehicle, str) else self.ids[vehicle]
        options = {"connection": self.connection, "transport": self.transport, **self.options(), **options}
        return self.client(ADDRESS, self.credentials, id_, **options)

    def options(self) -> dict[str, Any]:
        return {}

    def pass_time(self, seconds: float) -> None:
        self.fleet.advance_to(self.fleet.now + seconds)

    def meets(self, kind: FaultKind, method: str = "POST", path: str = "") -> None:
        self.fleet.faults.add(Fault(kind, path or self.orders_at, method))

    def lose(self, target: Any, kind: FaultKind) -> str:
        """An order of Home, or the answer to it; returns its token."""
        own = token()
        self.meets(kind)
        with raises(ConnectionLost, delivery=Delivery.UNKNOWN):
            target.enqueue(GUIDS["Home"], description=own)
        return own

    def run_until(self, target: Any, number: int, own: str, *states: QueueState) -> QueueState:
        ends = self.fleet.now + 600
        while (state := target.queue_item(number, own).state) not in states:
            assert self.fleet.now < ends, state
            self.pass_time(1.0)
        return state

    def run_one(self, aino: Any) -> None:
        """From then on the app knows what lists of Fleet Enterprise call its key."""
        own = token()
        number = aino.enqueue(GUIDS["Deliver"], description=own)
        self.run_until(aino, number, own, QueueState.EXECUTING)
        self.run_until(aino, number, own, QueueState.DONE)


class ClassicHall(Hall):
    client, credentials, orders_at = ClassicVehicle, TOKEN, "/mission_scheduler"

    def __init__(self, **knobs: Any) -> None:
        robots = [SimulatedRobot(name, battery=80.0, software="2.14.7") for name in NAMES]
        super().__init__(ClassicFleet("Fleet", robots, knobs=changed(ClassicKnobs(), knobs)), robots, ["1", "2"])

    def options(self) -> dict[str, Any]:
        return {"profile": CHECKED_UP, "reach": lambda _address: MachineTransport(self.robots[0], TOKEN)}


class EnterpriseHall(Hall):
    client, credentials, orders_at = EnterpriseVehicle, KEY, "/serial-order"

    def __init__(self, **knobs: Any) -> None:
        robots = [SimulatedRobot(name, battery=80.0) for name in NAMES]
        fleet = EnterpriseFleet("Hall", robots, knobs=EnterpriseKnobs(**knobs))
        super().__init__(fleet, robots, [vehicle.guid for vehicle in fleet.vehicles])

    @property
    def orders(self) -> int:
        return len(list(self.fleet.phases()))
