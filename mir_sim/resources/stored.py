"""Operations that only read and write stored data: on collections, and on single objects, which are empty until written."""

from __future__ import annotations

from typing import Any

from mir_sim import missions
from mir_sim.errors import ApiError, argument_error
from mir_sim.resources import rows
from mir_sim.resources.call import Call
from mir_sim.site import MISSION_ACTIONS, Row, Table, with_hashed_password

# Collections inside a row of another one: template → (table, field that holds the key of that row).
NESTED = {
    "/dashboards/{dashboard_id}/widgets": ("/dashboards/{dashboard_id}/widgets", "dashboard_id"),
    "/maps/{map_id}/area_events": ("/area_events", "map_id"),
    "/maps/{map_id}/path_guides": ("/path_guides", "map_id"),
    "/maps/{map_id}/paths": ("/paths", "map_id"),
    "/maps/{map_id}/positions": ("/positions", "map_id"),
    "/maps/{map_id}/zones": ("/zones", "map_id"),
    "/mission_groups/{group_id}/missions": ("/missions", "group_id"),
    "/missions/{mission_id}/actions": (MISSION_ACTIONS, "mission_id"),
    "/path_guides/{path_guide_guid}/positions": ("/path_guides_positions", "path_guide_guid"),
    "/positions/{parent_guid}/helper_positions": ("/positions", "parent_id"),
    "/positions/{pos_id}/docking_offsets": ("/docking_offsets", "pos_id"),
    "/sessions/{session_id}/elevator_floors": ("/elevator_floors", "session_guid"),
    "/sessions/{session_id}/elevators": ("/elevators", "session_guid"),
    "/sessions/{session_id}/maps": ("/maps", "session_id"),
    "/sessions/{session_id}/missions": ("/missions", "session_id"),
    "/sessions/{session_id}/position_transition_lists": ("/position_transition_lists", "session_id"),
    "/setting_groups/{settings_group_id}/settings": ("/settings", "settings_group_id"),
    "/setting_groups/{settings_group_id}/settings/advanced": ("/settings/advanced", "settings_group_id"),
    "/user_groups/{user_group_guid}/permissions": ("/permissions", "user_group_guid"),
}


def generic(call: Call) -> Any:
    """Handle an operation that has no handler of its own."""
    template = call.operation.template
    head, _, tail = template.rpartition("/")
    key = tail[1:-1] if tail.startswith("{") else None
    collection = head if key else template
    _check_parent(call, collection)
    table, field = NESTED.get(collection, (collection, None))
    if key is not None:
        return _item(call, table, field, call.params[key])
    if field is not None or rows.item_template(call.machine.software, table) is not None or call.operation.is_list:
        return _collection(call, table, field)
    return _single(call)


def _check_parent(call: Call, collection: str) -> None:
    """Raise 404 when the row that the collection is inside of doesn't exist."""
    owner, placeholder, _ = collection.partition("/{")
    if placeholder and _parent_key(call) not in call.machine.site.table(owner):
        raise ApiError(404)


def _parent_key(call: Call) -> str:
    """The key of the row that a nested collection is inside of: the first placeholder of the path."""
    return next(iter(call.params.values()))


def _item(call: Call, table: str, field: str | None, key: str) -> dict[str, Any] | None:
    rows_of, verb = call.machine.site.table(table), call.operation.verb
    row = rows_of.get(key)
    if row is None and rows_of.has_had(key) and verb == "get" and not call.machine.software.startswith("2."):
        raise ApiError(410)  # MiR's definition 3.5.4 lists this code; that it means "deleted" is a guess
    if row is None or (field is not None and row.get(field) != _parent_key(call)):
        raise ApiError(404)
    if verb != "get" and row.get("guid") in missions.BUILT_IN:
        raise ApiError(400)
    if verb == "delete":
        rows_of.remove(key)
        return None
    if verb == "put":
        changes = with_hashed_password(call.changes())
        row.update(_with_parameters(call, changes) if table == MISSION_ACTIONS else changes)
    elif verb == "post" and call.operation.body_schema is not None:
        row.update(with_hashed_password(call.fields()))
    return rows.full(call.machine, table, row)


def _collection(call: Call, table: str, field: str | None) -> Any:
    verb, rows_of = call.operation.verb, call.machine.site.table(table)
    if verb == "post":
        return _create(call, table, rows_of, field)
    if verb == "delete":
        rows_of.clear()
        return None
    brief = call.machine.definition.properties(call.operation.schema)
    return [
        rows.Entry(call.machine, table, row, brief)
        for row in rows_of
        if field is None or row.get(field) == _parent_key(call)
    ]


def _single(call: Call) -> Any:
    """An object outside of all collections, or a command, which only stores its body."""
    verb, written = call.operation.verb, call.machine.site.single(call.operation.template, tuple(call.params.values()))
    if verb == "delete":
        written.clear()
        return None
    if call.operation.body_schema is not None:
        written.update(call.changes() if verb == "put" else call.fields())
    value = call.machine.definition.blank(call.operation.schema or {})
    return (
        {**value, **{name: inner for name, inner in written.items() if name in value}}
        if isinstance(value, dict)
        else value
    )


def _create(call: Call, table_name: str, table: Table, field: str | None) -> dict[str, Any]:
    machine = call.machine
    fields = with_hashed_password(call.fields() if call.operation.body_schema is not None else {})
    if field is not None and fields.setdefault(field, _parent_key(call)) != _parent_key(call):
        raise argument_error(field)
    if fields.get(table.key) in table:
        raise ApiError(409)
    row: Row = {**rows.blank(machine, table_name), table.key: _new_key(call, table), **fields}
    row.setdefault("created_by_id", call.asker["guid"])
    table.add(_with_parameters(call, row) if table_name == MISSION_ACTIONS else row)
    return rows.shown(machine, table_name, row, machine.definition.properties(call.operation.schema))


def _with_parameters(call: Call, action: Row) -> Row:
    """The action with complete parameters. Each must have an ``id`` and can have a ``value`` and an ``input_name``."""
    if "parameters" not in action:
        return action
    for one in action["parameters"]:
        name = one.get("input_name") if isinstance(one, dict) else 0
        if (
            not isinstance(one, dict)
            or not isinstance(one.get("id"), str)
            or not (name is None or isinstance(name, str))
        ):
            raise argument_error("parameters")
    complete = [
        {"guid": call.machine.site.new_guid(), "value": None, "input_name": None, **one} for one in action["parameters"]
    ]
    return {**action, "parameters": complete}


def _new_key(call: Call, table: Table) -> Any:
    return max((int(row["id"]) for row in table), default=0) + 1 if table.key == "id" else call.machine.site.new_guid()
