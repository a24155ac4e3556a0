"""How the API shows a stored row: its own fields, links to other resources, and empty values for fields that aren't stored."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from mir_sim import definition, missions
from mir_sim.rest_machine import RestMachine
from mir_sim.site import MISSION_ACTIONS, Row

# A field that links to a row of another table. The row holds the key in the field with the suffix "_id" or "_guid".
LINKS = {
    "cart_calibration": "/cart_calibrations",
    "cart_type": "/cart_types",
    "created_by": "/users",
    "dashboard": "/dashboards",
    "elevator_entry_pos": "/positions",
    "elevator_pos": "/positions",
    "entry_mission": "/missions",
    "exit_mission": "/missions",
    "goal_pos": "/positions",
    "map": "/maps",
    "mission": "/missions",
    "owner_group": "/user_groups",
    "parent": "/positions",
    "position": "/positions",
    "settings_group": "/setting_groups",
    "start_pos": "/positions",
    "type": "/position_types",
    "user_group": "/user_groups",
}
IRREGULAR_KEYS = {"position": "pos_id"}
IRREGULAR_CHILDREN = {"help_positions": "helper_positions"}


def url_of(table: str, key: object, row: Row | None = None) -> str:
    """The link to a row; those of mission actions have a form of their own (recorded)."""
    return (
        f"/v2.0.0/mission_actions/{key}" if table == MISSION_ACTIONS else f"/v2.0.0{table.format_map(row or {})}/{key}"
    )


@lru_cache(maxsize=1024)
def item_template(software: str, table: str) -> str | None:
    """The path template of one row of a table, or None when the definition has none."""
    return next(
        (
            template
            for template in definition.load(software).templates()
            if template.startswith(f"{table}/{{")
            and template.endswith("}")
            and template.count("/") == table.count("/") + 1
        ),
        None,
    )


@lru_cache(maxsize=1024)
def properties(software: str, table: str) -> Mapping[str, definition.Schema]:
    """The fields of one row by the definition."""
    template = item_template(software, table)
    operation = definition.load(software).operation("get", template) if template else None
    return definition.load(software).properties(operation.schema if operation else None)


@lru_cache(maxsize=4096)
def _child(software: str, table: str, name: str) -> str | None:
    """The path segment of the collection inside a row that a field links to, if it does: "positions" of a map."""
    segment = IRREGULAR_CHILDREN.get(name, name)
    templates = definition.load(software).templates()
    return (
        segment if any(one.startswith(f"{table}/{{") and one.endswith(f"}}/{segment}") for one in templates) else None
    )


def _link_key(name: str, fields: Container[str]) -> str:
    """The one of the fields that holds the key of the row that ``name`` links to; empty if ``name`` is not a link."""
    keys = (IRREGULAR_KEYS.get(name, ""), f"{name}_id", f"{name}_guid") if name in LINKS else ()
    return next((key for key in keys if key in fields), "")


def shown(machine: RestMachine, table: str, row: Row, fields: Mapping[str, definition.Schema]) -> dict[str, Any]:
    """The row, reduced or extended to the given fields."""
    key = row[machine.site.table(table).key]
    fields_shown: dict[str, Any] = {}
    for name, schema in fields.items():
        if name in row:
            fields_shown[name] = row[name]
        elif name == "url":
            fields_shown[name] = url_of(table, key, row)
        elif (target := row.get(_link_key(name, row))) is not None:
            fields_shown[name] = url_of(LINKS[name], target) if target != "" else ""
        elif (segment := _child(machine.software, table, name)) is not None:
            fields_shown[name] = f"{url_of(table, key, row)}/{segment}"
        else:
            fields_shown[name] = machine.definition.blank(schema)
    if table == "/missions" and "has_user_parameters" in fields:
        fields_shown["has_user_parameters"] = bool(machine.site.user_parameters(row["guid"]))
    # Of mission actions lists were recorded; of other rows nothing, so that they are as the definition has them.
    return fields_shown if table == MISSION_ACTIONS else definition.declared(fields, fields_shown)


def full(machine: RestMachine, table: str, row: Row) -> dict[str, Any]:
    """One row as GET shows it: the fields of the definition, and further recorded ones."""
    fields_shown = shown(machine, table, row, properties(machine.software, table))
    template = item_template(machine.software, table) or table
    built_in = row.get("guid") in missions.BUILT_IN
    fields_shown["allowed_methods"] = (
        ["GET"]
        if built_in
        else [verb.upper() for verb in ("put", "get", "delete") if machine.definition.operation(verb, template)]
    )
    if "created_by" in fields_shown:
        author = machine.site.table("/users").get(row.get("created_by_id"))
        fields_shown["created_by_name"] = author["name"] if author else ""
    return fields_shown


def blank(machine: RestMachine, table: str) -> Row:
    """A new row whose stored fields have empty values. Links and nested collections are not stored."""
    fields = properties(machine.software, table)
    made = {
        name: machine.definition.blank(schema)
        for name, schema in fields.items()
        if name not in ("url", "created_by_id")
        and _child(machine.software, table, name) is None
        and not _link_key(name, fields)
    }
    if "valid" in made:
        made["valid"] = True
    return made


@dataclass(frozen=True)
class Entry:
    """A row in a list."""

    machine: RestMachine
    table: str
    row: Row
    brief: Mapping[str, definition.Schema]

    def summary(self) -> dict[str, Any]:
        return shown(self.machine, self.table, self.row, self.brief)

    def full(self) -> dict[str, Any]:
        return shown(self.machine, self.table, self.row, properties(self.machine.software, self.table) or self.brief)

    def value(self, name: str) -> Any:
        return self.row[name] if name in self.row else (self.full() | self.summary())[name]
