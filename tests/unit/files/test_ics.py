"""iCalendar text: what is written can be read again, what is read is bounded, and garbage is one sentence."""
from __future__ import annotations

import time
from datetime import date, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.database.calendar import CalendarRepository
from app.domain.models import DayException, InvalidInput
from app.domain.names import cleaned
from app.services.files import calendar_import, ics
from app.services.files.calendar_import import CalendarFiles, read_days
from tests.unit.catalogue.world import World

HELSINKI, TODAY = ZoneInfo("Europe/Helsinki"), date(2026, 11, 20)


def calendar(*events: str) -> bytes:
    body = "".join(f"BEGIN:VEVENT\r\n{event}\r\nEND:VEVENT\r\n" for event in events)
    return f"BEGIN:VCALENDAR\r\nVERSION:2.0\r\n{body}END:VCALENDAR\r\n".encode()


def days(*events: str):
    return [(e.name, e.first_day.isoformat(), e.last_day.isoformat(), e.yearly)
            for e in read_days(calendar(*events), "plant", HELSINKI, TODAY, with_timed=True).exceptions]


# ---------------------------------------------------------------------- events
@pytest.mark.parametrize(("event", "found"), [
    ("SUMMARY:Break\nDTSTART;VALUE=DATE:20270705\nDTEND;VALUE=DATE:20270719", ("Break", "2027-07-05", "2027-07-18", False)),
    ("SUMMARY:One day\nDTSTART;VALUE=DATE:20270705", ("One day", "2027-07-05", "2027-07-05", False)),
    ("SUMMARY:One day\nDTSTART:20270705\nDTEND:20270705", ("One day", "2027-07-05", "2027-07-05", False)),     # as some programs write it
    ("SUMMARY:Morning\nDTSTART:20270705T080000\nDTEND:20270705T120000", ("Morning", "2027-07-05", "2027-07-05", False)),
    ("SUMMARY:Night\nDTSTART:20270705T200000\nDTEND:20270706T060000", ("Night", "2027-07-05", "2027-07-06", False)),
    ("SUMMARY:To midnight\nDTSTART:20270705T080000\nDTEND:20270706T000000", ("To midnight", "2027-07-05", "2027-07-05", False)),
    ("SUMMARY:UTC\nDTSTART:20270705T220000Z\nDTEND:20270706T200000Z", ("UTC", "2027-07-06", "2027-07-06", False)),   # 01:00 to 23:00 here
    ("SUMMARY:Zone\nDTSTART;TZID=\"W. Europe Standard Time\":20270705T233000", ("Zone", "2027-07-06", "2027-07-06", False)),
    ("SUMMARY:Weeks\nDTSTART;VALUE=DATE:20270705\nDURATION:P2W", ("Weeks", "2027-07-05", "2027-07-18", False)),
    ("SUMMARY:Long\nDTSTART:20270705T080000\nDURATION:P1DT20H", ("Long", "2027-07-05", "2027-07-07", False)),
    ("SUMMARY:Vappu\nDTSTART;VALUE=DATE:20200501\nRRULE:FREQ=YEARLY", ("Vappu", "2020-05-01", "2020-05-01", True)),
    ("SUMMARY:Vappu\nDTSTART;VALUE=DATE:20200501\nRRULE:FREQ=YEARLY;WKST=SU;BYMONTH=5;BYMONTHDAY=1", ("Vappu", "2020-05-01", "2020-05-01",
                                                                                                      True)),
    ("SUMMARY:A\\, b\\; c\\\\d\\ne\nDTSTART:20270705", ("A, b; c\\d e", "2027-07-05", "2027-07-05", False)),
    ("SUMMARY:Long na\n me folded\nDTSTART:20270705", ("Long name folded", "2027-07-05", "2027-07-05", False)),
    ("DTSTART:20270705", ("plant", "2027-07-05", "2027-07-05", False)),
    ("SUMMARY:" + "x" * 200 + "\nDTSTART:20270705", ("x" * 80, "2027-07-05", "2027-07-05", False)),
    ("SUMMARY:Alarm\nDTSTART:20270705\nBEGIN:VALARM\nSUMMARY:Not this\nEND:VALARM", ("Alarm", "2027-07-05", "2027-07-05", False)),
])
def test_events_become_closed_days(event, found):
    assert days(event.replace("\n", "\r\n")) == [found] == days(event)


