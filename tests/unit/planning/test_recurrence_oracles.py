"""Recurrence against two oracles: dateutil's own expansion of whole rules, and a look at every single minute."""

from __future__ import annotations

from calendar import monthrange
from collections.abc import Iterator
from datetime import UTC, date, datetime, time, timedelta
from functools import cache
from itertools import islice, pairwise, takewhile
from timeit import repeat
from zoneinfo import ZoneInfo, available_timezones

import pytest
from dateutil.rrule import rrulestr
from hypothesis import assume, given
from hypothesis import strategies as st

from app.domain.models import WEEKDAYS, Between, InvalidInput, Schedule, Settings
from app.services.planning.recurrence import (
    Recurrence,
    check_has_instants,
    next_occurrence,
    occurrences,
    passed_occurrences,
)
from app.services.planning.working_days import WorkingCalendar
from tests.support.examples import examples

EVERY_DAY = WorkingCalendar(Settings(working_days=WEEKDAYS))
LONG_AGO = datetime(1970, 1, 1, tzinfo=UTC)
MINUTE, DAY = timedelta(minutes=1), timedelta(days=1)


def schedule(
    start: datetime, rule: str, zone: str = "UTC", between: Between | None = None, respects: bool = False
) -> Schedule:
    return Schedule("S", 1, 1, start, zone, rule, between=between, respect_working_days=respects)


def listed(name: str, values: st.SearchStrategy) -> st.SearchStrategy[str]:
    """``;NAME=a,b`` or nothing."""
    some = st.lists(values, min_size=1, max_size=3, unique=True).map(
        lambda items: f";{name}=" + ",".join(map(str, items))
    )
    return st.one_of(st.just(""), some)


STARTS = st.datetimes(datetime(2020, 1, 1), datetime(2028, 12, 31)).map(
    lambda moment: moment.replace(second=0, microsecond=0)
)
MONTHS, HOURS, MINUTES = (
    listed("BYMONTH", st.integers(1, 12)),
    listed("BYHOUR", st.integers(0, 23)),
    listed("BYMINUTE", st.integers(0, 59)),
)
MONTH_DAYS = listed("BYMONTHDAY", st.integers(1, 31) | st.integers(-31, -1))
PLAIN_DAYS = listed("BYDAY", st.sampled_from(WEEKDAYS))
# With and without a number, but not both in one rule: dateutil takes the dates that fit one of each then, RFC 5545 those that fit any.
NTH_DAYS = PLAIN_DAYS | listed(
    "BYDAY", st.tuples(st.sampled_from(("1", "2", "5", "-1", "-5")), st.sampled_from(WEEKDAYS)).map("".join)
)
ENDS = st.one_of(
    st.just(""),
    st.integers(1, 40).map(lambda n: f";COUNT={n}"),
    st.dates(date(2020, 1, 1), date(2034, 1, 1)).map(lambda day: f";UNTIL={day:%Y%m%d}T{15:02}0000"),
)
DATE_RULES = st.one_of(
    st.tuples(st.just("FREQ=DAILY"), MONTHS, MONTH_DAYS, PLAIN_DAYS),
    st.tuples(st.just("FREQ=WEEKLY"), MONTHS, PLAIN_DAYS),
    st.tuples(st.just("FREQ=MONTHLY"), MONTHS, MONTH_DAYS, NTH_DAYS),
    st.tuples(st.just("FREQ=YEARLY"), MONTHS, MONTH_DAYS, NTH_DAYS),
)
INTERVALS = st.integers(1, 9).map(lambda n: f";INTERVAL={n}")


# ---------------------------------------------------------------------- dateutil
@examples(150)
@given(
    start=STARTS,
    parts=DATE_RULES,
    interval=INTERVALS,
    hours=HOURS,
    minutes=MINUTES,
    end=ENDS,
    look=st.integers(-400, 3000),
)
def test_where_no_clock_changes_it_is_what_dateutil_says(start, parts, interval, hours, minutes, end, look):
    rule = "".join(parts) + interval + hours + minutes + end
    given_schedule = schedule(start, rule)
    try:
        check_has_instants(given_schedule)
    except InvalidInput:
        assume(False)
    after = start + look * DAY
    horizon = datetime(2036, 1, 1)
    expected = [moment for moment in takewhile(lambda m: m < horizon, rrulestr(rule, dtstart=start)) if moment > after][
        :25
    ]
    found = takewhile(lambda o: o.nominal < horizon, occurrences(given_schedule, after.replace(tzinfo=UTC), EVERY_DAY))
    assert [o.nominal for o in islice(found, 25)] == expected


