"""The figures beyond the thesis's five: why runs failed, how long missions take, waiting against running."""

from __future__ import annotations

from collections import Counter
from datetime import date, timedelta

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from app.domain.execution import Reason, ReasonCode, State, Trigger
from app.services.history.figures import MOST_CAUSES, Cause, causes, kind_of
from app.services.history.kpis import KpiFilter
from app.services.planning.durations import LEAST_BASELINE, Band, DayMedian, band, percentile
from tests.support.examples import examples
from tests.support.kpi_world import HELSINKI, NOON


def aborted(message: str) -> Reason:
    return Reason(ReasonCode.ROBOT_ABORTED, {"message": message})


# ---------------------------------------------------------------------- why runs failed
def test_the_most_frequent_cause_comes_first_with_its_share(world):
    for dock in (1, 2, 3):
        world.row(State.FAILED, dock, reason=aborted(f"Failed to reach goal position 'Dock {dock}'"))
    world.row(State.FAILED, 4, reason=Reason(ReasonCode.RETRY_LIMIT))
    world.row(State.FAILED, 5, trigger=Trigger.MANUAL, reason=Reason(ReasonCode.RETRY_LIMIT))
    world.row(State.COMPLETED, 6)
    world.row(State.SKIPPED, 7)
    world.afterwards()
    assert world.kpis.failures() == [
        Cause(
            ReasonCode.ROBOT_ABORTED,
            "Failed to reach goal position …",
            3,
            0.6,
            0.6,
            (("Dock 1", 1), ("Dock 2", 1), ("Dock 3", 1)),
        ),
        Cause(ReasonCode.RETRY_LIMIT, "", 2, 0.4, 1.0),
    ]
    assert world.kpis.failures(KpiFilter(end=NOON)) == []


@pytest.mark.parametrize(
    ("message", "kind"),
    [
        ("Failed to reach goal position 'Dock 3'", "Failed to reach goal position …"),
        ("Lost at 12.5, 3.1 after 40 s", "Lost at … after … s"),
        ('  Blocked \n by "Pallet"  ', "Blocked by …"),
        ("Stopped", "Stopped"),
    ],
)
def test_a_message_is_reported_without_what_is_particular(message, kind):
    assert kind_of(message) == kind


def test_rare_causes_are_summed_up_at_the_end():
    found = causes([("robot_aborted", name * 3, 10 - n) for n, name in enumerate("abcdefgh")])
    assert [cause.number for cause in found] == [10, 9, 8, 7, 6, 5, 4 + 3]
    assert found[-1].code is None
    assert found[-1].cumulative == 1.0
    assert len(found) == MOST_CAUSES + 1


COUNTED = st.lists(
    st.tuples(
        st.sampled_from([ReasonCode.ROBOT_ABORTED, ReasonCode.RETRY_LIMIT, ReasonCode.REFUSED, ReasonCode.VANISHED]),
        st.none() | st.sampled_from(["Lost", "Blocked 1", "Blocked 2", "'x'", "Wheel", "Brake", "Lift", "Laser"]),
        st.integers(1, 9),
    )
)


@given(COUNTED)
def test_causes_are_a_ranked_recount(counted):
    found = causes(counted)
    assert sum(cause.number for cause in found) == sum(number for *_, number in counted)
    named = [cause.number for cause in found if cause.code is not None]
    assert named == sorted(named, reverse=True)
    expected = Counter()
    for code, message, number in counted:
        expected[code, kind_of(message) if message and code is ReasonCode.ROBOT_ABORTED else ""] += number
    assert all(expected[cause.code, cause.words] == cause.number for cause in found if cause.code is not None)
    if found:
        assert found[-1].cumulative == pytest.approx(1.0)
        assert [cause.cumulative for cause in found] == pytest.approx(
            [sum(cause.share for cause in found[: n + 1]) for n in range(len(found))]
        )


# ---------------------------------------------------------------------- how long missions take
def test_a_mission_is_compared_with_what_it_took_before(world):
    for n in range(10):  # before: 100, 110 … 190 s
        world.row(State.COMPLETED, -100 - n, duration_s=100.0 + 10 * n)
    for hours, seconds in ((1, 200.0), (2, 210.0), (3, 230.0), (25, 190.0)):
        world.row(State.COMPLETED, hours, duration_s=seconds)
    world.row(State.FAILED, 4, duration_s=5.0)
    world.row(State.COMPLETED, 5, duration_s=60.0, mission="Collect", mission_guid="h", robot_id=2)
    world.afterwards()
    deliver, collect = world.kpis.trends(KpiFilter(start=NOON))
    assert (deliver.mission, deliver.count, deliver.median_s) == ("Deliver", 4, 200.0)
    assert deliver.usual == Band(10, 100.0, 140.0, 180.0)
    assert list(deliver.days) == [DayMedian(date(2026, 11, 23), 3, 210.0), DayMedian(date(2026, 11, 24), 1, 190.0)]
    assert deliver.is_longer
    assert (collect.mission, collect.count, collect.usual) == ("Collect", 1, None)
    assert [trend.mission for trend in world.kpis.trends(KpiFilter(start=NOON, robot_ids=[2]))] == ["Collect"]
    assert [trend.guid for trend in world.kpis.trends(KpiFilter(start=NOON), most=1)] == ["g"]


