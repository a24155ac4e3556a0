"""Settings, what a deletion also deletes, named in the question before. Pure functions."""

from __future__ import annotations

from collections.abc import Sequence

from app.domain.models import Fleet, Group, Mission, Robot, Schedule
from app.i18n import _, ngettext
from app.screens.settings.facts import SettingsFacts

MOST_NAMED = 6  # schedules, groups


# ---------------------------------------------------------------------- missions
def mission_question(facts: SettingsFacts, mission: Mission) -> str:
    """Which schedules and idle rules are deleted with it; empty: none."""
    if _has_stand_in(facts, mission):
        return ""
    idle = _several([robot.name for robot in facts.idle_on(mission)], ", ")
    others = [_("idle automation on {robots}").format(robots=idle)] if idle else []
    return _question(facts, facts.schedules_of(mission), others).rstrip()


def _has_stand_in(facts: SettingsFacts, mission: Mission) -> bool:
    """Users of a robot's own mission continue with the one of that name for all robots."""
    return mission.robot_id is not None and any(
        other.robot_id is None and other.name == mission.name for other in facts.missions
    )


# ---------------------------------------------------------------------- robots
def robot_question(facts: SettingsFacts, robot: Robot) -> str:
    """What is deleted with it, and what stays."""
    goes = _question(facts, [each for each in facts.schedules if each.robot_id == robot.id], _other_of(facts, robot))
    groups = [group.name for group in facts.groups if robot.id in group.members]
    alone = [group.name for group in facts.groups if group.members == (robot.id,)]
    left = (
        ngettext("It leaves the group {groups}.", "It leaves the groups {groups}.", len(groups)).format(
            groups=_several(groups, ", ")
        )
        if groups
        else ""
    )
    empty = (
        _("No robot is left in {groups}: starts that wait for one are cancelled.").format(groups=_several(alone, ", "))
        if alone
        else ""
    )
    stays = _("Its runs stay in the history. Nothing changes on the robot itself.")
    return "\n".join(filter(None, (goes, left, empty, stays)))


def _other_of(facts: SettingsFacts, robot: Robot) -> list[str]:
    own = sum(mission.robot_id == robot.id for mission in facts.missions)
    others = [_("its idle automation")] if robot.idle is not None else []
    if own:
        others.append(
            ngettext("{n} mission that only this robot has", "{n} missions that only this robot has", own).format(n=own)
        )
    return others


def fleet_question(facts: SettingsFacts, fleet: Fleet) -> str:
    """Which robots and schedules are deleted with it, and what stays; empty: none."""
    robots = facts.robots_of(fleet)
    if not robots:
        return ""
    ids = {robot.id for robot in robots}
    schedules = [each for each in facts.schedules if each.robot_id in ids]
    goes = _question(facts, schedules, [_several([robot.name for robot in robots], ", ")])
    return "\n".join((goes, _("Their runs stay in the history. Nothing changes on the fleet itself.")))


# ---------------------------------------------------------------------- groups
def group_question(facts: SettingsFacts, group: Group, waiting: int = 0) -> str:
    """Which schedules are deleted with it, by name, how many waiting starts, and what stays."""
    cancelled = (
        ngettext(
            "A start that waits for one of its robots is cancelled.",
            "{n} starts that wait for one of its robots are cancelled.",
            waiting,
        ).format(n=waiting)
        if waiting
        else ""
    )
    return "\n".join(
        filter(
            None,
            (
                _question(facts, [each for each in facts.schedules if each.group_id == group.id], []),
                cancelled,
                _("Its robots stay, and running missions continue."),
            ),
        )
    )


# ---------------------------------------------------------------------- all of them
def _question(facts: SettingsFacts, schedules: Sequence[Schedule], others: Sequence[str]) -> str:
    """The schedules one below the other, then the ``others`` in a sentence."""
    parts = []
    if schedules:
        lead = ngettext("This schedule goes with it:", "These {n} schedules go with it:", len(schedules)).format(
            n=len(schedules)
        )
        parts += [lead, _several([_name(facts, schedule) for schedule in schedules], "\n"), ""]
    if others:
        parts.append(_("This goes with it: {what}.").format(what=", ".join(others)))
    return "\n".join(parts)


def _name(facts: SettingsFacts, schedule: Schedule) -> str:
    mission, target = (
        facts.mission(schedule.mission_id),
        facts.robot(schedule.robot_id) or facts.group(schedule.group_id),
    )
    return facts.mission_names.schedule(schedule, mission, target) if mission and target else schedule.name


def _several(names: Sequence[str], separator: str) -> str:
    more = len(names) - MOST_NAMED
    return separator.join(
        [*names[:MOST_NAMED], *([ngettext("and {n} more", "and {n} more", more).format(n=more)] if more > 0 else [])]
    )
