"""The Scheduler's form as plain values: every choice becomes the right rule, and what was opened comes back unchanged."""

from dataclasses import replace
from datetime import date, datetime, time

import pytest

from app.domain.models import WEEKDAYS, Between, InvalidInput, Overlap, Schedule, Settings
from app.screens.scheduler.draft import LAST, Draft, Kind, Unit
from app.services.planning.working_days import WorkingCalendar

MONDAY = date(2026, 11, 23)


def draft(**values):
    return Draft(
        **{"day": MONDAY, "at": time(6, 30), "timezone": "Europe/Helsinki", "mission_id": 1, "robot_id": 2, **values}
    )


def stored(**values):
    return Schedule(
        **{
            "name": "Morning",
            "robot_id": 2,
            "mission_id": 1,
            "start": datetime(2026, 11, 23, 6, 30),
            "id": 7,
            "timezone": "Europe/Helsinki",
            **values,
        }
    )


@pytest.mark.parametrize(
    ("values", "rule"),
    [
        ({"kind": Kind.ONCE}, None),
        ({"kind": Kind.DAILY}, "FREQ=DAILY"),
        ({"kind": Kind.DAILY, "last_day": date(2026, 12, 31)}, "FREQ=DAILY;UNTIL=20261231"),
        ({"kind": Kind.WEEKLY, "weekdays": ("FR", "MO")}, "FREQ=WEEKLY;BYDAY=MO,FR"),
        ({"kind": Kind.DAILY, "more_hours": (8, 14)}, "FREQ=DAILY;BYHOUR=6,8,14;BYMINUTE=30"),
        ({"kind": Kind.EVERY, "every": 30, "unit": Unit.MINUTES}, "FREQ=MINUTELY;INTERVAL=30"),
        (
            {"kind": Kind.EVERY, "every": 2, "unit": Unit.HOURS, "weekdays": ("MO", "TU")},
            "FREQ=HOURLY;INTERVAL=2;BYDAY=MO,TU",
        ),
        ({"kind": Kind.MONTHLY, "month_day": 15}, "FREQ=MONTHLY;BYMONTHDAY=15"),
        ({"kind": Kind.MONTHLY, "month_day": LAST}, "FREQ=MONTHLY;BYMONTHDAY=-1"),
        ({"kind": Kind.MONTHLY, "by_weekday": True, "nth": 1, "month_weekday": "MO"}, "FREQ=MONTHLY;BYDAY=1MO"),
        ({"kind": Kind.MONTHLY, "by_weekday": True, "nth": LAST, "month_weekday": "FR"}, "FREQ=MONTHLY;BYDAY=-1FR"),
    ],
)
def test_every_choice_becomes_its_rule_and_back(values, rule):
    chosen = draft(name="Morning", **values)
    schedule = chosen.schedule()
    assert schedule.recurrence == rule
    again = Draft.of(replace(schedule, id=7))
    assert {name: getattr(again, name) for name in values} == {
        name: tuple(day for day in WEEKDAYS if day in value) if name == "weekdays" else value
        for name, value in values.items()
    }


def test_every_runs_between_two_times_or_round_the_clock():
    between = draft(kind=Kind.EVERY, every=20, unit=Unit.MINUTES, at=time(8, 30), until_time=time(16, 45))
    assert between.schedule().between == Between(time(8, 30), time(16, 45))
    assert replace(between, all_day=True).schedule().between is None
    again = Draft.of(replace(between.schedule(), id=7))
    assert (again.at, again.until_time, again.all_day) == (time(8, 30), time(16, 45), False)
    once_a_day = replace(between, until_time=time(8, 30))
    assert once_a_day.schedule().between == Between(time(8, 30), time(8, 30))


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"mission_id": None}, "mission"),
        ({"robot_id": None}, "robot"),
        ({"kind": Kind.WEEKLY, "weekdays": ()}, "weekdays"),
        ({"kind": Kind.EVERY, "at": time(18), "until_time": time(17, 59)}, "until_time"),
        ({"kind": Kind.DAILY, "last_day": date(2026, 11, 22)}, "last_day"),
    ],
)
def test_what_cannot_be_is_said_at_its_field(values, field):
    with pytest.raises(InvalidInput) as caught:
        draft(**values).schedule()
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("recurrence", "between"),
    [
        (None, None),
        ("FREQ=DAILY", None),
        ("FREQ=WEEKLY", None),
        ("FREQ=WEEKLY;BYDAY=MO,WE", None),
        ("FREQ=WEEKLY;INTERVAL=2;BYDAY=MO", None),
        ("FREQ=DAILY;COUNT=5", None),
        ("FREQ=YEARLY", None),
        ("FREQ=MONTHLY;BYDAY=MO", None),
        ("FREQ=MONTHLY;BYMONTHDAY=1,15", None),
        ("FREQ=DAILY;UNTIL=20261231T120000Z", None),
        ("FREQ=DAILY;BYHOUR=6,14;BYMINUTE=0", None),
        ("FREQ=DAILY;BYHOUR=8,14", None),
        ("FREQ=DAILY;BYMINUTE=0,30", None),
        ("FREQ=MONTHLY;BYMONTHDAY=-2", None),
        ("FREQ=MINUTELY;INTERVAL=45", Between(time(8), time(16))),
        ("FREQ=HOURLY;INTERVAL=48", None),
        ("FREQ=MONTHLY", None),
    ],
)
def test_an_untouched_draft_is_the_schedule_it_came_from(recurrence, between):
    schedule = stored(
        recurrence=recurrence,
        between=between,
        parameters={"speed": 0.5},
        minimum_battery_percent=20,
        overlap=Overlap.QUEUE,
    )
    assert Draft.of(schedule).schedule() == schedule


