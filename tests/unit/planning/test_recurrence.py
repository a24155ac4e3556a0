"""Rules read, and the instants that the contract and the table of clock changes demand, case by case."""

from __future__ import annotations

from datetime import UTC, date, datetime, time, timedelta
from itertools import islice, pairwise
from zoneinfo import ZoneInfo

import pytest

from app.domain.models import WEEKDAYS, Between, InvalidInput, Schedule, Settings
from app.services.planning.recurrence import Frequency, Recurrence, check_has_instants, next_occurrence, occurrences
from app.services.planning.working_days import WorkingCalendar

EVERY_DAY = WorkingCalendar(Settings(working_days=WEEKDAYS))
MONDAY_TO_FRIDAY = WorkingCalendar(Settings())
LONG_AGO = datetime(1970, 1, 1, tzinfo=UTC)


def schedule(
    start: str,
    recurrence: str | None = None,
    zone: str = "Europe/Helsinki",
    respects: bool = False,
    between: tuple[str, str] | None = None,
) -> Schedule:
    part = Between(*map(time.fromisoformat, between)) if between else None
    return Schedule(
        "S", 1, 1, datetime.fromisoformat(start), zone, recurrence, between=part, respect_working_days=respects
    )


def utc(text: str) -> datetime:
    return datetime.fromisoformat(text).replace(tzinfo=UTC)


def starts(
    source: Schedule, after: str | datetime = LONG_AGO, number: int = 100, calendar: WorkingCalendar = EVERY_DAY
) -> list[str]:
    """The next instants in UTC, as text; one that was moved by a clock change with a star."""
    after = utc(after) if isinstance(after, str) else after
    found = islice(occurrences(source, after, calendar), number)
    return [f"{o.instant:%Y-%m-%d %H:%M}{'*' if o.moved else ''}" for o in found]


# ---------------------------------------------------------------------- rules
def test_a_rule_is_read_into_numbers():
    rule = Recurrence.parse(
        "freq=monthly;interval=2;byday=-1fr,2mo;bymonthday=-1,1;bymonth=3,1;byhour=6;byminute=30,0;count=9"
    )
    assert rule == Recurrence(Frequency.MONTHLY, 2, (1, 3), (-1, 1), ((-1, 4), (2, 0)), (6,), (0, 30), 9)
    assert Recurrence.parse(None).frequency is Frequency.ONCE


@pytest.mark.parametrize(
    ("text", "until"),
    [
        ("20261231", datetime(2026, 12, 31, 23, 59, 59, 999999)),
        ("20261231T160000", datetime(2026, 12, 31, 16)),
        ("20261231T160000Z", datetime(2026, 12, 31, 16, tzinfo=UTC)),
    ],
)
def test_until_is_local_time_utc_or_a_whole_day(text, until):
    assert Recurrence.parse(f"FREQ=DAILY;UNTIL={text}").until == until


