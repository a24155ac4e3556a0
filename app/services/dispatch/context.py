"""What every robot's worker shares with the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from app.database.activities import ActivityRepository
from app.database.connection import Database
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.domain.clock import Clock, ClockReading
from app.domain.models import Settings
from app.services.dispatch.ledger import Ledger
from app.services.dispatch.restored_starts import RestoredStarts
from app.services.live.alarms import Alarms
from app.services.live.downtime import Downtime
from app.services.live.holds import Clearing, Holds
from app.services.live.mission_parameters import MissionParameters
from app.services.live.snapshots import Snapshots
from app.services.live.tablet import Tablet
from app.services.planning.working_days import WorkingCalendar


@dataclass(frozen=True)
class Context:
    """``plan_version`` grows with every change that may withdraw a start. ``is_contradicted``: whether a single robot's
    clock puts the tablet's in doubt."""

    db: Database
    clock: Clock
    ledger: Ledger
    holds: Holds
    clearing: Clearing
    alarms: Alarms
    downtime: Downtime
    snapshots: Snapshots
    settings: Callable[[], Settings]
    calendar: Callable[[], WorkingCalendar]
    tablet: Tablet
    restored_starts: RestoredStarts
    plan_version: Callable[[], int]
    is_contradicted: Callable[[int, ClockReading], bool]
    parameters: MissionParameters
    robots: RobotRepository = field(default_factory=RobotRepository)
    missions: MissionRepository = field(default_factory=MissionRepository)
    schedules: ScheduleRepository = field(default_factory=ScheduleRepository)
    activities: ActivityRepository = field(default_factory=ActivityRepository)
