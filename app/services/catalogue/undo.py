"""Undoing a deletion: what it took away, and how that is put back."""
from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from app.database.holds import StoredHold
from app.database.robots import Accepted
from app.database.schedules import Skip
from app.domain.models import DayException, IdleRule, InvalidInput, Mission, Robot, Schedule
from app.services.catalogue import told
from app.services.live.changes import Topic

if TYPE_CHECKING:
    from app.services.catalogue.edit import Edit


@dataclass(frozen=True)
class Removed:
    """What one deletion took away, ids included: ``Catalogue.restore`` puts it back."""
    robot: Robot | None = None
    accepted: Accepted | None = None                     # by that robot, last
    idle_queue_id: int | None = None                     # of that robot
    missions: Sequence[Mission] = ()
    schedules: Sequence[Schedule] = ()
    skips: Collection[Skip] = ()
    idle: Sequence[tuple[int, IdleRule]] = ()            # by robot id
    holds: Sequence[StoredHold] = ()
    days: Sequence[DayException] = ()
    waiting: Sequence[int] = ()                          # executions that ended with it


def restore(edit: Edit, removed: Removed) -> None:
    """Put back what a deletion took, under its old ids, with what waited. What would have fallen due meanwhile writes no row."""
    if removed.robot is not None:
        edit.check_robot_name(removed.robot)
        edit.check_is_no_other(removed.robot)
        edit.robots.add(edit.c, replace(removed.robot, idle=None))
        edit.robots.note_idle(edit.c, removed.robot.id, removed.idle_queue_id)
        edit.notes.append(f"robot {removed.robot.name!r} put back")
        if removed.accepted is not None:
            edit.robots.note_accepted(edit.c, removed.robot.id, removed.accepted)
    for mission in removed.missions:
        if edit.missions.by_name(edit.c, mission.name, mission.robot_id):
            raise InvalidInput("name", "there is a mission {name} already", name=mission.name)
        edit.missions.add(edit.c, mission)
        edit.notes.append(f"mission {mission.name!r} put back")
        edit.prefer_own(mission)
    if removed.robot is not None and removed.robot.idle is not None:
        _restore_idle(edit, removed.robot.id, removed.robot.idle)
    for robot_id, rule in removed.idle:
        _restore_idle(edit, robot_id, rule)
    calendar = edit.calendar
    for schedule in removed.schedules:
        if edit.schedules.by_name(edit.c, schedule.name):
            raise InvalidInput("name", "there is a schedule {name} already", name=schedule.name)
        edit.the_robot(schedule.robot_id)
        edit.the_mission(schedule.mission_id)
        edit.schedules.add(edit.c, replace(schedule, changed_at=edit.now))
        edit.notes.append(f"schedule {schedule.name!r} put back")
        for instant in [instant for schedule_id, instant in removed.skips if schedule_id == schedule.id]:
            edit.schedules.skip(edit.c, schedule.id, instant)
        edit.schedules.advance(edit.c, schedule.id, edit.first_due(schedule, calendar))
    edit.executions.wait_again(edit.c, removed.waiting, edit.now)
    for hold in removed.holds:
        edit.holds.add(edit.c, hold)
    if removed.days:
        for exception in removed.days:
            edit.days.add(edit.c, exception)
            edit.notes.append(f"{told.days(exception)} put back")
        edit.days_changed()
        return
    edit.topics |= {Topic.ROBOTS, Topic.MISSIONS, Topic.SCHEDULES, Topic.HOLDS, Topic.EXECUTIONS}


def _restore_idle(edit: Edit, robot_id: int, rule: IdleRule) -> None:
    """Unless there is another one by now, or its robot or mission is gone."""
    robot = edit.robots.get(edit.c, robot_id)
    if robot is not None and robot.idle is None and edit.missions.get(edit.c, rule.mission_id):
        edit.robots.update(edit.c, replace(robot, idle=rule))
