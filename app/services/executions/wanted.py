"""Whether the plan still wants a start that no robot has: edits come while it waits, is being sent or in doubt, or
after it has ended."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from app.database.group_executions import GroupExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain import rules
from app.domain.execution import UNBOUND, Execution, Reason, ReasonCode, Trigger
from app.domain.models import Mission, Schedule, Settings
from app.services.executions.transitions import why_withdrawn
from app.services.planning.planned import first_due
from app.services.planning.working_days import WorkingCalendar, working_calendar

_MISSIONS, _SETTINGS, _STARTS = MissionRepository(), SettingsRepository(), GroupExecutionRepository()


def as_defined(
    c: sqlite3.Connection, row: Execution, schedule: Schedule, mission: Mission, settings: Settings
) -> dict[str, Any]:
    """The columns that have to change for it to run as its schedule is defined now. For a group: its assigned robot
    uses its own mission of that name, another mission allows all robots again, and a start that a person put before
    others stays there."""
    columns = rules.as_planned(schedule, mission, settings, row.planned_at)
    if row.group_id is not None:
        columns["priority"] = max(row.priority, schedule.priority)
        if row.robot_id is not None and (own := _MISSIONS.for_robot(c, mission.name, row.robot_id)):
            columns["mission_guid"] = own.guid
        if row.mission != mission.name:
            columns["tried"] = rules.may_try_again(row.tried)
    return {name: value for name, value in columns.items() if value != getattr(row, name)}


class Verdict(NamedTuple):
    """The columns that have to change for it to run as its plan has it now; None: it must not be sent, and why not."""

    columns: Mapping[str, Any] | None
    why: Reason | None = None


def wanted(c: sqlite3.Connection, row: Execution, *, reopen: bool = False) -> Verdict:
    """A Run now stays as the person started it. A group's start continues without a robot if its robot may no longer
    get it. ``reopen``: it has ended, or was withdrawn; check whether the plan would still have it."""
    if not reopen and (why := why_withdrawn(row) or _robot_is_off(c, row)):
        return Verdict(None, why)
    may_stay = reopen or None in (row.group_id, row.robot_id) or _STARTS.may_get(c, row)
    if row.trigger is Trigger.MANUAL:
        return Verdict({} if may_stay else UNBOUND)
    if row.trigger is Trigger.IDLE:
        is_idle = _is_idle_mission(c, row)
        return Verdict({}) if is_idle else Verdict(None, Reason(ReasonCode.SCHEDULE_CHANGED, {"idle": True}))
    schedule = None if row.schedule_id is None else ScheduleRepository().get(c, row.schedule_id)
    mission = None if schedule is None else _MISSIONS.get(c, schedule.mission_id)
    if schedule is None or mission is None or not _is_for(row, schedule):
        return Verdict(None, Reason(ReasonCode.SCHEDULE_CHANGED))
    settings = _SETTINGS.load(c)
    if reopen and schedule.paused_until is not None and schedule.is_paused(row.planned_at):
        return Verdict(None, Reason(ReasonCode.HOLD, {"paused_until": schedule.paused_until.isoformat()}))
    if reopen and not has_start(row, schedule, settings, working_calendar(c, settings)):
        return Verdict(None, Reason(ReasonCode.SCHEDULE_CHANGED))
    return Verdict(as_defined(c, row, schedule, mission, settings) | ({} if may_stay else UNBOUND))


def has_start(row: Execution, schedule: Schedule, settings: Settings, calendar: WorkingCalendar) -> bool:
    """Whether the schedule has a start at that instant, on that robot or group."""
    at = first_due(replace(schedule, planned_through=None), settings, row.planned_at, calendar)
    return _is_for(row, schedule) and at == row.planned_at


def _robot_is_off(c: sqlite3.Connection, row: Execution) -> Reason | None:
    robot = RobotRepository().get(c, row.robot_id or 0)
    is_off = row.group_id is None and (robot is None or not robot.enabled)
    return Reason(ReasonCode.ROBOT_REMOVED, {"robot": row.robot}) if is_off else None


def _is_for(row: Execution, schedule: Schedule) -> bool:
    return schedule.group_id == row.group_id and (row.group_id is not None or schedule.robot_id == row.robot_id)


def _is_idle_mission(c: sqlite3.Connection, row: Execution) -> bool:
    """Whether it is still its robot's idle mission."""
    robot = RobotRepository().get(c, row.robot_id or 0)
    rule = robot.idle if robot is not None else None
    mission = _MISSIONS.get(c, rule.mission_id) if rule is not None and rule.enabled else None
    return mission is not None and mission.guid == row.mission_guid
