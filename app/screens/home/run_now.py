"""Run now: which mission it would start, on any robot of a group or on the selected robot. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

from app.database.robots import Hold
from app.domain import rules
from app.domain.models import Execution, Group, HandOver, Robot
from app.i18n import _
from app.screens.common import formats
from app.screens.common.group_starts import lacking, lacking_words
from app.screens.common.holding import held_until, hold_at, run_words
from app.screens.common.options import Option
from app.screens.common.robot_appearance import is_old
from app.screens.common.start_now import is_stopped, why_not
from app.screens.home.facts import HomeFacts
from app.services.allocation.situation import CRITICAL, HIGH
from app.services.robots.commands import Operator

CHIPS = 4  # missions offered by one tap without favourites
FEW_GROUPS = 2  # each offered by one tap; more of them in a list
MANY_GROUPS = ("groups", 0)  # key of the way to that


@dataclass(frozen=True)
class RunView:
    """Run now. ``off`` if it can't be pressed; the button then says why."""

    note: str = ""
    mission_id: int | None = None
    mission: str = ""
    chips: tuple[Option, ...] = ()
    text: str = ""
    icon: str = "play"
    off: bool = True
    low_battery: str = ""  # asked before it runs
    targets: tuple[Option, ...] = ()  # groups, then the selected robot; empty without groups
    can_be_first: bool = False


def run_now(facts: HomeFacts, robot: Robot, chosen: int | None, now: datetime) -> RunView:
    missions = facts.missions
    mission = next((m for m in missions if m.id == chosen), missions[0] if len(missions) == 1 else None)
    shown = [m for m in missions if m.favourite] or missions[:CHIPS]
    chips = tuple(Option(m.id, m.name, "star" if m.favourite else "", selected=m is mission) for m in shown)
    hold, off = facts.hold(robot.id, now), False
    text, icon, note = _what_run_does(facts, robot, hold, now)
    if not missions:
        text, off = _no_mission(facts), True
    elif why := why_not(robot, (), hold, is_stopped(facts.snapshot, facts.settings, now)):
        text, off = why, True
    elif mission is None:
        text, off = _no_mission(facts), True
    return RunView(
        note=note,
        mission_id=mission.id if mission else None,
        mission=mission.name if mission else _("Choose a mission"),
        chips=chips,
        text=text,
        off=off,
        icon="play" if off else icon,
        low_battery=_low_battery(facts, robot, now),
    )


def _what_run_does(facts: HomeFacts, robot: Robot, hold: Hold | None, now: datetime) -> tuple[str, str, str]:
    """Text and icon of the button, and the note next to the heading: where it runs, or until when it waits at most."""
    zone, closes_at = facts.settings.timezone, rules.closes_at(now, None, facts.settings)
    at_most = _("waits until {time} at most").format(time=formats.day_and_time(closes_at, zone, now))
    words = run_words(hold, robot if is_old(facts.snapshot, now, facts.settings) else None, closes_at, zone, now)
    note = _held_note(hold, closes_at, zone, now) or _("on {robot}").format(robot=robot.name)
    if words is None:
        return _("Run on {robot}").format(robot=robot.name), "play", note
    return *words, at_most if hold is None else note


def _held_note(hold: Hold | None, closes_at: datetime, zone: str, now: datetime) -> str:
    """Next to the heading, if it may never be sent."""
    if hold is None or held_until(hold, closes_at) is not None:
        return ""
    return _("skipped at {time} unless released").format(time=formats.day_and_time(closes_at, zone, now))


def _low_battery(facts: HomeFacts, robot: Robot, now: datetime) -> str:
    minimum = facts.settings.minimum_battery_percent
    status = None if is_old(facts.snapshot, now, facts.settings) else facts.snapshot.status
    if not minimum:
        return ""
    if status is None or status.battery_percentage is None:
        return _("The battery of {robot} is not known; the minimum is {minimum} %.").format(
            robot=robot.name, minimum=formats.plain(minimum)
        )
    if status.battery_percentage >= minimum:
        return ""
    return _("The battery of {robot} is at {battery} %, under the minimum of {minimum} %.").format(
        robot=robot.name, battery=f"{status.battery_percentage:.0f}", minimum=formats.plain(minimum)
    )


