"""Everything that is only stored: collections that can be listed, read, added to, changed and deleted as the definition says."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mir_sim import missions
from mir_sim.errors import ApiError, argument_error, duplicate, not_found
from mir_sim.resources.registry import Call
from mir_sim.site import MISSION_ACTIONS, Row, Table, password_hash

if TYPE_CHECKING:
    from mir_sim.robot import SimulatedRobot

# Collections that are a part of another one: template → (table, the field that names the whole).
PARTS = {
    "/maps/{map_id}/positions": ("/positions", "map_id"),
    "/maps/{map_id}/zones": ("/zones", "map_id"),
    "/maps/{map_id}/area_events": ("/area_events", "map_id"),
    "/maps/{map_id}/paths": ("/paths", "map_id"),
    "/maps/{map_id}/path_guides": ("/path_guides", "map_id"),
    "/sessions/{session_id}/maps": ("/maps", "session_id"),
    "/sessions/{session_id}/missions": ("/missions", "session_id"),
    "/sessions/{session_id}/elevators": ("/elevators", "session_guid"),
    "/sessions/{session_id}/elevator_floors": ("/elevator_floors", "session_guid"),
    "/sessions/{session_id}/position_transition_lists": ("/position_transition_lists", "session_id"),
    "/mission_groups/{group_id}/missions": ("/missions", "group_id"),
    "/missions/{mission_id}/actions": (MISSION_ACTIONS, "mission_id"),
    "/positions/{parent_guid}/helper_positions": ("/positions", "parent_id"),
    "/positions/{pos_id}/docking_offsets": ("/docking_offsets", "pos_id"),
    "/setting_groups/{settings_group_id}/settings": ("/settings", "settings_group_id"),
    "/setting_groups/{settings_group_id}/settings/advanced": ("/settings/advanced", "settings_group_id"),
    "/path_guides/{path_guide_guid}/positions": ("/path_guides_positions", "path_guide_guid"),
    "/user_groups/{user_group_guid}/permissions": ("/permissions", "user_group_guid"),
    "/dashboards/{dashboard_id}/widgets": ("/dashboards/widgets", "dashboard_id"),
}

# A field that links to a row of another table: name → table. The row keeps the key under name + "_id" or "_guid".
LINKS = {"created_by": "/users", "map": "/maps", "type": "/position_types", "parent": "/positions", "mission": "/missions", "position": "/positions",
         "user_group": "/user_groups", "owner_group": "/user_groups", "cart_type": "/cart_types", "cart_calibration": "/cart_calibrations",
         "dashboard": "/dashboards", "start_pos": "/positions", "goal_pos": "/positions", "elevator_pos": "/positions",
         "elevator_entry_pos": "/positions", "entry_mission": "/missions", "exit_mission": "/missions", "settings_group": "/setting_groups"}
KEYS_OF_LINKS = {"position": "pos_id"}
CHILDREN = {"help_positions": "helper_positions"}


def _url(table: str, key: object) -> str:
    return f"/v2.0.0/mission_actions/{key}" if table == MISSION_ACTIONS else f"/v2.0.0{table}/{key}"


def _shown(robot: SimulatedRobot, table: str, row: Row, properties: Mapping[str, Any]) -> dict[str, Any]:
    """The row with the fields of a schema: stored ones, links, and schema-true nothings for the rest."""
    key = row[robot.site.table(table).key]
    shown: dict[str, Any] = {}
    for name, schema in properties.items():
        if name in row:
            shown[name] = row[name]
        elif name == "url":
            shown[name] = _url(table, key)
        elif name in LINKS and (link := _linked(row, name)) is not None:
            shown[name] = _url(LINKS[name], link) if link != "" else ""
        elif (child := CHILDREN.get(name, name)) and any(t.startswith(f"{table}/{{") and t.endswith(f"}}/{child}") for t in robot.definition.templates()):
            shown[name] = f"{_url(table, key)}/{child}"
        else:
            shown[name] = robot.definition.blank(schema)
    return shown


def _linked(row: Row, name: str) -> Any:
    for key in (KEYS_OF_LINKS.get(name, ""), f"{name}_id", f"{name}_guid"):
        if key in row:
            return row[key]
    return None


@dataclass(frozen=True)
class Entry:
    """A row in a list."""

    robot: SimulatedRobot
    table: str
    row: Row
    brief: Mapping[str, Any]
    whole: Mapping[str, Any]

    def summary(self) -> dict[str, Any]:
        return _shown(self.robot, self.table, self.row, self.brief)

    def full(self) -> dict[str, Any]:
        return _shown(self.robot, self.table, self.row, self.whole)

    def value(self, name: str) -> Any:
        return self.row[name] if name in self.row else (self.full() | self.summary())[name]


def _item_template(robot: SimulatedRobot, table: str) -> str | None:
    if table == MISSION_ACTIONS:
        return "/missions/{mission_id}/actions/{guid}"
    return next((template for template in robot.definition.templates()
                 if template.startswith(f"{table}/{{") and template.endswith("}") and template.count("/") == table.count("/") + 1), None)


def whole_properties(robot: SimulatedRobot, table: str) -> Mapping[str, Any]:
    template = _item_template(robot, table)
    operation = robot.definition.operation("get", template) if template else None
    return robot.definition.properties(operation.schema if operation else None)


def row_full(call: Call, table: str, row: Row) -> dict[str, Any]:
    """A single row as GET shows it: the definition's fields and what was recorded besides."""
    robot = call.robot
    shown = _shown(robot, table, row, whole_properties(robot, table))
    template = _item_template(robot, table) or call.operation.template
    verbs = [verb.upper() for verb in ("put", "get", "delete") if robot.definition.operation(verb, template)]
    shown["allowed_methods"] = verbs
    if "created_by" in shown:
        author = robot.site.table("/users").get(row.get("created_by_id"))
        shown["created_by_name"] = author["name"] if author else ""
    if table == "/missions":
        shown["has_user_parameters"] = bool(robot.site.user_parameters(row["guid"]))
    return shown


