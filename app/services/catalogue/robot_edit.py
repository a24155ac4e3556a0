"""Robots and what they do when idle: the part of a change of the plan that is about them.

Every function raises InvalidInput before it has written anything.
"""

from __future__ import annotations

import re
from dataclasses import replace

from app.domain.execution import Reason, ReasonCode, Trigger
from app.domain.models import Fleet, FleetKind, IdleRule, InvalidInput, Mission, Robot
from app.mir.credentials import with_token
from app.services.catalogue import change_log, fields, generated_names, group_edit
from app.services.catalogue.edit import Edit, Removed
from app.services.catalogue.validation import check_name_is_free
from app.services.executions import transitions
from app.services.executions.transitions import NOT_WITH_THE_ROBOT, Event
from app.services.live.changes import Topic

_NUMBER = re.compile(r"0|[1-9][0-9]*")


def save(
    edit: Edit, robot: Robot, password: str | None = None, *, is_tested: bool = False, is_one_of_many: bool = False
) -> Robot:
    """Add (id 0) or change. A password becomes the token at once; without one, a new robot or one with another
    user, address, certificate or serial number is switched off and needs a password. A robot that only needed its
    password is switched on by it. A serial number of None keeps the known one; other facts about the machine stay
    unless ``is_tested``: the caller has just read them from it. ``is_one_of_many``: others change too, and the
    caller compares them afterwards."""
    stored = edit.the(Robot, robot.id) if robot.id else None
    if robot.fleet is not None:
        robot = robot.within(edit.the(Fleet, robot.fleet.id))
    robot = fields.checked(robot, fields.ROBOT)
    _check_name(edit, robot)
    _check_way(robot, stored, password)
    if stored is not None:
        robot = replace(robot, serial_number=robot.serial_number or stored.serial_number)
        if not is_tested:
            robot = replace(robot, model=stored.model, software=stored.software, identified_by=stored.identified_by)
    if not is_one_of_many:
        edit.check_is_no_other(robot, stored)
    if robot.fleet is None:
        robot = with_token(robot, password, stored)
    if robot.idle is not None:
        robot = replace(robot, idle=_checked_idle(edit, robot, robot.idle))
    return _put(edit, robot, stored)


def _check_way(robot: Robot, stored: Robot | None, password: str | None) -> None:
    """It is reached directly or through a fleet, and stays what it is: its queue ids are those of its robot or fleet."""
    if password == "":
        raise InvalidInput("password", "enter a password")
    if bool(robot.vehicle) is (robot.fleet is None):
        raise InvalidInput("vehicle", "a robot of a fleet needs its id at the fleet, others have none")
    is_new_of_classic = stored is None and robot.fleet is not None and robot.fleet.kind is FleetKind.CLASSIC
    if is_new_of_classic and not robot.is_any and not _NUMBER.fullmatch(robot.vehicle):
        raise InvalidInput("vehicle", "a robot's id at MiR Fleet is a number, such as 7, or the word any")
    if robot.fleet is not None and password is not None:
        raise InvalidInput("password", "{fleet} has the password of this robot: enter it there", fleet=robot.fleet.name)
    if stored is not None and way(robot) != way(stored):
        raise InvalidInput(
            "fleet", "{robot} can't be reached in another way: add that as another robot", robot=stored.name
        )


def way(robot: Robot) -> tuple[int | None, str]:
    """How it is reached: the id of its fleet and its id there; or directly."""
    return None if robot.fleet is None else robot.fleet.id, robot.vehicle


def _check_name(edit: Edit, robot: Robot) -> None:
    check_name_is_free(edit.robots.by_name(edit.c, robot.name), robot.id, "there is a robot {name} already")
    check_name_is_free(edit.groups.by_name(edit.c, robot.name), 0, "there is a group {name} already")


def _put(edit: Edit, robot: Robot, stored: Robot | None) -> Robot:
    if robot == stored:
        return robot
    if stored is None:
        robot = edit.robots.add(edit.c, robot)
        place = robot.address if robot.fleet is None else f"{robot.vehicle!r} of fleet {robot.fleet.name!r}"
        edit.notes.append(f"robot {robot.name!r} added, at {place}")
    else:
        edit.robots.update(edit.c, robot)
        if changed := change_log.change_of_robot(stored, robot):
            edit.notes.append(f"robot {stored.name!r} changed: {changed}")
        generated_names.rename(edit, stored.name, robot)
        if stored.enabled and not robot.enabled:
            end_unsent(edit, stored)
        edit.note_password(robot, stored, f"robot:{robot.id}", robot_id=robot.id)
    _note_idle(edit, robot, stored.idle if stored else None)
    if stored is not None and _idle_mission(stored) not in (None, _idle_mission(robot)):
        withdraw_idle(edit, robot)
    edit.topics.add(Topic.ROBOTS)
    return robot


