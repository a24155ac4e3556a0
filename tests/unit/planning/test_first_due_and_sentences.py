"""When a schedule begins to run after it was made or changed, and how it is put into words."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, time, timedelta

import pytest

from app.domain.models import Between, Schedule, Settings
from app.services.planning.planned import first_due
from app.services.planning.sentences import sentence
from app.services.planning.working_days import WorkingCalendar

SETTINGS = Settings()
CALENDAR = WorkingCalendar(SETTINGS)
START = datetime(2026, 11, 23, 6, 30)  # a Monday
AT = START.replace(tzinfo=UTC)


def schedule(recurrence: str | None = None, **values) -> Schedule:
    return replace(Schedule("S", 1, 1, START, "UTC", recurrence, respect_working_days=False), **values)


@pytest.mark.parametrize(
    ("window", "late", "due"),
    [
        (None, timedelta(days=-3), True),
        (None, timedelta(0), True),
        (None, timedelta(minutes=14, seconds=59), True),
        (None, timedelta(minutes=15), False),
        (60, timedelta(minutes=59), True),
        (0, timedelta(seconds=59), True),
        (0, timedelta(seconds=60), False),
    ],
)
def test_a_one_time_start_is_due_until_its_window_closes(window, late, due):
    found = first_due(schedule(start_window_minutes=window), SETTINGS, AT + late, CALENDAR)
    assert found == (AT if due else None)


@pytest.mark.parametrize(
    ("now", "expected"),
    [
        (AT - timedelta(days=3), AT),
        (AT, AT),
        (AT + timedelta(microseconds=1), AT + timedelta(days=1)),
        (AT + timedelta(days=400), AT + timedelta(days=400)),
    ],
)
def test_a_recurring_one_begins_with_its_first_instant_from_now_on(now, expected):
    assert first_due(schedule("FREQ=DAILY"), SETTINGS, now, CALENDAR) == expected


def test_a_schedule_that_is_off_or_over_is_never_due():
    assert first_due(schedule(enabled=False), SETTINGS, AT, CALENDAR) is None
    assert first_due(schedule("FREQ=DAILY;COUNT=2"), SETTINGS, AT + timedelta(days=2), CALENDAR) is None


def test_days_off_are_skipped():
    saturday, monday = AT + timedelta(days=5), AT + timedelta(days=7)
    assert first_due(schedule("FREQ=DAILY", respect_working_days=True), SETTINGS, saturday, CALENDAR) == monday


# ---------------------------------------------------------------------- words
@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        (None, "Once on 23 Nov 2026 at 06:30"),
        ("FREQ=DAILY", "Every day at 06:30"),
        ("FREQ=DAILY;INTERVAL=3;BYHOUR=6,14", "Every 3 days at 06:30, 14:30"),
        ("FREQ=WEEKLY;BYDAY=MO,WE,FR", "Every Mon, Wed, Fri at 06:30"),
        ("FREQ=WEEKLY;BYDAY=MO,TU,WE,TH,FR", "Every Mon–Fri at 06:30"),
        ("FREQ=WEEKLY;INTERVAL=2", "Every 2 weeks on Mon at 06:30"),
        ("FREQ=MONTHLY", "Every month on day 23 at 06:30"),
        ("FREQ=MONTHLY;BYMONTHDAY=-1", "Every month on the last day at 06:30"),
        ("FREQ=MONTHLY;BYDAY=2MO", "Every month on the second Mon at 06:30"),
        ("FREQ=YEARLY", "Every year on day 23 of November at 06:30"),
        ("FREQ=HOURLY;INTERVAL=2;COUNT=5", "Every 2 hours, 5 times"),
        ("FREQ=DAILY;BYMONTH=1,2;UNTIL=20271231", "Every day at 06:30, in January, February, until 31 Dec 2027"),
        ("FREQ=NONSENSE", "FREQ=NONSENSE"),
    ],
)
def test_a_schedule_in_words(rule, expected):
    assert sentence(schedule(rule)) == expected


@pytest.mark.parametrize(
    ("rule", "ending"),
    [
        ("FREQ=MONTHLY;BYMONTHDAY=31", "at 06:30, not in February, April, June, September, November"),
        ("FREQ=MONTHLY;BYMONTHDAY=-31", ", not in February, April, June, September, November"),
        ("FREQ=MONTHLY;BYMONTHDAY=30", "at 06:30, not in February"),
        ("FREQ=MONTHLY;BYMONTHDAY=29", "at 06:30, in February in leap years only"),
        ("FREQ=MONTHLY;BYMONTHDAY=28", "at 06:30"),
        ("FREQ=MONTHLY;BYMONTHDAY=15,31", "at 06:30"),
        ("FREQ=MONTHLY;BYMONTHDAY=-1", "at 06:30"),
        ("FREQ=MONTHLY;INTERVAL=2;BYMONTHDAY=31", "at 06:30, not in September, November"),  # begins in November
        ("FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=29", ", in leap years only"),
        ("FREQ=MONTHLY;BYMONTH=3,4;BYMONTHDAY=31;UNTIL=20271231", "in March, April, not in April, until 31 Dec 2027"),
        ("FREQ=MONTHLY;BYMONTHDAY=31;BYDAY=MO", "at 06:30"),
    ],
)
def test_months_that_do_not_have_the_day_are_said(rule, ending):
    assert sentence(schedule(rule)).endswith(ending)


def test_the_part_of_the_day_and_days_off_are_said():
    rule = schedule(
        "FREQ=MINUTELY;INTERVAL=30;BYDAY=MO", between=Between(time(8, 30), time(16, 45)), respect_working_days=True
    )
    assert sentence(rule) == "Every 30 minutes from 08:30 to 16:45, on Mon, on working days only"


def test_words_are_translated_piece_by_piece():
    german = {"Every {days}": "Jeden {days}", "Mon": "Mo", "{every} at {times}": "{every} um {times}"}
    assert sentence(schedule("FREQ=WEEKLY;BYDAY=MO"), lambda text: german.get(text, text)) == "Jeden Mo um 06:30"
