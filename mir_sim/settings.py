"""A few settings of the kind that robots have. All values are texts (recorded)."""

from __future__ import annotations

from typing import Any


def _group(number: int, name: str, settings: int) -> dict[str, Any]:
    return {
        "id": number,
        "name": name,
        "description": "",
        "priority": number,
        "settings_count": settings,
        "advanced_settings_count": 1 if number == 1 else 0,
    }


def _setting(number: int, group: int, name: str, value: str, kind: str, description: str) -> dict[str, Any]:
    return {
        "id": number,
        "name": name,
        "full_name": name,
        "description": description,
        "value": value,
        "default": value,
        "type": kind,
        "parent_name": "",
        "parent_id": "",
        "parent_value": "",
        "settings_group_id": group,
        "fieldtype": kind,
        "editable": "true",
        "children_ids": "",
    }


TABLES = {
    "/setting_groups": [_group(1, "Planner", 2), _group(2, "Battery", 2), _group(3, "Features", 1)],
    "/settings": [
        _setting(101, 1, "Maximum allowed speed", "1.2", "float", "Metres per second that the robot may drive"),
        _setting(102, 1, "Maximum planning time", "30", "integer", "Seconds for planning a path"),
        _setting(201, 2, "Warning level", "20", "integer", "Percent of battery at which the robot warns"),
        _setting(202, 2, "Error level", "5", "integer", "Percent of battery at which the robot stops"),
        _setting(301, 3, "MiR Fleet", "false", "boolean", "Whether the robot is visible to a fleet"),
    ],
    "/settings/advanced": [
        _setting(901, 1, "Obstacle timeout", "2.0", "float", "Seconds for which an obstacle is remembered")
    ],
}
