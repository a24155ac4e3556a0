"""Texts and values that Settings shows of groups of robots and of the places that they share. Pure functions."""

from __future__ import annotations

from collections.abc import Sequence

from app.domain.models import FEWEST_TO_KEEP_FREE, Group, HandOver, Robot
from app.i18n import _, ngettext
from app.screens.settings.facts import SettingsFacts
from app.widgets.items import Action, Item


# ---------------------------------------------------------------------- groups
def group_items(facts: SettingsFacts, chosen: int | None = None) -> list[Item]:
    return [_group_item(facts, group, chosen) for group in facts.groups]


def _group_item(facts: SettingsFacts, group: Group, chosen: int | None) -> Item:
    missing = len({mission.id for robot in facts.members(group.id) for mission in facts.missing[robot.id]})
    return Item(
        group.id,
        group.name,
        robots_phrase(facts, group.members),
        ngettext("{n} mission missing", "{n} missions missing", missing).format(n=missing) if missing else "",
        icon="account-group-outline",
        look="chosen" if group.id == chosen else "plain",
        meta_tone="attention",
        actions=(Action("open", icon="chevron-right"),),
    )


def member_items(facts: SettingsFacts, members: Sequence[int], group: Group | None) -> list[Item]:
    """All robots, those of the group first, with the missions that they lack; of others, the groups that they are in."""
    robots = sorted(facts.robots, key=lambda robot: group is not None and robot.id not in group.members)
    return [_member_item(facts, robot, robot.id in members, group) for robot in robots]


def _member_item(facts: SettingsFacts, robot: Robot, is_member: bool, group: Group | None) -> Item:
    lacks = ", ".join(mission.name for mission in facts.missing[robot.id]) if is_member else ""
    return Item(
        robot.id,
        robot.name,
        _("Lacks {missions}").format(missions=lacks) if lacks else "",
        ", ".join(other.name for other in facts.groups if robot.id in other.members and other != group),
        support_tone="attention",
        ticked=is_member,
        strong=is_member,
        actions=(Action("missions", icon="chevron-right"),) if lacks else (),
    )


def robots_phrase(facts: SettingsFacts, members: Sequence[int]) -> str:
    return ", ".join(robot.name for robot in facts.robots if robot.id in members) or _("none yet")


def hand_over_names() -> dict[HandOver, str]:
    return {HandOver.AT_ONCE: _("At once"), HandOver.WHEN_FREE: _("When it is free")}


def hand_over_meaning(hand_over: HandOver) -> str:
    if hand_over is HandOver.AT_ONCE:
        return _("While the tablet is off, the robots continue. An urgent start waits behind earlier ones.")
    return _("Urgent starts go first. While the tablet is off, nothing starts.")


def keep_free_meaning(keep_free: int, members: int) -> str:
    """Its cost, as measured (tests/benchmarks/bench_allocation.py)."""
    if members < FEWEST_TO_KEEP_FREE:
        return _("From {n} robots on").format(n=FEWEST_TO_KEEP_FREE)
    if not keep_free:
        return _("Urgent starts wait until a robot is free, usually half a minute.")
    return _("For High and Critical starts. Others wait longer, on a busy day every fifth is not run.")


def most_kept_free(members: int) -> int:
    return members - 1 if members >= FEWEST_TO_KEEP_FREE else 0


# ---------------------------------------------------------------------- places
def place_items(facts: SettingsFacts, chosen: int | None = None) -> list[Item]:
    """Places, with how many robots each takes, then the positions that may become one."""
    icon = "map-marker-outline"
    places = [
        Item(
            place.id,
            place.name,
            missions_phrase(facts, place.missions),
            str(place.most),
            icon=icon,
            look="chosen" if place.id == chosen else "plain",
            actions=(Action("open", icon="chevron-right"),),
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
