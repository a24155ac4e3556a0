"""Simulated fleets: each stands above robots that are simulated as well, and hands them its orders."""

from __future__ import annotations

from typing import Any, NamedTuple

from mir_sim.fleets.base import SimulatedFleet
from mir_sim.fleets.classic import ClassicFleet
from mir_sim.fleets.enterprise import EnterpriseFleet
from mir_sim.fleets.knobs import ClassicKnobs, EnterpriseKnobs
from mir_sim.robot import SimulatedRobot


class Kind(NamedTuple):
    """A kind of fleet: its class, its knobs, and the software of robots that fits it."""

    make: type[SimulatedFleet]
    knobs: type
    robots: str


KINDS = {
    "classic": Kind(ClassicFleet, ClassicKnobs, "2.14.7"),
    "enterprise": Kind(EnterpriseFleet, EnterpriseKnobs, "3.8.1"),
}


def make_fleet(kind: str, robots: list[SimulatedRobot], **options: Any) -> SimulatedFleet:
    """A fleet of one of ``KINDS`` above these robots. ``options`` go to its class: ``knobs``, ``seed``, ``chaos``."""
    return KINDS[kind].make("Fleet", robots, **options)
