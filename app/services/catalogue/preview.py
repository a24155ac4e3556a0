"""Preview of a schedule that is not saved yet: its next starts, and warnings about it.

A concern never prevents saving. Invalid schedules raise InvalidInput, by the same checks as saving.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import date, datetime
from enum import StrEnum
from itertools import islice
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

    def of(
        self, draft: Schedule, known_missions: Mapping[str, str] | None = None, until: datetime | None = None
    ) -> Forecast:
        """The preview of ``draft``; an id means that it replaces that schedule.

        ``known_missions``: guid -> name as read from the robot; None or empty: not known. ``until``: the end of the time in
        which all its starts are wanted (UTC). Raises InvalidInput for an invalid rule.
        """
        c = self._db.read()
        calendar = working_calendar(c, SettingsRepository().load(c))
        draft = validation.schedule(draft)
        validation.one_time_on_working_day(draft, calendar)
        look = _Look(c, draft, calendar, self._clock.now(), until, self._live)
        conflicts, free_at = look.conflicts()
        concerns = (
            *_target(look, known_missions or {}),
            *_stopped(draft, look.paused_until),
            *_days_off(look),
            *_clock_changes(look.starts, draft.timezone),
            *conflicts,
            *_finish_by(look),
        )
        return Forecast(look.starts, look.usual, concerns, free_at, look.skipped)

    def free_at(self, draft: Schedule) -> datetime | None:
        """Naive local time of the nearest first start without an overlap in the plan, possibly its own. None if there
        is none, or if it can't run. Raises InvalidInput for an invalid rule."""
        found = self.of(draft)
        codes = {concern.code for concern in found.concerns}
        if codes & _CANNOT_RUN or (draft.enabled and not found.starts):
            return None
        return found.free_at if codes & _IN_THE_WAY else draft.start


class _Look:
    """What the database says of a valid draft, its next starts, and what they meet."""

    def __init__(
        self,
        c: sqlite3.Connection,
        draft: Schedule,
        calendar: WorkingCalendar,
        now: datetime,
        until: datetime | None,
        live: LiveRobots,
    ) -> None:
        self.draft, self.calendar, self.now = draft, calendar, now
        self.mission, self.target = MissionRepository().get(c, draft.mission_id), target_of(c, draft)
        members = self.target.members if isinstance(self.target, Group) else ()
        self.usable = [r for r in RobotRepository().all(c) if r.id in members and r.enabled and not r.needs_password]
        self.paused_until = draft.paused_until if draft.is_paused(now) else None
        self.begins = self.paused_until - MOMENT if self.paused_until else now
        self._c, self._skips = c, ScheduleRepository().skips_from(c, now)
        if draft.moved_of is not None and draft.moved_from is not None:
            self._skips.add((draft.moved_of, draft.moved_from))
        self.starts = tuple(self._starts(until)) if draft.enabled else ()
        self.skipped = tuple(self._skipped()) if draft.enabled else ()
        self.durations = MissionDurations(c, GroupRepository().all(c), live)
        self.usual = (
            self.durations.usual_on(self.target, self.mission)
            if self.target is not None and self.mission is not None
            else None
        )

    def _starts(self, until: datetime | None) -> Iterator[Occurrence]:
        found = occurrences(self.draft, self.begins, self.calendar)
        ahead = (start for start in found if (self.draft.id, start.instant) not in self._skips)
        for number, start in enumerate(islice(ahead, MOST_SHOWN)):
            if number >= STARTS and (until is None or start.instant >= until):
                return
            yield start

    def _skipped(self) -> Iterator[datetime]:
        moved = ScheduleRepository().moved_away(self._c)
        for number, at in sorted(self._skips - moved):
            is_its_own = number == self.draft.id and at > self.begins
            if is_its_own and next_occurrence(self.draft, at - MOMENT, self.calendar) == at:
                yield at

    def conflicts(self) -> tuple[list[Concern], datetime | None]:
        """With other schedules, and the naive local time nearest to the first start without any."""
        if self.mission is None or self.target is None:
            return [], None
        draft, usual, starts = self.draft, self.usual, self.starts
        others = DraftConflicts(
            self._c, self.durations, draft, self.target, self.mission, usual, starts, self.calendar, self._skips
        )
        near, behind, of_resources = others.on_its_robot, list(others.behind()), list(others.of_resources())
        overlaps = list(find_overlaps(starts, usual, near)) if draft.robot_id is not None else []
        reported = {(conflict.details["schedule_id"], conflict.details["start"], conflict.at) for conflict in behind}
        concerns = [
            _overlap(run)
            for run in overlaps
            if (run.other.schedule.id, max(run.at, run.other.at), min(run.at, run.other.at)) not in reported
        ]
        concerns += [Concern(ConcernCode(each.code), each.at, each.details) for each in [*behind, *of_resources]]
        if not (overlaps or of_resources) or draft.between is not None or "BYHOUR" in (draft.recurrence or "").upper():
            return concerns, None
        shift = free_shift(starts, usual, near, self.now, others.has_room)
        return concerns, None if shift is None else draft.start + shift


