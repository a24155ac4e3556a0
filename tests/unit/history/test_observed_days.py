"""For how long robots were seen: one truth, which the states' timeline, the figures per day and the KPIs of a period all show."""

from __future__ import annotations

from datetime import date, datetime, timedelta

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from app.database import activities
from app.database.activities import ActivityRepository
from app.database.schema import _ACTIVITY_DAYS
from app.domain.activity import ACTIVITIES, NO_DATA, ActivitySpan, seen_seconds
from app.domain.clock import midnight
from app.domain.execution import State
from app.services.history.kpis import KpiFilter, Kpis
from app.services.history.runs import RobotStates
from tests.support.clock import VirtualClock
from tests.support.examples import examples
from tests.support.kpi_world import HELSINKI, NOON, World
from tests.support.stored import brought_up_to_date

DAY, TODAY = timedelta(days=1), date(2026, 11, 23)
BACK = 40  # days; a clock change is among them
SPANS = st.lists(
    st.tuples(st.sampled_from(ACTIVITIES), st.integers(-BACK * 24 * 60, 300), st.integers(1, 4000)),
    max_size=12,
    unique_by=lambda one: one[1],
)  # activity, minutes after noon, minutes
KEPT = activities.KEPT_FOR.days
PRUNED_AFTER = st.lists(st.integers(KEPT - BACK, KEPT), min_size=1, max_size=3).map(sorted)  # days
REPOSITORY = ActivityRepository()


def watched(world: World, spans: list[tuple[str, int, int]]) -> None:
    world.db.write(lambda c: c.execute("DELETE FROM activity_spans"))
    world.db.write(lambda c: c.execute("DELETE FROM activity_days"))
    starts = [NOON + timedelta(minutes=start) for _, start, _ in spans]
    world.watch(
        1,
        *(
            ActivitySpan(activity, at, at + timedelta(minutes=length))
            for at, (activity, _, length) in zip(starts, spans, strict=True)
        ),
    )


def prune(world: World, now: datetime, robot_id: int = 1) -> None:
    world.db.write(lambda c: REPOSITORY.prune(c, robot_id, now, HELSINKI))


def seconds(world: World, end: datetime = NOON, robot_id: int = 1) -> dict[date, dict[str, float]]:
    return REPOSITORY.seconds(world.db.read(), robot_id, midnight(TODAY - BACK * DAY, HELSINKI), end, HELSINKI)


def test_a_lengthened_span_takes_the_place_of_the_shorter_one(world):
    at = [NOON + timedelta(minutes=minutes) for minutes in range(5)]
    for end in at[1:4]:
        world.watch(1, ActivitySpan("idle", at[0], end))
    [_, bella] = RobotStates(world.db).timelines(at[0], at[4])
    whole = ActivitySpan("idle", at[0], at[3])
    assert list(bella.spans) == [whole, ActivitySpan(NO_DATA, at[3], at[4])]
    assert bella.at(at[1]) == whole
    assert bella.at(NOON + DAY) is None


def test_how_long_robots_ran_is_asked_of_all_at_once(world):
    """To the minute; what lies outside of the period is cut off, as of spans that begin before it or in the future."""

    def at(minutes):
        return NOON + timedelta(minutes=minutes)

    world.watch(
        1,
        ActivitySpan("executing", at(-300), at(-200)),
        ActivitySpan("executing", at(-90), at(-30.2)),
        ActivitySpan("idle", at(-30.2), at(-10)),
        ActivitySpan("executing", at(-10), at(-4.6)),
        ActivitySpan("executing", at(-1), at(60)),
        ActivitySpan("executing", at(70), at(80)),
    )
    world.watch(2, ActivitySpan("executing", at(-300), at(-200)), ActivitySpan("idle", at(-200), at(0)))
    world.watch(3, ActivitySpan("executing", at(-50), at(-10)))  # which has been removed
    assert REPOSITORY.hours_executing(world.db.read(), at(-60), NOON) == {1: pytest.approx((29.8 + 5.4 + 1 - 0.2) / 60)}
    assert REPOSITORY.hours_executing(world.db.read(), at(-240), NOON) == {
        1: pytest.approx(106 / 60),
        2: pytest.approx(40 / 60),
    }


