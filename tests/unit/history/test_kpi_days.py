"""What is kept per day of the history: always what a recount says, and long periods give the same as from the rows themselves."""

from __future__ import annotations

import sqlite3
from collections import Counter
from dataclasses import replace
from datetime import timedelta

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from app.database.executions import ExecutionRepository
from app.database.schema import _ENDED_DAYS, _FIGURES
from app.database.values import to_text
from app.domain.clock import midnight
from app.domain.execution import Reason, ReasonCode, State, Trigger
from app.services.history.kpis import KpiFilter, Kpis
from tests.support.clock import VirtualClock
from tests.support.examples import examples
from tests.support.kpi_world import HELSINKI, NOON, World
from tests.support.stored import bring_over, brought_up_to_date
from tests.unit.history.test_kpi import ROWS

ENDED = [state for state in State if not state.is_open]
CODES = {state: [code for code in ReasonCode if Reason(code).state is state] for state in ENDED}
CHANGES = st.lists(
    st.tuples(
        st.integers(0, 39),
        st.sampled_from(["state", "ended_at", "submitted_at", "duration_s", "gone"]),
        st.integers(-600, 600),
        st.sampled_from(ENDED),
    ),
    max_size=30,
)
KEPT = """SELECT day, robot_id, robot_group, is_scheduled, state, reason_code, is_submitted, number, timed, microseconds, starts
          FROM ended_days ORDER BY 1, 2, 3, 4, 5, 6, 7"""
COUNTED = """SELECT substr(ended_at, 1, 10), coalesce(robot_id, 0), robot_group, trigger = 'scheduled', state, coalesce(reason_code, ''),
             submitted_at IS NOT NULL, count(*), count(duration_s), coalesce(sum(CAST(round(duration_s * 1000000) AS INTEGER)), 0),
             sum(starts)
             FROM executions WHERE ended_at IS NOT NULL GROUP BY 1, 2, 3, 4, 5, 6, 7 ORDER BY 1, 2, 3, 4, 5, 6, 7"""


def is_true(c: sqlite3.Connection) -> bool:
    return [tuple(row) for row in c.execute(KEPT)] == [tuple(row) for row in c.execute(COUNTED)]


@examples(60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rows=ROWS, changes=CHANGES, starts=st.integers(1, 3000))
def test_daily_sums_always_equal_a_recount(world, rows, changes, starts):
    world.empty()
    stored = [
        world.row(
            state,
            hours,
            robot_id=robot,
            duration_s=seconds,
            trigger=trigger,
            starts=starts if state is State.MISSED else 1,
        )
        for state, robot, hours, seconds, trigger in rows
    ]
    assert is_true(world.db.read())
    for number, column, hours, state in changes:
        if number >= len(stored):
            continue
        at = to_text(NOON + timedelta(hours=hours))
        value = {"state": state.value, "duration_s": hours / 7}.get(column, at if hours % 5 else None)
        if column == "gone":
            world.db.write(lambda c, n=number: c.execute("DELETE FROM executions WHERE id = ?", (stored[n].id,)))
        else:
            world.db.write(
                lambda c, n=number, column=column, value=value: c.execute(
                    f"UPDATE executions SET {column} = ? WHERE id = ?", (value, stored[n].id)
                )
            )
        assert is_true(world.db.read())
    again = [replace(row, id=0) for row in stored if row.ended_at is not None]  # nothing is new, or everything again
    world.db.write(lambda c: ExecutionRepository().add_many(c, again))
    assert is_true(world.db.read())
    world.empty()
    assert world.db.read().execute("SELECT count(*) FROM ended_days").fetchone()[0] == 0


