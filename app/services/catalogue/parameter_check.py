"""Whether the robots that are to run a mission take the parameters that it is given, as they have said themselves."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from app.domain.models import IdleRule, InvalidInput, Mission, Robot, Schedule
from app.domain.parameters import missing, values_for
from app.domain.robot import MissionParameter
from app.services.catalogue.transaction import Transaction

ASKED_OF_A_GROUP = 4         # robots, before one of them refuses: mostly a mission is the same on all
Known = Callable[[Robot, str], Sequence[MissionParameter] | None]        # of a mission's guid; None: not known


class Checked(NamedTuple):
    """``problem``: why no robot of which it is known what the mission asks for would take it. ``to_ask``: robots, with the mission's guid,
    whose answer could change that."""
    problem: InvalidInput | None = None
    to_ask: Sequence[tuple[Robot, str]] = ()


def of_schedule(edit: Transaction, schedule: Schedule, known: Known) -> Checked:
    """Of a group one robot that takes it is enough: each has positions of its own."""
    mission = edit.the_mission(schedule.mission_id)
    return _checked(mission.name, schedule.parameters, _robots(edit, schedule, mission), known)


def of_idle_rule(edit: Transaction, robot: Robot, rule: IdleRule, known: Known) -> Checked:
    """Its mission is given nothing."""
    mission = edit.the_mission(rule.mission_id)
    parameters = known(robot, mission.guid)
    if parameters is not None and not (asked := missing(parameters)):
        return Checked()
    problem = None if parameters is None else InvalidInput(
        "mission", "{mission} asks for {values}, which only a schedule or Run now can give", mission=mission.name, values=", ".join(asked))
    return Checked(problem, [(robot, mission.guid)])


def of_start(mission: str, given: Mapping[str, Any], robots: Sequence[tuple[Robot, str]], known: Known) -> Checked:
    """Of a mission that is to be run now on one of these robots, each with its guid there."""
    return _checked(mission, given, robots, known)


def is_given_anew(schedule: Schedule, before: Schedule | None) -> bool:
    """Whether it is to be checked: one that stays as it is may be edited otherwise, whatever robots say by now."""
    return before is None or _given(schedule) != _given(before)


def is_mission_new(rule: IdleRule, before: IdleRule | None) -> bool:
    """The same of an idle rule: whether it begins to start this mission."""
    return rule.enabled and (before is None or not before.enabled or before.mission_id != rule.mission_id)


def _given(schedule: Schedule) -> tuple[object, ...]:
    return schedule.mission_id, schedule.robot_id, schedule.group_id, dict(schedule.parameters)


def _robots(edit: Transaction, schedule: Schedule, mission: Mission) -> list[tuple[Robot, str]]:
    """Those that are switched on, each with the mission's guid there."""
    target = edit.target_of(schedule)
    members = [target] if isinstance(target, Robot) else [edit.the_robot(member) for member in target.members]
    meant = ((robot, edit.missions.for_robot(edit.c, mission.name, robot.id)) for robot in members if robot.enabled)
    return [(robot, there.guid) for robot, there in meant if there is not None]


def _checked(mission: str, given: Mapping[str, Any], robots: Sequence[tuple[Robot, str]], known: Known) -> Checked:
    problem: InvalidInput | None = None
    for robot, guid in robots:
        if (parameters := known(robot, guid)) is None:
            continue
        try:
            values_for(mission, parameters, given)
        except InvalidInput as why:
            problem = problem or why
        else:
            return Checked()
    if problem is not None:
        return Checked(problem, robots)
    return Checked(None, robots[:ASKED_OF_A_GROUP] if given else ())