@pytest.mark.parametrize(
    ("rule", "problem"),
    [
        ("", "null"),
        ("  ", "null"),
        ("RRULE:FREQ=DAILY", "without RRULE:"),
        ("FREQ=SECONDLY", "MINUTELY"),
        ("FREQ=ONCE", "MINUTELY"),
        ("FREQ=FORTNIGHTLY", "FORTNIGHTLY"),
        ("INTERVAL=2", "needs FREQ"),
        ("FREQ=DAILY;BYSETPOS=1", "BYSETPOS"),
        ("FREQ=DAILY;WKST=MO", "WKST"),
        ("FREQ=DAILY;BYSECOND=0", "BYSECOND"),
        ("FREQ=YEARLY;BYYEARDAY=1", "BYYEARDAY"),
        ("FREQ=YEARLY;BYWEEKNO=1", "BYWEEKNO"),
        ("FREQ=DAILY;DTSTART=20260101", "DTSTART"),
        ("FREQ=DAILY;", "''"),
        ("FREQ", "FREQ"),
        ("FREQ=DAILY;FREQ=DAILY", "twice"),
        ("FREQ=DAILY;INTERVAL=0", "INTERVAL takes 1 to"),
        ("FREQ=DAILY;INTERVAL=-1", "INTERVAL"),
        ("FREQ=DAILY;INTERVAL=1,2", "one number"),
        ("FREQ=DAILY;INTERVAL=x", "'X'"),
        ("FREQ=DAILY;COUNT=0", "COUNT"),
        ("FREQ=DAILY;COUNT=1;UNTIL=20261231", "not by both"),
        ("FREQ=DAILY;UNTIL=2026-12-31", "UNTIL"),
        ("FREQ=DAILY;UNTIL=20260230", "UNTIL"),
        ("FREQ=DAILY;UNTIL=20261231T250000", "UNTIL"),
        ("FREQ=DAILY;BYHOUR=24", "BYHOUR takes 0 to 23"),
        ("FREQ=DAILY;BYMINUTE=60", "BYMINUTE"),
        ("FREQ=DAILY;BYMONTH=13", "BYMONTH"),
        ("FREQ=MONTHLY;BYMONTHDAY=0", "BYMONTHDAY"),
        ("FREQ=MONTHLY;BYMONTHDAY=32", "BYMONTHDAY"),
        ("FREQ=WEEKLY;BYDAY=XX", "'XX'"),
        ("FREQ=WEEKLY;BYDAY=", "BYDAY"),
        ("FREQ=WEEKLY;BYDAY=2MO", "FREQ=MONTHLY"),
        ("FREQ=DAILY;BYDAY=1MO", "FREQ=MONTHLY"),
        ("FREQ=MONTHLY;BYDAY=6MO", "6th"),
        ("FREQ=YEARLY;BYDAY=54MO", "BYDAY"),
        ("FREQ=WEEKLY;BYMONTHDAY=1", "BYMONTHDAY"),
        ("FREQ=DAILY;BYHOUR=１", "BYHOUR"),
        ("FREQ=DAILY;INTERVAL=" + "9" * 5000, "INTERVAL"),
    ],
)
def test_an_invalid_rule_is_reported_in_one_sentence(rule, problem):
    with pytest.raises(InvalidInput) as caught:
        Recurrence.parse(rule)
    assert caught.value.field == "recurrence"
    assert problem in caught.value.text
    assert "\n" not in caught.value.text
    assert len(caught.value.text) < 250


@pytest.mark.parametrize(
    "rule",
    [
        "FREQ=DAILY;BYMONTH=2;BYMONTHDAY=30",
        "FREQ=MONTHLY;BYMONTHDAY=31;BYDAY=1MO",
        "FREQ=YEARLY;BYMONTH=4;BYMONTHDAY=31",
        "FREQ=DAILY;INTERVAL=7;BYDAY=TU",
        "FREQ=MONTHLY;INTERVAL=12;BYMONTH=3",
        "FREQ=YEARLY;INTERVAL=4;BYMONTH=2;BYMONTHDAY=29",
        "FREQ=MINUTELY;BYMONTH=2;BYMONTHDAY=30",
        "FREQ=DAILY;UNTIL=20261122",
        "FREQ=DAILY;UNTIL=20261123T033000Z",
        "FREQ=WEEKLY;BYDAY=TU;UNTIL=20261123",
    ],
)
def test_a_rule_that_never_comes_is_an_error(rule):
    with pytest.raises(InvalidInput, match="has no start"):
        check_has_instants(schedule("2026-11-23T06:30", rule))


