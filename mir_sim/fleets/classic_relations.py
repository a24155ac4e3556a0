"""What belongs to the groups of a classic fleet: mission groups to robot groups, robots and chargers to charging groups, and the like."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mir_sim.errors import ApiError, argument_error
from mir_sim.fleets.classic_view import fleet_of
from mir_sim.resources import rows
from mir_sim.resources.call import Call, Handlers

if TYPE_CHECKING:
    from mir_sim.fleets.classic import ClassicFleet

# Collection → the field that holds the key of a member.
MEMBERS = {
    "/robot_groups/{robot_group_id}/mission_groups": "mission_group_id",
    "/charging_groups/{group_id}/robots": "robot_id",
    "/charging_groups/{group_id}/chargers": "charger_id",
    "/elevator_groups/{group_id}/elevators": "elevator_guid",
    "/elevator_groups/{group_id}/robots": "robot_id",
}
# The groups that something is a member of: by its own path.
GROUPS = {
    "/robots/{robot_id}/charging_groups": "/charging_groups/{group_id}/robots",
    "/chargers/{charger_id}/charging_groups": "/charging_groups/{group_id}/chargers",
}


def members(fleet: ClassicFleet, collection: str, group: object) -> list[Any]:
    """The keys of the members of a group."""
    return fleet.relations.setdefault((collection, str(group)), [])


def _place(call: Call) -> tuple[str, str, list[Any]]:
    """The collection, the group's key and its members. Raises 404 when there is no such group."""
    collection = next(one for one in MEMBERS if call.operation.template.startswith(one))
    group = next(iter(call.params.values()))
    if group not in call.machine.site.table(collection.partition("/{")[0]):
        raise ApiError(404)
    return collection, group, members(fleet_of(call), collection, group)


def _shown(call: Call, collection: str, group: str, member: Any) -> dict[str, Any]:
    """A pair in the fields of the definition."""
    owner = collection.partition("{")[2].partition("}")[0]
    values = {
        owner: int(group),
        MEMBERS[collection]: member,
        "url": f"/v2.0.0{collection.format(**{owner: group})}/{member}",
    }
    fields = call.machine.definition.properties(call.operation.schema)
    return {name: values.get(name, call.machine.definition.blank(schema)) for name, schema in fields.items()}


def list_members(call: Call) -> list[dict[str, Any]]:
    collection, group, keys = _place(call)
    return [_shown(call, collection, group, key) for key in keys]


def add_member(call: Call) -> dict[str, Any]:
    """409 for one that belongs to the group already."""
    collection, group, keys = _place(call)
    name = MEMBERS[collection]
    key = call.fields()[name]
    if not _exists(fleet_of(call), name, key):
        raise argument_error(name)
    if key in keys:
        raise ApiError(409)
    keys.append(key)
    return _shown(call, collection, group, key)


def _exists(fleet: ClassicFleet, name: str, key: object) -> bool:
    """Whether there is what a field names. Elevators are not looked for."""
    if name == "robot_id":
        return any(str(vehicle.number) == str(key) for vehicle in fleet.vehicles)
    table = {"mission_group_id": "/mission_groups", "charger_id": "/positions"}.get(name)
    return table is None or key in fleet.site.table(table)


def _member(call: Call) -> tuple[str, str, list[Any], Any]:
    collection, group, keys = _place(call)
    wanted = list(call.params.values())[-1]
    found = [key for key in keys if str(key) == wanted]
    if not found:
        raise ApiError(404)
    return collection, group, keys, found[0]


def get_member(call: Call) -> dict[str, Any]:
    collection, group, _, key = _member(call)
    return _shown(call, collection, group, key)


def remove_member(call: Call) -> None:
    _, _, keys, key = _member(call)
    keys.remove(key)


def groups_of(call: Call) -> list[dict[str, Any]]:
    """The groups that a robot or a charger belongs to."""
    collection = GROUPS[call.operation.template]
    (name, key), *_ = call.params.items()
    if not _exists(fleet_of(call), name, key):
        raise ApiError(404)
    fields = call.machine.definition.properties(call.operation.schema)
    table = collection.partition("/{")[0]
    return [
        rows.shown(call.machine, table, row, fields)
        for row in call.machine.site.table(table)
        if key in map(str, members(fleet_of(call), collection, row["id"]))
    ]


HANDLERS: Handlers = {("get", template): groups_of for template in GROUPS}
for _collection, _name in MEMBERS.items():
    HANDLERS |= {
        ("get", _collection): list_members,
        ("post", _collection): add_member,
        ("get", f"{_collection}/{{{_name}}}"): get_member,
        ("delete", f"{_collection}/{{{_name}}}"): remove_member,
    }
