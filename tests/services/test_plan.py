"""What is planned, however far ahead one looks."""
from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest

FAR = datetime(2027, 4, 12, 6, tzinfo=UTC)


@pytest.mark.parametrize(("recurrence", "number"), [("FREQ=MINUTELY;INTERVAL=5", 288), ("FREQ=HOURLY", 24), ("FREQ=DAILY", 1)])
def test_a_day_months_ahead_is_as_full_as_tomorrow(site, plan, recurrence, number):
    plan("2026-11-23T06:05", recurrence, respect_working_days=False)
    for day in (datetime(2026, 11, 24, 6, tzinfo=UTC), FAR):
        found = [run.at for run in site.container.plan.between(day, day + timedelta(days=1))]
        assert (len(found), found == sorted(set(found))) == (number, True)
        assert all(day <= at < day + timedelta(days=1) for at in found)


def test_what_is_paused_until_then_is_not_planned_before(site, plan):
    schedule = plan("2026-11-23T06:05", "FREQ=HOURLY", respect_working_days=False)
    site.container.pausing.pause(schedule.id, FAR + timedelta(hours=12))
    found = site.container.plan.between(FAR, FAR + timedelta(days=1))
    assert (len(found), found[0].at) == (12, FAR + timedelta(hours=12, minutes=5))
