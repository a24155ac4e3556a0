"""Calendar files as many programs write them: the days that they close, by name, first and last day."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest

from app.services.files.calendar_days import Found, LeftOut, read_days

FILES = Path(__file__).parent / "calendars"
HELSINKI, NEW_YORK, TODAY = ZoneInfo("Europe/Helsinki"), ZoneInfo("America/New_York"), date(2026, 11, 23)
HEAD = ("BEGIN:VCALENDAR", "VERSION:2.0")


def read(content: bytes, plant: ZoneInfo = HELSINKI) -> Found:
    return read_days(content, "plant", plant, TODAY)


def calendar(*lines: str, head: tuple[str, ...] = HEAD) -> bytes:
    return "\r\n".join([*head, *lines, "END:VCALENDAR", ""]).encode()


def event(*lines: str) -> list[str]:
    return ["BEGIN:VEVENT", "SUMMARY:Stop", *lines, "END:VEVENT"]


def whole(found: Found) -> list[str]:
    """The whole days, such as "2027-07-05" or "2027-07-05/2027-07-07", with "yearly" behind those that are."""
    return sorted(text(day) for each in found.events for day in each.days if each.whole)


def timed(found: Found) -> list[str]:
    return sorted(text(day) for each in found.events for day in each.days if not each.whole)


def text(day) -> str:
    days = f"{day.first_day}" if day.first_day == day.last_day else f"{day.first_day}/{day.last_day}"
    return f"{days} yearly" if day.yearly else days


FRIDAYS = [f"2027-{day}" for day in ("06-04", "06-11", "06-18", "06-25", "07-02", "07-09", "07-16", "07-23", "07-30")]
FIRST_OF_JUNE = [
    f"{year}-06-0{day}" for year, day in zip(range(2026, 2037), (1, 1, 1, 1, 3, 2, 1, 1, 1, 1, 2), strict=True)
]


BY_FILE = {
    "midnights-of-another-zone": ["2027-07-05"],
    "all-day-in-utc": ["2027-07-05"],
    "all-day-in-utc-msn": ["2027-07-05"],
    "zone-without-winter": ["2027-07-05"],
    "until-in-utc": ["2026-06-10", "2027-06-10", "2028-06-10"],
    "line-end-in-description": ["2027-01-04"],
    "bad-trigger-of-alarm": ["2027-01-04", "2027-02-01"],
    "line-end-in-alarm": ["2027-01-04"],
    "bad-todo": ["2027-01-04"],
    "bad-refresh-interval": ["2027-01-04"],
    "zone-of-notes": ["2027-01-04"],
    "zone-history-jerusalem": ["2027-01-04"],
    "zone-history-london": ["2027-01-04"],
    "folded-inside-a-character": ["2027-01-04"],
    "windows-1252": ["2027-07-05/2027-07-18"],
    "zone-without-parts": ["2027-07-05"],
    "zone-with-byday-1": ["2027-01-04"],
    "comment-after-the-end": ["2027-01-04"],
    "nuls-after-the-end": ["2027-01-04"],
    "this-and-future": ["2026-01-04", "2027-01-11", "2028-01-11", "2029-01-11"],
    "two-versions": ["2027-01-11"],
    "until-23-59": ["2027-05-03", "2027-05-10", "2027-10-18/2027-10-22"],
    "daily-five-times": ["2027-01-04", "2027-07-05/2027-07-09"],
    "weekly-until": FRIDAYS,
    "every-12-months": ["2025-06-10 yearly"],
    "first-working-day": FIRST_OF_JUNE,
}


@pytest.mark.parametrize("file", sorted(FILES.iterdir()), ids=lambda file: file.stem)
def test_a_file_of_another_program_closes_its_days(file):
    found = read(file.read_bytes())
    assert (whole(found), timed(found), dict(found.left_out), found.is_whole) == (BY_FILE[file.stem], [], {}, True)


# ---------------------------------------------------------------------- encodings
UMLAUTS = calendar(*event("DTSTART;VALUE=DATE:20270104")).replace(b"Stop", "Kesäseisokki – ei töitä".encode())


@pytest.mark.parametrize(
    "content",
    [
        UMLAUTS,
        b"\xef\xbb\xbf" + UMLAUTS,
        UMLAUTS.decode().encode("utf-16"),
        b"\xfe\xff" + UMLAUTS.decode().encode("utf-16-be"),
        UMLAUTS.decode().encode("windows-1252"),
        UMLAUTS.replace(b"\r\n", b"\n"),
        UMLAUTS.replace(b"\r\n", b"\r"),
        UMLAUTS.replace(b"\r\n", b"\r\r\n"),
        b"\0" * 20 + UMLAUTS + b"\0" * 512 + b"\x1a",
        re.sub(rb"(?<=[^\r\n])(?=[^\r\n])", b"\r\n ", UMLAUTS),
        UMLAUTS.replace(b"SUMMARY", b"X-NOTE:caf\xe9\r\nSUMMARY"),
    ],
    ids=[
        "UTF-8",
        "mark",
        "UTF-16",
        "UTF-16 big endian",
        "Windows-1252",
        "LF",
        "CR",
        "CRCRLF",
        "NULs",
        "folded",
        "two encodings",
    ],
)
def test_a_name_is_read_in_whatever_encoding(content):
    [found] = read(content).events
    assert found.name == "Kesäseisokki – ei töitä"


# ---------------------------------------------------------------------- parts that are of no interest, or broken
@pytest.mark.parametrize(
    "lines",
    [
        ["BEGIN:VALARM", "TRIGGER:", "DTSTART:20300101", "END:VALARM"],
        ["BEGIN:VALARM", "BEGIN:VLOCATION", "END:VLOCATION", "SUMMARY:x"],
        ["no colon here", "X", ";:", ":"],
        ["LAST-MODIFIED:today", "DTSTAMP:", "SEQUENCE:first", "CREATED:2026-11-01", "GEO:x"],
        ["ATTACH;ENCODING=BASE64;VALUE=BINARY:" + "A" * 2000],
        ['DESCRIPTION;ALTREP="cid:1:2":text', "and: more of it"],
        ["DTEND:", "DURATION:", "RRULE:", "EXDATE:", "RDATE:", "RECURRENCE-ID:"],
        ["EXDATE:soon", "RDATE:soon"],
        ["DURATION:soon", "DTEND:20270706"],
    ],
)
def test_garbage_in_an_event_costs_nothing(lines):
    found = read(calendar(*event("DTSTART;VALUE=DATE:20270705", *lines)))
    assert (whole(found), dict(found.left_out)) == (["2027-07-05"], {})


@pytest.mark.parametrize(
    "lines",
    [
        ["BEGIN:VTODO", "DTSTART:20300101", "DUE:x"],
        ["BEGIN:VJOURNAL", "SUMMARY:x", "DTSTART:x", "END:VJOURNAL"],
        ["BEGIN:VFREEBUSY", "FREEBUSY:x", "END:VFREEBUSY"],
        ["BEGIN:X-COMPONENT", "DTSTART:20300101", "END:X-COMPONENT"],
        ["BEGIN:VTIMEZONE", "LAST-MODIFIED:today", "BEGIN:STANDARD", "END:STANDARD", "END:VTIMEZONE"],
        ["END:VEVENT", "END:NOTHING"],
        ["X-WR-CALDESC:one", "two", "BEGIN", "METHOD", "REFRESH-INTERVAL:12H"],
    ],
)
def test_garbage_around_an_event_is_ignored(lines):
    good = event("DTSTART;VALUE=DATE:20270705")
    assert whole(read(calendar(*lines, *good))) == whole(read(calendar(*good, *lines))) == ["2027-07-05"]


@pytest.mark.parametrize(
    "bad",
    [
        [],
        ["DTSTART:soon"],
        ["DTSTART:20270231"],
        ["DTSTART:00010101T000000Z"],
        ["DTSTART:99990705"],
        ["DTSTART:20270705", "DTEND:soon"],
        ["DTSTART:20270705", "DURATION:soon"],
        ["DTSTART:20270705", "RRULE:nonsense"],
        ["DTSTART:20270705", "RRULE:FREQ=YEARLY;COUNT=x"],
        ["DTSTART:20270705", "RRULE:FREQ=YEARLY;BYDAY=1"],
        ["DTSTART:20270705", "RRULE:FREQ=YEARLY;INTERVAL=0"],
        ["DTSTART:20270705", "RRULE:FREQ=YEARLY;BYMONTH=1;BYEASTER=0"],
        ["DTSTART:20270705", "RRULE:FREQ=HOURLY;COUNT=9"],
        ["DTSTART:20270705", "RRULE:FREQ=YEARLY;UNTIL=soon"],
    ],
)
def test_a_broken_event_costs_that_event_and_is_counted(bad):
    found = read(calendar(*event(*bad), *event("DTSTART;VALUE=DATE:20270712")))
    assert (whole(found), dict(found.left_out)) == (["2027-07-12"], {LeftOut.UNREADABLE: 1})


@pytest.mark.parametrize(
    "text",
    [
        ["Begin: 9 am"],
        ["Begin: 9 am", "End: 5 pm"],
        ["BEGIN:9am"],
        ["End: VEVENT"],
        ["Status: cancelled"],
        ["Status:Cancelled"],
        ["STATUS: see below"],
        ["Duration: 3 hours"],
        ["DURATION: 3 HOURS"],
        ["Summary: no"],
        ["Dtstart: tomorrow"],
        ["DTSTART: TOMORROW"],
    ],
)
def test_a_text_with_a_raw_line_end_spoils_nothing(text):
    rest = ["DTSTART;VALUE=DATE:20270705", "DURATION:P2D", "STATUS:CONFIRMED", "RRULE:FREQ=WEEKLY;COUNT=2"]
    for lines in (["DESCRIPTION:Agenda", *text, *rest], [*rest, "DESCRIPTION:Agenda", *text]):
        found = read(calendar(*event(*lines)))
        assert (whole(found), dict(found.left_out)) == (["2027-07-05/2027-07-06", "2027-07-12/2027-07-13"], {})
        assert [each.name for each in found.events] == ["Stop"]


@pytest.mark.parametrize("text", ["Status: cancelled", "Duration: 3 hours"])
def test_a_text_with_a_raw_line_end_is_no_property(text):
    assert whole(read(calendar(*event("DTSTART;VALUE=DATE:20270705", "DESCRIPTION:Agenda", text)))) == ["2027-07-05"]


@pytest.mark.parametrize("state", ["CANCELLED", "Cancelled", "cancelled"])
def test_a_state_counts_in_any_letters(state):
    assert whole(read(calendar(*event("DTSTART;VALUE=DATE:20270705", f"STATUS:{state}")))) == []


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("<!-- cached -->", ""),
        ("Warning: x in y on line 3<br />", ""),
        ("", "<!-- served in 0.1 s -->"),
        ("<pre>", "</pre>"),
        ("", "<script>BEGIN:VCALENDAR</script>"),
    ],
)
def test_other_text_may_stand_on_the_first_and_the_last_line(before, after):
    content = before.encode() + calendar(*event("DTSTART:20270705")).rstrip() + after.encode()
    found = read(content)
    assert (whole(found), found.is_whole) == (["2027-07-05"], True)


def test_calendars_may_be_joined_without_a_line_end():
    content = calendar(*event("DTSTART:20270705")).rstrip() + calendar(*event("DTSTART:20270712"))
    assert whole(read(content)) == ["2027-07-05", "2027-07-12"]


def test_lines_outside_of_the_calendar_are_ignored():
    good, other = calendar(*event("DTSTART:20270705")), b"\r\n".join(map(str.encode, event("DTSTART:20280705")))
    assert whole(read(b"HTTP/1.1 200 OK\r\n\r\n" + other + b"\r\n" + good + other)) == ["2027-07-05"]
    assert whole(read(good + calendar(*event("DTSTART:20290705")))) == ["2027-07-05", "2029-07-05"]


def test_a_file_that_ends_in_the_middle_says_so_and_its_whole_events_are_there():
    content = calendar(
        *event("DTSTART;VALUE=DATE:20270705"), *event("DTSTART;VALUE=DATE:20270712", "DTEND;VALUE=DATE:20270720")
    )
    cut = read(content[: content.index(b"DTEND")])
    assert (whole(cut), cut.is_whole) == (["2027-07-05"], False)


# ---------------------------------------------------------------------- ends
@pytest.mark.parametrize(
    ("lines", "days"),
    [
        (["DTSTART;VALUE=DATE:20270705", "DTEND;VALUE=DATE:20270707", "DURATION:P9D"], "2027-07-05/2027-07-06"),
        (["DTSTART:20270705T000000", "DURATION:PT1H", "DTEND:20270707T000000"], "2027-07-05/2027-07-06"),
        (["DTSTART;VALUE=DATE:20270705", "DTEND:20270707T000000"], "2027-07-05/2027-07-06"),
        (["DTSTART;VALUE=DATE:20270705", "DTEND:20270706T235900"], "2027-07-05/2027-07-06"),
        (["DTSTART:20270705T000000", "DTEND;VALUE=DATE:20270707"], "2027-07-05/2027-07-06"),
        (["DTSTART;VALUE=DATE:20270705", "DTEND:20270706T210000Z"], "2027-07-05/2027-07-06"),
        (["DTSTART;VALUE=DATE:20270705T000000", "DTEND;VALUE=DATE:20270707T000000"], "2027-07-05/2027-07-06"),
        (["DTSTART;VALUE=DATE-TIME:20270705", "DURATION:P2D"], "2027-07-05/2027-07-06"),
        (["DTSTART:2027-07-05", "DTEND:2027-07-07"], "2027-07-05/2027-07-06"),
        (["DTSTART;VALUE=DATE:20270705", "DTEND;VALUE=DATE:20270701"], "2027-07-05"),
        (["DTSTART;VALUE=DATE:20270705", "DURATION:-P1D"], "2027-07-05"),
        (["DTSTART:20270705T000000"], "2027-07-05"),
        (["DTSTART:20270705T000000Z"], "2027-07-05"),
        (["DTSTART:20270705T000000", "DTEND:20270705T000000"], "2027-07-05"),
        (["DTSTART:20270705T000000", "DURATION:PT0S"], "2027-07-05"),
        (["DTSTART:20270705T000000", "DTEND:20270705T240000"], "2027-07-05"),
        (["DTSTART:20270705T000100", "DTEND:20270706T000000"], "2027-07-05"),
        (["DTSTART:20270705T000100", "DTEND:20270706T235959"], "2027-07-05/2027-07-06"),
        (["DTSTART:20270705T000000", "DURATION:PT24H"], "2027-07-05"),
        (["DTSTART:20270705T000000", "DURATION:P1DT23H59M"], "2027-07-05/2027-07-06"),
    ],
)
def test_the_end_of_whole_days(lines, days):
    found = read(calendar(*event(*lines)))
    assert (whole(found), timed(found)) == ([days], [])


@pytest.mark.parametrize(
    "lines",
    [
        ["DTSTART:20270705T080000", "DTEND:20270705T100000"],
        ["DTSTART:20270705T100000"],
        ["DTSTART:20270705T000000", "DTEND:20270705T120000"],
        ["DTSTART:20270705T120000", "DTEND:20270706T000000"],
        ["DTSTART:20270705T000000", "DTEND:20270705T000100"],
        ["DTSTART:20270705T080000", "DTEND;VALUE=DATE:20270706"],
        ["DTSTART:20270705T100000Z", "DURATION:PT2H"],
    ],
)
def test_an_event_with_times_of_day_is_an_appointment(lines):
    found = read(calendar(*event(*lines)))
    assert (whole(found), timed(found)) == ([], ["2027-07-05"])


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
def test_the_whole_name_of_a_zone_means_that_zone_whatever_the_file_says(name):
    for defined in ([], zone(name, "+0200", "+0300")):
        assert timed(read(calendar(*defined, *in_zone(name)))) == ["2027-07-06"]


def test_a_utc_time_stays_one_when_a_zone_has_that_name():
    assert timed(read(calendar(*zone("UTC", "-0500", "-0400"), *event("DTSTART:20270705T173000Z")))) == ["2027-07-05"]


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
    assert whole(read(calendar(*event(*starts, f"RRULE:FREQ=DAILY;UNTIL={until}")))) == [days]


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
    content = calendar(*event("DTSTART;VALUE=DATE:20270610", "RRULE:FREQ=DAILY;COUNT=4", f"EXDATE;{excepted}"))
    assert whole(read(content)) == ["2027-06-10/2027-06-11", "2027-06-13"]


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
    assert whole(read(calendar(*event("DTSTART;VALUE=DATE:20270705", end)))) == ["2027-07-05"]


def test_a_start_and_an_end_may_be_written_in_two_zones():
    content = calendar(*event("DTSTART:20270705T040000Z", "DTEND;TZID=America/New_York:20270706T000000"))
    assert whole(read(content)) == ["2027-07-05"]


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


def test_an_appointment_early_in_the_morning_repeats_until_a_time_of_utc():
    content = calendar(
        *event(
            "DTSTART;TZID=Europe/Helsinki:20270610T010000", "DURATION:PT2H", "RRULE:FREQ=DAILY;UNTIL=20270611T220000Z"
        )
    )
    assert timed(read(content)) == ["2027-06-10/2027-06-12"]


def test_the_weekdays_of_an_appointment_are_those_of_its_own_zone():
    content = calendar(
        *event("DTSTART;TZID=America/New_York:20270104T200000", "DURATION:PT1H", "RRULE:FREQ=WEEKLY;BYDAY=MO;COUNT=2")
    )
    assert timed(read(content)) == ["2027-01-05", "2027-01-12"]


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
    assert whole(read(calendar(*event("DTSTART;VALUE=DATE:20270705", f"RRULE:{rule}")))) == days


@pytest.mark.parametrize(
    "rule", ["FREQ=DAILY", "FREQ=WEEKLY;BYDAY=SU", "FREQ=MONTHLY", "FREQ=MONTHLY;INTERVAL=6", "FREQ=WEEKLY;INTERVAL=52"]
)
def test_endless_events_more_often_than_yearly_are_left_out(rule):
    found = read(calendar(*event("DTSTART;VALUE=DATE:20270705", f"RRULE:{rule}")))
    assert (found.events, dict(found.left_out)) == ([], {LeftOut.ENDLESS: 1})


def test_29_february_is_yearly_and_so_is_what_began_long_ago():
    assert whole(read(calendar(*event("DTSTART;VALUE=DATE:20240229", "RRULE:FREQ=YEARLY")))) == ["2024-02-29 yearly"]
    assert whole(read(calendar(*event("DTSTART;VALUE=DATE:16040610", "RRULE:FREQ=YEARLY")))) == ["1970-06-10 yearly"]
    assert whole(
        read(calendar(*event("DTSTART;VALUE=DATE:20151224", "DTEND;VALUE=DATE:20160102", "RRULE:FREQ=YEARLY")))
    ) == ["2015-12-24/2016-01-01 yearly"]


@pytest.mark.parametrize("until", ["99991231T235959Z", "99991231", "99991231T000000", "30000101", "00010101T000000Z"])
def test_until_far_away_is_without_end(until):
    assert whole(read(calendar(*event("DTSTART;VALUE=DATE:20261225", f"RRULE:FREQ=YEARLY;UNTIL={until}")))) == [
        "2026-12-25 yearly"
    ]
    assert read(calendar(*event("DTSTART;VALUE=DATE:20261225", f"RRULE:FREQ=WEEKLY;UNTIL={until}"))).left_out == {
        LeftOut.ENDLESS: 1
    }


@pytest.mark.parametrize("end", ["DTEND;VALUE=DATE:99991231", "DTEND:99991231T235959Z", "DURATION:P9000W"])
def test_an_end_far_away_is_longer_than_a_year(end):
    found = read(calendar(*event("DTSTART;VALUE=DATE:20270705", end)))
    assert (whole(found), found.left_out) == ([], {LeftOut.OUT_OF_RANGE: 1})


def test_a_further_date_far_away_is_passed_over():
    content = calendar(
        *event("DTSTART;VALUE=DATE:20270705", "RDATE;VALUE=DATE:20270805,99991231", "EXDATE:00010101T000000")
    )
    assert whole(read(content)) == ["2027-07-05", "2027-08-05"]


def test_yearly_events_from_a_late_year_are_accepted():
    assert whole(read(calendar(*event("DTSTART;VALUE=DATE:20380705", "RRULE:FREQ=YEARLY")))) == ["2038-07-05 yearly"]


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
    assert whole(read(calendar(*event("DTSTART;VALUE=DATE:20270705", *rules)))) == days


def test_a_rule_of_exceptions_that_cant_be_read_costs_the_event():
    found = read(calendar(*event("DTSTART;VALUE=DATE:20270705", "RRULE:FREQ=DAILY;COUNT=5", "EXRULE:nonsense")))
    assert (whole(found), found.left_out) == ([], {LeftOut.UNREADABLE: 1})


def test_a_run_of_days_over_new_year_is_the_same_in_the_next_year():
    content = calendar(*event("DTSTART;VALUE=DATE:20261228", "RRULE:FREQ=DAILY;COUNT=9"))
    assert [whole(read_days(content, "", HELSINKI, date(year, 3, 1))) for year in (2026, 2027)] == [
        ["2026-12-28/2027-01-05"]
    ] * 2


# ---------------------------------------------------------------------- versions
def version(*lines: str, uid: str = "1") -> list[str]:
    return event(f"UID:{uid}", *lines)


@pytest.mark.parametrize(
    ("older", "newer"),
    [
        (["SEQUENCE:1"], ["SEQUENCE:10"]),
        ([], ["SEQUENCE:1"]),
        (["SEQUENCE:1", "DTSTAMP:20261103T000000Z"], ["SEQUENCE:2", "DTSTAMP:20261101T000000Z"]),
        (["DTSTAMP:20261101T000000Z"], ["DTSTAMP:20261102T000000Z"]),
        (["LAST-MODIFIED:20261101T000000Z"], ["LAST-MODIFIED:20261102T000000Z"]),
    ],
)
def test_the_newest_version_counts(older, newer):
    first, second = version("DTSTART;VALUE=DATE:20270104", *older), version("DTSTART;VALUE=DATE:20270111", *newer)
    assert whole(read(calendar(*first, *second))) == whole(read(calendar(*second, *first))) == ["2027-01-11"]
    cancelled = version("DTSTART;VALUE=DATE:20270104", *newer, "STATUS:CANCELLED")
    assert whole(read(calendar(*first, *cancelled))) == []


def test_events_of_one_uid_that_are_equally_new_all_count():
    assert whole(read(calendar(*version("DTSTART:20270104"), *version("DTSTART:20270111")))) == [
        "2027-01-04",
        "2027-01-11",
    ]
    assert whole(
        read(calendar(*version("DTSTART:20270104", uid=""), *version("DTSTART:20270111", "SEQUENCE:2", uid="")))
    ) == ["2027-01-04", "2027-01-11"]


def test_a_notice_of_cancellation_cancels():
    notice = calendar(*version("DTSTART;VALUE=DATE:20270104", "SEQUENCE:1"), head=(*HEAD, "METHOD:CANCEL"))
    found = read(notice)
    assert (whole(found), dict(found.left_out)) == ([], {})
    assert whole(read(calendar(*version("DTSTART;VALUE=DATE:20270104")) + notice)) == []


def test_one_day_of_a_series_is_cancelled_or_moved_by_its_newest_version():
    series = version("DTSTART;VALUE=DATE:20270104", "RRULE:FREQ=WEEKLY;COUNT=3")
    moved = version("RECURRENCE-ID;VALUE=DATE:20270111", "DTSTART;VALUE=DATE:20270113", "SEQUENCE:1")
    cancelled = version("RECURRENCE-ID;VALUE=DATE:20270111", "STATUS:CANCELLED", "SEQUENCE:2")
    assert whole(read(calendar(*series, *moved))) == ["2027-01-04", "2027-01-13", "2027-01-18"]
    assert whole(read(calendar(*moved, *cancelled, *series))) == ["2027-01-04", "2027-01-18"]
    assert (
        whole(
            read(calendar(*series, *moved, *version("SEQUENCE:2", "DTSTART;VALUE=DATE:20270104", "STATUS:CANCELLED")))
        )
        == []
    )


@pytest.mark.parametrize(
    ("following", "days"),
    [
        (["DTSTART;VALUE=DATE:20270120"], ["2027-01-04", "2027-01-11", "2027-01-20", "2027-01-27"]),
        (
            ["DTSTART;VALUE=DATE:20270118", "DTEND;VALUE=DATE:20270120"],
            ["2027-01-04", "2027-01-11", "2027-01-18/2027-01-19", "2027-01-25/2027-01-26"],
        ),
        (["DTSTART;VALUE=DATE:20270118", "STATUS:CANCELLED"], ["2027-01-04", "2027-01-11"]),
    ],
)
def test_this_and_all_following_days_are_moved_or_cancelled(following, days):
    series = version("DTSTART;VALUE=DATE:20270104", "RRULE:FREQ=WEEKLY;COUNT=4")
    assert (
        whole(read(calendar(*series, *version("RECURRENCE-ID;RANGE=THISANDFUTURE;VALUE=DATE:20270118", *following))))
        == days
    )


def test_a_day_may_be_moved_once_more_after_all_that_follow():
    series = version("DTSTART;VALUE=DATE:20270104", "RRULE:FREQ=WEEKLY;COUNT=5", "EXDATE;VALUE=DATE:20270201")
    following = version("RECURRENCE-ID;RANGE=THISANDFUTURE;VALUE=DATE:20270111", "DTSTART;VALUE=DATE:20270112")
    single = version("RECURRENCE-ID;VALUE=DATE:20270118", "DTSTART;VALUE=DATE:20270122")
    assert whole(read(calendar(*series, *following, *single))) == [
        "2027-01-04",
        "2027-01-12",
        "2027-01-22",
        "2027-01-26",
    ]
