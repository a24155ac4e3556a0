"""/robots, /robot_groups, /status, /prompt and qualified robots: what a classic fleet says of its robots and of itself."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum
from typing import TYPE_CHECKING, Any, cast

from mir_sim.errors import ApiError, argument_error
from mir_sim.fleets.orders import Vehicle
from mir_sim.footprints import footprint_of
from mir_sim.messages import Response
from mir_sim.resources import stored
from mir_sim.resources.call import Call, Handlers
from mir_sim.site import ADMINISTRATOR, USER_GROUPS
from mir_sim.state import RobotError, StateId

if TYPE_CHECKING:
    from mir_sim.fleets.classic import ClassicFleet

LOW_BATTERY = 10.0  # percent (guess)
RESTART = 30.0  # real s that a fleet is offline when it is asked to restart (guess)
ACTIVE_MODE = {
    "synchronization_enabled": True,
    "mission_scheduling_enabled": True,
    "resource_management_enabled": True,
    "initial_synchronization_enabled": False,
    "collision_avoidance_enabled": True,
    "charging_staging_enabled": True,
    "communicator_enabled": True,
    "mode_name": "ActiveMode",
}
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


def _prompt(vehicle: Vehicle) -> dict[str, Any]:
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
    """The state of an online robot in the form of ROS messages, which differs from the robot's own GET /status."""
    robot = vehicle.robot
    motion, run = robot.motion, robot.run
    return {
        "header": {"stamp": NO_TIME, "frame_id": "", "seq": 0},
        "battery_percentage": round(robot.battery.at(robot.now), 2),
        "battery_time_remaining": robot.battery.seconds_left(robot.now),
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
        "user_prompt": _prompt(vehicle),
        "velocity": {"linear": round(motion.linear, 3), "angular": round(motion.angular, 3)},
    }


def brief(vehicle: Vehicle) -> dict[str, Any]:
    return {"id": vehicle.number, "name": vehicle.robot.name, "ip": vehicle.address}


@dataclass(frozen=True)
class Entry:
    """A robot as the fleet shows it. Of one that is offline the last status stays."""

    fleet: ClassicFleet
    vehicle: Vehicle
    methods: tuple[str, ...] = ("GET",)

    def alone(self) -> dict[str, Any]:
        """The answer to a request for this robot."""
        fleet, vehicle, robot = self.fleet, self.vehicle, self.vehicle.robot
        state = fleet_state(fleet, vehicle)
        return {
            "id": vehicle.number,
            "ip": vehicle.address,
            "active": vehicle.is_active,
            "description": vehicle.description,
            "serial_number": robot.serial_number if fleet.knobs.serial_numbers else "",
            "robot_model": robot.model,
            "robot_group_id": vehicle.group,
            "fleet_state": int(state),
            "fleet_state_text": state.text,
            "factory_reset_needed": False,
            "operation_mode_info": ACTIVE_MODE,
            "created_by": f"/v2.0.0/users/{ADMINISTRATOR}",
            "created_by_id": ADMINISTRATOR,
            "created_by_name": "Administrator",
            "allowed_methods": list(self.methods),
            "status": status_of(vehicle) if vehicle.is_online else fleet.last_status[vehicle.number],
        }

    def full(self) -> dict[str, Any]:
        """The answer in the list, to ``whitelist=all``."""
        alone = self.alone()
        return {**alone, "name": self.vehicle.robot.name, "url": self.url, "state_id": alone["status"]["state_id"]}

    @property
    def url(self) -> str:
        return f"/v2.0.0/robots/{self.vehicle.number}"

    def summary(self) -> dict[str, Any]:
        """The bare list has all fields by MiR's definition; that was not recorded, hence a knob."""
        whole = self.fleet.knobs.robots == "whole"
        return self.full() if whole else {"id": self.vehicle.number, "url": self.url}

    def value(self, name: str) -> Any:
        return self.full()[name]


def list_robots(call: Call) -> list[Entry]:
    methods = _methods(call)
    return [Entry(fleet_of(call), vehicle, methods) for vehicle in fleet_of(call).vehicles]


def _methods(call: Call) -> tuple[str, ...]:
    """By the rights of the user who asks."""
    return ("PUT", "GET", "DELETE") if call.asker["user_group_id"] in USER_GROUPS.values() else ("GET",)


def _vehicle(call: Call, name: str = "id") -> Vehicle:
    found = next((one for one in fleet_of(call).vehicles if str(one.number) == call.params[name]), None)
    if found is None:
        raise ApiError(404)
    return found


def get_robot(call: Call) -> dict[str, Any]:
    return Entry(fleet_of(call), _vehicle(call), _methods(call)).alone()


def put_robot(call: Call) -> dict[str, Any]:
    vehicle, fields = _vehicle(call), call.changes()
    _change(fleet_of(call), vehicle, fields)
    return get_robot(call)


def _change(fleet: ClassicFleet, vehicle: Vehicle, fields: dict[str, Any]) -> None:
    if fields.get("robot_group_id", vehicle.group) not in fleet.site.table("/robot_groups"):
        raise argument_error("robot_group_id")
    vehicle.group = fields.get("robot_group_id", vehicle.group)
    vehicle.is_active = fields.get("active", vehicle.is_active)
    vehicle.description = fields.get("description", vehicle.description)


def remove_robot(call: Call) -> None:
    """What it has from the fleet it still does."""
    vehicle = _vehicle(call)
    fleet_of(call).vehicles.remove(vehicle)
    fleet_of(call).removed.append(vehicle)


