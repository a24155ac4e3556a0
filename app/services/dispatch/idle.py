"""Idle automation: when a robot has been idle long enough, seen without a break, its idle mission is started once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from zoneinfo import ZoneInfo

from app.domain import rules
from app.domain.models import IdleRule, Settings
from app.domain.robot import RobotState, RobotStatus
from app.services.planning.working_days import WorkingCalendar

KEEP_FREE_BEFORE_PLANNED = timedelta(minutes=5)


class IdleWatch:
    """How long one robot has been idle: Ready, nothing pending or executing, nothing new in its queue. Measured on the
    monotonic clock and only over observed time: after a gap between two polls longer than ``longest_gap`` seconds the
    time counts from zero."""

    def __init__(self) -> None:
        self._since: float | None = None
        self._seen = -math.inf
        self._highest: int | None = None  # queue id

    def saw(self, idle: bool, highest: int | None, mono: float, longest_gap: float) -> None:
        if not idle or mono - self._seen > longest_gap or highest != self._highest:
            self._since = None
        if idle and self._since is None:
            self._since = mono
        self._seen, self._highest = mono, highest

    def not_seen(self) -> None:
        """The robot could not be read, or the tablet slept: its activity is unknown."""
        self._since = None
        self._seen = -math.inf

    def seconds(self, mono: float) -> float:
        return 0.0 if self._since is None else mono - self._since


def is_idle(status: RobotStatus, has_queue_items: bool) -> bool:
    return status.state is RobotState.READY and not has_queue_items


@dataclass(frozen=True)
class IdleSituation:
    """Everything the decision needs to know, read at one moment."""

    idle_seconds: float
    status: RobotStatus
    highest_queue_id: int
    last_queue_id: int | None  # of its last idle mission, or the highest known when that was triggered
    next_planned_at: datetime | None  # of any schedule of this robot
    minimum_battery: float | None  # %, for its idle mission


def idle_mission_is_due(
    rule: IdleRule | None, situation: IdleSituation, settings: Settings, calendar: WorkingCalendar, now: datetime
) -> bool:
    """Whether the idle mission starts now. Once per idle period: a period ends when anything else runs, which shows as
    a queue id above that of the last idle mission, or below it if the robot's queue began again. So a restart of the
    app does not repeat it.
    """
    if rule is None or not rule.enabled or situation.idle_seconds < rule.after_minutes * 60:
        return False
    if situation.highest_queue_id == situation.last_queue_id:
        return False
    return (
        obstacle(
            situation.status.battery_percentage,
            situation.minimum_battery,
            situation.next_planned_at,
            settings,
            calendar,
            now,
        )
        is None
    )


class Obstacle(StrEnum):
    """What stops the idle mission of an idle robot from starting."""

    PLANNED = "planned"  # something planned begins soon
    DAY_OFF = "day_off"
    BATTERY = "battery"


def obstacle(
    battery: float | None,
    minimum: float | None,
    next_planned_at: datetime | None,
    settings: Settings,
    calendar: WorkingCalendar,
    now: datetime,
) -> Obstacle | None:
    """``battery`` and the ``minimum`` for its idle mission in %."""
    if next_planned_at is not None and next_planned_at - now < KEEP_FREE_BEFORE_PLANNED:
        return Obstacle.PLANNED
    if not calendar.is_working_day(now.astimezone(ZoneInfo(settings.timezone)).date()):
        return Obstacle.DAY_OFF
    return None if rules.battery_allows(battery, minimum) else Obstacle.BATTERY