@pytest.mark.parametrize("step", [_ENDED_DAYS, _FIGURES], ids=["before there were days", "before days knew groups"])
def test_history_of_before_is_counted_when_the_database_is_brought_up_to_date(tmp_path, step):
    made, clock = World(tmp_path / "other"), VirtualClock(NOON)
    rows = [
        made.row(state, hours, duration_s=None if hours % 3 else hours * 1.5, robot_group="Hall" if hours % 2 else "")
        for hours in range(60)
        for state in (State.COMPLETED, State.FAILED, State.SKIPPED, State.WAITING)
    ]
    assert len(rows) == 240
    db = brought_up_to_date(tmp_path / "old.db", clock, step, lambda old: bring_over(made.db, old))
    made.db.close()
    assert is_true(db.read())
    assert db.read().execute("SELECT sum(number) FROM ended_days").fetchone()[0] == 180
    clock.step(timedelta(hours=60).total_seconds())
    assert Kpis(db, clock).facts().completed == 60
    db.close()


def test_adding_many_counts_rows_and_not_what_they_bring_along(world):
    row = world.row(State.COMPLETED)
    others = [replace(row, id=0, token=f"other {n}", schedule_id=100 + n) for n in range(3)]
    assert world.db.write(lambda c: ExecutionRepository().add_many(c, [replace(row, id=0), *others])) == 3
    assert world.db.write(lambda c: ExecutionRepository().add_many(c, [])) == 0


@examples(60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(
        st.tuples(
            st.sampled_from(ENDED),
            st.integers(0, 20),
            st.integers(1, 3),
            st.integers(-30_000, 30_000),
            st.booleans(),
            st.none() | st.floats(0, 5000),
            st.sampled_from(list(Trigger)),
        ),
        max_size=50,
    ),
    start=st.none() | st.integers(-30_000, 30_000),
    end=st.none() | st.integers(-30_000, 30_000),
    robots=st.none() | st.lists(st.integers(1, 3), unique=True, max_size=2),
)
def test_a_long_period_is_the_sum_of_its_days(world, rows, start, end, robots):
    """A local day of Helsinki has no whole UTC day in it, so its figures come from the rows. Minutes before and after noon."""
    world.empty()
    for state, code, robot, minutes, submitted, seconds, trigger in rows:
        codes = CODES[state]
        at = NOON + timedelta(minutes=minutes)
        world.row(
            state,
            minutes / 60,
            robot_id=robot,
            trigger=trigger,
            duration_s=seconds,
            ended_at=at,
            starts=1 + minutes % 7 if state is State.MISSED else 1,
            submitted_at=at if submitted else None,
            reason=Reason(codes[code % len(codes)]) if codes else None,
        )
    since, until = (None if minutes is None else NOON + timedelta(minutes=minutes) for minutes in (start, end))
    figures = world.kpis.facts(KpiFilter(since, until, robots))
    first, last = since or NOON - timedelta(days=22), until or NOON + timedelta(days=22)
    planned, ran, not_run, completed, failed, seconds = 0, 0, Counter(), 0, 0, 0.0
    day = first.astimezone(HELSINKI).date()
    while midnight(day, HELSINKI) < last:
        bounds = max(first, midnight(day, HELSINKI)), min(last, midnight(day + timedelta(days=1), HELSINKI))
        one = world.kpis.facts(KpiFilter(*bounds, robots))
        planned, ran, not_run = planned + one.planned, ran + one.ran, not_run + Counter(one.not_run)
        completed, failed, seconds = completed + one.completed, failed + one.failed, seconds + one.mission_s
        day += timedelta(days=1)
    assert (figures.planned, figures.ran, Counter(figures.not_run)) == (planned, ran, not_run)
    assert (figures.completed, figures.failed) == (completed, failed)
    assert figures.mission_s == pytest.approx(seconds, abs=1e-4)


def test_a_row_that_stands_for_many_starts_counts_as_many(world):
    world.row(State.MISSED, -1, starts=2016)
    world.row(State.COMPLETED, -1)
    [day] = world.kpis.per_day()
    assert (day.missed, day.completed) == (2016, 1)
    found = world.kpis.facts()
    assert (found.planned, found.ran, found.not_run) == (2017, 1, {ReasonCode.APP_DOWN: 2016})
    world.afterwards()
    assert world.kpis.facts().planned == 2017
