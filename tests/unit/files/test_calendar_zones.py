"""Zones in calendar files: whole days of another zone, and zones that files bring along."""

from __future__ import annotations

from zoneinfo import ZoneInfo

import pytest

from tests.unit.files.calendar_text import HELSINKI, NEW_YORK, calendar, event, read, timed, whole


# ---------------------------------------------------------------------- whole days of another zone
def zone(
    name: str,
    winter: str,
    summer: str,
    *,
    rule: str = "FREQ=YEARLY;BYMONTH={month};BYDAY=-1SU",
    more: tuple[str, ...] = (),
) -> list[str]:
    parts = [
        ("STANDARD", "19701025T030000", summer, winter, "10"),
        ("DAYLIGHT", "19700329T020000", winter, summer, "3"),
    ]
    return [
        "BEGIN:VTIMEZONE",
        f"TZID:{name}",
        *more,
        *(
            line
            for kind, starts, before, after, month in parts
            for line in (
                f"BEGIN:{kind}",
                f"DTSTART:{starts}",
                f"TZOFFSETFROM:{before}",
                f"TZOFFSETTO:{after}",
                f"RRULE:{rule.format(month=month)}",
                f"END:{kind}",
            )
        ),
        "END:VTIMEZONE",
    ]


@pytest.mark.parametrize("plant", [HELSINKI, NEW_YORK, ZoneInfo("Asia/Tokyo"), ZoneInfo("Pacific/Kiritimati")])
@pytest.mark.parametrize(
    ("tzid", "end"),
    [
        (";TZID=America/Los_Angeles", ""),
        (";TZID=W. Europe Standard Time", ""),
        (";TZID=Plant North", ""),
        ("", "Z"),
        (";TZID=/mozilla.org/20050126_1/Asia/Tokyo", ""),
        (";TZID=Nowhere", ""),
    ],
)
@pytest.mark.parametrize(
    ("more", "days"),
    [
        (["DTEND{tzid}:20270708T000000{end}"], ["2027-07-05/2027-07-07"]),
        (["RRULE:FREQ=YEARLY"], ["2027-07-05 yearly"]),
        (["RRULE:FREQ=WEEKLY;COUNT=3", "EXDATE{tzid}:20270712T000000{end}"], ["2027-07-05", "2027-07-19"]),
        (["RDATE{tzid}:20270805T000000{end},20270905T000000{end}"], ["2027-07-05", "2027-08-05", "2027-09-05"]),
    ],
)
def test_midnight_to_midnight_is_those_dates_in_whatever_zone(plant, tzid, end, more, days):
    lines = [line.format(tzid=tzid, end=end) for line in more]
    content = calendar(*zone("Plant North", "-0800", "-0700"), *event(f"DTSTART{tzid}:20270705T000000{end}", *lines))
    found = read(content, plant)
    assert (whole(found), timed(found), dict(found.left_out)) == (days, [], {})


def test_moved_and_excepted_days_of_another_zone_are_found_in_any_notation():
    series = [
        "UID:1",
        "DTSTART;TZID=America/Los_Angeles:20270705T000000",
        "DTEND;TZID=America/Los_Angeles:20270706T000000",
        "RRULE:FREQ=WEEKLY;COUNT=4",
    ]
    moved = ["UID:1", "RECURRENCE-ID:20270719T070000Z", "DTSTART;TZID=America/Los_Angeles:20270721T000000"]
    for excepted in ("EXDATE:20270712T070000Z", "EXDATE;VALUE=DATE:20270712", "EXDATE:20270712T000000"):
        assert whole(read(calendar(*event(*series, excepted), *event(*moved)))) == [
            "2027-07-05",
            "2027-07-21",
            "2027-07-26",
        ]


@pytest.mark.parametrize("mark", ["X-MICROSOFT-CDO-ALLDAYEVENT:TRUE", "X-MICROSOFT-MSNCALENDAR-ALLDAYEVENT:true"])
@pytest.mark.parametrize(
    ("starts", "ends"),
    [
        ("20270705T000000Z", "20270707T000000Z"),
        ("20270704T210000Z", "20270706T210000Z"),  # midnight of the plant
        ("20270704T220000Z", "20270706T220000Z"),
        ("20270705T070000Z", "20270707T070000Z"),  # of Berlin and Los Angeles
        ("20270704T150000Z", "20270706T150000Z"),
        ("20270705T100000Z", "20270707T100000Z"),  # of Tokyo and Honolulu
        ("20270705T010000", "20270707T010000"),
    ],
)
def test_events_marked_as_whole_days_use_the_nearest_midnights(mark, starts, ends):
    found = read(calendar(*event(f"DTSTART:{starts}", f"DTEND:{ends}", mark)))
    assert (whole(found), timed(found)) == (["2027-07-05/2027-07-06"], [])