def test_a_rule_the_form_cannot_say_survives_other_changes():
    schedule = stored(recurrence="FREQ=WEEKLY;INTERVAL=2;BYDAY=MO")
    opened = Draft.of(schedule)
    assert opened.kind is Kind.OTHER
    assert replace(opened, robot_id=3, at=time(7)).schedule() == replace(
        schedule, robot_id=3, start=datetime(2026, 11, 23, 7)
    )


def test_the_first_of_several_hours_is_where_it_begins():
    chosen = draft(kind=Kind.DAILY, at=time(10, 15), more_hours=(6, 14)).schedule()
    assert (chosen.start, chosen.recurrence) == (datetime(2026, 11, 23, 6, 15), "FREQ=DAILY;BYHOUR=6,10,14;BYMINUTE=15")


def test_editing_keeps_identity_and_a_copy_gets_a_new_one():
    opened = Draft.of(stored(recurrence="FREQ=DAILY"))
    edited = replace(opened, kind=Kind.WEEKLY, weekdays=("TU",)).schedule()
    assert (edited.id, edited.recurrence) == (7, "FREQ=WEEKLY;BYDAY=TU")
    copied = opened.copy().schedule()
    assert (copied.id, copied.name, copied.recurrence) == (0, "", "FREQ=DAILY")
    odd = stored(recurrence="FREQ=MINUTELY;INTERVAL=20;BYHOUR=8,9", between=Between(time(8), time(9, 40)))
    copied = Draft.of(odd).copy().schedule()
    assert (copied.id, copied.recurrence, copied.between) == (0, odd.recurrence, odd.between)


def test_a_new_draft_starts_at_the_next_hour_of_a_working_day():
    friday_evening = datetime(2026, 11, 20, 23, 10)
    settings = Settings(timezone="Europe/Helsinki")
    fresh = Draft.new(friday_evening, settings, WorkingCalendar(settings))
    assert fresh.start == datetime(2026, 11, 23, 0, 0)
    assert fresh.kind is Kind.ONCE
    assert Draft.new(datetime(2026, 11, 20, 14, 38), settings, WorkingCalendar(settings)).start == datetime(
        2026, 11, 20, 15, 0
    )
    assert Draft.new(datetime(2026, 11, 20, 14, 58), settings, WorkingCalendar(settings)).start == datetime(
        2026, 11, 20, 16, 0
    )


def test_the_monthly_choice_follows_the_first_day_until_it_is_chosen():
    fresh = draft(**Draft.derived(MONDAY))
    assert (fresh.month_day, fresh.nth, fresh.month_weekday) == (23, 4, "MO")
    moved = fresh.with_day(date(2026, 12, 31))
    assert (moved.month_day, moved.nth, moved.month_weekday) == (31, LAST, "TH")
    assert replace(fresh, month_day=15).with_day(date(2026, 12, 1)).month_day == 15


