"""Preview of a schedule that is not saved yet: its next starts, and warnings about it.

A concern never prevents saving. Invalid schedules raise InvalidInput, by the same checks as saving.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date, datetime
from enum import StrEnum
from itertools import islice, takewhile
from typing import Any
from zoneinfo import ZoneInfo

from app.database.connection import Database
from app.database.groups import GroupRepository, target_of
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain.clock import MOMENT, Clock
from app.domain.execution import DurationEstimate
from app.domain.models import Group, Mission, Robot, Schedule
from app.services.catalogue import validation
from app.services.planning.conflicts import finish_by_short
from app.services.planning.draft_conflicts import DraftConflicts
from app.services.planning.durations import NO_LIVE_ROBOTS, LiveRobots, MissionDurations
from app.services.planning.overlaps import RunOverlap, find_overlaps, free_shift
from app.services.planning.recurrence import Frequency, Occurrence, Recurrence, next_occurrence, occurrences
from app.services.planning.working_days import WorkingCalendar, working_calendar

STARTS = 5  # at least, and those of the time that is shown
MOST_SHOWN = 200
MOST_SEARCHED = 2000  # starts that are searched for it


class ConcernCode(StrEnum):
    """A possible problem of a schedule that can be saved nevertheless."""

    OVERLAP = "overlap"  # another planned run of that robot is still under way, or begins before its end
    DAY_OFF = "day_off"  # the first day is not a working day, so the schedule begins later
    WEEKDAYS_OFF = "weekdays_off"  # chosen days of the week that are no working days: nothing starts on them
    CLOSED_DAYS = "closed_days"  # between the next starts lie days that the exception calendar closes
    CLOCK_CHANGE = "clock_change"  # the wall-clock time does not exist on that day, or comes twice
    MISSION_MISSING = "mission_missing"  # the robot, or every one of the group, does not have it
    ROBOT_OFF = "robot_off"  # the robot is switched off in Settings
    NOT_CHECKED_UP = "not_checked_up"  # the robot's fleet, or those of the whole group
    PAUSED = "paused"  # a person paused the schedule: no start before then
    SWITCHED_OFF = "switched_off"  # the schedule is: nothing starts
    NO_START = "no_start"  # no more starts
    # those of ``app.domain.conflicts``, which has their words
    TOO_FEW_ROBOTS = "too_few_robots"
    PLACE_FULL = "place_full"
    PLACE_CROWDED = "place_crowded"
    CRITICAL_BEHIND = "critical_behind"
    FINISH_BY_SHORT = "finish_by_short"


_CANNOT_RUN = frozenset({ConcernCode.MISSION_MISSING, ConcernCode.ROBOT_OFF, ConcernCode.NO_START})
_IN_THE_WAY = frozenset(
    {
        ConcernCode.OVERLAP,
        ConcernCode.CRITICAL_BEHIND,
        ConcernCode.TOO_FEW_ROBOTS,
        ConcernCode.PLACE_FULL,
        ConcernCode.PLACE_CROWDED,
    }
)


@dataclass(frozen=True)
class Concern:
    """One warning; ``at`` is the start it is about, None: all of them. Times in ``details`` are UTC instants."""

    code: ConcernCode
    at: datetime | None = None
    details: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Forecast:
    starts: tuple[Occurrence, ...] = ()
    usual: DurationEstimate | None = None  # of that mission on that robot; None: not known
    concerns: tuple[Concern, ...] = ()
    free_at: datetime | None = None  # naive local time of the nearest first start without an overlap
    skipped: tuple[datetime, ...] = ()  # future starts that a person has skipped (UTC)

    @property
    def usual_s(self) -> float | None:
        return self.usual.median_s if self.usual else None

    @property
    def in_the_way(self) -> set[datetime | None]:
        """The starts that something else of the plan is in the way of."""
        return {concern.at for concern in self.concerns if concern.code in _IN_THE_WAY}


class Forecasts:
    def __init__(self, db: Database, clock: Clock, live: LiveRobots = NO_LIVE_ROBOTS) -> None:
        self._db, self._clock, self._live = db, clock, live
        self._schedules, self._robots, self._missions = ScheduleRepository(), RobotRepository(), MissionRepository()
        self._settings = SettingsRepository()

    def of(
        self, draft: Schedule, known_missions: Mapping[str, str] | None = None, until: datetime | None = None
    ) -> Forecast:
        """The preview of ``draft``; an id means that it replaces that schedule.

        ``known_missions``: guid -> name as read from the robot; None or empty: not known. ``until``: the end of the time in
        which all its starts are wanted (UTC). Raises InvalidInput for an invalid rule.
        """
        c = self._db.read()
        settings = self._settings.load(c)
        calendar = working_calendar(c, settings)
        draft = validation.schedule(draft)
        validation.one_time_on_working_day(draft, calendar)
        mission, target = self._missions.get(c, draft.mission_id), target_of(c, draft)
        robot = target if isinstance(target, Robot) else None
        now = self._clock.now()
        paused_until = draft.paused_until if draft.paused_until is not None and draft.paused_until > now else None
        begins = paused_until - MOMENT if paused_until else now
        moved = self._schedules.moved_away(c)
        skips = self._schedules.skips_from(c, now)
        if draft.moved_of is not None and draft.moved_from is not None:
            skips.add((draft.moved_of, draft.moved_from))
        ahead = (start for start in occurrences(draft, begins, calendar) if (draft.id, start.instant) not in skips)
        wanted = takewhile(lambda n: n[0] < STARTS or (until is not None and n[1].instant < until), enumerate(ahead))
        starts = tuple(start for _n, start in islice(wanted, MOST_SHOWN)) if draft.enabled else ()
        skipped = tuple(
            sorted(
                at
                for number, at in skips
                if number == draft.id
                and (number, at) not in moved
                and draft.enabled
                and at > begins
                and next_occurrence(draft, at - MOMENT, calendar) == at
            )
        )
        durations = MissionDurations(c, GroupRepository().all(c), self._live)
        usual = durations.usual_on(target, mission) if mission and target else None
        concerns: list[Concern] = []
        if robot is not None and not robot.enabled:
            concerns.append(Concern(ConcernCode.ROBOT_OFF, details={"robot": robot.name}))
        if mission is not None and robot is not None and _is_missing(mission, robot.id, known_missions):
            concerns.append(
                Concern(ConcernCode.MISSION_MISSING, details={"mission": mission.name, "robot": robot.name})
            )
        if mission is not None and isinstance(target, Group) and self._is_lacking(c, durations, target, mission.name):
            concerns.append(
                Concern(ConcernCode.MISSION_MISSING, details={"mission": mission.name, "group": target.name})
            )
        concerns += self._not_checked_up(c, target)
        if not draft.enabled:
            concerns.append(Concern(ConcernCode.SWITCHED_OFF))
        elif paused_until:
            concerns.append(Concern(ConcernCode.PAUSED, details={"until": paused_until}))
        concerns += (off := tuple(_weekdays_off(draft, calendar)))
        if not starts and draft.enabled:
            concerns += [Concern(ConcernCode.NO_START)] if not any(each.details["all"] for each in off) else []
        elif (
            starts
            and draft.recurrence is not None
            and draft.respect_working_days
            and not off
            and _begins_on_day_off(draft, now, calendar)
        ):
            concerns.append(
                Concern(
                    ConcernCode.DAY_OFF,
                    details={"day": draft.start.date(), "name": calendar.day_status(draft.start.date()).name},
                )
            )
        if passed_over := tuple(_closed_days(draft, starts, begins, calendar)):
            concerns.append(Concern(ConcernCode.CLOSED_DAYS, details={"days": passed_over}))
        concerns += _clock_changes(starts, draft.timezone)
        free_at = None
        if mission is not None and target is not None:
            others = DraftConflicts(c, durations, draft, target, mission, usual, starts, calendar, skips)
            found, free_at = self._conflicts(draft, usual, starts, others)
            concerns += found
        concerns += _finish_by(draft, mission, usual)
        return Forecast(starts, usual, tuple(concerns), free_at, skipped)

    def _conflicts(
        self, draft: Schedule, usual: DurationEstimate | None, starts: Sequence[Occurrence], others: DraftConflicts
    ) -> tuple[list[Concern], datetime | None]:
        """With other schedules, and the nearest time of the first start without any."""
        near = others.on_its_robot
        behind, of_resources = list(others.behind()), list(others.of_resources())
        reported = {(conflict.details["schedule_id"], conflict.details["start"], conflict.at) for conflict in behind}
        overlaps = list(find_overlaps(starts, usual, near)) if draft.robot_id is not None else []
        concerns = [
            _overlap(run)
            for run in overlaps
            if (run.other.schedule.id, max(run.at, run.other.at), min(run.at, run.other.at)) not in reported
        ]
        concerns += [Concern(ConcernCode(each.code), each.at, each.details) for each in [*behind, *of_resources]]
        if not (overlaps or of_resources) or draft.between is not None or "BYHOUR" in (draft.recurrence or "").upper():
            return concerns, None
        shift = free_shift(starts, usual, near, self._clock.now(), others.has_room)
        return concerns, None if shift is None else draft.start + shift

    def free_at(self, draft: Schedule) -> datetime | None:
        """Naive local time of the nearest first start without an overlap in the plan, possibly its own. None if there
        is none, or if it can't run. Raises InvalidInput for an invalid rule."""
        found = self.of(draft)
        codes = {concern.code for concern in found.concerns}
        if codes & _CANNOT_RUN or (draft.enabled and not found.starts):
            return None
        return found.free_at if codes & _IN_THE_WAY else draft.start

    def _is_lacking(self, c: sqlite3.Connection, durations: MissionDurations, group: Group, mission: str) -> bool:
        """Whether none of its robots that are switched on has the mission."""
        members = self._usable(c, group)
        return bool(members) and not any(durations.has(robot.id, mission) for robot in members)

    def _usable(self, c: sqlite3.Connection, group: Group) -> list[Robot]:
        return [
            robot
            for robot in self._robots.all(c)
            if robot.id in group.members and robot.enabled and not robot.needs_password
        ]

    def _not_checked_up(self, c: sqlite3.Connection, target: Robot | Group | None) -> Iterator[Concern]:
        """Nothing is sent to any of its robots by itself, as their fleets were not checked up."""
        robots = self._usable(c, target) if isinstance(target, Group) else [target] if target is not None else []
        fleets = [robot.fleet for robot in robots if robot.fleet is not None and robot.fleet.known is None]
        if fleets and len(fleets) == len(robots):
            yield Concern(ConcernCode.NOT_CHECKED_UP, details={"fleet": fleets[0].name})