WINTER = "DTSTART:19701025T030000\nRRULE:FREQ=YEARLY;BYMONTH=10;BYDAY=-1SU\nTZOFFSETFROM:{summer}\nTZOFFSETTO:{winter}"
SUMMER = "DTSTART:19700329T020000\nRRULE:FREQ=YEARLY;BYMONTH=3;BYDAY=-1SU\nTZOFFSETFROM:{winter}\nTZOFFSETTO:{summer}"


def with_zone(event: str, winter: str, summer: str, rule: str | None = None) -> bytes:
    """A file that brings its own time zone, ``(UTC+99) Plant``, along."""
    parts = "".join(f"BEGIN:{kind}\n{part}\nEND:{kind}\n" for kind, part in (("STANDARD", WINTER), ("DAYLIGHT", SUMMER)))
    zone = "BEGIN:VTIMEZONE\nTZID:(UTC+99) Plant\n" + parts.format(winter=winter, summer=summer) + "END:VTIMEZONE\n"
    zone = zone.replace("FREQ=YEARLY;BYMONTH=3;BYDAY=-1SU", rule) if rule else zone
    return calendar(event).replace(b"BEGIN:VEVENT", zone.encode() + b"BEGIN:VEVENT", 1)


@pytest.mark.parametrize(("winter", "summer", "at", "day"), [
    ("+0800", "+0900", "20270706T040000", "2027-07-05"), ("+0800", "+0900", "20270706T070000", "2027-07-06"),
    ("-0500", "-0400", "20270705T180000", "2027-07-06"), ("-0500", "-0400", "20271205T163000", "2027-12-05")])
def test_a_time_in_a_zone_of_the_files_own_is_the_plants(winter, summer, at, day):
    content = with_zone(f'SUMMARY:Away\nDTSTART;TZID="(UTC+99) Plant":{at}', winter, summer)
    assert [e.first_day.isoformat() for e in read_days(content, "plant", HELSINKI, TODAY).timed] == [day]


def test_a_zone_of_one_file_is_not_that_of_the_next():
    for winter, day in (("-0800", "2027-01-06"), ("+0800", "2027-01-05")):
        content = with_zone('DTSTART;TZID="(UTC+99) Plant":20270105T200000', winter, winter)
        assert [e.first_day.isoformat() for e in read_days(content, "plant", HELSINKI, TODAY).timed] == [day]


def test_days_that_a_repetition_excepts_are_left_out():
    yearly = "SUMMARY:Audit\nDTSTART;VALUE=DATE:20250610\nRRULE:FREQ=YEARLY;COUNT=4\nEXDATE;VALUE=DATE:20260610\nEXDATE;VALUE=DATE:20280610"
    assert [day[1] for day in days(yearly)] == ["2027-06-10"]
    timed = "DTSTART:20260610T203000Z\nDTEND:20260610T223000Z\nRRULE:FREQ=YEARLY;COUNT=3\nEXDATE:20270610T203000Z"
    assert [day[1:3] for day in days(timed)] == [("2026-06-10", "2026-06-11"), ("2028-06-10", "2028-06-11")]
    forever = days("DTSTART;VALUE=DATE:20200501\nRRULE:FREQ=YEARLY\nEXDATE;VALUE=DATE:20280501")
    assert [day[1][:4] for day in forever] == ["2026", "2027", *(str(year) for year in range(2029, 2037))]


def test_days_that_are_added_or_moved_are_where_they_are():
    assert [day[1] for day in days("DTSTART;VALUE=DATE:20260610\nRDATE;VALUE=DATE:20260812,20270113")] == [
        "2026-06-10", "2026-08-12", "2027-01-13"]
    assert [day[1] for day in days("UID:1\nDTSTART;VALUE=DATE:20260610\nRRULE:FREQ=YEARLY;COUNT=2",
                                   "UID:1\nRECURRENCE-ID;VALUE=DATE:20270610\nDTSTART;VALUE=DATE:20270614")] == ["2026-06-10", "2027-06-14"]


def test_a_yearly_rule_that_is_more_than_the_same_day_becomes_its_dates():
    thanksgiving = days("SUMMARY:Thanksgiving\nDTSTART:20201126\nRRULE:FREQ=YEARLY;BYMONTH=11;BYDAY=4TH")
    assert thanksgiving[0] == ("Thanksgiving", "2026-11-26", "2026-11-26", False)
    assert (len(thanksgiving), thanksgiving[-1][1]) == (11, "2036-11-27")
    assert [day[1] for day in days("DTSTART:20240610\nDTEND:20240612\nRRULE:FREQ=YEARLY;COUNT=3")] == ["2026-06-10"]
    assert [day[1] for day in days("DTSTART:20250610\nRRULE:FREQ=YEARLY;UNTIL=20270610T000000Z;INTERVAL=2")] == ["2027-06-10"]


