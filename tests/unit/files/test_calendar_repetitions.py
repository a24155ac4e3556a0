"""Repetitions in calendar files: until when, by which weekdays, without which days."""

from __future__ import annotations

from datetime import date
from zoneinfo import ZoneInfo

import pytest

from app.services.files.calendar_days import LeftOut, read_days
from tests.unit.files.calendar_text import HEAD, HELSINKI, NEW_YORK, calendar, days_of, event, read, timed, whole

# ---------------------------------------------------------------------- repetitions
HELSINKI_DAY = ["DTSTART;TZID=Europe/Helsinki:20270610T000000", "DTEND;TZID=Europe/Helsinki:20270611T000000"]


@pytest.mark.parametrize(
    ("starts", "until", "days"),
    [
        (HELSINKI_DAY, "20270611T210000Z", "2027-06-10/2027-06-12"),
        (HELSINKI_DAY, "20270611T205959Z", "2027-06-10/2027-06-11"),
        (HELSINKI_DAY, "20270612", "2027-06-10/2027-06-12"),
        (HELSINKI_DAY, "20270612T000000", "2027-06-10/2027-06-12"),
        (["DTSTART:20270610T000000Z", "DTEND:20270611T000000Z"], "20270612T000000Z", "2027-06-10/2027-06-12"),
        (["DTSTART;VALUE=DATE:20270610"], "20270612T000000Z", "2027-06-10/2027-06-12"),
        (["DTSTART;VALUE=DATE:20270610"], "20270611T210000Z", "2027-06-10/2027-06-12"),
        (["DTSTART;VALUE=DATE:20270610"], "20270612T235959Z", "2027-06-10/2027-06-12"),
        (
            ["DTSTART;TZID=America/New_York:20270610T000000", "DURATION:P1D"],
            "20270612T040000Z",
            "2027-06-10/2027-06-12",
        ),
        (
            ["DTSTART;TZID=America/New_York:20270610T000000", "DURATION:P1D"],
            "20270612T035959Z",
            "2027-06-10/2027-06-11",
        ),
        (
            ["DTSTART:20270609T210000Z", "DURATION:P1D", "X-MICROSOFT-CDO-ALLDAYEVENT:TRUE"],
            "20270611T210000Z",
            "2027-06-10/2027-06-12",
        ),
    ],
)
def test_whole_days_repeat_until_the_day_that_is_meant(starts, until, days):
    assert days_of(*starts, f"RRULE:FREQ=DAILY;UNTIL={until}") == [days]


@pytest.mark.parametrize("plant", [HELSINKI, NEW_YORK, ZoneInfo("Pacific/Honolulu"), ZoneInfo("Pacific/Kiritimati")])
@pytest.mark.parametrize(
    "until",
    [
        "20270612T000000Z",
        "20270611T210000Z",
        "20270611T230000Z",
        "20270611T150000Z",
        "20270612T040000Z",
        "20270612T100000Z",  # midnights
        "20270612T235959Z",
        "20270612T205959Z",
        "20270612T145900Z",
        "20270613T065959Z",
        "20270612T120000Z",
    ],
)
def test_dates_repeat_until_the_date_that_a_time_of_utc_stands_for(until, plant):
    content = calendar(*event("DTSTART;VALUE=DATE:20270610", f"RRULE:FREQ=DAILY;UNTIL={until}"))
    is_midnight_there = until == "20270612T100000Z" and plant.key == "Pacific/Kiritimati"  # that of 13 June
    assert whole(read(content, plant)) == [f"2027-06-10/2027-06-{13 if is_midnight_there else 12}"]


@pytest.mark.parametrize(
    "excepted",
    [
        "TZID=W. Europe Standard Time:20270612T000000",
        "TZID=Asia/Tokyo:20270612T100000",
        "X=1:20270612T000000",
        "VALUE=DATE-TIME:20270611T220000Z",
        "X=1:20270611T150000Z",
        "X=1:20270612T040000Z",
    ],
)
def test_an_excepted_date_may_be_written_as_a_time(excepted):
    found = days_of("DTSTART;VALUE=DATE:20270610", "RRULE:FREQ=DAILY;COUNT=4", f"EXDATE;{excepted}")
    assert found == ["2027-06-10/2027-06-11", "2027-06-13"]


# Plant, midnight at which 9 July 2027 begins there and the last second of that day, both in UTC.
DAYS_IN_UTC = [
    ("Pacific/Auckland", "20270708T120000Z", "20270709T115959Z"),
    ("Pacific/Chatham", "20270708T111500Z", "20270709T111459Z"),
    ("Pacific/Kiritimati", "20270708T100000Z", "20270709T095959Z"),
    ("Asia/Kolkata", "20270708T183000Z", "20270709T182959Z"),
    ("Asia/Kathmandu", "20270708T181500Z", "20270709T181459Z"),
    ("Australia/Adelaide", "20270708T143000Z", "20270709T142959Z"),
    ("America/St_Johns", "20270709T023000Z", "20270710T022959Z"),
    ("Europe/London", "20270708T230000Z", "20270709T225900Z"),
    ("Pacific/Honolulu", "20270709T100000Z", "20270710T095959Z"),
]


