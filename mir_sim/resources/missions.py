"""The definitions of missions and of the actions that they are made of."""

from __future__ import annotations

from typing import Any

from mir_sim import catalogue
from mir_sim.errors import ApiError
from mir_sim.resources.call import Call, Handlers


def mission_definition(call: Call) -> list[dict[str, Any]]:
    """The mission as an action, with the parameters it asks for when queued. What the fields contain is a guess."""
    guid = call.params["guid"]
    mission = call.machine.site.table("/missions").get(guid)
    if mission is None:
        raise ApiError(404)
    kinds = {
        parameter["guid"]: catalogue.parameter_type(row["action_type"], parameter["id"])
        for row in call.machine.site.mission_actions(guid)
        for parameter in row["parameters"]
    }
    asked = [
        catalogue.parameter(name, name, kinds[parameter["guid"]], parameter["value"])
        for name, parameter in call.machine.site.user_parameters(guid).items()
    ]
    return [
        {
            "url": f"/v2.0.0/missions/{guid}/definition",
            "action_type": f"mission_{guid}",
            "name": mission["name"],
            "description": mission["description"],
            "parameters": asked,
        }
    ]


def list_definitions(call: Call) -> list[dict[str, Any]]:
    return catalogue.definitions()


def group_definitions(call: Call) -> list[dict[str, Any]]:
    group = call.params["mission_group_id"]
    if group not in call.machine.site.table("/mission_groups"):
        raise ApiError(404)
    return [definition for definition in catalogue.definitions() if definition["mission_group_id"] == group]


def action_definition(call: Call) -> dict[str, Any]:
    """GET it, or POST values to learn what the others can then be; here they don't depend on each other."""
    if call.operation.verb == "post":
        call.fields()
    found = catalogue.definition(call.params["action_type"])
    if found is None:
        raise ApiError(404)
    return found


HANDLERS: Handlers = {
    ("get", "/missions/{guid}/definition"): mission_definition,
    ("get", "/actions"): list_definitions,
    ("get", "/actions/{action_type}"): action_definition,
    ("post", "/actions/{action_type}"): action_definition,
    ("get", "/mission_groups/{mission_group_id}/actions"): group_definitions,
}
