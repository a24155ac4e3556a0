"""Sorts robots into a few groups, from most to least in need of a person, so that many are read at a glance. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import datetime
from enum import Enum

from app.database.robots import Hold
from app.domain.activity import activity_of
from app.domain.models import Connection, Robot, RobotSnapshot, Settings
from app.domain.robot import RobotState, RobotStatus
from app.i18n import _, ngettext
from app.screens.common.holding import HAND, hold_at
from app.screens.common.robot_appearance import LOW, STOPPED, Appearance, is_old, is_silent


class Group(Enum):
    """Every robot is in exactly one. In the order of urgency."""

    STOPPED = "stopped"  # emergency stop or error
    ASKS = "asks"
    SILENT = "silent"  # no answer, or none that can be trusted
    LOOK = "look"  # something that a person should look at, though the robot may continue
    PAUSED = "paused"
    HELD = "held"  # ready, and nothing is sent to it
    WORKING = "working"
    READY = "ready"
    CHARGING = "charging"
    STARTING = "starting"  # or shutting down, or not asked yet
    OFF = "off"


FEW = 3  # robots, up to which Home shows one of them and the others as chips
URGENCY = {group: number for number, group in enumerate(Group)}
NEEDS_HELP = frozenset((Group.STOPPED, Group.ASKS, Group.SILENT, Group.LOOK, Group.PAUSED))
FREE = (Group.READY, Group.CHARGING)
CALM = (Group.WORKING, Group.READY, Group.CHARGING, Group.HELD, Group.STARTING, Group.OFF)  # as they are counted


def help_rank(group: Group) -> int:
    """To sort by: what needs help first, most urgent first; all others are alike."""
    return URGENCY[group] if group in NEEDS_HELP else len(Group)


def group_of(robot: Robot, snapshot: RobotSnapshot, old: bool, settings: Settings) -> Group:
    """``old``: its known state is out of date."""
    if robot.needs_password:
        return Group.LOOK
    if not robot.enabled or snapshot.connection is Connection.DISABLED:
        return Group.OFF
    if snapshot.connection is Connection.UNKNOWN:
        return Group.STARTING
    if old or snapshot.status is None or is_silent(snapshot.connection):
        return Group.SILENT
    return _group_of(snapshot.status, settings)


def _group_of(status: RobotStatus, settings: Settings) -> Group:
    if status.state in STOPPED:
        return Group.STOPPED
    if status.user_prompt is not None:
        return Group.ASKS
    if status.errors or status.state in (RobotState.UNKNOWN, RobotState.MANUAL_CONTROL):
        return Group.LOOK
    if status.state is RobotState.PAUSE:
        return Group.PAUSED
    match activity_of(status):
        case "charging":
            return Group.CHARGING
        case "executing":
            return Group.WORKING
    if status.state in (RobotState.STARTING, RobotState.SHUTTING_DOWN):
        return Group.STARTING
    return Group.LOOK if is_low(status, settings) else Group.READY


def or_held(group: Group, holds: Iterable[Hold], robot: Robot, now: datetime) -> Group:
    """A ready robot gets nothing while it is held."""
    return Group.HELD if group is Group.READY and hold_at(holds, robot.id, now) is not None else group


def is_low(status: RobotStatus, settings: Settings) -> bool:
    """Whether the battery is under the minimum, so that missions wait, or nearly empty."""
    percent = status.battery_percentage
    return percent is not None and percent < (settings.minimum_battery_percent or LOW)


def look_of(group: Group) -> Appearance:
    """How robots of the group are shown together: its word is short enough for the smallest tile."""
    return {
        Group.STOPPED: Appearance(_("Stopped"), "alert-octagon", "fault", loud=True),
        Group.ASKS: Appearance(_("Asks"), "comment-question", "action"),
        Group.SILENT: Appearance(_("No answer"), "wifi-off", "attention"),
        Group.LOOK: Appearance(_("Look at it"), "eye-outline", "attention"),
        Group.PAUSED: Appearance(_("Paused"), "pause-circle-outline", "action"),
        Group.HELD: Appearance(_("On hold"), HAND),
        Group.WORKING: Appearance(_("Working"), "play-circle-outline"),
        Group.READY: Appearance(_("Ready"), "check-circle-outline"),
        Group.CHARGING: Appearance(_("Charging"), "lightning-bolt"),
        Group.STARTING: Appearance(_("Starting up"), "timer-sand"),
        Group.OFF: Appearance(_("Off"), "power-plug-off-outline"),
    }[group]


def count_words(group: Group, n: int) -> str:
    """ "22 working", of a normal group."""
    return {
        Group.HELD: _("{n} on hold"),
        Group.WORKING: ngettext("{n} working", "{n} working", n),
        Group.READY: ngettext("{n} ready", "{n} ready", n),
        Group.CHARGING: ngettext("{n} charging", "{n} charging", n),
        Group.STARTING: _("{n} starting up"),
        Group.OFF: ngettext("{n} off", "{n} off", n),
    }[group].format(n=n)


def robots_in_words(robots: Iterable[Robot]) -> str:
    """How many: what stands for any robot of a fleet is none."""
    n = sum(not robot.is_any for robot in robots)
    return ngettext("{n} robot", "{n} robots", n).format(n=n)


def free_words(
    either: Robot,
    robots: Iterable[Robot],
    snapshot_of: Callable[[int], RobotSnapshot | None],
    settings: Settings,
    now: datetime,
) -> str:
    """Of any robot of a fleet: how many of those in the plan are free; empty if none is in it, or it is one robot."""
    its_own = [robot for robot in robots if either.is_any and not robot.is_any and robot.fleet_id == either.fleet_id]
    seen = [(robot, snapshot_of(robot.id) or RobotSnapshot(robot.id)) for robot in its_own]
    free = sum(group_of(robot, each, is_old(each, now, settings), settings) in FREE for robot, each in seen)
    return _("{free} of {n} free").format(free=free, n=len(seen)) if seen else ""
