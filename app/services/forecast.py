"""What a schedule in the making would bring: its next starts, and what a person should know before it is saved.

A concern forbids nothing. What can't be saved at all is raised as InvalidInput, by the same checks as when it is saved.
"""
from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from enum import StrEnum
from itertools import islice
from typing import Any
from zoneinfo import ZoneInfo

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.models import Mission, Schedule
from app.services import validation
from app.services.calendar import WorkingCalendar
from app.services.clock import Clock
from app.services.recurrence import Occurrence, next_occurrence, occurrences

ASSUMED_S = 300.0            # length of a run that was never seen to its end
STARTS = 5


class ConcernCode(StrEnum):
    """What may be wrong with a schedule that can be saved all the same."""
    OVERLAP = "overlap"                  # another planned run of that robot is still under way, or begins meanwhile
    DAY_OFF = "day_off"                  # the first day is not a working day, so the schedule begins later
    CLOCK_CHANGE = "clock_change"        # the wall-clock time does not exist on that day, or comes twice
    MISSION_MISSING = "mission_missing"  # the robot does not have it
    ROBOT_OFF = "robot_off"              # the robot is switched off in Settings
    NO_START = "no_start"                # nothing is left to come


@dataclass(frozen=True)
class Concern:
    """One warning; ``at`` is the start it is about, None: all of them. Times in ``details`` are UTC instants."""
    code: ConcernCode
    at: datetime | None = None
    details: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Forecast:
    starts: tuple[Occurrence, ...] = ()
    usual_s: float | None = None         # of that mission on that robot
    concerns: tuple[Concern, ...] = ()


class Forecasts:
    def __init__(self, db: Database, clock: Clock) -> None:
        self._db, self._clock = db, clock
        self._schedules, self._robots, self._missions = ScheduleRepository(), RobotRepository(), MissionRepository()
        self._executions, self._settings = ExecutionRepository(), SettingsRepository()

    def of(self, draft: Schedule, known_missions: Mapping[str, str] | None = None, count: int = STARTS) -> Forecast:
        """What ``draft`` would bring if it were saved now; an id means that it replaces that schedule.

        ``known_missions``: guid -> name as the robot told them; None or empty: it did not tell. Raises InvalidInput for a rule that
        can't be.
        """
        c = self._db.read()
        calendar = WorkingCalendar(self._settings.load(c))
        draft = validation.schedule(draft)
        validation.one_time_on_working_day(draft, calendar)
        mission, robot = self._missions.get(c, draft.mission_id), self._robots.get(c, draft.robot_id)
        starts = tuple(islice(occurrences(draft, self._clock.now(), calendar), count))
        usual = self._executions.usual_duration(c, draft.robot_id, mission.guid) if mission else None
        concerns: list[Concern] = []
        if robot is not None and not robot.enabled:
            concerns.append(Concern(ConcernCode.ROBOT_OFF, details={"robot": robot.name}))
        if mission is not None and robot is not None and _is_missing(mission, robot.id, known_missions):
            concerns.append(Concern(ConcernCode.MISSION_MISSING, details={"mission": mission.name, "robot": robot.name}))
        if not starts:
            concerns.append(Concern(ConcernCode.NO_START))
        elif draft.recurrence is not None and draft.respect_working_days and not calendar.is_working_day(draft.start.date()):
            concerns.append(Concern(ConcernCode.DAY_OFF, details={"day": draft.start.date()}))
        concerns += _clock_changes(starts, draft.timezone)
        concerns += self._overlaps(c, draft, starts, usual or ASSUMED_S, calendar)
        return Forecast(starts, usual, tuple(concerns))

    def _overlaps(self, c: sqlite3.Connection, draft: Schedule, starts: tuple[Occurrence, ...], lasts_s: float,
                  calendar: WorkingCalendar) -> Iterator[Concern]:
        """Earliest first, at most one for each start: with the run that is under way then, else with the first that begins meanwhile."""
        others = [other for other in self._schedules.for_robot(c, draft.robot_id)
                  if other.enabled and other.next_at is not None and other.id != draft.id]
        missions = {mission.id: mission for mission in self._missions.all(c)} if others else {}
        usual: dict[int, float] = {}
        for start in starts:
            met: list[tuple[datetime, datetime, Schedule]] = []
            for other in others:
                if other.mission_id not in usual:
                    found = missions.get(other.mission_id)
                    usual[other.mission_id] = (found and self._executions.usual_duration(c, draft.robot_id, found.guid)) or ASSUMED_S
                takes = timedelta(seconds=usual[other.mission_id])
                begins = _first_after(other, start.instant - takes, calendar)
                if begins is not None and begins < start.instant + timedelta(seconds=lasts_s):
                    met.append((begins, begins + takes, other))
            if met:
                begins, ends, other = min(met, key=lambda entry: entry[0])
                met_mission = missions.get(other.mission_id)
                yield Concern(ConcernCode.OVERLAP, start.instant, {
                    "schedule_id": other.id, "mission": met_mission.name if met_mission else other.name, "start": begins, "end": ends})


def _first_after(schedule: Schedule, after: datetime, calendar: WorkingCalendar) -> datetime | None:
    """The first instant after that one that is still to come."""
    if schedule.next_at is None:
        return None
    if after < schedule.next_at:
        return schedule.next_at
    return next_occurrence(schedule, after, calendar)


def _is_missing(mission: Mission, robot_id: int, known: Mapping[str, str] | None) -> bool:
    return mission.robot_id not in (None, robot_id) or (bool(known) and mission.guid not in (known or {}))


def _clock_changes(starts: tuple[Occurrence, ...], zone: str) -> Iterator[Concern]:
    """Starts whose wall-clock time is left out by a clock change (they come later) or comes twice (the first time counts)."""
    tz = ZoneInfo(zone)
    for start in starts:
        local = start.instant.astimezone(tz)
        twice = local.utcoffset() != local.replace(fold=1).utcoffset() and not start.moved
        if start.moved or twice:
            yield Concern(ConcernCode.CLOCK_CHANGE, start.instant, {"nominal": start.nominal, "twice": twice})