@pytest.mark.parametrize(
    ("values", "before", "after", "changed"),
    [
        ({}, "23 06:30", "25 07:10", {"day": date(2026, 11, 25), "at": time(7, 10)}),
        ({"kind": Kind.DAILY}, "24 06:30", "24 07:10", {"at": time(7, 10)}),
        (
            {"kind": Kind.DAILY, "more_hours": (14, 17)},
            "24 14:30",
            "24 15:10",
            {"at": time(6, 10), "more_hours": (15, 17)},
        ),
        (
            {"kind": Kind.DAILY, "more_hours": (14, 17)},
            "24 06:30",
            "24 08:30",
            {"at": time(8, 30), "more_hours": (14, 17)},
        ),
        (
            {"kind": Kind.WEEKLY, "weekdays": ("MO", "WE")},
            "25 06:30",
            "26 06:00",
            {"at": time(6), "weekdays": ("MO", "TH")},
        ),
        (
            {"kind": Kind.EVERY, "until_time": time(18)},
            "24 14:30",
            "24 14:50",
            {"at": time(6, 50), "until_time": time(18, 20)},
        ),
        (
            {"kind": Kind.EVERY, "until_time": time(23)},
            "24 14:30",
            "24 16:30",
            {"at": time(8, 30), "until_time": time(23, 59)},
        ),
        (
            {"kind": Kind.MONTHLY, "month_day": 23},
            "23 06:30",
            "24 06:30",
            {"month_day": 24, "nth": 4, "month_weekday": "TU"},
        ),
    ],
)
def test_a_start_that_is_moved_takes_along_what_is_ruled_with_it(values, before, after, changed):
    chosen, (old, new) = (
        draft(**values),
        (datetime.strptime(f"2026-11-{when}", "%Y-%m-%d %H:%M") for when in (before, after)),
    )
    moved = chosen.moved(old, new)
    assert {name: getattr(moved, name) for name in changed} == changed
    assert chosen.moved(old, old) == chosen


@pytest.mark.parametrize(
    ("rule", "before", "after", "begins"),
    [
        ("FREQ=MINUTELY;INTERVAL=20", "2026-11-24T10:32", "2026-11-24T14:50", "2026-11-23T07:10"),
        ("FREQ=MINUTELY;INTERVAL=20", "2026-11-24T10:32", "2026-11-23T10:25", "2026-11-23T07:05"),
        ("FREQ=HOURLY", "2026-11-24T10:12", "2026-11-24T16:30", "2026-11-23T07:30"),
        ("FREQ=HOURLY;INTERVAL=8", "2026-11-24T07:12", "2026-11-24T10:12", "2026-11-23T10:12"),
        (
            "FREQ=HOURLY;INTERVAL=24",
            "2026-11-24T07:12",
            "2026-11-24T20:12",
            "2026-11-23T20:12",
        ),  # not before the first day
    ],
)
def test_starts_round_the_clock_are_moved_by_half_an_interval_at_most(rule, before, after, begins):
    schedule = Schedule("S", 1, 1, datetime(2026, 11, 23, 7, 12), "Europe/Helsinki", rule, respect_working_days=False)
    before, after = map(datetime.fromisoformat, (before, after))
    assert Draft.of(schedule).starts_at(before, WorkingCalendar(Settings()))
    moved = Draft.of(schedule).moved(before, after)
    assert moved.schedule().start == datetime.fromisoformat(begins)
    assert moved.starts_at(after, WorkingCalendar(Settings()))


def test_a_start_moved_there_and_back_by_hand_changes_nothing():
    stored = Schedule("S", 1, 1, datetime(2026, 11, 23, 8), "Europe/Helsinki", "FREQ=DAILY")
    moved = Draft.of(stored).moved(datetime(2026, 11, 24, 8), datetime(2026, 11, 24, 9))
    assert not moved.is_stored
    assert replace(moved, at=time(8)).is_stored


@pytest.mark.parametrize(
    ("rule", "before", "after", "can"),
    [
        ("FREQ=DAILY", "2026-11-24T08:00", "2026-11-25T09:00", True),
        ("FREQ=WEEKLY;BYDAY=MO,WE", "2026-11-25T08:00", "2026-11-26T09:00", True),
        ("FREQ=DAILY;INTERVAL=2", "2026-11-25T08:00", "2026-11-26T08:00", False),
        ("FREQ=DAILY;BYHOUR=8,12;COUNT=10", "2026-11-24T12:00", "2026-11-24T15:00", False),
        ("FREQ=DAILY", "2026-11-23T08:00", "2026-11-22T08:00", False),
    ],
)
def test_a_start_can_be_dragged_only_where_the_rule_has_one_then(rule, before, after, can):
    schedule = Schedule("S", 1, 1, datetime(2026, 11, 23, 8), "Europe/Helsinki", rule, respect_working_days=False)
    draft = Draft.of(schedule).moved(datetime.fromisoformat(before), datetime.fromisoformat(after))
    assert draft.starts_at(datetime.fromisoformat(after), WorkingCalendar(Settings())) is can
