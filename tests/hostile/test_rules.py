"""Recurrences that are valid but costly to search: none delays others, when it is saved or falls due. Work is counted
in lines that run, not timed."""

from __future__ import annotations

from datetime import UTC, date, datetime, timedelta

import pytest

from app.domain.models import WEEKDAYS, DayException, InvalidInput, Schedule, Settings
from app.services.catalogue import validation
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.configuration import import_configuration, preview
from app.services.planning.recurrence import check_has_instants, next_occurrence, occurrences
from app.services.planning.working_days import WorkingCalendar
from tests.hostile.test_import_on_the_scheduler import document
from tests.support.edits import add_days, import_file
from tests.support.errors import refuses
from tests.support.steps import steps

EVERY_DAY = WorkingCalendar(Settings(working_days=WEEKDAYS))
FEW, SOME, MANY = 4_000, 40_000, 260_000
MONDAY = datetime(2026, 11, 23, 4)
NOW = MONDAY.replace(hour=12, tzinfo=UTC)
LEAP = "BYMONTH=2;BYMONTHDAY=29;BYDAY=SU"
EVERY_MINUTE = f"BYHOUR={','.join(map(str, range(24)))};BYMINUTE={','.join(map(str, range(60)))}"
MONTH_DAYS = f"BYMONTHDAY={','.join(map(str, range(1, 32)))}"


def schedule(rule: str, zone: str = "UTC", start: datetime = MONDAY, respects: bool = False) -> Schedule:
    return Schedule("S", 1, 1, start, zone, rule, respect_working_days=respects)


# ---------------------------------------------------------------------- the next start
@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ("FREQ=HOURLY;BYMONTH=11;BYMONTHDAY=23;BYDAY=MO;BYHOUR=4", "2037-11-23 04:00"),
        (f"FREQ=HOURLY;{LEAP}", "2032-02-29 00:00"),
        (f"FREQ=MINUTELY;{LEAP};BYHOUR=23;BYMINUTE=59", "2032-02-29 23:59"),
        (f"FREQ=DAILY;{LEAP};BYHOUR=5", "2032-02-29 05:00"),
        (f"FREQ=MONTHLY;{LEAP};BYHOUR=5", "2032-02-29 05:00"),
        (f"FREQ=YEARLY;{LEAP};BYHOUR=5", "2032-02-29 05:00"),
        (f"FREQ=YEARLY;{MONTH_DAYS};{EVERY_MINUTE}", "2026-11-23 12:01"),
        ("FREQ=HOURLY;INTERVAL=100000", "2038-04-20 20:00"),
        ("FREQ=MINUTELY;INTERVAL=1440;BYMONTH=12;BYMONTHDAY=31", "2026-12-31 04:00"),
        ("FREQ=DAILY;INTERVAL=100000", None),
        ("FREQ=MINUTELY;INTERVAL=1439;BYHOUR=3;BYMINUTE=59", "2026-11-24 03:59"),
        ("FREQ=MINUTELY;INTERVAL=1439;BYHOUR=5;BYMINUTE=0", "2030-09-02 05:00"),
    ],
)
def test_a_date_that_is_years_away_is_found_in_few_steps(rule, expected):
    found = []
    assert steps(lambda: found.append(next_occurrence(schedule(rule), NOW, EVERY_DAY))) <= (
        SOME if "1439" in rule else FEW
    )
    assert [found[0] and f"{found[0]:%Y-%m-%d %H:%M}"] == [expected]


@pytest.mark.parametrize(
    "rule",
    [
        "FREQ=MINUTELY;BYMINUTE=59",
        "FREQ=MINUTELY",
        f"FREQ=DAILY;{EVERY_MINUTE}",
        f"FREQ=MINUTELY;{EVERY_MINUTE}",
        f"FREQ=HOURLY;{EVERY_MINUTE}",
        "FREQ=HOURLY;COUNT=1000000",
        "FREQ=DAILY;COUNT=1000000",
    ],
)
@pytest.mark.parametrize(
    "now", ["2026-12-07 23:58", "2027-03-28 00:59", "2027-03-28 01:30", "2027-10-30 23:59", "2027-10-31 00:59"]
)
def test_a_dense_rule_costs_little_at_any_time_of_any_day(rule, now):
    rule_of, after = schedule(rule, "Europe/Helsinki"), datetime.fromisoformat(now).replace(tzinfo=UTC)
    next_occurrence(rule_of, NOW, EVERY_DAY)  # where COUNT ends is known from now on
    assert steps(lambda: next_occurrence(rule_of, after, EVERY_DAY)) <= FEW


