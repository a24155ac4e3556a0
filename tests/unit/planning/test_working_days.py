"""Working days: exceptions beat the weekly rule, the shorter of two holds, holidays of a country lie below what was entered."""

from __future__ import annotations

import subprocess
import sys
from datetime import date, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.models import WEEKDAYS, DayException, Settings
from app.services.catalogue import validation
from app.services.planning import public_holidays
from app.services.planning.working_days import DayStatus, Ground, WorkingCalendar, days_of
from tests.support.errors import refuses

MONDAY, SATURDAY = date(2026, 7, 6), date(2026, 7, 11)
SUMMER = DayException("Summer break", MONDAY, date(2026, 7, 19), id=1)
FINLAND = Settings(holiday_country="FI")


def test_without_exceptions_the_days_of_the_week_decide():
    calendar = WorkingCalendar(Settings())
    assert not calendar.has_exceptions
    assert calendar.day_status(MONDAY) == DayStatus(True)
    assert calendar.day_status(SATURDAY) == DayStatus(False)


def test_public_holidays_close_and_an_own_working_day_beats_them():
    independence = date(2027, 12, 6)  # a Monday
    assert WorkingCalendar(FINLAND).day_status(independence) == DayStatus(False, "Independence Day", Ground.HOLIDAY)
    open_then = DayException("Fair", independence, independence, is_working=True, id=4)
    assert WorkingCalendar(FINLAND, [open_then]).day_status(independence).is_working


def test_the_names_of_holidays_follow_the_language():
    finnish = Settings(holiday_country="FI", language="fi")
    assert WorkingCalendar(finnish).day_status(date(2026, 12, 6)).name == "Itsenäisyyspäivä"
    assert (
        WorkingCalendar(Settings(holiday_country="DE", language="fi")).day_status(date(2026, 10, 3)).name
        == "Tag der Deutschen Einheit"
    )


def test_a_region_has_holidays_of_its_own():
    epiphany = date(2027, 1, 6)  # a Wednesday, closed in Bavaria but not in all of Germany
    assert WorkingCalendar(Settings(holiday_country="DE")).is_working_day(epiphany)
    assert not WorkingCalendar(Settings(holiday_country="DE", holiday_subdivision="BY")).is_working_day(epiphany)


def test_countries_and_regions_have_names():
    assert public_holidays.countries()["FI"] == "Finland"
    assert list(public_holidays.countries().values()) == sorted(public_holidays.countries().values())
    assert public_holidays.subdivisions("DE")["BY"] == "Bayern"
    assert public_holidays.subdivisions("nowhere") == {}


@pytest.mark.parametrize(
    ("country", "region", "field"),
    [("XX", "", "holiday_country"), ("FI", "BY", "holiday_subdivision"), ("", "BY", "holiday_subdivision")],
)
def test_an_unknown_country_or_region_is_refused(country, region, field):
    with refuses(field):
        public_holidays.check(country, region)


def test_a_country_unknown_to_this_version_closes_nothing():
    assert public_holidays.of_year("XX", "", 2026, "en") == {}


def test_a_yearly_exception_comes_back_and_may_reach_over_new_year():
    shutdown = DayException("Shutdown", date(2025, 12, 24), date(2026, 1, 2), yearly=True, id=5)
    assert list(days_of(shutdown, 2024)) == []
    assert list(days_of(shutdown, 2025)) == [date(2025, 12, day) for day in range(24, 32)]
    assert list(days_of(shutdown, 2030))[:2] == [date(2030, 1, 1), date(2030, 1, 2)]
    assert len(list(days_of(shutdown, 2030))) == 10


def test_a_yearly_29_february_comes_in_leap_years_only():
    leap = DayException("Leap day", date(2028, 2, 29), date(2028, 2, 29), yearly=True)
    assert [year for year in range(2027, 2037) if list(days_of(leap, year))] == [2028, 2032, 2036]


def test_the_exceptional_days_of_a_span_come_in_order():
    found = list(WorkingCalendar(FINLAND, [SUMMER]).exceptional(date(2026, 6, 1), date(2027, 1, 1)))
    assert [status.name for day, status in found if day < MONDAY] == ["Midsummer Eve", "Midsummer Day"]
    assert [day for day, _look in found] == sorted(day for day, _look in found)
    assert found[-1][0] == date(2027, 1, 1)


# ---------------------------------------------------------------------- what an exception can be
@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"name": " "}, "name"),
        ({"name": "x" * 81}, "name"),
        ({"last_day": date(2026, 7, 5)}, "last_day"),
        ({"first_day": date(1969, 12, 31)}, "first_day"),
        ({"last_day": date(2200, 1, 1)}, "last_day"),
        ({"last_day": MONDAY + timedelta(days=366)}, "last_day"),
    ],
)
def test_an_invalid_exception_is_reported_at_its_field(values, field):
    with refuses(field):
        validation.day_exception(DayException(**{"name": "Break", "first_day": MONDAY, "last_day": MONDAY, **values}))


DAYS = st.dates(date(2020, 1, 1), date(2032, 12, 31))
EXCEPTIONS = st.lists(
    st.builds(
        lambda first, length, is_working, yearly, number: DayException(
            f"E{number}", first, first + timedelta(days=length), is_working, yearly, id=number
        ),
        DAYS,
        st.integers(0, 40),
        st.booleans(),
        st.booleans(),
        st.integers(1, 50),
    ),
    max_size=6,
    unique_by=lambda e: e.id,
)


def holds_on(exception: DayException, day: date) -> bool:
    """The definition, without any calendar: some year's copy of the range contains the day."""
    if not exception.yearly:
        return exception.first_day <= day <= exception.last_day
    for year in range(exception.first_day.year, day.year + 1):
        shift = year - exception.first_day.year
        try:
            first = exception.first_day.replace(year=year)
        except ValueError:
            continue
        try:
            last = exception.last_day.replace(year=exception.last_day.year + shift)
        except ValueError:
            last = date(exception.last_day.year + shift, 2, 28)
        if first <= day <= last:
            return True
    return False


@given(EXCEPTIONS, DAYS, st.sets(st.sampled_from(WEEKDAYS), min_size=1))
def test_any_day_is_judged_by_the_shortest_and_newest_exception_that_holds(exceptions, day, weekdays):
    calendar = WorkingCalendar(Settings(working_days=tuple(weekdays)), exceptions)
    met = [exception for exception in exceptions if holds_on(exception, day)]
    status = calendar.day_status(day)
    assert calendar.is_working_day(day) == status.is_working
    if not met:
        assert status == DayStatus(WEEKDAYS[day.weekday()] in weekdays)
    else:
        decides = min(met, key=lambda e: (e.last_day - e.first_day, -e.id))
        assert status == DayStatus(decides.is_working, decides.name, Ground.OWN, decides.id)


# ---------------------------------------------------------------------- start-up
START = """
import sys
from app.database.connection import Database
from app.container import Container
from pathlib import Path
container = Container(Database.open(Path(sys.argv[1]) / "data" / "a.db", durable=False))
container.first_start()
container.engine.start()
container.calendar().day_status(container.clock.now().date())
container.plan.next(5)
print("holidays" in sys.modules)
container.catalogue.set_public_holidays("FI")
print("holidays" in sys.modules)
container.close()
"""


def test_the_library_of_holidays_is_read_only_when_a_country_is_chosen(tmp_path):
    output = subprocess.run(
        [sys.executable, "-c", START, str(tmp_path)], capture_output=True, text=True, check=True, timeout=60
    )
    assert output.stdout.split() == ["False", "True"]