@pytest.mark.parametrize(
    "rule",
    [
        None,
        "FREQ=DAILY;UNTIL=20261123",
        "FREQ=DAILY;UNTIL=20261123T043000Z",
        "FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=29",
        "FREQ=MINUTELY;INTERVAL=1440;BYHOUR=6",
        "FREQ=DAILY;BYDAY=MO;BYMONTH=2;BYMONTHDAY=29",
        "FREQ=YEARLY;BYDAY=53FR",
    ],
)
def test_a_rule_that_comes_rarely_or_once_is_none(rule):
    check_has_instants(schedule("2026-11-23T06:30", rule))


def test_a_rule_wholly_in_the_past_is_valid_and_has_nothing_left():
    past = schedule("2020-01-01T06:30", "FREQ=DAILY;COUNT=3")
    check_has_instants(past)
    assert next_occurrence(past, utc("2026-11-23"), EVERY_DAY) is None


# ---------------------------------------------------------------------- the kinds
@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        (None, ["2026-11-23 04:30"]),
        ("FREQ=DAILY", ["2026-11-23 04:30", "2026-11-24 04:30", "2026-11-25 04:30"]),
        ("FREQ=DAILY;INTERVAL=3", ["2026-11-23 04:30", "2026-11-26 04:30", "2026-11-29 04:30"]),
        ("FREQ=WEEKLY", ["2026-11-23 04:30", "2026-11-30 04:30", "2026-12-07 04:30"]),
        ("FREQ=WEEKLY;BYDAY=MO,WE,FR", ["2026-11-23 04:30", "2026-11-25 04:30", "2026-11-27 04:30"]),
        ("FREQ=WEEKLY;INTERVAL=2;BYDAY=SU,MO", ["2026-11-23 04:30", "2026-11-29 04:30", "2026-12-07 04:30"]),
        ("FREQ=WEEKLY;BYDAY=TU", ["2026-11-24 04:30", "2026-12-01 04:30", "2026-12-08 04:30"]),
        ("FREQ=MONTHLY", ["2026-11-23 04:30", "2026-12-23 04:30", "2027-01-23 04:30"]),
        ("FREQ=MONTHLY;BYMONTHDAY=31", ["2026-12-31 04:30", "2027-01-31 04:30", "2027-03-31 03:30"]),
        ("FREQ=MONTHLY;BYMONTHDAY=-1", ["2026-11-30 04:30", "2026-12-31 04:30", "2027-01-31 04:30"]),
        ("FREQ=MONTHLY;BYDAY=1MO", ["2026-12-07 04:30", "2027-01-04 04:30", "2027-02-01 04:30"]),
        ("FREQ=MONTHLY;BYDAY=-1FR", ["2026-11-27 04:30", "2026-12-25 04:30", "2027-01-29 04:30"]),
        ("FREQ=MONTHLY;BYDAY=FR;BYMONTHDAY=13", ["2027-08-13 03:30", "2028-10-13 03:30", "2029-04-13 03:30"]),
        ("FREQ=YEARLY", ["2026-11-23 04:30", "2027-11-23 04:30", "2028-11-23 04:30"]),
        ("FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=29", ["2028-02-29 04:30", "2032-02-29 04:30", "2036-02-29 04:30"]),
        ("FREQ=YEARLY;BYMONTH=1;BYDAY=1MO", ["2027-01-04 04:30", "2028-01-03 04:30", "2029-01-01 04:30"]),
        ("FREQ=DAILY;BYHOUR=6,14", ["2026-11-23 04:30", "2026-11-23 12:30", "2026-11-24 04:30"]),
        ("FREQ=DAILY;BYHOUR=5,6;BYMINUTE=0,45", ["2026-11-23 04:45", "2026-11-24 03:00", "2026-11-24 03:45"]),
        ("FREQ=HOURLY;INTERVAL=8", ["2026-11-23 04:30", "2026-11-23 12:30", "2026-11-23 20:30"]),
        ("FREQ=HOURLY;BYMINUTE=0,45", ["2026-11-23 04:45", "2026-11-23 05:00", "2026-11-23 05:45"]),
        ("FREQ=MINUTELY;INTERVAL=90", ["2026-11-23 04:30", "2026-11-23 06:00", "2026-11-23 07:30"]),
        ("FREQ=MINUTELY;INTERVAL=20;BYHOUR=7;BYDAY=TU", ["2026-11-24 05:10", "2026-11-24 05:30", "2026-11-24 05:50"]),
    ],
)
def test_the_first_three_instants_of_each_kind(rule, expected):
    source = schedule("2026-11-23T06:30", rule)
    assert starts(source, number=3) == expected
    assert starts(source, "2026-11-23 04:30", 3)[:2] == [text for text in expected if text > "2026-11-23 04:30"][:2]


