"""What every robot's worker shares with the others."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime

from app.database.activities import ActivityRepository
from app.database.connection import Database
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.domain.clock import Clock
from app.domain.models import Settings
from app.services.dispatch.ledger import Ledger
from app.services.live.alarms import Alarms
from app.services.live.gaps import Downtime
from app.services.live.holds import Holds
from app.services.live.snapshots import Snapshots
from app.services.live.tablet import Tablet
from app.services.planning.working_days import WorkingCalendar


@dataclass(frozen=True)
class Shared:
    """``plan_version`` grows with every change that may take a start back. ``trusted_since``: when the clock was last found right."""
    db: Database
    clock: Clock
    ledger: Ledger
    holds: Holds
    alarms: Alarms
    downtime: Downtime
    snapshots: Snapshots
    robots: RobotRepository
    missions: MissionRepository
    schedules: ScheduleRepository
    settings: Callable[[], Settings]
    calendar: Callable[[], WorkingCalendar]
    restored_at: datetime | None           # who goes back to a backup opens everything anew
    tablet: Tablet
    plan_version: Callable[[], int]
    trusted_since: Callable[[], datetime | None]
    activities: ActivityRepository = field(default_factory=ActivityRepository)

    @property
    def uncertain_through(self) -> datetime | None:
        """What was planned up to then may be on a robot although its row does not say so: a backup was restored, or the plan moved here.
        The clock by which that was noted may have been wrong, so all counts that was planned before it was found right."""
        move = self.tablet.move
        noted = [at for at in (self.restored_at, move.at if move else None) if at is not None]
        return max([*noted, self.trusted_since() or noted[0]]) if noted else None
