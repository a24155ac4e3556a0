"""KPIs by SQL against a plain recount in Python, and against figures worked out by hand."""

from __future__ import annotations

from datetime import UTC, date, datetime, timedelta

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger
from app.services.history.kpis import KpiFilter
from app.services.planning.durations import percentile
from tests.support.examples import examples
from tests.support.kpi_world import HELSINKI, NOON


# ---------------------------------------------------------------------- by hand
def test_without_history_nothing_is_claimed(world):
    kpis = world.kpis.facts()
    assert (kpis.value("success"), kpis.value("duration"), kpis.value("per_day"), kpis.recorded_days) == (
        None,
        None,
        None,
        0,
    )
    assert [(robot.robot, robot.mission_s, robot.value("utilisation")) for robot in kpis.robots] == [
        ("Aino", 0, None),
        ("Bella", 0, None),
    ]
    assert world.kpis.per_day() == []
    assert kpis.value("adherence") is None
    assert world.kpis.delays().value("delay_half") is None


def test_the_five_of_the_thesis(world):
    for hours, state, seconds in (
        (0, State.COMPLETED, 100.0),
        (1, State.COMPLETED, 200.0),
        (2, State.COMPLETED, None),
        (3, State.FAILED, 50.0),
        (24, State.CANCELLED, 30.0),
        (72, State.SKIPPED, None),
    ):
        world.row(state, hours, duration_s=seconds)
    world.row(State.COMPLETED, 25, robot_id=2, robot="Aino", duration_s=1000.0)
    world.row(State.EXECUTING, 25)
    world.clock.advance(4 * 86400)
    world.observe(1, "2026-11-23", executing=400.0, idle=3200.0, offline=9000.0)
    world.observe(2, "2026-11-24", executing=900.0)
    kpis = world.kpis.facts()
    assert (kpis.completed, kpis.failed, kpis.cancelled) == (4, 1, 1)
    assert kpis.value("success") == 4 / 5  # cancelled left out
    assert (kpis.timed, kpis.value("duration")) == (3, 1300 / 3)
    assert (kpis.recorded_days, kpis.value("per_day")) == (3, 4 / 3)
    assert kpis.mission_s == 1380
    aino, bella = kpis.robots
    assert (bella.robot, bella.completed, bella.failed, bella.cancelled, bella.mission_s, bella.observed_s) == (
        "Bella",
        3,
        1,
        1,
        380,
        3600,
    )
    assert (bella.value("utilisation"), aino.value("utilisation")) == (380 / 3600, 1.0)


def test_a_removed_robot_keeps_its_share_and_name(world):
    world.row(State.COMPLETED, duration_s=10.0, robot_id=9, robot="Old one")
    assert [(robot.robot_id, robot.robot, robot.mission_s) for robot in world.kpis.facts().robots] == [
        (2, "Aino", 0),
        (1, "Bella", 0),
        (9, "Old one", 10),
    ]


def test_days_are_local_days(world):
    world.row(State.COMPLETED, 9.9)  # 23:54 in Helsinki
    world.row(State.COMPLETED, 10.1)  # 00:06
    world.afterwards()
    assert world.kpis.facts().recorded_days == 2
    assert [(day.day, day.completed) for day in world.kpis.per_day()] == [
        (date(2026, 11, 23), 1),
        (date(2026, 11, 24), 1),
    ]


def test_a_day_of_25_hours_is_one_day(world):
    start = datetime(2026, 10, 24, 21, 0, tzinfo=UTC)  # midnight in Helsinki, the night of the change
    for hours in (0, 24.9):
        world.row(State.COMPLETED, planned_at=start + timedelta(hours=hours), ended_at=start + timedelta(hours=hours))
    assert [(day.day, day.completed) for day in world.kpis.per_day()] == [(date(2026, 10, 25), 2)]


def test_days_without_anything_are_zero_between_recorded_ones(world):
    world.row(State.COMPLETED, 0, duration_s=5.0)
    world.row(State.SKIPPED, 48)
    assert [day.day.day for day in world.kpis.per_day()] == [23]  # no future days
    world.afterwards()
    assert [(day.day.day, day.total, day.completed_s) for day in world.kpis.per_day()] == [
        (23, 1, 5.0),
        (24, 0, 0.0),
        (25, 1, 0.0),
    ]


