"""Runs of other schedules around the starts of a new one, against the plainest way to find them: one by one from the beginning."""

from __future__ import annotations

from datetime import UTC, datetime, time, timedelta
from itertools import takewhile

from hypothesis import given
from hypothesis import strategies as st

from app.domain.execution import DurationEstimate
from app.domain.models import Between, Mission, Robot, Schedule, Settings
from app.services.planning.overlaps import FURTHEST, STEP, find_overlaps, free_shift, lasts, neighbours
from app.services.planning.planned import PlannedRun, planned_run
from app.services.planning.recurrence import Occurrence, occurrences
from app.services.planning.working_days import WorkingCalendar
from tests.support.examples import examples

ZONE = "Europe/Helsinki"
NOW = datetime(2026, 10, 23, 9, 0, tzinfo=UTC)  # a Friday; clocks go back on Sunday
CALENDAR = WorkingCalendar(Settings(timezone=ZONE))
RULES = [
    "FREQ=DAILY",
    "FREQ=WEEKLY;BYDAY=MO,WE,FR",
    "FREQ=HOURLY;INTERVAL=6",
    "FREQ=MINUTELY;INTERVAL=7",
    "FREQ=MONTHLY;BYDAY=-1FR",
    None,
]
USUAL = st.none() | st.floats(60, 30_000).map(
    lambda seconds: DurationEstimate(seconds / 2, seconds, (seconds / 2, seconds))
)


@st.composite
def schedules(draw) -> Schedule:
    start = datetime(2026, 10, 20) + timedelta(minutes=draw(st.integers(0, 20_000)))
    rule = draw(st.sampled_from(RULES))
    between = Between(time(6), time(18)) if rule and "MINUTELY" in rule and draw(st.booleans()) else None
    schedule = Schedule("S", 1, 1, start, ZONE, rule, between=between, respect_working_days=draw(st.booleans()))
    first = next(occurrences(schedule, NOW, CALENDAR), None)
    return Schedule(**{**vars(schedule), "next_at": first and first.instant})


def runs(other: PlannedRun, end: datetime) -> list[datetime]:
    """All future ones before ``end``."""
    return [
        found.instant
        for found in takewhile(lambda found: found.instant < end, occurrences(other.schedule, NOW, CALENDAR))
    ]


@examples(80)
@given(draft=schedules(), usual=USUAL, others=st.lists(st.tuples(schedules(), USUAL), max_size=4))
def test_runs_that_meet_and_the_free_time_are_those_of_a_plain_search(draft, usual, others):
    starts = [start for start, _ in zip(occurrences(draft, NOW, CALENDAR), range(4), strict=False)]
    known = [
        planned_run(schedule.next_at, schedule, Robot("R1", "http://r1"), Mission(f"M{n}", "guid"), its)
        for n, (schedule, its) in enumerate(others)
        if schedule.next_at is not None
    ]
    near = neighbours(starts, usual, known, CALENDAR, ())
    until = max((start.instant for start in starts), default=NOW) + FURTHEST + lasts(usual)
    every = [(begins, begins + lasts(other.usual)) for other in known for begins in runs(other, until)]

    def in_the_way(at: datetime) -> list[datetime]:
        done = at + lasts(usual)
        return [begins for begins, ends in every if begins < done and at < ends]

    reported = {conflict.at: conflict.other.at for conflict in find_overlaps(starts, usual, near)}
    assert reported == {start.instant: min(met) for start in starts if (met := in_the_way(start.instant))}
    shifts = [sign * n * STEP for n in range(1, int(FURTHEST / STEP) + 1) for sign in (1, -1)]
    fitting = [shift for shift in shifts if all(stays(start, shift) for start in starts)]
    assert free_shift(starts, usual, near, NOW, lambda *_when: True) == next(
        (shift for shift in fitting if not any(in_the_way(start.instant + shift) for start in starts)), None
    )


def stays(start: Occurrence, shift: timedelta) -> bool:
    """On its day, in the future."""
    return (start.nominal + shift).date() == start.nominal.date() and start.instant + shift > NOW