@pytest.mark.parametrize(
    "rule", ["FREQ=WEEKLY;BYDAY=SU;COUNT=2", "FREQ=WEEKLY;BYDAY=MO;COUNT=2", "FREQ=WEEKLY;UNTIL=20270711T210000Z"]
)
def test_weekdays_of_midnights_written_in_utc_are_those_of_utc_or_of_the_plant(rule):
    """Sunday 21:00 of UTC is Monday at the plant."""
    content = calendar(*event("DTSTART:20270704T210000Z", "DTEND:20270705T210000Z", f"RRULE:{rule}"))
    assert whole(read(content)) == ["2027-07-05", "2027-07-12"]


@pytest.mark.parametrize(
    ("starts", "rule", "days", "plant"),
    [
        (
            "20270702T210000Z",
            "FREQ=WEEKLY;BYDAY=FR,SA;COUNT=4",
            ["2027-07-03/2027-07-04", "2027-07-10/2027-07-11"],
            "Europe/Helsinki",
        ),
        (
            "20270704T210000Z",
            "FREQ=WEEKLY;BYDAY=SU,MO;COUNT=4",
            ["2027-07-05/2027-07-06", "2027-07-12/2027-07-13"],
            "Europe/Helsinki",
        ),
        (
            "20270704T210000Z",
            "FREQ=WEEKLY;BYDAY=SU,MO,TU,WE,TH;UNTIL=20270708T210000Z",
            ["2027-07-05/2027-07-09"],
            "Europe/Helsinki",
        ),
        (
            "20270704T210000Z",
            "FREQ=WEEKLY;BYDAY=MO,TU,WE,TH,FR;UNTIL=20270708T210000Z",
            ["2027-07-05/2027-07-09"],
            "Europe/Helsinki",
        ),
        (
            "20270702T183000Z",
            "FREQ=WEEKLY;BYDAY=FR,SA;COUNT=4",
            ["2027-07-03/2027-07-04", "2027-07-10/2027-07-11"],
            "Asia/Kolkata",
        ),
        (
            "20270702T183000Z",
            "FREQ=WEEKLY;BYDAY=SA,SU;COUNT=4",
            ["2027-07-03/2027-07-04", "2027-07-10/2027-07-11"],
            "Asia/Kolkata",
        ),
        (
            "20270703T040000Z",
            "FREQ=WEEKLY;BYDAY=SA,SU;COUNT=4",
            ["2027-07-03/2027-07-04", "2027-07-10/2027-07-11"],
            "America/New_York",
        ),
        (
            "20270630T210000Z",
            "FREQ=MONTHLY;BYMONTHDAY=-1;COUNT=3",
            ["2027-07-01", "2027-08-01", "2027-09-01"],
            "Europe/Helsinki",
        ),
        ("20270630T210000Z", "FREQ=MONTHLY;COUNT=3", ["2027-07-01", "2027-08-01", "2027-09-01"], "Europe/Helsinki"),
        ("20251230T220000Z", "FREQ=YEARLY;BYMONTH=12;BYMONTHDAY=30", ["2025-12-31 yearly"], "Europe/Helsinki"),
        ("20251230T220000Z", "FREQ=YEARLY;BYMONTHDAY=30", ["2025-12-31 yearly"], "Europe/Helsinki"),
    ],
)
def test_weekdays_of_a_rule_belong_to_the_zone_of_a_start_that_matches_them(starts, rule, days, plant):
    assert whole(read(calendar(*event(f"DTSTART:{starts}", "DURATION:P1D", f"RRULE:{rule}")), ZoneInfo(plant))) == days


