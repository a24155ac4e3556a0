"""A client of one simulated robot or classic fleet that supplies what an operation needs: credentials, bodies, keys of existing rows."""

from __future__ import annotations

from typing import Any

from mir_sim import MISSIONS, SimulatedRobot
from mir_sim.definition import FLEET_SOFTWARE, load
from mir_sim.fleets.classic import ClassicFleet
from mir_sim.missions import DEFAULT_GROUP
from mir_sim.site import USER_GROUPS
from mir_sim.world import BY_NAME, MAP_GUID, SESSION_GUID
from tests.unit.sim.asking import Asker

# Fields of bodies that must refer to something that exists.
REFERENCES: dict[str, Any] = {
    "mission_id": MISSIONS[0].guid,
    "group_id": DEFAULT_GROUP,
    "map_id": MAP_GUID,
    "map_guid": MAP_GUID,
    "session_id": SESSION_GUID,
    "session_guid": SESSION_GUID,
    "pos_id": BY_NAME["Dock"].guid,
    "pos_guid": BY_NAME["Dock"].guid,
    "user_group_id": USER_GROUPS["Distributors"],
    "user_group_guid": USER_GROUPS["Distributors"],
    "type_id": 0,
    "parent_id": "",
    "mission_group_id": DEFAULT_GROUP,
    "earliest_start_time": "2026-11-23T07:00:00",
    "ip": "192.0.2.1",
    "charger_id": BY_NAME["Charger"].guid,
}
# Bodies that the definition alone doesn't describe well enough.
BODIES: dict[tuple[str, str], Any] = {
    ("put", "/status"): {"state_id": 4},
    ("put", "/users/me"): {"email": "someone@example.com"},
    ("put", "/registers/{id}"): {"value": 7},
    ("post", "/registers/{id}"): {"value": 7, "label": "Counter"},
    ("post", "/platform/timezone"): {"value": "Europe/Helsinki"},
}
BODIES_OF_FLEETS = {**BODIES, ("put", "/status"): {"state": "normal"}}
KEYS = ("guid", "id", "uuid", "file_name", "action_type")


class Client(Asker):
    """Sends requests to a new robot, or to a new fleet, without a network."""

    _bodies = BODIES

    def __init__(self, software: str) -> None:
        if software == FLEET_SOFTWARE:
            self._bodies = BODIES_OF_FLEETS
            self.machine = ClassicFleet("Fleet", [SimulatedRobot("Aino", battery=80.0, software="2.14.7")])
        else:
            super().__init__(software=software)
        self.document = load(software).document

    def body(self, verb: str, template: str, params: dict[str, str] | None = None) -> Any:
        """A body with every field of the definition, or None when the operation takes none."""
        if (verb, template) == ("post", "/robots") and isinstance(self.machine, ClassicFleet):
            self.send("DELETE", "/robots/1")  # only a robot that isn't there can be added
        if (verb, template) in self._bodies:
            return self._bodies[verb, template]
        for parameter in self.document["paths"][template][verb]["parameters"]:
            if parameter["in"] == "body":
                return self._value("", parameter["schema"], params or {})
        return None

    def _value(self, name: str, schema: dict[str, Any], params: dict[str, str]) -> Any:
        if "$ref" in schema:
            schema = self.document["definitions"][schema["$ref"].rsplit("/", 1)[-1]]
        if name in params:
            return int(params[name]) if schema.get("type") == "integer" else params[name]
        if name in REFERENCES:
            return REFERENCES[name]
        if "enum" in schema:
            return schema["enum"][0]
        match schema.get("type"):
            case "object":
                left_out = {"guid", "created_by_id"} - set(schema.get("required", ()))
                return {
                    field: self._value(field, inner, params)
                    for field, inner in schema.get("properties", {}).items()
                    if field not in left_out
                }
            case "array":
                return []
            case "integer":
                return 1
            case "number":
                return 1.5
            case "boolean":
                return True
            case _:
                return "x" * max(4, schema.get("minLength", 0))

    def fill(self, template: str) -> dict[str, str] | None:
        """Keys of existing rows for the placeholders of a path, or None when the robot has no such row and none can be added."""
        params: dict[str, str] = {}
        path, segments = "", template.strip("/").split("/")
        for number, segment in enumerate(segments):
            if segment.startswith("{"):
                key = self._key("/" + "/".join(segments[:number]), path, params)
                if key is None:
                    return None
                params[segment[1:-1]] = key
                segment = key
            path += f"/{segment}"
        return params

    def _key(self, template: str, path: str, params: dict[str, str]) -> str | None:
        """The key of the first entry of a collection, or of one that is added to it."""
        verbs = self.document["paths"].get(template, {})
        if template == "/mission_queue":
            self.send("POST", path, {"mission_id": MISSIONS[0].guid})
            self.pass_time(30)  # some actions have started
        if "get" in verbs:
            found = self.send("GET", path).json()
            if isinstance(found, list) and found:
                return self._key_of(found[0])
        if "post" in verbs:
            answer = self.send("POST", path, self.body("post", template, params) or {})
            if answer.status == 201:
                return self._key_of(answer.json())
        return None

    @staticmethod
    def _key_of(entry: dict[str, Any]) -> str | None:
        return next((str(entry[key]) for key in KEYS if key in entry), None)