def _place(call: Call) -> tuple[str, str | None, str | None]:
    """Where a template leads: the table, the field and value of the whole it is a part of, and the placeholder of the row's key."""
    template = call.operation.template
    head, _, tail = template.rpartition("/")
    key = tail[1:-1] if tail.startswith("{") else None
    collection = head if key else template
    table, field = PARTS.get(collection, (collection, None))
    return table, field, key


def generic(call: Call) -> Any:
    """Answer an operation on a collection, or with a schema-true nothing where there is no collection."""
    table_name, field, key = _place(call)
    table = call.robot.site.table(table_name)
    verb = call.operation.verb
    if field is not None:
        _check_whole(call, field)
    if key is not None:
        row = table.get(call.params[key])
        if row is None or field is not None and row.get(field) != _whole(call, field):
            raise not_found()
        if verb == "get":
            return row_full(call, table_name, row)
        if verb == "delete":
            _refuse_built_in(row)
            table.remove(call.params[key])
            return None
        return row_full(call, table_name, _change(call, row))
    if verb == "post":
        return _create(call, table_name, table, field)
    if verb == "delete":
        table.clear()
        return None
    if call.operation.is_list or table_name == MISSION_ACTIONS:
        brief, whole = call.robot.definition.properties(call.operation.schema), whole_properties(call.robot, table_name)
        rows = [row for row in table if field is None or row.get(field) == _whole(call, field)]
        return [Entry(call.robot, table_name, row, brief, whole or brief) for row in rows]
    return call.robot.definition.blank(call.operation.schema or {})


def _whole(call: Call, field: str) -> str:
    """The key of the whole, which is the first placeholder of the path."""
    return next(iter(call.params.values()))


def _check_whole(call: Call, field: str) -> None:
    """A part of something that doesn't exist is not found."""
    collection = "/" + call.operation.template.split("/")[1]
    if _whole(call, field) not in call.robot.site.table(collection):
        raise not_found()


def _refuse_built_in(row: Row) -> None:
    """Hidden built-in missions can only be read."""
    if row.get("guid") in missions.BUILT_IN:
        raise ApiError(400, "Bad request")


def _change(call: Call, row: Row) -> Row:
    _refuse_built_in(row)
    row.update(_stored(call.changes()))
    return row


def _stored(fields: dict[str, Any]) -> dict[str, Any]:
    """Passwords are kept as their hash."""
    return {("password_hash" if name == "password" else name): (password_hash(value) if name == "password" else value) for name, value in fields.items()}


def _create(call: Call, table_name: str, table: Table, field: str | None) -> dict[str, Any]:
    fields = _stored(call.fields() if call.operation.body_schema is not None else {})
    if field is not None:
        fields.setdefault(field, _whole(call, field))
        if fields[field] != _whole(call, field):
            raise argument_error()
    key = fields.get("guid")
    if key is not None and key in table:
        raise duplicate()
    row = _new_row(call, table_name, table)
    row.update({"guid": call.robot.site.new_guid(), **fields})
    row.setdefault("created_by_id", call.asker["guid"])
    if table.key == "id":
        row["id"] = max((int(other["id"]) for other in table), default=0) + 1
    if table_name == MISSION_ACTIONS:
        row["parameters"] = [{"guid": call.robot.site.new_guid(), "input_name": None, **parameter} for parameter in row["parameters"]]
    table.add(row)
    return _shown(call.robot, table_name, row, call.robot.definition.properties(call.operation.schema))


def _new_row(call: Call, table_name: str, table: Table) -> Row:
    """Stored fields of a new row at their defaults: those that are neither links nor keys."""
    whole = whole_properties(call.robot, table_name)
    linked = {f"{name}{end}" for name in whole for end in ("_id", "_guid")} & set(whole)
    blank = {name: call.robot.definition.blank(schema) for name, schema in whole.items()
             if name not in LINKS and name not in ("url", "guid", "id", "created_by_id", "widgets", "options", "positions", "paths", "path_guides", "actions",
                                                   "definition", "maps", "export", "docking_offsets", "help_positions") or name in linked - {"created_by_id"}}
    if table_name == "/missions":
        blank["valid"] = True
    return blank
