"""One transaction's worth of changes to robots, missions, schedules and settings, with everything that follows from them.

``app.services.catalogue.catalogue`` opens and commits it; the import of a configuration does many in one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from app.domain.models import (
    DayException,
    IdleRule,
    InvalidInput,
    Mission,
    Reason,
    ReasonCode,
    Robot,
    Settings,
    Trigger,
)
from app.mir.credentials import token_for
from app.services.catalogue import change_log, fields, generated_names, validation, zones
from app.services.catalogue.group_edit import GroupEdit
from app.services.catalogue.schedule_edit import ScheduleEdit
from app.services.catalogue.undo import Removed
from app.services.executions import transitions
from app.services.executions.transitions import NOT_WITH_THE_ROBOT, Event
from app.services.live.alarms import alarm_of
from app.services.live.changes import Topic
from app.services.planning import public_holidays

_NO_NEWS = frozenset({"selected_robot_id"})  # settings that change whenever somebody looks at another robot


class Edit(GroupEdit, ScheduleEdit):
    """Changes inside one transaction at one moment. Every method raises InvalidInput before it has written anything."""

    # ------------------------------------------------------------------ settings
    def change_settings(self, **changes: Any) -> Settings:
        """When working days change, the next occurrences of schedules that respect them are recomputed."""
        before = self.settings
        changed = replace(before, **validation.settings(changes))
        if "timezone" in changes:
            zones.was_chosen(self)
        if _days_off(changed)[1:] != _days_off(before)[1:]:
            public_holidays.check(changed.holiday_country, changed.holiday_subdivision)
        changes = {
            name: value
            for name, value in validation.settings(changes).items()
            if value != getattr(before, name) or not self.stored_settings.is_stored(self.c, name)
        }
        if changes:
            self.settings = self.stored_settings.save(self.c, **changes)
            self.topics.add(Topic.SETTINGS)
            wanted = sorted(changes.keys() - _NO_NEWS)
            if line := change_log.differences(
                change_log.parts(before, wanted), change_log.parts(self.settings, wanted)
            ):
                self.notes.append(f"settings changed: {line}")
        if _days_off(self.settings) != _days_off(before):
            self._replan_schedules()
        if _of_starts(self.settings) != _of_starts(before):
            found = (
                self.schedules.get(self.c, schedule_id) for schedule_id in self.executions.schedules_with_unsent(self.c)
            )
            self.update_waiting(filter(None, found))  # of a deleted one something may be in doubt
        return self.settings

    def _replan_schedules(self) -> None:
        """Due starts stay due; a one-time schedule ignores working days."""
        self._calendar = None
        calendar = self.calendar
        for schedule in self.schedules.all(self.c):
            is_due = schedule.next_at is not None and schedule.next_at <= self.now
            if schedule.respect_working_days and schedule.recurrence is not None and not is_due:
                next_at = self.first_due(schedule, calendar)
                if next_at != schedule.next_at:
                    self.schedules.advance(self.c, schedule.id, next_at)
        self.schedules.days_changed(self.c, self.now)
        self.topics.add(Topic.SCHEDULES)

    # ------------------------------------------------------------------ days off and extra working days
    def save_days(self, exceptions: Sequence[DayException]) -> list[DayException]:
        """Add (id 0) or change exceptions to the working days; the next occurrences of schedules that respect them are recomputed."""
        exceptions = [validation.day_exception(exception) for exception in exceptions]
        before = {exception.id: self.days.get(self.c, exception.id) for exception in exceptions if exception.id}
        if None in before.values():
            raise InvalidInput("days", "this entry of the calendar no longer exists")
        if self.days.count(self.c) + sum(not exception.id for exception in exceptions) > validation.MOST_DAY_EXCEPTIONS:
            raise InvalidInput("days", "the calendar has room for {most} entries", most=validation.MOST_DAY_EXCEPTIONS)
        saved = []
        for exception in exceptions:
            if stored := before.get(exception.id):
                self.days.update(self.c, exception)
                saved.append(exception)
                if stored != exception:
                    self.notes.append(f"{change_log.days(stored)} → {change_log.days(exception)}")
            else:
                saved.append(self.days.add(self.c, exception))
                self.notes.append(f"{change_log.days(exception)} added")
        self.days_changed()
        return saved

    def remove_days(self, ids: Sequence[int]) -> Removed:
        """Those of them that are still there."""
        found = self.days.by_ids(self.c, ids)
        self.notes += [f"{change_log.days(found[id_])} removed" for id_ in ids if id_ in found]
        removed = self.remove(Removed(self.now, days=[id_ for id_ in ids if id_ in found]))
        self.days_changed()
        return removed

    def days_changed(self) -> None:
        self.topics.add(Topic.CALENDAR)
        self._replan_schedules()

    # ------------------------------------------------------------------ robots
    def save_robot(
        self, robot: Robot, password: str | None = None, *, is_tested: bool = False, is_one_of_many: bool = False
    ) -> Robot:
        """Add (id 0) or change. A password becomes the token at once; without one, a new robot or one with another
        user, address, certificate or serial number is switched off and needs a password. A robot that only needed its
        password is switched on by it. A serial number of None keeps the known one; other facts about the machine stay
        unless ``is_tested``: the caller has just read them from it. ``is_one_of_many``: others change too, and the
        caller calls ``check_is_no_other`` afterwards."""
        stored = self.the_robot(robot.id) if robot.id else None
        robot = fields.checked(robot, fields.ROBOT)
        self.check_robot_name(robot)
        if password == "":
            raise InvalidInput("password", "enter a password")
        if stored is not None:
            robot = replace(robot, serial_number=robot.serial_number or stored.serial_number)
            if not is_tested:
                robot = replace(robot, model=stored.model, software=stored.software, identified_by=stored.identified_by)
        if not is_one_of_many:
            self.check_is_no_other(robot, stored)
        token = token_for(robot, password, stored)
        was_waiting = password is not None and stored is not None and stored.needs_password
        robot = replace(
            robot,
            token=token,
            needs_password=token is None,
            enabled=token is not None and (robot.enabled or was_waiting),
        )
        if robot.idle is not None:
            robot = replace(robot, idle=self._checked_idle(robot.id, robot.idle))
        return self._put_robot(robot, stored)

    def check_robot_name(self, robot: Robot) -> None:
        other = self.robots.by_name(self.c, robot.name)
        if other is not None and other.id != robot.id:
            raise InvalidInput("name", "there is a robot {name} already", name=robot.name)
        if self.groups.by_name(self.c, robot.name) is not None:
            raise InvalidInput("name", "there is a group {name} already", name=robot.name)

    def check_is_no_other(self, robot: Robot, before: Robot | None = None) -> None:
        """Check that a machine is not configured twice. Duplicates stored by an older version can still be changed."""
        if before is None or (robot.address, robot.serial_number) != (before.address, before.serial_number):
            validation.check_is_no_other(robot, self.robots.all(self.c))

    def _put_robot(self, robot: Robot, stored: Robot | None) -> Robot:
        if robot == stored:
            return robot
        if stored is None:
            robot = self.robots.add(self.c, robot)
            self.notes.append(f"robot {robot.name!r} added, at {robot.address}")
        else:
            self.robots.update(self.c, robot)
            if changed := change_log.change_of_robot(stored, robot):
                self.notes.append(f"robot {stored.name!r} changed: {changed}")
            generated_names.rename_for_robot(self, stored.name, robot)
            if stored.enabled and not robot.enabled:
                reason = Reason(ReasonCode.ROBOT_REMOVED, {"robot": stored.name})
                self._unassign(robot.id)
                unsent = self.executions.open_for(self.c, robot.id, NOT_WITH_THE_ROBOT)
                self.withdraw([row for row in unsent if row.group_id is None], reason)
                self._clear_alarms(robot.id)
            if robot.needs_password and stored.enabled:
                details = {"robot": robot.name, "robot_id": robot.id}
                self.alarms.raise_once(self.c, alarm_of("needs_password", f"robot:{robot.id}", self.now, details))
                self.topics.add(Topic.ALARMS)
            elif stored.needs_password and not robot.needs_password:
                self._clear_alarms(robot.id)
        self._note_idle(robot, stored.idle if stored else None)
        if stored is not None and _idle_mission(stored) not in (None, _idle_mission(robot)):
            self._withdraw_idle(robot)
        self.topics.add(Topic.ROBOTS)
        return robot

    def _withdraw_idle(self, robot: Robot) -> None:
        """Withdraw its idle mission; if it was never sent, the idle period counts as unused."""
        reason = Reason(ReasonCode.SCHEDULE_CHANGED, {"idle": True})
        unsent = self.executions.open_for(self.c, robot.id, NOT_WITH_THE_ROBOT)
        if self.withdraw([row for row in unsent if row.trigger is Trigger.IDLE], reason):
            self.robots.note_idle(self.c, robot.id, None)

    def _withdraw_idle_of(self, mission_id: int) -> bool:
        """The same of all robots that have this mission when idle; whether there are any."""
        robots = [robot for robot in self.robots.all(self.c) if robot.idle and robot.idle.mission_id == mission_id]
        for robot in robots:
            self._withdraw_idle(robot)
        return bool(robots)

    def _note_idle(self, robot: Robot, before: IdleRule | None) -> None:
        old, new = (
            change_log.of_idle_rule(rule, self.missions.get(self.c, rule.mission_id) if rule else None)
            for rule in (before, robot.idle)
        )
        if old != new:
            self.notes.append(f"idle automation of robot {robot.name!r}: {change_log.differences(old, new)}")

    def set_idle_rule(self, robot_id: int, rule: IdleRule | None) -> Robot:
        """None: no idle automation."""
        stored = self.the_robot(robot_id)
        return self._put_robot(replace(stored, idle=rule and self._checked_idle(robot_id, rule)), stored)

    def _checked_idle(self, robot_id: int, rule: IdleRule) -> IdleRule:
        mission = self._mission_on(robot_id, rule.mission_id)
        return fields.checked(replace(rule, mission_id=mission.id), fields.IDLE)

    def remove_robot(self, robot_id: int) -> Removed:
        """With its schedules, its own missions, its idle rule and its hold. Its open executions end as cancelled."""
        robot = self.the_robot(robot_id)
        reason = Reason(ReasonCode.ROBOT_REMOVED, {"robot": robot.name})
        self._unassign(robot_id)
        starts = self.executions.open_for(self.c, robot_id)
        self.apply(transitions.end(Event.REMOVE, row, reason) for row in starts)
        schedules = self.schedules.for_robot(self.c, robot_id)
        self.notes.append(f"robot {robot.name!r} removed, and {len(schedules)} schedules with it")
        missions = [mission.id for mission in self.missions.all(self.c) if mission.robot_id == robot_id]
        member_of = self.groups.of_robot(self.c, robot_id)
        self._clear_alarms(robot_id)
        removed = self.remove(
            Removed(self.now, robots=[robot_id], missions=missions, starts=starts, token=robot.token), schedules
        )
        self.topics |= {Topic.ROBOTS, Topic.MISSIONS, Topic.SCHEDULES, Topic.HOLDS}
        return replace(removed, starts=[*starts, *self._end_without_robots(member_of)])

    def _clear_alarms(self, robot_id: int) -> None:
        """The alarms of a robot that is not asked any more."""
        if self.alarms.clear_of_robot(self.c, robot_id, self.now):
            self.topics.add(Topic.ALARMS)

    # ------------------------------------------------------------------ missions
    def save_mission(self, mission: Mission) -> Mission:
        """Add (id 0) or change. Schedules on a robot that used the mission of that name for all robots continue with
        the robot's own."""
        mission = fields.checked(mission, fields.MISSION)
        stored = self.the_mission(mission.id) if mission.id else None
        only = None if mission.robot_id is None else self.the_robot(mission.robot_id)
        other = self.missions.by_name(self.c, mission.name, mission.robot_id)
        if other is not None and other.id != mission.id:
            raise InvalidInput("name", "there is a mission {name} already", name=mission.name)
        if stored is not None and mission.robot_id is not None:
            self._check_used_only_on(mission)
        if stored is not None and stored.guid != mission.guid:
            mission = replace(mission, charges=False)  # the robot has not been asked about that one
        if mission == stored:
            return mission
        if stored is None:
            mission = self.missions.add(self.c, mission)
            self.notes.append(f"mission {mission.name!r}{f' of robot {only.name!r}' if only else ''} added")
        else:
            self.missions.update(self.c, mission)
            was_only = None if stored.robot_id is None else self.the_robot(stored.robot_id)
            changed = change_log.differences(
                change_log.of_mission(stored, was_only), change_log.of_mission(mission, only)
            )
            self.notes.append(f"mission {stored.name!r} changed: {changed}")
            generated_names.rename_for_mission(self, stored.name, mission)
            if mission.robot_id is None and mission.name != stored.name:
                named = [row for row in self.executions.open_all(self.c) if row.group_id and row.mission == stored.name]
                self.apply(transitions.redefine(row, mission=mission.name) for row in named)
            self.update_waiting(self.schedules.for_mission(self.c, mission.id))
            if stored.guid != mission.guid:
                self._withdraw_idle_of(mission.id)
        self.use_own_mission(mission)
        self.topics.add(Topic.MISSIONS)
        return mission

    def use_own_mission(self, mission: Mission) -> None:
        if mission.robot_id is not None and (general := self.missions.by_name(self.c, mission.name)):
            self._replace_mission(general.id, mission.id, mission.robot_id)

    def _check_used_only_on(self, mission: Mission) -> None:
        if self.missions.used_on(self.c, mission.id) - {mission.robot_id}:
            raise InvalidInput("robot", "the mission {name} is used on other robots too", name=mission.name)

    def _replace_mission(self, old_id: int, new_id: int, robot_id: int) -> None:
        self.schedules.replace_mission(self.c, old_id, new_id, robot_id)
        self.update_waiting(self.schedules.for_mission(self.c, new_id))
        robot = self.the_robot(robot_id)
        if robot.idle and robot.idle.mission_id == old_id:
            self.robots.update(self.c, replace(robot, idle=replace(robot.idle, mission_id=new_id)))
            self._withdraw_idle(robot)
        self.topics.add(Topic.SCHEDULES)

    def remove_mission(self, mission_id: int) -> Removed:
        """Deletes the schedules and idle rules that use it; those of a robot's own one continue with the mission of
        that name for all robots."""
        mission = self.the_mission(mission_id)
        if mission.robot_id is not None and (general := self.missions.by_name(self.c, mission.name)):
            self._replace_mission(mission_id, general.id, mission.robot_id)
        is_idle_mission = self._withdraw_idle_of(mission_id)
        schedules = self.schedules.for_mission(self.c, mission_id)
        starts = self.open_of(schedules)
        for schedule in schedules:
            self.withdraw_all(schedule, "deleted")
        self.notes.append(f"mission {mission.name!r} removed, and {len(schedules)} schedules with it")
        self.topics |= {Topic.MISSIONS, Topic.SCHEDULES} | ({Topic.ROBOTS} if is_idle_mission else set())
        return self.remove(Removed(self.now, missions=[mission_id], starts=starts), schedules)


def _idle_mission(robot: Robot) -> int | None:
    return robot.idle.mission_id if robot.idle and robot.idle.enabled else None


def _of_starts(settings: Settings) -> tuple[object, ...]:
    """The default settings for starts whose schedule has no own ones."""
    return settings.start_window_minutes, settings.minimum_battery_percent


def _days_off(settings: Settings) -> tuple[object, ...]:
    """The settings that decide which days are working days."""
    return settings.working_days, settings.holiday_country, settings.holiday_subdivision