ODD = [
    "FREQ=DAILY;BYMONTH=2;BYMONTHDAY=29;BYDAY=SU",
    "FREQ=MONTHLY;BYMONTHDAY=31;BYDAY=-1MO",
    "FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=29;BYDAY=SU",
    "FREQ=YEARLY;BYDAY=53FR",
    "FREQ=YEARLY;BYDAY=-53MO,20TU",
    "FREQ=DAILY;INTERVAL=45;BYMONTH=1",
    "FREQ=WEEKLY;INTERVAL=52;BYMONTH=11",
    "FREQ=DAILY;INTERVAL=1000",
    "FREQ=WEEKLY;INTERVAL=200;BYDAY=MO,SU",
    "FREQ=MONTHLY;INTERVAL=7;BYMONTH=2,3;BYMONTHDAY=-1",
    "FREQ=HOURLY;BYMONTH=11;BYMONTHDAY=23;BYDAY=MO;BYHOUR=4",
    "FREQ=HOURLY;BYMONTH=2;BYMONTHDAY=29;BYDAY=SU",
    "FREQ=HOURLY;INTERVAL=2401",
    "FREQ=MINUTELY;INTERVAL=1439;BYHOUR=3;BYMINUTE=0",
    "FREQ=HOURLY;INTERVAL=25;BYHOUR=4;BYDAY=SU",
    "FREQ=MINUTELY;INTERVAL=1441;BYHOUR=2;BYDAY=SU",
    "FREQ=MINUTELY;BYMONTH=2;BYMONTHDAY=29;BYHOUR=23;BYMINUTE=58,59",
]


@pytest.mark.parametrize("rule", ODD)
def test_rules_that_come_rarely_are_what_dateutil_says(rule):
    start = datetime(2026, 11, 23, 4)
    expected = list(islice(takewhile(lambda moment: moment.year < 2060, rrulestr(rule, dtstart=start)), 5))
    found = takewhile(lambda o: o.nominal.year < 2060, occurrences(schedule(start, rule), LONG_AGO, EVERY_DAY))
    assert [o.nominal for o in islice(found, 5)] == expected


def test_weekdays_with_and_without_a_number_add_up():
    def first(days: str) -> list[datetime]:
        given_schedule = schedule(datetime(2026, 11, 23, 4), f"FREQ=MONTHLY;BYDAY={days}")
        return [o.nominal for o in islice(occurrences(given_schedule, LONG_AGO, EVERY_DAY), 60)]

    assert first("SU,1SA,-1MO") == sorted({*first("SU"), *first("1SA"), *first("-1MO")})[:60]


# ---------------------------------------------------------------------- every minute
def days_of(local: datetime) -> int:
    return monthrange(local.year, local.month)[1]


def fits(rule: Recurrence, local: datetime) -> bool:
    return (
        (not rule.weekdays or (0, local.weekday()) in rule.weekdays)
        and (not rule.month_days or local.day in rule.month_days or local.day - 1 - days_of(local) in rule.month_days)
        and (not rule.months or local.month in rule.months)
        and (not rule.hours or local.hour in rule.hours)
        and (not rule.minutes or local.minute in rule.minutes)
    )


def on_step(rule: Recurrence, is_hourly: bool, begin: datetime, moment: datetime) -> bool:
    """Both by one clock."""
    if is_hourly and rule.minutes:
        hour, first_hour = (each.replace(minute=0) for each in (moment, begin))
        return (hour - first_hour) / timedelta(hours=1) % rule.interval == 0
    return (moment - begin) / MINUTE % (rule.interval * (60 if is_hourly else 1)) == 0


def every_minute(given_schedule: Schedule, days: int) -> Iterator[datetime]:
    """The definition itself, asked of each minute from the start on."""
    rule, zone, between = (
        Recurrence.parse(given_schedule.recurrence),
        ZoneInfo(given_schedule.timezone),
        given_schedule.between,
    )
    start = given_schedule.start.replace(tzinfo=zone).astimezone(UTC)
    is_hourly = "HOURLY" in (given_schedule.recurrence or "")
    step = rule.interval * (60 if is_hourly else 1)
    if between is None and 1440 % step == 0 and step > 60:
        yield from every_time_of_day(given_schedule, rule, is_hourly, days)
        return
    for number in range(days * 1440):
        instant = start + number * MINUTE
        local = instant.astimezone(zone)
        begin = start
        if between:
            if not between.start <= local.time() <= between.end:
                continue
            begin = datetime.combine(local.date(), between.start, zone).astimezone(UTC)
        if instant < begin or not fits(rule, local):
            continue
        if between is None and 1440 % step == 0:
            fits_step = on_step(rule, is_hourly, given_schedule.start, local.replace(tzinfo=None))
        else:  # of an hour by the wall clock the steps are counted in elapsed time
            past, first_past = local.minute * MINUTE, begin.astimezone(zone).minute * MINUTE
            by_hours = is_hourly and bool(rule.minutes)
            elapsed = (instant - past) - (begin - first_past) if by_hours else instant - begin
            fits_step = elapsed / MINUTE % step == 0
        if fits_step:
            yield instant


