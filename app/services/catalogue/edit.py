"""One transaction's worth of changes of the plan: what there is, and what follows from a change of it.

``app.services.catalogue.catalogue`` opens and commits it, the modules ``…_edit`` change robots, missions, schedules and settings in it; the
import of a configuration does many in one.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any, TypeVar

from app.database.alarms import AlarmRepository
from app.database.executions import ExecutionRepository
from app.database.fleets import FleetRepository
from app.database.groups import GroupRepository, PlaceRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import CalendarRepository, SettingsRepository
from app.database.table import Table
from app.domain import names
from app.domain.execution import Execution, Reason, ReasonCode
from app.domain.models import DayException, Fleet, Group, InvalidInput, Mission, Place, Robot, Schedule, existing
from app.services.catalogue import validation
from app.services.executions import transitions
from app.services.executions.apply import apply_in
from app.services.executions.transitions import NOT_WITH_THE_ROBOT, Transition
from app.services.live.alarms import alarm_of
from app.services.live.changes import Topic
from app.services.planning.working_days import WorkingCalendar, working_calendar

T = TypeVar("T")
KINDS: Mapping[type, str] = {  # as refusals name their fields
    Fleet: "fleet",
    Robot: "robot",
    Group: "group",
    Place: "place",
    Mission: "mission",
    Schedule: "schedule",
    DayException: "days",
}
_OF_A_MACHINE = ("address", "serial_number")
SENTENCES: Mapping[type, str] = {
    Fleet: "this fleet no longer exists",
    Robot: "this robot no longer exists",
    Group: "this group no longer exists",
    Place: "this place no longer exists",
    Mission: "this mission no longer exists",
    Schedule: "this schedule no longer exists",
    DayException: "this entry of the calendar no longer exists",
}


@dataclass(frozen=True)
class Removed:
    """What one deletion has hidden, by kind and ids, and the starts that it ended, as they were: ``Catalogue.restore`` puts all that
    back."""

    at: datetime
    ids: Mapping[type, Sequence[int]]
    made_names: Collection[int] = ()  # ids of those schedules whose names say what they do where
    starts: Sequence[Execution] = ()
    token: str | None = field(default=None, repr=False)  # of the robot or fleet: here only, until it is put back


@dataclass
class Edit:
    """One transaction of the database, opened and committed by the caller: the present rows, and the changed ones."""

    c: sqlite3.Connection
    now: datetime
    topics: set[Topic] = field(default_factory=set)  # what changed, to be published after the commit
    notes: list[str] = field(default_factory=list)  # the same in lines for the log
    known_calendar: WorkingCalendar | None = None  # until a day changes
    untried_names: dict[tuple[str, str], Iterator[str]] = field(default_factory=dict)  # by mission and robot

    def __post_init__(self) -> None:
        self.robots, self.missions, self.schedules = RobotRepository(), MissionRepository(), ScheduleRepository()
        self.executions, self.stored_settings = ExecutionRepository(), SettingsRepository()
        self.fleets, self.groups, self.places = FleetRepository(), GroupRepository(), PlaceRepository()
        self.days, self.alarms = CalendarRepository(), AlarmRepository()
        self.tables: Mapping[type, Table[Any]] = {
            Fleet: self.fleets,
            Robot: self.robots,
            Group: self.groups,
            Place: self.places,
            Mission: self.missions,
            Schedule: self.schedules,
            DayException: self.days,
        }
        self.settings = self.stored_settings.load(self.c)

    @property
    def calendar(self) -> WorkingCalendar:
        """The working days, changes of this transaction included."""
        if self.known_calendar is None:
            self.known_calendar = working_calendar(self.c, self.settings)
        return self.known_calendar

    def the(self, kind: type[T], id_: int) -> T:
        """The one with this id. Raises InvalidInput where it was removed."""
        gone = SENTENCES[kind]
        found: T = existing(self.tables[kind].get(self.c, id_), KINDS[kind], gone)
        return found

    def target_of(self, schedule: Schedule) -> Robot | Group:
        """The robot that a schedule names, or its group."""
        if schedule.group_id is not None and schedule.robot_id is None:
            return self.the(Group, schedule.group_id)
        if schedule.robot_id is not None and schedule.group_id is None:
            return self.the(Robot, schedule.robot_id)
        raise InvalidInput("robot", "choose a robot, or a group of robots")

    def mission_on(self, robot_id: int, mission_id: int) -> Mission:
        """The mission of that name on that robot."""
        mission = self.the(Mission, mission_id)
        meant = self.missions.for_robot(self.c, mission.name, robot_id)
        return existing(meant, "mission", "the mission {name} is for another robot only", name=mission.name)

    def mission_for(self, target: Robot | Group, mission_id: int) -> Mission:
        """The mission of that name on that robot; for a group the one for all robots; each robot then uses its own of
        that name."""
        if isinstance(target, Robot):
            return self.mission_on(target.id, mission_id)
        mission = self.the(Mission, mission_id)
        return existing(
            self.missions.by_name(self.c, mission.name),
            "mission",
            "the mission {name} is for one robot only, a group needs one for all robots",
            name=mission.name,
        )

    def has_generated_name(self, schedule: Schedule) -> bool:
        mission, target = self.the(Mission, schedule.mission_id), self.target_of(schedule)
        return names.is_generated(schedule.name, mission.name, target.name)

    def with_moved(self, schedules: Iterable[Schedule]) -> list[Schedule]:
        """These, and their starts that a person moved."""
        return [each for one in schedules for each in (one, *self.schedules.moved_starts(self.c, one.id))]

    def check_is_no_other(self, it: Robot | Fleet, before: Robot | Fleet | None = None) -> None:
        """Check that a machine is not configured twice. Duplicates stored by an older version can still be changed."""
        if before is None or any(getattr(it, name, None) != getattr(before, name, None) for name in _OF_A_MACHINE):
            validation.check_is_no_other(it, [*self.fleets.all(self.c), *self.robots.all(self.c)])

    def note(self, line: str, *topics: Topic) -> None:
        """What is changed: for the log, and for those who show it."""
        self.notes.append(line)
        self.topics.update(topics)

    # ------------------------------------------------------------------ what follows from a change
    def hide(self, removed: Removed, schedules: Sequence[Schedule] = ()) -> Removed:
        """Hide what is named by its ids, and these schedules with it."""
        made_names = {schedule.id for schedule in schedules if self.has_generated_name(schedule)}
        ids = {**removed.ids, Schedule: sorted(schedule.id for schedule in schedules)}
        for kind in ids:
            for id_ in ids[kind]:
                self.tables[kind].remove(self.c, id_, removed.at)
        return replace(removed, ids=ids, made_names=made_names)

    def purge(self) -> None:
        """Finally delete what was removed. Only when the app starts: what it can undo is in its memory."""
        for table in self.tables.values():
            table.purge(self.c)

    def note_password(self, entered: Robot | Fleet, before: Robot | Fleet, key: str, **details: object) -> None:
        """An alarm while one that was in use lacks its password."""
        if entered.needs_password and before.enabled:
            details = {"robot": entered.name, **details}
            self.alarms.raise_once(self.c, alarm_of("needs_password", key, self.now, details))
            self.topics.add(Topic.ALARMS)
        elif before.needs_password and not entered.needs_password:
            self.end_alarm("needs_password", key)

    def end_alarm(self, code: str, key: str) -> None:
        if self.alarms.clear(self.c, code, key, self.now):
            self.topics.add(Topic.ALARMS)

    def apply(self, found: Iterable[Transition]) -> list[Execution]:
        """Returns the rows after those that could be made."""
        rows = [row for each in found if (row := apply_in(self.c, each, self.now)) is not None]
        if rows:
            self.topics.add(Topic.EXECUTIONS)
        return rows

    def withdraw(self, rows: Iterable[Execution], reason: Reason) -> list[Execution]:
        """Withdraw starts of these that no robot has yet; returns the waiting ones, which have ended."""
        return [
            row for row in self.apply(transitions.withdraw(row, reason) for row in rows) if row.ended_at is not None
        ]

    def end_starts_of(self, schedules: Sequence[Schedule]) -> list[Execution]:
        """Of schedules that are deleted; returns what was open of them."""
        starts = self.open_of(schedules)
        for each in schedules:
            self.withdraw_all(each, "deleted")
        return starts

    def withdraw_all(self, schedule: Schedule, was: str, kept: Collection[int] = ()) -> list[Execution]:
        """The same for a schedule that ``was`` "deleted", "switched_off" or "changed", except ``kept`` ones."""
        rows = [row for row in self.unsent_of([schedule]) if row.id not in kept]
        return self.withdraw(rows, Reason(ReasonCode.SCHEDULE_CHANGED, {was: True}))

    def unsent_of(self, schedules: Sequence[Schedule]) -> list[Execution]:
        """Starts of these that no robot has yet, as far as known."""
        return [
            row
            for schedule in schedules
            for row in self.executions.open_of_schedule(self.c, schedule.id, NOT_WITH_THE_ROBOT)
        ]

    def open_of(self, schedules: Sequence[Schedule]) -> list[Execution]:
        """What is not over of these."""
        return [row for schedule in schedules for row in self.executions.open_of_schedule(self.c, schedule.id)]