@pytest.mark.parametrize(
    "starts", [["DTSTART;VALUE=DATE:20270705"], ["DTSTART:20270705T000000", "DTEND:20270705T235959"]]
)
@pytest.mark.parametrize(("plant", "midnight", "end"), DAYS_IN_UTC)
def test_a_utc_time_among_dates_means_the_date_that_begins_or_ends_then_at_the_plant(starts, plant, midnight, end):
    for until in (midnight, end):
        found = read(calendar(*event(*starts, f"RRULE:FREQ=DAILY;UNTIL={until}")), ZoneInfo(plant))
        assert whole(found) == ["2027-07-05/2027-07-09"]
    found = read(calendar(*event(*starts, "RRULE:FREQ=DAILY;COUNT=6", f"EXDATE:{midnight}")), ZoneInfo(plant))
    assert whole(found) == ["2027-07-05/2027-07-08", "2027-07-10"]
    assert whole(read(calendar(*event(*starts, f"RDATE:{midnight}")), ZoneInfo(plant))) == ["2027-07-05", "2027-07-09"]
    series, moved = (
        ["UID:1", *starts, "RRULE:FREQ=DAILY;COUNT=5"],
        ["UID:1", f"RECURRENCE-ID:{midnight}", "DTSTART;VALUE=DATE:20270720"],
    )
    assert whole(read(calendar(*event(*series), *event(*moved)), ZoneInfo(plant))) == [
        "2027-07-05/2027-07-08",
        "2027-07-20",
    ]


@pytest.mark.parametrize("until", ["20270107T110000Z", "20270108T105959Z"])
def test_midnight_of_the_plant_moves_with_its_summer_time(until):
    content = calendar(*event("DTSTART;VALUE=DATE:20270104", f"RRULE:FREQ=DAILY;UNTIL={until}"))
    assert whole(read(content, ZoneInfo("Pacific/Auckland"))) == ["2027-01-04/2027-01-08"]


@pytest.mark.parametrize(
    "end",
    [
        "DTEND:20270706T000000Z",
        "DTEND;TZID=America/New_York:20270706T000000",
        "DTEND:20270705T210000Z",
        "DTEND:20270705T235959Z",
        "DTEND:20270705T220000Z",
        "DTEND:20270706T040000Z",
        "DTEND:20270706T035900Z",
    ],
)
def test_a_date_ends_at_the_midnight_of_whatever_zone(end):
    assert days_of("DTSTART;VALUE=DATE:20270705", end) == ["2027-07-05"]


def test_a_start_and_an_end_may_be_written_in_two_zones():
    assert days_of("DTSTART:20270705T040000Z", "DTEND;TZID=America/New_York:20270706T000000") == ["2027-07-05"]


@pytest.mark.parametrize(
    ("starts", "ends"),
    [
        ("20270429T220000Z", "20270430T210000Z"),
        ("20270428T220000Z", "20270429T220000Z"),
        (";TZID=Africa/Cairo:20270430T010000", ";TZID=Africa/Cairo:20270501T000000"),
    ],
)
def test_a_day_whose_midnight_a_change_of_the_clocks_skips_is_whole(starts, ends):
    """In Cairo 30 April 2027 begins at 01:00."""
    lines = [f"{name}{'' if text[0] == ';' else ':'}{text}" for name, text in (("DTSTART", starts), ("DTEND", ends))]
    found = read(calendar(*event(*lines)), ZoneInfo("Africa/Cairo"))
    assert (whole(found), timed(found)) == (["2027-04-29" if starts == "20270428T220000Z" else "2027-04-30"], [])


def test_midnights_of_the_zone_of_the_calendar_are_whole_days():
    content = calendar(
        *event("DTSTART:20270704T220000Z", "DTEND:20270706T220000Z"), head=(*HEAD, "X-WR-TIMEZONE:Europe/Berlin")
    )
    assert whole(read(content)) == ["2027-07-05/2027-07-06"]


@pytest.mark.parametrize(
    ("starts", "rule", "days"),
    [
        ("Europe/Helsinki:20270610T010000", "FREQ=DAILY;UNTIL=20270611T220000Z", ["2027-06-10/2027-06-12"]),
        ("America/New_York:20270104T200000", "FREQ=WEEKLY;BYDAY=MO;COUNT=2", ["2027-01-05", "2027-01-12"]),
    ],
    ids=["until a time of UTC", "by weekdays of its own zone"],
)
def test_an_appointment_repeats(starts, rule, days):
    content = calendar(*event(f"DTSTART;TZID={starts}", "DURATION:PT2H", f"RRULE:{rule}"))
    assert timed(read(content)) == days


