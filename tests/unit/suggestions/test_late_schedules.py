"""Which schedules usually come late, and why."""

from __future__ import annotations

import pytest

from app.database.suggestions import PastRun
from app.domain.execution import ReasonCode
from app.services.suggestions.late_schedules import LATE_S, Cause, findings, is_late, is_usual

MINUTE, DAY = 60.0, 86_400.0
KITS = {1: 0.0}  # schedule 1, from the beginning


def run(day, minute, late=0.0, lasts=5.0, schedule=1, reason="", **values):
    """Planned at that minute of a day, on robot 1; without a reason it began ``late`` minutes after that."""
    planned = day * DAY + minute * MINUTE
    started = None if reason else planned + late * MINUTE
    ended = None if started is None else started + lasts * MINUTE
    kept = {"id": 0, "robot": 1, "trigger": "scheduled", "mission": f"Mission {schedule}", **values}
    return PastRun(schedule=schedule, reason=reason, planned=planned, started=started, ended=ended, **kept)


def weeks(days=20, late=9.0, every=1):
    """Schedule 1 at minute 450 of each day; until then a run of schedule 2 keeps the robot busy."""
    delays = [late if day % every == 0 else 0.0 for day in range(days)]
    return [
        each
        for day, delay in enumerate(delays)
        for each in (run(day, 440, lasts=10 + delay, schedule=2), run(day, 450, late=delay))
    ]


def seen(activity=""):
    return lambda _robot, _instant: activity


def test_a_schedule_that_is_late_behind_another_one_is_found_with_its_cause():
    [found] = findings(weeks(), KITS, seen())
    assert (found.schedule, found.starts, found.late, found.typical_s) == (1, 20, 20, 540.0)
    assert (found.cause, found.mission) == (Cause.BUSY, "Mission 2")


@pytest.mark.parametrize("runs", [weeks(days=9), weeks(late=4.9), weeks(every=6)])
def test_few_starts_small_delays_and_rare_ones_are_not_a_finding(runs):
    assert findings(runs, KITS, seen()) == []


def test_starts_before_it_was_what_it_is_do_not_count():
    assert findings(weeks(), {1: 11 * DAY}, seen()) == []
    assert findings(weeks(), {}, seen()) == []


def test_ten_starts_and_a_quarter_of_them_beyond_chance():
    assert [is_usual(late, 10) for late in range(11)] == [False] * 5 + [True] * 6
    assert not is_usual(9, 9)
    assert [next(late for late in range(n) if is_usual(late, n)) for n in (20, 100)] == [8, 31]


@pytest.mark.parametrize(
    ("activity", "cause"),
    [
        ("executing", Cause.OTHER),
        ("error", Cause.STOPPED),
        ("paused", Cause.STOPPED),
        ("offline", Cause.SILENT),
        ("idle", Cause.UNKNOWN),
        ("", Cause.UNKNOWN),
    ],
)
def test_the_observed_activity_is_the_cause_where_no_earlier_run_was_ahead(activity, cause):
    runs = [each for each in weeks() if each.schedule == 1]
    assert [found.cause for found in findings(runs, KITS, seen(activity))] == [cause]


def test_a_low_battery_is_a_cause_and_what_never_ran_has_no_typical_delay():
    runs = [run(day, 450, reason=ReasonCode.BATTERY_LOW) for day in range(20)]
    [found] = findings(runs, KITS, seen("executing"))
    assert (found.cause, found.typical_s) == (Cause.BATTERY, None)


def test_the_worst_comes_first():
    runs = [run(day, 450, late=9 * (day % 2)) for day in range(20)]
    runs += [run(day, 600, late=9, schedule=3) for day in range(20)]
    assert [found.schedule for found in findings(runs, {1: 0.0, 3: 0.0}, seen())] == [3, 1]


def test_late_means_more_than_five_minutes_or_not_at_all():
    starts = [run(0, 0, late=LATE_S / 60), run(0, 0, late=5.01), run(0, 0, reason=ReasonCode.OVERLAP)]
    assert [is_late(start) for start in starts] == [False, True, True]
