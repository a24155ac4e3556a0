"""Robots, missions, schedules and settings: every change of them, from screens and from files, goes through here.

Each change is checked completely before anything is written, made in one transaction together with its consequences (waiting executions of
a changed schedule are cancelled, next occurrences recomputed), and published after the commit. Invalid values are raised as InvalidInput.
"""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from typing import Any, TypeVar

from app.database.connection import Database
from app.database.copy import copy_in_memory
from app.database.execution_history import ExecutionHistory
from app.database.fleets import FleetRepository
from app.database.group_executions import GroupExecutionRepository
from app.database.groups import GroupRepository, PlaceRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository, Skip
from app.database.settings import STEPS_LEFT_OUT, CalendarRepository, SettingsRepository
from app.domain.clock import Clock
from app.domain.models import (
    DayException,
    Fleet,
    Group,
    IdleRule,
    InvalidInput,
    Mission,
    Place,
    Robot,
    Schedule,
    Settings,
)
from app.domain.robot import MissionParameter
from app.services.catalogue import (
    checks,
    fleet_edit,
    group_edit,
    mission_edit,
    parameter_check,
    robot_edit,
    schedule_edit,
    settings_edit,
    undo,
    zones,
)
from app.services.catalogue.edit import Edit, Removed
from app.services.catalogue.undo import Changed
from app.services.live.changes import Changes, Topic
from app.services.live.mission_parameters import MissionParameters
from app.services.planning import public_holidays

MOST_NOTES = 20  # lines of the log for one change: an import makes thousands
T = TypeVar("T")
log = logging.getLogger(__name__)

__all__ = ["Catalogue", "Edit", "Removed"]