# By what they prove; "end": no start comes after these.
NEXT = {
    # days off
    "count counts skipped days too": (  # from a Friday; Saturday and Sunday count
        schedule("2026-11-20T06:30", "FREQ=DAILY;COUNT=5", respects=True),
        ["2026-11-20 04:30", "2026-11-23 04:30", "2026-11-24 04:30", "end"],
    ),
    "count counts skipped hours too": (
        schedule("2026-11-20T06:30", "FREQ=HOURLY;INTERVAL=12;COUNT=8", respects=True),
        ["2026-11-20 04:30", "2026-11-20 16:30", "2026-11-23 04:30", "2026-11-23 16:30", "end"],
    ),
    "daily ones skip days off by their local date": (  # 00:30 in Helsinki is the day before in UTC
        schedule("2026-11-19T00:30", "FREQ=DAILY", respects=True),
        [
            "2026-11-18 22:30",
            "2026-11-19 22:30",
            "2026-11-22 22:30",
        ],
    ),
    "hourly ones skip days off by their local date": (
        schedule("2026-11-20T12:00", "FREQ=HOURLY;INTERVAL=6", respects=True),
        [
            "2026-11-20 10:00",
            "2026-11-20 16:00",
            "2026-11-22 22:00",
            "2026-11-23 04:00",
        ],
    ),
    "a one-time schedule runs whatever day it is": (
        schedule("2026-11-22T06:30", respects=True),
        ["2026-11-22 04:30", "end"],
    ),
    # part of the day
    "steps start again each day, and both ends are included": (
        schedule("2026-11-23T00:00", "FREQ=MINUTELY;INTERVAL=45", between=("08:30", "10:00")),
        [
            "2026-11-23 06:30",
            "2026-11-23 07:15",
            "2026-11-23 08:00",
            "2026-11-24 06:30",
            "2026-11-24 07:15",
            "2026-11-24 08:00",
        ],
    ),
    "on the first day the steps still count from where the part begins": (
        schedule("2026-11-23T09:00", "FREQ=MINUTELY;INTERVAL=45", between=("08:30", "10:00")),
        ["2026-11-23 07:15", "2026-11-23 08:00", "2026-11-24 06:30"],
    ),
    "the part of the day knows days and count": (
        schedule("2026-11-20T00:00", "FREQ=HOURLY;BYDAY=FR,SU,MO;COUNT=5", between=("08:00", "09:00"), respects=True),
        ["2026-11-20 06:00", "2026-11-20 07:00", "2026-11-23 06:00", "end"],
    ),
    "the part of the day knows minutes": (
        schedule("2026-11-23T00:00", "FREQ=HOURLY;BYMINUTE=0,50", between=("08:10", "10:00")),
        [
            "2026-11-23 06:50",
            "2026-11-23 07:00",
            "2026-11-23 07:50",
            "2026-11-23 08:00",
            "2026-11-24 06:50",
        ],
    ),
    "a part of the day missing by a clock change is skipped": (
        schedule("2027-03-27T00:00", "FREQ=MINUTELY;INTERVAL=20", between=("03:10", "03:50")),
        [
            "2027-03-27 01:10",
            "2027-03-27 01:30",
            "2027-03-27 01:50",
            "2027-03-29 00:10",
            "2027-03-29 00:30",
            "2027-03-29 00:50",
        ],
    ),
    "a repeated part of the day runs on": (
        schedule("2026-10-25T00:00", "FREQ=MINUTELY;INTERVAL=30", between=("03:00", "03:45")),
        [
            "2026-10-25 00:00",
            "2026-10-25 00:30",
            "2026-10-25 01:00",
            "2026-10-25 01:30",
            "2026-10-26 01:00",
        ],
    ),
    # clock changes
    "a weekly time early on Monday stays where people expect it": (
        schedule("2026-10-19T00:05", "FREQ=WEEKLY;BYDAY=MO"),
        ["2026-10-18 21:05", "2026-10-25 22:05"],
    ),
    "two times that a change pushes onto one instant run once": (
        schedule("2027-03-28T03:00", "FREQ=DAILY;BYHOUR=3,4"),
        ["2027-03-28 01:00*", "2027-03-29 00:00", "2027-03-29 01:00"],
    ),
    "a shifted time that passes a later one keeps the order": (
        schedule("2027-03-28T00:00", "FREQ=DAILY;BYHOUR=3,4;BYMINUTE=10,30"),
        ["2027-03-28 01:10*", "2027-03-28 01:30*", "2027-03-29 00:10", "2027-03-29 00:30"],
    ),
    "a shifted time over midnight keeps the order": (  # over midnight: gap 23:00–24:00
        schedule("2026-03-28T12:00", "FREQ=DAILY;BYHOUR=0,23;BYMINUTE=0,30", zone="America/Nuuk"),
        ["2026-03-29 01:00*", "2026-03-29 01:30*", "2026-03-30 00:00"],
    ),
    "sub-daily steps run on through a repeated hour": (
        schedule("2026-10-25T02:10", "FREQ=HOURLY"),
        [
            "2026-10-24 23:10",
            "2026-10-25 00:10",
            "2026-10-25 01:10",
            "2026-10-25 02:10",
        ],
    ),
    "sub-daily steps run on over a missing hour": (
        schedule("2027-03-28T02:10", "FREQ=HOURLY"),
        [
            "2027-03-28 00:10",
            "2027-03-28 01:10",
            "2027-03-28 02:10",
        ],
    ),
    "a missing hour is not counted": (
        schedule("2027-03-28T00:00", "FREQ=HOURLY;BYHOUR=2,3,4;COUNT=3"),
        ["2027-03-28 00:00", "2027-03-28 01:00", "2027-03-28 23:00", "end"],
    ),
    "a skipped calendar day of a zone does not double the next": (  # there was no 30 December 2011
        schedule("2011-12-28T12:00", "FREQ=DAILY", zone="Pacific/Apia"),
        ["2011-12-28 22:00", "2011-12-29 22:00", "2011-12-30 22:00*", "2011-12-31 22:00"],
    ),
}


