"""New conflicts of an unsaved schedule: those of the plan with its next starts, without those that exist already.
Considers the schedules with which it shares a robot, a group or a place."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator, Sequence
from datetime import datetime
from functools import cache

from app.database.groups import GroupRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository, Skip
from app.domain.conflicts import ConflictCode
from app.domain.execution import DurationEstimate
from app.domain.models import Group, Mission, Robot, Schedule
from app.services.planning.conflicts import (
    HOUR,
    Resource,
    Shared,
    critical_behind,
    crowded_hours,
    late_because_of,
    resources,
)
from app.services.planning.durations import MissionDurations
from app.services.planning.occupancy import Occupancy
from app.services.planning.overlaps import Neighbours, neighbours
from app.services.planning.planned import Conflict, PlannedRun, planned_run
from app.services.planning.recurrence import Occurrence
from app.services.planning.working_days import WorkingCalendar


class DraftConflicts:
    """``starts``: its next ones, earliest first. ``on_its_robot``: for each of them, other runs on its robot; empty if
    any of several robots may take it."""

    def __init__(
        self,
        c: sqlite3.Connection,
        durations: MissionDurations,
        draft: Schedule,
        target: Robot | Group,
        mission: Mission,
        usual: DurationEstimate | None,
        starts: Sequence[Occurrence],
        calendar: WorkingCalendar,
        skips: Collection[Skip],
    ) -> None:
        self._c, self._durations, self._draft = c, durations, draft
        self._robots = {robot.id: robot for robot in RobotRepository().all(c)}
        self._groups = {group.id: group for group in GroupRepository().all(c)}
        self._robot = self._only_robot(target)
        self._shared = self._shared_with(mission)
        self._near = neighbours(starts, usual, self._others(), calendar, skips)
        self._own = [planned_run(start.instant, draft, target, mission, usual) for start in starts]
        self.on_its_robot: list[Neighbours] = [
            [run for run in near if self._is_on_its_robot(run.schedule)] for near in self._near
        ]
        self._if_slow = cache(self._occupancies_if_slow)

    # ------------------------------------------------------------------ what it shares, and with whom
    def _only_robot(self, target: Robot | Group) -> Robot | None:
        """None if any of several may take it."""
        if isinstance(target, Robot):
            return None if target.is_any else target
        usable = self._usable(target)
        return self._robots[usable[0]] if len(usable) == 1 else None

    def _usable(self, group: Group) -> list[int]:
        return [robot_id for robot_id in group.members if self._robots[robot_id].enabled]

    def _is_on_its_robot(self, other: Schedule) -> bool:
        if self._robot is None:
            return False
        return other.robot_id == self._robot.id or other.group_id == self._draft.group_id is not None

    def _shared_with(self, mission: Mission) -> Shared:
        groups = {
            group.id: (group, self._usable(group))
            for group in self._groups.values()
            if group.id == self._draft.group_id or self._draft.robot_id in group.members
        }
        return Shared(groups, [(place, names) for place, names in self._durations.places() if mission.name in names])

    def _others(self) -> Iterator[PlannedRun]:
        """The next future run of each enabled schedule, except the one that the draft replaces."""
        repository = ScheduleRepository()
        robots = {robot_id for _group, usable in self._shared.groups.values() for robot_id in usable}
        if self._robot is not None:
            robots.add(self._robot.id)
        names = {name for _place, missions in self._shared.places for name in missions}
        missions = [mission.id for mission in self._durations.missions.values() if mission.name in names]
        found = [repository.for_robot(self._c, robot_id) for robot_id in sorted(robots)]
        found += [repository.for_group(self._c, group_id) for group_id in self._shared.groups]
        found += [repository.for_mission(self._c, mission_id) for mission_id in missions]
        for schedule in {schedule.id: schedule for schedules in found for schedule in schedules}.values():
            if schedule.enabled and schedule.next_at is not None and schedule.id != self._draft.id:
                mission, target = self._durations.missions[schedule.mission_id], self._target(schedule)
                usual = self._durations.usual_on(target, mission)
                yield planned_run(schedule.next_at, schedule, target, mission, usual)

    def _target(self, schedule: Schedule) -> Robot | Group:
        robot_id, group_id = schedule.robot_id, schedule.group_id
        return self._robots[robot_id] if robot_id is not None else self._groups[group_id or 0]

    # ------------------------------------------------------------------ conflicts
    def behind(self) -> Iterator[Conflict]:
        """For each start, the first other one that delays it, or is delayed by it, on its only robot."""
        for own, near in zip(self._own, self.on_its_robot, strict=True):
            runs = sorted([*near, own], key=lambda run: run.at)
            for earlier, later in late_because_of(runs, self._shared):
                if self._robot is not None and (earlier is own or later is own):
                    other = later if earlier is own else earlier
                    yield critical_behind(earlier, later, self._robot.name, other.schedule.id)
                    break

    def of_resources(self) -> Iterator[Conflict]:
        """Starts for which a group has too few robots or a place no room, and hours in which a place is in use too
        much."""
        with_it = [resources([*near, own], self._shared) for near, own in zip(self._near, self._own, strict=True)]
        for number, each in enumerate(zip(*with_it, strict=True)):
            yield from self._overloads(number, each)
            if each[0].code is ConflictCode.PLACE_FULL:
                yield from self._crowded_hour(each)

    def _overloads(self, number: int, with_it: Sequence[Resource]) -> Iterator[Conflict]:
        for near, own, resource in zip(self._near, self._own, with_it, strict=True):
            overload = Occupancy(resource.spans).first_overload(resource.room, own.at, own.ends)
            if overload is not None:
                without = list(resources(near, self._shared))[number]
                if Occupancy(without.spans).at(overload.at) < overload.number:
                    yield resource.conflict(overload, overload.until)

    def _crowded_hour(self, places: Sequence[Resource]) -> Iterator[Conflict]:
        """The first; other days are alike."""
        for own, place in zip(self._own, places, strict=True):
            for hour in crowded_hours(place):
                if hour.at <= own.at < hour.at + HOUR:
                    yield hour
                    return

    def has_room(self, number: int, begins: datetime, ends: datetime) -> bool:
        """Whether that start could be then, as far as groups and places are concerned, though others take long."""
        return all(occupancy.most(begins, ends) < room for room, occupancy in self._if_slow(number))

    def _occupancies_if_slow(self, number: int) -> list[tuple[int, Occupancy]]:
        slow = resources(self._near[number], self._shared, slow=True)
        return [(resource.room, Occupancy(resource.spans)) for resource in slow]
