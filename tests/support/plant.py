"""A plant in which one mission starts at 06:30 on every working day, without threads, on a Monday at 06:00."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from app.container import Container
from app.database.connection import Database
from app.database.execution_history import ExecutionHistory
from app.domain.execution import Execution
from app.domain.models import Group, Mission, Robot, Schedule
from tests.support.clock import VirtualClock
from tests.support.planner import insert_due

NOW = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)  # Monday


class Plant:
    """Two robots in a group; the mission is Aino's."""

    def __init__(self, directory: Path) -> None:
        self.clock = VirtualClock(NOW)
        db = Database.open(directory / "a.db", clock=self.clock, durable=False, threaded=False)
        self.container = container = Container(db, self.clock)
        self.moving, self.pausing, self.catalogue = container.moving, container.pausing, container.catalogue
        self.catalogue.change_settings(timezone="UTC")
        self.aino = self.catalogue.save_robot(Robot("Aino", "10.0.0.1", "user"), "secret").id
        self.sisu = self.catalogue.save_robot(Robot("Sisu", "10.0.0.2", "user"), "secret").id
        self.hall = self.catalogue.save_group(Group("Hall", (self.aino, self.sisu))).id
        self.deliver = self.catalogue.save_mission(Mission("Deliver", "guid-1")).id
        self.other = self.catalogue.save_mission(Mission("Other", "guid-2")).id
        self.daily = self.catalogue.save_schedule(self.schedule())

    def schedule(self, **values: Any) -> Schedule:
        start = datetime(2026, 11, 23, 6, 30)
        daily = {"name": "Daily", "start": start, "timezone": "UTC", "recurrence": "FREQ=DAILY"}
        return Schedule(robot_id=self.aino, mission_id=self.deliver, **{**daily, **values})

    def stored(self) -> Schedule:
        return self.catalogue.schedule(self.daily.id)

    def edit(self, **changes: Any) -> Schedule:
        return self.catalogue.save_schedule(replace(self.stored(), **changes))

    def rows(self) -> list[Execution]:
        return list(ExecutionHistory().stream(self.container.db.read()))

    def go_to(self, moment: datetime) -> None:
        self.clock.step((moment - self.clock.now()).total_seconds())
        insert_due(self.container)
