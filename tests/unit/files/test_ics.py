"""Calendar files: what is written can be read again, an import takes what is chosen of it, and garbage is one sentence."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st
from icalendar import Calendar

from app.database.settings import CalendarRepository
from app.domain.models import DayException
from app.domain.names import cleaned
from app.services.files import ics
from app.services.files.calendar_days import LeftOut, read_days
from app.services.files.calendar_import import CalendarFiles
from tests.support.errors import refuses
from tests.unit.catalogue.world import World

HELSINKI, TODAY = ZoneInfo("Europe/Helsinki"), date(2026, 11, 20)


def calendar(*events: str) -> bytes:
    body = "".join(f"BEGIN:VEVENT\r\n{event}\r\nEND:VEVENT\r\n" for event in events)
    return f"BEGIN:VCALENDAR\r\nVERSION:2.0\r\n{body}END:VCALENDAR\r\n".encode()


def days(*events: str):
    return [
        (day.name, day.first_day.isoformat(), day.last_day.isoformat(), day.yearly)
        for event in read_days(calendar(*events), "plant", HELSINKI, TODAY).events
        for day in event.days
    ]


# ---------------------------------------------------------------------- events
@pytest.mark.parametrize(
    ("event", "found"),
    [
        (
            "SUMMARY:Break\nDTSTART;VALUE=DATE:20270705\nDTEND;VALUE=DATE:20270719",
            ("Break", "2027-07-05", "2027-07-18", False),
        ),
        ("SUMMARY:One day\nDTSTART;VALUE=DATE:20270705", ("One day", "2027-07-05", "2027-07-05", False)),
        (
            "SUMMARY:One day\nDTSTART:20270705\nDTEND:20270705",
            ("One day", "2027-07-05", "2027-07-05", False),
        ),  # as some programs write it
        (
            "SUMMARY:Morning\nDTSTART:20270705T080000\nDTEND:20270705T120000",
            ("Morning", "2027-07-05", "2027-07-05", False),
        ),
        ("SUMMARY:Night\nDTSTART:20270705T200000\nDTEND:20270706T060000", ("Night", "2027-07-05", "2027-07-06", False)),
        (
            "SUMMARY:To midnight\nDTSTART:20270705T080000\nDTEND:20270706T000000",
            ("To midnight", "2027-07-05", "2027-07-05", False),
        ),
        (
            "SUMMARY:UTC\nDTSTART:20270705T220000Z\nDTEND:20270706T200000Z",
            ("UTC", "2027-07-06", "2027-07-06", False),
        ),  # 01:00 to 23:00 here
        (
            'SUMMARY:Zone\nDTSTART;TZID="W. Europe Standard Time":20270705T233000',
            ("Zone", "2027-07-06", "2027-07-06", False),
        ),
        ("SUMMARY:Weeks\nDTSTART;VALUE=DATE:20270705\nDURATION:P2W", ("Weeks", "2027-07-05", "2027-07-18", False)),
        ("SUMMARY:Long\nDTSTART:20270705T080000\nDURATION:P1DT20H", ("Long", "2027-07-05", "2027-07-07", False)),
        ("SUMMARY:Vappu\nDTSTART;VALUE=DATE:20200501\nRRULE:FREQ=YEARLY", ("Vappu", "2020-05-01", "2020-05-01", True)),
        (
            "SUMMARY:Vappu\nDTSTART;VALUE=DATE:20200501\nRRULE:FREQ=YEARLY;WKST=SU;BYMONTH=5;BYMONTHDAY=1",
            ("Vappu", "2020-05-01", "2020-05-01", True),
        ),
        ("SUMMARY:A\\, b\\; c\\\\d\\ne\nDTSTART:20270705", ("A, b; c\\d e", "2027-07-05", "2027-07-05", False)),
        ("SUMMARY:Long na\n me folded\nDTSTART:20270705", ("Long name folded", "2027-07-05", "2027-07-05", False)),
        ("DTSTART:20270705", ("plant", "2027-07-05", "2027-07-05", False)),
        ("SUMMARY:" + "x" * 200 + "\nDTSTART:20270705", ("x" * 80, "2027-07-05", "2027-07-05", False)),
        (
            "SUMMARY:Alarm\nDTSTART:20270705\nBEGIN:VALARM\nSUMMARY:Not this\nEND:VALARM",
            ("Alarm", "2027-07-05", "2027-07-05", False),
        ),
    ],
)
def test_events_become_closed_days(event, found):
    assert days(event.replace("\n", "\r\n")) == [found] == days(event)


def test_days_that_a_repetition_excepts_are_omitted():
    yearly = "SUMMARY:Audit\nDTSTART;VALUE=DATE:20250610\nRRULE:FREQ=YEARLY;COUNT=4\nEXDATE;VALUE=DATE:20260610\nEXDATE;VALUE=DATE:20280610"
    assert [day[1] for day in days(yearly)] == ["2027-06-10"]
    timed = "DTSTART:20260610T203000Z\nDTEND:20260610T223000Z\nRRULE:FREQ=YEARLY;COUNT=3\nEXDATE:20270610T203000Z"
    assert [day[1:3] for day in days(timed)] == [("2026-06-10", "2026-06-11"), ("2028-06-10", "2028-06-11")]
    forever = days("DTSTART;VALUE=DATE:20200501\nRRULE:FREQ=YEARLY\nEXDATE;VALUE=DATE:20280501")
    assert [day[1][:4] for day in forever] == ["2026", "2027", *(str(year) for year in range(2029, 2037))]


def test_a_yearly_rule_that_is_more_than_the_same_day_becomes_its_dates():
    thanksgiving = days("SUMMARY:Thanksgiving\nDTSTART:20201126\nRRULE:FREQ=YEARLY;BYMONTH=11;BYDAY=4TH")
    assert thanksgiving[0] == ("Thanksgiving", "2026-11-26", "2026-11-26", False)
    assert (len(thanksgiving), thanksgiving[-1][1]) == (11, "2036-11-27")
    assert [day[1] for day in days("DTSTART:20240610\nDTEND:20240612\nRRULE:FREQ=YEARLY;COUNT=3")] == ["2026-06-10"]
    assert [day[1] for day in days("DTSTART:20250610\nRRULE:FREQ=YEARLY;UNTIL=20270610T000000Z;INTERVAL=2")] == [
        "2027-06-10"
    ]


@pytest.mark.parametrize(
    "event",
    [
        "DTSTART:22000705",
        *(
            f"DTSTART:20270705\n{end}"
            for end in ("DTEND:20290705", "DTEND:99991231T235959Z", "DURATION:P99W", "DURATION:P9000W")
        ),
    ],
)
def test_entries_beyond_the_limit_are_counted_and_the_rest_is_imported(event):
    found = read_days(calendar(event, "SUMMARY:Good\nDTSTART:20270705"), "plant", HELSINKI, TODAY)
    assert ([each.name for each in found.events], dict(found.left_out), found.past) == (
        ["Good"],
        {LeftOut.OUT_OF_RANGE: 1},
        0,
    )


def test_cancelled_events_are_ignored():
    found = read_days(
        calendar(
            "SUMMARY:Off\nDTSTART:20270705\nSTATUS:CANCELLED",
            "SUMMARY:Old\nDTSTART:20200705\nSTATUS:cancelled",
            "STATUS:CANCELLED",
            "SUMMARY:Good\nDTSTART:20270712",
        ),
        "plant",
        HELSINKI,
        TODAY,
    )
    assert ([each.name for each in found.events], dict(found.left_out), found.past) == (["Good"], {}, 0)


@pytest.mark.parametrize("name", ["Europe", "Europe/", "x" * 300, "a/" * 3000, "..", "é", "", "//", "\x7f"])
def test_an_unknown_zone_is_taken_as_the_plants_whatever_its_name(name):
    assert [day[1] for day in days(f"DTSTART;TZID={name}:20270705T233000")] == ["2027-07-05"]


def test_events_before_this_year_are_past_and_duplicates_count_once():
    found = read_days(
        calendar("SUMMARY:Old\nDTSTART:20251224", "SUMMARY:A\nDTSTART:20260105", "SUMMARY:A\nDTSTART:20260105"),
        "plant",
        HELSINKI,
        TODAY,
    )
    assert ([each.name for each in found.events], found.past) == (["A"], 1)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"not a calendar",
        b"\xff\xfe\x00",
        b"<html></html>",
        b"BEGIN:VCARD\r\nEND:VCARD",
        b"END:VCALENDAR",
        b"{}",
        b"BEGIN:VEVENT\r\nDTSTART:20270705\r\nEND:VEVENT",
    ],
)
def test_garbage_is_no_calendar(content):
    with pytest.raises(ics.NotACalendar):
        read_days(content, "plant", HELSINKI, TODAY)


# ---------------------------------------------------------------------- any text
TEXTS = st.text(
    st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=300
)  # a reader leaves out NUL


@given(TEXTS)
def test_any_text_survives_writing_and_reading_and_no_line_is_too_long(text):
    written = ics.text_line("SUMMARY", text)
    assert written.endswith("\r\n")
    assert all(len(part.encode()) <= ics.FOLD_AT for part in written.split("\r\n"))
    content = calendar(written.removesuffix("\r\n"))
    [read] = Calendar.from_ical(content).events
    assert read["SUMMARY"] == text.replace("\r\n", "\n").replace("\r", "\n")
    [[event], _is_whole] = ics.components(content)
    assert cleaned(event.text("SUMMARY")) == cleaned(text)


@given(
    st.binary(max_size=400)
    | st.lists(
        st.sampled_from(
            [
                "BEGIN:VCALENDAR",
                "END:VCALENDAR",
                "BEGIN:VEVENT",
                "END:VEVENT",
                "DTSTART:20270705",
                "DTSTART;VALUE=DATE:20271305",
                "DTEND:20270101",
                "DURATION:P1W",
                "DURATION:-P1D",
                "RRULE:FREQ=YEARLY",
                "RRULE:FREQ=YEARLY;COUNT=99999",
                "RRULE:FREQ=YEARLY;BYDAY=53MO",
                "SUMMARY:a\\",
                " folded",
                "\tfolded",
                "",
                ":",
                ";",
                "X",
                "DTSTART;TZID=:2",
                "RRULE:FREQ=SECONDLY",
                "RECURRENCE-ID:20270705",
                "UID:1",
                "BEGIN:VTIMEZONE",
                "TZID:x",
                "BEGIN:STANDARD",
                "TZOFFSETTO:0100",
                "END:VTIMEZONE",
                "DTSTART;TZID=x:00020101T000000",
                "METHOD:CANCEL",
                "RECURRENCE-ID;RANGE=THISANDFUTURE;TZID=x:89991231T235959",
                "EXDATE:20270705,x",
            ]
        ),
        max_size=30,
    ).map(lambda lines: "\r\n".join(["BEGIN:VCALENDAR", *lines, "END:VCALENDAR"]).encode())
)
def test_whatever_a_file_holds_reading_ends_with_days_or_says_no(content):
    try:
        found = read_days(content, "plant", HELSINKI, TODAY)
    except (ics.NotACalendar, ics.TooMuch):
        return
    assert all(
        day.first_day <= day.last_day and 1 <= len(day.name) <= 80 for event in found.events for day in event.days
    )


@given(
    st.lists(
        st.tuples(
            st.text(st.characters(categories=["L", "N", "P", "Zs"]), min_size=1, max_size=80),
            st.dates(date(2026, 1, 1), date(2199, 1, 1)),
            st.integers(0, 100),
        ),
        min_size=1,
        max_size=8,
    )
)
def test_days_written_as_all_day_events_come_back(given_days):
    events = "".join(
        "BEGIN:VEVENT\r\n"
        + ics.text_line("SUMMARY", name)
        + ics.line("DTSTART;VALUE=DATE", f"{first:%Y%m%d}")
        + ics.line("DTEND;VALUE=DATE", f"{first + timedelta(days=length + 1):%Y%m%d}")
        + "END:VEVENT\r\n"
        for name, first, length in given_days
    )
    found = read_days(f"BEGIN:VCALENDAR\r\n{events}END:VCALENDAR\r\n".encode(), "plant", HELSINKI, TODAY)
    wanted = {(cleaned(name) or "plant", first, first + timedelta(days=length)) for name, first, length in given_days}
    assert {(day.name, day.first_day, day.last_day) for event in found.events for day in event.days} == wanted


# ---------------------------------------------------------------------- files
@pytest.fixture
def world(tmp_path):
    world = World(tmp_path)
    world.files = CalendarFiles(world.db, world.catalogue, world.clock, tmp_path)
    yield world
    world.db.close()


def test_an_import_takes_what_is_chosen_and_nothing_twice(world, tmp_path):
    daily = world.schedule()
    (tmp_path / "plant.ics").write_bytes(
        calendar(
            "SUMMARY:Audit\nDTSTART:20261124\nDTEND:20261126",
            "SUMMARY:Old\nDTSTART:20200101",
            "SUMMARY:Party\nDTSTART:20261127T180000",
            "SUMMARY:x\nDTSTART:20270705\nRRULE:FREQ=DAILY",
        )
    )
    found = world.files.read("plant.ics")
    assert [(event.name, event.whole) for event in found.events] == [("Audit", True), ("Party", False)]
    assert (found.known, found.left_out, found.past, found.is_whole) == (0, {LeftOut.ENDLESS: 1}, 1, True)
    assert CalendarRepository().all(world.db.read()) == []
    for again in range(2):
        assert [day.name for day in world.files.take(found.events[:1])] == ["Audit"][again:]
        [stored] = CalendarRepository().all(world.db.read())
        assert stored == DayException("Audit", date(2026, 11, 24), date(2026, 11, 25), source="plant.ics", id=stored.id)
    assert world.stored(daily).next_at.replace(tzinfo=None) == datetime(2026, 11, 26, 6, 30)
    rest = world.files.read("plant.ics")
    assert ([event.name for event in rest.events], rest.known) == (["Party"], 1)


def test_the_rest_of_a_partly_known_series_is_offered(world, tmp_path):
    (tmp_path / "plant.ics").write_bytes(calendar("SUMMARY:Audit\nDTSTART:20270610\nRRULE:FREQ=YEARLY;COUNT=3"))
    [audit] = world.files.read("plant.ics").events
    world.files.take([replace(audit, days=audit.days[:1])])
    [rest] = world.files.read("plant.ics").events
    assert [day.first_day.year for day in rest.days] == [2028, 2029]


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"nonsense", "is not a calendar file"),
        (calendar(), "has no days to import$"),
        (calendar("SUMMARY:Every week\nDTSTART:20270705\nRRULE:FREQ=WEEKLY"), "they are yearly or end$"),
        (calendar("DTSTART:20270705")[:-40], "ends in the middle"),
        (calendar("DTSTART:soon"), "has no readable days to import$"),
        (b"x" * (5 * 1024 * 1024 + 1), "larger than 5 MiB"),
    ],
)
def test_a_file_that_is_no_calendar_is_refused_and_changes_nothing(world, tmp_path, content, problem):
    (tmp_path / "plant.ics").write_bytes(content)
    with refuses("path", problem):
        world.files.read("plant.ics")
