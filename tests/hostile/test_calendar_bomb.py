"""Calendar files of a few bytes that stand for thousands of days: counted while they are expanded."""
from __future__ import annotations

import itertools
import tracemalloc
from datetime import date
from zoneinfo import ZoneInfo

import pytest

from app.domain.models import InvalidInput
from app.services.files import calendar_import, ics
from app.services.files.calendar_import import read_days
from tests.support.site import Site

TODAY = date(2026, 11, 23)
MONTHS = "BYMONTH=" + ",".join(map(str, range(1, 13)))
EVERY_DAY = f"RRULE:FREQ=YEARLY;{MONTHS};BYDAY=MO,TU,WE,TH,FR,SA,SU"


def calendar(*events: list[str]) -> bytes:
    lines = [line for event in events for line in ("BEGIN:VEVENT", "DTSTART;VALUE=DATE:20260101", *event, "END:VEVENT")]
    return "\r\n".join(["BEGIN:VCALENDAR", *lines, "END:VCALENDAR", ""]).encode()


def excepted() -> str:
    return "EXDATE;VALUE=DATE:" + ",".join(f"{year}{month:02}{day:02}" for year in range(2026, 2037) for month in range(1, 13)
                                           for day in range(1, 29))


@pytest.mark.parametrize("content", [
    calendar(["SUMMARY:bomb", EVERY_DAY]),
    calendar(*[[f"SUMMARY:bomb {number}", EVERY_DAY] for number in range(60)]),
    calendar([EVERY_DAY] * 100),
    calendar([excepted(), *[f"RRULE:FREQ=YEARLY;{MONTHS};BYMONTHDAY=" + ",".join(map(str, range(1, 29)))] * 20]),
], ids=["one rule", "sixty events", "rules without end", "rules of days that are excepted"])
def test_a_bomb_stops_at_the_limit(content, monkeypatch):
    """Of what is counted, not of time."""
    monkeypatch.setattr(calendar_import, "LONGEST_READING_S", 1e6)
    ics.events(calendar([]))                           # loads the library
    tracemalloc.start()
    try:
        with pytest.raises(ics.TooMuch):
            read_days(content, "bomb", ZoneInfo("UTC"), TODAY)
        assert tracemalloc.get_traced_memory()[1] < 20 << 20
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("content", [
    calendar(["RDATE;VALUE=DATE:" + ",".join(["20260101"] * 100_000)]),
    calendar(["EXDATE;VALUE=DATE:" + ",".join(["20260101"] * 100_000)]),
    calendar(["EXD\r\n ATE;VALUE=DATE:" + ",\r\n ".join(["20260101"] * 39_000)]),
    calendar(["RRULE:FREQ=YEARLY;BYMONTHDAY=" + ",".join(["1"] * 500_000)]),
    calendar(["CATEGORIES:" + ",".join(["a"] * 500_000)]),
    calendar(["X-A" + ";P=a" * 200_000 + ":b"]),
    calendar(*[["SUMMARY:past"]] * 9_000),
    calendar(*[[]] * 9_000).replace(b"BEGIN:VEVENT", b"begin;x=1:ve\r\n vent"),
], ids=["dates", "exceptions", "folded", "days of a rule", "categories", "parameters", "events", "folded events"])
def test_what_takes_long_to_parse_is_not_parsed(content, monkeypatch):
    ics.events(calendar([]))
    monkeypatch.setattr("icalendar.Calendar.from_ical", lambda *_args, **_options: pytest.fail("parsed"))
    with pytest.raises(ics.TooMuch):
        ics.events(content)


def test_the_calendar_of_a_company_is_parsed():
    event = ["SUMMARY:Closed\\, as every year\\; ask at the gate", "CATEGORIES:a,b", "DTEND;VALUE=DATE:20260102",
             "EXDATE;VALUE=DATE:20270101"]
    assert len(ics.events(calendar(*[event] * 4_000))) == 4_000


def test_reading_ends_in_time(monkeypatch):
    """The clock goes on by a second each time that it is looked at."""
    seconds = itertools.count()
    monkeypatch.setattr(calendar_import.time, "monotonic", lambda: float(next(seconds)))
    exceptions = calendar(["EXDATE;VALUE=DATE:20270101,20270102"])
    assert len(read_days(exceptions, "quick", ZoneInfo("UTC"), TODAY).exceptions) == 1
    with pytest.raises(ics.TooMuch, match="takes too long"):
        read_days(calendar(["EXDATE;VALUE=DATE:" + ",".join(["20270101"] * 30)]), "slow", ZoneInfo("UTC"), TODAY)


def test_it_is_said_in_one_sentence_and_nothing_is_taken(tmp_path):
    site = Site(tmp_path / "data")
    bomb = tmp_path / "bomb.ics"
    bomb.write_bytes(calendar([EVERY_DAY]))
    with pytest.raises(InvalidInput, match=r"bomb\.ics holds too much for a calendar of closed days"):
        site.container.calendar_files.import_days(str(bomb))
    assert site.container.catalogue.day_exceptions() == []
    site.switch_off()
