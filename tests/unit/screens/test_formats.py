"""Words for instants, spans and numbers, in both languages."""

from __future__ import annotations

from datetime import UTC, date, datetime, time, timedelta

import pytest

from app.i18n import translator
from app.screens.common import formats

ZONE = "Europe/Helsinki"
NOW = datetime(2026, 11, 20, 12, 38, 5, tzinfo=UTC)  # 14:38:05 in Helsinki


@pytest.fixture
def finnish():
    translator.use("fi")
    yield
    translator.use("en")


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (None, "–"),
        (0, "0 s"),
        (59.9, "59 s"),
        (60, "1 min"),
        (200, "3 min 20 s"),
        (485, "8 min 05 s"),
        (3600, "1 h"),
        (7800, "2 h 10 min"),
        (86400, "1 d"),
        (273600, "3 d 4 h"),
        (-3, "0 s"),
    ],
)
def test_durations(seconds, words):
    assert formats.duration(seconds) == words


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (None, "–"),
        (0.4, "now"),
        (9.9, "now"),
        (10, "10 s ago"),
        (59.9, "50 s ago"),
        (185, "3 min ago"),
        (7800, "2 h 10 min ago"),
        (180000, "2 d 2 h ago"),
    ],
)
def test_ages(seconds, words):
    assert formats.ago(seconds) == words


@pytest.mark.parametrize(
    ("ahead", "words"),
    [
        (timedelta(0), "now"),
        (timedelta(minutes=22, seconds=40), "in 22 min"),
        (timedelta(hours=2, minutes=10), "in 2 h 10 min"),
        (timedelta(days=3), "Mon 23 Nov 14:38"),
        (timedelta(days=60), "Tue 19 Jan 2027 14:38"),
    ],
)
def test_how_soon_within_a_day_and_when_beyond_it(ahead, words):
    assert formats.until(NOW + ahead, NOW, ZONE) == words


def test_instants_in_their_zone():
    assert formats.clock_time(NOW, ZONE) == "14:38"
    assert formats.wall_time(NOW, seconds=True) == "12:38:05"
    assert formats.day(NOW, ZONE) == "Fri 20 Nov"
    assert formats.day(NOW, ZONE, year=True) == "Fri 20 Nov 2026"
    assert formats.day_and_time(NOW, ZONE) == "Fri 20 Nov 14:38"
    assert formats.day_and_time(NOW, ZONE, NOW) == "14:38"
    assert formats.day_and_time(NOW - timedelta(days=1), ZONE, NOW) == "Thu 19 Nov 14:38"
    assert formats.day(datetime(2026, 11, 20, 22, 30, tzinfo=UTC), ZONE) == "Sat 21 Nov"


def test_wall_clock_times_and_days_stay_what_they_are():
    assert formats.wall_time(time(6, 5)) == "06:05"
    assert formats.wall_day(date(2026, 3, 1), year=True) == "Sun 1 Mar 2026"


def test_an_unknown_value_is_a_dash():
    assert {
        formats.clock_time(None, ZONE),
        formats.day(None, ZONE),
        formats.day_and_time(None, ZONE),
        formats.until(None, NOW, ZONE),
        formats.wall_time(None),
        formats.wall_day(None),
        formats.rough_duration(None),
        formats.number(None, 1, "%"),
        formats.percent(None),
    } == {"–"}


@pytest.mark.parametrize(("size", "words"), [(0, "1 kB"), (2_400, "2 kB"), (999_499, "999 kB"), (80_000_000, "80 MB")])
def test_sizes_of_files(size, words):
    assert formats.file_size(size) == words


def test_numbers():
    assert formats.number(98.13, 1, "%") == "98.1 %"
    assert formats.number(46.6) == "47"
    assert (formats.number(-0.4, 1), formats.number(-12345.6, 1), formats.count(100000)) == (
        "-0.4",
        "-12,345.6",
        "100,000",
    )
    assert formats.percent(78) == "78 %"


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("http://10.40.12.21", "10.40.12.21"),
        ("http://robot.local:8080/", "robot.local:8080"),
        ("https://robot.local", "https://robot.local"),
    ],
)
def test_addresses_without_what_goes_without_saying(url, words):
    assert formats.address(url) == words


@pytest.mark.usefixtures("finnish")
def test_finnish_writes_differently():
    assert formats.day(NOW, ZONE, year=True) == "pe 20.11.2026"
    assert formats.day_and_time(NOW, ZONE) == "pe 20.11. 14.38"
    assert formats.ago(20) == "20 s sitten"
    assert formats.until(NOW + timedelta(minutes=22), NOW, ZONE) == "22 min kuluttua"
    assert formats.number(98.1, 1, "%") == "98,1 %"
    assert formats.number(12345.6, 1) == f"{formats.count(12345)},6" == "12\u00a0345,6"
    assert formats.duration(273600) == "3 pv 4 h"


def test_every_language_has_complete_tables():
    for table in formats.LANGUAGES.values():
        assert [
            len(table.months),
            len(table.months_short),
            len(table.weekdays),
            len(table.weekdays_short),
            len(table.weekdays_date),
        ] == [12, 12, 7, 7, 7]
