"""Pause until: starts before it are skipped with their row, none of them runs, and the pause can be ended at any time."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, date, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain import reasons
from app.domain.execution import ReasonCode, State
from app.domain.models import InvalidInput, Overlap, Schedule
from app.services.history.kpis import KpiFilter
from app.services.history.shift_report import ReportPeriod
from app.services.live.downtime import Gap
from tests.support.edits import skip_next
from tests.support.errors import refuses
from tests.support.planner import insert_due
from tests.support.plant import NOW, Plant

WEDNESDAY = datetime(2026, 11, 25, tzinfo=UTC)


def at(day: int) -> datetime:
    """When the daily schedule starts on that day."""
    return datetime(2026, 11, day, 6, 30, tzinfo=UTC)


@pytest.fixture
def plant(tmp_path):
    plant = Plant(tmp_path)
    yield plant
    plant.container.close()


def planned(plant, count: int = 3) -> list[int]:
    return [run.at.day for run in plant.container.plan.next(count)]


def test_starts_of_a_pause_are_skipped_with_their_row_and_the_next_one_runs(plant):
    paused = plant.pausing.pause(plant.daily.id, WEDNESDAY)
    assert (paused.paused_until, plant.stored().paused_until) == (WEDNESDAY, WEDNESDAY)
    assert [run.at.date() for run in plant.container.plan.next(2)] == [date(2026, 11, 25), date(2026, 11, 26)]
    for day in (23, 24, 25):
        plant.go_to(at(day) + timedelta(seconds=1))
    assert [(row.state, row.reason and row.reason.code) for row in plant.rows()] == [
        (State.SKIPPED, ReasonCode.HOLD),
        (State.SKIPPED, ReasonCode.HOLD),
        (State.WAITING, None),
    ]
    assert reasons.sentence(plant.rows()[0].reason, "UTC") == "The schedule was paused until 25 Nov 2026"
    assert plant.container.alarms.open() == []  # who pauses a schedule knows it


def test_starts_of_a_pause_were_not_missed_when_the_app_was_off(plant):
    plant.pausing.pause(plant.daily.id, WEDNESDAY)
    plant.container.downtime.add(Gap(NOW, NOW + timedelta(days=4)))
    plant.go_to(NOW + timedelta(days=4))
    assert [(row.planned_at.day, row.state, row.starts) for row in plant.rows()] == [
        (24, State.SKIPPED, 2),
        (26, State.MISSED, 2),
    ]
    assert reasons.sentence(plant.rows()[0].reason, "UTC") == (
        "2 starts were not run, 23–24 November: the schedule was paused until 25 Nov 2026"
    )
    [alarm] = [alarm for alarm in plant.container.alarms.open() if alarm.code == "executions_missed"]
    assert alarm.details["count"] == 2


def test_it_survives_an_edit_of_the_schedule(plant):
    plant.pausing.pause(plant.daily.id, WEDNESDAY)
    plant.edit(name="Other")
    assert plant.stored().paused_until == WEDNESDAY


@pytest.mark.parametrize("until", [NOW, NOW - timedelta(days=1)])
def test_a_time_that_has_passed_is_refused(plant, until):
    with refuses("until"):
        plant.pausing.pause(plant.daily.id, until)
    assert plant.stored().paused_until is None


def test_a_deleted_schedule_is_reported(plant):
    plant.catalogue.remove_schedule(plant.daily.id)
    for act in (lambda: plant.pausing.pause(plant.daily.id, WEDNESDAY), lambda: plant.pausing.resume(plant.daily.id)):
        with pytest.raises(InvalidInput, match="schedule no longer exists"):
            act()


@pytest.mark.long
@given(st.integers(1, 14 * 24), st.integers(0, 14 * 24), st.integers(0, 23))
def test_nothing_runs_within_a_pause_and_every_start_has_one_row(
    tmp_path_factory, pause_hours, resume_after_hours, minute_hour
):
    """However long it is, and whenever it is ended: skipped exactly when it stood at that instant."""
    plant = Plant(tmp_path_factory.mktemp("plant"))
    until = NOW + timedelta(hours=pause_hours)
    plant.pausing.pause(plant.daily.id, until)
    resumed = NOW + timedelta(hours=resume_after_hours)
    for hour in range(15 * 24):
        moment = NOW + timedelta(hours=hour, minutes=35)
        if moment - timedelta(hours=1) < resumed <= moment:
            plant.clock.step((resumed - plant.clock.now()).total_seconds() if resumed > plant.clock.now() else 0)
            insert_due(plant.container)
            plant.pausing.resume(plant.daily.id)
        if hour % 24 == minute_hour or moment.hour == 6:
            plant.go_to(moment)
    rows = plant.rows()
    ends = min(until, resumed)
    assert len({row.planned_at for row in rows}) == len(rows)
    for row in rows:
        assert row.planned_at.weekday() < 5
        stood = row.planned_at < ends
        assert (
            row.state is State.SKIPPED and row.reason.code is ReasonCode.HOLD and "paused_until" in row.reason.details
        ) == stood
    plant.container.close()


# ---------------------------------------------------------------------- a skip is undone


def test_a_skip_of_a_start_that_the_plan_has_passed_over_is_not_undone(plant):
    """The clock was ahead when later starts were made, and has been set back since."""
    plant.pausing.skip(plant.daily.id, at(24))
    for day in (23, 25):
        plant.go_to(at(day) + timedelta(seconds=1))
    plant.clock.step(-30 * 3600)
    before = plant.rows()
    with pytest.raises(InvalidInput, match="passed"):
        plant.pausing.unskip(plant.daily.id, at(24))
    assert plant.rows() == before


def test_a_skip_whose_time_has_passed_stays(plant):
    skipped = skip_next(plant.container, plant.daily.id)
    plant.go_to(skipped + timedelta(minutes=1))
    with pytest.raises(InvalidInput, match="passed"):
        plant.pausing.unskip(plant.daily.id, skipped)
    assert [row.state for row in plant.rows()] == [State.SKIPPED]


def test_undoing_a_skip_leaves_a_schedule_off_that_was_switched_off_since(plant):
    skipped = skip_next(plant.container, plant.daily.id)
    plant.catalogue.switch_schedule(plant.daily.id, False)
    plant.pausing.unskip(plant.daily.id, skipped)
    assert plant.stored().next_at is None


# ---------------------------------------------------------------------- a later start is skipped
def test_a_later_start_is_skipped_and_only_that_one(plant):
    plant.pausing.skip(plant.daily.id, at(25))
    assert (plant.stored().next_at, planned(plant)) == (at(23), [23, 24, 26])
    assert [(row.planned_at, row.state, row.reason.code) for row in plant.rows()] == [
        (at(25), State.SKIPPED, ReasonCode.HOLD)
    ]
    for day in (23, 24, 25, 26):
        plant.go_to(at(day) + timedelta(seconds=1))
    assert {row.planned_at.day: row.state for row in plant.rows()} == {
        23: State.WAITING,
        24: State.SKIPPED,
        25: State.SKIPPED,
        26: State.SKIPPED,
    }  # 24, 26: the first one is still open
    assert [row.reason.code for row in plant.rows() if row.planned_at.day in (24, 25, 26)] == [
        ReasonCode.OVERLAP,
        ReasonCode.HOLD,
        ReasonCode.OVERLAP,
    ]
    assert len(plant.rows()) == 4


def test_undoing_a_later_skip_leaves_a_start_that_is_due_just_now(plant):
    plant.pausing.skip(plant.daily.id, at(24))
    plant.clock.step((at(23) + timedelta(seconds=1) - plant.clock.now()).total_seconds())  # and not planned yet
    plant.pausing.unskip(plant.daily.id, at(24))
    insert_due(plant.container)
    assert [(row.planned_at, row.state) for row in plant.rows()] == [(at(23), State.WAITING)]


def test_after_a_later_skip_comes_up_it_is_passed_over_by_the_next_one(plant):
    plant.pausing.skip(plant.daily.id, at(24))
    assert skip_next(plant.container, plant.daily.id) == at(23)
    assert (plant.stored().next_at, planned(plant)) == (at(25), [25, 26, 27])
    assert [row.planned_at for row in plant.rows()] == [at(23), at(24)]
    plant.pausing.unskip(plant.daily.id, at(23))
    assert (plant.stored().next_at, planned(plant)) == (at(23), [23, 25, 26])


def test_the_preview_and_its_warnings_omit_what_is_skipped(plant):
    plant.pausing.skip(plant.daily.id, at(24))
    assert [start.instant.day for start in plant.container.forecasts.of(plant.stored()).starts[:3]] == [23, 25, 26]
    other = Schedule("Other", 1, 1, datetime(2026, 11, 24, 6, 30), "UTC")
    assert plant.container.forecasts.of(other).concerns == ()
    other = replace(other, start=datetime(2026, 11, 25, 6, 30))
    assert [concern.code for concern in plant.container.forecasts.of(other).concerns] == ["overlap"]


@pytest.mark.parametrize("instant", [at(23) - timedelta(days=1), at(24) + timedelta(minutes=1), at(28)])
def test_only_what_is_planned_can_be_skipped(plant, instant):
    """Not what has passed, nor another time, nor a day without work."""
    with refuses("schedule"):
        plant.pausing.skip(plant.daily.id, instant)
    assert (plant.rows(), planned(plant, 1)) == ([], [23])


def test_a_one_time_start_that_is_skipped_is_over(plant):
    once = plant.catalogue.save_schedule(Schedule("Once", 1, 1, datetime(2026, 11, 24, 9, 0), "UTC"))
    nine = datetime(2026, 11, 24, 9, 0, tzinfo=UTC)
    plant.pausing.skip(once.id, nine)
    assert plant.catalogue.schedule(once.id).next_at is None
    plant.pausing.unskip(once.id, nine)
    assert plant.catalogue.schedule(once.id).next_at == nine


@given(st.lists(st.tuples(st.sampled_from(["skip", "again", "go"]), st.integers(0, 4)), max_size=12))
def test_whatever_is_skipped_and_taken_again_each_start_has_one_row_and_runs_exactly_if_it_is_not_skipped(
    tmp_path_factory, steps
):
    plant = Plant(tmp_path_factory.mktemp("plant"))
    plant.edit(overlap=Overlap.QUEUE)
    days, skipped = [at(day) for day in range(23, 28)], set()
    for action, n in steps:
        ahead, day = [day for day in days if day > plant.clock.now()], days[n]
        if action == "skip" and day in ahead:
            plant.pausing.skip(plant.daily.id, day)
            skipped.add(day)
        elif action == "again" and day in ahead:
            plant.pausing.unskip(plant.daily.id, day)
            skipped.discard(day)
        elif action == "go" and ahead:
            plant.go_to(ahead[0] + timedelta(seconds=1))
    for day in days:
        if day > plant.clock.now():
            plant.go_to(day + timedelta(seconds=1))
    assert {row.planned_at: row.state for row in plant.rows()} == {
        day: State.SKIPPED if day in skipped else State.WAITING for day in days
    }
    assert len(plant.rows()) == len(days)
    plant.container.close()


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"enabled": False}, "this schedule is switched off: switch it on first"),
        ({"start": datetime(2026, 11, 23, 8, 0)}, "this schedule no longer has this start"),
    ],
)
def test_a_skipped_start_that_would_not_run_all_the_same_is_not_planned_again(plant, change, why):
    plant.pausing.skip(plant.daily.id, at(24))
    plant.edit(**change)
    with pytest.raises(InvalidInput, match=why):
        plant.pausing.unskip(plant.daily.id, at(24), must_run=True)
    assert (plant.daily.id, at(24)) in plant.container.repositories.schedules.skips(
        plant.container.db.read(), [plant.daily.id]
    )


def test_a_skipped_start_of_a_pause_is_not_planned_again_before_the_pause_is_ended(plant):
    plant.pausing.skip(plant.daily.id, at(24))
    plant.pausing.pause(plant.daily.id, datetime(2026, 11, 30, tzinfo=UTC))
    with pytest.raises(InvalidInput, match="this schedule is paused beyond that start: resume it first"):
        plant.pausing.unskip(plant.daily.id, at(24), must_run=True)
    plant.pausing.resume(plant.daily.id)
    plant.pausing.unskip(plant.daily.id, at(24), must_run=True)
    assert plant.container.plan.next(2)[1].at == at(24)


# ---------------------------------------------------------------------- in the history
def test_a_start_skipped_ahead_counts_on_the_day_it_was_planned_for_and_not_before(plant):
    plant.go_to(at(23) + timedelta(seconds=1))
    [today] = plant.rows()
    plant.container.db.write(
        lambda c: plant.container.repositories.executions.change(
            c, today, [State.WAITING], state=State.COMPLETED, ended_at=plant.clock.now()
        )
    )
    tomorrow, kpis, now = skip_next(plant.container, plant.daily.id), plant.container.kpis, plant.clock.now()
    assert [(row.planned_at, row.ended_at) for row in plant.rows() if row.state is State.SKIPPED] == [
        (tomorrow, tomorrow)
    ]
    day_of_skip, day_of_start = (
        KpiFilter(end=datetime(2026, 11, 24, tzinfo=UTC)),
        KpiFilter(datetime(2026, 11, 24, tzinfo=UTC)),
    )
    for period in (KpiFilter(), day_of_skip, KpiFilter(now - timedelta(days=1))):
        assert (kpis.facts(period).planned, kpis.facts(period).value("adherence")) == (1, 1.0)
        assert [(day.day, day.total) for day in kpis.per_day(period)] == [(date(2026, 11, 23), 1)]
        assert kpis.not_completed(period) == []
    assert (kpis.facts(day_of_start).value("adherence"), kpis.facts().recorded_days) == (None, 1)
    report = plant.container.shift_reports.make(ReportPeriod.TODAY)
    assert (report.facts.skipped, report.runs, report.facts.planned) == (0, [], 1)

    plant.go_to(tomorrow + timedelta(seconds=1))
    assert kpis.facts(day_of_skip).value("adherence") == 1.0  # that day's figure never moves
    assert kpis.facts(day_of_start).not_run == {ReasonCode.HOLD: 1}
    report = plant.container.shift_reports.make(ReportPeriod.TODAY)
    assert (report.facts.skipped, [row.planned_at for row in report.runs], report.more_runs) == (1, [tomorrow], 0)


def test_an_undone_skip_leaves_no_figure(plant):
    plant.pausing.unskip(plant.daily.id, skip_next(plant.container, plant.daily.id))
    plant.clock.step(timedelta(days=1).total_seconds())
    assert (plant.container.kpis.facts().planned, plant.container.kpis.per_day()) == (0, [])