def add_robot(call: Call) -> dict[str, Any]:
    """Only a robot that was removed can be added: no other answers at its address."""
    fleet, fields = fleet_of(call), call.fields()
    if any(vehicle.address == fields["ip"] for vehicle in fleet.vehicles):
        raise ApiError(409)
    found = next((vehicle for vehicle in fleet.removed if vehicle.address == fields["ip"]), None)
    if found is None:
        raise argument_error("ip")
    _change(fleet, found, fields)
    fleet.removed.remove(found)
    fleet.vehicles.append(found)
    return Entry(fleet, found, _methods(call)).full()


def scan(call: Call) -> Any:
    """The robots in the network, in the fleet or not; or the one at an address."""
    fleet, fields = fleet_of(call), call.machine.definition.properties(call.operation.schema)
    found = {
        vehicle.address: {name: value for name, value in _scanned(fleet, vehicle).items() if name in fields}
        for vehicle in (*fleet.vehicles, *fleet.removed)
    }
    if "ip" not in call.params:
        return list(found.values())
    if call.params["ip"] not in found:
        raise ApiError(404)
    return found[call.params["ip"]]


def _scanned(fleet: ClassicFleet, vehicle: Vehicle) -> dict[str, Any]:
    robot = vehicle.robot
    return {
        "already_exists": vehicle in fleet.vehicles,
        "api_version": "v2.0.0",
        "battery_percentage": round(robot.battery.at(robot.now), 2),
        "ip": vehicle.address,
        "model": robot.model,
        "name": robot.name,
        "serial_number": robot.serial_number,
        "software_version": robot.software,
        "url": f"/v2.0.0/robots/scan/{vehicle.address}",
        "version_match": True,
    }


def qualified_robots(call: Call) -> list[dict[str, Any]]:
    fleet, guid = fleet_of(call), call.params["guid"]
    if guid not in fleet.site.table("/missions"):
        raise ApiError(404)
    return [
        {"name": vehicle.robot.name, "url": f"/v2.0.0/robots/{vehicle.number}"}
        for vehicle in fleet.vehicles
        if fleet.may_run(vehicle, guid)
    ]


def get_status(call: Call) -> Any:
    """One object (guess); the definition has a list of one, which a knob gives."""
    fleet = fleet_of(call)
    status = {"url": "/v2.0.0/status", "state": fleet.state, "default_state": "normal"}
    return status if fleet.knobs.status == "object" else [status]


def put_status(call: Call) -> Any:
    fleet, fields = fleet_of(call), call.changes()
    if "datetime" in fields:
        try:
            fleet.clock.set_local(datetime.fromisoformat(fields["datetime"]), fleet.now)
        except (ValueError, OverflowError):
            raise argument_error("datetime") from None
    fleet.state = fields.get("state", fleet.state)
    fleet.name = fields.get("name", fleet.name)
    return get_status(call)


def evacuate(call: Call) -> Any:
    """While it lasts no robot gets an order; what runs continues (guess)."""
    fleet_of(call).is_evacuating = call.fields()["evacuation_activated"]
    return stored.generic(call)


def list_prompts(call: Call) -> list[dict[str, Any]]:
    """The questions of all robots; the fields are a guess."""
    return [
        {**_prompt(vehicle), "url": f"/v2.0.0/prompt/{vehicle.robot.prompt.guid}", "robot_id": vehicle.number}
        for vehicle in fleet_of(call).vehicles
        if vehicle.robot.prompt is not None
    ]


def prompt(call: Call) -> dict[str, Any]:
    """Read a question, or answer it."""
    guid = call.params["guid"]
    for vehicle in fleet_of(call).vehicles:
        if vehicle.robot.prompt is not None and vehicle.robot.prompt.guid == guid:
            answer = call.changes()["answer"] if call.operation.verb == "put" else ""
            shown = {**_prompt(vehicle), "robot_id": vehicle.number, "answer": answer}
            if answer:
                vehicle.robot.withdraw_prompt(guid)
            return shown
    raise ApiError(404)


def metrics(call: Call) -> Response:
    """OpenMetrics text; the names are a guess."""
    robots = len(fleet_of(call).vehicles)
    text = f"# TYPE mir_fleet_robots gauge\nmir_fleet_robots {robots}\n# EOF\n"
    return Response(200, {"Content-Type": "application/openmetrics-text; version=1.0.0; charset=utf-8"}, text.encode())


def restart(call: Call) -> Any:
    """Answer, then be offline for a while (guess)."""
    fleet = fleet_of(call)
    fleet.call_at(fleet.now + 1.0, lambda: fleet.reboot(RESTART))
    return stored.generic(call)


HANDLERS: Handlers = {
    ("post", "/restart"): restart,
    ("get", "/metrics"): metrics,
    ("get", "/robots"): list_robots,
    ("post", "/robots"): add_robot,
    ("get", "/robots/scan"): scan,
    ("get", "/robots/scan/{ip}"): scan,
    ("get", "/robots/{id}"): get_robot,
    ("delete", "/robots/{id}"): remove_robot,
    ("put", "/robots/{id}"): put_robot,
    ("get", "/missions/{guid}/qualified_robots"): qualified_robots,
    ("get", "/status"): get_status,
    ("put", "/status"): put_status,
    ("post", "/evacuations"): evacuate,
    ("get", "/prompt"): list_prompts,
    ("get", "/prompt/{guid}"): prompt,
    ("put", "/prompt/{guid}"): prompt,
}