# ---------------------------------------------------------------------- on a group
def start(
    operator: Operator, target: Target, robot_id: int, mission_id: int, parameters: Mapping[str, Any], token: str
) -> Execution:
    """``robot_id``: of the selected robot."""
    if target.group_id is None:
        return operator.run_now(robot_id, mission_id, parameters, token)
    return operator.run_on_any(target.group_id, mission_id, parameters, token, priority=target.priority)


@dataclass(frozen=True)
class Target:
    """``group_id`` None: the selected robot. ``first``: before everything else that waits, also on a robot that is kept."""

    group_id: int | None = None
    first: bool = False

    @property
    def priority(self) -> int:
        return CRITICAL if self.first else HIGH


def target_chips(facts: HomeFacts, target: Target) -> tuple[Option, ...]:
    """Groups first, then the selected robot; empty without groups. With many groups, the chosen one and a way to their
    list."""
    robot, group = facts.robot, chosen_group(facts, target)
    if robot is None or not facts.groups:
        return ()
    are_many = len(facts.groups) > FEW_GROUPS
    shown = [each for each in facts.groups if each is group or not are_many]
    more = [Option(MANY_GROUPS, _("Groups ({n})").format(n=len(facts.groups)), "select-group")] if are_many else []
    return (
        *(_any_of(each, each is group) for each in shown),
        *more,
        Option(("robot", robot.id), robot.name, "robot-outline", selected=group is None),
    )


def group_options(facts: HomeFacts) -> list[Option]:
    """All groups, each with its robots."""
    called = {robot.id: robot.name for robot in facts.robots}
    return [
        replace(_any_of(each), note=", ".join(called[member] for member in each.members if member in called))
        for each in facts.groups
    ]


def _any_of(group: Group, selected: bool = False) -> Option:
    return Option(("group", group.id), _("Any of {group}").format(group=group.name), "select-group", selected=selected)


def chosen_group(facts: HomeFacts, target: Target) -> Group | None:
    """The group, while there still is one."""
    return next((group for group in facts.groups if group.id == target.group_id), None)


def mission_options(facts: HomeFacts, target: Target) -> list[Option]:
    """Of a group with the robots that don't have it."""
    group = chosen_group(facts, target)
    members = [robot for robot in facts.robots if group is not None and robot.id in group.members]
    return [
        Option(
            each.id,
            each.name,
            "star" if each.favourite else "star-outline",
            lacking_words(lacking(each, members, facts.all_missions, facts.known)),
        )
        for each in facts.missions
    ]


def aimed(run: RunView, facts: HomeFacts, target: Target, now: datetime) -> RunView:
    """Run now of the selected robot, as it would be for this target."""
    group = chosen_group(facts, target)
    if group is not None:
        run = replace(on_group(run, facts, group, now), can_be_first=True)
    return replace(run, targets=target_chips(facts, target))


def _no_mission(facts: HomeFacts) -> str:
    """The button's words while no mission is chosen."""
    return _("Choose a mission") if facts.missions or facts.is_new else _("No missions yet")


def on_group(run: RunView, facts: HomeFacts, group: Group, now: datetime) -> RunView:
    """Run now of the selected robot, as it would be on any of the group."""
    members = [robot for robot in facts.robots if robot.id in group.members and robot.enabled]
    mission = next((mission for mission in facts.missions if mission.id == run.mission_id), None)
    hold = hold_at(facts.holds, None, now)
    zone, closes_at = facts.settings.timezone, rules.closes_at(now, None, facts.settings)
    text, icon, off = _("Run on any of {group}").format(group=group.name), "play", False
    if why := why_not(group, facts.robots, hold):
        text, off = why, True
    elif mission is None:
        text, off = _no_mission(facts), True
    elif mission.robot_id is not None and not any(
        other.name == mission.name and other.robot_id is None for other in facts.entered
    ):
        text, off = _("This mission is for one robot only"), True
    elif len(lacking(mission, members, facts.all_missions, facts.known)) == len(members):
        text, off = _("No robot of {group} has this mission").format(group=group.name), True
    note = _("waits until {time} at most").format(time=formats.day_and_time(closes_at, zone, now))
    if not off and (words := run_words(hold, None, closes_at, zone, now)) is not None:
        (text, icon), note = words, _held_note(hold, closes_at, zone, now)
    elif group.hand_over is HandOver.AT_ONCE and hold is None:
        note = _("at once, also to a busy robot")
    return replace(run, text=text, icon="play" if off else icon, off=off, low_battery="", note=note)
