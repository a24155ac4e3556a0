"""What is planned, however far ahead one looks."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.screens.common.shell import pick
from app.screens.scheduler.facts import SchedulerServices, Window, read

FAR = datetime(2027, 4, 12, 6, tzinfo=UTC)


@pytest.mark.parametrize(
    ("recurrence", "number"), [("FREQ=MINUTELY;INTERVAL=5", 288), ("FREQ=HOURLY", 24), ("FREQ=DAILY", 1)]
)
def test_a_day_months_ahead_is_as_full_as_tomorrow(site, plan, recurrence, number):
    plan("2026-11-23T06:05", recurrence, respect_working_days=False)
    for day in (datetime(2026, 11, 24, 6, tzinfo=UTC), FAR):
        found = [run.at for run in site.container.plan.between(day, day + timedelta(days=1)).runs]
        assert (len(found), found == sorted(set(found))) == (number, True)
        assert all(day <= at < day + timedelta(days=1) for at in found)


def test_what_is_paused_until_then_is_not_planned_before(site, plan):
    schedule = plan("2026-11-23T06:05", "FREQ=HOURLY", respect_working_days=False)
    site.container.pausing.pause(schedule.id, FAR + timedelta(hours=12))
    found = site.container.plan.between(FAR, FAR + timedelta(days=1)).runs
    assert (len(found), found[0].at) == (12, FAR + timedelta(hours=12, minutes=5))


def test_a_paused_schedule_starts_next_where_the_plan_has_its_first_start(site, plan):
    schedule, monday = plan("2026-11-23T06:05", "FREQ=DAILY"), datetime(2026, 11, 23, 6, 5, tzinfo=UTC)
    wednesday, thursday = monday + timedelta(days=2), monday + timedelta(days=3)
    for at in (wednesday, thursday):
        site.container.pausing.pause(schedule.id, monday + timedelta(days=1, hours=2))
        facts = read(pick(SchedulerServices, site.container))
        assert facts.next_start(facts.schedule(schedule.id)) == facts.planned[0].at == at
        site.container.pausing.skip(schedule.id, wednesday)


def test_more_starts_than_can_be_computed_are_shared_out_and_said(site, plan):
    often = [plan("2026-11-23T06:05", "FREQ=MINUTELY", respect_working_days=False) for _ in range(3)]
    daily = plan("2026-11-23T06:05", "FREQ=DAILY", respect_working_days=False)
    now = site.clock.now()
    found = site.container.plan.between(now, now + timedelta(days=7), most=1000)
    counts = {schedule.id: sum(run.schedule.id == schedule.id for run in found.runs) for schedule in (*often, daily)}
    assert counts == {**dict.fromkeys([schedule.id for schedule in often], 331), daily.id: 7}
    assert found.more == dict.fromkeys([schedule.id for schedule in often], now + timedelta(minutes=5 + 331))
    assert list(found.runs) == sorted(found.runs, key=lambda run: run.at)


def test_where_all_can_be_computed_nothing_is_said_to_be_missing(site, plan):
    schedule = plan("2026-11-23T06:05", "FREQ=MINUTELY;COUNT=10", respect_working_days=False)
    now = site.clock.now()
    assert [len(site.container.plan.between(now, now + timedelta(days=7), most=most).runs) for most in (11, 10, 9)] == [
        10,
        10,
        9,
    ]
    assert site.container.plan.between(now, now + timedelta(days=7), most=10).more == {}
    assert site.container.plan.between(now, now + timedelta(days=7), most=9).more == {
        schedule.id: now + timedelta(minutes=14)
    }


def test_a_run_that_is_still_under_way_when_a_span_begins_is_in_it(site, plan):
    mission = site.container.catalogue.missions()[0]
    site.container.catalogue.save_mission(replace(mission, usual_minutes=90))
    plan("2026-11-23T06:05", "FREQ=HOURLY", respect_working_days=False)
    found = [run.at for run in site.container.plan.between(FAR, FAR + timedelta(hours=1)).runs]
    assert found == [FAR - timedelta(minutes=55), FAR + timedelta(minutes=5)]
    now = site.clock.now()
    assert site.container.plan.between(now + timedelta(minutes=1), now + timedelta(hours=1)).runs[
        0
    ].at == now + timedelta(minutes=5)


@pytest.mark.parametrize("ahead", [timedelta(), timedelta(days=3), timedelta(days=200)])
def test_a_robot_every_minute_fills_what_the_timeline_shows_however_far_ahead(site, plan, ahead):
    plan("2026-11-23T06:05", "FREQ=MINUTELY", respect_working_days=False)
    now, services = site.clock.now(), pick(SchedulerServices, site.container)
    window = Window(left=now + ahead, hours=168)
    facts = read(services, window)
    _start, end = window.span(now, facts.zone, facts.calendar)
    assert facts.planned[-1].at == end - timedelta(minutes=1)
    assert facts.more == {}
