"""Missions: the part of a change of the plan that is about them.

Every function raises InvalidInput before it has written anything.
"""

from __future__ import annotations

from dataclasses import replace

from app.domain.models import InvalidInput, Mission, Robot
from app.services.catalogue import change_log, fields, generated_names, robot_edit, schedule_edit
from app.services.catalogue.edit import Edit, Removed
from app.services.catalogue.validation import check_name_is_free
from app.services.executions import transitions
from app.services.live.changes import Topic


def save(edit: Edit, mission: Mission) -> Mission:
    """Add (id 0) or change. Schedules on a robot that used the mission of that name for all robots continue with
    the robot's own."""
    mission = fields.checked(mission, fields.MISSION)
    stored = edit.the(Mission, mission.id) if mission.id else None
    only = None if mission.robot_id is None else edit.the(Robot, mission.robot_id)
    other = edit.missions.by_name(edit.c, mission.name, mission.robot_id)
    check_name_is_free(other, mission.id, "there is a mission {name} already")
    check_used_only_there(edit, mission)
    if stored is not None and stored.guid != mission.guid:
        mission = replace(mission, charges=False)  # the robot has not been asked about that one
    if mission == stored:
        return mission
    if stored is None:
        mission = edit.missions.add(edit.c, mission)
        edit.notes.append(f"mission {mission.name!r}{f' of robot {only.name!r}' if only else ''} added")
    else:
        edit.missions.update(edit.c, mission)
        was_only = None if stored.robot_id is None else edit.the(Robot, stored.robot_id)
        changed = change_log.differences(change_log.of_mission(stored, was_only), change_log.of_mission(mission, only))
        edit.notes.append(f"mission {stored.name!r} changed: {changed}")
        generated_names.rename(edit, stored.name, mission)
        if mission.robot_id is None and mission.name != stored.name:
            named = [row for row in edit.executions.open_all(edit.c) if row.group_id and row.mission == stored.name]
            edit.apply(transitions.redefine(row, mission=mission.name) for row in named)
        schedule_edit.update_waiting(edit, mission.id)
        if stored.guid != mission.guid:
            robot_edit.withdraw_idle_of(edit, mission.id)
    use_own(edit, mission.name)
    edit.topics.add(Topic.MISSIONS)
    return mission


def use_own(edit: Edit, name: str) -> None:
    """Robots that have a mission of that name of their own use that instead of the one for all robots."""
    if general := edit.missions.by_name(edit.c, name):
        for robot_id, own_id in edit.missions.own_of_name(edit.c, name):
            _replace(edit, general.id, own_id, robot_id)


def check_used_only_there(edit: Edit, mission: Mission) -> None:
    """Check that no other robot, and no group, uses a robot's own mission."""
    if mission.robot_id is not None and edit.missions.used_on(edit.c, mission.id) - {mission.robot_id}:
        raise InvalidInput("robot", "the mission {name} is used on other robots too", name=mission.name)


def _replace(edit: Edit, old_id: int, new_id: int, robot_id: int) -> None:
    edit.schedules.replace_mission(edit.c, old_id, new_id, robot_id)
    schedule_edit.update_waiting(edit, new_id)
    robot = edit.the(Robot, robot_id)
    if robot.idle and robot.idle.mission_id == old_id:
        edit.robots.update(edit.c, replace(robot, idle=replace(robot.idle, mission_id=new_id)))
        robot_edit.withdraw_idle(edit, robot)
    edit.topics.add(Topic.SCHEDULES)


def remove(edit: Edit, mission_id: int) -> Removed:
    """Deletes the schedules and idle rules that use it; those of a robot's own one continue with the mission of
    that name for all robots."""
    mission = edit.the(Mission, mission_id)
    if mission.robot_id is not None and (general := edit.missions.by_name(edit.c, mission.name)):
        _replace(edit, mission_id, general.id, mission.robot_id)
    robot_edit.withdraw_idle_of(edit, mission_id)
    schedules = edit.schedules.for_mission(edit.c, mission_id)
    starts = edit.end_starts_of(schedules)
    edit.note(
        f"mission {mission.name!r} removed, and {len(schedules)} schedules with it", Topic.MISSIONS, Topic.SCHEDULES
    )
    return edit.hide(Removed(edit.now, {Mission: [mission_id]}, starts=starts), schedules)