@pytest.mark.parametrize(
    ("rule", "days"),
    [
        ("FREQ=MONTHLY;COUNT=3", ["2027-07-05", "2027-08-05", "2027-09-05"]),
        ("FREQ=WEEKLY;INTERVAL=2;COUNT=2", ["2027-07-05", "2027-07-19"]),
        ("FREQ=MONTHLY;BYDAY=-1FR;UNTIL=20270901", ["2027-07-30", "2027-08-27"]),
        ("FREQ=DAILY;BYMONTH=7;BYMONTHDAY=5", ["2027-07-05 yearly"]),
        ("FREQ=MONTHLY;INTERVAL=12", ["2027-07-05 yearly"]),
        ("FREQ=YEARLY;BYMONTHDAY=5", ["2027-07-05 yearly"]),
        ("freq=yearly; wkst=su; bymonth=7; bymonthday=5; byhour=0; rscale=gregorian; byday=", ["2027-07-05 yearly"]),
        ("FREQ=YEARLY;COUNT=3;BYYEARDAY=200", ["2027-07-19", "2028-07-18", "2029-07-19"]),
        ("FREQ=YEARLY;COUNT=2;BYWEEKNO=30;BYDAY=MO", ["2027-07-26", "2028-07-24"]),
        ("FREQ=MONTHLY;COUNT=2;BYDAY=MO,TU,WE,TH,FR;BYSETPOS=-1", ["2027-07-30", "2027-08-31"]),
    ],
)
def test_events_that_end_or_come_every_year_are_accepted(rule, days):
    assert days_of("DTSTART;VALUE=DATE:20270705", f"RRULE:{rule}") == days


@pytest.mark.parametrize(
    "rule", ["FREQ=DAILY", "FREQ=WEEKLY;BYDAY=SU", "FREQ=MONTHLY", "FREQ=MONTHLY;INTERVAL=6", "FREQ=WEEKLY;INTERVAL=52"]
)
def test_endless_events_more_often_than_yearly_are_omitted(rule):
    found = read(calendar(*event("DTSTART;VALUE=DATE:20270705", f"RRULE:{rule}")))
    assert (found.events, dict(found.left_out)) == ([], {LeftOut.ENDLESS: 1})


@pytest.mark.parametrize(
    ("starts", "days"),
    [
        (["DTSTART;VALUE=DATE:20240229"], "2024-02-29 yearly"),
        (["DTSTART;VALUE=DATE:16040610"], "1970-06-10 yearly"),
        (["DTSTART;VALUE=DATE:20380705"], "2038-07-05 yearly"),
        (["DTSTART;VALUE=DATE:20151224", "DTEND;VALUE=DATE:20160102"], "2015-12-24/2016-01-01 yearly"),
    ],
)
def test_29_february_is_yearly_and_so_is_what_begins_in_any_year(starts, days):
    assert days_of(*starts, "RRULE:FREQ=YEARLY") == [days]


@pytest.mark.parametrize("until", ["99991231T235959Z", "99991231", "99991231T000000", "30000101", "00010101T000000Z"])
def test_until_far_away_is_without_end(until):
    assert days_of("DTSTART;VALUE=DATE:20261225", f"RRULE:FREQ=YEARLY;UNTIL={until}") == ["2026-12-25 yearly"]
    assert read(calendar(*event("DTSTART;VALUE=DATE:20261225", f"RRULE:FREQ=WEEKLY;UNTIL={until}"))).left_out == {
        LeftOut.ENDLESS: 1
    }


def test_a_further_date_far_away_is_passed_over():
    further = ("RDATE;VALUE=DATE:20270805,99991231", "EXDATE:00010101T000000")
    assert days_of("DTSTART;VALUE=DATE:20270705", *further) == ["2027-07-05", "2027-08-05"]


@pytest.mark.parametrize(
    ("rules", "days"),
    [
        (
            ["RRULE:FREQ=DAILY;COUNT=5", "EXRULE:FREQ=WEEKLY;BYDAY=WE;COUNT=1"],
            ["2027-07-05/2027-07-06", "2027-07-08/2027-07-09"],
        ),
        (["RRULE:FREQ=DAILY;COUNT=5", "EXRULE:FREQ=WEEKLY"], ["2027-07-06/2027-07-09"]),
        (
            ["RRULE:FREQ=YEARLY;BYMONTH=7;BYDAY=MO;UNTIL=20270801", "EXRULE:FREQ=YEARLY;BYMONTH=7;BYDAY=2MO,3MO"],
            ["2027-07-05", "2027-07-26"],
        ),
    ],
)
def test_a_rule_of_exceptions_takes_its_days_away(rules, days):
    assert days_of("DTSTART;VALUE=DATE:20270705", *rules) == days


def test_a_run_of_days_over_new_year_is_the_same_in_the_next_year():
    content = calendar(*event("DTSTART;VALUE=DATE:20261228", "RRULE:FREQ=DAILY;COUNT=9"))
    assert [whole(read_days(content, "", HELSINKI, date(year, 3, 1))) for year in (2026, 2027)] == [
        ["2026-12-28/2027-01-05"]
    ] * 2
