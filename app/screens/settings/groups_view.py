"""Texts and values that Settings shows of groups of robots and of the places that they share. Pure functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from app.domain.models import FEWEST_TO_KEEP_FREE, Group, HandOver, Place, Robot
from app.i18n import _, ngettext
from app.screens.common.options import Option
from app.screens.settings.facts import SettingsFacts

MOST_COLUMNS = 8  # robots that fit next to the names of the missions

HAS, LACKS, UNKNOWN = "check", "close-thick", "help"  # icons of a cell of the table


@dataclass(frozen=True)
class GroupPanelView:
    """Values of GroupPanel."""

    key: tuple[str, int]
    name: str
    note: str
    robots: str
    hand_over: str
    keep_free: str
    missions: str
    missions_tone: str
    missions_icon: str
    panelclass: ClassVar[str] = "GroupPanel"


@dataclass(frozen=True)
class AddGroupPanelView:
    """Values of AddGroupPanel; ``first``: no group exists yet."""

    first: bool
    key: str = "add group"
    panelclass: ClassVar[str] = "AddGroupPanel"


@dataclass(frozen=True)
class MissionLine:
    """A line of the table of missions and members: ``cells`` are icons in the order of the members."""

    key: str
    name: str
    note: str
    tone: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class PlaceView:
    """Values of PlaceRow."""

    key: int
    name: str
    note: str


@dataclass(frozen=True)
class ProposalView:
    """Values of ProposedPlaceRow; ``key``: guid of the position."""

    key: str
    text: str


# ---------------------------------------------------------------------- groups
def group_panels(facts: SettingsFacts) -> list[GroupPanelView | AddGroupPanelView]:
    return [*(_panel(facts, group) for group in facts.groups), AddGroupPanelView(first=not facts.groups)]


def _panel(facts: SettingsFacts, group: Group) -> GroupPanelView:
    lines = mission_lines(facts, group)
    gaps = sum(LACKS in line.cells for line in lines)
    schedules = sum(schedule.group_id == group.id for schedule in facts.schedules)
    note = (
        ngettext("{n} schedule", "{n} schedules", schedules).format(n=schedules)
        if schedules
        else _("no schedule uses it")
    )
    missions = (
        ngettext("{n} not on every robot", "{n} not on every robot", gaps).format(n=gaps)
        if gaps
        else _("on all its robots")
        if lines and all(set(line.cells) == {HAS} for line in lines)
        else "–"
    )
    return GroupPanelView(
        ("group", group.id),
        group.name,
        note,
        robots=robots_phrase(facts, group.members),
        hand_over=hand_over_names()[group.hand_over],
        keep_free=ngettext("{n} robot", "{n} robots", group.keep_free).format(n=group.keep_free)
        if group.keep_free
        else _("no robot"),
        missions=missions,
        missions_tone="attention" if gaps else "neutral",
        missions_icon="alert" if gaps else "",
    )


def robots_phrase(facts: SettingsFacts, members: Sequence[int]) -> str:
    return ", ".join(robot.name for robot in facts.robots if robot.id in members) or _("none yet")


def robot_options(facts: SettingsFacts) -> list[Option]:
    return [Option(robot.id, robot.name, "robot-outline", robot.model or "") for robot in facts.robots]


def hand_over_names() -> dict[HandOver, str]:
    return {HandOver.WHEN_FREE: _("When a robot is free"), HandOver.AT_ONCE: _("At once")}


def hand_over_meaning(hand_over: HandOver) -> str:
    if hand_over is HandOver.AT_ONCE:
        return _(
            "At its time, each start goes into the queue of the robot that will be done first, and stays there. The "
            "robots continue while the tablet is off or the radio fails; an urgent start does not overtake starts in "
            "a queue."
        )
    return _(
        "Starts wait in the app, the urgent ones first, until a robot is free. While the tablet is off the robots get nothing new."
    )


def keep_free_meaning(keep_free: int, members: int) -> str:
    """Its cost, as measured (tests/benchmarks/bench_allocation.py)."""
    if members < FEWEST_TO_KEEP_FREE:
        return _("Needs a group of {n} robots or more: with fewer, everything else would wait too long.").format(
            n=FEWEST_TO_KEEP_FREE
        )
    if not keep_free:
        return _("Urgent starts go first, but wait until a robot is free: half a minute on a usual day.")
    return _(
        "Only for starts of High and Critical priority, which then wait only seconds. All others wait longer: half "
        "as long again on a usual day; on a busy day every fifth is not run."
    )


def most_kept_free(members: int) -> int:
    return members - 1 if members >= FEWEST_TO_KEEP_FREE else 0


# ---------------------------------------------------------------------- which robot of a group has which mission
def mission_lines(facts: SettingsFacts, group: Group) -> list[MissionLine]:
    """One row for each mission of the members, those with gaps first."""
    members = facts.members(group)
    names = sorted(
        {mission.name for mission in facts.missions if mission.robot_id is None or mission.robot_id in group.members},
        key=str.casefold,
    )
    lines = [_line(facts, name, members) for name in names]
    return sorted(lines, key=lambda line: (LACKS not in line.cells, UNKNOWN not in line.cells))


def _line(facts: SettingsFacts, name: str, members: Sequence[Robot]) -> MissionLine:
    cells = tuple(_cell(facts, name, robot) for robot in members)
    lacking = [robot.name for robot, cell in zip(members, cells, strict=True) if cell == LACKS]
    unknown = [robot.name for robot, cell in zip(members, cells, strict=True) if cell == UNKNOWN]
    if lacking:
        note = _("Not on {robots}").format(robots=", ".join(lacking))
    elif unknown:
        note = _("Not known yet of {robots}").format(robots=", ".join(unknown))
    else:
        note = ""
    return MissionLine(name, name, note, "attention" if lacking else "neutral", cells)


def _cell(facts: SettingsFacts, name: str, robot: Robot) -> str:
    """A robot's own mission of that name takes the place of the one for all robots."""
    meant = [mission for mission in facts.missions if mission.name == name and mission.robot_id in (None, robot.id)]
    if not meant:
        return LACKS
    there = facts.names.get(robot.id)
    if not there:
        return UNKNOWN
    return HAS if max(meant, key=lambda mission: mission.robot_id or 0).guid in there else LACKS


# ---------------------------------------------------------------------- places
def place_views(facts: SettingsFacts) -> list[PlaceView]:
    return [PlaceView(place.id, place.name, _place_note(facts, place)) for place in facts.places]


def proposal_views(facts: SettingsFacts) -> list[ProposalView]:
    """One at a time."""
    return [
        ProposalView(
            place.position,
            _("{place} is used by {n} missions: make it a place?").format(place=place.name, n=len(place.missions)),
        )
        for place in facts.proposed[:1]
    ]


def _place_note(facts: SettingsFacts, place: Place) -> str:
    most = ngettext("At most {n} robot at a time", "At most {n} robots at a time", place.most).format(n=place.most)
    return f"{most} · {missions_phrase(facts, place.missions)}"


def missions_phrase(facts: SettingsFacts, missions: Sequence[int]) -> str:
    return ", ".join(mission.name for mission in facts.missions if mission.id in missions) or _("no mission uses it")
