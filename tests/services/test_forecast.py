"""The preview of a schedule that is not saved yet: starts, conflicts, clock changes, refusals; skipping the next start."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, date, datetime, time, timedelta

import pytest

from app.domain.execution import ReasonCode, State
from app.domain.models import Between, DayException, InvalidInput, Mission, Robot, Schedule
from app.services.catalogue.preview import ConcernCode
from app.services.planning.planned import ASSUMED_S
from tests.support.clock import VirtualClock
from tests.support.edits import skip_next, switch_robot
from tests.support.errors import raises
from tests.support.history import add_run

ZONE = "Europe/Helsinki"
NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)  # Friday, 14:38 in Helsinki


@pytest.fixture
def clock():
    return VirtualClock(NOW)


@pytest.fixture
def container(container):
    container.catalogue.change_settings(timezone=ZONE)
    container.catalogue.save_robot(Robot("Aino", "10.0.0.1", "scheduler"), "secret")
    container.catalogue.save_robot(Robot("Veikko", "10.0.0.2", "scheduler"), "secret")
    for name in ("Kits", "Empties"):
        container.catalogue.save_mission(Mission(name, f"guid-{name.lower()}"))
    return container


def draft(**values):
    return Schedule(
        **{
            "name": "",
            "robot_id": 1,
            "mission_id": 1,
            "start": datetime(2026, 11, 23, 6, 30),
            "timezone": ZONE,
            **values,
        }
    )


def preview(container, **values):
    return container.forecasts.of(draft(**values))


def plan(container, **values):
    return container.catalogue.save_schedule(draft(mission_id=2, **values))


def usually(container, mission_guid, seconds, robot_id=1):
    """One completed run that took so long."""
    at = NOW - timedelta(days=1)
    add_run(container, at, mission_guid=mission_guid, robot_id=robot_id, duration_s=seconds)


def codes(forecast):
    return [concern.code for concern in forecast.concerns]


# ---------------------------------------------------------------------- starts
def test_the_next_five_starts_skip_days_without_work(container):
    found = preview(container, recurrence="FREQ=DAILY", start=datetime(2026, 11, 20, 18, 0))
    assert [start.nominal.date() for start in found.starts] == [date(2026, 11, day) for day in (20, 23, 24, 25, 26)]
    assert found.usual_s is None
    assert codes(found) == []


def test_a_paused_schedule_has_no_start_in_its_pause(container):
    until = datetime(2026, 11, 24, 22, 0, tzinfo=UTC)  # midnight in Helsinki
    found = preview(container, recurrence="FREQ=DAILY", paused_until=until)
    assert [start.nominal.date().day for start in found.starts] == [25, 26, 27, 30, 1]
    assert [(concern.code, concern.details) for concern in found.concerns] == [(ConcernCode.PAUSED, {"until": until})]
    over = preview(container, recurrence="FREQ=DAILY", paused_until=NOW - timedelta(days=1))
    assert (over.starts[0].nominal.date().day, codes(over)) == (23, [])


OVER = {"start": datetime(2026, 11, 2, 6, 30), "recurrence": "FREQ=DAILY;UNTIL=20261110"}


@pytest.mark.parametrize(
    ("values", "code"),
    [({"recurrence": "FREQ=DAILY", "enabled": False}, ConcernCode.SWITCHED_OFF), (OVER, ConcernCode.NO_START)],
    ids=["switched off", "over"],
)
def test_a_schedule_without_a_start_says_why(container, values, code):
    found = preview(container, **values)
    assert (found.starts, codes(found)) == ((), [code])


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"start": datetime(2026, 11, 21, 6, 30)}, "start"),
        ({"recurrence": "FREQ=SECONDLY"}, "recurrence"),
        ({"recurrence": "FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=30"}, "recurrence"),
        ({"minimum_battery_percent": 120.0}, "minimum_battery_percent"),
        ({"recurrence": "FREQ=DAILY", "between": Between(time(8), time(9))}, "between"),
    ],
)
def test_what_cannot_be_is_refused_as_when_it_is_saved(container, values, field):
    with pytest.raises(InvalidInput) as caught:
        preview(container, **values)
    assert caught.value.field == field
    with raises(InvalidInput, text=caught.value.text):
        container.catalogue.save_schedule(draft(**values))


# ---------------------------------------------------------------------- conflicts
@pytest.mark.parametrize(
    ("other", "meets"),
    [
        ("06:10", True),  # still under way: it takes 25 min
        ("06:04", False),  # ended a minute before
        ("06:30", True),  # at the same time
        ("06:36", True),  # begins while this one runs: it takes 7 min
        ("06:38", False),
    ],
)
def test_a_conflict_is_found_by_the_learned_durations(container, other, meets):
    usually(container, "guid-kits", 420.0)
    usually(container, "guid-empties", 1500.0)
    hour, minute = map(int, other.split(":"))
    plan(container, start=datetime(2026, 11, 23, hour, minute), recurrence="FREQ=DAILY")
    found = preview(container)
    assert codes(found) == ([ConcernCode.OVERLAP] if meets else [])
    if meets:
        (concern,) = found.concerns
        begins = datetime(2026, 11, 23, hour - 2, minute, tzinfo=UTC)
        assert (concern.at, concern.details["mission"], concern.details["start"], concern.details["end"]) == (
            datetime(2026, 11, 23, 4, 30, tzinfo=UTC),
            "Empties",
            begins,
            begins + timedelta(seconds=1500),
        )


def type_duration(container, mission_id, minutes):
    mission = container.repositories.missions.get(container.db.read(), mission_id)
    container.catalogue.save_mission(replace(mission, usual_minutes=minutes))


def test_a_typed_duration_holds_until_a_run_on_that_robot_shows_it(container):
    plan(container, start=datetime(2026, 11, 23, 6, 40), recurrence="FREQ=DAILY")  # Empties, ten minutes later
    assert codes(preview(container)) == []  # five minutes are assumed
    type_duration(container, 1, 30)
    found = preview(container)
    assert (found.usual_s, found.usual.typed, codes(found)) == (1800.0, True, [ConcernCode.OVERLAP])
    usually(container, "guid-kits", 400.0, robot_id=2)  # of another robot: says nothing about this one
    assert preview(container).usual.typed
    usually(container, "guid-kits", 420.0)
    found = preview(container)
    assert (found.usual_s, found.usual.typed, codes(found)) == (420.0, False, [])


def test_the_typed_duration_of_the_other_mission_counts_as_much(container):
    plan(container, start=datetime(2026, 11, 23, 6, 10), recurrence="FREQ=DAILY")  # Empties, twenty minutes before
    assert codes(preview(container)) == []
    type_duration(container, 2, 25)
    (concern,) = preview(container).concerns
    assert (concern.code, concern.details["end"] - concern.details["start"]) == (
        ConcernCode.OVERLAP,
        timedelta(minutes=25),
    )


def test_plan_and_runs_under_way_know_the_typed_duration_and_that_it_is_one(container):
    type_duration(container, 2, 25)
    plan(container, start=datetime(2026, 11, 23, 6, 10), recurrence="FREQ=DAILY")

    def first():
        run = container.plan.next(1)[0]
        return run.usual.median_s, run.usual.slow_s, run.usual.typed

    assert first() == (1500.0, 1500.0, True)
    assert container.history.expected(1, "guid-empties").typed
    assert container.history.expected(1, "guid-kits") is None
    usually(container, "guid-empties", 600.0)
    assert first() == (600.0, 600.0, False)
    assert container.history.expected(1, "guid-empties").median_s == 600.0


def test_the_nearest_free_time_is_offered_and_is_free(container):
    usually(container, "guid-kits", 420.0)
    usually(container, "guid-empties", 1500.0)
    plan(container, start=datetime(2026, 11, 23, 6, 10), recurrence="FREQ=DAILY")  # until 06:35
    plan(container, start=datetime(2026, 11, 23, 6, 40), recurrence="FREQ=DAILY", name="next")  # until 07:05
    found = preview(container)  # 06:30, 7 min
    assert found.free_at == datetime(2026, 11, 23, 6, 0)
    assert codes(preview(container, start=found.free_at)) == []
    assert preview(container, start=datetime(2026, 11, 23, 9, 0)).free_at is None  # nothing in its way


def test_every_start_that_conflicts_is_reported_once(container):
    plan(container, start=datetime(2026, 11, 23, 6, 30), recurrence="FREQ=WEEKLY;BYDAY=MO,WE")
    plan(container, start=datetime(2026, 11, 23, 6, 31), recurrence="FREQ=DAILY", name="second")
    found = preview(container, recurrence="FREQ=DAILY")
    assert [concern.at.day for concern in found.concerns] == [23, 24, 25, 26, 27]


def test_all_starts_of_the_time_that_is_shown_are_compared(container):
    plan(container, start=datetime(2026, 11, 23, 6, 30), recurrence="FREQ=DAILY")
    often = draft(start=datetime(2026, 11, 23, 6, 30), recurrence="FREQ=DAILY")
    for days, starts in ((1, 5), (8, 6), (1000, 200)):
        until = datetime(2026, 11, 23, tzinfo=UTC) + timedelta(days=days)
        found = container.forecasts.of(often, until=until)
        assert (len(found.starts), len(found.concerns)) == (starts, starts)


def test_another_robot_itself_and_schedules_that_are_off_cause_no_overlap(container):
    plan(container, robot_id=2, recurrence="FREQ=DAILY", name="elsewhere")
    plan(container, recurrence="FREQ=DAILY", enabled=False, name="off")
    own = plan(container, recurrence="FREQ=DAILY", name="own")
    assert codes(container.forecasts.of(replace(own, start=datetime(2026, 11, 23, 6, 31)))) == []


def test_a_paused_schedule_overlaps_only_after_its_pause(container):
    plan(container, recurrence="FREQ=DAILY", paused_until=datetime(2026, 11, 23, 22, 0, tzinfo=UTC))
    assert codes(preview(container)) == []
    assert codes(preview(container, start=datetime(2026, 11, 24, 6, 31))) == [ConcernCode.OVERLAP]


def test_unknown_durations_count_as_five_minutes(container):
    plan(container, start=datetime(2026, 11, 23, 6, 26), recurrence="FREQ=DAILY")
    assert ASSUMED_S == 300
    assert codes(preview(container)) == [ConcernCode.OVERLAP]


# ---------------------------------------------------------------------- what else a person should know
def test_a_clock_change_is_reported_with_both_times(container):
    gap = preview(container, start=datetime(2027, 3, 28, 3, 30), respect_working_days=False)
    assert [(concern.code, concern.details["nominal"], concern.details["twice"]) for concern in gap.concerns] == [
        (ConcernCode.CLOCK_CHANGE, datetime(2027, 3, 28, 3, 30), False)
    ]
    assert gap.starts[0].instant == datetime(2027, 3, 28, 1, 30, tzinfo=UTC)  # 04:30 there
    twice = preview(container, start=datetime(2027, 10, 31, 3, 30), respect_working_days=False)
    assert [(concern.code, concern.details["twice"]) for concern in twice.concerns] == [
        (ConcernCode.CLOCK_CHANGE, True)
    ]
    assert codes(preview(container, start=datetime(2027, 3, 29, 3, 30))) == []


@pytest.mark.parametrize(
    ("days", "off", "instead"),
    [("SA", (5,), (0,)), ("FR,SA", (5,), (0, 4)), ("MO,SA,SU", (5, 6), (0,)), ("MO,FR", (), None)],
)
@pytest.mark.parametrize("every", ["WEEKLY", "DAILY"])
def test_chosen_days_of_the_week_that_are_no_working_days_are_a_finding_with_its_remedies(
    container, every, days, off, instead
):
    rule = f"FREQ={every};BYDAY={days}"
    concerns = preview(container, recurrence=rule).concerns
    details = {"weekdays": off, "all": len(off) == len(days.split(",")), "instead": instead}
    assert [(each.code, each.details) for each in concerns] == [(ConcernCode.WEEKDAYS_OFF, details)] * bool(off)
    assert codes(preview(container, recurrence=rule, respect_working_days=False)) == []
    names = ",".join(("MO", "TU", "WE", "TH", "FR")[day] for day in instead or ())
    assert not off or codes(preview(container, recurrence=f"FREQ={every};BYDAY={names}")) == []


@pytest.mark.parametrize(
    ("values", "instead"),
    [
        ({"start": datetime(2026, 11, 21, 6, 30), "recurrence": "FREQ=WEEKLY"}, (0,)),  # the Saturday of its start
        ({"recurrence": "FREQ=MONTHLY;BYDAY=1SA"}, ()),  # the first Monday may be another week
    ],
)
def test_a_rule_without_any_working_day_never_starts_and_has_no_free_time(container, values, instead):
    (concern,) = preview(container, **values).concerns
    assert (concern.code, concern.details["all"], concern.details["instead"]) == (
        ConcernCode.WEEKDAYS_OFF,
        True,
        instead,
    )
    assert container.forecasts.free_at(draft(**values)) is None


def test_a_one_time_start_on_a_day_off_names_the_next_working_day(container):
    container.catalogue.save_days(DayException("Audit", date(2026, 11, 23), date(2026, 11, 23)))
    for day, following in ((21, "2026-11-24"), (23, "2026-11-24")):
        with pytest.raises(InvalidInput) as caught:
            preview(container, start=datetime(2026, 11, day, 6, 30))
        assert (caught.value.field, caught.value.details["next"]) == ("start", following)


def test_a_first_day_without_work_a_robot_that_is_off_and_a_missing_mission_are_reported(container):
    switch_robot(container.catalogue, 2, False)
    found = container.forecasts.of(
        draft(robot_id=2, start=datetime(2026, 11, 21, 6, 30), recurrence="FREQ=DAILY"), {"other": "Other"}
    )
    assert codes(found) == [ConcernCode.ROBOT_OFF, ConcernCode.MISSION_MISSING, ConcernCode.DAY_OFF]
    assert codes(container.forecasts.of(draft(), {"guid-kits": "Kits"})) == []
    assert codes(container.forecasts.of(draft(), {})) == []  # it did not answer


def test_a_first_day_that_has_passed_says_nothing_about_when_it_begins(container):
    saturday = draft(start=datetime(2026, 11, 14, 6, 30), recurrence="FREQ=DAILY")
    assert codes(container.forecasts.of(saturday)) == []
    assert codes(container.forecasts.of(replace(saturday, start=datetime(2026, 11, 21, 6, 30)))) == [
        ConcernCode.DAY_OFF
    ]


# ---------------------------------------------------------------------- skipping
def test_skipping_writes_the_row_at_once_and_continues_with_the_start_after_it(container):
    schedule = plan(container, recurrence="FREQ=DAILY")
    assert skip_next(container, schedule.id) == datetime(2026, 11, 23, 4, 30, tzinfo=UTC)
    row = container.history.last_of_schedule(schedule.id)
    assert (row.state, row.reason.code, row.planned_at, row.ended_at) == (
        State.SKIPPED,
        ReasonCode.HOLD,
        schedule.next_at,
        schedule.next_at,
    )
    assert row.reason.details == {"skipped_at": NOW.isoformat()}
    after = container.repositories.schedules.get(container.db.read(), schedule.id)
    assert after.next_at == datetime(2026, 11, 24, 4, 30, tzinfo=UTC)
    assert after.changed_at == schedule.changed_at


def test_the_preview_names_the_skipped_starts_that_would_run_again(container):
    schedule = plan(container, recurrence="FREQ=DAILY")
    monday = skip_next(container, schedule.id)
    thursday = monday + timedelta(days=3)
    container.pausing.skip(schedule.id, thursday)
    found = container.forecasts.of(schedule)
    assert (found.skipped, [start.nominal.day for start in found.starts]) == ((monday, thursday), [24, 25, 27, 30, 1])
    assert (
        container.forecasts.of(replace(schedule, start=datetime(2026, 11, 23, 7, 30))).skipped == ()
    )  # its rule has them no more
    assert container.forecasts.of(replace(schedule, paused_until=thursday - timedelta(hours=1))).skipped == (thursday,)
    assert container.forecasts.of(replace(schedule, enabled=False)).skipped == ()
    assert preview(container, recurrence="FREQ=DAILY").skipped == ()  # another schedule


# ---------------------------------------------------------------------- the exception calendar
def test_days_that_the_calendar_closes_between_the_next_starts_are_reported_by_name(container):
    container.catalogue.save_days(DayException("Audit", date(2026, 11, 24), date(2026, 11, 25)))
    found = preview(container, recurrence="FREQ=DAILY")
    assert [concern.details["days"] for concern in found.concerns] == [
        ((date(2026, 11, 24), "Audit"), (date(2026, 11, 25), "Audit"))
    ]
    assert found.starts[1].nominal.date() == date(2026, 11, 26)
    assert preview(container, recurrence="FREQ=DAILY", respect_working_days=False).concerns == ()
    assert preview(container, recurrence="FREQ=WEEKLY;BYDAY=MO").concerns == ()


def test_a_first_day_that_is_closed_is_reported_by_name(container):
    container.catalogue.save_days(DayException("Audit", date(2026, 11, 23), date(2026, 11, 23)))
    [concern] = preview(container, recurrence="FREQ=DAILY").concerns
    assert (concern.code, concern.details) == (ConcernCode.DAY_OFF, {"day": date(2026, 11, 23), "name": "Audit"})
    with pytest.raises(InvalidInput, match="Audit"):
        preview(container)
