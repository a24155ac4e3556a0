"""Where runs of several schedules would overlap on one robot, how likely that is by what their missions took lately, and when it is free.

A run is assumed to last as long as the 90th percentile of the latest runs or, without any, as a person typed it; else five minutes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from app.domain.models import DurationEstimate, Schedule
from app.services.planning.recurrence import Occurrence, occurrences
from app.services.planning.working_days import WorkingCalendar

ASSUMED_S = 300.0  # length of a run whose duration is not known
STEP = timedelta(minutes=5)  # between the times that are tried when a free one is searched for
FURTHEST = timedelta(hours=4)
STEPPED = 16  # runs of a schedule that are stepped through one by one before the search is restarted at the wanted time


@dataclass(frozen=True)
class OtherSchedule:
    """Another schedule of the robot, and how long its runs take."""

    schedule: Schedule
    mission: str
    usual: DurationEstimate | None
    skipped: Collection[datetime] = ()  # its starts that a person has skipped

    @property
    def lasts(self) -> timedelta:
        return lasts(self.usual)


@dataclass(frozen=True)
class RunOverlap:
    """Two runs at one time. ``likely`` is the share of runs that took long enough for it, None where that is not known."""

    at: datetime  # UTC, of the draft's start
    other: OtherSchedule
    begins: datetime
    likely: float | None

    @property
    def ends(self) -> datetime:
        """When the other one usually has ended."""
        usual = self.other.usual
        return self.begins + timedelta(seconds=usual.median_s if usual else ASSUMED_S)


def lasts(usual: DurationEstimate | None) -> timedelta:
    """How long a run is assumed to last."""
    return timedelta(seconds=usual.slow_s if usual else ASSUMED_S)


Neighbours = Sequence[tuple[OtherSchedule, datetime]]  # runs of others, by when they begin


def neighbours(
    starts: Sequence[Occurrence],
    usual: DurationEstimate | None,
    others: Iterable[OtherSchedule],
    calendar: WorkingCalendar,
) -> Sequence[Neighbours]:
    """For each start, earliest first: the runs of others as far around it as it may be shifted."""
    beyond = FURTHEST + lasts(usual)
    found: list[list[tuple[OtherSchedule, datetime]]] = [[] for _ in starts]
    for other in others:
        before, walk = FURTHEST + other.lasts, _Walk(other.schedule, calendar)
        for start, near in zip(starts, found, strict=True):
            runs = walk.between(start.instant - before, start.instant + beyond)
            near += [(other, begins) for begins in runs if begins not in other.skipped]
    return found


class _Walk:
    """The future runs of one schedule, asked for in spans of which none begins or ends before the last one."""

    def __init__(self, schedule: Schedule, calendar: WorkingCalendar) -> None:
        self._schedule, self._calendar = schedule, calendar
        self._found: list[datetime] = []
        self._next = schedule.next_at
        self._following = self._after(schedule.next_at) if schedule.next_at else iter(())

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
    """Earliest first, at most one for each start: with the run that is in progress then, else with the first that begins before it ends."""
    mine = lasts(usual)
    for start, others in zip(starts, near, strict=True):
        at = start.instant
        met = [(begins, other) for other, begins in others if at - other.lasts < begins < at + mine]
        if met:
            begins, other = min(met, key=lambda one: one[0])
            yield RunOverlap(at, other, begins, _likely(at, usual, other.usual, begins))


def _likely(
    at: datetime, usual: DurationEstimate | None, others: DurationEstimate | None, begins: datetime
) -> float | None:
    if begins == at:
        return 1.0
    earlier = others if begins < at else usual
    return earlier.share_over(abs((at - begins).total_seconds())) if earlier and not earlier.typed else None


HasRoom = Callable[[int, datetime, datetime], bool]  # for a start, by its number, from when to when


def free_shift(
    starts: Sequence[Occurrence],
    usual: DurationEstimate | None,
    near: Sequence[Neighbours],
    now: datetime,
    has_room: HasRoom | None = None,
) -> timedelta | None:
    """The smallest shift of all these starts, on their own days and to come, at which no other run is in the way and whatever else they
    want has room; None: none is found."""
    mine = lasts(usual)
    busy = [
        (start, [(begins - mine, begins + other.lasts) for other, begins in others])
        for start, others in zip(starts, near, strict=True)
    ]
    for n in range(1, int(FURTHEST / STEP) + 1):
        for shift in (n * STEP, -n * STEP):
            if any(
                (start.nominal + shift).date() != start.nominal.date() or start.instant + shift <= now
                for start in starts
            ):
                continue
            if any(after < start.instant + shift < until for start, taken in busy for after, until in taken):
                continue
            if has_room is None or all(
                has_room(number, start.instant + shift, start.instant + shift + mine)
                for number, start in enumerate(starts)
            ):
                return shift
    return None
