"""All robots in one look: a cell for each in its place, and what needs a person as rows, the worst first. Pure."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from app.domain.capabilities import Capabilities
from app.domain.models import Connection, Fleet, Robot, RobotSnapshot, Settings
from app.domain.models import Group as RobotGroup
from app.domain.robot import RobotState, UserPrompt, clipped
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.formats import LONGEST_QUESTION
from app.screens.common.holding import HAND
from app.screens.common.robot_appearance import (
    LOW,
    battery_appearance,
    silent_fleet,
    state_appearance,
    trouble_of,
)
from app.screens.common.robot_groups import CALM, NEEDS_HELP, URGENCY, Group, count_words, look_of, robots_in_words
from app.screens.common.robot_texts import Problem, problem_of_status
from app.widgets.items import Action, Item, Option

NAMED_UP_TO = 3  # robots in one row; more are counted
GROUPED_OVER = 56  # robots, which no longer fit on a page
ON_WALL = 3  # rows of the wall view
AT_REST = (RobotState.READY, RobotState.ABORTED, RobotState.COMPLETED)

Cause = tuple[str, str, str]  # a group of states, the problem in words, and the fleet or the minute in which it began


@dataclass(frozen=True)
class Look:
    """One robot as it is shown: its ``cell`` has its name and one fact. If it needs a person: why (``problem``), since when, its question,
    and the command that helps."""

    robot: Robot
    group: Group
    cell: Item
    said: str = ""  # its state and battery as last known
    is_known: bool = True  # it has been asked
    problem: str = ""
    since: datetime | None = None
    prompt: UserPrompt | None = None
    remedy: str = ""  # "reset" or "resume"
    fleet: Fleet | None = None  # that is silent, and not this robot alone

    @property
    def rank(self) -> tuple[int, bool, float]:
        """The worst first, of these the one at which a person has to go to the robot; then the oldest."""
        return URGENCY[self.group], bool(self.remedy), self.since.timestamp() if self.since else math.inf


@dataclass(frozen=True)
class Head:
    """The head of a group of robots; ``key`` is the place of the group among all, ``bad`` and ``calm`` how many are in which state."""

    key: tuple[str, int]
    name: str
    robots: str
    is_open: bool
    bad: tuple[Option, ...]
    calm: tuple[Option, ...]
    panelclass: str = "FleetHead"
    is_whole_row = True


@dataclass(frozen=True)
class Pane:
    """The list at the left; without a ``title`` there is none."""

    title: str = ""
    note: str = ""
    rows: tuple[Item, ...] = ()
    can_go_back: bool = False
    more: str = ""  # robots that the wall view doesn't show


def minutes_left(left_s: float) -> int:
    """Of a mission, in whole ones; 0 if it should end soon, below 0 by how much it takes longer than usual."""
    return int(math.copysign(max(1, abs(left_s) // 60), left_s)) if left_s else 0


def look(
    robot: Robot,
    snapshot: RobotSnapshot,
    group: Group,
    old: bool,
    settings: Settings,
    left: int | None = None,
    since: datetime | None = None,
    free: str = "",
) -> Look:
    """``old``: what is known of it is out of date; ``left``: the minutes of its mission, None if unknown; ``free``: how
    many are, if it stands for any robot of a fleet."""
    state, kind, status = state_appearance(robot, snapshot, old, free), look_of(group), snapshot.status
    battery = battery_appearance(status, settings)
    is_low = group is Group.LOOK and status is not None and status.state in AT_REST and not status.errors
    fact = battery.text if is_low or group is Group.CHARGING else state.word
    if group is Group.WORKING and left is not None:
        fact = _left(left)
    elif group is Group.HELD:
        fact = kind.word
    icon = HAND if group is Group.HELD else battery.icon if is_low else state.icon
    last = state
    if old and status is not None:
        last = state_appearance(robot, RobotSnapshot(robot.id, Connection.CONNECTED, status), stale=False)
    return Look(
        robot,
        group,
        Item(robot.id, robot.name, fact, icon=icon, tone=kind.tone, loud=kind.loud),
        " · ".join(dict.fromkeys((last.word, battery.text))),
        snapshot.connection is not Connection.UNKNOWN,
        " ".join(_problem(robot, snapshot, group, state.word, is_low, settings).split()),
        since,
        status.user_prompt if status is not None and group is Group.ASKS and snapshot.capabilities.prompts else None,
        _remedy(group, status.state if status is not None else None, snapshot.capabilities),
        silent_fleet(robot, snapshot),
    )


def _left(minutes: int) -> str:
    if not minutes:
        return _("Soon done")
    time = formats.rough_duration(60 * abs(minutes))
    return _("{time} left").format(time=time) if minutes > 0 else _("{time} late").format(time=time)


def _problem(robot: Robot, snapshot: RobotSnapshot, group: Group, word: str, is_low: bool, settings: Settings) -> str:
    """Why it needs a person; ``word`` is its state."""
    status = snapshot.status
    if robot.needs_password:
        return _("Needs its password")
    if silent_fleet(robot, snapshot) is not None:
        return _("{problem}. Is the fleet's server on?").format(problem=word) if word == _("No answer") else word
    if group not in NEEDS_HELP or group is Group.SILENT or status is None:
        return word
    if status.state is RobotState.EMERGENCY_STOP:
        return _("Emergency stop. Release the red button, then press Reset on the robot.")
    if group is Group.ASKS and status.user_prompt is not None:
        return clipped(status.user_prompt.question, LONGEST_QUESTION)
    if is_low:
        return _("Battery under {minimum} %").format(minimum=formats.plain(settings.minimum_battery_percent or LOW))
    is_said = status.errors or group is Group.STOPPED or word == formats.NOTHING
    found = problem_of_status(status) if is_said else Problem()
    return found.words or found.quote or word


def _remedy(group: Group, state: RobotState | None, can: Capabilities) -> str:
    if group is Group.STOPPED:
        return "reset" if state is RobotState.ERROR and can.clear_error else ""
    return "resume" if group is Group.PAUSED and can.pause else ""


# ---------------------------------------------------------------------- what needs a person
def cause(look: Look, zone: str) -> Cause | None:
    """What it shares with the other robots of its row; None: it has a row of its own, as one that asks has."""
    if look.fleet is not None:
        return look.group.value, look.problem, look.fleet.name
    if look.since is None or look.prompt is not None:
        return None
    return look.group.value, look.problem, formats.clock_time(look.since, zone)


def causes(looks: Iterable[Look], zone: str) -> dict[Cause | int, list[Look]]:
    """Those that need a person, by their common cause or else by robot, the worst first."""
    found: dict[Cause | int, list[Look]] = {}
    for each in sorted((each for each in looks if each.group in NEEDS_HELP), key=lambda each: each.rank):
        found.setdefault(cause(each, zone) or each.robot.id, []).append(each)
    return {key if len(same) > 1 else same[0].robot.id: same for key, same in found.items()}


def to_do(
    looks: Sequence[Look], settings: Settings, now: datetime, halls: Mapping[int, str], tight: bool = False
) -> tuple[Item, ...]:
    """A row for each cause. ``halls``: names of groups by robot, where rows say it; in a ``tight`` list all buttons are
    below the words."""
    silent = (Group.SILENT, Group.OFF, Group.STARTING)
    answering = sum(each.group not in silent and not each.robot.is_any for each in looks)
    rows = []
    for key, same in causes(looks, settings.timezone).items():
        first = same[0]
        where = dict.fromkeys(halls[each.robot.id] for each in same if each.robot.id in halls)
        since = formats.day_and_time(first.since, settings.timezone, now) if first.since is not None else ""
        row = Item(
            key,
            title=first.fleet.name if first.fleet else _names(same),
            support=first.problem if first.fleet or len(same) <= NAMED_UP_TO else _all_at_once(first, answering),
            aside=" · ".join(filter(None, (since, *where))),
            icon=first.cell.icon,
            tone=first.cell.tone,
            disc=True,
            loud=first.cell.tone != "attention",
            large=True,
            below=tight or first.prompt is not None,
            actions=_actions(first) if len(same) == 1 else (OPEN,),
        )
        rows.append(row)
    return tuple(rows)


OPEN = Action("open", icon="chevron-right")


def _actions(look: Look) -> tuple[Action, ...]:
    """What solves it, or the way to the robot."""
    if look.prompt is not None:
        options = dict.fromkeys(look.prompt.options)
        return tuple(Action(f"{ANSWER}{look.prompt.guid}\n{option}", option, tone="action") for option in options) or (
            OPEN,
        )
    return {
        "reset": (Action("reset", _("Reset errors")),),
        "resume": (Action("resume", _("Resume")),),
    }.get(look.remedy, (OPEN,))


ANSWER = "answer "  # in the name of an action, before the guid of the question and the option


def _names(looks: Sequence[Look]) -> str:
    """Their common beginning is said once: "Robot 9, 23, 40"."""
    names = [each.robot.name for each in looks]
    if len(names) > NAMED_UP_TO:
        return robots_in_words(each.robot for each in looks)
    head, _space, number = names[0].rpartition(" ")
    beginning = f"{head} "
    if head and number.isdigit() and all(name.startswith(beginning) for name in names):
        return ", ".join([names[0], *(name.removeprefix(beginning) for name in names[1:])])
    return ", ".join(names)


def _all_at_once(first: Look, answering: int) -> str:
    """Of many robots at once the cause may be elsewhere: the others tell where."""
    text = _("{problem}, all at the same minute.").format(problem=first.problem.rstrip("."))
    if first.group is not Group.SILENT:
        return text
    others = (
        ngettext("{n} other answers.", "{n} others answer.", answering).format(n=answering)
        if answering
        else _("Maybe this tablet has no network.")
    )
    return f"{text} {others}"


def listed(looks: Iterable[Look]) -> tuple[Item, ...]:
    """Robots of one kind, or that were searched for, a row each."""
    return tuple(
        Item(
            each.robot.id,
            title=each.robot.name,
            meta=each.said,
            icon=each.cell.icon,
            tone=each.cell.tone,
            actions=_actions(each) if each.remedy else (OPEN,),
        )
        for each in looks
    )


def pane_of(same: Sequence[Look], at: str) -> Pane:
    """The robots that have one cause, which began ``at`` that time, or is their fleet."""
    first = same[0]
    if first.fleet is not None:
        return Pane(first.fleet.name, first.problem, listed(same), True)
    title = _("{problem}: {robots}").format(problem=first.problem, robots=robots_in_words(each.robot for each in same))
    note = _("All at {time}. What each told last:") if first.group is Group.SILENT else _("All at {time}.")
    return Pane(title, note.format(time=at), listed(same), True)


def of_group(looks: Iterable[Look], group: Group) -> list[Look]:
    """The robots of that group, as they are counted."""
    return [each for each in looks if each.group is group and not each.robot.is_any]


def troubles_in_words(looks: Iterable[Look]) -> str:
    """How many robots, or silent fleets, need a person; empty when none does."""
    n = len({trouble_of(each.robot, each.fleet) for each in looks if each.group in NEEDS_HELP})
    return ngettext("{n} needs you", "{n} need you", n).format(n=n) if n else ""


def more_than_on_wall(looks: Iterable[Look], zone: str) -> str:
    n = sum(len(same) for same in list(causes(looks, zone).values())[ON_WALL:])
    return ngettext("{n} more", "{n} more", n).format(n=n) if n else ""


# ---------------------------------------------------------------------- all of them
def counts(groups: Iterable[Group], only: Group | None) -> tuple[Option, ...]:
    """Of the normal groups, those with robots; the others are in the list. The key is the group."""
    found = Counter(groups)
    return tuple(
        Option(group, count_words(group, found[group]), look_of(group).icon, selected=group is only)
        for group in CALM
        if found[group]
    )


def heading(looks: Sequence[Look], has_alarms: bool) -> tuple[str, str]:
    """In place of the list where no robot needs a person: text and icon. Open alarms are counted at the bell."""
    if not all(each.is_known for each in looks):
        return formats.NOTHING, "timer-sand"
    if has_alarms:
        return _("Look at the alarms"), "bell-outline"
    return _("All well"), "check"


def halls_of(robots: Iterable[int], groups: Sequence[RobotGroup]) -> dict[int, int]:
    """The place of each robot's group; of several, the first, and after all groups for a robot without one."""
    return {
        robot: next((n for n, group in enumerate(groups) if robot in group.members), len(groups)) for robot in robots
    }


