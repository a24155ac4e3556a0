"""How a classic fleet shows its robots: the state that it sees them in, and their own status in the form of ROS messages."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Any, cast

from mir_sim.fleets.orders import Vehicle
from mir_sim.footprints import footprint_of
from mir_sim.resources.call import Call
from mir_sim.state import RobotError, StateId

if TYPE_CHECKING:
    from mir_sim.fleets.classic import ClassicFleet

LOW_BATTERY = 10.0  # percent (guess)
NO_TIME = {"secs": 0, "nsecs": 0}
NO_HOOK = {
    "hook_status": {
        "available": False,
        "trolley": {"id": 0, "length": 0, "width": 0, "height": 0, "offset_locked_wheels": 0},
        "trolley_attached": False,
    },
    "hook_data": {
        "angle": {"timestamp": NO_TIME, "angle": 0},
        "brake_state": 0,
        "gripper_state": 0,
        "height": 0,
        "height_state": 0,
        "length": 0,
    },
}


class FleetState(IntEnum):
    """``fleet_state`` of a robot; those that simulated robots get into."""

    UNAVAILABLE = 1
    EMERGENCY_STOP = 4
    ERROR = 5
    STARTING = 6
    MANUAL_CONTROL = 8
    PAUSE = 9
    LOW_BATTERY = 10
    READY = 11
    CHARGING = 12
    STAGING = 13
    INDEPENDENT_MISSION = 14
    EXECUTING_FLEET_ORDER = 15
    EVACUATED = 21
    DEACTIVATED = 25

    @property
    def text(self) -> str:
        return self.name.lower().replace("_", " ")


BY_ROBOT_STATE = {
    StateId.STARTING: FleetState.STARTING,
    StateId.SHUTTING_DOWN: FleetState.UNAVAILABLE,
    StateId.EMERGENCY_STOP: FleetState.EMERGENCY_STOP,
    StateId.ERROR: FleetState.ERROR,
    StateId.MANUAL_CONTROL: FleetState.MANUAL_CONTROL,
    StateId.PAUSE: FleetState.PAUSE,
}


def fleet_of(call: Call) -> ClassicFleet:
    return cast("ClassicFleet", call.machine)


def fleet_state(fleet: ClassicFleet, vehicle: Vehicle) -> FleetState:
    robot = vehicle.robot
    if not vehicle.is_active:
        return FleetState.DEACTIVATED
    if not vehicle.is_online:
        return FleetState.UNAVAILABLE
    if robot.state in BY_ROBOT_STATE:
        return BY_ROBOT_STATE[robot.state]
    if vehicle.is_charging:
        return FleetState.CHARGING
    if vehicle.is_staging:
        return FleetState.STAGING
    work = [*robot.queue.pending(), *([robot.run.item] if robot.run is not None else [])]
    if work:
        is_ours = any(item.fleet_schedule_guid for item in work)
        return FleetState.EXECUTING_FLEET_ORDER if is_ours else FleetState.INDEPENDENT_MISSION
    if fleet.is_evacuating:
        return FleetState.EVACUATED  # without a drive to anywhere (guess)
    return FleetState.LOW_BATTERY if robot.battery.at(robot.now) < LOW_BATTERY else FleetState.READY


def _error(error: RobotError) -> dict[str, Any]:
    return {
        "code": error.code,
        "description": error.description,
        "module": error.module,
        "nolog": False,
        "timestamp": NO_TIME,
    }


def prompt_of(vehicle: Vehicle) -> dict[str, Any]:
    prompt = vehicle.robot.prompt
    return {
        "has_request": prompt is not None,
        "guid": prompt.guid if prompt else "",
        "user_group": prompt.user_group if prompt else "",
        "question": prompt.question if prompt else "",
        "options": prompt.options if prompt else [],
        "timeout": {"secs": int(prompt.timeout), "nsecs": 0} if prompt else NO_TIME,
    }


def status_of(vehicle: Vehicle) -> dict[str, Any]:
    """The state of an online robot in the form of ROS messages, which differs from the robot's own GET /status. Without power for
    the battery monitor it shows as little of the battery as the robot itself."""
    robot = vehicle.robot
    motion, run = robot.motion, robot.run
    stopped = robot.emergency_stop
    return {
        "header": {"stamp": NO_TIME, "frame_id": "", "seq": 0},
        "battery_percentage": -1.0 if stopped else round(robot.battery.at(robot.now), 2),
        "battery_time_remaining": -1 if stopped else robot.battery.seconds_left(robot.now),
        "battery_voltage": 0,
        "distance_to_next_target": round(robot.controller.distance_to_target, 3),
        "errors": [_error(error) for error in robot.errors],
        "footprint": footprint_of(robot.model),
        **NO_HOOK,
        "joystick_low_speed_mode_enabled": False,
        "joystick_web_session_id": robot.joystick_session,
        "map_id": robot.map_id,
        "mission_queue_id": run.item.id if run is not None else 0,
        "mission_text": robot.mission_text,
        "mode_id": int(robot.mode),
        "mode_key_state": "idle",
        "mode_text": robot.mode.text,
        "moved": round(robot.controller.odometer, 3),
        "position": {
            "x": round(motion.pose.x, 3),
            "y": round(motion.pose.y, 3),
            "orientation": round(motion.pose.orientation, 3),
        },
        "robot_name": robot.name,
        "safety_system_muted": False,
        "session_id": robot.session_id,
        "software_version": robot.software,
        "state_id": int(robot.state),
        "state_text": robot.state.text,
        "unloaded_map_changes": False,
        "uptime": int(robot.now - robot.switched_on),
        "user_prompt": prompt_of(vehicle),
        "velocity": {"linear": round(motion.linear, 3), "angular": round(motion.angular, 3)},
    }
