"""What takes the missions of a simulated site: its robots themselves, or a fleet above them (``pytest --target classic``)."""

from __future__ import annotations

from collections.abc import Sequence

from mir_sim import SimulatedRobot
from mir_sim.fleets import KINDS, ClassicKnobs, SimulatedFleet, make_fleet
from mir_sim.fleets.orders import Order

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


def as_robots_have_it(path: str) -> str:
    """The path of a robot for a request with the same meaning."""
    for own, robots in _WHERE:
        if path == own or path.startswith(f"{own}/"):
            return robots if robots == "/status" else robots + path[len(own) :]
    return path


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