@pytest.mark.parametrize("event", [
    "SUMMARY:No date", "DTSTART:20270231", "DTSTART:2027-07-05", "DTSTART:20270705\nRRULE:FREQ=WEEKLY", "DTSTART:20270705\nRRULE:nonsense",
    "DTSTART:20270705\nDTEND:20290705", "DTSTART:99990705", "DTSTART:20270705\nDURATION:P99999W"])
def test_what_can_not_be_taken_is_counted_and_the_rest_is_taken(event):
    found = read_days(calendar(event, "SUMMARY:Good\nDTSTART:20270705"), "plant", HELSINKI, TODAY)
    assert ([e.name for e in found.exceptions], found.left_out, found.past) == (["Good"], 1, 0)


@pytest.mark.parametrize("times", [
    "DTSTART:20270705T080000\nDTEND:20270705T100000", "DTSTART:20270705T100000", "DTSTART:20270705T200000\nDTEND:20270706T060000",
    "DTSTART:20270705T000000\nDTEND:20270705T120000", "DTSTART:20270705T210000Z\nDURATION:PT2H", "DTSTART:20270705T000000"])
def test_an_appointment_closes_nothing_unless_it_is_asked_for(times):
    events = calendar(f"SUMMARY:Meeting\n{times}", "SUMMARY:Break\nDTSTART:20270712")
    found = read_days(events, "plant", HELSINKI, TODAY)
    assert ([e.name for e in found.exceptions], [e.name for e in found.timed]) == (["Break"], ["Meeting"])
    assert (found.left_out, found.past) == (0, 0)
    found = read_days(events, "plant", HELSINKI, TODAY, with_timed=True)
    assert ([e.name for e in found.exceptions], found.timed) == (["Meeting", "Break"], [])


@pytest.mark.parametrize("times", ["DTSTART:20270705T000000\nDTEND:20270707T000000", "DTSTART:20270704T210000Z\nDTEND:20270706T210000Z",
                                   "DTSTART:20270705\nDTEND:20270707"])
def test_from_midnight_to_midnight_is_whole_days(times):
    [found] = read_days(calendar(f"SUMMARY:Break\n{times}"), "plant", HELSINKI, TODAY).exceptions
    assert (found.first_day, found.last_day) == (date(2027, 7, 5), date(2027, 7, 6))


def test_cancelled_events_are_passed_over_and_so_is_a_cancelled_day_of_a_repetition():
    found = read_days(calendar("SUMMARY:Off\nDTSTART:20270705\nSTATUS:CANCELLED", "SUMMARY:Old\nDTSTART:20200705\nSTATUS:cancelled",
                               "STATUS:CANCELLED", "SUMMARY:Good\nDTSTART:20270712"), "plant", HELSINKI, TODAY)
    assert ([e.name for e in found.exceptions], found.left_out, found.past) == (["Good"], 0, 0)
    assert [day[1] for day in days("UID:1\nDTSTART;VALUE=DATE:20270610\nRRULE:FREQ=YEARLY;COUNT=3",
                                   "UID:1\nRECURRENCE-ID;VALUE=DATE:20280610\nDTSTART;VALUE=DATE:20280610\nSTATUS:CANCELLED")] == [
        "2027-06-10", "2029-06-10"]


@pytest.mark.parametrize("content", [
    calendar(*["DTSTART:20260101\nRRULE:FREQ=YEARLY;BYDAY=MO,TU,WE,TH,FR,SA,SU"] * 60),
    calendar("DTSTART:19700101\nRRULE:FREQ=YEARLY;COUNT=50000;BYDAY=MO,TU,WE,TH,FR,SA,SU"),
    calendar("DTSTART:20260101\nEXDATE:" + ",".join(["20270101"] * 120_000)),
    calendar("DTSTART:20260101\n" + "X:\n" * 50_000), calendar(*[f"SUMMARY:{n}\nDTSTART:20270105" for n in range(2_001)]),
    with_zone('DTSTART;TZID="(UTC+99) Plant":20270105T200000', "+0100", "+0200", "FREQ=SECONDLY"),
    *(with_zone('DTSTART;TZID="(UTC+99) Plant":20270105T200000', "+0100", "+0200", rule) for rule in (
        "FREQ=YEARLY;BYSECOND=1,2,3", "FREQ=YEARLY;BYYEARDAY=1,2,3", "FREQ=YEARLY;BYDAY=MO,TU,WE", "FREQ=YEARLY;BYDAY=MO",
        "FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=30", "FREQ=YEARLY;BYMONTH=1;BYMONTHDAY=1;BYDAY=-1MO", "FREQ=YEARLY;BYMONTH=1;BYDAY=53MO",
        "FREQ=YEARLY;BYMONTH=13;BYMONTHDAY=1",
        "FREQ=YEARLY;BYMONTH=1\nEXRULE:FREQ=SECONDLY", "\nRRULE:".join(["FREQ=YEARLY;BYMONTH=1;BYDAY=1MO"] * 61)))])
