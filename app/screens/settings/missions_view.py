"""Texts and values of missions in Settings: their uses, robots that lack them, and a robot's missions. Pure
functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from app.domain import names
from app.domain.models import Mission, Robot
from app.domain.robot import MissionInfo
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.view import NoticeView
from app.widgets.items import Action, Item, Option

MOST_COLUMNS = 6  # robots, else groups
HAS, MISSING, UNKNOWN = "check", "close", "help"  # icons of cells


@dataclass(frozen=True)
class Cell:
    """How a mission stands on the robots of a column: an icon for one robot, a text for several."""

    icon: str = ""
    text: str = ""
    is_missing: bool = False


@dataclass(frozen=True)
class MissionLine:
    """Values of MissionRow. ``usual``: its duration."""

    key: int
    name: str
    note: str
    favourite: bool
    usual: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Choice:
    """Which missions and robots the matrix shows: those that some robot misses, those found by a search, one group."""

    query: str = ""
    only_missing: bool = False
    group_id: int = 0  # 0: all robots


def columns(facts: SettingsFacts, choice: Choice, most: int) -> list[tuple[str, tuple[Robot, ...]]]:
    """The head and the robots of each of at most ``most`` columns: a robot, else a group, else all of them in one."""
    group = facts.group(choice.group_id)
    robots = facts.members(group.id) if group else facts.robots
    if len(robots) <= min(most, MOST_COLUMNS):
        return [(robot.name, (robot,)) for robot in robots]
    groups = [(each.name, facts.members(each.id)) for each in facts.groups]
    rest = tuple(robot for robot in robots if not any(robot.id in each.members for each in facts.groups))
    groups += [(_("Others"), rest)] if rest else []
    if group is None and 1 < len(groups) <= min(most, MOST_COLUMNS):
        return groups
    return [(group.name if group else _("Robots"), robots)]


def mission_lines(facts: SettingsFacts, choice: Choice, most: int) -> list[MissionLine]:
    """By name; searched are name, GUID and robot."""
    words, shown = choice.query.casefold().split(), columns(facts, choice, most)
    lines = []
    for mission in sorted(facts.missions, key=lambda mission: (mission.name.casefold(), mission.robot_id or 0)):
        owner = facts.robot(mission.robot_id)
        searched = f"{mission.name} {mission.guid} {owner.name if owner else ''}".casefold()
        if all(word in searched for word in words) and not (choice.only_missing and not facts.robots_missing(mission)):
            seconds = facts.usual_s.get(mission.guid) or 60 * (mission.usual_minutes or 0)
            usual = formats.duration(seconds) if seconds else "–"
            note = _("Only {robot}").format(robot=owner.name) if owner else ""
            cells = tuple(_cell(facts, mission, robots) for _head, robots in shown)
            lines.append(MissionLine(mission.id, mission.name, note, mission.favourite, usual, cells))
    return lines


def _cell(facts: SettingsFacts, mission: Mission, robots: Sequence[Robot]) -> Cell:
    there = [facts.names.get(robot.id) for robot in robots if mission.robot_id in (None, robot.id)]
    has = [mission.guid in names for names in there if names]
    is_missing = any(mission in facts.missing[robot.id] for robot in robots)
    if len(robots) > 1 and has:
        return Cell(text=f"{sum(has)}/{len(has)}", is_missing=is_missing)
    if len(robots) == 1 and there and not has:
        return Cell(UNKNOWN)
    if is_missing:
        return Cell(MISSING, is_missing=True)
    return Cell(HAS) if any(has) else Cell(text="–")


def usage(facts: SettingsFacts, mission: Mission) -> str:
    """What starts it by itself: "2 schedules, idle automation on Aino"."""
    parts = []
    if schedules := facts.schedules_of(mission):
        parts.append(ngettext("{n} schedule", "{n} schedules", len(schedules)).format(n=len(schedules)))
    if idle := facts.idle_on(mission):
        parts.append(_("idle automation on {robots}").format(robots=", ".join(robot.name for robot in idle)))
    return ", ".join(parts) or _("no schedule uses it")


def mission_note(facts: SettingsFacts, mission: Mission) -> NoticeView:
    """What starts it, and which robots lack it."""
    use = usage(facts, mission)
    use = use[:1].upper() + use[1:]
    if missing := missing_sentence(facts, mission):
        return NoticeView(missing, use, "attention", "alert")
    return NoticeView(use, icon="calendar-clock-outline")


def typed_minutes(text: str) -> int | None:
    """The usual duration in the field: None if empty; 0, which the services refuse, if it is not a number."""
    stripped = text.strip()
    if not stripped:
        return None
    return int(stripped) if stripped.isdecimal() else 0


def missing_sentence(facts: SettingsFacts, mission: Mission) -> str:
    """On which robots it can't be started, if known; empty: none."""
    if robots := facts.robots_missing(mission):
        return _("Not on {robots} any more").format(robots=", ".join(robot.name for robot in robots))
    return ""


