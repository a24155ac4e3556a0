"""What is stored on the robot and can be read and edited through collections of the API: missions, positions, maps, users and the rest.

A table is named after its collection path. Rows hold plain fields; links to other resources are made when a row is shown.
"""
from __future__ import annotations

import hashlib
import random
from collections.abc import Iterator
from typing import Any

from mir_sim import missions, world
from mir_sim.missions import UserParameter

Row = dict[str, Any]

ADMINISTRATOR = "mirconst-guid-0000-0005-users0000000"     # recorded
DISTRIBUTOR = "mirconst-guid-0000-0004-users0000000"       # guess: its neighbour
USER_GROUPS = {"Distributors": "mirconst-guid-0000-0003-user_groups0", "Administrators": "mirconst-guid-0000-0004-user_groups0"}
MISSION_ACTIONS = "/missions/{mission_id}/actions"


def password_hash(password: str) -> str:
    """What a client sends instead of the password: SHA-256 in lower-case hexadecimal."""
    return hashlib.sha256(password.encode()).hexdigest()


class Table:
    """Rows of one collection in the order in which they were made, found by their key field (``guid`` or ``id``)."""

    def __init__(self, key: str = "guid") -> None:
        self.key = key
        self._rows: dict[str, Row] = {}

    def __iter__(self) -> Iterator[Row]:
        return iter(self._rows.values())

    def __len__(self) -> int:
        return len(self._rows)

    def __contains__(self, key: object) -> bool:
        return str(key) in self._rows

    def get(self, key: object) -> Row | None:
        return self._rows.get(str(key))

    def add(self, row: Row) -> Row:
        self._rows[str(row[self.key])] = row
        return row

    def remove(self, key: object) -> None:
        del self._rows[str(key)]

    def clear(self) -> None:
        self._rows.clear()


class Site:
    """All tables of one robot, filled with what a freshly commissioned robot has."""

    def __init__(self, rng: random.Random) -> None:
        self._rng = rng
        self._tables: dict[str, Table] = {}
        for name in ("/registers", "/position_types", "/settings", "/setting_groups", "/log/error_reports", "/docking_offsets/types"):
            self._tables[name] = Table("id")
        self._fill_world()
        self._fill_missions()
        self._fill_users()
        for number in range(1, 201):
            self.table("/registers").add({"id": number, "label": f"PLC Register {number}", "value": 0 if number <= 100 else 0.0})

    def table(self, name: str) -> Table:
        return self._tables.setdefault(name, Table())

    def new_guid(self) -> str:
        """A guid of the shape that robots make: version 1, the last part being the robot's network address."""
        bits = self._rng.getrandbits
        return f"{bits(32):08x}-{bits(16):04x}-11ef-{0x8000 | bits(14):04x}-0001297b6e20"

    def _fill_world(self) -> None:
        self.table("/sessions").add({"guid": world.SESSION_GUID, "name": world.SESSION_NAME, "description": "", "active": True,
                                     "created_by_id": DISTRIBUTOR})
        self.table("/maps").add({"guid": world.MAP_GUID, "name": world.MAP_NAME, "session_id": world.SESSION_GUID, "resolution": 0.05,
                                 "origin_x": 0.0, "origin_y": 0.0, "origin_theta": 0.0, "created_by_id": DISTRIBUTOR})
        for number, name in world.POSITION_TYPES.items():
            self.table("/position_types").add({"id": number, "name": name, "hidden": False, "reachable_for_robot": number not in (world.CHARGER,)})
        for station in world.STATIONS:
            pose = station.pose
            self.table("/positions").add({
                "guid": station.guid, "name": station.name, "pos_x": pose.x, "pos_y": pose.y, "orientation": pose.orientation,
                "type_id": station.type_id, "map_id": world.MAP_GUID, "parent_id": station.parent, "created_by_id": DISTRIBUTOR})

    def _fill_missions(self) -> None:
        self.table("/mission_groups").add({"guid": missions.DEFAULT_GROUP, "name": "Missions", "priority": 1, "feature": "default", "icon": "",
                                           "created_by_id": ADMINISTRATOR})
        for mission in missions.MISSIONS:
            self._add_mission(mission.guid, mission.name, mission.description, hidden=False)
            for priority, action in enumerate(mission.actions, start=1):
                self.table(MISSION_ACTIONS).add({
                    "guid": self.new_guid(), "action_type": action.type, "mission_id": mission.guid, "priority": priority, "scope_reference": "",
                    "created_by_id": DISTRIBUTOR, "parameters": [self._parameter(name, value) for name, value in action.parameters.items()]})
        for guid, name in missions.BUILT_IN.items():
            self._add_mission(guid, name, "", hidden=True)

    def _add_mission(self, guid: str, name: str, description: str, hidden: bool) -> None:
        self.table("/missions").add({"guid": guid, "name": name, "description": description, "session_id": world.SESSION_GUID,
                                     "group_id": missions.DEFAULT_GROUP, "hidden": hidden, "is_template": False, "valid": True,
                                     "created_by_id": ADMINISTRATOR if hidden else DISTRIBUTOR})

    def _parameter(self, name: str, value: Any) -> Row:
        asked = isinstance(value, UserParameter)
        return {"guid": self.new_guid(), "id": name, "value": value.default if asked else value, "input_name": value.input_name if asked else None}

    def _fill_users(self) -> None:
        for name, guid in USER_GROUPS.items():
            self.table("/user_groups").add({"guid": guid, "name": name, "session_expiration_enabled": False, "session_timeout": 0,
                                            "created_by_id": ADMINISTRATOR})
        for guid, name, group in ((DISTRIBUTOR, "distributor", "Distributors"), (ADMINISTRATOR, "admin", "Administrators")):
            self.table("/users").add({"guid": guid, "username": name, "name": "Administrator" if name == "admin" else "Distributor", "email": "",
                                      "user_group_id": USER_GROUPS[group], "single_dashboard": False, "dashboard_id": "",
                                      "password_hash": password_hash(name), "created_by_id": ADMINISTRATOR})

    def mission_actions(self, mission_id: str) -> list[Row]:
        """The actions of a mission in the order in which they run."""
        rows = [row for row in self.table(MISSION_ACTIONS) if row["mission_id"] == mission_id]
        return sorted(rows, key=lambda row: int(row["priority"]))

    def user_parameters(self, mission_id: str) -> dict[str, Row]:
        """The values a mission asks for when it is queued: input name → action parameter."""
        return {parameter["input_name"]: parameter for row in self.mission_actions(mission_id)
                for parameter in row["parameters"] if parameter.get("input_name")}
