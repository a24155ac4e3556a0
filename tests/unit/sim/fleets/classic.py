"""A client of a classic fleet without a network, at simulated times that the test chooses."""

from __future__ import annotations

from typing import Any

from mir_sim import SimulatedRobot
from mir_sim.fleets.classic import ClassicFleet
from mir_sim.fleets.knobs import ClassicKnobs, changed
from tests.unit.sim.asking import GUIDS, Asker


class FleetAsker(Asker):
    """A fleet of two robots, and a client of it. ``knobs``: those that differ."""

    def __init__(self, **knobs: Any) -> None:
        self.robots = [SimulatedRobot(name, battery=80.0, software="2.14.7") for name in ("Aino", "Veikko")]
        self.fleet = ClassicFleet("Fleet", self.robots, knobs=changed(ClassicKnobs(), knobs))
        self.machine = self.fleet

    def order(self, mission: str = "Deliver", **fields: Any) -> int:
        answer = self.send("POST", "/mission_scheduler", {"mission_id": GUIDS[mission], **fields})
        assert answer.status == 201, answer.body
        return int(answer.json()["id"])

    def item(self, number: int) -> Any:
        return self.get(f"/mission_scheduler/{number}")

    def vehicle(self, number: int = 1) -> Any:
        return self.get(f"/robots/{number}")

    def search(self, name: str, operator: str, value: Any) -> Any:
        filters = [{"fieldname": name, "operator": operator, "value": value}]
        return self.send("POST", "/mission_scheduler/search", {"filters": filters})
