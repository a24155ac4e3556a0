"""Calendar files of a few bytes that stand for thousands of days, or that take long to read: counted while they are followed."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Iterator
from datetime import date
from zoneinfo import ZoneInfo

import pytest

from app.domain.models import InvalidInput
from app.services.files import calendar_days, ics
from app.services.files.calendar_days import read_days

FAR_TOO_LONG = 60.0  # s of processor time; each takes less than one
TODAY = date(2026, 11, 23)
MONTHS = "BYMONTH=" + ",".join(map(str, range(1, 13)))
EVERY_DAY = f"RRULE:FREQ=YEARLY;{MONTHS};BYDAY=MO,TU,WE,TH,FR,SA,SU"
NEVER = "RRULE:FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=30"


def calendar(*events: list[str]) -> bytes:
    lines = [line for event in events for line in ("BEGIN:VEVENT", "DTSTART;VALUE=DATE:20260101", *event, "END:VEVENT")]
    return "\r\n".join(["BEGIN:VCALENDAR", *lines, "END:VCALENDAR", ""]).encode()


def read(content: bytes) -> calendar_days.Found:
    return read_days(content, "bomb", ZoneInfo("UTC"), TODAY)


def following(count: int) -> Iterator[list[str]]:
    """Events that cancel all of a series from a day on, each from another day."""
    for number in range(count):
        day = f"{number // 300 + 2030}{number // 25 % 12 + 1:02}{number % 25 + 1:02}"
        yield ["UID:1", f"RECURRENCE-ID;RANGE=THISANDFUTURE:{day}", "STATUS:CANCELLED"]


def excepted() -> str:
    return "EXDATE;VALUE=DATE:" + ",".join(
        f"{year}{month:02}{day:02}" for year in range(2026, 2037) for month in range(1, 13) for day in range(1, 29)
    )


@pytest.mark.parametrize(
    "content",
    [
        calendar(["SUMMARY:bomb", EVERY_DAY]),
        calendar(*[[f"SUMMARY:bomb {number}", EVERY_DAY] for number in range(60)]),
        calendar([EVERY_DAY] * 100),
        calendar([excepted(), *[f"RRULE:FREQ=YEARLY;{MONTHS};BYMONTHDAY=" + ",".join(map(str, range(1, 29)))] * 40]),
        calendar(["RRULE:FREQ=DAILY;COUNT=9999999"]),
        calendar(["RDATE;VALUE=DATE:" + ",".join(["20260101"] * 11_000)]),
        calendar(["EXDATE;VALUE=DATE:" + ",".join(["20260101"] * 11_000)]),
        calendar(
            *[
                [f"DTSTART:19500101T{number:04}00", "DURATION:PT1H", "RRULE:FREQ=DAILY;UNTIL=20250101"]
                for number in range(60)
            ]
        ).replace(b"DTSTART;VALUE=DATE:20260101\r\n", b""),
        calendar(
            *[["UID:1"]] * 1_000,
            *[["UID:1", f"RECURRENCE-ID:{number // 12 + 2027}{number % 12 + 1:02}01"] for number in range(1_000)],
        ),
    ],
    ids=[
        "one rule",
        "sixty events",
        "rules without end",
        "rules of days that are excepted",
        "a count",
        "dates",
        "exceptions",
        "meetings",
        "copies",
    ],
)
def test_a_bomb_stops_at_the_limit(content, monkeypatch):
    """The limit counts steps, not time; a tenth of it is reached in a tenth of the time."""
    monkeypatch.setattr(calendar_days, "LONGEST_READING_S", 1e6)
    monkeypatch.setattr(calendar_days, "MOST_DATES", calendar_days.MOST_DATES // 10)
    with pytest.raises(ics.TooMuch):
        read(content)


def test_a_bomb_needs_little_memory():
    read(calendar([]))  # loads the libraries
    tracemalloc.start()
    try:
        with pytest.raises(ics.TooMuch):
            read(calendar(*[[f"SUMMARY:bomb {number}", EVERY_DAY] for number in range(60)]))
        assert tracemalloc.get_traced_memory()[1] < 20 << 20
    finally:
        tracemalloc.stop()


LONG = [
    calendar(["EXD\r\n ATE;VALUE=DATE:" + ",\r\n ".join(["20270101"] * 39_000)]),
    calendar(["RRULE:FREQ=YEARLY;BYMONTHDAY=" + ",".join(["1"] * 500_000)]),
    calendar(["CATEGORIES:" + ",".join(["a"] * 500_000)]),
    calendar(["X-A" + ";P=a" * 1_000_000 + ":b"]),
    calendar(["SUMMARY" + ";P=a" * 1_000_000]),
    calendar(["SUMMARY" + ';P="a' * 1_000_000]),
    calendar(["SUMMARY" + "\x0b" * 4_000_000]),
    calendar(["\n" * 4_000_000]),
    calendar(["X\n" * 2_000_000]),
    calendar(["\0" * 4_000_000]),
    calendar(["BEGIN:X\n" * 500_000]),
    calendar(["UID:1", EVERY_DAY.replace("FREQ=YEARLY", "FREQ=YEARLY;COUNT=1500")], *following(20_000)),
    calendar(["BEGIN:X\n" * 9_000 + "END:X\n" * 9_000]),
    calendar(["DTSTART;TZID=" + "a/" * 2_000_000 + ":20270101T000000"]),
    *(
        calendar([]).replace(b"BEGIN:VEVENT", (nested * 9_000).encode() + b"BEGIN:VEVENT")
        for nested in ("BEGIN:VTIMEZONE\r\n", "BEGIN:VALARM\r\n", "BEGIN:STANDARD\r\n")
    ),
]


@pytest.mark.parametrize(
    "content",
    [*LONG[:2], *(pytest.param(content, marks=pytest.mark.long) for content in LONG[2:])],
    ids=lambda content: repr(content[60:80]),
)
def test_long_calendars_are_read_quickly(content):
    read(calendar([]))
    begins = time.process_time()
    assert len(read(content).events) == 1
    assert time.process_time() - begins < FAR_TOO_LONG


def test_a_file_of_events_alone_has_a_limit():
    with pytest.raises(ics.TooMuch):
        read(b"BEGIN:VCALENDAR\r\n" + b"BEGIN:VEVENT\r\n" * 350_000)


@pytest.mark.parametrize(
    "rule",
    [
        "FREQ=SECONDLY",
        "FREQ=YEARLY;BYSECOND=1,2,3;BYMINUTE=" + ",".join(map(str, range(60))),
        "FREQ=DAILY",
        "FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=30",
        "FREQ=YEARLY;BYDAY=MO,TU,WE,TH,FR,SA,SU",
        "FREQ=MONTHLY",
    ],
)
def test_a_zone_that_changes_all_the_time_ends_in_time(rule):
    part = f"BEGIN:STANDARD\r\nDTSTART:16010101T000000\r\nTZOFFSETTO:+0100\r\nRRULE:{rule}\r\nEND:STANDARD\r\n"
    zone = f"BEGIN:VTIMEZONE\r\nTZID:x\r\n{part}END:VTIMEZONE\r\n".encode()
    content = (
        calendar([])
        .replace(b"BEGIN:VEVENT", zone + b"BEGIN:VEVENT")
        .replace(b";VALUE=DATE:20260101", b";TZID=x:20260101T120000")
    )
    read(calendar([]))
    begins = time.process_time()
    assert [event.whole for event in read(content).events] == [False]
    assert time.process_time() - begins < FAR_TOO_LONG


def test_zones_that_no_event_uses_cost_nothing(monkeypatch):
    part = "BEGIN:STANDARD\r\nDTSTART:16010101T000000\r\nTZOFFSETTO:+0100\r\nRRULE:FREQ=YEARLY\r\nEND:STANDARD\r\n"
    zones = "".join(
        f"BEGIN:VTIMEZONE\r\nTZID:{number}\r\n{part * 90}END:VTIMEZONE\r\n" for number in range(200)
    ).encode()
    monkeypatch.setattr("app.services.files.ics_zones.Zones._by_rules", lambda *_args: pytest.fail("followed"))
    assert len(read(calendar([]).replace(b"BEGIN:VEVENT", zones + b"BEGIN:VEVENT")).events) == 1


def test_reading_ends_in_time(monkeypatch):
    """A rule that never comes takes a part of a second, and some take several."""
    monkeypatch.setattr(calendar_days, "LONGEST_READING_S", 0.5)
    begins = time.process_time()
    with pytest.raises(ics.TooMuch, match="too much work"):
        read(calendar(*[[NEVER]] * 1_000))
    assert time.process_time() - begins < FAR_TOO_LONG


@pytest.mark.parametrize("starts", [pytest.param("16010101", marks=pytest.mark.long), "20270101"])
@pytest.mark.parametrize(
    "rule",
    [
        "BYSETPOS=300",
        "BYSETPOS=300;BYMONTHDAY=30;BYMONTH=2",
        "BYMONTHDAY=30;BYMONTH=2",
        "BYYEARDAY=1;BYMONTH=6;BYWEEKNO=1,2,3,53;BYSETPOS=-1;BYDAY=MO,TU",
    ],
)
def test_a_rule_that_names_no_day_takes_little_time(starts, rule):
    content = calendar([f"RRULE:FREQ=DAILY;COUNT=1;{rule}"]).replace(b"20260101", starts.encode())
    read(calendar([]))
    begins = time.process_time()
    assert read(content).events == []
    assert time.process_time() - begins < FAR_TOO_LONG


def test_a_calendar_bomb_is_refused_in_one_sentence(container, tmp_path):
    bomb = tmp_path / "bomb.ics"
    bomb.write_bytes(calendar([EVERY_DAY]))
    with pytest.raises(InvalidInput, match=r"bomb\.ics is too large for a calendar of days off"):
        container.calendar_files.read(str(bomb))
    assert container.catalogue.day_exceptions() == []
