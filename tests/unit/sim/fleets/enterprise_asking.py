"""A client of a simulated Fleet Enterprise without a network, at simulated times that the test chooses."""

from __future__ import annotations

import uuid
from typing import Any

from mir_sim import Exchange, Response, SimulatedRobot
from mir_sim.fleets.enterprise import EnterpriseFleet
from mir_sim.fleets.knobs import EnterpriseKnobs
from tests.unit.sim.asking import GUIDS, Client

KEY = {"x-api-key": "mir_scheduler", "Content-Type": "application/json", "Accept": "application/json"}


def uuid_of(name: str) -> str:
    """Some UUID, the same for the same name."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, name))


class EnterpriseAsker(Client):
    """A fleet of two robots, Aino and Veikko, and a client of it. Paths are those below /api/v1."""

    base, headers = "/api/v1", KEY

    def __init__(self, **knobs: Any) -> None:
        robots = [SimulatedRobot(name, battery=80.0) for name in ("Aino", "Veikko")]
        self.fleet = self.machine = EnterpriseFleet("Hall", robots, knobs=EnterpriseKnobs(**knobs))
        self.aino, self.veikko = self.fleet.vehicles

    def post(self, name: str = "one", *missions: str, phase: dict[str, Any] | None = None, **fields: Any) -> Response:
        """Order missions, each a phase, as the order that is called so. ``phase`` are further fields of each phase."""
        phases = [
            {"mission-id": GUIDS[mission], "arguments": [], "order-id": uuid_of(f"{name} {number}"), **(phase or {})}
            for number, mission in enumerate(missions or ("Home",))
        ]
        fields = {key.replace("_", "-"): value for key, value in fields.items()}
        return self.send("POST", "/serial-order", {"serial-order": {"id": uuid_of(name), "phases": phases, **fields}})

    def exchange_order(self) -> Exchange:
        """Order Home as "one", through the faults of the network."""
        phase = {"mission-id": GUIDS["Home"], "order-id": uuid_of("one 0")}
        body = {"serial-order": {"id": uuid_of("one"), "phases": [phase]}}
        return self.exchange("POST", "/serial-order", body)

    def order(self, name: str = "one", number: int = 0) -> Any:
        """A phase of the order that is called so."""
        return self.get(f"/order/{uuid_of(f'{name} {number}')}")

    def status(self, name: str = "one", number: int = 0, *, after: float = 0.0) -> str:
        """When so many seconds have passed."""
        if after:
            self.pass_time(after)
        return str(self.order(name, number)["order-status"])

    def runs(self, after: float = 0.0) -> int:
        """How many missions the robots were given, when so many seconds have passed."""
        if after:
            self.pass_time(after)
        return sum(len(vehicle.robot.queue) for vehicle in self.fleet.vehicles)

    def events(self, name: str = "one") -> dict[int | None, Any]:
        """What the snapshot says of an order, by the index of the phase."""
        events = self.get("/serial-order-status/snapshot")["serial-order-status-events"]
        return {one["phase-index"]: one for one in events if one["serial-order-id"] == uuid_of(name)}

    def run_until(self, *statuses: str, name: str = "one", number: int = 0) -> str:
        """Let time pass until a phase has one of the statuses, for ten minutes at most."""
        ends = self.fleet.now + 600
        while (status := self.status(name, number)) not in statuses:
            assert self.fleet.now < ends, status
            self.pass_time(0.5)
        return status

    def run_to_end(self, name: str = "one", number: int = 0) -> str:
        return self.run_until("Finished", "Aborted", "Invalid", name=name, number=number)

    def robot(self, number: int = 0) -> Any:
        return self.get(f"/robots/{self.fleet.vehicles[number].guid}")