def test_a_date_with_a_zone_is_that_date():
    as_date = "VALUE=DATE;TZID=America/New_York"
    content = calendar(
        *event(
            f"DTSTART;{as_date}:20270705",
            f"DTEND;{as_date}:20270708",
            "RRULE:FREQ=WEEKLY;COUNT=2",
            f"EXDATE;{as_date}:20270712",
        )
    )
    assert whole(read(content)) == ["2027-07-05/2027-07-07"]


# ---------------------------------------------------------------------- zones
@pytest.mark.parametrize(
    ("name", "defined"),
    [
        ("Europe/Helsinki", []),
        ("FLE Standard Time", []),
        ("/mozilla.org/20050126_1/Europe/Helsinki", []),
        ("/freeassociation.sourceforge.net/Tzfile/Europe/Helsinki", []),
        ("/a.b.c/America/Argentina/Buenos_Aires", []),
        ("Custom", ["BEGIN:VTIMEZONE", "TZID:Custom", "X-LIC-LOCATION:Europe/Helsinki", "END:VTIMEZONE"]),
        ("Custom", zone("Custom", "+0200", "+0300")),
        ("Custom", zone("Custom", "0200", "0300", more=("LAST-MODIFIED:today",))),
        ("Custom", zone("Custom", "+0200", "+0300", rule="FREQ=YEARLY;BYMINUTE=0;BYHOUR=3;BYDAY=-1SU;BYMONTH={month}")),
        ("Custom", zone("Custom", "+0200", "+0300", rule="FREQ=YEARLY;BYYEARDAY=264;BYMONTH={month}")),
        ("(UTC+02:00) Helsinki", zone("(UTC+02:00) Helsinki", "+0200", "+0300")),
        ("Custom", zone("Custom", "+02", "+03")),
        ("Eastern, and more", zone("Eastern\\, and more", "+0200", "+0300")),
    ],
)
def test_a_time_is_read_in_the_zone_that_is_meant(name, defined):
    """00:30 there is the day before in Honolulu, and 21:30 the day after in Kiritimati."""
    for tzid in (name, f'"{name}"'):
        content = calendar(
            *defined, *event(f"DTSTART;TZID={tzid}:20270115T003000"), *event(f"DTSTART;TZID={tzid}:20270117T213000")
        )
        assert timed(read(content, ZoneInfo("Pacific/Honolulu"))) == ["2027-01-14", "2027-01-17"]
        assert timed(read(content, ZoneInfo("Pacific/Kiritimati"))) == ["2027-01-15", "2027-01-18"]


@pytest.mark.parametrize(
    "defined",
    [
        [],
        ["BEGIN:VTIMEZONE", "TZID:Custom", "END:VTIMEZONE"],
        zone("Custom", "+0900", "later"),
        zone("Custom", "+9900", "+0900"),
        *(
            zone("Custom", "+0900", "+0900", rule=rule)
            for rule in (
                "FREQ=SECONDLY",
                "FREQ=MINUTELY",
                "FREQ=HOURLY",
                "FREQ=DAILY",
                "FREQ=WEEKLY",
                "FREQ=YEARLY;BYDAY=1;BYMONTH=1",
                "nonsense",
                "FREQ=YEARLY;BYDAY=MO,TU,WE,TH,FR,SA,SU",
            )
        ),
    ],
)
def test_a_zone_that_cant_be_used_is_that_of_the_plant(defined):
    found = read(calendar(*defined, *event("DTSTART;TZID=Custom:20270705T010000", "DTEND;TZID=Custom:20270705T230000")))
    assert timed(found) == ["2027-07-05"]


def test_the_summer_time_of_a_file_is_followed_and_so_is_a_list_of_changes():
    rules = zone("Custom", "-0500", "-0400")
    listed = [
        "BEGIN:VTIMEZONE",
        "TZID:Custom",
        *(
            line
            for kind, at, before, after in (
                ("DAYLIGHT", "20270328T020000", "-0500", "-0400"),
                ("STANDARD", "20271031T020000", "-0400", "-0500"),
            )
            for line in (
                f"BEGIN:{kind}",
                f"DTSTART:{at}",
                f"RDATE:{at}",
                f"TZOFFSETFROM:{before}",
                f"TZOFFSETTO:{after}",
                f"END:{kind}",
            )
        ),
        "END:VTIMEZONE",
    ]
    for defined in (rules, listed):
        found = read(
            calendar(
                *defined, *event("DTSTART;TZID=Custom:20270705T163000"), *event("DTSTART;TZID=Custom:20271205T163000")
            )
        )
        assert timed(found) == ["2027-07-05", "2027-12-05"]
        found = read(
            calendar(
                *defined, *event("DTSTART;TZID=Custom:20270705T173000"), *event("DTSTART;TZID=Custom:20271205T173000")
            )
        )
        assert timed(found) == ["2027-07-06", "2027-12-06"]


