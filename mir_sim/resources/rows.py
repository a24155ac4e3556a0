"""How a stored row looks from outside: its own fields, links to other resources, and schema-true nothings for what isn't stored."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from mir_sim import definition, missions
from mir_sim.robot import SimulatedRobot
from mir_sim.site import MISSION_ACTIONS, Row

# A field that links to a row of another table. The row keeps the key under the field's name + "_id" or "_guid".
LINKS = {
    "cart_calibration": "/cart_calibrations", "cart_type": "/cart_types", "created_by": "/users", "dashboard": "/dashboards",
    "elevator_entry_pos": "/positions", "elevator_pos": "/positions", "entry_mission": "/missions", "exit_mission": "/missions",
    "goal_pos": "/positions", "map": "/maps", "mission": "/missions", "owner_group": "/user_groups", "parent": "/positions",
    "position": "/positions", "settings_group": "/setting_groups", "start_pos": "/positions", "type": "/position_types",
    "user_group": "/user_groups"}
ODD_KEYS = {"position": "pos_id"}
ODD_CHILDREN = {"help_positions": "helper_positions"}


def url_of(table: str, key: object, row: Row | None = None) -> str:
    """The link to a row; actions of missions have one of their own kind (recorded)."""
    return f"/v2.0.0/mission_actions/{key}" if table == MISSION_ACTIONS else f"/v2.0.0{table.format_map(row or {})}/{key}"


@lru_cache(maxsize=1024)
def item_template(software: str, table: str) -> str | None:
    """The path template of a single row of a table, or None when the definition has none."""
    return next((template for template in definition.load(software).templates()
                 if template.startswith(f"{table}/{{") and template.endswith("}") and template.count("/") == table.count("/") + 1), None)


@lru_cache(maxsize=1024)
def properties(software: str, table: str) -> Mapping[str, definition.Schema]:
    """The fields of a single row by the definition."""
    template = item_template(software, table)
    operation = definition.load(software).operation("get", template) if template else None
    return definition.load(software).properties(operation.schema if operation else None)


@lru_cache(maxsize=4096)
def _child(software: str, table: str, name: str) -> str | None:
    """The path segment of the part of a row that a field leads to, if it does: "positions" of a map."""
    segment = ODD_CHILDREN.get(name, name)
    templates = definition.load(software).templates()
    return segment if any(one.startswith(f"{table}/{{") and one.endswith(f"}}/{segment}") for one in templates) else None


def _link(row: Row, name: str) -> Any:
    keys = (ODD_KEYS.get(name, ""), f"{name}_id", f"{name}_guid")
    return next((row[key] for key in keys if key in row), None) if name in LINKS else None


def shown(robot: SimulatedRobot, table: str, row: Row, fields: Mapping[str, definition.Schema]) -> dict[str, Any]:
    """The row with the given fields."""
    key = row[robot.site.table(table).key]
    seen: dict[str, Any] = {}
    for name, schema in fields.items():
        if name in row:
            seen[name] = row[name]
        elif name == "url":
            seen[name] = url_of(table, key, row)
        elif (target := _link(row, name)) is not None:
            seen[name] = url_of(LINKS[name], target) if target != "" else ""
        elif (segment := _child(robot.software, table, name)) is not None:
            seen[name] = f"{url_of(table, key, row)}/{segment}"
        else:
            seen[name] = robot.definition.blank(schema)
    if table == "/missions" and "has_user_parameters" in fields:
        seen["has_user_parameters"] = bool(robot.site.user_parameters(row["guid"]))
    return seen


def full(robot: SimulatedRobot, table: str, row: Row) -> dict[str, Any]:
    """A single row as GET shows it: the definition's fields, and what was recorded besides."""
    seen = shown(robot, table, row, properties(robot.software, table))
    template = item_template(robot.software, table) or table
    built_in = row.get("guid") in missions.BUILT_IN
    seen["allowed_methods"] = ["GET"] if built_in else [
        verb.upper() for verb in ("put", "get", "delete") if robot.definition.operation(verb, template)]
    if "created_by" in seen:
        author = robot.site.table("/users").get(row.get("created_by_id"))
        seen["created_by_name"] = author["name"] if author else ""
    return seen


def blank(robot: SimulatedRobot, table: str) -> Row:
    """A new row with its stored fields at schema-true nothings. Links and parts are never stored."""
    fields = properties(robot.software, table)
    made = {name: robot.definition.blank(schema) for name, schema in fields.items()
            if name not in ("url", "created_by_id") and _child(robot.software, table, name) is None and not _is_link(name, fields)}
    if "valid" in made:
        made["valid"] = True
    return made


def _is_link(name: str, fields: Mapping[str, Any]) -> bool:
    return name in LINKS and any(key in fields for key in (ODD_KEYS.get(name, ""), f"{name}_id", f"{name}_guid"))


@dataclass(frozen=True)
class Entry:
    """A row in a list."""

    robot: SimulatedRobot
    table: str
    row: Row
    brief: Mapping[str, definition.Schema]

    def summary(self) -> dict[str, Any]:
        return shown(self.robot, self.table, self.row, self.brief)

    def full(self) -> dict[str, Any]:
        return shown(self.robot, self.table, self.row, properties(self.robot.software, self.table) or self.brief)

    def value(self, name: str) -> Any:
        return self.row[name] if name in self.row else (self.full() | self.summary())[name]
