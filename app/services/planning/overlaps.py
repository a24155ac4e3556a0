"""Where runs of several schedules would overlap on one robot, and when it is free.

A run is assumed to last as long as the 90th percentile of the latest runs or, without any, as a person typed it; else
five minutes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from datetime import datetime, timedelta
from typing import NamedTuple

from app.database.schedules import Skip
from app.domain.execution import DurationEstimate
from app.domain.models import Schedule
from app.services.planning.planned import ASSUMED_S, PlannedRun, copy_at
from app.services.planning.recurrence import Occurrence, occurrences
from app.services.planning.working_days import WorkingCalendar

STEP = timedelta(minutes=5)  # between the times that are tried when a free one is searched for
FURTHEST = timedelta(hours=4)
STEPPED = 16  # runs of a schedule that are stepped through one by one before the search is restarted at the wanted time


class RunOverlap(NamedTuple):
    """A start and the run of another schedule at that time."""

    at: datetime  # UTC
    other: PlannedRun


def lasts(usual: DurationEstimate | None) -> timedelta:
    """How long a run is assumed to last."""
    return timedelta(seconds=usual.slow_s if usual else ASSUMED_S)


Neighbours = Sequence[PlannedRun]  # runs of others


def neighbours(
    starts: Sequence[Occurrence],
    usual: DurationEstimate | None,
    others: Iterable[PlannedRun],
    calendar: WorkingCalendar,
    skips: Collection[Skip],
) -> Sequence[Neighbours]:
    """For each start, earliest first: the runs of others as far around it as it may be shifted. ``others``: the next run of each."""
    beyond = FURTHEST + lasts(usual)
    found: list[list[PlannedRun]] = [[] for _ in starts]
    for other in others:
        before, walk = FURTHEST + lasts(other.usual), _Walk(other.schedule, other.at, calendar)
        for start, near in zip(starts, found, strict=True):
            runs = walk.between(start.instant - before, start.instant + beyond)
            near += [
                copy_at(other, at)
                for at in runs
                if (other.schedule.id, at) not in skips and not other.schedule.is_paused(at)
            ]
    return found


class _Walk:
    """The future runs of one schedule, read in spans that never begin or end before the previous one."""

    def __init__(self, schedule: Schedule, first: datetime, calendar: WorkingCalendar) -> None:
        self._schedule, self._calendar = schedule, calendar
        self._found: list[datetime] = []
        self._next: datetime | None = first
        self._following = self._after(first)

    def between(self, after: datetime, end: datetime) -> list[datetime]:
        """Both ends excluded."""
        self._found = [instant for instant in self._found if instant > after]
        passed = 0
        while self._next is not None and self._next < end:
            if self._next > after:
                self._found.append(self._next)
            elif (passed := passed + 1) > STEPPED:
                self._following = self._after(after)
            self._next = next(self._following, None)
        return self._found

    def _after(self, instant: datetime) -> Iterator[datetime]:
        return (found.instant for found in occurrences(self._schedule, instant, self._calendar))


def find_overlaps(
    starts: Sequence[Occurrence], usual: DurationEstimate | None, near: Sequence[Neighbours]
) -> Iterator[RunOverlap]:
    """Earliest first, at most one for each start: with the run in progress then, else with the first one that begins
    before it ends."""
    mine = lasts(usual)
    for start, others in zip(starts, near, strict=True):
        at = start.instant
        met = [other for other in others if at - lasts(other.usual) < other.at < at + mine]
        if met:
            yield RunOverlap(at, min(met, key=lambda one: one.at))


HasRoom = Callable[[int, datetime, datetime], bool]  # for a start, by its number, from when to when


def free_shift(
    starts: Sequence[Occurrence],
    usual: DurationEstimate | None,
    near: Sequence[Neighbours],
    now: datetime,
    has_room: HasRoom,
) -> timedelta | None:
    """The smallest shift of all these starts, on their own days and in the future, without overlaps and with room for
    everything else they need; None: not found."""
    mine = lasts(usual)
    busy = [
        (start, [(other.at - mine, other.at + lasts(other.usual)) for other in others])
        for start, others in zip(starts, near, strict=True)
    ]

    def is_free(shift: timedelta) -> bool:
        days = ((start.nominal + shift).date() == start.nominal.date() for start in starts)
        ahead = (start.instant + shift > now for start in starts)
        taken = (after < start.instant + shift < until for start, spans in busy for after, until in spans)
        room = (has_room(n, start.instant + shift, start.instant + shift + mine) for n, start in enumerate(starts))
        return all(days) and all(ahead) and not any(taken) and all(room)

    shifts = (sign * n * STEP for n in range(1, int(FURTHEST / STEP) + 1) for sign in (1, -1))
    return next(filter(is_free, shifts), None)
