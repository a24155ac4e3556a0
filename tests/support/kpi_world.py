"""A database for figures: rows are put in, figures asked for. Two robots, Helsinki, noon of Monday 23 Nov 2026."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

from app.database.activities import ActivityRepository
from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.robots import RobotRepository
from app.database.settings import SettingsRepository
from app.domain.activity import ActivitySpan
from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger
from app.domain.models import Robot
from app.services.history.kpis import Kpis
from tests.support.clock import VirtualClock

NOON = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)  # a Monday
HELSINKI = ZoneInfo("Europe/Helsinki")
REASONS = {
    State.FAILED: ReasonCode.ROBOT_ABORTED,
    State.CANCELLED: ReasonCode.USER_CANCELLED,
    State.SKIPPED: ReasonCode.BATTERY_LOW,
    State.MISSED: ReasonCode.APP_DOWN,
}


class World:
    def __init__(self, path: Path) -> None:
        self.clock = VirtualClock(NOON)
        self.db = Database.open(path / "data" / "a.db", clock=self.clock, threaded=False, durable=False)
        self.db.write(lambda c: SettingsRepository().save(c, timezone="Europe/Helsinki"))
        for number, name in ((1, "Bella"), (2, "Aino")):
            self.db.write(
                lambda c, number=number, name=name: RobotRepository().add(c, Robot(name, "http://x", id=number))
            )
        self.kpis, self._made = Kpis(self.db, self.clock), 0

    def row(self, state: State, hours: float = 0.0, **values: object) -> Execution:
        """One that was planned ``hours`` after noon and ended then, unless it says otherwise."""
        self._made += 1
        at = NOON + timedelta(hours=hours)
        row = Execution(
            Trigger.SCHEDULED,
            1,
            "Bella",
            "Deliver",
            "g",
            at,
            at,
            at,
            f"token-{self._made}",
            "UTC",
            state=state,
            schedule_id=self._made,
            schedule="S",
            ended_at=None if state.is_open else at,
            reason=Reason(REASONS[state]) if state in REASONS else None,
        )
        return self.add(replace(row, **values))

    def add(self, row: Execution) -> Execution:
        return self.db.write(lambda c: ExecutionRepository().add_each_once(c, [row])[0])

    def observe(self, robot_id: int, day: str, **seconds: float) -> None:
        """From midnight, one after the other."""
        at, spans = datetime.fromisoformat(day).replace(tzinfo=HELSINKI), []
        for activity, length in seconds.items():
            spans.append(ActivitySpan(activity, at, at := at + timedelta(seconds=length)))
        self.watch(robot_id, *spans)

    def watch(self, robot_id: int, *spans: ActivitySpan) -> None:
        self.db.write(lambda c: ActivityRepository().save(c, robot_id, spans))

    def afterwards(self) -> None:
        """Days later: all that was put in has ended."""
        self.clock.advance(3 * 86400)

    def empty(self) -> None:
        self.db.write(lambda c: c.execute("DELETE FROM executions"))
