"""The REST API of Fleet Enterprise as a pure function: a request in, an answer out."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

from mir_sim import catalogue
from mir_sim.fleets import enterprise_robots
from mir_sim.fleets.enterprise_definition import JSON, is_uuid, moment
from mir_sim.fleets.enterprise_orders import API_KEYS, Origin, Phase, SerialOrder, order_shown
from mir_sim.fleets.orders import Vehicle
from mir_sim.messages import Request, Response
from mir_sim.site import Row

if TYPE_CHECKING:
    from mir_sim.fleets.enterprise import EnterpriseFleet

PROBLEM = "application/problem+json"
LOGGED = ("Executing", "Aborting", "Aborted", "Finished", "Invalid")  # in GET /order unless statuses are asked for
HOUR = 3600.0
KINDS = {"position": "Position", "marker": "Position"}  # of arguments, by the parameter of the action


class Problem(Exception):
    """An answer other than success. ``detail`` says what is wrong."""

    def __init__(self, status: int, detail: str = "") -> None:
        self.status, self.detail = status, detail
        super().__init__(f"{status} {detail}")


@dataclass(frozen=True)
class Call:
    """A request whose operation is known and whose body fits it."""

    fleet: EnterpriseFleet
    request: Request
    params: Mapping[str, str]
    body: Any
    key_name: str


Reply = tuple[int, Any]  # the status; the value, None for no body


def answer(fleet: EnterpriseFleet, request: Request) -> Response:
    """Answer one request. 401 and its body are a guess, as is that a wrong id counts as an unknown one."""
    if request.path == "/healthz":
        return Response(200, {"Content-Type": "text/plain"}, b"Healthy")
    found = fleet.definition.find(request.method.lower(), request.path)
    operation: Mapping[str, Any] = found[2] if found is not None else {}
    try:
        name = API_KEYS.get(request.headers.get("x-api-key", ""))
        if name is None:
            raise Problem(401, "The API key is missing or wrong.")
        if found is None:
            raise Problem(404, "There is no such operation.")
        template, params, _ = found
        if not all(is_uuid(params[one["name"]]) for one in _uuids(operation)):
            raise Problem(404 if "404" in operation["responses"] else 400, "The id is not a UUID.")
        status, value = HANDLERS[request.method.lower(), template](
            Call(fleet, request, params, _body(fleet, request, operation), name)
        )
    except Problem as problem:
        return refuse(problem, operation, request.headers.get("accept", ""))
    if value is None:
        return Response(status)
    return _written(status, value, _content_type(operation, status, request.headers.get("accept", ""), JSON))


def refuse(problem: Problem, operation: Mapping[str, Any], accept: str) -> Response:
    """``type`` and ``instance`` have the shape of MiR's example."""
    phrase = HTTPStatus(problem.status).phrase
    value = {
        "type": f"/errors/{phrase.lower().replace(' ', '-')}",
        "title": phrase,
        "status": problem.status,
        "detail": problem.detail or phrase,
        "instance": "/runtime/log/0",
    }
    return _written(problem.status, value, _content_type(operation, problem.status, accept, PROBLEM))


def _content_type(operation: Mapping[str, Any], status: int, accept: str, usual: str) -> str:
    """Of the documented ones the one that the client accepts, or the first."""
    documented: list[str] = list(operation.get("responses", {}).get(str(status), {}).get("content", ())) or [usual]
    return next((one for one in documented if one in accept), documented[0])


def _written(status: int, value: Any, content_type: str) -> Response:
    return Response(status, {"Content-Type": content_type}, json.dumps(value).encode())


