"""Skip next: the coming start of a schedule is left out, at once and with its row in the ledger (design: "Cancel")."""
from __future__ import annotations

import sqlite3
from datetime import datetime

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.models import Execution, InvalidInput, Reason, ReasonCode, Schedule, Trigger
from app.services import decisions
from app.services.calendar import WorkingCalendar
from app.services.changes import Changes, Topic
from app.services.clock import Clock
from app.services.recurrence import next_occurrence


class Skipping:
    def __init__(self, db: Database, clock: Clock, changes: Changes) -> None:
        self._db, self._clock, self._changes = db, clock, changes
        self._schedules, self._robots, self._missions = ScheduleRepository(), RobotRepository(), MissionRepository()
        self._executions, self._settings = ExecutionRepository(), SettingsRepository()

    def skip_next(self, schedule_id: int) -> datetime:
        """Returns the instant (UTC) that was left out. Raises InvalidInput when there is none to come."""
        skipped = self._db.write(lambda c: self._skip(c, schedule_id))
        self._changes.publish(Topic.SCHEDULES)
        self._changes.publish(Topic.EXECUTIONS)
        return skipped

    def _skip(self, c: sqlite3.Connection, schedule_id: int) -> datetime:
        schedule = self._schedules.get(c, schedule_id)
        if schedule is None:
            raise InvalidInput("schedule", "there is no such schedule any more")
        if not schedule.enabled or schedule.next_at is None:
            raise InvalidInput("schedule", "the schedule {name} has no start to skip", name=schedule.name)
        settings = self._settings.load(c)
        now = self._clock.now()
        self._executions.add_once(c, self._row(c, schedule, schedule.next_at, now))
        following = next_occurrence(schedule, max(now, schedule.next_at), WorkingCalendar(settings))
        self._schedules.advance(c, schedule.id, following)
        return schedule.next_at

    def _row(self, c: sqlite3.Connection, schedule: Schedule, at: datetime, now: datetime) -> Execution:
        settings = self._settings.load(c)
        robot, mission = self._robots.get(c, schedule.robot_id), self._missions.get(c, schedule.mission_id)
        if robot is None or mission is None:             # foreign keys see to it that they are there
            raise InvalidInput("schedule", "there is no such schedule any more")
        reason = Reason(ReasonCode.HOLD)
        return Execution(
            trigger=Trigger.SCHEDULED, schedule_id=schedule.id, schedule=schedule.name, robot_id=robot.id, robot=robot.name,
            mission=mission.name, mission_guid=mission.guid, parameters=schedule.parameters, priority=schedule.priority,
            minimum_battery_percent=decisions.minimum_battery(schedule, settings), timezone=schedule.timezone, planned_at=at,
            closes_at=decisions.closes_at(at, schedule.start_window_minutes, settings), created_at=now, ended_at=now,
            token=decisions.token_of(self._settings.install_id(c), schedule.id, at), state=reason.state, reason=reason)
