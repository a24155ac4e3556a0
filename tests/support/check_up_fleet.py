"""A simulated fleet with the app that knows it, on a virtual clock: for check-ups, and what must be left after them."""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path
from typing import Any

from app.domain.check_up import Report, Trial
from app.domain.models import Fleet, FleetKind, Robot
from app.mir.address import Address
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.fleet_connection import FleetConnection
from app.mir.transport import Pace
from app.services.check_up.fleet_check_ups import FleetCheckUps, FleetClient
from mir_sim import SimulatedRobot
from mir_sim.fleets import KINDS, SimulatedFleet, make_fleet
from tests.support.check_up_site import DATABASE, Checked, opened
from tests.support.clock import VirtualClock
from tests.support.fleets import KEY
from tests.support.recorded_robot import START, TOKEN, AskedRobot, Direct

MISSION, ROBOT = "Home", "Bella"
KNOBS = {"classic": {"description_on_robot": "posted"}, "enterprise": {}}


class AskedFleet(AskedRobot):
    """Above two robots, Bella and Celia."""

    machine: SimulatedFleet  # type: ignore[assignment]

    def __init__(self, kind: str, *, history: int = 20, **knobs: Any) -> None:
        self.clock = VirtualClock(START)
        robots = [
            SimulatedRobot(
                name, software=KINDS[kind].robots, seed=1, battery=80.0, clock=self.clock.elapsed, start=START
            )
            for name in (ROBOT, "Celia")
        ]
        chosen = KINDS[kind].knobs(**{**KNOBS[kind], **knobs})
        self.machine = make_fleet(kind, robots, knobs=chosen, history=history)
        self.kind, self.base = kind, self.machine.base
        self.token = TOKEN if kind == "classic" else KEY
        self.connection = FleetConnection(self.clock.monotonic, Pace(self.clock.monotonic, self.clock.sleep))
        self._begin()

    def client(self, robot: Robot | None = None) -> FleetClient:  # type: ignore[override]
        make: type[FleetClient] = ClassicVehicle if self.kind == "classic" else EnterpriseVehicle
        return make(
            Address.parse(robot.address),
            self.token,
            robot.vehicle,
            connection=self.connection,
            fleet_identity=robot.fleet.identity,
            profile=robot.known,
            transport=Direct(self),
        )


class CheckedFleet(Checked):
    def __init__(self, directory: Path, kind: str = "classic", **knobs: Any) -> None:
        self.asked = AskedFleet(kind, **knobs)
        super().__init__(directory, _database(kind))

    @property
    def check_ups(self) -> FleetCheckUps:
        return self.container.fleet_check_ups

    @property
    def fleet(self) -> Fleet:
        return self.container.catalogue.fleets()[0]

    def trial(self, **values: Any) -> Report:
        return self.check_ups.run(self.id, Trial(MISSION, ROBOT), **values)

    def clean_up(self) -> None:
        """The app runs for some minutes."""
        for _ in range(4):
            self.check_ups.put_back_all(list(self.check_ups.left_behind()))
            self.asked.clock.advance(60.0)
            self.machine.catch_up()

    def open_orders(self) -> list[str]:
        """Those that may still run."""
        self.machine.catch_up()
        return [order.mission_id for order in self.machine.book.open]

    def runs(self) -> list[str]:
        """Missions that a robot was ever given."""
        return [item.mission_id for vehicle in self.machine.vehicles for item in vehicle.robot.queue]


@functools.cache
def _database(kind: str) -> bytes:
    """With that fleet in it. Made once, as that takes as long as a check-up."""
    user, secret = ("distributor", "distributor") if kind == "classic" else ("", "mir_scheduler")
    with tempfile.TemporaryDirectory() as directory:
        container = opened(Path(directory), AskedFleet(kind, history=0))
        new = Fleet("Hall", "http://10.0.0.9", FleetKind(kind), user)
        assert container.catalogue.save_fleet(new, password=secret).id == 1
        container.db.close()
        return (Path(directory) / DATABASE).read_bytes()
