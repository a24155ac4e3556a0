"""Planned starts."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.clock import MOMENT
from app.domain.conflicts import ConflictCode
from app.domain.execution import DurationEstimate
from app.domain.models import Group, Mission, Robot, Schedule, Settings
from app.domain.rules import closes_at
from app.services.planning.recurrence import occurrences, to_utc
from app.services.planning.working_days import WorkingCalendar

ASSUMED_S = 300.0  # length of a run whose duration is not known

Lane = int | tuple[str, int]  # of a timeline: a robot's id, or ("group", its id)


@dataclass(frozen=True)
class PlannedRun:
    """One future start. For a group ``robot`` is the one of the forecast or, without one, a robot without an id, under
    the group's name."""

    at: datetime  # UTC
    schedule: Schedule
    robot: Robot
    mission: Mission
    usual: DurationEstimate | None = None  # how long it takes on this robot; None: not known yet
    group: Group | None = None
    begins_at: datetime | None = None  # of a group's: when the forecast has a robot for it; None: no robot
    lacks_mission: bool = False  # no robot of the group has the mission, as far as is known
    held: bool = False  # by a person: not sent when its time has come

    @property
    def is_approximate(self) -> bool:
        """Another robot may do it after all."""
        return self.group is not None and self.begins_at is not None

    @property
    def lane(self) -> Lane:
        """Where it is drawn."""
        return self.robot.id if self.group is None or self.begins_at is not None else ("group", self.group.id)

    @property
    def whose(self) -> str:
        """The name of the group or the robot that its schedule is for."""
        return self.robot.name if self.group is None else self.group.name

    @property
    def begins(self) -> datetime:
        """When a robot probably takes it."""
        return self.begins_at or self.at

    @property
    def ends(self) -> datetime:
        """When it is over as a rule."""
        return self.begins + timedelta(seconds=self.usual_s or ASSUMED_S)

    @property
    def usual_s(self) -> float | None:
        """The median of the last completed runs, or what was typed."""
        return self.usual.median_s if self.usual else None


def copy_at(like: PlannedRun, at: datetime, **changes: Any) -> PlannedRun:
    """The same start at another instant. ``dataclasses.replace`` takes ten times as long, and a plan has thousands."""
    made = object.__new__(PlannedRun)
    made.__dict__.update(like.__dict__, at=at, **changes)
    return made


def planned_run(
    at: datetime,
    schedule: Schedule,
    target: Robot | Group,
    mission: Mission,
    usual: DurationEstimate | None,
    lacks_mission: bool = False,
) -> PlannedRun:
    robot, group = (target, None) if isinstance(target, Robot) else (unassigned_robot(target), target)
    return PlannedRun(at, schedule, robot, mission, usual, group, lacks_mission=lacks_mission)


def unassigned_robot(group: Group) -> Robot:
    """Stands for any robot of a group, under the group's name."""
    return Robot(group.name, "")


@dataclass(frozen=True)
class Conflict:
    """``at``: the moment for which it is true. ``details``: the numbers of its sentence (``app.domain.conflicts``), and
    ids."""

    code: ConflictCode
    at: datetime
    details: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Planned:
    """Starts in order of time. ``more``: the time after which a schedule has more of them in that span than were
    computed, by its id. ``conflicts``: of groups, places and priorities, in order of time."""

    runs: tuple[PlannedRun, ...] = ()
    more: Mapping[int, datetime] = field(default_factory=dict)
    conflicts: tuple[Conflict, ...] = ()


def first_due(
    schedule: Schedule, settings: Settings, now: datetime, calendar: WorkingCalendar, skipped: Collection[datetime] = ()
) -> datetime | None:
    """The first instant from ``now`` on (UTC), ``now`` itself included, that was not planned before and that no person
    has ``skipped``; None if it is switched off or has no more. Earlier instants write no row, except that a one-time
    start still inside its start window is due at once.
    """
    if not schedule.enabled:
        return None
    through = schedule.planned_through
    if schedule.recurrence is None:
        start = to_utc(schedule.start, ZoneInfo(schedule.timezone))
        is_open = now < closes_at(start, schedule.start_window_minutes, settings)
        return start if is_open and start not in skipped and (through is None or start > through) else None
    after = now - MOMENT
    ahead = occurrences(schedule, after if through is None else max(after, through), calendar)
    return next((each.instant for each in ahead if each.instant not in skipped), None)