def one_offset(name: str, starts: str, offset: str, *more: str) -> list[str]:
    return [
        "BEGIN:VTIMEZONE",
        f"TZID:{name}",
        "BEGIN:STANDARD",
        f"DTSTART:{starts}",
        f"TZOFFSETFROM:{offset}",
        f"TZOFFSETTO:{offset}",
        "END:STANDARD",
        *more,
        "END:VTIMEZONE",
    ]


NEW_YORK_EVENING = event("DTSTART;TZID={name}:20270705T173000", "DURATION:PT10M")  # after midnight in Helsinki
BAD_PART = ["BEGIN:STANDARD", "DTSTART:soon", "TZOFFSETTO:later", "END:STANDARD"]


def in_zone(name: str) -> list[str]:
    return [line.format(name=name) for line in NEW_YORK_EVENING]


@pytest.mark.parametrize(
    "defined",
    [
        *(
            one_offset("Custom", starts, "-0400")
            for starts in ("19700101T000000", "00010101T000000", "00000101T000000", "16010101T000000")
        ),
        one_offset("Custom", "00010101T000000", "-0400", *BAD_PART),
        [line.replace("1970", "0001") for line in zone("Custom", "-0500", "-0400")],
        zone("Custom", "-0500", "-0400", rule="FREQ=YEARLY;BYMONTH={month};BYDAY=-1SU;UNTIL=99991231T235959Z"),
        [*zone("Custom", "-0500", "-0400")[:-1], *BAD_PART, "END:VTIMEZONE"],
    ],
)
def test_a_zone_with_dates_far_away_or_a_bad_part_is_used(defined):
    assert timed(read(calendar(*defined, *in_zone("Custom")))) == ["2027-07-06"]


@pytest.mark.parametrize("name", ["GMT", "EST", "CET", "Company/GMT", "HQ/Japan", "My East"])
def test_a_short_name_means_the_rules_that_the_file_brings_along(name):
    assert timed(read(calendar(*zone(name, "-0500", "-0400"), *in_zone(name)))) == ["2027-07-06"]


@pytest.mark.parametrize(
    ("defined", "used"),
    [
        ("My East", "my east"),
        ("MY EAST", "My East"),
        ('"My East"', "My East"),
        ('"My East"', '"My East"'),
        ("Ottawa\\, Boston", '"Ottawa\\, Boston"'),
    ],
)
def test_names_of_zones_are_the_same_with_quotes_or_in_capitals(defined, used):
    assert timed(read(calendar(*zone(defined, "-0500", "-0400"), *in_zone(used)))) == ["2027-07-06"]


@pytest.mark.parametrize("name", ["america/new_york", "AMERICA/NEW_YORK", "eastern standard time", "America/New_York"])
def test_the_whole_name_of_a_zone_means_that_zone_despite_the_file(name):
    for defined in ([], zone(name, "+0200", "+0300")):
        assert timed(read(calendar(*defined, *in_zone(name)))) == ["2027-07-06"]


def test_a_utc_time_stays_one_when_a_zone_has_that_name():
    assert timed(read(calendar(*zone("UTC", "-0500", "-0400"), *event("DTSTART:20270705T173000Z")))) == ["2027-07-05"]


def test_days_that_are_excepted_in_a_zone_with_a_colon_and_a_comma_are_read():
    name = "(UTC-08:00) Los Angeles, Tijuana"
    content = calendar(
        *zone(name.replace(",", "\\,"), "-0800", "-0700"),
        *event(
            f"DTSTART;TZID={name}:20270705T180000",
            "RRULE:FREQ=DAILY;COUNT=4",
            f"EXDATE;TZID={name}:20270706T180000,20270707T180000",
        ),
    )
    assert timed(read(content)) == ["2027-07-06", "2027-07-09"]
