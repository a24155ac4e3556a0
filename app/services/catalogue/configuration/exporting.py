"""Writes the configuration, without secrets, in an order that stays the same: reading it in again changes nothing."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping, Sequence
from typing import Any

from app.database.calendar import CalendarRepository
from app.database.groups import GroupRepository, PlaceRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain import names
from app.domain.models import DayException, Group, HandOver, InvalidInput, Mission, Place, Robot, Schedule, Settings
from app.services.catalogue import validation
from app.services.catalogue.configuration.document import DISPLAY, FORMAT
from app.services.planning.working_days import WorkingCalendar


def export_configuration(c: sqlite3.Connection) -> str:
    """JSON with a line break at its end."""
    robots = {robot.id: robot for robot in RobotRepository().all(c)}
    missions = {mission.id: mission for mission in MissionRepository().all(c)}
    groups, places = {group.id: group for group in GroupRepository().all(c)}, PlaceRepository().all(c)
    settings, days = SettingsRepository().load(c), CalendarRepository().all(c)
    calendar = WorkingCalendar(settings, days)
    document: dict[str, Any] = {
        "format": FORMAT,
        "settings": _settings(settings),
        "display": {key: getattr(settings, key) for key in DISPLAY},
        "calendar": _calendar(settings, days),
        "robots": [_robot(robot, missions) for robot in robots.values()],
        **({"groups": [_group(group, robots) for group in groups.values()]} if groups else {}),
        **({"places": [{"name": place.name, "most": place.most} for place in places]} if places else {}),
        "missions": sorted(
            (_mission(mission, robots, places) for mission in missions.values()),
            key=lambda given: (given["name"], given.get("robot", "")),
        ),
        "schedules": [
            _schedule(schedule, _target(schedule, robots, groups), missions, calendar)
            for schedule in ScheduleRepository().all(c)
        ],
    }
    return json.dumps(document, ensure_ascii=False, indent=2) + "\n"


def _settings(settings: Settings) -> dict[str, Any]:
    return {
        "poll_interval_seconds": settings.poll_interval_seconds,
        "retry_limit": settings.retry_limit,
        "minimum_battery_percent": _percent(settings.minimum_battery_percent),
        "working_days": list(settings.working_days),
        "timezone": settings.timezone,
        "start_window_minutes": settings.start_window_minutes,
        "unknown_outcome_quiet_seconds": settings.unknown_outcome_quiet_seconds,
        "history_limit": settings.history_limit,
    }


def _calendar(settings: Settings, days: Sequence[DayException]) -> dict[str, Any]:
    """The days as they were entered, since of two for the same day the later one may hold."""
    return {
        "country": settings.holiday_country or None,
        "region": settings.holiday_subdivision or None,
        "days": [_day(exception) for exception in sorted(days, key=lambda exception: exception.id)],
    }


def _day(exception: DayException) -> dict[str, Any]:
    given = {
        "name": exception.name,
        "first_day": exception.first_day.isoformat(),
        "last_day": exception.last_day.isoformat(),
        "working": exception.is_working,
        "yearly": exception.yearly,
    }
    source = names.cleaned(exception.source)  # the name of a file, of any length
    return {**given, "source": source} if source else given


def _robot(robot: Robot, missions: Mapping[int, Mission]) -> dict[str, Any]:
    given: dict[str, Any] = {
        "name": robot.name,
        "address": robot.address,
        "username": robot.username,
        "enabled": robot.enabled,
    }
    if robot.certificate_sha256:
        given["certificate_sha256"] = robot.certificate_sha256
    idle = robot.idle
    given["idle"] = idle and {
        "mission": missions[idle.mission_id].name,
        "after_minutes": idle.after_minutes,
        "enabled": idle.enabled,
    }
    if robot.hand_over is not HandOver.AT_ONCE:
        given["hand_over"] = str(robot.hand_over)
    return given


def _group(group: Group, robots: Mapping[int, Robot]) -> dict[str, Any]:
    return {
        "name": group.name,
        "robots": sorted(robots[robot_id].name for robot_id in group.members),
        "hand_over": str(group.hand_over),
        "keep_free": group.keep_free,
    }


def _target(schedule: Schedule, robots: Mapping[int, Robot], groups: Mapping[int, Group]) -> dict[str, str]:
    if schedule.robot_id is not None:
        return {"robot": robots[schedule.robot_id].name}
    return {"group": groups[schedule.group_id or 0].name}


def _mission(mission: Mission, robots: Mapping[int, Robot], places: Sequence[Place]) -> dict[str, Any]:
    given: dict[str, Any] = {"name": mission.name, "guid": mission.guid}
    if mission.robot_id is not None:
        given["robot"] = robots[mission.robot_id].name
    if mission.usual_minutes is not None:
        given["usual_minutes"] = mission.usual_minutes
    if mission.favourite:
        given["favourite"] = True
    if mission.on_low_battery:
        given["on_low_battery"] = True
    if used := [place.name for place in places if mission.id in place.missions]:
        given["places"] = used
    return given


def _schedule(
    schedule: Schedule, target: Mapping[str, str], missions: Mapping[int, Mission], calendar: WorkingCalendar
) -> dict[str, Any]:
    between = schedule.between
    return {
        "name": schedule.name,
        **target,
        "mission": missions[schedule.mission_id].name,
        "start": schedule.start.isoformat(timespec="minutes"),
        "timezone": schedule.timezone,
        "recurrence": schedule.recurrence,
        "enabled": schedule.enabled,
        "minimum_battery_percent": _percent(schedule.minimum_battery_percent),
        "respect_working_days": schedule.respect_working_days and not _is_on_a_day_off(schedule, calendar),
        "between": between and {"from": f"{between.start:%H:%M}", "to": f"{between.end:%H:%M}"},
        "start_window_minutes": schedule.start_window_minutes,
        **({} if schedule.group_id is None else {"finish_by_minutes": schedule.finish_by_minutes}),
        "overlap": str(schedule.overlap),
        "priority": schedule.priority,
        "parameters": dict(schedule.parameters),
    }


def _is_on_a_day_off(schedule: Schedule, calendar: WorkingCalendar) -> bool:
    """A one-time schedule whose day was closed after it was entered: it starts all the same, but can't be entered so any more."""
    try:
        validation.one_time_on_working_day(schedule, calendar)
    except InvalidInput:
        return True
    return False


def _percent(value: float | None) -> float | int | None:
    return int(value) if value is not None and value.is_integer() else value
