"""Skip a start and pause until: a person leaves out starts of a schedule.

A skipped start gets its row in the ledger at once, which ends at the instant that it was planned for: that day's figures have it, and no
earlier ones. Those in a pause get theirs when they fall due, so that it can be ended at any time.
"""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from typing import TypeVar

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.groups import target_of
from app.database.missions import MissionRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain import rules
from app.domain.clock import Clock
from app.domain.models import InvalidInput, Reason, ReasonCode, Schedule
from app.services.catalogue import change_log
from app.services.executions.apply import apply_in
from app.services.executions.transitions import NOT_WITH_THE_ROBOT, withdraw
from app.services.live.changes import Changes, Topic
from app.services.planning.planned import MOMENT, first_due
from app.services.planning.recurrence import next_occurrence
from app.services.planning.working_days import WorkingCalendar, working_calendar

T = TypeVar("T")
log = logging.getLogger(__name__)


class Pausing:
    def __init__(self, db: Database, clock: Clock, changes: Changes) -> None:
        self._db, self._clock, self._changes = db, clock, changes
        self._schedules, self._missions = ScheduleRepository(), MissionRepository()
        self._executions, self._settings = ExecutionRepository(), SettingsRepository()

    def skip_next(self, schedule_id: int, seen: datetime | None = None) -> datetime:
        """Returns the instant (UTC) that was skipped: the next one as a person has ``seen`` it, though an earlier one may be there now.
        Raises InvalidInput when no start is left, or what was seen is skipped already, on its way or not planned any more."""

        def work(c: sqlite3.Connection) -> tuple[Schedule, datetime]:
            schedule = self._the_schedule(c, schedule_id)
            if seen in self._schedules.skipped(c, schedule_id):
                raise InvalidInput("schedule", "this start is skipped already")
            if seen is not None:
                self._check_is_to_come(c, schedule, seen)
            at = self._next_to_run(c, replace(schedule, next_at=seen or schedule.next_at), may_be_paused=False)
            if not schedule.enabled or at is None:
                raise _nothing_to_skip()
            return self._skip(c, schedule, at)

        return _told_skipped(*self._write(work))

    def skip(self, schedule_id: int, instant: datetime) -> datetime:
        """Leave out the start planned at that instant (UTC), which is returned. Raises InvalidInput when there is none, or not any more."""

        def work(c: sqlite3.Connection) -> tuple[Schedule, datetime]:
            schedule = self._the_schedule(c, schedule_id)
            if instant in self._schedules.skipped(c, schedule_id):
                return schedule, instant
            self._check_is_to_come(c, schedule, instant)
            return self._skip(c, schedule, instant)

        return _told_skipped(*self._write(work))

    def unskip(self, schedule_id: int, instant: datetime, *, must_run: bool = False) -> None:
        """Undo the skip of that start (UTC). Raises InvalidInput when its time has passed, and where it ``must_run`` also when it would not
        all the same: the schedule is off, paused until then or has another rule now."""

        def work(c: sqlite3.Connection) -> Schedule:
            now, schedule, settings = self._clock.now(), self._the_schedule(c, schedule_id), self._settings.load(c)
            if self._has_passed(schedule, instant):
                raise InvalidInput("schedule", "the time of this start has passed")
            if must_run and not schedule.enabled:
                raise InvalidInput("schedule", "this schedule is switched off: switch it on first")
            if must_run and schedule.is_paused(instant):
                raise InvalidInput("schedule", "this schedule is paused beyond that start: resume it first")
            if must_run and next_occurrence(schedule, instant - MOMENT, self._calendar(c)) != instant:
                raise InvalidInput("schedule", "this schedule has no such start any more")
            self._schedules.unskip(c, schedule_id, instant)
            self._executions.drop_skipped(c, schedule_id, instant)
            if self._executions.has_instant(c, schedule_id, instant):
                raise InvalidInput("schedule", "this start may have been sent already")
            if schedule.next_at is None or instant < schedule.next_at:  # else what is due just now would be passed over
                skipped = self._schedules.skipped(c, schedule_id)
                self._schedules.advance(c, schedule_id, first_due(schedule, settings, now, self._calendar(c), skipped))
            return schedule

        schedule = self._write(work)
        log.info("schedule %r: the start at %s is not skipped any more", schedule.name, change_log.moment(instant))

    def pause(self, schedule_id: int, until: datetime) -> Schedule:
        """Skip every start before ``until`` (aware), also what waits of the schedule. Raises InvalidInput for a time that has passed."""

        def work(c: sqlite3.Connection) -> Schedule:
            now, schedule = self._clock.now(), self._the_schedule(c, schedule_id)
            if until <= now:
                raise InvalidInput("until", "choose a time in the future")
            self._schedules.pause(c, schedule_id, until)
            reason = Reason(ReasonCode.HOLD, {"paused_until": until.isoformat()})
            for row in self._executions.open_of_schedule(c, schedule_id, NOT_WITH_THE_ROBOT):
                if row.planned_at < until:
                    apply_in(c, withdraw(row, reason), now)
            return schedule

        return self._paused(self._write(work), until)

    def resume(self, schedule_id: int) -> Schedule:
        """End the pause: the next start runs. What was skipped stays so."""

        def work(c: sqlite3.Connection) -> Schedule:
            schedule = self._the_schedule(c, schedule_id)
            self._schedules.pause(c, schedule_id, None)
            return schedule

        return self._paused(self._write(work), None)

    @staticmethod
    def _paused(before: Schedule, until: datetime | None) -> Schedule:
        log.info(
            "schedule %r changed: paused until %s → %s",
            before.name,
            change_log.shown(before.paused_until),
            change_log.shown(until),
        )
        return replace(before, paused_until=until)

    def _write(self, work: Callable[[sqlite3.Connection], T]) -> T:
        result = self._db.write(work)
        self._changes.publish(Topic.SCHEDULES)
        self._changes.publish(Topic.EXECUTIONS)
        return result

    def _the_schedule(self, c: sqlite3.Connection, schedule_id: int) -> Schedule:
        if schedule := self._schedules.get(c, schedule_id):
            return schedule
        raise InvalidInput("schedule", "there is no such schedule any more")

    def _check_is_to_come(self, c: sqlite3.Connection, schedule: Schedule, instant: datetime) -> None:
        if not schedule.enabled or schedule.next_at is None:
            raise _nothing_to_skip()
        if instant < schedule.next_at and self._has_passed(schedule, instant):
            raise InvalidInput("schedule", "the time of this start has passed")
        after = max(schedule.next_at, instant - MOMENT)
        if instant not in (schedule.next_at, next_occurrence(schedule, after, self._calendar(c))):
            raise InvalidInput("schedule", "this schedule has no such start any more")

    def _has_passed(self, schedule: Schedule, instant: datetime) -> bool:
        """Also where its row is there just before it."""
        return instant <= self._clock.now() or (
            schedule.planned_through is not None and instant <= schedule.planned_through
        )

    def _calendar(self, c: sqlite3.Connection) -> WorkingCalendar:
        return working_calendar(c, self._settings.load(c))

    def _next_to_run(self, c: sqlite3.Connection, schedule: Schedule, may_be_paused: bool = True) -> datetime | None:
        """The next start, which may be due as well, that is not skipped."""
        at, skipped, calendar = schedule.next_at, self._schedules.skipped(c, schedule.id), self._calendar(c)
        while at is not None and (at in skipped or (not may_be_paused and schedule.is_paused(at))):
            at = next_occurrence(schedule, at, calendar)
        return at

    def _skip(self, c: sqlite3.Connection, schedule: Schedule, at: datetime) -> tuple[Schedule, datetime]:
        settings, now = self._settings.load(c), self._clock.now()
        target, mission = target_of(c, schedule), self._missions.get(c, schedule.mission_id)
        if target is None or mission is None:  # foreign keys prevent that
            raise InvalidInput("schedule", "there is no such schedule any more")
        row = rules.scheduled(schedule, target, mission, settings, self._settings.install_id(c), at, now)
        self._executions.add_once(
            c, rules.ended(row, Reason(ReasonCode.HOLD, {"skipped_at": now.isoformat()}), max(at, now))
        )
        self._schedules.skip(c, schedule.id, at)
        self._schedules.advance(c, schedule.id, self._next_to_run(c, schedule))
        return schedule, at


def _nothing_to_skip() -> InvalidInput:
    return InvalidInput("schedule", "this schedule has no start to skip")


def _told_skipped(schedule: Schedule, at: datetime) -> datetime:
    log.info("schedule %r: the start at %s is skipped", schedule.name, change_log.moment(at))
    return at
