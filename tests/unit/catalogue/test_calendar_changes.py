"""A change of the exception calendar: in one transaction with the next occurrences of all schedules, undone by restore, kept by backups."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, datetime, timedelta

import pytest

from app.database.settings import CalendarRepository
from app.domain.execution import ReasonCode, State
from app.domain.models import DayException, InvalidInput, Schedule
from app.services.catalogue import validation
from app.services.catalogue.pausing import Pausing
from app.services.live.changes import Topic
from tests.support.edits import add_days, skip_next
from tests.support.errors import refuses
from tests.support.site import Site

CALENDAR = CalendarRepository()
TUESDAY = date(2026, 11, 24)
CLOSED = DayException("Inventory", TUESDAY, date(2026, 11, 25))


def next_of(world, schedule):
    return world.stored(schedule).next_at.isoformat()[:10]


def test_closed_days_move_the_next_start_and_their_removal_moves_it_back(world):
    daily, free = world.schedule(), world.schedule(name="Free", respect_working_days=False)
    assert next_of(world, daily) == "2026-11-24"
    world.announced.clear()
    saved = world.catalogue.save_days(CLOSED)
    assert (next_of(world, daily), next_of(world, free)) == ("2026-11-26", "2026-11-24")
    assert world.announced == [Topic.CALENDAR, Topic.SCHEDULES]
    removed = world.catalogue.remove_days(saved.id, saved.id)
    assert next_of(world, daily) == "2026-11-24"
    world.catalogue.restore(removed)
    assert (next_of(world, daily), CALENDAR.all(world.db.read())) == ("2026-11-26", [saved])


def test_an_extra_working_day_brings_a_start(world):
    weekend = world.schedule(name="Weekend", recurrence="FREQ=WEEKLY;BYDAY=SA")
    assert weekend.next_at is None
    saved = world.catalogue.save_days(DayException("Fair", date(2026, 12, 5), date(2026, 12, 5), is_working=True))
    assert next_of(world, weekend) == "2026-12-05"
    world.catalogue.save_days(replace(saved, first_day=date(2026, 12, 12), last_day=date(2026, 12, 12)))
    assert next_of(world, weekend) == "2026-12-12"


def test_public_holidays_move_the_next_start(world):
    sixth = world.schedule(name="Sixth", start=datetime(2027, 12, 6, 6, 30), recurrence="FREQ=MONTHLY")
    assert next_of(world, sixth) == "2027-12-06"
    world.catalogue.set_public_holidays("FI")
    assert next_of(world, sixth) == "2028-03-06"  # Independence Day, Epiphany, a Sunday
    world.catalogue.set_public_holidays("")
    assert next_of(world, sixth) == "2027-12-06"


def test_a_region_of_another_country_is_refused_and_nothing_changes(world):
    with refuses("holiday_subdivision", "FI has no region BY"):
        world.catalogue.set_public_holidays("FI", "BY")
    world.catalogue.set_public_holidays("DE", "BY")
    with refuses("holiday_subdivision", "FI has no region BY"):
        world.catalogue.change_settings(holiday_country="FI")
    assert world.catalogue.change_settings().holiday_country == "DE"


def test_a_one_time_start_on_a_closed_day_is_refused_by_name(world):
    world.catalogue.save_days(CLOSED)
    with refuses("start", "2026-11-24 is a day off: Inventory"):
        world.schedule(recurrence=None)
    assert world.schedule(recurrence=None, respect_working_days=False).next_at is not None


def test_a_one_time_start_on_an_extra_working_saturday_is_taken(world):
    world.catalogue.save_days(DayException("Fair", date(2026, 11, 28), date(2026, 11, 28), is_working=True))
    assert world.schedule(start=datetime(2026, 11, 28, 6, 30), recurrence=None).next_at is not None


@pytest.mark.parametrize(
    "change",
    [lambda catalogue: catalogue.save_days(CLOSED), lambda catalogue: catalogue.change_settings(working_days=["SU"])],
    ids=["days off", "working days"],
)
def test_due_starts_stay_due(world, change):
    daily = world.schedule()
    world.clock.step(86400 + 1800)
    change(world.catalogue)
    assert world.stored(daily).next_at == daily.next_at


def test_a_start_that_was_skipped_is_not_planned_again(world):
    daily = world.schedule()
    Pausing(world.catalogue).skip(daily.id, daily.next_at)
    assert next_of(world, daily) == "2026-11-25"
    world.catalogue.save_days(DayException("Inventory", date(2026, 11, 26), date(2026, 11, 26)))
    assert next_of(world, daily) == "2026-11-25"


def test_several_are_added_all_or_none(world):
    with pytest.raises(InvalidInput):
        add_days(world.catalogue, [CLOSED, replace(CLOSED, name="")])
    assert CALENDAR.all(world.db.read()) == []
    assert len(add_days(world.catalogue, [CLOSED, replace(CLOSED, name="Audit")])) == 2


def test_the_calendar_has_an_end(world, monkeypatch):
    monkeypatch.setattr(validation, "MOST_DAY_EXCEPTIONS", 2)
    add_days(world.catalogue, [CLOSED, CLOSED])
    with refuses("days", "room for 2 entries"):
        world.catalogue.save_days(CLOSED)


def test_what_was_deleted_cannot_be_changed(world):
    saved = world.catalogue.save_days(CLOSED)
    world.catalogue.remove_days(saved.id)
    with refuses("days", "entry of the calendar no longer exists"):
        world.catalogue.save_days(saved)
    assert world.catalogue.remove_days(saved.id).ids[DayException] == []


def test_the_planner_skips_closed_days(tmp_path):
    site = Site(tmp_path)
    container, [robot], mission = site.container, site.add_robots(), site.add_mission()
    container.catalogue.change_settings(poll_interval_seconds=600)
    daily = container.catalogue.save_schedule(
        Schedule("Morning", robot.id, mission.id, datetime(2026, 11, 24, 6, 30), "UTC", "FREQ=DAILY")
    )
    container.catalogue.save_days(DayException("Inventory", date(2026, 11, 25), date(2026, 11, 25)))
    assert [run.at.date() for run in container.plan.next(2)] == [TUESDAY, date(2026, 11, 26)]
    site.run(86400 + 1801)
    [row] = site.executions()
    assert (row.state, row.planned_at.date()) == (State.QUEUED, TUESDAY)
    assert container.repositories.schedules.get(container.db.read(), daily.id).next_at.date() == date(2026, 11, 26)
    assert skip_next(container, daily.id).date() == date(2026, 11, 26)
    last = container.repositories.executions.last_of_schedule(container.db.read(), daily.id)
    assert (last.state, last.reason.code) == (State.SKIPPED, ReasonCode.HOLD)
    assert last.planned_at - row.planned_at == timedelta(days=2)
    site.switch_off()
