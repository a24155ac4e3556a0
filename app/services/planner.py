"""Turns schedules into executions when they fall due: each occurrence one row, in the same transaction that advances its schedule."""
from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cache
from itertools import takewhile

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.models import Execution, Mission, Overlap, Reason, ReasonCode, Robot, Schedule, Settings, State, Trigger, Wait
from app.services import decisions
from app.services.alarms import Alarms
from app.services.calendar import WorkingCalendar, working_calendar
from app.services.changes import Changes, Topic
from app.services.clock import Clock
from app.services.dispatcher import Ready
from app.services.downtime import Downtime, Gap
from app.services.ledger import Ledger
from app.services.recurrence import next_occurrence, occurrences

log = logging.getLogger(__name__)

AT_ONCE = 500                # schedules per transaction, so that a burst never holds the writer for long


@dataclass
class Fallen:
    """What one look at the plan brought."""
    robot_ids: set[int] = field(default_factory=set)      # with something that waits to be sent
    touched: set[int] = field(default_factory=set)        # with something new in the ledger
    skipped: list[Execution] = field(default_factory=list)
    missed: int = 0
    late_starts: int = 0
    intents: list[Execution] = field(default_factory=list)   # to be sent at once


class Planner:
    def __init__(self, db: Database, *, schedules: ScheduleRepository, executions: ExecutionRepository, robots: RobotRepository,
                 missions: MissionRepository, settings: SettingsRepository, clock: Clock, downtime: Downtime, alarms: Alarms,
                 ledger: Ledger, changes: Changes, hold_late_starts: bool, ready: Callable[[int], Ready | None],
                 hand_over: Callable[[Execution], None]) -> None:
        self._db, self._schedules, self._executions = db, schedules, executions
        self._robots, self._missions, self._settings = robots, missions, settings
        self._clock, self._downtime, self._alarms, self._ledger, self._changes = clock, downtime, alarms, ledger, changes
        self._ready, self._hand_over = ready, hand_over   # of the robots' lanes
        self._hold_late_starts = hold_late_starts         # only a window can show the list with its Hold button

    def next_due(self) -> datetime | None:
        return self._schedules.next_due(self._db.read())

    def robots_due(self, after: datetime, until: datetime) -> set[int]:
        """Robots with an occurrence after one instant and not after the other."""
        due = self.next_due()
        return set() if due is None or due > until else self._schedules.robots_due(self._db.read(), after, until)

    def fall_due(self) -> Fallen:
        """Make a row of every occurrence up to now. Costs one indexed look when nothing is due."""
        fallen = Fallen()
        due = self.next_due()
        is_more = due is not None and due <= self._clock.now()
        while is_more:
            is_more = self._db.write(lambda c: self._take_due(c, fallen))
            for intent in decisions.in_dispatch_order(fallen.intents):       # before anybody hears of it and looks
                self._hand_over(intent)
            fallen.intents.clear()
        if fallen.missed or fallen.skipped:
            self._ledger.grew = True
        if fallen.missed:
            self._alarms.raise_("executions_missed", "plan", count=fallen.missed)
        for execution in fallen.skipped:
            if execution.reason and execution.reason.code is not ReasonCode.HOLD:        # who pauses a schedule knows it
                self._ledger.alarm_for(execution)
        for robot_id in fallen.touched:
            self._changes.publish(Topic.EXECUTIONS, robot_id)
        if fallen.touched:
            self._changes.publish(Topic.SCHEDULES)
        return fallen

    def _take_due(self, c: sqlite3.Connection, fallen: Fallen) -> bool:
        """What is due by now, when the writer has come to it, and not only what was due when it was asked for; returns whether there may be
        more of it."""
        now = self._clock.now()
        settings = self._settings.load(c)
        install_id = self._settings.install_id(c)
        calendar = working_calendar(c, settings)
        robot_of, mission_of = cache(lambda key: self._robots.get(c, key)), cache(lambda key: self._missions.get(c, key))
        schedules = self._schedules.due(c, now, AT_ONCE)
        for schedule in schedules:
            robot, mission = robot_of(schedule.robot_id), mission_of(schedule.mission_id)
            if robot is None or mission is None:           # foreign keys don't let that happen
                self._schedules.advance(c, schedule.id, None)
                continue
            maker = _RowMaker(schedule, robot, mission, settings, install_id, now)
            ready = None if self._executions.has_waiting(c, robot.id) else self._ready(robot.id)     # what waits may have to go first
            self._take_schedule(c, schedule, maker, calendar, ready, fallen)
        return len(schedules) == AT_ONCE

    def _take_schedule(self, c: sqlite3.Connection, schedule: Schedule, make: _RowMaker, calendar: WorkingCalendar, ready: Ready | None,
                       fallen: Fallen) -> None:
        """The latest instant runs if it is still within its start window; the earlier ones were missed. With the intent of its first
        attempt where the robot is ``ready`` for it: the row that a POST needs before it is then on disk with one write."""
        now, settings = make.now, make.settings
        (*earlier, latest), following = _instants(schedule, now, calendar)
        newest = earlier if settings.history_limit is None else earlier[-settings.history_limit:]     # more would be pruned at once
        rows = [make.paused(instant) if schedule.is_paused(instant) else make.missed(instant, self._downtime.at(instant))
                for instant in newest]
        fallen.missed += sum(not schedule.is_paused(instant) for instant in earlier)
        if schedule.is_paused(latest):
            rows.append(make.paused(latest))
        elif now >= decisions.closes_at(latest, schedule.start_window_minutes, settings):
            rows.append(make.missed(latest, self._downtime.at(latest)))
            fallen.missed += 1
        elif not make.robot.enabled:
            rows.append(make.ended(latest, Reason(ReasonCode.ROBOT_REMOVED, {"robot": make.robot.name})))
        elif schedule.overlap is Overlap.SKIP and (previous := self._executions.open_of_schedule(c, schedule.id)):
            rows.append(make.ended(latest, Reason(ReasonCode.OVERLAP, {"planned_at": previous[-1].planned_at.isoformat()})))
        else:
            late = self._hold_late_starts and self._downtime.at(latest) is not None
            rows.append(make.waiting(latest, late) if late or ready is None else make.submitting(latest, ready))
            fallen.late_starts += late
        for row in rows:
            if added := self._executions.add_once(c, row):
                fallen.skipped += [added] if added.state is State.SKIPPED else []
                fallen.intents += [added] if added.state is State.SUBMITTING else []
                fallen.robot_ids |= {schedule.robot_id} if added.state is State.WAITING else set()
            else:
                log.info("The occurrence %s of %r is in the ledger already", row.planned_at, schedule.name)
        fallen.touched.add(schedule.robot_id)
        self._schedules.advance(c, schedule.id, following)


