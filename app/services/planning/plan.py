"""What will run: the occurrences of all schedules in a period, the next few, and those of a schedule that is not saved yet."""
from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from itertools import chain, islice, takewhile

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository, Skip
from app.database.settings import SettingsRepository
from app.domain.clock import Clock
from app.domain.models import DurationEstimate, Mission, Robot, Schedule
from app.services.planning.durations import expected
from app.services.planning.recurrence import Occurrence, occurrences
from app.services.planning.working_days import WorkingCalendar, working_calendar

MOMENT = timedelta(microseconds=1)
MOST = 100_000                  # occurrences in one span: what takes half a second and 30 MB
LONGEST_RUN = timedelta(hours=12)        # of a run that is still under way when a span begins


@dataclass(frozen=True)
class PlannedRun:
    """One occurrence to come."""
    at: datetime                # UTC
    schedule: Schedule
    robot: Robot
    mission: Mission
    usual_s: float | None       # median of the last completed runs on this robot, or what was typed; None: not known yet
    slow_s: float | None = None # what nine of ten of them stayed under
    typed: bool = False         # no run has been measured yet


@dataclass(frozen=True)
class Planned:
    """Occurrences in order of time. ``more``: from when on a schedule has further ones in that span, by its id: too many to be computed."""
    runs: tuple[PlannedRun, ...] = ()
    more: Mapping[int, datetime] = field(default_factory=dict)


class Plan:
    def __init__(self, db: Database, *, schedules: ScheduleRepository, robots: RobotRepository, missions: MissionRepository,
                 executions: ExecutionRepository, settings: SettingsRepository, clock: Clock) -> None:
        self._db, self._schedules, self._robots, self._missions = db, schedules, robots, missions
        self._executions, self._settings, self._clock = executions, settings, clock

    def between(self, start: datetime, end: datetime, most: int = MOST) -> Planned:
        """Occurrences of enabled schedules in [start, end), and before it those whose runs will still be under way then; nothing before
        now. Where there are more than ``most``, schedules with few keep all of theirs, and the others share the rest evenly."""
        now = self._clock.now()
        streams = [takewhile(lambda run: run.at < end, (run for run in stream if run.at >= now))
                   for stream in self._streams(max(start, now), now, before=end)]
        runs, more = list[PlannedRun](), dict[int, datetime]()
        while streams and (share := (most - len(runs)) // len(streams)):
            taken = [(stream, list(islice(stream, share))) for stream in streams]
            runs += chain.from_iterable(found for _stream, found in taken)
            streams = [stream for stream, found in taken if len(found) == share]
        for further in filter(None, (next(stream, None) for stream in streams)):
            more[further.schedule.id] = further.at
        return Planned(tuple(sorted(runs, key=_order)), more)

    def until(self, end: datetime) -> Iterator[PlannedRun]:
        """Every occurrence from now on and before ``end``, in order, however many."""
        now = self._clock.now()
        return takewhile(lambda run: run.at < end, (run for run in heapq.merge(*self._streams(before=end), key=_order) if run.at >= now))

    def next(self, count: int) -> list[PlannedRun]:
        return list(islice(heapq.merge(*self._streams(), key=_order), count))

    def skips(self) -> set[Skip]:
        """Starts to come that a person has left out."""
        return self._schedules.skips_from(self._db.read(), self._clock.now())

    def preview(self, draft: Schedule, count: int = 5) -> Sequence[Occurrence]:
        """The next starts that a schedule would have if it were saved now. Raises InvalidInput for an invalid rule."""
        c = self._db.read()
        calendar = working_calendar(c, self._settings.load(c))
        return list(islice(occurrences(draft, self._clock.now(), calendar), count))

    def _streams(self, start: datetime | None = None, earliest: datetime | None = None,
                 before: datetime | None = None) -> list[Iterator[PlannedRun]]:
        """Of each enabled schedule, in order of time: from ``start`` on, or as long before it as its run may take, but not before
        ``earliest``. ``before`` leaves out the schedules that don't come until then."""
        c = self._db.read()
        schedules = self._schedules.all(c) if before is None else self._schedules.due(c, before)
        calendar = working_calendar(c, self._settings.load(c))
        robots = {robot.id: robot for robot in self._robots.all(c) if robot.enabled}
        missions = {mission.id: mission for mission in self._missions.all(c)}
        skips = self._schedules.skips_from(c, self._clock.now())
        learned: dict[tuple[int, str], DurationEstimate | None] = {}
        streams: list[Iterator[PlannedRun]] = []
        for schedule in schedules:
            robot, mission = robots.get(schedule.robot_id or 0), missions.get(schedule.mission_id)
            if schedule.enabled and schedule.next_at is not None and robot and mission:
                key = (robot.id, mission.guid)
                if key not in learned:
                    learned[key] = self._executions.usual(c, *key)
                usual, begin = expected(learned[key], mission), start
                if start is not None and usual is not None:
                    begin = max(start - min(timedelta(seconds=usual.slow_s), LONGEST_RUN), earliest or start)
                runs = _runs(schedule, robot, mission, usual, calendar, begin)
                streams.append(run for run in runs if (run.schedule.id, run.at) not in skips)
        return streams


def _order(run: PlannedRun) -> tuple[datetime, int, str]:
    return run.at, -run.schedule.priority, run.schedule.name


def _runs(schedule: Schedule, robot: Robot, mission: Mission, usual: DurationEstimate | None, calendar: WorkingCalendar,
          start: datetime | None) -> Iterator[PlannedRun]:
    first = schedule.next_at
    if first is None:
        return
    wanted = max((schedule.paused_until if schedule.is_paused(first) else None) or first, start or first)
    after, begun = (first, [first]) if wanted == first else (wanted - MOMENT, [])
    for at in chain(begun, (o.instant for o in occurrences(schedule, after, calendar))):
        yield PlannedRun(at, schedule, robot, mission, usual.median_s if usual else None, usual.slow_s if usual else None,
                         usual is not None and usual.typed)
