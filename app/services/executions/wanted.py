"""What the plan wants by now of a start that no robot has: edits come while it waits, is on its way or in doubt, or after it has ended."""

from __future__ import annotations

import sqlite3
from dataclasses import replace
from typing import Any

from app.database.groups import target_of
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain import rules
from app.domain.models import Execution, Group, Mission, Reason, ReasonCode, Robot, Schedule, Settings, Trigger
from app.services.planning.planned import first_due
from app.services.planning.working_days import WorkingCalendar, working_calendar

_FOLLOWS = (
    "schedule",
    "mission",
    "mission_guid",
    "parameters",
    "priority",
    "minimum_battery_percent",
    "closes_at",
    "finish_by",
)
_MISSIONS = MissionRepository()


def as_defined(
    c: sqlite3.Connection,
    row: Execution,
    schedule: Schedule,
    target: Robot | Group,
    mission: Mission,
    settings: Settings,
    install_id: str,
) -> dict[str, Any]:
    """The columns that make it run as its schedule is defined now. Of a group: a robot that it was given to has its own mission of that
    name, for another mission all robots may be asked anew, and where a person has put it before others it stays there."""
    made = rules.scheduled(schedule, target, mission, settings, install_id, row.planned_at, row.created_at)
    columns = {name: getattr(made, name) for name in _FOLLOWS} | {"tried": row.tried}
    if isinstance(target, Group):
        columns["priority"] = max(row.priority, made.priority)
        if row.robot_id is not None and (own := _MISSIONS.for_robot(c, mission.name, row.robot_id)):
            columns["mission_guid"] = own.guid
        if row.mission != made.mission:
            columns["tried"] = rules.may_try_again(row.tried)
    return columns


def changed_since(c: sqlite3.Connection, row: Execution) -> dict[str, Any] | None:
    """The columns that have to change for it to run as it is defined now; None: nothing wants it any more. What a person started is as
    that person wanted it."""
    if row.trigger is Trigger.MANUAL:
        return {}
    if row.trigger is Trigger.IDLE:
        return {} if _is_idle_mission(c, row) else None
    schedule = _schedule_of(c, row)
    if schedule is None or not _is_for(row, schedule):
        return None
    target, mission = target_of(c, schedule), _MISSIONS.get(c, schedule.mission_id)
    if target is None or mission is None:  # foreign keys prevent that
        return None
    settings = SettingsRepository()
    columns = as_defined(c, row, schedule, target, mission, settings.load(c), settings.install_id(c))
    return {name: value for name, value in columns.items() if value != getattr(row, name)}


def is_planned(row: Execution, schedule: Schedule, settings: Settings, calendar: WorkingCalendar) -> bool:
    """Whether the schedule has a start at that instant, on that robot or group."""
    at = first_due(replace(schedule, planned_through=None), settings, row.planned_at, calendar)
    return _is_for(row, schedule) and at == row.planned_at


def why_unwanted(c: sqlite3.Connection, row: Execution) -> Reason | None:
    """Why a start that has ended, or was taken back, may not be opened again; None: the plan has it, as if nothing had been."""
    if changed_since(c, row) is None:
        return Reason(ReasonCode.SCHEDULE_CHANGED, {"idle": True} if row.trigger is Trigger.IDLE else {})
    if (schedule := _schedule_of(c, row)) is None:
        return None
    if schedule.paused_until is not None and schedule.is_paused(row.planned_at):
        return Reason(ReasonCode.HOLD, {"paused_until": schedule.paused_until.isoformat()})
    settings = SettingsRepository().load(c)
    return (
        None
        if is_planned(row, schedule, settings, working_calendar(c, settings))
        else Reason(ReasonCode.SCHEDULE_CHANGED)
    )


def _schedule_of(c: sqlite3.Connection, row: Execution) -> Schedule | None:
    return None if row.schedule_id is None else ScheduleRepository().get(c, row.schedule_id)


def _is_for(row: Execution, schedule: Schedule) -> bool:
    return schedule.group_id == row.group_id and (row.group_id is not None or schedule.robot_id == row.robot_id)


def _is_idle_mission(c: sqlite3.Connection, row: Execution) -> bool:
    """Whether it is still what its robot does when idle."""
    robot = RobotRepository().get(c, row.robot_id or 0)
    rule = robot.idle if robot is not None else None
    mission = _MISSIONS.get(c, rule.mission_id) if rule is not None and rule.enabled else None
    return mission is not None and mission.guid == row.mission_guid