class Catalogue:
    """``parameters``: missions' parameters, if robots can be asked."""

    def __init__(
        self, db: Database, clock: Clock, changes: Changes | None = None, parameters: MissionParameters | None = None
    ) -> None:
        self._db, self._clock, self._changes, self.parameters = db, clock, changes, parameters
        self._robots, self._missions, self._schedules = RobotRepository(), MissionRepository(), ScheduleRepository()
        self._calendar = CalendarRepository()

    # ------------------------------------------------------------------ reading
    def robots(self) -> list[Robot]:
        """In order of name."""
        return self._robots.all(self._db.read())

    def robot(self, robot_id: int) -> Robot | None:
        return self._robots.get(self._db.read(), robot_id)

    def fleets(self) -> list[Fleet]:
        """In order of name."""
        return FleetRepository().all(self._db.read())

    def groups(self) -> list[Group]:
        """In order of name."""
        return GroupRepository().all(self._db.read())

    def waiting_for(self, group_id: int) -> int:
        """How many starts of a group no robot has yet: deleting the group cancels them."""
        return GroupExecutionRepository().count_waiting(self._db.read(), group_id)

    def places(self) -> list[Place]:
        """In order of name."""
        return PlaceRepository().all(self._db.read())

    def missions(self) -> list[Mission]:
        """In order of name."""
        return self._missions.all(self._db.read())

    def missions_of(self, robot_id: int) -> list[Mission]:
        """Those that can be started on this robot."""
        return self._missions.available_on(self._db.read(), robot_id)

    def schedules(self) -> list[Schedule]:
        """In order of name; without single starts that were moved, which are of one of these."""
        return [schedule for schedule in self._schedules.all(self._db.read()) if schedule.moved_of is None]

    def moved_away(self) -> set[Skip]:
        """Starts of schedules that were moved and are still to come, by where they were."""
        found = (each for each in self._schedules.all(self._db.read()) if each.enabled and each.next_at is not None)
        return {(each.moved_of, each.moved_from) for each in found if each.moved_of and each.moved_from}

    def schedule(self, schedule_id: int) -> Schedule | None:
        """Also a single start that was moved."""
        return self._schedules.get(self._db.read(), schedule_id)

    def refused(self) -> dict[int, InvalidInput]:
        """By schedule that has starts, also single ones that were moved: why each robot that may get them would refuse their values, by
        what it has said itself."""
        if (parameters := self.parameters) is None:
            return {}
        c = self._db.read()
        runners = parameter_check.Runners(c)
        ahead = (schedule for schedule in self._schedules.all(c) if schedule.enabled and schedule.next_at is not None)
        found = {each.id: runners.refused(each, lambda robot, guid: parameters.known(robot.id, guid)) for each in ahead}
        return {number: problem for number, problem in found.items() if problem is not None}

    def day_exceptions(self) -> list[DayException]:
        """Days off and extra working days."""
        return self._calendar.all(self._db.read())

    def settings(self) -> Settings:
        return SettingsRepository().load(self._db.read())

    def runs_beyond(self, limit: int) -> int:
        """How many runs would be deleted if the history had this limit; 0 when it is not lower than the present one."""
        present = self.settings().history_limit
        surplus = ExecutionHistory().surplus(self._db.read(), limit)
        return sum(surplus) if present is None or limit < present else 0

    # ------------------------------------------------------------------ changing
    def edit(self, work: Callable[[Edit], T]) -> T:
        """Several changes in one transaction: all of them, or none when ``work`` raises."""
        edits = list[Edit]()

        def transaction(c: Any) -> T:
            edits[:] = [Edit(c, self._clock.now())]  # the last one, where the transaction has to be repeated
            return work(edits[0])

        result = self._db.write(transaction)
        self._publish(edits[0])
        return result

    def change(self, before: T | None, after: T, **how: Any) -> T:
        """Write what differs between the two to the fleet, robot, group, place, mission, schedule or day as it is stored now:
        of two changes at the same time both stay. Without one ``before`` it is added. ``how`` a robot or fleet is saved: as in
        ``save_robot``, ``save_fleet``. Returns it as it is then."""
        if isinstance(after, Schedule) and (before is None or isinstance(before, Schedule)):
            self._check_parameters(after, before)
        return self.edit(lambda edit: undo.change(edit, before, after, **how))

    def change_back(self, before: T, changed: T) -> T:
        """Undo that ``before`` became ``changed``, and nothing else. Raises InvalidInput if one of these fields was
        changed again since, or it was deleted."""
        return self.edit(lambda edit: undo.change(edit, changed, before, must_be_unchanged=True))

    def try_out(self, work: Callable[[Edit], T]) -> T:
        """What ``work`` would return: nothing is changed, and others keep writing."""
        try:
            with closing(copy_in_memory(self._db.read())) as copy:
                return work(Edit(copy, self._clock.now()))
        except sqlite3.Error as error:
            known = self._db.known(error)
            raise known from (error if known is not error else None)

    def _publish(self, edit: Edit) -> None:
        for line in edit.notes[:MOST_NOTES]:
            log.info("%s", line)
        if (more := len(edit.notes) - MOST_NOTES) > 0:
            log.info("and %d more changes", more)
        if self._changes is not None:
            for topic in sorted(edit.topics):
                self._changes.publish(topic)

    def change_settings(self, **changes: Any) -> Settings:
        """Settings by name, as in ``Settings``; returns all of them."""
        return self.edit(lambda edit: settings_edit.change(edit, **changes))

    def guess_zone_again(self, zone: str) -> None:
        """Undo a person's choice of the time zone (``zone`` was the guess): an alarm asks for it again. Raises
        InvalidInput."""

        def work(edit: Edit) -> None:
            settings_edit.change(edit, timezone=zone)
            zones.ask_for_zone(edit)

        self.edit(work)

    def steps_left_out(self) -> frozenset[str]:
        """Of the set-up, those that somebody does not want."""
        return frozenset(SettingsRepository().get(self._db.read(), STEPS_LEFT_OUT, ()))

    def leave_out(self, step: str, *, wanted: bool = False) -> None:
        """A step of the set-up, or have it back if it is ``wanted``."""
        left_out = self.steps_left_out() - {step} | (frozenset() if wanted else {step})
        self._db.write(lambda c: SettingsRepository().put(c, STEPS_LEFT_OUT, sorted(left_out)))

    # ------------------------------------------------------------------ days off and extra working days
    def save_days(self, exception: DayException) -> DayException:
        """Add (id 0) or change days off or extra working days; they take precedence over the days of the week."""
        return self.edit(lambda edit: settings_edit.save_days(edit, [exception]))[0]

    def remove_days(self, *ids: int) -> Removed:
        """``restore`` puts them back."""
        return self.edit(lambda edit: settings_edit.remove_days(edit, ids))

    def set_public_holidays(self, country: str, subdivision: str = "") -> Settings:
        """Close on the public holidays of a country (ISO 3166 code) and of a region of it; empty: none."""
        # Here, because it reads a large library, during which others want to write.
        public_holidays.check(country, subdivision)
        return self.change_settings(holiday_country=country, holiday_subdivision=subdivision)

    # ------------------------------------------------------------------ robots
    def save_robot(self, robot: Robot, password: str | None = None, *, is_tested: bool = False) -> Robot:
        """Add (id 0) or change a robot. Without a password it keeps its token; a new one, or one whose user, address, certificate or serial
        number changes, is then switched off and needs a password. ``is_tested``: its model, software and what identified it come from a
        test of the connection just now; otherwise those of a known robot stay."""
        return self.edit(lambda edit: robot_edit.save(edit, robot, password, is_tested=is_tested))

    def remove_robot(self, robot_id: int) -> Removed:
        """With everything planned on it; ``restore`` puts all that back."""
        return self.edit(lambda edit: robot_edit.remove(edit, robot_id))

    def save_fleet(self, fleet: Fleet, password: str | None = None) -> Fleet:
        """Add (id 0) or change a fleet, and with it all of its robots; as ``save_robot``. The ``password`` of Fleet
        Enterprise is an API key."""
        return self.edit(lambda edit: fleet_edit.save(edit, fleet, password))

    def note_fleet(self, asked: Fleet, identity: str | None, software: str | None) -> None:
        """What a fleet said of itself when it was asked. A known identity stays."""
        if (asked.identity or identity, software) == (asked.identity, asked.software):
            return
        is_noted = self._db.write(lambda c: FleetRepository().note_identity(c, asked, identity, software))
        if is_noted and self._changes is not None:
            self._changes.publish(Topic.ROBOTS)

    def remove_fleet(self, fleet_id: int) -> Removed:
        """With its robots and everything planned on them; ``restore`` puts all that back."""
        return self.edit(lambda edit: fleet_edit.remove(edit, fleet_id))

    def change_idle_rule(self, robot_id: int, **changes: Any) -> Robot:
        """The robot's idle automation, which mission after how many minutes (5–30): change the stored rule, or add a
        new one, which needs a mission."""

        def work(edit: Edit) -> Robot:
            before = edit.the(Robot, robot_id).idle
            saved = robot_edit.set_idle_rule(edit, robot_id, replace(before or IdleRule(0), **changes))
            if saved.idle is not None and parameter_check.is_mission_new(saved.idle, before):
                _raise(parameter_check.of_idle_rule(edit, saved, saved.idle, self.known_parameters))
            return saved

        return self.edit(work)

    def idle_rule_back(self, robot_id: int, before: IdleRule | None, changes: Mapping[str, Any]) -> Robot:
        """Undo that these fields of the rule were changed. Raises InvalidInput if one of them was changed again since."""
        return self.edit(lambda edit: undo.idle_rule_back(edit, robot_id, before, changes))

    def known_parameters(self, robot: Robot, guid: str) -> Sequence[MissionParameter] | None:
        """A mission's parameters, as reported by this robot or else another one."""
        return None if self.parameters is None else self.parameters.known_from_any(robot.id, guid)

    # ------------------------------------------------------------------ groups and places
    def save_group(self, group: Group) -> Group:
        """Add (id 0) or change a group of robots."""
        return self.edit(lambda edit: group_edit.save(edit, group))

    def remove_group(self, group_id: int) -> Removed:
        """Delete it with its schedules and waiting starts; ``restore`` undoes all of it."""
        return self.edit(lambda edit: group_edit.remove(edit, group_id))

    def save_place(self, place: Place) -> Place:
        """Add (id 0) or change a place for a limited number of missions at a time."""
        return self.edit(lambda edit: group_edit.save_place(edit, place))

    def remove_place(self, place_id: int) -> Removed:
        """``restore`` puts it back."""
        return self.edit(lambda edit: group_edit.remove_place(edit, place_id))

    # ------------------------------------------------------------------ missions
    def save_mission(self, mission: Mission) -> Mission:
        """Add (id 0) or change a mission."""
        return self.edit(lambda edit: mission_edit.save(edit, mission))

    def remove_mission(self, mission_id: int) -> Removed:
        """With the schedules and idle rules that use it; ``restore`` puts all that back."""
        return self.edit(lambda edit: mission_edit.remove(edit, mission_id))

    # ------------------------------------------------------------------ schedules
    def save_schedule(self, schedule: Schedule) -> Schedule:
        """Add (id 0) or change a schedule; a blank name becomes "<mission> on <robot>". Parameters are checked by what
        is known of the mission; callers that may ask robots do so before."""
        self._check_parameters(schedule, self.schedule(schedule.id) if schedule.id else None)
        return self.edit(lambda edit: schedule_edit.save(edit, schedule))

    def _check_parameters(self, schedule: Schedule, before: Schedule | None) -> None:
        parameters = checks.parameters(schedule.parameters)
        if self.parameters is not None and parameter_check.needs_check(
            replace(schedule, parameters=parameters), before
        ):
            _raise(parameter_check.Runners(self._db.read()).check(schedule, self.known_parameters))

    def switch_schedule(self, schedule_id: int, on: bool) -> Changed:
        """Switch it on or off, which cancels what waits of it; ``undo_change`` undoes that."""

        def work(edit: Edit) -> Changed:
            schedule = edit.the(Schedule, schedule_id)
            return undo.change_schedule(edit, schedule, replace(schedule, enabled=on))

        return self.edit(work)

    def change_schedule(self, before: Schedule, after: Schedule) -> Changed:
        """Write what differs between the two, as ``change`` does; ``undo_change`` undoes it."""
        self._check_parameters(after, before)
        return self.edit(lambda edit: undo.change_schedule(edit, before, after))

    def undo_change(self, changed: Changed) -> Schedule:
        """As the schedule was before, except for what others have changed since; what it would have started until now is due again,
        unless it is too late or a later one was sent or ended since. Raises InvalidInput where the same was changed again."""
        return self.edit(lambda edit: undo.undo_change(edit, changed))

    def remove_schedule(self, schedule_id: int) -> Removed:
        """Off at once; ``restore`` puts it back."""
        return self.edit(lambda edit: schedule_edit.remove(edit, schedule_id))

    def restore(self, removed: Removed) -> None:
        """Undo a deletion; raises InvalidInput when one of its names, or the robot's address, is taken now."""
        self.edit(lambda edit: undo.restore(edit, removed))

    def wait_again(self, execution_id: int) -> None:
        """Undo a person's cancellation of a start that was never sent; raises InvalidInput if it is too late."""
        self.edit(lambda edit: undo.wait_again(edit, execution_id))


def _raise(checked: parameter_check.Checked) -> None:
    if checked.problem is not None:
        raise checked.problem