def end_unsent(edit: Edit, robot: Robot) -> None:
    """It was switched off: its unsent starts end, or are for another robot of their group."""
    reason = Reason(ReasonCode.ROBOT_REMOVED, {"robot": robot.name})
    group_edit.unassign(edit, robot.id)
    unsent = edit.executions.open_for(edit.c, robot.id, NOT_WITH_THE_ROBOT)
    edit.withdraw([row for row in unsent if row.group_id is None], reason)
    _clear_alarms(edit, robot.id)


def withdraw_idle(edit: Edit, robot: Robot) -> None:
    """Withdraw its idle mission; if it was never sent, the idle period counts as unused."""
    reason = Reason(ReasonCode.SCHEDULE_CHANGED, {"idle": True})
    unsent = edit.executions.open_for(edit.c, robot.id, NOT_WITH_THE_ROBOT)
    if edit.withdraw([row for row in unsent if row.trigger is Trigger.IDLE], reason):
        edit.robots.note_idle(edit.c, robot.id, None)


def withdraw_idle_of(edit: Edit, mission_id: int) -> None:
    """The same of all robots that have this mission when idle."""
    for robot in edit.robots.select(edit.c, "WHERE idle.mission_id = ?", mission_id):
        withdraw_idle(edit, robot)
        edit.topics.add(Topic.ROBOTS)


def _note_idle(edit: Edit, robot: Robot, before: IdleRule | None) -> None:
    old, new = (
        change_log.of_idle_rule(rule, edit.missions.get(edit.c, rule.mission_id) if rule else None)
        for rule in (before, robot.idle)
    )
    if old != new:
        edit.notes.append(f"idle automation of robot {robot.name!r}: {change_log.differences(old, new)}")


def set_idle_rule(edit: Edit, robot_id: int, rule: IdleRule | None) -> Robot:
    """None: no idle automation."""
    stored = edit.the(Robot, robot_id)
    return _put(edit, replace(stored, idle=rule and _checked_idle(edit, stored, rule)), stored)


def _checked_idle(edit: Edit, robot: Robot, rule: IdleRule) -> IdleRule:
    if robot.is_any:
        raise InvalidInput("idle", "a fleet is never idle: choose an idle mission for one of its robots")
    mission = edit.mission_on(robot.id, rule.mission_id)
    return fields.checked(replace(rule, mission_id=mission.id), fields.IDLE)


def remove(edit: Edit, robot_id: int) -> Removed:
    """With its schedules, its own missions, its idle rule and its hold. Its open executions end as cancelled."""
    robot = edit.the(Robot, robot_id)
    reason = Reason(ReasonCode.ROBOT_REMOVED, {"robot": robot.name})
    group_edit.unassign(edit, robot_id)
    starts = edit.executions.open_for(edit.c, robot_id)
    edit.apply(transitions.end(Event.REMOVE, row, reason) for row in starts)
    schedules = edit.schedules.for_robot(edit.c, robot_id)
    edit.note(
        f"robot {robot.name!r} removed, and {len(schedules)} schedules with it",
        Topic.ROBOTS,
        Topic.MISSIONS,
        Topic.SCHEDULES,
        Topic.HOLDS,
    )
    missions = [mission.id for mission in edit.missions.all(edit.c) if mission.robot_id == robot_id]
    member_of = edit.groups.of_robot(edit.c, robot_id)
    _clear_alarms(edit, robot_id)
    removed = edit.hide(
        Removed(edit.now, {Robot: [robot_id], Mission: missions}, starts=starts, token=robot.token), schedules
    )
    return replace(removed, starts=[*starts, *group_edit.end_without_robots(edit, member_of)])


def _clear_alarms(edit: Edit, robot_id: int) -> None:
    """The alarms of a robot that is not asked any more."""
    if edit.alarms.clear_of_robot(edit.c, robot_id, edit.now):
        edit.topics.add(Topic.ALARMS)


def _idle_mission(robot: Robot) -> int | None:
    return robot.idle.mission_id if robot.idle and robot.idle.enabled else None
