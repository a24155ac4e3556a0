"""The exception calendar in words: the month, its entries, the year, what an import brought."""

from __future__ import annotations

from datetime import date

from app.domain.models import DayException, Settings
from app.i18n import translator
from app.screens.settings import calendar_view as view
from app.screens.settings.country_names import translations
from app.screens.settings.facts import SettingsFacts
from app.services.files.calendar_days import FoundDays, LeftOut
from app.services.files.calendar_import import CalendarFile
from app.services.planning import public_holidays

TODAY = date(2026, 11, 20)
SHUTDOWN = DayException("Shutdown", date(2026, 12, 24), date(2027, 1, 3), yearly=True, source="plant.ics", id=1)
FAIR = DayException("Fair", date(2026, 12, 5), date(2026, 12, 5), is_working=True, id=2)
FACTS = SettingsFacts(settings=Settings(holiday_country="FI"), exceptions=(SHUTDOWN, FAIR), country="Finland")


def kind_of(cells, number):
    return next((cell.status, cell.icon) for cell in cells if cell.text == str(number))


def test_a_month_is_whole_weeks_and_each_day_says_what_it_is():
    cells = view.month_days(FACTS, 2026, 12, TODAY)
    assert len(cells) % 7 == 0
    assert [cell.text for cell in cells if cell.day] == [str(number) for number in range(1, 32)]
    assert cells[0].day is None  # 1 December 2026 is a Tuesday
    assert (kind_of(cells, 1), kind_of(cells, 12)) == (("work", ""), ("free", ""))
    assert (kind_of(cells, 5), kind_of(cells, 6), kind_of(cells, 24)) == (
        ("extra", view.EXTRA),
        ("closed", view.HOLIDAY),
        ("closed", view.CLOSED),
    )
    assert [cell.text for cell in view.month_days(FACTS, 2026, 11, TODAY) if cell.today] == ["20"]


def test_entries_of_a_month_are_in_order_with_their_span():
    rows = view.entries(FACTS, 2026, 12)
    assert [(row.title, row.support, bool(row.actions)) for row in rows] == [
        ("Fair", "Sat 5 Dec · extra working day", True),
        ("Independence Day", "Sun 6 Dec · public holiday", False),
        ("Shutdown", "Thu 24 Dec – Sun 3 Jan · every year · plant.ics", True),
    ]
    assert [row.title for row in view.entries(FACTS, 2031, 1)] == ["Shutdown", "Epiphany"]
    assert len({row.key for row in rows}) == len(rows)


def test_months_turn_within_the_years_that_a_calendar_has():
    assert view.turned(2026, 12, 1) == (2027, 1)
    assert view.turned(2026, 1, -1) == (2025, 12)
    assert view.turned(2026, 1, -9999) == (1970, 1)
    assert view.turned(2026, 1, 9999) == (2199, 12)


def test_country_and_region_are_said_or_that_there_is_none():
    assert (view.country_phrase(FACTS), view.region_phrase(FACTS)) == ("Finland", "–")
    none = SettingsFacts(has_regions=True)
    assert (view.country_phrase(none), view.region_phrase(none)) == ("No country", "All of the country")
    assert [row.key for row in view.country_options({"FI": "Finland"})] == ["", "FI"]
    assert [row.text for row in view.region_options({"BY": "Bayern"})] == ["All of the country", "Bayern"]


def found(*events, **counts):
    return CalendarFile(events, **{"name": "plant.ics", "known": 0, **counts})


def closed(name, *days, yearly=False):
    return tuple(
        DayException(name, date.fromisoformat(first), date.fromisoformat(last), yearly=yearly) for first, last in days
    )


def test_events_of_a_file_are_offered_whole_days_first():
    offered = found(
        FoundDays(closed("Break", ("2027-07-05", "2027-07-18")), True),
        FoundDays(closed("Audit", ("2026-12-01", "2026-12-01")), False),
        FoundDays(closed("Fridays", ("2027-06-04", "2027-06-04"), ("2027-06-11", "2027-06-11")), True),
        FoundDays(closed("Year's end", ("2020-12-24", "2021-01-03"), yearly=True), True),
        FoundDays(closed("Leap day", ("2024-02-29", "2024-02-29"), yearly=True), True),
    )
    assert [(item.title, item.support, item.ticked) for item in view.import_items(offered, TODAY, {0, 2, 4})] == [
        ("Whole days", "", None),
        ("Break", "Mon 5 Jul 2027 – Sun 18 Jul 2027", True),
        ("Fridays", "2 days · Fri 4 Jun 2027 – Fri 11 Jun 2027", True),
        ("Year's end", "Thu 24 Dec 2026 – Sun 3 Jan 2027 · every year", False),
        ("Leap day", "Tue 29 Feb 2028 · every year · leap years only", True),
        ("With times of day", "", None),
        ("Audit", "Tue 1 Dec 2026", False),
    ]


def test_what_is_omitted_of_a_file_is_counted_with_its_reason():
    left = {LeftOut.ENDLESS: 2, LeftOut.UNREADABLE: 1, LeftOut.OUT_OF_RANGE: 1}
    assert view.import_notes(found(known=1, past=3, left_out=left, is_whole=False)).split("\n") == [
        "The file ends in the middle: days may be missing",
        "1 event is in the calendar already",
        "3 past events left out",
        "1 event left out: it can't be read",
        "2 events left out: they repeat without end, and more often than yearly",
        "1 event left out: it lasts more than a year, or is after 2199",
    ]
    assert view.import_notes(found()) == ""


def test_an_import_says_how_many_days():
    assert view.imported_sentence((SHUTDOWN, FAIR)) == "12 days off imported"


def test_countries_are_called_and_ordered_by_their_name_in_the_language():
    translator.use("fi")
    try:
        options = view.country_options({"DE": "Germany", "FI": "Finland", "NR": "Nauru"})
        assert [(row.key, row.text) for row in options[1:]] == [("NR", "Nauru"), ("DE", "Saksa"), ("FI", "Suomi")]
        assert view.country_phrase(FACTS) == "Suomi"
    finally:
        translator.use("en")


def test_names_of_countries_are_those_of_the_library():
    known = public_holidays.countries()
    assert {code for code in translations() if code not in known} == set()
    assert {code for code, name in translations().items() if known[code] != name} == {"AX", "HK"}  # Åland, Hong Kong
