"""One transaction's worth of changes of the plan: what there is, and what follows from a change of it.

``app.services.catalogue.catalogue`` opens and commits it, the modules ``…_edit`` change robots, missions, schedules and settings in it; the
import of a configuration does many in one.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime

from app.database.alarms import AlarmRepository
from app.database.executions import ExecutionRepository
from app.database.fleets import FleetRepository
from app.database.groups import GroupRepository, PlaceRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import CalendarRepository, SettingsRepository
from app.domain import names
from app.domain.execution import Execution, Reason, ReasonCode
from app.domain.models import DayException, Fleet, Group, InvalidInput, Mission, Place, Robot, Schedule, existing
from app.services.executions import transitions
from app.services.executions.apply import apply_in
from app.services.executions.transitions import NOT_WITH_THE_ROBOT, Transition
from app.services.live.changes import Topic
from app.services.planning.working_days import WorkingCalendar, working_calendar


@dataclass(frozen=True)
class Removed:
    """What one deletion has hidden, by ids, and the starts that it ended, as they were: ``Catalogue.restore`` puts all that back."""

    at: datetime
    fleets: Sequence[int] = ()
    robots: Sequence[int] = ()
    groups: Sequence[int] = ()
    places: Sequence[int] = ()
    missions: Sequence[int] = ()
    schedules: Sequence[int] = ()
    days: Sequence[int] = ()
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
        self.settings = self.stored_settings.load(self.c)

    @property
    def calendar(self) -> WorkingCalendar:
        """The working days, changes of this transaction included."""
        if self.known_calendar is None:
            self.known_calendar = working_calendar(self.c, self.settings)
        return self.known_calendar

    def the_robot(self, robot_id: int) -> Robot:
        return existing(self.robots.get(self.c, robot_id), "robot", "this robot no longer exists")

    def the_fleet(self, fleet_id: int) -> Fleet:
        return existing(self.fleets.get(self.c, fleet_id), "fleet", "this fleet no longer exists")

    def the_group(self, group_id: int) -> Group:
        return existing(self.groups.get(self.c, group_id), "group", "this group no longer exists")

    def target_of(self, schedule: Schedule) -> Robot | Group:
        """The robot that a schedule names, or its group."""
        if schedule.group_id is not None and schedule.robot_id is None:
            return self.the_group(schedule.group_id)
        if schedule.robot_id is not None and schedule.group_id is None:
            return self.the_robot(schedule.robot_id)
        raise InvalidInput("robot", "choose a robot, or a group of robots")

    def the_place(self, place_id: int) -> Place:
        return existing(self.places.get(self.c, place_id), "place", "this place no longer exists")

    def the_mission(self, mission_id: int) -> Mission:
        return existing(self.missions.get(self.c, mission_id), "mission", "this mission no longer exists")

    def the_schedule(self, schedule_id: int) -> Schedule:
        return existing(self.schedules.get(self.c, schedule_id), "schedule", "this schedule no longer exists")

    def the_days(self, id_: int) -> DayException:
        return existing(self.days.get(self.c, id_), "days", "this entry of the calendar no longer exists")

    def mission_on(self, robot_id: int, mission_id: int) -> Mission:
        """The mission of that name on that robot."""
        mission = self.the_mission(mission_id)
        meant = self.missions.for_robot(self.c, mission.name, robot_id)
        if meant is None:
            raise InvalidInput("mission", "the mission {name} is for another robot only", name=mission.name)
        return meant

    def mission_for(self, target: Robot | Group, mission_id: int) -> Mission:
        """The mission of that name on that robot; for a group the one for all robots; each robot then uses its own of
        that name."""
        if isinstance(target, Robot):
            return self.mission_on(target.id, mission_id)
        mission = self.the_mission(mission_id)
        meant = self.missions.by_name(self.c, mission.name)
        if meant is None:
            raise InvalidInput(
                "mission",
                "the mission {name} is for one robot only, a group needs one for all robots",
                name=mission.name,
            )
        return meant

    def has_generated_name(self, schedule: Schedule) -> bool:
        mission, target = self.the_mission(schedule.mission_id), self.target_of(schedule)
        return names.is_generated(schedule.name, mission.name, target.name)

    def with_moved(self, schedules: Iterable[Schedule]) -> list[Schedule]:
        """These, and their starts that a person moved."""
        return [each for one in schedules for each in (one, *self.schedules.moved_starts(self.c, one.id))]

    # ------------------------------------------------------------------ what follows from a change
    def hide(self, removed: Removed, schedules: Sequence[Schedule] = ()) -> Removed:
        """Hide what is named by its ids, and these schedules with it."""
        made_names = {schedule.id for schedule in schedules if self.has_generated_name(schedule)}
        removed = replace(removed, schedules=sorted(schedule.id for schedule in schedules), made_names=made_names)
        for table, ids in (
            (self.fleets, removed.fleets),
            (self.robots, removed.robots),
            (self.groups, removed.groups),
            (self.places, removed.places),
            (self.missions, removed.missions),
            (self.schedules, removed.schedules),
            (self.days, removed.days),
        ):
            for id_ in ids:
                table.remove(self.c, id_, removed.at)
        return removed

    def purge(self) -> None:
        """Finally delete what was removed. Only when the app starts: what it can undo is in its memory."""
        for table in (self.fleets, self.robots, self.groups, self.places, self.missions, self.schedules, self.days):
            table.purge(self.c)

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
