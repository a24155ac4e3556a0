"""The plan: starts of all schedules in a period, the next few, and those of an unsaved schedule."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from datetime import datetime, timedelta
from itertools import chain, islice, takewhile

from app.database.connection import Database
from app.database.groups import GroupRepository
from app.database.missions import DurationRepository, MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository, Skip
from app.database.settings import SettingsRepository
from app.domain.clock import MOMENT, Clock
from app.domain.models import Group, Place, Robot, Schedule
from app.services.allocation.choose import AHEAD
from app.services.planning.conflicts import Shared, place_warning, plan_conflicts
from app.services.planning.durations import NO_LIVE_ROBOTS, LiveRobots, MissionDurations
from app.services.planning.group_forecast import GroupForecast
from app.services.planning.planned import Conflict, Planned, PlannedRun, copy_at, planned_run
from app.services.planning.recurrence import occurrences
from app.services.planning.working_days import working_calendar

MOST = 100_000  # occurrences in one span: what takes half a second and 30 MB
WEEK = timedelta(days=7)
LONGEST_RUN = timedelta(hours=12)  # of a run that is still under way when a span begins


class Plan:
    def __init__(self, db: Database, clock: Clock, live: LiveRobots = NO_LIVE_ROBOTS) -> None:
        self._db, self._clock, self._live = db, clock, live

    def between(self, start: datetime, end: datetime, most: int = MOST) -> Planned:
        """Occurrences of enabled schedules in [start, end), and before it those whose runs will still be under way
        then; nothing before now. Where there are more than ``most``, schedules with few keep all of theirs, and the
        others share the rest evenly: later ones get no robot of their group."""
        now = self._clock.now()
        start = max(start, now)
        reading = _Reading(self, start, now, end)
        forecast, last = reading.forecast, reading.before or end
        streams = [
            takewhile(lambda run: run.at < last, (run for run in stream if run.at >= now))
            for stream in reading.streams(start, now)
        ]
        runs, more = list[PlannedRun](), dict[int, datetime]()
        while streams and (share := (most - len(runs)) // len(streams)):
            taken = [(stream, list(islice(stream, share))) for stream in streams]
            runs += chain.from_iterable(found for _stream, found in taken)
            streams = [stream for stream, found in taken if len(found) == share]
        for further in filter(None, (next(stream, None) for stream in streams)):
            more[further.schedule.id] = further.at
        runs.sort(key=_order)
        known_until = min(more.values(), default=last)
        conflicts = reading.conflicts(runs, start, known_until)
        if forecast is not None:
            runs = [
                run
                for run in forecast.assign(runs, known_until)
                if run.at < end and (run.at >= start or _reaches(run, start))
            ]
        return Planned(
            tuple(runs),
            {key: at for key, at in more.items() if at < end},
            tuple(conflict for conflict in conflicts if conflict.at < end),
        )

    def until(self, end: datetime) -> Iterator[PlannedRun]:
        """Every occurrence from now on and before ``end``, in order, however many; those of groups without a robot."""
        now = self._clock.now()
        streams = _Reading(self, now, now, end).streams()
        return takewhile(lambda run: run.at < end, (run for run in heapq.merge(*streams, key=_order) if run.at >= now))

    def next(self, count: int) -> list[PlannedRun]:
        now = self._clock.now()
        reading = _Reading(self, now, now)
        ahead = heapq.merge(*reading.streams(), key=_order)
        runs = list(islice(ahead, count))
        if not runs or reading.forecast is None:
            return runs
        last = runs[-1].at + timedelta(seconds=AHEAD)
        return reading.forecast.assign([*runs, *takewhile(lambda run: run.at < last, ahead)], last)[:count]

    def place_warning(self, place: Place) -> Conflict | None:
        """The hour of the next week in which a place, saved or not, is used most, if for more than 70 % of it."""
        now = self._clock.now()
        names = {mission.name for mission in MissionRepository().all(self._db.read()) if mission.id in place.missions}
        return place_warning(self.between(now, now + WEEK).runs, place, names)

    def usual_durations(self) -> dict[str, float]:
        """By a mission's guid, in seconds, of those that have been run."""
        return DurationRepository().usual_of_all(self._db.read())

    def skips(self) -> set[Skip]:
        """Future starts that a person has skipped; not those that were moved."""
        c, schedules = self._db.read(), ScheduleRepository()
        return schedules.skips_from(c, self._clock.now()) - schedules.moved_away(c)


