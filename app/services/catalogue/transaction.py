"""What every change of the plan begins with: the rows that it is about, or InvalidInput where they are gone."""
from __future__ import annotations

import sqlite3
from dataclasses import dataclass, field
from datetime import datetime

from app.database.alarms import AlarmRepository
from app.database.calendar import CalendarRepository
from app.database.executions import ExecutionRepository
from app.database.holds import HoldRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain.models import InvalidInput, Mission, Robot, Schedule
from app.services.live.changes import Topic
from app.services.planning.working_days import WorkingCalendar, working_calendar


@dataclass
class Transaction:
    """One moment of the database, that the caller opened and commits: what there is, and what of it was changed."""
    c: sqlite3.Connection
    now: datetime
    topics: set[Topic] = field(default_factory=set)      # what changed, to be published after the commit
    notes: list[str] = field(default_factory=list)       # the same in lines for the log
    _calendar: WorkingCalendar | None = None             # as long as no day has changed

    def __post_init__(self) -> None:
        self.robots, self.missions, self.schedules = RobotRepository(), MissionRepository(), ScheduleRepository()
        self.executions, self._settings, self.holds = ExecutionRepository(), SettingsRepository(), HoldRepository()
        self.days, self._alarms = CalendarRepository(), AlarmRepository()
        self.settings = self._settings.load(self.c)

    @property
    def calendar(self) -> WorkingCalendar:
        """The working days, changes of this transaction included."""
        if self._calendar is None:
            self._calendar = working_calendar(self.c, self.settings)
        return self._calendar

    def the_robot(self, robot_id: int) -> Robot:
        if robot := self.robots.get(self.c, robot_id):
            return robot
        raise InvalidInput("robot", "there is no such robot any more")

    def the_mission(self, mission_id: int) -> Mission:
        if mission := self.missions.get(self.c, mission_id):
            return mission
        raise InvalidInput("mission", "there is no such mission any more")

    def the_schedule(self, schedule_id: int) -> Schedule:
        if schedule := self.schedules.get(self.c, schedule_id):
            return schedule
        raise InvalidInput("schedule", "there is no such schedule any more")

    def _mission_on(self, robot_id: int, mission_id: int) -> Mission:
        """The mission of that name on that robot."""
        mission = self.the_mission(mission_id)
        meant = self.missions.for_robot(self.c, mission.name, robot_id)
        if meant is None:
            raise InvalidInput("mission", "the mission {name} is for another robot only", name=mission.name)
        return meant
