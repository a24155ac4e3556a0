"""Groups of robots and priorities in the Scheduler: a schedule's robot or group, priorities in words. Pure."""

from __future__ import annotations

from collections.abc import Collection

from app.domain.execution import Execution
from app.domain.models import Group, Robot, Schedule
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.group_starts import lacking, lacking_words
from app.screens.common.priorities import LEVELS, level, word
from app.screens.common.robot_appearance import off_word, robot_option
from app.screens.scheduler.draft import Target
from app.screens.scheduler.facts import SchedulerFacts
from app.services.allocation.situation import NORMAL
from app.services.planning.planned import PlannedRun
from app.widgets.items import Option


def target_options(facts: SchedulerFacts) -> list[Option]:
    """Groups first, then robots."""
    groups = [
        Option(
            ("group", group.id),
            _("Any of {group}").format(group=group.name),
            "select-group",
            ", ".join(robot.name for robot in facts.members(group.id)),
        )
        for group in facts.groups
    ]
    robots = (robot_option(robot, "" if robot.enabled else off_word(robot)) for robot in facts.robots)
    return [*groups, *robots]


def other_robots(facts: SchedulerFacts, run: PlannedRun, lacks: Collection[str] = ()) -> list[Option]:
    """To which a planned start may be moved, with those whose names say that they lack its mission."""
    return [
        robot_option(robot, _("does not have the mission") if robot.name in lacks else "")
        for robot in facts.robots
        if robot.enabled and robot.id != run.schedule.robot_id
    ]


def target_text(target: Robot | Group | None) -> str:
    if target is None:
        return _("Choose a robot")
    return _("Any of {group}").format(group=target.name) if isinstance(target, Group) else target.name


def whose(facts: SchedulerFacts, schedule: Schedule, last: Execution | None) -> str:
    """The robot of a schedule; of a group's, which of them it was last."""
    target = facts.target(schedule)
    if target is None:
        return ""
    if isinstance(target, Robot):
        return target.name
    if last is not None and last.robot:
        return _("any of {group} (last: {robot})").format(group=target.name, robot=last.robot)
    return _("any of {group}").format(group=target.name)


def line(robots: int, starts: int, is_more: bool, failed: int, overlaps: int, held: int, silent: int) -> str:
    """A line for the lanes of a number of robots: their future starts (``is_more``: not all are known), problems, and
    how many of them get nothing."""
    return " · ".join(
        filter(
            None,
            (
                ngettext("{n} robot", "{n} robots", robots).format(n=robots),
                ngettext("{n} start", "{n} starts", starts).format(n=starts)
                if starts
                else ""
                if is_more
                else _("nothing planned"),
                _("and more starts") if is_more else "",
                ngettext("{n} failed run", "{n} failed runs", failed).format(n=failed) if failed else "",
                ngettext("{n} overlap", "{n} overlaps", overlaps).format(n=overlaps) if overlaps else "",
                _("{n} on hold").format(n=held) if held else "",
                ngettext("{n} no answer", "{n} no answer", silent).format(n=silent) if silent else "",
            ),
        )
    )


def all_are_off(facts: SchedulerFacts, schedule: Schedule) -> bool:
    """Whether it is for a group with no robot switched on."""
    return schedule.group_id is not None and not any(robot.enabled for robot in facts.members(schedule.group_id))


def all_lack_mission(facts: SchedulerFacts, schedule: Schedule) -> bool:
    """Whether it is for a group whose switched-on robots all lack its mission, as far as known."""
    mission, robots = (
        facts.mission(schedule.mission_id),
        [robot for robot in facts.members(schedule.group_id) if robot.enabled],
    )
    return (
        mission is not None
        and bool(robots)
        and len(lacking(mission, robots, facts.missions, facts.names)) == len(robots)
    )


def is_listed(facts: SchedulerFacts, schedule: Schedule, target: Target | None) -> bool:
    """Whether it may run on that robot, or is for that group; None: any."""
    if target is None:
        return True
    if isinstance(target, tuple):
        return schedule.group_id == target[1]
    return schedule.robot_id == target or any(robot.id == target for robot in facts.members(schedule.group_id))


def mission_options(facts: SchedulerFacts, group_id: int) -> list[Option]:
    """Missions for all robots that at least one of the group has, as far as is known, favourites first; with the robots that lack it."""
    members, options = facts.members(group_id), []
    for mission in sorted(facts.missions, key=lambda m: (not m.favourite, m.name.casefold())):
        if mission.robot_id is not None:
            continue
        without = lacking(mission, members, facts.missions, facts.names)
        if len(without) < len(members) or not members:
            options.append(
                Option(
                    mission.id, mission.name, "star" if mission.favourite else "star-outline", lacking_words(without)
                )
            )
    return options


def what_matters(schedule: Schedule) -> str:
    """What its starts have beyond others: another priority, a time to be done by."""
    minutes = schedule.finish_by_minutes
    done = _("to be done within {time}").format(time=formats.duration(minutes * 60)) if minutes else ""
    return " · ".join(filter(None, (word(schedule.priority) if level(schedule.priority) != NORMAL else "", done)))


def priorities() -> tuple[tuple[int, str], ...]:
    """The four that are offered, with their numbers."""
    return tuple((number, word(number)) for number in LEVELS)
