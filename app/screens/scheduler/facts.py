"""What the Scheduler needs to know at one moment, read on a background thread; scheduler_view turns it into words and bars."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from functools import cached_property
from typing import TYPE_CHECKING
from zoneinfo import ZoneInfo

from app.domain.models import DayException, Execution, Mission, Robot, Schedule, Settings
from app.services.live.holds import Hold
from app.services.planning.plan import PlannedRun
from app.services.planning.working_days import WorkingCalendar

if TYPE_CHECKING:
    from app.container import Container

HOURS = 24                               # that the timeline shows at first
MARGIN = 0.5                             # of what it shows, read on either side of it, so that a finger finds something there
DAYS = 7
BEFORE = timedelta(hours=1)              # of what is past stays in sight
LONGEST_RUN = timedelta(hours=12)        # runs that began before the window are looked for so far back
MOST_PAST = 5000                         # runs of the past in one window


@dataclass(frozen=True)
class Window:
    """What the timeline shows. ``left`` None: it goes with the time, beginning a little before now."""
    left: datetime | None = None
    hours: float = HOURS

    def start(self, now: datetime, zone: ZoneInfo) -> datetime:
        """UTC instant of the left edge."""
        return window_start(now, zone) if self.left is None else self.left

    def span(self, now: datetime, zone: ZoneInfo) -> tuple[datetime, datetime]:
        """What is to be read, from and to."""
        start, margin = self.start(now, zone), timedelta(hours=self.hours * MARGIN)
        return start - margin, start + timedelta(hours=self.hours) + margin


@dataclass(frozen=True)
class SchedulerFacts:
    settings: Settings = field(default_factory=Settings)
    exceptions: tuple[DayException, ...] = ()                        # to the working days
    robots: tuple[Robot, ...] = ()
    missions: tuple[Mission, ...] = ()
    schedules: tuple[Schedule, ...] = ()
    last: Mapping[int, Execution] = field(default_factory=dict)      # by schedule: its newest row
    planned: tuple[PlannedRun, ...] = ()                             # within the window, or the days when the list is asked for
    past: tuple[Execution, ...] = ()                                 # planned within the window and before now, open ones included
    holds: tuple[Hold, ...] = ()                                     # that persons have set and that are not over
    usual_s: Mapping[tuple[int, str], float] = field(default_factory=dict)   # by robot and guid, of what is open
    typed: frozenset[tuple[int, str]] = frozenset()                  # of these, what no run has shown yet

    @property
    def zone(self) -> ZoneInfo:
        return ZoneInfo(self.settings.timezone)

    @cached_property
    def calendar(self) -> WorkingCalendar:
        return WorkingCalendar(self.settings, self.exceptions)

    def hold(self, robot_id: int | None, at: datetime) -> Hold | None:
        """What keeps a start on that robot from being sent at that instant."""
        return next((hold for hold in self.holds if hold.covers(robot_id, at)), None)

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


def read(container: Container, window: Window | None = None) -> SchedulerFacts:
    """Read everything; without a window the plan of a week. Called off the UI thread: asks the database, never a robot."""
    from app.database.executions import ExecutionFilter

    repositories, c, now = container.repositories, container.db.read(), container.clock.now()
    settings = container.settings()
    start, end = (now, now + timedelta(days=DAYS)) if window is None else window.span(now, ZoneInfo(settings.timezone))
    schedules = tuple(repositories.schedules.all(c))
    of_the_past = ExecutionFilter(start=start - LONGEST_RUN, end=min(end, now + timedelta(seconds=1)))
    past = tuple(container.history.page(of_the_past, size=MOST_PAST).rows)
    open_ones = {(e.robot_id, e.mission_guid) for e in past if e.state.is_open and e.robot_id is not None}
    usual = {key: found for key in open_ones if (found := container.history.expected(*key)) is not None}
    facts = SchedulerFacts(
        settings=settings, exceptions=tuple(repositories.calendar.all(c)), robots=tuple(repositories.robots.all(c)),
        missions=tuple(repositories.missions.all(c)), schedules=schedules,
        last={schedule.id: last for schedule in schedules if (last := container.history.last_of_schedule(schedule.id)) is not None},
        planned=tuple(container.plan.between(now, end)), past=past,
        holds=tuple(container.holds.standing()), usual_s={key: one.median_s for key, one in usual.items() if one.median_s},
        typed=frozenset(key for key, one in usual.items() if one.typed))
    for year in (now.year, now.year + 1):                            # public holidays are read here, not while something is drawn
        facts.calendar.day_status(now.date().replace(year=year, day=1))
    return facts