def _finish_by(draft: Schedule, mission: Mission | None, usual: DurationEstimate | None) -> Iterator[Concern]:
    """It usually takes longer than there is time."""
    seconds = usual.median_s if usual is not None else None
    details = finish_by_short(mission.name, draft.finish_by_minutes, seconds) if mission is not None else None
    if details is not None:
        yield Concern(ConcernCode.FINISH_BY_SHORT, None, details)


def _overlap(overlap: RunOverlap) -> Concern:
    return Concern(
        ConcernCode.OVERLAP,
        overlap.at,
        {
            "schedule_id": overlap.other.schedule.id,
            "mission": overlap.other.mission.name,
            "start": overlap.other.at,
            "end": overlap.other.ends,
        },
    )


def _weekdays_off(draft: Schedule, calendar: WorkingCalendar) -> Iterator[Concern]:
    """Of a rule that names days of the week (Monday is 0) those that are no working days, and whether they are ``all``
    of them. ``instead``: its days with the next working ones in their place; empty for a rule of certain weeks of a
    month. It may also run anyway, without respect for working days."""
    rule = Recurrence.parse(draft.recurrence)
    implied = ((0, draft.start.weekday()),) if rule.frequency is Frequency.WEEKLY else ()
    days = {day: number for number, day in rule.weekdays or implied}
    off = tuple(sorted(day for day in days if calendar.working_weekday(day) != day))
    if off and draft.respect_working_days:
        instead = () if any(days.values()) else tuple(sorted({calendar.working_weekday(day) for day in days}))
        details = {"weekdays": off, "all": len(off) == len(days), "instead": instead}
        yield Concern(ConcernCode.WEEKDAYS_OFF, details=details)


