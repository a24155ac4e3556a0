"""A schedule's starts that fell due while nothing could be started: their number and reason."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise

from app.domain.clock import MOMENT
from app.domain.models import Schedule
from app.services.live.downtime import Downtime, Gap
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