@examples(60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(spans=SPANS)
def test_timeline_figures_per_day_and_kpis_agree_on_every_day(world, spans):
    watched(world, spans)
    first = TODAY - BACK * DAY
    days = [(one.day, one.robots[1].observed_s) for one in world.kpis.per_day(dates=[first, TODAY])]
    assert [day for day, _ in days] == [first + n * DAY for n in range(BACK + 1)]
    for day, observed_s in days:
        start, end = midnight(day, HELSINKI), min(midnight(day + DAY, HELSINKI), NOON)
        _, timeline = RobotStates(world.db).timelines(start, end)
        _, bella = world.kpis.facts(KpiFilter(start, midnight(day + DAY, HELSINKI))).robots
        expected = pytest.approx(seen_seconds(timeline.seconds))
        assert observed_s == expected
        assert (bella.observed_s, bella.charging_s) == (expected, pytest.approx(timeline.seconds.get("charging", 0.0)))
    assert world.kpis.facts().robots[1].observed_s == pytest.approx(sum(observed_s for _, observed_s in days))


@examples(60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(spans=SPANS, times=PRUNED_AFTER)
def test_pruned_spans_leave_their_sums(world, spans, times):
    watched(world, spans)
    before = seconds(world)
    for days in times:
        prune(world, NOON + days * DAY)
        after = seconds(world)
        assert after.keys() == before.keys()
        assert all(after[day] == pytest.approx(before[day]) for day in before)
    kept_from = midnight(TODAY + (times[-1] - KEPT) * DAY, HELSINKI)
    assert len(REPOSITORY.between(world.db.read(), 1, NOON - 2 * BACK * DAY, kept_from)) <= 1


def test_too_many_spans_keep_the_newest_days(world, monkeypatch):
    monkeypatch.setattr(activities, "KEPT_ROWS", 5)
    hour = timedelta(hours=1)
    for at in (NOON - back * DAY for back in (3, 2, 1, 0)):
        world.watch(1, ActivitySpan("idle", at, at + hour / 2), ActivitySpan("idle", at + hour, at + 1.5 * hour))
    before = seconds(world, NOON + DAY)
    prune(world, NOON + 2 * hour)
    assert [span.start for span in REPOSITORY.between(world.db.read(), 1, NOON - 9 * DAY, NOON + DAY)] == [
        NOON - 2 * DAY + hour,
        *(NOON - back * DAY + n * hour for back in (1, 0) for n in (0, 1)),
    ]
    assert seconds(world, NOON + DAY) == before
    monkeypatch.setattr(activities, "KEPT_ROWS", 1)
    prune(world, NOON + 2 * hour)  # today's stay, however many
    assert len(REPOSITORY.between(world.db.read(), 1, NOON, NOON + DAY)) == 2
    assert seconds(world, NOON + DAY) == before


def test_a_removed_robots_spans_become_sums_too(world):
    for robot_id in (1, 9):
        world.watch(
            robot_id,
            ActivitySpan("idle", NOON, NOON + timedelta(hours=1)),
            ActivitySpan("error", NOON + DAY, NOON + 2 * DAY),
        )
    world.row(State.COMPLETED, duration_s=60.0, robot_id=9, robot="Old one")
    prune(world, NOON + 200 * DAY, robot_id=2)
    assert [
        robot_id for robot_id in (1, 9) if len(REPOSITORY.between(world.db.read(), robot_id, NOON, NOON + 2 * DAY)) > 1
    ] == [1]
    world.clock.advance(200 * 86400)
    assert [robot.observed_s for robot in world.kpis.facts().robots] == [0.0, 90000.0, 90000.0]


def test_a_period_that_cuts_a_day_without_spans_leaves_that_day_out(world):
    world.watch(
        1, *(ActivitySpan("idle", NOON - back * DAY, NOON - back * DAY + timedelta(hours=1)) for back in (3, 2, 1, 0))
    )
    prune(world, NOON + activities.KEPT_FOR)
    [_, bella] = world.kpis.facts(KpiFilter(NOON - 2 * DAY + timedelta(minutes=30), NOON)).robots
    assert bella.observed_s == 3600


# ---------------------------------------------------------------------- databases of earlier versions
def test_sums_of_days_to_come_hide_nothing(world):
    """A clock that was a year ahead, and then two: what was seen in the first of them became sums."""
    year, at = timedelta(days=365), NOON + timedelta(hours=2)
    watched(world, [])
    world.watch(1, ActivitySpan("idle", NOON + year, at + year), ActivitySpan("idle", at + year, at + year + DAY))
    prune(world, NOON + 2 * year)
    assert world.db.read().execute("SELECT max(day) FROM activity_days").fetchone()[0] > "2027"
    world.watch(1, *(ActivitySpan("executing", NOON + n * DAY, at + n * DAY) for n in range(5)))
    kept = seconds(world, NOON + 6 * DAY)
    assert kept == {TODAY + n * DAY: {"executing": 7200.0} for n in range(5)}
    prune(world, NOON + (KEPT + 3) * DAY)
    assert seconds(world, NOON + 6 * DAY) == kept


def test_days_observed_before_there_were_spans_are_carried_over(tmp_path):
    begins = datetime(2026, 11, 10, 12, tzinfo=HELSINKI)  # of the spans, in the middle of a day

    def fill(c):
        c.execute("INSERT INTO settings VALUES ('timezone', '\"Europe/Helsinki\"')")
        c.executemany("INSERT INTO robots (id, name, address) VALUES (?, ?, '10.0.0.1')", [(1, "Aino"), (2, "Bella")])
        c.executemany(
            "INSERT INTO observed VALUES (?, ?, 'idle', ?)",
            [(robot, (TODAY - n * DAY).isoformat(), 36_000.0) for robot in (1, 2) for n in range(20)],
        )
        REPOSITORY.save(
            c, 1, [ActivitySpan("idle", begins + n * DAY, begins + n * DAY + timedelta(hours=1)) for n in range(13)]
        )

    clock = VirtualClock(NOON)
    db = brought_up_to_date(tmp_path / "old.db", clock, _ACTIVITY_DAYS, lambda old: old.write(fill))
    days = Kpis(db, clock).per_day(dates=[date(2026, 1, 1), TODAY - DAY])
    observed = [
        {day.day: day.robots[number].observed_s for day in days if day.robots[number].observed_s} for number in range(2)
    ]
    db.close()
    assert observed[1] == {TODAY - n * DAY: 36_000.0 for n in range(1, 20)}  # never had spans
    assert sorted(observed[0]) == [TODAY - n * DAY for n in range(19, 0, -1)]
    whole = [day for day, value in observed[0].items() if value == 36_000.0]
    assert (min(whole), max(whole)) == (
        date(2026, 11, 4),
        date(2026, 11, 11),
    )  # the day with the first spans was seen whole
    assert {value for day, value in observed[0].items() if day not in whole} == {3600.0}
