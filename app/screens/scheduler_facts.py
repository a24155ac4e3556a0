"""What the Scheduler needs to know at one moment, read on a background thread; scheduler_view turns it into words and bars."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import TYPE_CHECKING
from zoneinfo import ZoneInfo

from app.models import Execution, Mission, Robot, Schedule, Settings
from app.services.plan import PlannedRun

if TYPE_CHECKING:
    from app.container import Container

HOURS = 24
DAYS = 7
BEFORE = timedelta(hours=1)              # of what is past stays in sight
LONGEST_RUN = timedelta(hours=12)        # runs that began before the window are looked for so far back
MOST_PAST = 2000                         # runs of the last hours


@dataclass(frozen=True)
class SchedulerFacts:
    settings: Settings = field(default_factory=Settings)
    robots: tuple[Robot, ...] = ()
    missions: tuple[Mission, ...] = ()
    schedules: tuple[Schedule, ...] = ()
    last: Mapping[int, Execution] = field(default_factory=dict)      # by schedule: its newest row
    planned: tuple[PlannedRun, ...] = ()                             # within the window, or the days when the list is asked for
    past: tuple[Execution, ...] = ()                                 # planned within the window and before now, open ones included
    usual_s: Mapping[tuple[int, str], float] = field(default_factory=dict)   # by robot and guid, of what is open

    @property
    def zone(self) -> ZoneInfo:
        return ZoneInfo(self.settings.timezone)

    def robot(self, robot_id: int | None) -> Robot | None:
        return next((robot for robot in self.robots if robot.id == robot_id), None)

    def mission(self, mission_id: int | None) -> Mission | None:
        return next((mission for mission in self.missions if mission.id == mission_id), None)

    def schedule(self, schedule_id: int | None) -> Schedule | None:
        return next((schedule for schedule in self.schedules if schedule.id == schedule_id), None)


def window_start(now: datetime, zone: ZoneInfo) -> datetime:
    """UTC instant of the left edge of the timeline: a full local hour, one to two hours ago."""
    local = (now - BEFORE).astimezone(zone)
    return now - BEFORE - timedelta(minutes=local.minute, seconds=local.second, microseconds=local.microsecond)


def read(container: Container, days: bool = False) -> SchedulerFacts:
    """Read everything; ``days``: the plan of a week instead of the window. Called off the UI thread: asks the database, never a robot."""
    from app.database.executions import ExecutionFilter

    repositories, c, now = container.repositories, container.db.read(), container.clock.now()
    settings = container.settings()
    start = window_start(now, ZoneInfo(settings.timezone))
    end = now + timedelta(days=DAYS) if days else start + timedelta(hours=HOURS)
    schedules = tuple(repositories.schedules.all(c))
    past = tuple(container.history.page(ExecutionFilter(start=start - LONGEST_RUN, end=now + timedelta(seconds=1)), size=MOST_PAST).rows)
    usual = {(e.robot_id, e.mission_guid): container.history.usual_duration(e.robot_id, e.mission_guid)
             for e in past if e.state.is_open and e.robot_id is not None}
    return SchedulerFacts(
        settings=settings, robots=tuple(repositories.robots.all(c)), missions=tuple(repositories.missions.all(c)), schedules=schedules,
        last={schedule.id: last for schedule in schedules if (last := container.history.last_of_schedule(schedule.id)) is not None},
        planned=tuple(container.plan.between(now, end)), past=past, usual_s={key: seconds for key, seconds in usual.items() if seconds})
