"""The exception calendar in words: the month, its entries, the year, what an import brought."""
from __future__ import annotations

from datetime import date
from pathlib import Path

from app.domain.models import DayException, Settings
from app.i18n import translator
from app.screens.settings import calendar_view as view
from app.screens.settings.country_names import translations
from app.screens.settings.facts import SettingsFacts
from app.services.files.calendar_import import Imported
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
    assert cells[0].day is None                             # 1 December 2026 is a Tuesday
    assert (kind_of(cells, 1), kind_of(cells, 12)) == (("work", ""), ("free", ""))
    assert (kind_of(cells, 5), kind_of(cells, 6), kind_of(cells, 24)) == (("extra", view.EXTRA), ("closed", view.HOLIDAY),
                                                                          ("closed", view.CLOSED))
    assert [cell.text for cell in view.month_days(FACTS, 2026, 11, TODAY) if cell.today] == ["20"]


def test_entries_of_a_month_are_in_order_with_their_span():
    rows = view.entries(FACTS, 2026, 12)
    assert [(row.text, row.note, row.removable) for row in rows] == [
        ("Fair", "Sat 5 Dec · extra working day", True), ("Independence Day", "Sun 6 Dec · public holiday", False),
        ("Shutdown", "Thu 24 Dec – Sun 3 Jan · closed · every year · plant.ics", True)]
    assert [row.text for row in view.entries(FACTS, 2031, 1)] == ["Shutdown", "Epiphany"]
    assert len({row.key for row in rows}) == len(rows)


def test_the_year_is_reported_by_what_differs_from_the_week():
    assert view.year_note(SettingsFacts(exceptions=(FAIR,)), 2026) == "2026: 0 working days closed, 1 extra"
    assert view.year_note(SettingsFacts(exceptions=(SHUTDOWN,)), 2027) == "2027: 7 working days closed"
    assert view.year_note(SettingsFacts(), 2026) == "2026: no special days"


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


def test_an_import_says_days_and_what_was_left():
    result = view.import_result(Imported(Path("/x/plant.ics"), (SHUTDOWN, FAIR), known=1, left_out=2, past=3))
    assert (result.text, result.tone) == ("12 closed days imported", "attention")
    assert result.note.split("\n") == [
        "Shutdown: Thu 24 Dec – Sun 3 Jan, Fair: Sat 5 Dec", "1 entry existed already", "3 past entries skipped",
        "2 events can't be imported: they have no date, or don't repeat yearly"]
    nothing = view.import_result(Imported(Path("/x/plant.ics"), (), known=4, left_out=0, past=0))
    assert (nothing.text, nothing.note, nothing.tone) == ("The file contains nothing new", "", "done")


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
    assert {code for code, name in translations().items() if known[code] != name} == {"AX", "HK"}      # Åland, Hong Kong
