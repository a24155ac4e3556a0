"""Calendar files as many programs write them: the days that they close, by name, first and last day."""

from __future__ import annotations

import re

import pytest

from app.services.files.calendar_days import LeftOut
from tests.unit.files.calendar_text import FILES, HEAD, calendar, days_of, event, read, timed, whole

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
        ["DTSTART:20270705", "RRULE:FREQ=DAILY;COUNT=5", "EXRULE:nonsense"],
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


@pytest.mark.parametrize(
    ("lines", "days"),
    [
        *((["DESCRIPTION:Agenda", text], ["2027-07-05"]) for text in ("Status: cancelled", "Duration: 3 hours")),
        *(([f"STATUS:{state}"], []) for state in ("CANCELLED", "Cancelled", "cancelled")),
    ],
)
def test_a_text_with_a_raw_line_end_is_no_property_and_a_state_counts_in_any_letters(lines, days):
    assert days_of("DTSTART;VALUE=DATE:20270705", *lines) == days


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


def test_a_day_may_be_moved_again_after_all_that_follow():
    series = version("DTSTART;VALUE=DATE:20270104", "RRULE:FREQ=WEEKLY;COUNT=5", "EXDATE;VALUE=DATE:20270201")
    following = version("RECURRENCE-ID;RANGE=THISANDFUTURE;VALUE=DATE:20270111", "DTSTART;VALUE=DATE:20270112")
    single = version("RECURRENCE-ID;VALUE=DATE:20270118", "DTSTART;VALUE=DATE:20270122")
    assert whole(read(calendar(*series, *following, *single))) == [
        "2027-01-04",
        "2027-01-12",
        "2027-01-22",
        "2027-01-26",
    ]
