"""Whether the robots of a mission accept the parameters entered for it, by what they reported."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from app.database.groups import GroupRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.domain.models import IdleRule, InvalidInput, Mission, Robot, Schedule
from app.domain.parameters import missing, values_for
from app.domain.robot import MissionParameter
from app.services.catalogue.edit import Edit

ASKED_OF_A_GROUP = 4  # robots, before one of them refuses: mostly a mission is the same on all
Known = Callable[[Robot, str], Sequence[MissionParameter] | None]  # of a mission's guid; None: not known


class Checked(NamedTuple):
    """``problem``: why no robot with known parameters would accept it. ``to_ask``: robots, with the mission's guid,
    whose answer could change that."""

    problem: InvalidInput | None = None
    to_ask: Sequence[tuple[Robot, str]] = ()


class Runners:
    """Which robots may get the starts of schedules, by the configuration at one moment."""

    def __init__(self, c: sqlite3.Connection) -> None:
        self._robots = {robot.id: robot for robot in RobotRepository().all(c)}
        self._members = {group.id: group.members for group in GroupRepository().all(c)}
        missions = MissionRepository().all(c)
        self._names = {mission.id: mission.name for mission in missions}
        self._guids = {(mission.name, mission.robot_id): mission.guid for mission in missions}
        self._found: dict[tuple[int, int | None, int | None], list[tuple[Robot, str]]] = {}
        self._refused: dict[tuple[object, ...], InvalidInput | None] = {}

    def check(self, schedule: Schedule, known: Known) -> Checked:
        """Of a group one robot that takes it is enough: each has positions of its own."""
        return check(self._names.get(schedule.mission_id, ""), schedule.parameters, self._of(schedule), known)

    def refused(self, schedule: Schedule, said: Known) -> InvalidInput | None:
        """Why each of them would refuse it. None where one would not, or has not ``said`` itself what the mission needs."""
        key = schedule.mission_id, schedule.robot_id, schedule.group_id, repr(sorted(schedule.parameters.items()))
        if key not in self._refused:  # many schedules start the same
            problem = self.check(schedule, said).problem
            is_sure = problem is not None and all(said(*each) is not None for each in self._of(schedule))
            self._refused[key] = problem if is_sure else None
        return self._refused[key]

    def _of(self, schedule: Schedule) -> list[tuple[Robot, str]]:
        """Those that are switched on, each with the mission's guid there."""
        key = schedule.mission_id, schedule.robot_id, schedule.group_id
        if key not in self._found:
            name = self._names.get(schedule.mission_id, "")
            members = (
                self._members.get(schedule.group_id or 0, ()) if schedule.robot_id is None else (schedule.robot_id,)
            )
            guids = ((each, self._guids.get((name, each)) or self._guids.get((name, None))) for each in members)
            self._found[key] = [
                (robot, guid) for each, guid in guids if guid and (robot := self._robots.get(each)) and robot.enabled
            ]
        return self._found[key]


def of_idle_rule(edit: Edit, robot: Robot, rule: IdleRule, known: Known) -> Checked:
    """Its mission gets no parameters."""
    mission = edit.the(Mission, rule.mission_id)
    parameters = known(robot, mission.guid)
    if parameters is not None and not (asked := missing(parameters)):
        return Checked()
    problem = (
        None
        if parameters is None
        else InvalidInput(
            "mission",
            "{mission} asks for {values}, which only a schedule or Run now can give",
            mission=mission.name,
            values=", ".join(asked),
        )
    )
    return Checked(problem, [(robot, mission.guid)])


def needs_check(schedule: Schedule, before: Schedule | None) -> bool:
    """Whether it must be checked: unchanged ones need not, even if robots would refuse them today."""
    return before is None or _what_it_starts(schedule) != _what_it_starts(before)


def is_mission_new(rule: IdleRule, before: IdleRule | None) -> bool:
    """The same of an idle rule: whether it begins to start this mission."""
    return rule.enabled and (before is None or not before.enabled or before.mission_id != rule.mission_id)


def _what_it_starts(schedule: Schedule) -> tuple[object, ...]:
    return schedule.mission_id, schedule.robot_id, schedule.group_id, dict(schedule.parameters)


def check(mission: str, values: Mapping[str, Any], robots: Sequence[tuple[Robot, str]], known: Known) -> Checked:
    """The missions of that name on these robots, each with its guid there."""
    problem: InvalidInput | None = None
    for robot, guid in robots:
        if (parameters := known(robot, guid)) is None:
            continue
        try:
            values_for(mission, parameters, values)
        except InvalidInput as why:
            problem = problem or why
        else:
            return Checked()
    if problem is not None:
        return Checked(problem, robots)
    return Checked(None, robots[:ASKED_OF_A_GROUP] if values else ())
