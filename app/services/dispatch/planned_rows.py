"""The rows that a schedule gets when it falls due, and how many starts it had while nothing could be started, and why none of them was
made."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from typing import Any

from app.database.schedules import Skip
from app.domain import rules
from app.domain.clock import MOMENT
from app.domain.execution import Execution, Reason, ReasonCode, Wait
from app.domain.models import Group, Mission, Robot, Schedule, Settings
from app.services.dispatch.messages import Readiness
from app.services.live.downtime import UNKNOWN_START, Downtime, Gap
from app.services.planning.recurrence import next_occurrence, passed_occurrences
from app.services.planning.working_days import WorkingCalendar


@dataclass(frozen=True)
class Passed:
    """A number of successive starts that were not made for one reason: the schedule ``is_paused``, or they were missed
    in ``gap`` (None: reason unknown)."""

    starts: int
    first: datetime
    last: datetime
    is_paused: bool
    gap: Gap | None


def passed(
    schedule: Schedule, until: datetime, calendar: WorkingCalendar, downtime: Downtime, skipped: Collection[datetime]
) -> list[Passed]:
    """From its next instant up to and including ``until``. Starts that a person ``skipped`` already have their rows.
    Starts without a known reason count to the adjacent absence."""
    found: list[Passed] = []
    for each in _parts(schedule, until, calendar, downtime, skipped):
        before = found[-1] if found else None
        if (
            before is None
            or before.is_paused is not each.is_paused
            or (before.gap and each.gap and before.gap != each.gap)
        ):
            found.append(each)
        else:
            found[-1] = replace(before, starts=before.starts + each.starts, last=each.last, gap=before.gap or each.gap)
    return found


def _parts(
    schedule: Schedule, until: datetime, calendar: WorkingCalendar, downtime: Downtime, skipped: Collection[datetime]
) -> Iterator[Passed]:
    """In each of them one reason holds."""
    if schedule.next_at is None:
        raise ValueError(f"schedule {schedule.id} is not due")
    begin = schedule.next_at - MOMENT
    edges = {*downtime.edges(), *skipped, *(instant - MOMENT for instant in skipped)}
    if schedule.paused_until is not None:
        edges.add(schedule.paused_until - MOMENT)
    for after, end in pairwise([begin, *sorted(edge for edge in edges if begin < edge < until), until]):
        starts, last = passed_occurrences(schedule, after, end, calendar)
        first = next_occurrence(schedule, after, calendar) if starts else None
        if first is not None and last is not None and last not in skipped:
            is_paused = schedule.is_paused(last)
            yield Passed(starts, first, last, is_paused, None if is_paused else downtime.at(last))


@dataclass(frozen=True)
class PlanningContext:
    """What everything that falls due at ``now`` depends on, as the database has it."""

    now: datetime
    settings: Settings
    install_id: str
    calendar: WorkingCalendar
    robots: Mapping[int, Robot]
    groups: Mapping[int, Group]
    missions: Mapping[int, Mission]
    waited_for: set[int]  # robots for which something waits
    open_of_schedule: dict[int, datetime | None]  # by schedules that don't overlap: when what still runs was planned
    skips: Collection[Skip]
    kept_back: Collection[Skip]
    with_places: Collection[str]  # names of missions that wait where one is full
    ready: Callable[[int], Readiness | None]  # robots that can get a start at once
    uncertain_through: datetime | None  # starts planned up to then may have run

    def readiness(self, robot: Robot, mission: Mission) -> Readiness | None:
        """None: nothing can be sent to it at once. Waiting starts may go first."""
        return None if robot.id in self.waited_for or mission.name in self.with_places else self.ready(robot.id)

    def waits_for_its_instant(self, target: Robot | Group, mission: Mission) -> bool:
        """Whether a start of this mission can't be assigned before its instant, for other reasons than its own."""
        return isinstance(target, Robot) and self.readiness(target, mission) is None

    def target_of(self, schedule: Schedule) -> Robot | Group | None:
        if schedule.robot_id is not None:
            return self.robots.get(schedule.robot_id)
        return None if schedule.group_id is None else self.groups.get(schedule.group_id)


@dataclass(frozen=True)
class RowMaker:
    """Makes the rows of one schedule."""

    schedule: Schedule
    target: Robot | Group
    mission: Mission
    context: PlanningContext

    def waiting(self, planned_at: datetime, late: bool = False, intent_floor: int | None = None) -> Execution:
        context = self.context
        row = rules.scheduled(
            self.schedule,
            self.target,
            self.mission,
            context.settings,
            context.install_id,
            planned_at,
            context.now,
            intent_floor,
        )
        if late and context.uncertain_through is not None and planned_at <= context.uncertain_through:
            return replace(row, wait=Wait.ELSEWHERE, wait_details=rules.LISTED_LATER)
        return replace(row, wait=Wait.LATE_START, listed_until=context.now + rules.LATE_START_HOLD) if late else row

    def submitting(self, planned_at: datetime, ready: Readiness) -> Execution:
        may_be_there = ready.uncertain_through is not None and planned_at <= ready.uncertain_through
        is_charged = rules.battery_allows(
            ready.battery, rules.minimum_battery(self.schedule, self.mission, self.context.settings)
        )
        return self.waiting(planned_at, intent_floor=ready.queue_floor if is_charged and not may_be_there else None)

    def ended(self, planned_at: datetime, reason: Reason) -> Execution:
        return rules.ended(self.waiting(planned_at), reason, self.context.now)

    def is_skipped(self, planned_at: datetime) -> bool:
        """In a pause, or by itself."""
        return self.schedule.is_paused(planned_at) or (self.schedule.id, planned_at) in self.context.skips

    def skipped_row(self, planned_at: datetime) -> Execution:
        until = self.schedule.paused_until if self.schedule.is_paused(planned_at) else None
        return self.ended(planned_at, Reason(ReasonCode.HOLD, {"paused_until": until.isoformat()} if until else {}))

    def still_open(self) -> datetime | None:
        """The latest instant, if its start window is open and no person skipped it: it still runs."""
        context, schedule = self.context, self.schedule
        window = rules.closes_at(context.now, schedule.start_window_minutes, context.settings) - context.now
        since = max(context.now - window, (schedule.next_at or context.now) - MOMENT)
        latest = passed_occurrences(schedule, since, context.now, context.calendar).last
        return None if latest is None or self.is_skipped(latest) else latest

    def passed(self, starts: Passed) -> Execution:
        """One row for all of them, in the place of the last."""
        row = self.skipped_row(starts.last) if starts.is_paused else self.missed(starts.last, starts.gap)
        if starts.starts == 1 or row.reason is None:
            return row
        span = {"starts": starts.starts, "first": starts.first.isoformat(), "last": starts.last.isoformat()}
        return replace(row, starts=starts.starts, reason=Reason(row.reason.code, {**row.reason.details, **span}))

    def missed(self, planned_at: datetime, gap: Gap | None) -> Execution:
        code = ReasonCode.CLOCK_IMPLAUSIBLE if gap and gap.clock else ReasonCode.APP_DOWN
        details: dict[str, Any] = (
            {"start": gap.start.isoformat(), "end": gap.end.isoformat()} if gap and gap.start > UNKNOWN_START else {}
        )
        return self.ended(
            planned_at, Reason(code, {**details, "problem": gap.problem} if gap and gap.problem else details)
        )
