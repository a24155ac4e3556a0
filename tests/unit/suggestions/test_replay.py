"""What the last weeks would have been like otherwise: waits, late starts, harm, and what is suggested from it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.services.suggestions.find import Cause, Kind, Option, Rule, findings, is_usual, shifts
from app.services.suggestions.replay import DAY, LATE_S, NEXT_S, Busy, Past, Start
from tests.support.examples import examples

MINUTE = 60.0


def day(number, minute):
    return number * DAY + minute * MINUTE


def spans(days=20, wait=9.0, other="Waste"):
    """What robot 1 does then."""
    return [
        span
        for n in range(days)
        for span in (
            Busy(day(n, 440), day(n, 450 + wait), 2 * n + 2, day(n, 440), mission=other),
            Busy(day(n, 450 + wait), day(n, 455 + wait), 2 * n + 1, day(n, 450), mission="Kits"),
        )
    ]


def weeks(*, days=20, wait=9.0, every=1):
    """Kits (schedule 1) at minute 450 of each day on robot 1, which is busy until ``wait`` minutes later with a run of schedule 2."""
    starts = []
    for n in range(days):
        late = wait if n % every == 0 else 0.0
        starts.append(Start(2 * n + 1, 1, 1, day(n, 450), day(n, 450 + late), day(n, 455 + late)))
        starts.append(Start(2 * n + 2, 2, 1, day(n, 440), day(n, 440), day(n, 450 + late)))
    return Past(starts, {1: spans(days, wait), 2: []})


KITS = Rule(1, (1,), shifts(), (2,), ((7, (1, 2)),))


# ---------------------------------------------------------------------- findings
def test_a_schedule_that_is_late_behind_another_one_is_found_with_its_cause_and_what_would_have_helped():
    [found] = findings(weeks(), [KITS])
    assert (found.schedule, found.starts, found.late, found.typical_s) == (1, 20, 20, 540.0)
    assert (found.cause, found.mission, found.robot) == (Cause.BUSY, "Waste", 1)
    assert list(found.options) == [Option(Kind.TIME, 300.0, 0), Option(Kind.ROBOT, 2, 0), Option(Kind.GROUP, 7, 0)]


@pytest.mark.parametrize("past", [weeks(days=9), weeks(wait=4.9), weeks(every=6)])
def test_few_starts_small_delays_and_rare_ones_are_no_finding(past):
    assert findings(past, [KITS]) == []


def test_others_may_go_on_between_two_replays():
    paused = []
    findings(weeks(), [KITS, replace(KITS, id=2)], lambda: paused.append(1))
    assert len(paused) == len(KITS.shifts) + 2  # of the one that was late


def test_where_nothing_would_have_helped_nothing_is_said():
    assert findings(weeks(), [replace(KITS, shifts=(), others=(), groups=())]) == []


def test_ten_starts_and_a_quarter_of_them_beyond_chance():
    assert [is_usual(late, 10) for late in range(11)] == [False] * 5 + [True] * 6
    assert not is_usual(9, 9)
    assert [next(late for late in range(n) if is_usual(late, n)) for n in (20, 100)] == [8, 31]


def test_a_low_battery_is_a_cause_and_keeps_a_robot_from_being_proposed():
    starts = [Start(n + 1, 1, 1, day(n, 450), None, None, True) for n in range(20)]
    [found] = findings(Past(starts, {1: [], 2: []}), [KITS])
    assert (found.cause, found.typical_s) == (Cause.BATTERY, None)
    assert [option.kind for option in found.options] == [Kind.ROBOT, Kind.GROUP]  # the same battery within the hour
    tired = [Start(100 + n, 3, 2, day(n, 400), None, None, True) for n in range(20)]
    assert findings(Past(starts + tired, {1: [], 2: []}), [KITS]) == []


@pytest.mark.parametrize(("shift", "is_told"), [(600.0, True), (1200.0, True), (1500.0, False)])
def test_another_time_that_makes_others_late_is_none(shift, is_told):
    """Kits take 12 min; at minute 480 a third schedule is in time on that robot."""
    starts, busy = [], {1: []}
    for n in range(20):
        starts += [
            Start(3 * n + 1, 1, 1, day(n, 450), day(n, 459), day(n, 471)),
            Start(3 * n + 2, 3, 1, day(n, 480), day(n, 480), day(n, 490)),
        ]
        busy[1] += [
            Busy(day(n, 440), day(n, 459), why="other"),
            Busy(day(n, 459), day(n, 471), 3 * n + 1, day(n, 450)),
            Busy(day(n, 480), day(n, 490), 3 * n + 2, day(n, 480)),
        ]
    assert bool(findings(Past(starts, busy), [Rule(1, (1,), (shift,))])) == is_told


def test_what_helped_on_every_other_day_only_is_none():
    """On odd days the other robot was busy, too."""
    past = weeks()
    busy = {1: spans(), 2: [Busy(day(n, 440), day(n, 470), why="other") for n in range(1, 20, 2)]}
    assert findings(Past(past.of_schedule[1] + past.of_schedule[2], busy), [replace(KITS, shifts=())]) == []


@pytest.mark.parametrize(
    ("possible", "told"), [((600.0,), [600.0]), ((600.0, 900.0), []), ((300.0, 600.0, 900.0), [300.0])]
)
def test_a_time_next_to_one_that_would_not_have_helped_is_left_to_chance(possible, told):
    """10 min later it is free, 15 min later it is not."""
    past = weeks()
    busy = {1: spans() + [Busy(day(n, 464), day(n, 520), why="other") for n in range(20)], 2: []}
    found = findings(Past(past.of_schedule[1] + past.of_schedule[2], busy), [Rule(1, (1,), possible)])
    assert [option.value for one in found for option in one.options] == told


# ---------------------------------------------------------------------- whatever happened
@st.composite
def pasts(draw):
    """A few days of two robots that work their queues in order."""
    starts, busy, free = [], {1: [], 2: []}, {1: 0.0, 2: 0.0}
    times = draw(
        st.lists(
            st.tuples(
                st.integers(0, 3), st.integers(300, 600), st.integers(1, 2), st.integers(1, 40), st.integers(0, 4)
            ),
            min_size=1,
            max_size=30,
        )
    )
    for number, (n, minute, robot, lasts, schedule) in enumerate(sorted(times), 1):
        planned = day(n, minute)
        begins = max(planned, free[robot])
        free[robot] = begins + lasts * MINUTE
        busy[robot].append(Busy(begins, free[robot], number, planned))
        if schedule:
            starts.append(Start(number, schedule, robot, planned, begins, free[robot]))
    return Past(starts, busy), busy


@examples(120)
@given(pasts(), st.integers(1, 2), st.integers(0, 3), st.integers(280, 640), st.integers(0, 30))
def test_the_wait_is_that_of_a_plain_walk_through_the_queue(past, robot, n, minute, without):
    made, busy = past
    at = until = float(day(n, minute))
    for span in sorted(busy[robot]):
        is_ahead = span.planned <= at and (not without or span.start != without)
        if is_ahead and span.begins <= until + NEXT_S and span.ends > until:
            until = span.ends
    assert made.wait_s(robot, at, without) == until - at


@examples(120)
@given(pasts(), st.integers(1, 4))
def test_what_stays_as_it_was_is_at_most_as_late_as_it_was(past, schedule):
    """Its own run taken out, and nothing else changed: what was ahead of it is still ahead."""
    made, _ = past
    starts = made.of_schedule[schedule]
    robots = {start.robot for start in starts}
    if len(robots) == 1:
        replay = made.replay(schedule, 0.0, tuple(robots), 300.0)
        assert replay.number <= sum(start.is_late for start in starts)
        assert sum(replay.starts) == len(starts)


@examples(120)
@given(pasts(), st.integers(1, 4))
def test_any_of_two_robots_is_never_later_than_one_of_them(past, schedule):
    made, _ = past
    both = made.replay(schedule, 0.0, (1, 2), 300.0)
    assert all(both.number <= made.replay(schedule, 0.0, (robot,), 300.0).number for robot in (1, 2))


@examples(120)
@given(pasts(), st.integers(1, 4), st.integers(-12, 12), st.tuples(st.integers(0, 5), st.integers(0, 5)))
def test_a_replay_is_given_up_only_where_too_many_would_have_been_late(past, schedule, steps, most):
    made, _ = past
    whole = made.replay(schedule, steps * 300.0, (1,), 300.0)
    cut = made.replay(schedule, steps * 300.0, (1,), 300.0, most)
    assert cut == (whole if all(late <= limit for late, limit in zip(whole.late, most, strict=True)) else None)


def test_late_means_more_than_five_minutes():
    assert [Start(1, 1, 1, 0.0, started, None).is_late for started in (LATE_S, LATE_S + 0.1, None)] == [
        False,
        True,
        True,
    ]
