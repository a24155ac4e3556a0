"""What an edit of its schedule changes of a start that no robot has."""
from __future__ import annotations

import sqlite3
from typing import Any

from app.database.groups import GroupRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain import rules
from app.domain.models import Execution, Group, Mission, Robot, Schedule, Settings, Trigger

_FOLLOWS = ("schedule", "mission", "mission_guid", "parameters", "priority", "minimum_battery_percent", "closes_at", "finish_by")
_CHOSEN = ("mission_guid", "priority")            # of a start of a group: its robot's own mission, and what a person may have set since


def as_defined(row: Execution, schedule: Schedule, target: Robot | Group, mission: Mission, settings: Settings,
               install_id: str) -> dict[str, Any]:
    """The columns that make it run as its schedule is defined now; of a group its robots may be asked anew for another mission."""
    made = rules.scheduled(schedule, target, mission, settings, install_id, row.planned_at, row.created_at)
    tried = row.tried if row.mission == made.mission else rules.may_try_again(row.tried)
    return {**{name: getattr(made, name) for name in _FOLLOWS}, "tried": tried}


def changed_since(c: sqlite3.Connection, row: Execution) -> dict[str, Any]:
    """What was edited while it was on its way to a robot or in doubt, as edits leave such rows alone; empty: nothing."""
    schedule = ScheduleRepository().get(c, row.schedule_id) if row.trigger is Trigger.SCHEDULED and row.schedule_id is not None else None
    if schedule is None or schedule.group_id != row.group_id or (row.group_id is None and schedule.robot_id != row.robot_id):
        return {}                                 # it was taken back
    target = GroupRepository().get(c, row.group_id) if row.group_id is not None else RobotRepository().get(c, row.robot_id or 0)
    mission = MissionRepository().get(c, schedule.mission_id)
    if target is None or mission is None:
        return {}
    settings = SettingsRepository()
    columns = as_defined(row, schedule, target, mission, settings.load(c), settings.install_id(c))
    kept = _CHOSEN if row.group_id is not None else ()
    return {name: value for name, value in columns.items() if name not in kept and value != getattr(row, name)}
