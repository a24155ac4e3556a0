"""Writes the configuration, without secrets, in a fixed order: importing it again changes nothing."""

from __future__ import annotations

import json
import sqlite3
from dataclasses import replace
from typing import Any

from app.database.fleets import FleetRepository
from app.database.groups import GroupRepository, PlaceRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import CalendarRepository, SettingsRepository
from app.domain import names
from app.domain.models import DayException, IdleRule, InvalidInput, Mission, Robot, Schedule
from app.services.catalogue import fields, validation
from app.services.catalogue.configuration.document import FORMAT
from app.services.catalogue.fields import written
from app.services.planning.working_days import WorkingCalendar


def export_configuration(c: sqlite3.Connection) -> str:
    """JSON with a line break at its end."""
    return json.dumps(_Export(c).document(), ensure_ascii=False, indent=2) + "\n"


class _Export:
    def __init__(self, c: sqlite3.Connection) -> None:
        self._robots, self._groups, self._missions = (
            RobotRepository().all(c),
            GroupRepository().all(c),
            MissionRepository().all(c),
        )
        self._fleets = FleetRepository().all(c)
        self._places = PlaceRepository().all(c)
        self._schedules = [each for each in ScheduleRepository().all(c) if each.moved_of is None]
        self._settings, self._days = SettingsRepository().load(c), CalendarRepository().all(c)
        self._calendar = WorkingCalendar(self._settings, self._days)
        self._robot_names = {robot.id: robot.name for robot in self._robots}
        self._group_names = {group.id: group.name for group in self._groups}
        self._mission_names = {mission.id: mission.name for mission in self._missions}

    def document(self) -> dict[str, Any]:
        found = {
            "format": FORMAT,
            "settings": written(self._settings, fields.SETTINGS),
            "display": written(self._settings, fields.DISPLAY),
            "calendar": written(
                self._settings,
                fields.CALENDAR,
                country=self._settings.holiday_country or None,
                region=self._settings.holiday_subdivision or None,
                # in the order of entry, as the later of two for the same day counts
                days=[_day(each) for each in sorted(self._days, key=lambda each: each.id)],
            ),
            "fleets": [written(fleet, fields.FLEET) for fleet in self._fleets],
            "robots": [self._robot(robot) for robot in self._robots],
            "groups": [
                written(group, fields.GROUP, robots=sorted(self._robot_names[id_] for id_ in group.members))
                for group in self._groups
            ],
            "places": [written(place, fields.PLACE) for place in self._places],
            "missions": sorted(
                map(self._mission, self._missions), key=lambda each: (each["name"], each.get("robot", ""))
            ),
            "schedules": [self._schedule(schedule) for schedule in self._schedules],
        }
        return {
            section: each for section, each in found.items() if each or section not in ("fleets", "groups", "places")
        }

    def _robot(self, robot: Robot) -> dict[str, Any]:
        """Of one of a fleet only what is its own."""
        idle, fleet = self._idle(robot.idle), robot.fleet and robot.fleet.name
        found = written(robot, fields.ROBOT, idle=idle, enabled=robot.is_on_by_itself, fleet=fleet)
        return {key: value for key, value in found.items() if fleet is None or key not in fields.OF_FLEET}

    def _idle(self, rule: IdleRule | None) -> dict[str, Any] | None:
        return None if rule is None else written(rule, fields.IDLE, mission=self._mission_names[rule.mission_id])

    def _mission(self, mission: Mission) -> dict[str, Any]:
        return written(
            mission,
            fields.MISSION,
            robot=self._robot_names.get(mission.robot_id or 0),
            places=[place.name for place in self._places if mission.id in place.missions],
        )

    def _schedule(self, schedule: Schedule) -> dict[str, Any]:
        respects = schedule.respect_working_days and not _is_on_a_day_off(schedule, self._calendar)
        found = written(
            replace(schedule, respect_working_days=respects),
            fields.SCHEDULE,
            name=schedule.name,
            robot=self._robot_names.get(schedule.robot_id or 0),
            group=self._group_names.get(schedule.group_id or 0),
            mission=self._mission_names[schedule.mission_id],
        )
        if schedule.group_id is None:
            del found["finish_by_minutes"]
        return found


def _day(exception: DayException) -> dict[str, Any]:
    return written(
        replace(exception, source=names.cleaned(exception.source)), fields.DAY
    )  # a file's name has any length


def _is_on_a_day_off(schedule: Schedule, calendar: WorkingCalendar) -> bool:
    """A one-time schedule whose day was closed later: it still starts, but could not be entered now."""
    try:
        validation.one_time_on_working_day(schedule, calendar)
    except InvalidInput:
        return True
    return False
