"""The data stored on the robot, which clients read and edit through collections of the API: missions, positions, maps, users and more.

A table is named after its collection path, or after its path template where it exists only inside another row.
Rows hold plain fields; links to other resources are added when a row is shown.
"""

from __future__ import annotations

import hashlib
import itertools
import random
from collections.abc import Callable, Iterator
from typing import Any

from mir_sim import floor_plan, missions, settings, world
from mir_sim.footprints import footprint_of
from mir_sim.missions import Mission, UserParameter

Row = dict[str, Any]

ADMINISTRATOR = "mirconst-guid-0000-0005-users0000000"  # recorded
DISTRIBUTOR = "mirconst-guid-0000-0004-users0000000"  # guess: one lower
USER_GROUPS = {
    "Distributors": "mirconst-guid-0000-0003-user_groups0",
    "Administrators": "mirconst-guid-0000-0004-user_groups0",
}
MISSION_ACTIONS = "/missions/{mission_id}/actions"
KEYS = {
    "/registers": "id",
    "/position_types": "id",
    "/settings": "id",
    "/settings/advanced": "id",
    "/setting_groups": "id",
    "/modbus": "id",
    "/log/error_reports": "id",
    "/docking_offsets/types": "id",
    "/robot_groups": "id",
    "/charging_groups": "id",
    "/elevator_groups": "id",
    "/evacuations": "id",
    "/fire_alarms": "id",
    "/system/setup/serial_devices": "id",
    "/wifi/connections": "uuid",
    "/wifi/certificates": "file_name",
    "/guided_move": "guided_move_id",
}


def new_guid(rng: random.Random) -> str:
    """A guid as robots make them: version 1, with the robot's network address as its last part."""
    bits = rng.getrandbits
    return f"{bits(32):08x}-{bits(16):04x}-11ef-{0x8000 | bits(14):04x}-0001297b6e20"


def password_hash(password: str) -> str:
    """What a client sends in place of the password: its SHA-256 in lower-case hexadecimal."""
    return hashlib.sha256(password.encode("utf-8", "surrogatepass")).hexdigest()


def with_hashed_password(fields: Row) -> Row:
    """The fields of a user as they are stored: with the hash in place of the password."""
    kept = {name: value for name, value in fields.items() if name != "password"}
    return {**kept, "password_hash": password_hash(fields["password"])} if "password" in fields else kept


def _parameter(name: str, value: Any, new_guid: Callable[[], str]) -> Row:
    if isinstance(value, UserParameter):
        return {"guid": value.guid or new_guid(), "id": name, "value": value.default, "input_name": value.input_name}
    return {"guid": new_guid(), "id": name, "value": value, "input_name": None}


# What a fleet keeps the same on all its robots.
SYNCHRONISED = (
    "/missions",
    MISSION_ACTIONS,
    "/mission_groups",
    "/sessions",
    "/maps",
    "/positions",
    "/users",
    "/user_groups",
)


class Table:
    """The rows of one collection in the order in which they were added, found by their key field."""

    def __init__(self, key: str = "guid") -> None:
        self.key = key
        self._rows: dict[str, Row] = {}
        self._removed: set[str] = set()

    def __iter__(self) -> Iterator[Row]:
        return iter(self._rows.values())

    def __len__(self) -> int:
        return len(self._rows)

    def __contains__(self, key: object) -> bool:
        return str(key) in self._rows

    def get(self, key: object) -> Row | None:
        return self._rows.get(str(key))

    def has_had(self, key: str) -> bool:
        """Whether a row with this key was deleted."""
        return key in self._removed

    def add(self, row: Row) -> Row:
        self._rows[str(row[self.key])] = row
        self._removed.discard(str(row[self.key]))
        return row

    def remove(self, key: object) -> None:
        del self._rows[str(key)]
        self._removed.add(str(key))

    def clear(self) -> None:
        self._removed.update(self._rows)
        self._rows.clear()


