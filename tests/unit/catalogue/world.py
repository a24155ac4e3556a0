"""A catalogue over a database, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta

from app.database.connection import Database
from app.database.execution_history import ExecutionFilter, ExecutionHistory
from app.database.executions import ExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.domain.execution import Execution, ReasonCode, State, Trigger
from app.domain.models import Mission, Robot, Schedule
from app.services.catalogue.catalogue import Catalogue
from app.services.live.changes import Changes
from tests.support.clock import VirtualClock

ROBOTS, MISSIONS, SCHEDULES, EXECUTIONS = (
    RobotRepository(),
    MissionRepository(),
    ScheduleRepository(),
    ExecutionRepository(),
)


class World:
    """A catalogue over a database, on Monday 2026-11-23 06:00 UTC, and what it published."""

    def __init__(self, path) -> None:
        self.clock, self.changes, self.announced = VirtualClock(), Changes(), []
        self.changes.subscribe(lambda topic, about: self.announced.append(topic))
        self.db = Database.open(path / "data" / "a.db", clock=self.clock, threaded=False, durable=False)
        self.catalogue = Catalogue(self.db, self.clock, self.changes)
        self.robot = self.catalogue.save_robot(Robot("Aino", "10.0.0.1", "user"), password="secret")
        self.mission = self.catalogue.save_mission(Mission("Deliver", "guid-1"))
        self.announced.clear()

    def schedule(self, **values) -> Schedule:
        new = Schedule("Morning", self.robot.id, self.mission.id, datetime(2026, 11, 24, 6, 30), "UTC", "FREQ=DAILY")
        return self.catalogue.save_schedule(replace(new, **values))

    def stored(self, schedule: Schedule) -> Schedule | None:
        return SCHEDULES.get(self.db.read(), schedule.id)

    def row(self, schedule: Schedule, state: State = State.WAITING) -> Execution:
        now = self.clock.now()
        number = sum(ExecutionHistory().counts(self.db.read(), ExecutionFilter()).values()) + 1
        execution = Execution(
            Trigger.SCHEDULED,
            schedule.robot_id,
            "Aino",
            "Deliver",
            "guid-1",
            now + timedelta(minutes=number),
            now + timedelta(hours=1),
            now,
            f"token-{number}",
            "UTC",
            state=state,
            schedule_id=schedule.id,
        )
        return self.db.write(lambda c: EXECUTIONS.add_each_once(c, [execution])[0])

    def outcome(self, row: Execution) -> tuple[State, ReasonCode | None]:
        found = EXECUTIONS.get(self.db.read(), row.id)
        return found.state, found.reason.code if found.reason else None
