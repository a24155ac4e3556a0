"""Settings, what a deletion also deletes: named in the question before, counted in the message with Undo. Pure
functions."""

from __future__ import annotations

from collections.abc import Sequence

from app.domain.models import Group, Mission, Robot, Schedule
from app.i18n import _, ngettext
from app.screens.settings.facts import SettingsFacts

MOST_NAMED = 6  # schedules, groups


# ---------------------------------------------------------------------- missions
def mission_question(facts: SettingsFacts, mission: Mission) -> str:
    """Which schedules and idle rules are deleted with it; empty: none."""
    return _question(facts, _schedules_with(facts, mission), _idle_with(facts, mission)).rstrip()


def mission_sentence(facts: SettingsFacts, mission: Mission) -> str:
    return _sentence(
        _("{mission} deleted").format(mission=mission.name), _schedules_with(facts, mission), _idle_with(facts, mission)
    )


def _schedules_with(facts: SettingsFacts, mission: Mission) -> Sequence[Schedule]:
    return () if _has_stand_in(facts, mission) else facts.schedules_of(mission)


def _idle_with(facts: SettingsFacts, mission: Mission) -> list[str]:
    idle = () if _has_stand_in(facts, mission) else facts.idle_on(mission)
    return (
        [_("idle automation on {robots}").format(robots=_several([robot.name for robot in idle], ", "))] if idle else []
    )


def _has_stand_in(facts: SettingsFacts, mission: Mission) -> bool:
    """Users of a robot's own mission continue with the one of that name for all robots."""
    return mission.robot_id is not None and any(
        other.robot_id is None and other.name == mission.name for other in facts.missions
    )


# ---------------------------------------------------------------------- robots
def robot_question(facts: SettingsFacts, robot: Robot) -> str:
    """What is deleted with it, and what stays."""
    goes = _question(facts, _schedules_on(facts, robot), _other_of(facts, robot))
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


def robot_sentence(facts: SettingsFacts, robot: Robot) -> str:
    return _sentence(
        _("{robot} deleted").format(robot=robot.name), _schedules_on(facts, robot), _other_of(facts, robot)
    )


def _schedules_on(facts: SettingsFacts, robot: Robot) -> list[Schedule]:
    return [schedule for schedule in facts.schedules if schedule.robot_id == robot.id]


def _other_of(facts: SettingsFacts, robot: Robot) -> list[str]:
    own = sum(mission.robot_id == robot.id for mission in facts.missions)
    others = [_("its idle automation")] if robot.idle is not None else []
    if own:
        others.append(
            ngettext("{n} mission that only this robot has", "{n} missions that only this robot has", own).format(n=own)
        )
    return others


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
                _question(facts, _schedules_for(facts, group), []),
                cancelled,
                _("Its robots stay, and running missions continue."),
            ),
        )
    )


def group_sentence(facts: SettingsFacts, group: Group) -> str:
    return _sentence(_("{group} deleted").format(group=group.name), _schedules_for(facts, group), [])


def _schedules_for(facts: SettingsFacts, group: Group) -> list[Schedule]:
    return [schedule for schedule in facts.schedules if schedule.group_id == group.id]


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


def _sentence(deleted: str, schedules: Sequence[Schedule], others: Sequence[str]) -> str:
    """All that went, for the message with Undo."""
    counted = [ngettext("{n} schedule", "{n} schedules", len(schedules)).format(n=len(schedules))] if schedules else []
    what = ", ".join([*counted, *others])
    return _("{deleted}, and with it: {what}").format(deleted=deleted, what=what) if what else deleted


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
