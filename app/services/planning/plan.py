"""What will run: the occurrences of all schedules in a period, the next few, and those of a schedule that is not saved yet."""
from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import chain, islice, takewhile

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository, Skip
from app.database.settings import SettingsRepository
from app.domain.clock import Clock
from app.domain.models import DurationEstimate, Mission, Robot, Schedule
from app.services.planning.durations import expected
from app.services.planning.recurrence import Occurrence, occurrences
from app.services.planning.working_days import WorkingCalendar, working_calendar

MOMENT = timedelta(microseconds=1)
MOST_PER_SCHEDULE = 2000        # in one span, at least: a rule every minute for a day is 1440
MOST_OF_ALL = 100_000           # in one span, shared by all schedules, where that is more


@dataclass(frozen=True)
class PlannedRun:
    """One occurrence to come."""
    at: datetime                # UTC
    schedule: Schedule
    robot: Robot
    mission: Mission
    usual_s: float | None       # median of the last completed runs on this robot, or what was typed; None: not known yet
    slow_s: float | None = None # what nine of ten of them stayed under
    typed: bool = False         # no run has been measured yet


class Plan:
    def __init__(self, db: Database, *, schedules: ScheduleRepository, robots: RobotRepository, missions: MissionRepository,
                 executions: ExecutionRepository, settings: SettingsRepository, clock: Clock) -> None:
        self._db, self._schedules, self._robots, self._missions = db, schedules, robots, missions
        self._executions, self._settings, self._clock = executions, settings, clock

    def between(self, start: datetime, end: datetime) -> list[PlannedRun]:
        """Every occurrence of an enabled schedule in [start, end), in order of time; nothing before now."""
        start = max(start, self._clock.now())
        count = self._schedules.count(self._db.read())
        runs = self._all(max(MOST_PER_SCHEDULE, MOST_OF_ALL // max(1, count)), start, before=end)
        return list(takewhile(lambda run: run.at < end, (run for run in runs if run.at >= start)))

    def until(self, end: datetime) -> Iterator[PlannedRun]:
        """Every occurrence from now on and before ``end``, in order, however many."""
        now = self._clock.now()
        return takewhile(lambda run: run.at < end, (run for run in self._all(None, before=end) if run.at >= now))

    def next(self, count: int) -> list[PlannedRun]:
        return list(islice(self._all(), count))

    def skips(self) -> set[Skip]:
        """Starts to come that a person has left out."""
        return self._schedules.skips_from(self._db.read(), self._clock.now())

    def preview(self, draft: Schedule, count: int = 5) -> Sequence[Occurrence]:
        """The next starts that a schedule would have if it were saved now. Raises InvalidInput for an invalid rule."""
        c = self._db.read()
        calendar = working_calendar(c, self._settings.load(c))
        return list(islice(occurrences(draft, self._clock.now(), calendar), count))

    def _all(self, most_each: int | None = MOST_PER_SCHEDULE, start: datetime | None = None,
             before: datetime | None = None) -> Iterator[PlannedRun]:
        """In order of time, from ``start`` on; ``before`` leaves out the schedules that don't come until then."""
        c = self._db.read()
        schedules = self._schedules.all(c) if before is None else self._schedules.due(c, before)
        calendar = working_calendar(c, self._settings.load(c))
        robots = {robot.id: robot for robot in self._robots.all(c) if robot.enabled}
        missions = {mission.id: mission for mission in self._missions.all(c)}
        skips = self._schedules.skips_from(c, self._clock.now())
        learned: dict[tuple[int, str], DurationEstimate | None] = {}
        streams = []
        for schedule in schedules:
            robot, mission = robots.get(schedule.robot_id), missions.get(schedule.mission_id)
            if schedule.enabled and schedule.next_at is not None and robot and mission:
                key = (robot.id, mission.guid)
                if key not in learned:
                    learned[key] = self._executions.usual(c, *key)
                runs = _runs(schedule, robot, mission, expected(learned[key], mission), calendar, most_each, start)
                streams.append(run for run in runs if (run.schedule.id, run.at) not in skips)
        return heapq.merge(*streams, key=lambda run: (run.at, -run.schedule.priority, run.schedule.name))


def _runs(schedule: Schedule, robot: Robot, mission: Mission, usual: DurationEstimate | None, calendar: WorkingCalendar,
          most: int | None, start: datetime | None) -> Iterator[PlannedRun]:
    first = schedule.next_at
    if first is None:
        return
    wanted = max((schedule.paused_until if schedule.is_paused(first) else None) or first, start or first)
    after, begun = (first, [first]) if wanted == first else (wanted - MOMENT, [])
    for at in chain(begun, (o.instant for o in islice(occurrences(schedule, after, calendar), most))):
        yield PlannedRun(at, schedule, robot, mission, usual.median_s if usual else None, usual.slow_s if usual else None,
                         usual is not None and usual.typed)
