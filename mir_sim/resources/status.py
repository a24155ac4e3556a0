"""/status: the robot's state, and the few things that a client can set."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from mir_sim.definition import is_number
from mir_sim.errors import argument_error
from mir_sim.footprints import footprint_of
from mir_sim.motion import Pose
from mir_sim.resources.call import Call, Handlers
from mir_sim.state import ModeId, StateId


def get_status(call: Call) -> dict[str, Any]:
    """The whole status. During an emergency stop the battery monitor has no power and reads −1 (recorded)."""
    robot = call.robot
    state, motion, run = robot.state, robot.motion, robot.run
    stopped, say = robot.emergency_stop, robot.profile.text
    return robot.profile.only(
        "status",
        {
            "allowed_methods": None,
            "battery_percentage": -1.0 if stopped else round(robot.battery.at(robot.now), 2),
            "battery_time_remaining": -1 if stopped else robot.battery.seconds_left(robot.now),
            "distance_to_next_target": round(robot.controller.distance_to_target, 3),
            "errors": []
            if stopped
            else [{**error.full(), "description": say(error.description)} for error in robot.errors],
            "footprint": footprint_of(robot.model),
            "joystick_low_speed_mode_enabled": False,
            "joystick_web_session_id": robot.joystick_session,
            "map_id": robot.map_id,
            "mission_queue_id": run.item.id if run is not None else None,
            "mission_queue_url": f"/v2.0.0/mission_queue/{run.item.id}" if run is not None else None,
            "mission_text": say(robot.mission_text),
            "mode_id": int(robot.mode),
            "mode_key_state": "idle" if robot.model in ("MiR100", "MiR200") else "manual" if robot.manual else "auto",
            "mode_text": say(robot.mode.text),
            "moved": round(robot.controller.odometer, 3),
            "position": {
                "x": round(motion.pose.x, 3),
                "y": round(motion.pose.y, 3),
                "orientation": round(motion.pose.orientation, 3),
            },
            "robot_model": robot.model,
            "robot_name": robot.name,
            "safety_system_muted": False,
            "serial_number": robot.serial_number,
            "session_id": robot.session_id,
            "state_id": int(state),
            "state_text": say(state.text),
            "unloaded_map_changes": False,
            "uptime": int(robot.now - robot.switched_on),
            "user_prompt": robot.prompt.full() if robot.prompt is not None else None,
            "velocity": {"linear": round(motion.linear, 3), "angular": round(motion.angular, 3)},
        },
    )


def put_status(call: Call) -> dict[str, Any]:
    """Apply all fields or none: they are checked before the first takes effect. Errors are cleared before a state is set.

    ``prompt_user_group_from_fleet`` (3.8.1) is accepted and has no effect (guess).
    """
    robot, fields = call.robot, call.changes()
    pose = _pose(fields["position"]) if "position" in fields else None
    map_id = fields.get("map_id", robot.map_id)
    if map_id not in robot.site.table("/maps"):
        raise argument_error("map_id")
    if "answer" in fields and (robot.prompt is None or fields.get("guid") != robot.prompt.guid):
        raise argument_error("guid")
    moment = _moment(fields["datetime"]) if "datetime" in fields else None

    robot.name = fields.get("name", robot.name)
    robot.serial_number = fields.get("serial_number", robot.serial_number)
    robot.joystick_session = fields.get("web_session_id", robot.joystick_session)
    if "mode_id" in fields:
        robot.set_mode(ModeId(fields["mode_id"]))
    if pose is not None or map_id != robot.map_id:
        robot.relocate(pose or robot.pose, map_id)
    if "answer" in fields:
        robot.withdraw_prompt(fields["guid"])
    if moment is not None:
        robot.set_clock(moment)
    if "clear_error" in fields:
        robot.clear_errors()
    if "state_id" in fields:
        {StateId.READY: robot.resume, StateId.PAUSE: robot.pause, StateId.MANUAL_CONTROL: robot.take_over}[
            StateId(fields["state_id"])
        ]()
    return get_status(call)


def _pose(position: dict[str, Any]) -> Pose:
    values = [position.get(name) for name in ("x", "y", "orientation")]
    numbers = [float(value) for value in values if is_number(value)]
    if len(numbers) != 3:
        raise argument_error("position")
    return Pose(*numbers)


def _moment(text: str) -> datetime:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise argument_error("datetime") from None
    if not 2000 <= moment.year <= 2200:
        raise argument_error("datetime")
    return moment


HANDLERS: Handlers = {("get", "/status"): get_status, ("put", "/status"): put_status}
