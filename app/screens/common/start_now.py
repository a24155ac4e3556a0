"""Whether a mission can be started now on a robot, or on any of a group: one rule for Home, the Scheduler and the Logs."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime

from app.database.robots import Hold
from app.domain.models import Group, Robot, RobotSnapshot, Settings
from app.i18n import _
from app.screens.common.robot_appearance import STOPPED, is_old


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
