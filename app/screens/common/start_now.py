"""Whether a mission can be started now on a robot, or on any of a group: one rule for Home, the Scheduler and the Logs."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from typing import Protocol

from app.database.robots import Hold
from app.domain import rules
from app.domain.clock import Clock
from app.domain.models import Group, Robot, RobotSnapshot, Settings
from app.i18n import _
from app.screens.common.holding import hold_at, run_words
from app.screens.common.robot_appearance import STOPPED, is_old
from app.services.live.holds import Holds
from app.services.live.snapshots import Snapshots


class LiveServices(Protocol):
    """What is read of a screen's services; all of it is in memory."""

    @property
    def clock(self) -> Clock: ...
    @property
    def holds(self) -> Holds: ...
    @property
    def snapshots(self) -> Snapshots: ...


def is_stopped(snapshot: RobotSnapshot, settings: Settings, now: datetime) -> bool:
    """Whether the robot, as just read, does nothing until a person helps it."""
    return not is_old(snapshot, now, settings) and snapshot.status is not None and snapshot.status.state in STOPPED


def why_not(target: Robot | Group, robots: Iterable[Robot], hold: Hold | None, stopped: bool = False) -> str:
    """Empty if a start can be sent, or can wait until a robot answers, is free or is released. ``stopped``: the robot
    is."""
    if hold is not None and hold.is_copy:
        return _("Nothing is sent from this tablet")
    if isinstance(target, Robot):
        return _why_not_on(target, stopped)
    if not target.members:
        return _("{group} has no robot").format(group=target.name)
    if not any(robot.id in target.members and robot.enabled for robot in robots):
        return _("No robot of {group} is switched on").format(group=target.name)
    return ""


def _why_not_on(robot: Robot, stopped: bool) -> str:
    if not robot.enabled:
        words = _("{robot} needs its password") if robot.needs_password else _("{robot} is switched off")
        return words.format(robot=robot.name)
    return _("{robot} is stopped").format(robot=robot.name) if stopped else ""


def start_now(
    services: LiveServices, settings: Settings, robots: Iterable[Robot], target: Robot | Group
) -> tuple[str, str]:
    """Why nothing can be started on ``target`` now, and what a start does if it is not sent at once ("Queue, on hold");
    each may be empty."""
    now, holds = services.clock.now(), services.holds.all_active()
    hold, stopped, silent = hold_at(holds, None, now), False, None
    if isinstance(target, Robot):
        snapshot = services.snapshots.get(target.id)
        hold, stopped = hold_at(holds, target.id, now), is_stopped(snapshot, settings, now)
        silent = target if is_old(snapshot, now, settings) else None
    words = run_words(hold, silent, rules.closes_at(now, None, settings), settings.timezone, now)
    return why_not(target, robots, hold, stopped), words[0] if words is not None else ""