def test_adherence_says_why_the_others_did_not_run(world):
    world.row(State.COMPLETED)
    world.row(State.FAILED)  # aborted by the robot: it ran
    world.row(State.FAILED, reason=Reason(ReasonCode.RETRY_LIMIT))
    world.row(State.CANCELLED, submitted_at=NOON)  # cancelled on the robot
    world.row(State.CANCELLED)  # cancelled while it waited
    for _ in range(2):
        world.row(State.SKIPPED)
    world.row(State.MISSED)
    world.row(State.COMPLETED, trigger=Trigger.MANUAL)
    world.row(State.WAITING)
    adherence = world.kpis.facts()
    assert (adherence.planned, adherence.ran, adherence.value("adherence")) == (8, 3, 3 / 8)
    assert list(adherence.not_run.items()) == [
        (ReasonCode.BATTERY_LOW, 2),
        (ReasonCode.RETRY_LIMIT, 1),
        (ReasonCode.USER_CANCELLED, 1),
        (ReasonCode.APP_DOWN, 1),
    ]


def test_delays_add_what_the_app_and_what_the_robots_queue_took(world):
    for number in range(1, 11):
        world.row(
            State.COMPLETED,
            number,
            submitted_at=NOON + timedelta(hours=number, seconds=number),
            robot_delay_s=10.0 * number,
        )
    world.row(State.COMPLETED, submitted_at=NOON)  # never seen to start
    world.row(State.COMPLETED, trigger=Trigger.MANUAL, submitted_at=NOON, robot_delay_s=1.0)
    world.afterwards()
    delays = world.kpis.delays()
    assert len(delays.starts) == 10
    assert (delays.value("delay_half"), delays.value("delay_most")) == (
        pytest.approx(55, abs=0.01),
        pytest.approx(99, abs=0.01),
    )
    assert (delays.value("accepted"), delays.value("queue")) == (pytest.approx(5, abs=0.01), 50)


@pytest.mark.parametrize(
    ("values", "percent", "expected"),
    [
        ([], 50, None),
        ([7], 50, 7),
        ([7], 90, 7),
        ([1, 2], 50, 1),
        ([1, 2, 3], 50, 2),
        (list(range(1, 101)), 90, 90),
        ([1, 2], 0, 1),
    ],
)
def test_percentiles_are_values_that_occurred(values, percent, expected):
    assert percentile(values, percent) == expected


# ---------------------------------------------------------------------- recounted
ROWS = st.lists(
    st.tuples(
        st.sampled_from(list(State)),
        st.integers(1, 4),
        st.integers(-600, 600),
        st.none() | st.floats(0, 5000),
        st.sampled_from(list(Trigger)),
    ),
    max_size=40,
)
ENDS = st.none() | st.integers(-400, 400)


@examples(120, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rows=ROWS, start=ENDS, end=ENDS, robots=st.none() | st.lists(st.integers(1, 4), unique=True, max_size=3))
def test_sql_says_what_a_recount_says(world, rows, start, end, robots):
    world.empty()
    stored = [
        world.row(state, hours, robot_id=robot, duration_s=seconds, trigger=trigger)
        for state, robot, hours, seconds, trigger in rows
    ]
    bounds = [None if hours is None else NOON + timedelta(hours=hours) for hours in (start, end)]
    wanted = KpiFilter(*bounds, robots)
    counted = [
        row
        for row in stored
        if row.ended_at is not None
        and row.ended_at <= NOON
        and (bounds[0] is None or row.ended_at >= bounds[0])
        and (bounds[1] is None or row.ended_at < bounds[1])
        and (robots is None or row.robot_id in robots)
    ]

    def of(state: State) -> list[Execution]:
        return [row for row in counted if row.state is state]

    days = {row.ended_at.astimezone(HELSINKI).date() for row in counted}
    timed = [row.duration_s for row in of(State.COMPLETED) if row.duration_s is not None]
    kpis = world.kpis.facts(wanted)
    assert [kpis.completed, kpis.failed, kpis.cancelled] == [
        len(of(state)) for state in (State.COMPLETED, State.FAILED, State.CANCELLED)
    ]
    assert (kpis.timed, kpis.completed_s) == (
        len(timed),
        pytest.approx(sum(timed), abs=1e-4),
    )  # days keep whole microseconds
    assert kpis.recorded_days == len(days)
    for robot in kpis.robots:
        own = [row.duration_s for row in counted if row.robot_id == robot.robot_id and row.duration_s is not None]
        assert robot.mission_s == pytest.approx(sum(own), abs=1e-4)
    assert {row.robot_id for row in counted} <= {robot.robot_id for robot in kpis.robots}

    per_day = world.kpis.per_day(wanted)
    assert {day.day for day in per_day if day.total} == days
    for name in State:
        if not name.is_open:
            assert sum(getattr(day, name) for day in per_day) == len(of(name))

    assert kpis.planned == sum(row.trigger is Trigger.SCHEDULED for row in counted)
    assert kpis.planned == kpis.ran + sum(kpis.not_run.values())