def heads(
    looks: Iterable[Look], halls: Mapping[int, int], groups: Sequence[RobotGroup], open_one: int | None
) -> tuple[Head, ...]:
    """One for each group with robots; ``halls``: the place of each robot's group."""
    by_hall: dict[int, list[Look]] = {}
    for each in looks:
        by_hall.setdefault(halls[each.robot.id], []).append(each)
    return tuple(
        _head(n, groups[n].name if n < len(groups) else _("Others"), by_hall[n], n == open_one) for n in sorted(by_hall)
    )


def _head(n: int, name: str, looks: Sequence[Look], is_open: bool) -> Head:
    found = Counter(each.group for each in looks if not each.robot.is_any)
    bad = tuple(
        Option(group, str(found[group]), look_of(group).icon, tone=look_of(group).tone)
        for group in URGENCY
        if group in NEEDS_HELP and found[group]
    )
    calm = tuple(
        Option(group, str(found[group]), look_of(group).icon) for group in (Group.WORKING, Group.READY, Group.CHARGING)
    )
    return Head(("hall", n), name, robots_in_words(each.robot for each in looks), is_open, bad, calm)


def columns(count: int, width: float, height: float, least: tuple[float, float], most: float, gap: float) -> int:
    """The fewest that show ``count`` cells without scrolling, as wide as ``most`` and at ``least`` (width, height)."""
    fitting = max(1, int((width + gap) // (least[0] + gap)))
    rows = max(1, int((height + gap) // (least[1] + gap)))
    return min(fitting, max(math.ceil((width + gap) / (most + gap)), math.ceil(count / rows)))
