"""What may happen to a robot of a fleet, and how often its robots were given each order."""

from __future__ import annotations

from collections import Counter

from mir_sim import SimulatedRobot
from mir_sim.fleets.base import SimulatedFleet
from mir_sim.state import RobotError


def happen(robot: SimulatedRobot, event: str) -> None:
    match event:
        case "reboot":
            robot.reboot(30)
        case "fail":
            robot.raise_error(RobotError(10120, "Goal not reached"), lasting=False)
        case _:
            getattr(robot, event)()


def queued(fleet: SimulatedFleet) -> Counter[str]:
    return Counter(item.fleet_schedule_guid for one in fleet.vehicles for item in one.robot.queue)