@pytest.mark.parametrize("rule", ["FREQ=DAILY", "FREQ=MINUTELY", "FREQ=WEEKLY;BYDAY=SA", f"FREQ=HOURLY;{EVERY_MINUTE}"])
def test_the_search_ends_where_no_day_is_a_working_day(rule):
    closed = WorkingCalendar(Settings(), [DayException("Closed", date(2026, 1, 1), date(2026, 12, 31), yearly=True)])
    found = []
    assert steps(lambda: found.append(next_occurrence(schedule(rule, respects=True), NOW, closed))) <= MANY
    assert found == [None]


# ---------------------------------------------------------------------- what is refused
@pytest.mark.parametrize(
    "rule",
    [
        "FREQ=MINUTELY;BYHOUR=1;COUNT=1000000",
        "FREQ=MINUTELY;BYHOUR=1;BYMINUTE=1;COUNT=1000000",
        f"FREQ=HOURLY;{LEAP};COUNT=1000000",
        "FREQ=MINUTELY;INTERVAL=7;BYDAY=MO,TU,WE,TH,FR,SA;COUNT=1000000",
    ],
)
def test_a_count_that_takes_years_of_days_is_refused(rule):
    with refuses("recurrence", r"COUNT=1000000 .* UNTIL"):
        steps(lambda: validation.schedule(schedule(rule)), most=MANY)


@pytest.mark.parametrize(
    ("rule", "last"),
    [
        ("FREQ=MINUTELY;BYHOUR=1;COUNT=6000", "2027-03-03 01:59"),
        ("FREQ=MINUTELY;BYMINUTE=0,30;COUNT=10000", "2027-06-19 11:30"),
        ("FREQ=HOURLY;BYDAY=SU;COUNT=48", "2026-12-06 23:00"),
        ("FREQ=HOURLY;BYHOUR=6,14;COUNT=1000", "2028-04-05 14:00"),
        ("FREQ=DAILY;BYMONTHDAY=31;COUNT=700", "2126-10-31 04:00"),
        ("FREQ=MINUTELY;COUNT=1000000", "2028-10-17 14:39"),
        (f"FREQ=DAILY;{EVERY_MINUTE};COUNT=1000000", "2028-10-17 14:39"),
    ],
)
def test_a_count_is_counted_by_days(rule, last):
    rule_of, found = schedule(rule), []
    steps(lambda: check_has_instants(rule_of), most=SOME)
    around = datetime.fromisoformat(last).replace(tzinfo=UTC) - timedelta(days=1)
    steps(lambda: found.append(next_occurrence(rule_of, around, EVERY_DAY)), most=SOME)
    assert found[0] is not None
    assert [f"{o.instant:%Y-%m-%d %H:%M}" for o in occurrences(rule_of, around, EVERY_DAY)][-1] == last


def test_the_last_of_a_large_count_may_lie_beyond_the_calendar():
    check_has_instants(schedule("FREQ=HOURLY;INTERVAL=100000;COUNT=1000000"))


@pytest.mark.parametrize(
    "rule",
    [
        "FREQ=HOURLY;INTERVAL=48;BYHOUR=10",
        "FREQ=MINUTELY;INTERVAL=2;BYMINUTE=1,3,5",
        "FREQ=MINUTELY;INTERVAL=60;BYMINUTE=31",
    ],
)
def test_a_rule_that_comes_too_rarely_is_refused_in_one_sentence(rule):
    with pytest.raises(InvalidInput, match="the recurrence is too rare to be searched"):
        steps(lambda: validation.schedule(schedule(rule)), most=MANY)
    assert next_occurrence(schedule(rule), NOW, EVERY_DAY) is None


