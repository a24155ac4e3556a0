"""/status, evacuations, questions and restarts: a classic fleet as a whole."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from mir_sim.errors import ApiError, argument_error
from mir_sim.fleets.classic_view import fleet_of, prompt_of
from mir_sim.messages import Response
from mir_sim.resources import stored
from mir_sim.resources.call import Call, Handlers

RESTART = 30.0  # real s that a fleet is offline when it is asked to restart (guess)


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
        {**prompt_of(vehicle), "url": f"/v2.0.0/prompt/{vehicle.robot.prompt.guid}", "robot_id": vehicle.number}
        for vehicle in fleet_of(call).vehicles
        if vehicle.is_online and vehicle.robot.prompt is not None
    ]


def prompt(call: Call) -> dict[str, Any]:
    """Read a question, or answer it."""
    guid = call.params["guid"]
    for vehicle in fleet_of(call).vehicles:
        if vehicle.is_online and vehicle.robot.prompt is not None and vehicle.robot.prompt.guid == guid:
            answer = call.changes()["answer"] if call.operation.verb == "put" else ""
            shown = {**prompt_of(vehicle), "robot_id": vehicle.number, "answer": answer}
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
    ("get", "/status"): get_status,
    ("put", "/status"): put_status,
    ("post", "/evacuations"): evacuate,
    ("get", "/prompt"): list_prompts,
    ("get", "/prompt/{guid}"): prompt,
    ("put", "/prompt/{guid}"): prompt,
    ("get", "/metrics"): metrics,
    ("post", "/restart"): restart,
}