def test_a_file_that_would_take_long_or_much_is_refused_early(content):
    begins = time.process_time()
    with pytest.raises(ics.TooMuch):
        read_days(content, "plant", HELSINKI, TODAY)
    assert time.process_time() - begins < 5


@pytest.mark.parametrize("rule", ["FREQ=YEARLY;BYMONTH=3;BYDAY=-1SU", "FREQ=YEARLY;INTERVAL=1;BYDAY=-1SU;BYMONTH=3", "FREQ=YEARLY",
                                  "FREQ=YEARLY;BYMONTH=3;BYDAY=SU;BYMONTHDAY=25,26,27,28,29,30,31", "FREQ=YEARLY;BYMONTH=3;BYMONTHDAY=29",
                                  "FREQ=YEARLY;BYMONTH=3;BYMONTHDAY=-3;WKST=SU;UNTIL=20401231T000000Z"])
def test_zones_that_change_once_a_year_are_read(rule):
    content = with_zone('DTSTART;TZID="(UTC+99) Plant":20270706T040000', "+0800", "+0900", rule)
    assert [e.first_day.isoformat() for e in read_days(content, "plant", HELSINKI, TODAY).timed] == ["2027-07-05"]


@pytest.mark.parametrize("name", ["Europe", "Europe/", "x" * 300, "a/" * 3000, "..", "é", ""])
def test_an_unknown_zone_is_taken_as_the_plants_whatever_its_name(name):
    assert [day[1] for day in days(f"DTSTART;TZID={name}:20270705T233000")] == ["2027-07-05"]


NEVER = "RRULE:FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=30"


@pytest.mark.parametrize("events", [[f"DTSTART:20260101\n{NEVER}"] * 2, ["\n".join(["DTSTART:20260101", *[NEVER] * 1_000])],
                                    ["DTSTART:20260101\nEXDATE:" + ",".join(["20270101T000000"] * 2_000)]])
def test_what_takes_long_ends_in_time(events, monkeypatch):
    monkeypatch.setattr(calendar_import, "LONGEST_READING_S", .0)
    with pytest.raises(ics.TooMuch):
        read_days(calendar(*events), "plant", HELSINKI, TODAY)


def test_what_was_over_before_this_year_is_past_and_the_same_twice_is_once():
    found = read_days(calendar("SUMMARY:Old\nDTSTART:20251224", "SUMMARY:A\nDTSTART:20260105", "SUMMARY:A\nDTSTART:20260105"), "plant",
                      HELSINKI, TODAY)
    assert ([e.name for e in found.exceptions], found.past) == (["A"], 1)


@pytest.mark.parametrize("content", [
    b"", b"not a calendar", b"\xff\xfe\x00", b"BEGIN:VCALENDAR", b"BEGIN:VCALENDAR\r\nBEGIN:VEVENT\r\nEND:VCALENDAR", b"<html></html>",
    b"BEGIN:VCARD\r\nEND:VCARD", b"BEGIN:VCALENDAR\r\nno colon here\r\nEND:VCALENDAR", b"END:VCALENDAR", b"{}"])
def test_garbage_is_no_calendar(content):
    with pytest.raises(ics.NotACalendar):
        read_days(content, "plant", HELSINKI, TODAY)


# ---------------------------------------------------------------------- any text
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=300)


@given(TEXTS)
def test_any_text_survives_writing_and_reading_and_no_line_is_too_long(text):
    written = ics.text_line("SUMMARY", text)
    assert written.endswith("\r\n")
    assert all(len(part.encode()) <= ics.FOLD_AT for part in written.split("\r\n"))
    [read] = ics.events(calendar(written.removesuffix("\r\n")))
    assert read["SUMMARY"] == text.replace("\r\n", "\n").replace("\r", "\n")


