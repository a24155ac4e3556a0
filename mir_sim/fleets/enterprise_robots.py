"""How Fleet Enterprise shows its robots: who they are, and how they are."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

from mir_sim.fleets.enterprise_orders import span
from mir_sim.fleets.orders import Vehicle
from mir_sim.footprints import footprint_of
from mir_sim.robot import SimulatedRobot
from mir_sim.site import Row
from mir_sim.state import StateId

HEIGHT = 0.3  # m, of a footprint
Stamp = Callable[[float], str]

# robot-state, an object with one key at each level, and robot-end-state. A robot that has nothing to do is Idle (seen in MiR's examples).
_IDLE: tuple[Row, str] = {"idle": {}}, "Idle"
_BUSY: tuple[Row, str] = {"operational": {}}, "Operational"


def _stopped(end_state: str, *keys: str) -> tuple[Row, str]:
    inner: Row = {}
    for key in reversed(keys):
        inner = {key: inner}
    return {"not-operational": inner}, end_state


STATES: dict[StateId, tuple[Row, str]] = {
    StateId.STARTING: _stopped("Starting", "system-busy", "starting"),
    StateId.SHUTTING_DOWN: _stopped("Shutting Down", "system-busy", "shutting-down"),
    StateId.READY: _IDLE,
    StateId.PAUSE: _stopped("Paused", "paused"),
    StateId.EXECUTING: _BUSY,
    StateId.ABORTED: _IDLE,
    StateId.COMPLETED: _IDLE,
    StateId.DOCKED: _BUSY,
    StateId.DOCKING: _BUSY,
    StateId.EMERGENCY_STOP: _stopped("Emergency Stop", "safety-stop", "e-stop"),
    StateId.MANUAL_CONTROL: _stopped("Manual Control", "manual-control"),
    StateId.ERROR: _stopped("Error", "error"),
}


def identity(vehicle: Vehicle, stamp: Stamp) -> Row:
    """The ``timestamp`` is when the robot joined the fleet (guess)."""
    robot = vehicle.robot
    return {
        "robot-id": vehicle.guid,
        "serial-number": robot.serial_number,
        "name": robot.name,
        "model": robot.model,
        "software-version": robot.software,
        "timestamp": stamp(0.0),
        "ip": vehicle.address,
    }


def shown(vehicle: Vehicle, stamp: Stamp) -> Row:
    """A robot as GET /robots/{id} shows it. It reports each second."""
    robot = vehicle.robot
    seen = math.floor(robot.now)
    state, end_state = STATES[robot.state]
    return {
        "robot-identity": identity(vehicle, stamp),
        "runtime-data": _runtime(robot, stamp, seen),
        "robot-state": state,
        "robot-end-state": end_state,
        "errors": [
            {"code": one.code, "description": one.description, "module": one.module, "timestamp": stamp(one.at)}
            for one in robot.errors
        ],
        "footprint": {
            "points": [{"x": x, "y": y} for x, y in json.loads(footprint_of(robot.model))],
            "height": HEIGHT,
        },
    }


def _runtime(robot: SimulatedRobot, stamp: Stamp, seen: float) -> Row:
    motion = robot.motion
    pose: dict[str, Any] = {name: round(getattr(motion.pose, name), 3) for name in ("x", "y", "orientation")}
    return {
        "uptime": span(seen - robot.switched_on),
        "battery-percentage": -1.0
        if robot.emergency_stop
        else round(robot.battery.at(seen), 2),  # as robots say (guess)
        "battery-time-remaining": span(0 if robot.emergency_stop else robot.battery.seconds_left(seen)),
        "pose": pose,
        "velocity-linear": round(motion.linear, 3),
        "velocity-angular": round(motion.angular, 3),
        "moved": round(robot.controller.odometer, 3),
        "timestamp": stamp(seen),
    }
