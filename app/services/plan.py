"""What will happen: the occurrences of all schedules in a span of time, the next few, and what a schedule in the making would bring."""
from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import islice, takewhile

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.models import Mission, Robot, Schedule
from app.services.calendar import WorkingCalendar
from app.services.clock import Clock
from app.services.recurrence import Occurrence, occurrences

MOST_PER_SCHEDULE = 2000        # in one span: a rule every minute for a day is 1440


@dataclass(frozen=True)
class PlannedRun:
    """One occurrence to come."""
    at: datetime                # UTC
    schedule: Schedule
    robot: Robot
    mission: Mission
    usual_s: float | None       # median of the last completed runs on this robot; None: not known yet


class Plan:
    def __init__(self, db: Database, *, schedules: ScheduleRepository, robots: RobotRepository, missions: MissionRepository,
                 executions: ExecutionRepository, settings: SettingsRepository, clock: Clock) -> None:
        self._db, self._schedules, self._robots, self._missions = db, schedules, robots, missions
        self._executions, self._settings, self._clock = executions, settings, clock

    def between(self, start: datetime, end: datetime) -> list[PlannedRun]:
        """Every occurrence of an enabled schedule in [start, end), in order of time; nothing before now."""
        start = max(start, self._clock.now())
        return list(takewhile(lambda run: run.at < end, (run for run in self._all() if run.at >= start)))

    def next(self, count: int) -> list[PlannedRun]:
        return list(islice(self._all(), count))

    def preview(self, draft: Schedule, count: int = 5) -> Sequence[Occurrence]:
        """The next starts that a schedule would have if it were saved now. Raises InvalidInput for a rule that can't be."""
        calendar = WorkingCalendar(self._settings.load(self._db.read()))
        return list(islice(occurrences(draft, self._clock.now(), calendar), count))

    def _all(self) -> Iterator[PlannedRun]:
        c = self._db.read()
        calendar = WorkingCalendar(self._settings.load(c))
        robots = {robot.id: robot for robot in self._robots.all(c) if robot.enabled}
        missions = {mission.id: mission for mission in self._missions.all(c)}
        usual: dict[tuple[int, str], float | None] = {}
        streams = []
        for schedule in self._schedules.all(c):
            robot, mission = robots.get(schedule.robot_id), missions.get(schedule.mission_id)
            if schedule.enabled and schedule.next_at is not None and robot and mission:
                key = (robot.id, mission.guid)
                if key not in usual:
                    usual[key] = self._executions.usual_duration(c, *key)
                streams.append(_runs(schedule, robot, mission, usual[key], calendar))
        return heapq.merge(*streams, key=lambda run: (run.at, -run.schedule.priority, run.schedule.name))


def _runs(schedule: Schedule, robot: Robot, mission: Mission, usual_s: float | None, calendar: WorkingCalendar) -> Iterator[PlannedRun]:
    first = schedule.next_at
    if first is None:
        return
    paused_until = schedule.paused_until
    instants: Iterator[datetime] = (o.instant for o in islice(occurrences(schedule, first, calendar), MOST_PER_SCHEDULE))
    for at in _first_then(first, instants):
        if paused_until is None or at >= paused_until:
            yield PlannedRun(at, schedule, robot, mission, usual_s)


def _first_then(first: datetime, rest: Iterator[datetime]) -> Iterator[datetime]:
    yield first
    yield from rest