@given(st.binary(max_size=400) | st.lists(st.sampled_from([
    "BEGIN:VCALENDAR", "END:VCALENDAR", "BEGIN:VEVENT", "END:VEVENT", "DTSTART:20270705", "DTSTART;VALUE=DATE:20271305", "DTEND:20270101",
    "DURATION:P1W", "DURATION:-P1D", "RRULE:FREQ=YEARLY", "RRULE:FREQ=YEARLY;COUNT=99999", "RRULE:FREQ=YEARLY;BYDAY=53MO", "SUMMARY:a\\",
    " folded", "\tfolded", "", ":", ";", "X", "DTSTART;TZID=:2", "RRULE:FREQ=SECONDLY"]), max_size=30).map(
        lambda lines: "\r\n".join(["BEGIN:VCALENDAR", *lines, "END:VCALENDAR"]).encode()))
def test_whatever_a_file_holds_reading_ends_with_days_or_says_no(content):
    try:
        found = read_days(content, "plant", HELSINKI, TODAY)
    except (ics.NotACalendar, ics.TooMuch):
        return
    assert all(e.first_day <= e.last_day and 1 <= len(e.name) <= 80 for e in found.exceptions)


@given(st.lists(st.tuples(st.text(st.characters(categories=["L", "N", "P", "Zs"]), min_size=1, max_size=80),
                          st.dates(date(2026, 1, 1), date(2199, 1, 1)), st.integers(0, 100)), min_size=1, max_size=8))
def test_days_written_as_all_day_events_come_back(given_days):
    events = "".join("BEGIN:VEVENT\r\n" + ics.text_line("SUMMARY", name) + ics.line("DTSTART;VALUE=DATE", f"{first:%Y%m%d}")
                     + ics.line("DTEND;VALUE=DATE", f"{first + timedelta(days=length + 1):%Y%m%d}") + "END:VEVENT\r\n"
                     for name, first, length in given_days)
    found = read_days(f"BEGIN:VCALENDAR\r\n{events}END:VCALENDAR\r\n".encode(), "plant", HELSINKI, TODAY)
    wanted = {(cleaned(name) or "plant", first, first + timedelta(days=length)) for name, first, length in given_days}
    assert {(e.name, e.first_day, e.last_day) for e in found.exceptions} == wanted


# ---------------------------------------------------------------------- files
@pytest.fixture
def world(tmp_path):
    world = World(tmp_path)
    world.files = CalendarFiles(world.db, world.catalogue, world.clock, tmp_path)
    yield world
    world.db.close()


def test_an_import_says_what_it_took_and_takes_nothing_twice(world, tmp_path):
    daily = world.schedule()
    (tmp_path / "plant.ics").write_bytes(calendar("SUMMARY:Audit\nDTSTART:20261124\nDTEND:20261126", "SUMMARY:Old\nDTSTART:20200101",
                                                  "SUMMARY:x\nDTSTART:20270705\nRRULE:FREQ=DAILY"))
    first = world.files.import_days("plant.ics")
    assert (first.days, first.known, first.left_out, first.past) == (2, 0, 1, 1)
    [stored] = CalendarRepository().all(world.db.read())
    assert stored == DayException("Audit", date(2026, 11, 24), date(2026, 11, 25), source="plant.ics", id=stored.id)
    assert world.stored(daily).next_at.replace(tzinfo=None) == datetime(2026, 11, 26, 6, 30)
    again = world.files.import_days("plant.ics")
    assert (again.days, again.known) == (0, 1)
    assert len(CalendarRepository().all(world.db.read())) == 1


@pytest.mark.parametrize(("content", "told"), [
    (b"nonsense", "is not a calendar file"), (calendar(), "has no days to take$"),
    (calendar("SUMMARY:Every week\nDTSTART:20270705\nRRULE:FREQ=WEEKLY"), "only whole days are taken"),
    (b"x" * (1024 * 1024 + 1), "holds too much"), (b"x" * (5 * 1024 * 1024 + 1), "larger than 5 MiB")])
def test_what_is_no_calendar_is_told_in_one_sentence_and_nothing_changes(world, tmp_path, content, told):
    (tmp_path / "plant.ics").write_bytes(content)
    with pytest.raises(InvalidInput, match=told) as caught:
        world.files.import_days("plant.ics")
    assert caught.value.field == "path"
    assert CalendarRepository().all(world.db.read()) == []


def test_a_file_that_is_not_there_is_told(world):
    with pytest.raises(InvalidInput, match="there is no file"):
        world.files.import_days("nowhere.ics")
