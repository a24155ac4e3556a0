"""All robots in one look: a tile per robot, and how many there are of each kind. Pure."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from app.domain.message import render
from app.domain.models import Connection, Robot, RobotSnapshot, Settings
from app.domain.robot import RobotState, problems_in_words
from app.i18n import _
from app.screens.common import formats
from app.screens.common.holding import HAND
from app.screens.common.robot_appearance import LOW, battery_appearance, link_appearance, state_appearance
from app.screens.common.robot_groups import NEEDS_HELP, URGENCY, Group, count_words, look_of

LARGE_UP_TO = 20  # robots whose tiles are large
ROOMY_UP_TO = 24  # whose small tiles are wider, in so few lines that a wide page has room for all
LONGER_THAN_USUAL = 1.5  # times the usual duration, above which it is marked

AT_REST = (RobotState.READY, RobotState.ABORTED, RobotState.COMPLETED)


@dataclass(frozen=True)
class Work:
    """A robot's mission. ``minutes_left`` None: unknown; ``is_late``: it takes much longer than usual."""

    mission: str = ""
    minutes_left: int | None = None
    is_late: bool = False


@dataclass(frozen=True)
class RobotTile:
    """``key``: id of the robot. ``word``: of its group; ``detail``: the mission, or why a person is needed."""

    key: int
    name: str
    word: str = ""
    icon: str = ""
    tone: str = "neutral"  # neutral is normal
    loud: bool = False
    detail: str = ""
    late: bool = False
    battery: str = "–"
    battery_icon: str = "battery-unknown"
    battery_tone: str = "neutral"


@dataclass(frozen=True)
class Count:
    """How many robots are in a group; ``key`` is the group."""

    key: Group
    text: str
    icon: str
    tone: str = "neutral"
    loud: bool = False
    selected: bool = False


@dataclass(frozen=True)
class Look:
    """Which robots are shown, and in which order."""

    only: Group | None = None
    needy_first: bool = False


def work(mission: str, elapsed_s: float | None, usual_s: float | None) -> Work:
    """``elapsed_s`` since it began, ``usual_s`` how long it takes; None: not known."""
    if elapsed_s is None or not usual_s:
        return Work(mission)
    return Work(mission, max(0, math.ceil((usual_s - elapsed_s) / 60)), elapsed_s > LONGER_THAN_USUAL * usual_s)


def robot_tile(
    robot: Robot,
    snapshot: RobotSnapshot,
    doing: Work | None,
    group: Group,
    old: bool,
    settings: Settings,
    now: datetime,
) -> RobotTile:
    """``old``: what is known of it is out of date; ``doing`` its mission, if any."""
    state, kind = state_appearance(robot, snapshot, old), look_of(group)
    battery = battery_appearance(
        None if old else snapshot.status, settings
    )  # an old level would look like a present one
    detail = " ".join(_detail(robot, snapshot, doing, group, state.word, settings, now).split())
    return RobotTile(
        robot.id,
        robot.name,
        kind.word,
        state.icon if kind.icon != HAND else HAND,
        kind.tone,
        kind.loud,
        detail,
        group is Group.WORKING and doing is not None and doing.is_late,
        battery.text,
        battery.icon,
        battery.tone,
    )


def _detail(
    robot: Robot,
    snapshot: RobotSnapshot,
    doing: Work | None,
    group: Group,
    state: str,
    settings: Settings,
    now: datetime,
) -> str:
    """What it executes and for how long yet, or why it needs a person; ``state`` is the word for that."""
    status = snapshot.status
    match group:
        case Group.SILENT:
            return _silence(robot, snapshot, settings, now)
        case Group.ASKS if status is not None and status.user_prompt is not None:
            return status.user_prompt.question
        case Group.WORKING if doing is not None:
            return _doing(doing)
        case Group.PAUSED if doing is not None:
            return doing.mission
        case Group.STOPPED | Group.LOOK if status is not None and status.errors:
            return render(problems_in_words(status.errors), _)
        case Group.LOOK if status is not None and status.state in AT_REST:
            return _("Battery under {minimum} %").format(minimum=formats.plain(settings.minimum_battery_percent or LOW))
        case Group.LOOK if status is not None and status.state is RobotState.UNKNOWN:
            return status.state_text or state
        case Group.STOPPED | Group.LOOK | Group.STARTING:
            return state
    return ""


def _silence(robot: Robot, snapshot: RobotSnapshot, settings: Settings, now: datetime) -> str:
    """Since when it hasn't answered, or what is wrong with its answers."""
    if snapshot.connection is Connection.UNREACHABLE and snapshot.since is not None:
        return _("since {time}").format(time=formats.day_and_time(snapshot.since, settings.timezone, now))
    return link_appearance(robot, snapshot, now, settings).word


def _doing(doing: Work) -> str:
    if doing.is_late:
        return _("longer than usual · {mission}").format(mission=doing.mission)
    if doing.minutes_left is None:
        return doing.mission
    if not doing.minutes_left:
        return _("soon done · {mission}").format(mission=doing.mission)
    left = formats.rough_duration(60 * doing.minutes_left)
    return _("{time} left · {mission}").format(time=left, mission=doing.mission)


# ---------------------------------------------------------------------- all of them
def counts(groups: Mapping[int, Group], look: Look) -> tuple[Count, ...]:
    """Most urgent first, normal ones grey; an empty group only while it is the filter. ``groups``: by robot."""
    found = Counter(groups.values())
    return tuple(
        _count(group, found[group], group is look.only) for group in Group if found[group] or group is look.only
    )


def _count(group: Group, n: int, selected: bool) -> Count:
    kind = look_of(group)
    return Count(group, count_words(group, n), kind.icon, kind.tone if n else "neutral", kind.loud and n > 0, selected)


def all_well(groups: Mapping[int, Group], alarms: int) -> bool:
    """``alarms`` are open, shelved ones among them."""
    return not alarms and not NEEDS_HELP.intersection(groups.values())


def arranged(tiles: Sequence[RobotTile], groups: Mapping[int, Group], look: Look) -> list[RobotTile]:
    """``tiles``, in their places, as they are looked at."""
    shown = [tile for tile in tiles if look.only is None or groups[tile.key] is look.only]
    return sorted(shown, key=lambda tile: URGENCY[groups[tile.key]]) if look.needy_first else shown