def every_time_of_day(given_schedule: Schedule, rule: Recurrence, is_hourly: bool, days: int) -> Iterator[datetime]:
    """As a daily rule has them: shifted by the gap, or the first of two."""
    zone, start = ZoneInfo(given_schedule.timezone), given_schedule.start
    minutes = (start + number * MINUTE for number in range((days + 1) * 1440))
    wanted = [local for local in minutes if fits(rule, local) and on_step(rule, is_hourly, start, local)]
    found = {local.replace(tzinfo=zone).astimezone(UTC) for local in wanted}
    end = start.replace(tzinfo=zone).astimezone(UTC) + days * DAY
    yield from sorted(instant for instant in found if instant < end)


CHANGES = {
    "Europe/Helsinki": ((2027, 3, 27), (2026, 10, 24)),
    "America/New_York": ((2027, 3, 13), (2026, 10, 31)),
    "Asia/Kolkata": ((2026, 11, 1),),
    "America/Nuuk": ((2026, 3, 28), (2026, 10, 24)),
    "America/Santiago": ((2026, 4, 3), (2026, 9, 4)),
    "Africa/Cairo": ((2026, 4, 23), (2026, 10, 28)),
    "Atlantic/Azores": ((2026, 3, 28), (2026, 10, 24)),
}
BEGINNINGS = st.sampled_from([(zone, day) for zone, days in CHANGES.items() for day in days])
PARTS_OF_DAY = st.one_of(
    st.none(),
    st.tuples(st.integers(0, 1439), st.integers(0, 1439)).map(
        lambda ends: Between(*(time(minute // 60, minute % 60) for minute in sorted(ends)))
    ),
)
OF_THE_DAY = [n for n in range(1, 1441) if 1440 % n == 0]
SUB_DAILY = st.one_of(
    (st.integers(1, 200) | st.sampled_from(OF_THE_DAY)).map(lambda n: f"FREQ=MINUTELY;INTERVAL={n}"),
    st.integers(1, 30).map(lambda n: f"FREQ=HOURLY;INTERVAL={n}"),
)


@examples(80)
@given(
    beginning=BEGINNINGS,
    minute=st.integers(0, 1439),
    rule=SUB_DAILY,
    days=PLAIN_DAYS | MONTH_DAYS | MONTHS,
    hours=HOURS,
    minutes=MINUTES,
    part=PARTS_OF_DAY,
    look=st.integers(-60, 2 * 1440),
)
def test_sub_daily_rules_are_what_a_look_at_every_minute_finds(
    beginning, minute, rule, days, hours, minutes, part, look
):
    zone, day = beginning
    given_schedule = schedule(datetime(*day) + minute * MINUTE, rule + days + hours + minutes, zone, part)
    start = given_schedule.start.replace(tzinfo=ZoneInfo(zone)).astimezone(UTC)
    after, end = start + look * MINUTE, start + 3 * DAY
    expected = [instant for instant in every_minute(given_schedule, 3) if instant > after]
    found = [o.instant for o in takewhile(lambda o: o.instant < end, occurrences(given_schedule, after, EVERY_DAY))]
    assert found == expected


# ---------------------------------------------------------------------- from any first instant
ANY_RULE = st.one_of(DATE_RULES.map("".join), SUB_DAILY)


@examples(100)
@given(
    zone=st.sampled_from(("Europe/Helsinki", "America/Nuuk", "Australia/Lord_Howe")),
    start=STARTS,
    rule=ANY_RULE,
    hours=HOURS,
    minutes=MINUTES,
    end=ENDS,
    respects=st.booleans(),
    skip=st.integers(0, 30),
)
def test_leaping_ahead_finds_what_walking_finds(zone, start, rule, hours, minutes, end, respects, skip):
    given_schedule = schedule(start, rule + hours + minutes + end, zone, respects=respects)
    calendar = WorkingCalendar(Settings())
    walked = [o.instant for o in islice(occurrences(given_schedule, LONG_AGO, calendar), 40)]
    assert all(earlier < later for earlier, later in pairwise(walked))
    if len(walked) > skip:
        assert [o.instant for o in islice(occurrences(given_schedule, walked[skip], calendar), 39 - skip)] == walked[
            skip + 1 :
        ]
        assert next_occurrence(given_schedule, walked[skip] - timedelta(microseconds=1), calendar) == walked[skip]


# ---------------------------------------------------------------------- how many have passed
LIMITS = st.one_of(
    ENDS, st.datetimes(datetime(2026, 1, 1), datetime(2028, 1, 1)).map(lambda end: f";UNTIL={end:%Y%m%dT%H%M%S}Z")
)


@examples(150)
@given(
    zone=st.sampled_from((*CHANGES, "Australia/Lord_Howe", "UTC")),
    start=STARTS,
    rule=ANY_RULE,
    hours=HOURS,
    minutes=MINUTES,
    end=LIMITS,
    part=PARTS_OF_DAY,
    respects=st.booleans(),
    after=st.integers(0, 400 * 1440),
    days=st.integers(0, 30 * 1440),
)
def test_those_that_passed_are_as_many_as_walking_finds(
    zone, start, rule, hours, minutes, end, part, respects, after, days
):
    part = part if rule.startswith(("FREQ=M", "FREQ=H")) and "MONTHLY" not in rule else None
    some, calendar = schedule(start, rule + hours + minutes + end, zone, part, respects), WorkingCalendar(Settings())
    since = datetime(2026, 3, 1, tzinfo=UTC) + after * MINUTE
    until = since + days * MINUTE
    walked = [o.instant for o in takewhile(lambda o: o.instant <= until, occurrences(some, since, calendar))]
    assert passed_occurrences(some, since, until, calendar) == (len(walked), walked[-1] if walked else None)


@pytest.mark.parametrize(
    ("zone", "since", "days"),
    [
        ("Pacific/Apia", datetime(2011, 12, 27), 6),
        ("Europe/Helsinki", datetime(2026, 10, 23), 4),
        ("Africa/Cairo", datetime(2026, 4, 22), 4),
        ("Australia/Lord_Howe", datetime(2026, 10, 2), 4),
        ("America/Nuuk", datetime(2026, 3, 27), 4),
    ],
)
@pytest.mark.parametrize(
    "rule", ["FREQ=DAILY;BYHOUR=0,1,2,3,12,22,23;BYMINUTE=0,30", "FREQ=MINUTELY;INTERVAL=10", "FREQ=HOURLY"]
)
def test_those_about_a_clock_change_are_as_many_as_walking_finds(zone, since, days, rule):
    some, begin = schedule(since - 5 * DAY, rule, zone), since.replace(tzinfo=UTC)
    for minutes in range(0, days * 1440, 97):
        until = begin + minutes * MINUTE
        walked = [
            o.instant for o in takewhile(lambda o, until=until: o.instant <= until, occurrences(some, begin, EVERY_DAY))
        ]
        assert passed_occurrences(some, begin, until, EVERY_DAY) == (len(walked), walked[-1] if walked else None)


@pytest.mark.parametrize(
    ("rule", "of_a_day", "share"),
    [
        ("FREQ=MINUTELY", 1440, 100),
        (f"FREQ=DAILY;BYHOUR={','.join(map(str, range(6, 24)))};BYMINUTE=0,10,20,30,40,50", 108, 10),
        ("FREQ=HOURLY;INTERVAL=2", 12, 3),
    ],
)
def test_a_year_is_counted_and_not_walked_through(rule, of_a_day, share):
    """In less than the time in which that share of it is walked through."""
    some, instants = schedule(datetime(2025, 1, 1), rule, "Europe/Helsinki", respects=True), 365 * of_a_day
    since, calendar = datetime(2025, 7, 1, tzinfo=UTC), WorkingCalendar(Settings(working_days=WEEKDAYS))

    def walk() -> None:
        assert sum(1 for _ in islice(occurrences(some, since, calendar), instants // share))

    def count() -> None:
        assert passed_occurrences(some, since, since + 365 * DAY, calendar).number == instants

    walks, counts = (min(repeat(action, number=1, repeat=3)) for action in (walk, count))
    assert counts < walks


# ---------------------------------------------------------------------- every zone
NOONS = [datetime(2026, 1, 1, 12) + number * DAY for number in range(2 * 365)]


@cache
def changes(zone: ZoneInfo) -> list[date]:
    """Local dates of two years around which the offset changes."""
    offsets = [zone.utcoffset(noon) for noon in NOONS]
    return [
        noon.date() for noon, (before, offset) in zip(NOONS[1:], pairwise(offsets), strict=True) if offset != before
    ]


@pytest.mark.parametrize("clock", ["00:00", "01:30", "02:00", "02:45", "23:30"])
def test_in_every_zone_a_daily_time_comes_once_per_local_date(clock):
    checked = 0
    for name in sorted(available_timezones()):
        zone = ZoneInfo(name)
        for day in changes(zone):
            first = day - 3 * DAY
            daily = schedule(datetime.combine(first, time.fromisoformat(clock)), "FREQ=DAILY", name)
            found = list(islice(occurrences(daily, LONG_AGO, EVERY_DAY), 6))
            assert [o.nominal.date() for o in found] == [first + number * DAY for number in range(6)], name
            assert all(earlier.instant < later.instant for earlier, later in pairwise(found)), name
            checked += 1
    assert checked > 300