def _uuids(operation: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    for one in operation.get("parameters", ()):
        if one["in"] == "path" and one["schema"].get("format") == "uuid":
            yield one


def _body(fleet: EnterpriseFleet, request: Request, operation: Mapping[str, Any]) -> Any:
    if "requestBody" not in operation:
        return None
    try:
        body = json.loads(request.body)
    except (ValueError, RecursionError):
        raise Problem(400, "The body is not JSON.") from None
    schema = operation["requestBody"]["content"][JSON]["schema"]
    if wrong := list(fleet.definition.misfits(schema, body, "$")):
        raise Problem(400, f"Missing or wrong: {', '.join(wrong)}.")
    return body


# ---------------------------------------------------------------------- the system and its site
def get_version(call: Call) -> Reply:
    return 200, {"version": call.fleet.knobs.version, "fleet-name": call.fleet.name}


def list_missions(call: Call) -> Reply:
    rows = [row for row in call.fleet.site.table("/missions") if not row["hidden"]]
    return 200, {"missions": [{"id": row["guid"], "name": row["name"]} for row in rows]}


def get_mission(call: Call) -> Reply:
    row = call.fleet.site.table("/missions").get(call.params["id"])
    if row is None:
        raise Problem(404, "There is no such mission.")
    return 200, {"name": row["name"], "arguments": list(_arguments(call.fleet, row["guid"]))}


def _arguments(fleet: EnterpriseFleet, mission_id: str) -> Iterator[Row]:
    """What a mission asks for. The default is empty where there is none (guess)."""
    for action in fleet.site.mission_actions(mission_id):
        for one in action["parameters"]:
            if one.get("input_name"):
                kind = KINDS.get(one["id"]) or catalogue.parameter_type(action["action_type"], one["id"])
                default = "" if one["value"] is None else str(one["value"])
                yield {"name": one["input_name"], "default-value": default, "type": kind}


def list_positions(call: Call) -> Reply:
    rows = call.fleet.site.table("/positions")
    return 200, {"positions": [{"id": row["guid"], "name": row["name"]} for row in rows]}


# ---------------------------------------------------------------------- robots
def list_robots(call: Call) -> Reply:
    return 200, {"robots": [enterprise_robots.identity(one, call.fleet.text_of) for one in call.fleet.vehicles]}


def robot_identities(call: Call) -> Reply:
    return 200, {"robot-identity-events": list_robots(call)[1]["robots"]}


def _vehicle(call: Call, guid: str | None, status: int) -> Vehicle:
    vehicle = call.fleet.vehicle(guid)
    if vehicle is None:
        raise Problem(status, "There is no such robot.")
    return vehicle


def get_robot(call: Call) -> Reply:
    """While a robot is offline, the last that was heard of it, or who it is alone."""
    fleet, vehicle = call.fleet, _vehicle(call, call.params["id"], 404)
    if vehicle.is_online:
        return 200, enterprise_robots.shown(vehicle, fleet.text_of)
    if fleet.knobs.offline_robot == "identity":
        return 200, {"robot-identity": enterprise_robots.identity(vehicle, fleet.text_of)}
    return 200, fleet.last_shown[vehicle.number]


def change_robot(call: Call) -> Reply:
    """Pause, continue, clear errors; a while later, and without effect on a robot that is offline then (guess)."""
    fleet, vehicle = call.fleet, _vehicle(call, call.params["id"], 404)
    robot = vehicle.robot
    if call.body.get("errors"):
        raise Problem(400, "Errors can only be cleared.")
    actions: list[Callable[[], None]] = []
    if call.body.get("errors") is not None:
        actions.append(robot.clear_errors)
    if "robot-end-state" in call.body:
        actions.append(robot.pause if call.body["robot-end-state"] == "Paused" else robot.resume)

    def act() -> None:
        for action in actions if vehicle.is_online else ():
            action()

    fleet.at_robots(fleet.now + fleet.knobs.patch_seconds, act)
    return 202, None


# ---------------------------------------------------------------------- orders
def post_order(call: Call) -> Reply:
    """Take an order: at once, or later after 202. From 1.4.2 on a known id is 409; before, such an order is dropped."""
    fleet, fields = call.fleet, call.body["serial-order"]
    serial_id = fields.get("id") or fleet.new_guid()
    phases = [_phase(call, one) for one in fields["phases"]]
    if not phases or len({phase.order_id for phase in phases}) < len(phases):
        raise Problem(400, "An order needs phases, and each an order id of its own.")
    serial = SerialOrder(
        serial_id,
        fields.get("priority", "Medium"),
        _earliest(fleet, fields.get("earliest-start-time")),
        _vehicle(call, fields["robot-id"], 400) if fields.get("robot-id") else None,
        phases,
        fleet.now,
        Origin.of_key(call.key_name),
    )
    answers_id = fleet.knobs.version == "1.3.1"
    if not answers_id and fleet.is_known(serial):
        raise Problem(409, "There is an order with this id.")
    if not answers_id and fleet.knobs.posted == "created":
        fleet.add(serial)
        return 201, {"id": serial_id}
    if fleet.knobs.posted != "lost":
        fleet.add_later(serial)
    return 202, {"id": serial_id} if answers_id else None


def _phase(call: Call, fields: Row) -> Phase:
    """Unknown missions and arguments are refused (guess)."""
    fleet, arguments = call.fleet, fields.get("arguments", [])
    mission_id = fields.get("mission-id")
    for one in (mission_id, fields.get("fallback-mission-id")):
        if one is not None and one not in fleet.site.table("/missions"):
            raise Problem(400, f"There is no mission {one}.")
    asked = {one["name"]: one["default-value"] for one in _arguments(fleet, mission_id or "")}
    sent = {one.get("name"): one.get("value") for one in arguments}
    for name in (*asked, *sent) if mission_id else ():
        if name not in asked or not (sent.get(name) or asked[name]):
            raise Problem(400, f"The argument {name} is missing or unknown.")
    order_id = fields.get("order-id") if fleet.definition.has("phase", "order-id") else None
    return Phase(mission_id, arguments, fields.get("fallback-mission-id"), order_id or fleet.new_guid())


def _earliest(fleet: EnterpriseFleet, text: str | None) -> tuple[float, str | None]:
    when = moment(text) if text is not None else None
    return (fleet.now if when is None else fleet.seconds_of(when)), text


def _serial(call: Call, serial_id: str, status: int) -> SerialOrder:
    serial = call.fleet.order(serial_id)
    if serial is None:
        raise Problem(status, "There is no such order.")
    return serial


def get_serial_order(call: Call) -> Reply:
    return 200, _serial(call, call.params["id"], 404).shown()


def abort_order(call: Call) -> Reply:
    """Of one that has ended: 400 (guess)."""
    serial = _serial(call, call.params["id"], 400)
    if serial.ended is not None:
        raise Problem(400, "The order has ended.")
    call.fleet.abort(serial)
    return 202, {"id": serial.id}


def abort_fallback(call: Call) -> Reply:
    serial = _serial(call, call.params["serialOrderId"], 400)
    if not call.fleet.abort_fallback(serial):
        raise Problem(400, "No fallback mission runs.")
    return 202, {"id": serial.id}


def change_order(call: Call) -> Reply:
    """Change one that no robot has yet; of any other: 400 (guess)."""
    fleet, fields = call.fleet, call.body
    serial = _serial(call, fields["serial-order-id"], 400)
    robot = serial.wanted
    if "robot-id" in fields:
        robot = None if fields["robot-id"] is None else _vehicle(call, fields["robot-id"], 400)
    earliest = serial.earliest
    if "earliest-start-time" in fields:
        earliest = _earliest(fleet, fields["earliest-start-time"])
    if not fleet.change(serial, fields.get("priority", serial.priority), earliest, robot):
        raise Problem(400, "A robot has the order already.")
    return 202, None


def change_phase(call: Call) -> Reply:
    serial = _serial(call, call.body["serial-order-id"], 400)
    if not call.fleet.change_phase(serial, call.body["index"], _phase(call, call.body["phase"])):
        raise Problem(400, "A robot has the phase already, or there is none.")
    return 202, None


def active_orders(call: Call) -> Reply:
    """As of the fleet's last look at its robots."""
    fleet = call.fleet
    events = [event for serial in fleet.active for event in serial.events(fleet.text_of)]
    return 200, {"serial-order-status-events": events}


def shown_order(fleet: EnterpriseFleet, serial: SerialOrder, phase: Phase) -> Row:
    """A phase, which stays as it is once the order has ended: clients read long lists of those often."""
    if phase.at_end is not None:
        return phase.at_end
    mission = fleet.site.table("/missions").get(phase.mission_id)
    shown = order_shown(serial, phase, fleet.now, mission["name"] if mission else "", fleet.text_of)
    phase.at_end = shown if serial.ended is not None else None
    return shown


def get_order(call: Call) -> Reply:
    found = call.fleet.phase(call.params["id"])
    if found is None:
        raise Problem(404, "There is no such order.")
    return 200, shown_order(call.fleet, *found)


def list_orders(call: Call) -> Reply:
    """Those that run, and those that have ended within the hour or since a time that is given."""
    fleet = call.fleet
    statuses = call.request.values("orderStatuses") or LOGGED
    created, ended = _after(call, "createdAfter", float("-inf")), _after(call, "terminatedAfter", fleet.now - HOUR)
    found = [
        shown_order(fleet, serial, phase)
        for serial, phase in fleet.phases()
        if serial.created >= created
        and ((finished := serial.finished(phase)) is None or finished >= ended)
        and serial.status(phase, fleet.now) in statuses
    ]
    return 200, found


def _after(call: Call, name: str, usual: float) -> float:
    text = call.request.query.get(name)
    when = moment(text) if text is not None else None
    if text is not None and when is None:
        raise Problem(400, f"{name} is no time.")
    return usual if when is None else call.fleet.seconds_of(when)


# ---------------------------------------------------------------------- questions of robots
def list_prompts(call: Call) -> Reply:
    return 200, {"user-prompt-events": [shown for one in call.fleet.vehicles for shown in _prompts(call.fleet, one)]}


def _prompts(fleet: EnterpriseFleet, vehicle: Vehicle) -> Iterator[Row]:
    prompt, serial = vehicle.robot.prompt, next((one for one in fleet.active if one.vehicle is vehicle), None)
    if prompt is not None:
        group = fleet.site.table("/user_groups").get(prompt.user_group)
        yield {
            "id": prompt.guid,
            "title": prompt.question,
            "options": prompt.options,
            "roles": [group["name"]] if group is not None else [],
            "timeout": int(prompt.timeout),
            "timestamp": fleet.text_of(prompt.expires - prompt.timeout),
            "serial-order-id": serial.id if serial is not None else "",
            "robot-id": vehicle.guid,
        }


def answer_prompt(call: Call) -> Reply:
    """The options are counted from 1. A wrong one is refused with 400, as is a question that is not asked (guess)."""
    for vehicle in call.fleet.vehicles:
        prompt = vehicle.robot.prompt
        if prompt is not None and prompt.guid == call.body["id"]:
            if not 1 <= call.body["value"] <= len(prompt.options):
                raise Problem(400, "There is no such option.")
            vehicle.robot.withdraw_prompt(prompt.guid)
            return 200, None
    raise Problem(400, "There is no such question.")


HANDLERS: dict[tuple[str, str], Callable[[Call], Reply]] = {
    ("get", "/api/v1/system/version"): get_version,
    ("get", "/api/v1/site/mission"): list_missions,
    ("get", "/api/v1/site/mission/{id}"): get_mission,
    ("get", "/api/v1/site/position"): list_positions,
    ("get", "/api/v1/robots"): list_robots,
    ("get", "/api/v1/robots/{id}"): get_robot,
    ("patch", "/api/v1/robots/{id}"): change_robot,
    ("get", "/api/v1/robot/robot-identity/snapshot"): robot_identities,
    ("post", "/api/v1/serial-order"): post_order,
    ("patch", "/api/v1/serial-order"): change_order,
    ("get", "/api/v1/serial-order/{id}"): get_serial_order,
    ("delete", "/api/v1/serial-order/{id}"): abort_order,
    ("put", "/api/v1/serial-order/phase"): change_phase,
    ("delete", "/api/v1/serial-order/fallback/{serialOrderId}"): abort_fallback,
    ("get", "/api/v1/serial-order-status/snapshot"): active_orders,
    ("get", "/api/v1/order"): list_orders,
    ("get", "/api/v1/order/{id}"): get_order,
    ("get", "/api/v1/user-prompt-snapshot"): list_prompts,
    ("post", "/api/v1/user-prompt"): answer_prompt,
}