@pytest.mark.parametrize("rule", ["FREQ=HOURLY;INTERVAL=24;BYHOUR=10", "FREQ=HOURLY;INTERVAL=24;BYHOUR=10;COUNT=3"])
def test_times_of_day_that_never_come_are_not_a_start(rule):
    with pytest.raises(InvalidInput, match="has no start"):
        steps(lambda: validation.schedule(schedule(rule)), most=SOME)


def test_a_recurrence_has_at_most_five_hundred_characters(container):
    longest = f"FREQ=YEARLY;{MONTH_DAYS};{EVERY_MINUTE};INTERVAL=1;BYDAY=MO,TU,WE,TH,FR,SA,SU;BYMONTH=1,2,3,4,5,6,7,8,9,10,11,12"
    validation.schedule(schedule(longest))
    endless = "FREQ=DAILY;BYDAY=" + ",".join(["MO"] * 20_000)
    with pytest.raises(InvalidInput, match="at most 500 characters"):
        validation.schedule(schedule(endless))
    with pytest.raises(InvalidInput, match=r"schedules\[0\].recurrence: a recurrence has at most 500 characters"):
        import_configuration(container.catalogue, document([{"recurrence": endless}]))


# ---------------------------------------------------------------------- the plan
def test_odd_rules_that_fall_due_together_delay_no_other_start(site):
    site.add_mission("Deliver")
    schedules = [
        {
            "name": f"odd {number}",
            "robot": "R1",
            "mission": "Deliver",
            "start": f"{site.clock.now():%Y-%m-%d}T06:05",
            "recurrence": "FREQ=HOURLY;BYMONTH=11;BYMONTHDAY=23;BYDAY=MO;BYHOUR=6",
        }
        for number in range(60)
    ]
    catalogue = site.container.catalogue
    steps(lambda: import_file(catalogue, settings={"timezone": "UTC"}, schedules=schedules), most=60 * FEW * 2)
    site.run(290)
    steps(lambda: site.run(60), most=60 * FEW * 2)  # all of them fall due, and what comes next is searched
    assert {f"{each.next_at:%Y-%m-%d %H:%M}" for each in site.container.catalogue.schedules()} == {"2037-11-23 06:05"}
    assert len(site.executions()) == 60


def close_a_day(catalogue: Catalogue) -> None:
    (day,) = add_days(catalogue, [DayException("Closed", date(2026, 11, 25), date(2026, 11, 25))])
    catalogue.restore(catalogue.remove_days(day.id))


@pytest.fixture
def held(container, monkeypatch) -> list[int]:
    """For how many lines of planning each transaction holds the writer."""
    lines, write = list[int](), container.db.write

    def counted(work, *patient):
        def transaction(c):
            found = []
            lines.append(steps(lambda: found.append(work(c))))
            return found[0]

        return write(transaction, *patient)

    monkeypatch.setattr(container.db, "write", counted)
    return lines


@pytest.mark.long
def test_a_change_of_working_days_holds_the_writer_briefly(container, held):
    schedules = [{"name": f"s{number}", "recurrence": "FREQ=DAILY"} for number in range(1000)]
    import_configuration(container.catalogue, document(schedules))
    held.clear()
    for change in (
        lambda catalogue: catalogue.change_settings(working_days=("MO", "TU")),
        lambda catalogue: catalogue.set_public_holidays("FI"),
        close_a_day,
    ):
        change(container.catalogue)
    assert 0 < max(held) < 1000 * 1000


@pytest.mark.parametrize("timezone", [{}, {"timezone": "Europe/Helsinki"}])
def test_where_counts_end_is_found_before_the_transaction_of_an_import(container, held, timezone):
    between = {"from": "03:00", "to": "04:00"}
    rule = {"recurrence": "FREQ=MINUTELY;INTERVAL=1439;COUNT=3900", "between": between, **timezone}
    starts = [f"2026-11-25T06:{minute}" for minute in range(10, 20)]
    content = document([{"name": f"s{start}", "start": start, **rule} for start in starts])
    preview(container.catalogue, content)
    import_configuration(container.catalogue, content)
    assert 0 < max(held) < len(starts) * FEW