# ---------------------------------------------------------------------- what may be wrong
def _target(look: _Look, known_missions: Mapping[str, str]) -> Iterator[Concern]:
    """Whether its robot, or one of its group, is switched on, has the mission, and may be sent missions by itself."""
    mission, target, robots = look.mission, look.target, look.usable
    if isinstance(target, Robot):
        robots = [target]
        if not target.enabled:
            yield Concern(ConcernCode.ROBOT_OFF, details={"robot": target.name})
        if mission is not None and _is_missing(mission, target.id, known_missions):
            yield Concern(ConcernCode.MISSION_MISSING, details={"mission": mission.name, "robot": target.name})
    elif (
        target is not None
        and mission is not None
        and robots
        and not any(look.durations.has(robot.id, mission.name) for robot in robots)
    ):
        yield Concern(ConcernCode.MISSION_MISSING, details={"mission": mission.name, "group": target.name})
    fleets = [robot.fleet for robot in robots if robot.fleet is not None and robot.fleet.known is None]
    if fleets and len(fleets) == len(robots):
        yield Concern(ConcernCode.NOT_CHECKED_UP, details={"fleet": fleets[0].name})


def _is_missing(mission: Mission, robot_id: int, known: Mapping[str, str]) -> bool:
    return mission.robot_id not in (None, robot_id) or (bool(known) and mission.guid not in known)


def _stopped(draft: Schedule, paused_until: datetime | None) -> Iterator[Concern]:
    if not draft.enabled:
        yield Concern(ConcernCode.SWITCHED_OFF)
    elif paused_until:
        yield Concern(ConcernCode.PAUSED, details={"until": paused_until})


def _days_off(look: _Look) -> Iterator[Concern]:
    """Days on which it doesn't start, though its rule names them, and whether any are left."""
    draft, calendar, starts = look.draft, look.calendar, look.starts
    yield from (off := list(_weekdays_off(draft, calendar)))
    if draft.enabled and not starts and not any(each.details["all"] for each in off):
        yield Concern(ConcernCode.NO_START)
    respects = draft.recurrence is not None and draft.respect_working_days
    if starts and respects and not off and _begins_on_day_off(draft, look.now, calendar):
        day = draft.start.date()
        yield Concern(ConcernCode.DAY_OFF, details={"day": day, "name": calendar.day_status(day).name})
    if passed_over := tuple(_closed_days(draft, starts, look.begins, calendar)):
        yield Concern(ConcernCode.CLOSED_DAYS, details={"days": passed_over})


def _finish_by(look: _Look) -> Iterator[Concern]:
    """It usually takes longer than there is time."""
    if look.mission is not None and look.usual is not None:
        details = finish_by_short(look.mission.name, look.draft.finish_by_minutes, look.usual.median_s)
        if details is not None:
            yield Concern(ConcernCode.FINISH_BY_SHORT, None, details)


def _overlap(overlap: RunOverlap) -> Concern:
    other = overlap.other
    details = {"schedule_id": other.schedule.id, "mission": other.mission.name, "start": other.at, "end": other.ends}
    return Concern(ConcernCode.OVERLAP, overlap.at, details)


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


def _clock_changes(starts: tuple[Occurrence, ...], zone: str) -> Iterator[Concern]:
    """Starts whose wall-clock time is skipped by a clock change (they come later) or repeated (the first one
    counts)."""
    tz = ZoneInfo(zone)
    for start in starts:
        local = start.instant.astimezone(tz)
        twice = local.utcoffset() != local.replace(fold=1).utcoffset() and not start.moved
        if start.moved or twice:
            yield Concern(ConcernCode.CLOCK_CHANGE, start.instant, {"nominal": start.nominal, "twice": twice})