def _instants(schedule: Schedule, now: datetime, calendar: WorkingCalendar) -> tuple[list[datetime], datetime | None]:
    """What fell due since the schedule was looked at last, oldest first, at least one; and what comes next."""
    first = schedule.next_at
    if first is None:
        raise ValueError(f"schedule {schedule.id} is not due")
    following = next_occurrence(schedule, first, calendar)
    if following is None or following > now:                   # as always, unless the app was off or the clock was set
        return [first], following
    after = (occurrence.instant for occurrence in occurrences(schedule, first, calendar))
    fallen = [first, *takewhile(lambda instant: instant <= now, after)]
    return fallen, next_occurrence(schedule, max(now, fallen[-1]), calendar)


@dataclass(frozen=True)
class _RowMaker:
    """Rows of one schedule as it stands at ``now``."""
    schedule: Schedule
    robot: Robot
    mission: Mission
    settings: Settings
    install_id: str
    now: datetime

    def waiting(self, planned_at: datetime, late: bool) -> Execution:
        schedule, settings = self.schedule, self.settings
        row = Execution(
            trigger=Trigger.SCHEDULED, schedule_id=schedule.id, schedule=schedule.name, robot_id=self.robot.id, robot=self.robot.name,
            mission=self.mission.name, mission_guid=self.mission.guid, parameters=schedule.parameters, priority=schedule.priority,
            minimum_battery_percent=decisions.minimum_battery(schedule, settings), timezone=schedule.timezone, planned_at=planned_at,
            closes_at=decisions.closes_at(planned_at, schedule.start_window_minutes, settings), created_at=self.now,
            token=decisions.token_of(self.install_id, schedule.id, planned_at))
        return replace(row, wait=Wait.LATE_START, hold_until=self.now + decisions.LATE_START_HOLD) if late else row

    def submitting(self, planned_at: datetime, ready: Ready) -> Execution:
        row = self.waiting(planned_at, late=False)
        if not decisions.battery_allows(ready.battery, row.minimum_battery_percent):
            return row
        return replace(row, state=State.SUBMITTING, attempts=1, queue_floor=ready.queue_floor)

    def ended(self, planned_at: datetime, reason: Reason) -> Execution:
        return replace(self.waiting(planned_at, late=False), state=reason.state, reason=reason, ended_at=self.now)

    def paused(self, planned_at: datetime) -> Execution:
        until = self.schedule.paused_until
        return self.ended(planned_at, Reason(ReasonCode.HOLD, {"paused_until": until.isoformat()} if until else {}))

    def missed(self, planned_at: datetime, gap: Gap | None) -> Execution:
        code = ReasonCode.CLOCK_IMPLAUSIBLE if gap and gap.clock else ReasonCode.APP_DOWN
        times = {"start": gap.start.isoformat(), "end": gap.end.isoformat()} if gap else {}
        return self.ended(planned_at, Reason(code, times))


def one_off(trigger: Trigger, robot: Robot, mission: Mission, settings: Settings, now: datetime, token: str, *,
            parameters: dict[str, object] | None = None, queue_floor: int | None = None) -> Execution:
    """The row of a manual or idle execution: due now, within the general start window."""
    minimum = decisions.minimum_battery(None, settings) if trigger is Trigger.IDLE else None     # Run now has no constraint
    return Execution(
        trigger=trigger, robot_id=robot.id, robot=robot.name, mission=mission.name, mission_guid=mission.guid, parameters=parameters or {},
        minimum_battery_percent=minimum, timezone=settings.timezone, planned_at=now, closes_at=decisions.closes_at(now, None, settings),
        created_at=now, token=token, queue_floor=queue_floor, state=State.WAITING)