@pytest.mark.parametrize(("source", "expected"), NEXT.values(), ids=NEXT)
def test_the_next_instants(source, expected):
    found = starts(source, number=len(expected), calendar=MONDAY_TO_FRIDAY)
    assert [*found, "end"][: len(expected)] == expected


def test_until_is_included_whatever_its_form():
    for until in ("20261125", "20261125T063000", "20261125T043000Z"):
        assert len(starts(schedule("2026-11-23T06:30", f"FREQ=DAILY;UNTIL={until}"))) == 3
    for until in ("20261125T062959", "20261125T042959Z"):
        assert len(starts(schedule("2026-11-23T06:30", f"FREQ=DAILY;UNTIL={until}"))) == 2


def test_count_is_counted_from_the_start_also_when_that_is_twenty_years_ago():
    long = schedule("2006-11-23T06:30", "FREQ=DAILY;COUNT=7306")
    assert starts(long, "2026-11-20") == [
        "2026-11-20 04:30",
        "2026-11-21 04:30",
        "2026-11-22 04:30",
        "2026-11-23 04:30",
    ]
    assert (
        starts(schedule("2006-11-23T06:30", "FREQ=HOURLY;COUNT=175297"), "2026-11-22 00:00")[-1] == "2026-11-22 04:30"
    )