class Site:
    """All tables of one robot, filled as on a newly commissioned one."""

    def __init__(self, rng: random.Random, software: str, model: str) -> None:
        self._rng = rng
        self._tables: dict[str, Table] = {}
        self._singles: dict[tuple[str, tuple[str, ...]], dict[str, Any]] = {}
        self._fill_world("map" if software.startswith("2.") else "base_map")
        self._fill_missions()
        self._fill_users()
        for number in range(1, 201):
            self.table("/registers").add(
                {"id": number, "label": f"PLC Register {number}", "value": 0 if number <= 100 else 0.0}
            )
        for name, rows in settings.TABLES.items():
            for row in rows:
                self.table(name).add(dict(row))
        self.table("/footprints").add(
            {
                "guid": "mirconst-guid-0000-0001-footprint000",
                "name": f"Default footprint {model}",
                "config_id": model,
                "height": 0.3,
                "footprint_points": footprint_of(model),
                "hook": False,
                "custom": False,
                "created_by_id": ADMINISTRATOR,
            }
        )
        self.table("/wifi/networks").add({"guid": self.new_guid(), "ssid": "Production", "connected": True})
        self.table("/wifi/connections").add(
            {
                "uuid": self.new_guid(),
                "name": "Production",
                "connected": True,
                "mac": "00:01:29:7b:6e:20",
                "bssid": "00:1a:1e:4c:2b:90",
                "description": "",
                "type": "802-11-wireless",
                "device": "wlan0",
                "security": "wpa-psk",
                "ip_address": "192.168.12.20",
            }
        )

    def table(self, name: str) -> Table:
        """The rows of a collection; created empty when first asked for."""
        if name not in self._tables:
            self._tables[name] = Table(KEYS.get(name, "guid"))
        return self._tables[name]

    def share(self, other: Site) -> None:
        """Have the same missions, maps and users as another one from now on: a change here is a change there."""
        self._tables.update({name: other.table(name) for name in SYNCHRONISED})

    def single(self, template: str, keys: tuple[str, ...]) -> dict[str, Any]:
        """The fields that were written to an object outside of all collections."""
        return self._singles.setdefault((template, keys), {})

    def new_guid(self) -> str:
        return new_guid(self._rng)

    def _fill_world(self, image_field: str) -> None:
        self.table("/sessions").add(
            {
                "guid": world.SESSION_GUID,
                "name": world.SESSION_NAME,
                "description": "",
                "active": True,
                "created_by_id": DISTRIBUTOR,
            }
        )
        self.table("/maps").add(
            {
                "guid": world.MAP_GUID,
                "name": world.MAP_NAME,
                "session_id": world.SESSION_GUID,
                "resolution": floor_plan.RESOLUTION,
                "origin_x": floor_plan.PLAN.left,
                "origin_y": floor_plan.PLAN.bottom,
                "origin_theta": 0.0,
                "created_by_id": DISTRIBUTOR,
                image_field: floor_plan.base_map(),
            }
        )
        for number, name in world.POSITION_TYPES.items():
            self.table("/position_types").add(
                {"id": number, "name": name, "hidden": False, "reachable_for_robot": number != world.CHARGER}
            )
        for station in world.STATIONS:
            pose = station.pose
            self.table("/positions").add(
                {
                    "guid": station.guid,
                    "name": station.name,
                    "pos_x": pose.x,
                    "pos_y": pose.y,
                    "orientation": pose.orientation,
                    "type_id": station.type_id,
                    "map_id": world.MAP_GUID,
                    "parent_id": station.parent,
                    "created_by_id": DISTRIBUTOR,
                }
            )
        self.table("/docking_offsets/types").add({"id": 1, "name": "Marker"})
        for station in world.STATIONS:
            if station.type_id in (world.VL_MARKER, world.CHARGER):
                self.table("/docking_offsets").add(
                    {
                        "guid": self.new_guid(),
                        "pos_id": station.guid,
                        "docking_type": 1,
                        "name": f"{station.name} offset",
                        "x_offset": -0.7,
                        "y_offset": 0.0,
                        "orientation_offset": 0.0,
                        "created_by_id": DISTRIBUTOR,
                    }
                )

    def _fill_missions(self) -> None:
        self.table("/mission_groups").add(
            {
                "guid": missions.DEFAULT_GROUP,
                "name": "Missions",
                "priority": 1,
                "feature": "default",
                "icon": "",
                "created_by_id": ADMINISTRATOR,
            }
        )
        for mission in missions.MISSIONS:
            self._add_mission(mission, DISTRIBUTOR, self.new_guid)
        numbers = itertools.count(1)
        for mission in missions.BUILT_IN.values():
            self._add_mission(mission, ADMINISTRATOR, lambda: f"mirconst-guid-0001-{next(numbers):04d}-actlistparam")

    def _add_mission(self, mission: Mission, author: str, new_guid: Callable[[], str]) -> None:
        """``new_guid``: of its actions and their parameters, where they have none yet."""
        self.table("/missions").add(
            {
                "guid": mission.guid,
                "name": mission.name,
                "description": mission.description,
                "session_id": world.SESSION_GUID,
                "group_id": missions.DEFAULT_GROUP,
                "hidden": author == ADMINISTRATOR,
                "is_template": False,
                "valid": True,
                "created_by_id": author,
            }
        )
        for priority, action in enumerate(mission.actions, start=1):
            self.table(MISSION_ACTIONS).add(
                {
                    "guid": new_guid(),
                    "action_type": action.type,
                    "mission_id": mission.guid,
                    "priority": priority,
                    "scope_reference": "",
                    "created_by_id": author,
                    "parameters": [_parameter(name, value, new_guid) for name, value in action.parameters.items()],
                }
            )

    def _fill_users(self) -> None:
        for name, guid in USER_GROUPS.items():
            self.table("/user_groups").add(
                {
                    "guid": guid,
                    "name": name,
                    "session_expiration_enabled": False,
                    "session_timeout": 0,
                    "created_by_id": ADMINISTRATOR,
                }
            )
        for guid, username, name, group in (
            (DISTRIBUTOR, "distributor", "Distributor", "Distributors"),
            (ADMINISTRATOR, "admin", "Administrator", "Administrators"),
        ):
            self.table("/users").add(
                {
                    "guid": guid,
                    "username": username,
                    "name": name,
                    "email": "",
                    "user_group_id": USER_GROUPS[group],
                    "single_dashboard": False,
                    "dashboard_id": "",
                    "password_hash": password_hash(username),
                    "created_by_id": ADMINISTRATOR,
                }
            )

    def mission_actions(self, mission_id: str) -> list[Row]:
        """The actions of a mission in the order in which they run."""
        rows = [row for row in self.table(MISSION_ACTIONS) if row["mission_id"] == mission_id]
        return sorted(rows, key=lambda row: int(row["priority"]))

    def user_parameters(self, mission_id: str) -> dict[str, Row]:
        """The values that a mission asks for when it is queued: input name → action parameter."""
        return {
            parameter["input_name"]: parameter
            for row in self.mission_actions(mission_id)
            for parameter in row["parameters"]
            if parameter.get("input_name")
        }
