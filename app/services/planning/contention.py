"""What a schedule that is not saved yet would have to share, and whether there is room: the robots of a group, and places."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from app.database.groups import GroupRepository, PlaceRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository, Skip
from app.domain.conflicts import ConflictCode
from app.domain.models import DurationEstimate, Group, Mission, Place, Robot, Schedule
from app.services.planning.crowds import CROWDED, HOUR, Demand, Span, joined, load
from app.services.planning.durations import MissionDurations
from app.services.planning.overlaps import ASSUMED_S, Neighbours, OtherSchedule, lasts, neighbours
from app.services.planning.planned import Conflict
from app.services.planning.recurrence import Occurrence
from app.services.planning.working_days import WorkingCalendar

NINE_OF_TEN = 0.9
_Wanting = Callable[
    [int, Span | None, bool], list[Span]
]  # number of a start, the draft's own run, whether runs are slow


@dataclass(frozen=True)
class _Room:
    """Robots of a group or a place, with room for so many. ``spans``: when others, and the draft where it is given, want it near a start,
    by its number. ``slowly``: when others do near each, if each run takes what nine of ten stay under."""

    code: ConflictCode
    most: int
    details: Mapping[str, Any]
    spans: _Wanting
    slowly: Sequence[Demand]


class Contention:
    def __init__(
        self,
        c: sqlite3.Connection,
        durations: MissionDurations,
        draft: Schedule,
        mission: Mission | None,
        usual: DurationEstimate | None,
        starts: Sequence[Occurrence],
        calendar: WorkingCalendar,
        skips: Collection[Skip],
    ) -> None:
        self._c, self._durations, self._draft, self._mission, self._usual = c, durations, draft, mission, usual
        self._starts, self._calendar, self._skips = starts, calendar, skips
        self._schedules = ScheduleRepository()
        self._robots = {robot.id: robot for robot in RobotRepository().all(c)}
        self._groups = {group.id: group for group in GroupRepository().all(c)}
        self._lasts = timedelta(seconds=usual.median_s if usual else ASSUMED_S)
        self._rooms: list[_Room] = []
        self._of_robot, self._of_group = dict[int, list[Neighbours]](), dict[int, list[Neighbours]]()
        self._joined = dict[tuple[int, int, bool], list[Span]]()

    # ------------------------------------------------------------------ one robot
    def of_its_robot(self) -> list[Neighbours]:
        """Neighbours each start: what others want of its robot; nothing where any of several may take it."""
        if (robot := self._only_robot()) is None:
            return [() for _ in self._starts]
        near = self._near_robot(robot.id)
        if self._draft.group_id is None:
            return near
        return [
            (*of_robot, *of_group)
            for of_robot, of_group in zip(near, self._near_group(self._draft.group_id), strict=True)
        ]

    def _near_robot(self, robot_id: int) -> list[Neighbours]:
        """It may be in many groups."""
        if (found := self._of_robot.get(robot_id)) is None:
            found = self._of_robot[robot_id] = self._near(self._schedules.for_robot(self._c, robot_id))
        return found

    def _near_group(self, group_id: int) -> list[Neighbours]:
        if (found := self._of_group.get(group_id)) is None:
            found = self._of_group[group_id] = self._near(self._schedules.for_group(self._c, group_id))
        return found

    def _near(self, schedules: Iterable[Schedule]) -> list[Neighbours]:
        return neighbours(self._starts, self._usual, self._others(schedules), self._calendar)

    def _spans_of_robot(self, robot_id: int, number: int, slow: bool, own: Span | None) -> list[Span]:
        """When it is wanted near a start, together with the draft's own run where that is on it."""
        key = robot_id, number, slow
        if (found := self._joined.get(key)) is None:
            found = self._joined[key] = list(joined(_spans(self._near_robot(robot_id)[number], slow)))
        return found if own is None or robot_id != self._draft.robot_id else list(joined([*found, own]))

    def _only_robot(self) -> Robot | None:
        if self._draft.robot_id is not None:
            return self._robots.get(self._draft.robot_id)
        usable = self._usable(self._groups.get(self._draft.group_id or 0))
        return self._robots[usable[0]] if len(usable) == 1 else None

    def _usable(self, group: Group | None) -> list[int]:
        return [robot_id for robot_id in group.members if self._robots[robot_id].enabled] if group else []

    def _others(self, schedules: Iterable[Schedule]) -> list[OtherSchedule]:
        """Those that are on and still to come, but for the one that the draft replaces."""
        found = []
        for schedule in schedules:
            mission = self._durations.missions[schedule.mission_id]
            target = self._robots.get(schedule.robot_id or 0) or self._groups.get(schedule.group_id or 0)
            if (
                schedule.enabled
                and schedule.next_at is not None
                and schedule.id != self._draft.id
                and target is not None
            ):
                found.append(
                    OtherSchedule(
                        schedule,
                        mission.name,
                        self._durations.usual_on(target, mission),
                        {at for skipped, at in self._skips if skipped == schedule.id},
                    )
                )
        return found

    def behind(self, near: Sequence[Neighbours]) -> Iterator[Conflict]:
        """A run that nine times of ten still goes on when one that matters more is planned on its only robot."""
        robot = self._only_robot()
        if robot is None or self._mission is None:
            return
        for start, others in zip(self._starts, near, strict=True):
            at, mine = start.instant, self._draft.priority
            for other, begins in sorted(others, key=lambda one: one[1]):
                theirs = other.schedule.priority
                first, gap = (self._usual, begins - at) if at < begins else (other.usual, at - begins)
                is_behind = (at < begins and mine < theirs) or (begins < at and theirs < mine)
                if is_behind and first is not None and first.share_over(gap.total_seconds()) >= NINE_OF_TEN:
                    names = (self._mission.name, other.mission) if at < begins else (other.mission, self._mission.name)
                    yield Conflict(
                        ConflictCode.CRITICAL_BEHIND,
                        min(at, begins),
                        {
                            "mission": names[0],
                            "behind": names[1],
                            "robot": robot.name,
                            "start": max(at, begins),
                            "schedule_id": other.schedule.id,
                        },
                    )
                    break

    # ------------------------------------------------------------------ robots of a group
    def too_few(self) -> Iterator[Conflict]:
        """More starts than robots, at a time at which this one wants one of them."""
        robot_id = self._draft.robot_id
        for group in self._groups.values():
            if group.id == self._draft.group_id or robot_id in group.members:
                yield from self._crowded(self._group_room(group))

    def _group_room(self, group: Group) -> _Room:
        usable = self._usable(group)
        of_group = self._near_group(group.id)

        def spans(number: int, own: Span | None, slow: bool) -> list[Span]:
            found = [span for robot_id in usable for span in self._spans_of_robot(robot_id, number, slow, own)]
            return [
                *found,
                *_spans(of_group[number], slow),
                *([] if own is None or self._draft.robot_id is not None else [own]),
            ]

        return self._room(
            ConflictCode.TOO_FEW_ROBOTS,
            len(usable),
            {"group": group.name, "group_id": group.id, "robots": len(usable)},
            spans,
        )

    # ------------------------------------------------------------------ places
    def places(self) -> Iterator[Conflict]:
        """Places that the mission uses, and that are full then, or wanted for most of an hour."""
        for place in PlaceRepository().all(self._c):
            names = {self._durations.missions[mission_id].name for mission_id in place.missions}
            if self._mission is not None and self._mission.name in names:
                same = [
                    schedule
                    for mission in self._durations.missions.values()
                    if mission.name in names
                    for schedule in self._schedules.for_mission(self._c, mission.id)
                ]
                yield from self._of_place(place, self._near(same))

    def _of_place(self, place: Place, near: Sequence[Neighbours]) -> Iterator[Conflict]:
        def spans(number: int, own: Span | None, slow: bool) -> list[Span]:
            return [*_spans(near[number], slow), *([] if own is None else [own])]

        yield from self._crowded(
            self._room(
                ConflictCode.PLACE_FULL,
                place.most,
                {"place": place.name, "place_id": place.id, "most": place.most},
                spans,
            )
        )
        for number, start in enumerate(self._starts):
            hour = start.instant.replace(minute=0, second=0, microsecond=0)
            share = load(spans(number, self._own(start), False), place.most, hour)
            if share > CROWDED:
                yield Conflict(
                    ConflictCode.PLACE_CROWDED,
                    hour,
                    {"place": place.name, "place_id": place.id, "until": hour + HOUR, "percent": round(100 * share)},
                )
                return  # other days are alike

    # ------------------------------------------------------------------ either
    def _room(self, code: ConflictCode, most: int, details: Mapping[str, Any], spans: _Wanting) -> _Room:
        room = _Room(
            code, most, details, spans, [Demand(spans(number, None, True)) for number in range(len(self._starts))]
        )
        self._rooms.append(room)
        return room

    def _own(self, start: Occurrence) -> Span:
        return Span(start.instant, start.instant + self._lasts)

    def _crowded(self, room: _Room) -> Iterator[Conflict]:
        """For each start, where it makes one too many."""
        for number, start in enumerate(self._starts):
            own = self._own(start)
            crowd = Demand(room.spans(number, own, False)).first_crowd(room.most, own.begins, own.ends)
            if crowd is not None and Demand(room.spans(number, None, False)).at(crowd.at) < crowd.number:
                yield Conflict(room.code, crowd.at, {**room.details, "starts": crowd.number, "until": crowd.until})

    def has_room(self, number: int, begins: datetime, ends: datetime) -> bool:
        """Whether that start could be then, as far as groups and places are concerned."""
        return all(room.slowly[number].most(begins, ends) < room.most for room in self._rooms)


def _spans(near: Neighbours, slow: bool) -> Iterator[Span]:
    for other, begins in near:
        long = lasts(other.usual) if slow else timedelta(seconds=other.usual.median_s if other.usual else ASSUMED_S)
        yield Span(begins, begins + long)