# ---------------------------------------------------------------------- working days
def test_a_rule_for_days_off_only_never_comes_and_that_is_found_out():
    weekend = schedule("2026-11-20T06:30", "FREQ=WEEKLY;BYDAY=SA,SU", respects=True)
    assert next_occurrence(weekend, LONG_AGO, MONDAY_TO_FRIDAY) is None
    minutes = schedule("2026-11-20T06:30", "FREQ=MINUTELY;BYDAY=SU", respects=True)
    assert next_occurrence(minutes, LONG_AGO, MONDAY_TO_FRIDAY) is None


# ---------------------------------------------------------------------- clock changes in Helsinki: gap 03:00–04:00, fold 04:00–03:00
@pytest.mark.parametrize(
    ("clock", "day", "expected"),
    [
        ("02:59", "2027-03-28", "2027-03-28 00:59"),
        ("03:00", "2027-03-28", "2027-03-28 01:00*"),
        ("03:30", "2027-03-28", "2027-03-28 01:30*"),
        ("03:59", "2027-03-28", "2027-03-28 01:59*"),
        ("04:00", "2027-03-28", "2027-03-28 01:00"),
        ("02:59", "2026-03-29", "2026-03-29 00:59"),
        ("03:00", "2026-03-29", "2026-03-29 01:00*"),
        ("03:30", "2026-03-29", "2026-03-29 01:30*"),
        ("03:59", "2026-03-29", "2026-03-29 01:59*"),
        ("04:00", "2026-03-29", "2026-03-29 01:00"),
        ("03:00", "2026-10-25", "2026-10-25 00:00"),
        ("03:30", "2026-10-25", "2026-10-25 00:30"),
        ("03:59", "2026-10-25", "2026-10-25 00:59"),
        ("04:00", "2026-10-25", "2026-10-25 02:00"),
        ("03:00", "2027-10-31", "2027-10-31 00:00"),
        ("03:30", "2027-10-31", "2027-10-31 00:30"),
        ("03:59", "2027-10-31", "2027-10-31 00:59"),
    ],
)
def test_a_daily_time_comes_once_on_the_day_of_a_change(clock, day, expected):
    daily = schedule(f"2026-01-01T{clock}", "FREQ=DAILY")
    middle = datetime.fromisoformat(f"{day}T12:00").replace(tzinfo=UTC)
    around = starts(daily, middle - timedelta(days=1), 2)
    assert around[0] == expected
    assert timedelta(hours=22) < utc(around[1]) - utc(around[0].rstrip("*")) < timedelta(hours=26)
    assert starts(schedule(f"{day}T{clock}")) == [expected]


@pytest.mark.parametrize(
    ("start", "spacings"), [("2027-03-14T03:30", [168, 168, 167]), ("2026-10-18T03:30", [168, 169, 168])]
)
def test_a_week_is_an_hour_shorter_or_longer_across_a_change(start, spacings):
    instants = [o.instant for o in islice(occurrences(schedule(start, "FREQ=WEEKLY;BYDAY=SU"), LONG_AGO, EVERY_DAY), 4)]
    assert [(later - earlier) / timedelta(hours=1) for earlier, later in pairwise(instants)] == spacings


def test_the_end_goes_by_the_wall_clock_when_times_are_shifted():
    assert len(starts(schedule("2027-03-27T03:30", "FREQ=DAILY;UNTIL=20270328T033000"))) == 2
    assert len(starts(schedule("2027-03-27T03:30", "FREQ=DAILY;COUNT=2"))) == 2


