"""Texts and values that Settings shows of groups of robots and of the places that they share. Pure functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from app.domain.models import FEWEST_TO_KEEP_FREE, Group, HandOver, Robot
from app.i18n import _, ngettext
from app.screens.settings.facts import SettingsFacts
from app.widgets.items import Action, Item

MOST_COLUMNS = 8  # robots that fit next to the names of the missions

HAS, LACKS, UNKNOWN = "check", "close-thick", "help"  # icons of a cell of the table


@dataclass(frozen=True)
class MissionLine:
    """A line of the table of missions and members: ``cells`` are icons in the order of the members."""

    key: str
    name: str
    note: str
    tone: str
    cells: tuple[str, ...]


# ---------------------------------------------------------------------- groups
def group_items(facts: SettingsFacts, chosen: int | None = None) -> list[Item]:
    return [_group_item(facts, group, chosen) for group in facts.groups]


def _group_item(facts: SettingsFacts, group: Group, chosen: int | None) -> Item:
    gaps = sum(LACKS in line.cells for line in mission_lines(facts, group))
    return Item(
        group.id,
        group.name,
        robots_phrase(facts, group.members),
        ngettext("{n} not on every robot", "{n} not on every robot", gaps).format(n=gaps) if gaps else "",
        icon="account-group-outline",
        look="chosen" if group.id == chosen else "plain",
        meta_tone="attention",
        actions=(Action("open", icon="chevron-right"),),
    )


def missions_item(facts: SettingsFacts, group: Group) -> Item:
    """Whether all its robots have its missions, which a tap shows."""
    lines = mission_lines(facts, group)
    gaps = sum(LACKS in line.cells for line in lines)
    missions = (
        ngettext("{n} not on every robot", "{n} not on every robot", gaps).format(n=gaps)
        if gaps
        else _("on all its robots")
        if lines and all(set(line.cells) == {HAS} for line in lines)
        else "–"
    )
    tone = "attention" if gaps else ""
    return Item(
        "missions",
        _("Missions"),
        missions,
        icon="flag-outline",
        support_tone=tone,
        actions=(Action("open", icon="chevron-right"),),
    )


def member_items(facts: SettingsFacts, members: Sequence[int], group: Group | None) -> list[Item]:
    """All robots, those of the group first; of others, the groups that they are in."""
    robots = sorted(facts.robots, key=lambda robot: group is not None and robot.id not in group.members)
    return [
        Item(
            robot.id,
            robot.name,
            meta=", ".join(other.name for other in facts.groups if robot.id in other.members and other != group),
            ticked=robot.id in members,
            strong=robot.id in members,
        )
        for robot in robots
    ]


def robots_phrase(facts: SettingsFacts, members: Sequence[int]) -> str:
    return ", ".join(robot.name for robot in facts.robots if robot.id in members) or _("none yet")


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
def place_items(facts: SettingsFacts, most: Mapping[int, int], chosen: int = 0) -> list[Item]:
    """Places with a stepper, ``most`` by their id, then the positions that may become one."""
    icon = "map-marker-outline"
    places = [
        Item(
            place.id,
            place.name,
            missions_phrase(facts, place.missions),
            icon=icon,
            look="chosen" if place.id == chosen else "plain",
            actions=(
                Action("fewer", icon="minus", style="outlined"),
                Action("", str(most[place.id])),
                Action("more", icon="plus", style="outlined"),
                Action("dots", icon="dots-vertical"),
            ),
        )
        for place in facts.places
    ]
    proposed = [
        Item(
            place.position,
            place.name,
            missions_phrase(facts, place.missions),
            icon=icon,
            opens=False,
            actions=(Action("take", _("Make it a place")), Action("decline", icon="close")),
        )
        for place in facts.proposed
    ]
    return places + ([Item("", _("Used by several missions"), look="head"), *proposed] if proposed else [])


def missions_phrase(facts: SettingsFacts, missions: Sequence[int]) -> str:
    return ", ".join(mission.name for mission in facts.missions if mission.id in missions) or _("no mission uses it")