def test_a_mission_that_was_renamed_has_its_newest_name(world):
    world.row(State.COMPLETED, 1, duration_s=10.0, mission="Old name")
    world.row(State.COMPLETED, 2, duration_s=10.0, mission="New name")
    world.afterwards()
    assert [trend.mission for trend in world.kpis.trends()] == ["New name"]


def test_too_few_runs_say_nothing_about_what_is_usual():
    assert band([1.0] * (LEAST_BASELINE - 1)) is None
    assert band([]) is None


def test_waiting_is_set_against_running(world):
    for n, (queue, run) in enumerate(((10.0, 90.0), (30.0, 120.0), (20.0, None))):
        world.row(State.COMPLETED, n, submitted_at=NOON + timedelta(hours=n), robot_delay_s=queue, duration_s=run)
    world.afterwards()
    delays = world.kpis.delays()
    assert (len(delays.starts), sum(delays.runs)) == (3, 210.0)
    assert tuple(map(delays.value, ("queue", "run_half", "run_most"))) == (20, 90, 120)


# ---------------------------------------------------------------------- recounted
STATES = (State.COMPLETED, State.FAILED, State.CANCELLED, State.SKIPPED, State.EXECUTING)
ROWS = st.lists(
    st.tuples(
        st.sampled_from(STATES),
        st.integers(1, 3),
        st.integers(-300, 300),
        st.none() | st.floats(0, 5000),
        st.sampled_from(["g", "h", "i"]),
        st.sampled_from(["Lost at 1", "Lost at 2", None]),
        st.none() | st.floats(0, 60),
        st.sampled_from(list(Trigger)),
    ),
    max_size=40,
)


@examples(80, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=ROWS,
    start=st.none() | st.integers(-200, 200),
    robots=st.none() | st.lists(st.integers(1, 3), unique=True, max_size=2),
)
def test_sql_says_what_a_recount_says(world, rows, start, robots):
    world.empty()
    stored = []
    for state, robot, hours, seconds, guid, message, delay, trigger in rows:
        reason = (
            {"reason": aborted(message) if message else Reason(ReasonCode.RETRY_LIMIT)} if state is State.FAILED else {}
        )
        submitted = None if delay is None else NOON + timedelta(hours=hours, seconds=2)
        stored.append(
            world.row(
                state,
                hours,
                robot_id=robot,
                duration_s=seconds,
                mission_guid=guid,
                mission=guid.upper(),
                trigger=trigger,
                submitted_at=submitted,
                robot_delay_s=delay,
                **reason,
            )
        )
    begin = None if start is None else NOON + timedelta(hours=start)
    ours = [
        row
        for row in stored
        if row.ended_at is not None and row.ended_at <= NOON and (robots is None or row.robot_id in robots)
    ]
    counted = [row for row in ours if begin is None or row.ended_at >= begin]
    wanted = KpiFilter(start=begin, robot_ids=robots)

    failed = [row for row in counted if row.state is State.FAILED]
    assert sum(cause.number for cause in world.kpis.failures(wanted)) == len(failed)
    lost = sum(cause.number for cause in world.kpis.failures(wanted) if cause.words == "Lost at …")
    assert lost == sum(row.reason.code is ReasonCode.ROBOT_ABORTED for row in failed)

    done = [row for row in counted if row.state is State.COMPLETED and row.duration_s is not None]
    trends = {trend.guid: trend for trend in world.kpis.trends(wanted)}
    assert trends.keys() == {row.mission_guid for row in done}
    for guid, trend in trends.items():
        runs = [row for row in done if row.mission_guid == guid]
        assert (trend.count, trend.mission) == (len(runs), guid.upper())
        assert trend.median_s == percentile(sorted(row.duration_s for row in runs), 50)
        days = Counter(row.ended_at.astimezone(HELSINKI).date() for row in runs)
        assert {day.day: day.count for day in trend.days} == days
        for day in trend.days:
            of_day = sorted(row.duration_s for row in runs if row.ended_at.astimezone(HELSINKI).date() == day.day)
            assert day.median_s == percentile(of_day, 50)
        earlier = [
            row.duration_s
            for row in ours
            if row.state is State.COMPLETED
            and row.mission_guid == guid
            and begin is not None
            and row.ended_at < begin
            and row.duration_s is not None
        ]
        assert trend.usual == band(earlier)

    timed = [
        row
        for row in counted
        if row.trigger is Trigger.SCHEDULED and row.submitted_at and row.robot_delay_s is not None
    ]
    delays = world.kpis.delays(wanted)
    assert len(delays.starts) == len(timed)
    assert sum(delays.runs) == pytest.approx(sum(row.duration_s or 0 for row in timed))
    assert delays.value("queue") == percentile(sorted(row.robot_delay_s for row in timed), 50)