def wall(source: Schedule, after: str, number: int) -> list[str]:
    """Days and times by the schedule's own clock."""
    zone = ZoneInfo(source.timezone)
    return [
        f"{o.instant.astimezone(zone):%d %H:%M}" for o in islice(occurrences(source, utc(after), EVERY_DAY), number)
    ]


@pytest.mark.parametrize(
    ("rule", "times"),
    [
        ("FREQ=HOURLY;INTERVAL=24", {"06:00"}),
        ("FREQ=MINUTELY;INTERVAL=1440", {"06:00"}),
        ("FREQ=HOURLY;INTERVAL=12", {"06:00", "18:00"}),
        ("FREQ=HOURLY;INTERVAL=8", {"06:00", "14:00", "22:00"}),
        ("FREQ=MINUTELY;INTERVAL=480", {"06:00", "14:00", "22:00"}),
        ("FREQ=HOURLY;INTERVAL=6;BYHOUR=6,12", {"06:00", "12:00"}),
        ("FREQ=HOURLY;INTERVAL=4;BYMINUTE=0,30;BYHOUR=6", {"06:00", "06:30"}),
        ("FREQ=MINUTELY;INTERVAL=40;BYHOUR=6", {"06:00", "06:40"}),
        ("FREQ=MINUTELY;INTERVAL=45;BYHOUR=6", {"06:00", "06:45"}),
        ("FREQ=MINUTELY;INTERVAL=90;BYHOUR=6,7", {"06:00", "07:30"}),
    ],
)
def test_an_interval_that_divides_the_day_keeps_its_times(rule, times):
    assert {at[3:] for at in wall(schedule("2026-05-02T06:00", rule), "2027-01-01", 1100)} == times


def test_every_hour_stays_at_the_full_hour_where_the_clock_moves_by_half_an_hour():
    hourly = schedule("2026-05-02T00:00", "FREQ=HOURLY;BYHOUR=6", "Australia/Lord_Howe")
    assert {at[3:] for at in wall(hourly, "2026-09-01", 60)} == {"06:00"}


def test_other_intervals_step_in_elapsed_time():
    assert wall(schedule("2026-10-24T06:00", "FREQ=HOURLY;INTERVAL=7"), "2026-10-24 09:00", 3) == [
        "24 13:00",
        "24 20:00",
        "25 03:00",
    ]
    assert wall(schedule("2026-10-24T06:00", "FREQ=HOURLY;INTERVAL=7"), "2026-10-25 01:00", 2) == [
        "25 09:00",
        "25 16:00",
    ]


def test_a_missing_time_of_day_is_shifted_and_a_repeated_one_counts_once():
    thirds = schedule("2026-05-02T03:30", "FREQ=HOURLY;INTERVAL=8")
    assert starts(thirds, "2026-10-24 22:00", 2) == ["2026-10-25 00:30", "2026-10-25 09:30"]
    assert starts(thirds, "2027-03-27 22:00", 2) == ["2027-03-28 01:30*", "2027-03-28 08:30"]


def test_count_counts_times_of_day_over_clock_changes():
    assert len(starts(schedule("2026-10-20T06:00", "FREQ=HOURLY;INTERVAL=8;COUNT=50"), number=90)) == 50
    assert len(starts(schedule("2026-10-20T06:00", "FREQ=MINUTELY;INTERVAL=40;COUNT=500"), number=900)) == 500
    assert (
        starts(schedule("2006-05-02T06:00", "FREQ=HOURLY;INTERVAL=8;COUNT=21915"), "2026-04-30")[-1]
        == "2026-05-01 19:00"
    )


# ---------------------------------------------------------------------- the nominal time
def test_each_occurrence_knows_its_wall_clock_time():
    [found] = islice(occurrences(schedule("2027-03-01T03:30", "FREQ=DAILY"), utc("2027-03-27 12:00"), EVERY_DAY), 1)
    assert (found.nominal, found.nominal.date(), found.moved) == (datetime(2027, 3, 28, 3, 30), date(2027, 3, 28), True)