def _begins_on_day_off(draft: Schedule, now: datetime, calendar: WorkingCalendar) -> bool:
    """Not of a day that has passed: what runs already doesn't begin later."""
    day = draft.start.date()
    return day >= now.astimezone(ZoneInfo(draft.timezone)).date() and not calendar.is_working_day(day)


def _closed_days(
    draft: Schedule, starts: tuple[Occurrence, ...], after: datetime, calendar: WorkingCalendar
) -> Iterator[tuple[date, str]]:
    """The days off, with their names, on which the rule would have had a start before the last one shown."""
    if draft.recurrence is None or not draft.respect_working_days or not starts or not calendar.has_exceptions:
        return
    last = None
    for occurrence in islice(occurrences(replace(draft, respect_working_days=False), after, calendar), MOST_SEARCHED):
        day = occurrence.nominal.date()
        if occurrence.instant >= starts[-1].instant:
            return
        if (
            day not in (last, draft.start.date())
            and (status := calendar.day_status(day)).name
            and not status.is_working
        ):
            last = day
            yield day, status.name


def _is_missing(mission: Mission, robot_id: int, known: Mapping[str, str] | None) -> bool:
    return mission.robot_id not in (None, robot_id) or (bool(known) and mission.guid not in (known or {}))


def _clock_changes(starts: tuple[Occurrence, ...], zone: str) -> Iterator[Concern]:
    """Starts whose wall-clock time is skipped by a clock change (they come later) or repeated (the first one
    counts)."""
    tz = ZoneInfo(zone)
    for start in starts:
        local = start.instant.astimezone(tz)
        twice = local.utcoffset() != local.replace(fold=1).utcoffset() and not start.moved
        if start.moved or twice:
            yield Concern(ConcernCode.CLOCK_CHANGE, start.instant, {"nominal": start.nominal, "twice": twice})