class _Reading:
    """The plan's rows in the database. ``before`` excludes schedules without a start until then; with groups it is a
    little later, as later starts may be more important."""

    def __init__(self, plan: Plan, start: datetime, now: datetime, before: datetime | None = None) -> None:
        self._c = c = plan._db.read()
        schedules = ScheduleRepository()
        self.before = before
        if before is not None and GroupRepository().count(c):
            self.before = before + timedelta(seconds=AHEAD)
        self._schedules = schedules.all(c) if self.before is None else schedules.due(c, self.before)
        settings = SettingsRepository().load(c)
        self._calendar = working_calendar(c, settings)
        self._robots = {robot.id: robot for robot in RobotRepository().all(c) if robot.enabled}
        used = {schedule.group_id for schedule in self._schedules if schedule.enabled and schedule.group_id is not None}
        self._groups = {group.id: group for group in GroupRepository().all(c) if group.id in used} if used else {}
        self._durations = MissionDurations(c, self._groups.values(), plan._live)
        self._skips, self._held = schedules.skips_from(c, now), schedules.skips_from(c, now, held=True)
        self.forecast = (
            GroupForecast(c, self._durations, self._groups, self._robots, settings, now, start, plan._live)
            if self._groups
            else None
        )

    def streams(self, start: datetime | None = None, earliest: datetime | None = None) -> list[Iterator[PlannedRun]]:
        """Of each enabled schedule, in order of time: from ``start`` on (with groups, from the begin of the forecast),
        or earlier by the length of its run, but not before ``earliest``."""
        streams: list[Iterator[PlannedRun]] = []
        for schedule in self._schedules:
            mission, target = self._durations.missions.get(schedule.mission_id), self._target(schedule)
            if not schedule.enabled or schedule.next_at is None or target is None or mission is None:
                continue
            usual, begin = self._durations.usual_on(target, mission), start
            if start is not None and self.forecast is not None and self.forecast.affects(schedule):
                begin = min(start, self.forecast.origin)
            if begin is not None and usual is not None:
                begin = max(begin - min(timedelta(seconds=usual.slow_s), LONGEST_RUN), earliest or begin)
            lacks_mission = (
                isinstance(target, Group)
                and self.forecast is not None
                and self.forecast.lacks_mission(target, mission.name)
            )
            first = planned_run(schedule.next_at, schedule, target, mission, usual, lacks_mission)
            streams.append(self._runs(first, begin or first.at))
        return streams

    def _runs(self, first: PlannedRun, start: datetime) -> Iterator[PlannedRun]:
        """Without those that a person has skipped; held ones are marked."""
        schedule = first.schedule
        wanted = max((schedule.paused_until if schedule.is_paused(first.at) else None) or first.at, start)
        after, begun = (first.at, [first.at]) if wanted == first.at else (wanted - MOMENT, [])
        for at in chain(begun, (o.instant for o in occurrences(schedule, after, self._calendar))):
            if (schedule.id, at) not in self._skips:
                yield copy_at(first, at, held=(schedule.id, at) in self._held)

    def conflicts(self, runs: Sequence[PlannedRun], start: datetime, last: datetime) -> list[Conflict]:
        """Of these runs, in order of time, that are planned from ``start`` (with groups from where the forecast begins) to ``last``."""
        members = self.forecast.members if self.forecast else {}
        since = min(start, self.forecast.origin) if self.forecast else start
        shared = Shared({key: (group, members[key]) for key, group in self._groups.items()}, self._durations.places())
        return plan_conflicts(runs, shared, since, last)

    def _target(self, schedule: Schedule) -> Robot | Group | None:
        """None if no robot of it is switched on."""
        if schedule.robot_id is not None:
            return self._robots.get(schedule.robot_id)
        group = self._groups.get(schedule.group_id or 0)
        return group if group is not None and not self._robots.keys().isdisjoint(group.members) else None


def _order(run: PlannedRun) -> tuple[datetime, int, str]:
    return run.at, -run.schedule.priority, run.schedule.name


def _reaches(run: PlannedRun, start: datetime) -> bool:
    """Whether it may still be under way then."""
    return run.usual is not None and run.begins + min(timedelta(seconds=run.usual.slow_s), LONGEST_RUN) >= start
