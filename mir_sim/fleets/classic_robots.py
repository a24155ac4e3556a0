"""/robots and /missions/…/qualified_robots: the robots of a classic fleet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mir_sim.errors import ApiError, argument_error
from mir_sim.fleets.classic_view import fleet_of, fleet_state, status_of
from mir_sim.fleets.orders import Vehicle
from mir_sim.resources.call import Call, Handlers
from mir_sim.site import ADMINISTRATOR, USER_GROUPS

if TYPE_CHECKING:
    from mir_sim.fleets.classic import ClassicFleet

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


HANDLERS: Handlers = {
    ("get", "/robots"): list_robots,
    ("post", "/robots"): add_robot,
    ("get", "/robots/scan"): scan,
    ("get", "/robots/scan/{ip}"): scan,
    ("get", "/robots/{id}"): get_robot,
    ("put", "/robots/{id}"): put_robot,
    ("delete", "/robots/{id}"): remove_robot,
    ("get", "/missions/{guid}/qualified_robots"): qualified_robots,
}