# ---------------------------------------------------------------------- fetched from a robot
@dataclass(frozen=True)
class Offer:
    """A mission that a robot has, as it would be saved. ``robot_id`` is set when another mission for all robots has this name; ``known``:
    it is saved already; ``is_cut``: the robot has a longer name for it."""

    name: str
    guid: str
    robot_id: int | None = None
    known: bool = False
    is_cut: bool = False


def offers(found: Sequence[MissionInfo], missions: Sequence[Mission], robot_id: int) -> list[Offer]:
    """The missions of the robot, by name. Of several with one name the later ones get a number, as names are unique."""
    there = {info.guid for info in found}
    here = [mission for mission in missions if mission.robot_id in (None, robot_id)]
    known = {mission.guid for mission in here}
    taken = {mission.name for mission in here if mission.robot_id == robot_id or mission.guid in there}
    for_all = {mission.name for mission in missions if mission.robot_id is None}
    result = []
    for info in sorted(found, key=lambda info: (info.name.casefold(), info.guid)):
        if info.guid in known:
            result.append(Offer(info.name, info.guid, known=True))
            continue
        name = _free_name(info.name if names.cleaned(info.name) else info.guid, taken)
        result.append(
            Offer(name, info.guid, robot_id if name in for_all else None, is_cut=len(info.name.strip()) > names.LONGEST)
        )
        taken.add(name)
        for_all.add(name)
    return result


def _free_name(wanted: str, taken: set[str]) -> str:
    name, number = names.cleaned(wanted), 1
    while name in taken:
        number += 1
        ending = f" {number}"
        name = names.cleaned(wanted, names.LONGEST - len(ending)) + ending
    return name


def offer_options(offered: Sequence[Offer]) -> list[Option]:
    """Options of the checklist, the new ones only."""
    return [
        Option(
            offer.guid,
            offer.name,
            "flag-outline",
            " · ".join(
                filter(
                    None,
                    (
                        _("The name is already in use: this one will be for this robot only") if offer.robot_id else "",
                        _("Name cut at {n} characters").format(n=names.LONGEST) if offer.is_cut else "",
                    ),
                )
            ),
        )
        for offer in offered
        if not offer.known
    ]


def fetched_sentence(offered: Sequence[Offer], robot: Robot) -> str:
    """Why there is nothing to choose; empty otherwise."""
    if not offered:
        return _("{robot} has no missions. Make one on the robot first.").format(robot=robot.name)
    if all(offer.known for offer in offered):
        return ngettext(
            "The mission of {robot} is already added", "All {n} missions of {robot} are already added", len(offered)
        ).format(n=len(offered), robot=robot.name)
    return ""


def mission_options(facts: SettingsFacts, robot: Robot) -> list[Option]:
    """Missions that can be chosen for the robot, favourites first; its own replace those for all robots with the same
    name. Its missions are known once its list has been read."""
    there = facts.names.get(robot.id)
    by_name: dict[str, Mission] = {}
    for mission in sorted(facts.missions, key=lambda m: m.robot_id or 0):
        if mission.robot_id in (None, robot.id) and (not there or mission.guid in there):
            by_name[mission.name] = mission
    return [
        Option(mission.id, mission.name, "star" if mission.favourite else "star-outline")
        for mission in sorted(by_name.values(), key=lambda m: (not m.favourite, m.name.casefold()))
    ]


# ---------------------------------------------------------------------- idle automation
def idle_items(facts: SettingsFacts, problems: Mapping[int, str], chosen: int | None = None) -> list[Item]:
    """A row per robot. ``problems`` by robot id: why something was not saved."""
    return [
        Item(
            robot.id,
            robot.name,
            problems.get(robot.id) or _idle_note(facts, robot),
            support_tone="fault" if problems.get(robot.id) else "",
            icon="robot-outline",
            look="chosen" if robot.id == chosen else "plain",
            on=robot.idle is not None and robot.idle.enabled,
            actions=(Action("open", icon="chevron-right"),),
        )
        for robot in facts.robots
    ]


def idle_mission(facts: SettingsFacts, robot: Robot) -> str:
    mission = facts.mission(robot.idle.mission_id) if robot.idle is not None else None
    return mission.name if mission is not None else _("Choose a mission")


def _idle_note(facts: SettingsFacts, robot: Robot) -> str:
    if robot.idle is None:
        return _("No mission")
    if not robot.enabled:
        return _("The robot is switched off")
    return _("{mission} · after {n} min").format(mission=idle_mission(facts, robot), n=robot.idle.after_minutes)
