"""Combines the forecast with the database: the robot that each planned start of a group will probably get."""

from __future__ import annotations

import sqlite3
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from math import inf
from zoneinfo import ZoneInfo

from app.database.activities import ActivityRepository
from app.database.executions import ExecutionRepository
from app.database.group_executions import GroupExecutionRepository
from app.database.robots import HoldRepository
from app.domain import rules
from app.domain.activity import is_at_work
from app.domain.clock import DAY, days_between, midnight
from app.domain.execution import Execution, State
from app.domain.models import Group, HandOver, Mission, Robot, Schedule, Settings
from app.services.allocation.choose import AHEAD
from app.services.allocation.situation import remaining_duration, run_duration
from app.services.planning.durations import LiveRobots, MissionDurations
from app.services.planning.forecast import ForecastSite, ForecastSlot, ForecastStart, forecast
from app.services.planning.planned import PlannedRun, copy_at


class GroupForecast:
    """``robots``: those that are switched on, by id. One that is silent or stopped at present is expected to stay so
    for some minutes. ``origin``: when the forecast begins, now or the midnight before the period, so that a start gets
    the same robot in any period."""

    def __init__(
        self,
        c: sqlite3.Connection,
        durations: MissionDurations,
        groups: Mapping[int, Group],
        robots: Mapping[int, Robot],
        settings: Settings,
        now: datetime,
        start: datetime,
        live: LiveRobots,
    ) -> None:
        self._c, self._durations, self._groups, self._robots = c, durations, groups, robots
        self._settings, self._now = settings, now
        self._zone, self._live = ZoneInfo(settings.timezone), live
        self.origin = max(now, midnight(start.astimezone(self._zone).date(), self._zone))
        self.members = {
            group.id: tuple(
                robot_id for robot_id in group.members if robot_id in robots and not robots[robot_id].needs_password
            )
            for group in groups.values()
        }
        self.shared = frozenset(robot_id for members in self.members.values() for robot_id in members)
        places = durations.places()
        self._room = {place.name: place.most for place, _missions in places}
        self._places = {  # by the names of missions
            name: tuple(place.name for place, missions in places if name in missions)
            for name in frozenset[str]().union(*(missions for _place, missions in places))
        }

    def lacks_mission(self, group: Group, mission: str) -> bool:
        """Whether it has usable robots, and none of them has that mission, as far as known."""
        members = self.members[group.id]
        return bool(members) and not any(self._durations.has(robot_id, mission) for robot_id in members)

    def affects(self, schedule: Schedule) -> bool:
        """Whether its starts use robots of a group, or a place."""
        return (
            schedule.group_id is not None
            or schedule.robot_id in self.shared
            or (bool(self._places) and self._durations.missions[schedule.mission_id].name in self._places)
        )

    def assign(self, runs: Sequence[PlannedRun], until: datetime) -> list[PlannedRun]:
        """The same runs, in order of time; those of groups before ``until`` with the robots that they will probably get."""
        numbers = [number for number, run in enumerate(runs) if run.at < until and self.affects(run.schedule)]
        waiting = list(self._waiting()) if self.origin == self._now else []
        starts = waiting + [self._forecast_start(runs[number]) for number in numbers]
        last = runs[-1].at if runs else self.origin
        found = forecast(starts, self._site(last))
        new = list(runs)
        likes: dict[tuple[int, int], PlannedRun] = {}
        for position, number in enumerate(numbers, len(waiting)):
            if runs[number].group is not None and (slot := found.get(position)) is not None and slot.in_time:
                new[number] = self._on(runs[number], slot, likes)
        return new

    def _on(self, run: PlannedRun, slot: ForecastSlot, likes: dict[tuple[int, int], PlannedRun]) -> PlannedRun:
        begins = max(run.at, self.origin + timedelta(seconds=slot.begins))
        key = run.schedule.id, slot.robot_id
        if (like := likes.get(key)) is None:
            mission = self._durations.mission(run.mission.name, slot.robot_id) or run.mission
            usual = self._durations.usual(slot.robot_id, mission) or run.usual
            likes[key] = like = replace(run, robot=self._robots[slot.robot_id], usual=usual)
        return copy_at(like, run.at, begins_at=begins, held=run.held)

    # ------------------------------------------------------------------ what the forecast rests on
    def _seconds(self, instant: datetime) -> float:
        return (instant - self.origin).total_seconds()

    def _forecast_start(self, run: PlannedRun) -> ForecastStart:
        schedule, at, mission = run.schedule, self._seconds(run.at), run.mission.name
        if run.group is None:
            places = self._places.get(mission, ())
            return ForecastStart(0, mission, (run.robot.id,), schedule.priority, at, places=places, is_fixed=True)
        closes = self._seconds(rules.closes_at(run.at, schedule.start_window_minutes, self._settings))
        finish = None if schedule.finish_by_minutes is None else at + schedule.finish_by_minutes * 60
        return self._of_group(run.group, mission, schedule.priority, at, closes, finish)

    def _waiting(self) -> Iterator[ForecastStart]:
        """What waits for a robot already."""
        for row in GroupExecutionRepository().unbound(self._c):
            if (
                (group := self._groups.get(row.group_id or 0)) is not None
                and not row.held
                and row.closes_at > self._now
            ):
                at, closes = self._seconds(row.planned_at), self._seconds(row.closes_at)
                finish = None if row.finish_by is None else self._seconds(row.finish_by)
                yield self._of_group(group, row.mission, row.priority, at, closes, finish)

    def _of_group(
        self, group: Group, mission: str, priority: int, at: float, closes: float, finish: float | None
    ) -> ForecastStart:
        is_at_once, places = group.hand_over is HandOver.AT_ONCE, self._places.get(mission, ())
        members, free = self.members[group.id], group.keep_free
        return ForecastStart(
            0, mission, members, priority, at, closes, finish, keep_free=free, at_once=is_at_once, places=places
        )

    def _site(self, last: datetime) -> ForecastSite:
        begin, end = (at.astimezone(self._zone).date() for at in (self.origin, last))
        days = [self._seconds(midnight(day, self._zone)) for day in days_between(begin + DAY, end)]
        is_now = self.origin == self._now
        busy, at_places = self._busy() if is_now else ({}, {})
        return ForecastSite(
            {robot_id: self._robots[robot_id].name for robot_id in self.shared},
            self._durations.duration,
            busy,
            self._hours() if is_now else {},
            self._held(),
            days,
            self._room,
            at_places,
        )

    def _busy(self) -> tuple[Mapping[int, float], Mapping[str, Sequence[float]]]:
        """Until when each robot is busy with the app's executions, and until when these need their places."""
        left, at_places = dict[int, float](), defaultdict[str, list[float]](list)
        for row in ExecutionRepository().open_all(self._c):
            if row.robot_id is not None and is_at_work(row, self._live.is_charging(row.robot_id)):
                left[row.robot_id] = left.get(row.robot_id, 0.0) + self._left(row, row.robot_id)
                for place in self._places.get(row.mission, ()):
                    at_places[place].append(left[row.robot_id])
        return left, at_places

    def _left(self, row: Execution, robot_id: int) -> float:
        usual = self._durations.usual(robot_id, Mission(row.mission, row.mission_guid))
        if row.state is State.EXECUTING and row.started_at is not None:
            return max(0.0, remaining_duration(usual, (self._now - row.started_at).total_seconds()))
        return run_duration(usual, None)

    def _hours(self) -> Mapping[int, float]:
        today = midnight(self._now.astimezone(self._zone).date(), self._zone)
        return ActivityRepository().hours_executing(self._c, today, self._now)

    def _held(self) -> Mapping[int, Sequence[tuple[float, float]]]:
        held = defaultdict[int, list[tuple[float, float]]](list)
        for robot_id in filter(self._live.is_unavailable, self.shared):
            held[robot_id].append((-inf, self._seconds(self._now) + AHEAD))
        for hold in HoldRepository().all(self._c):
            since = -inf if hold.since is None else self._seconds(hold.since)
            until = inf if hold.until is None else self._seconds(hold.until)
            for robot_id in self.shared if hold.robot_id is None else (hold.robot_id,):
                held[robot_id].append((since, until))
        return held
