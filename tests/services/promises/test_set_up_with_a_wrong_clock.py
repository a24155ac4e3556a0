"""What is made or changed while the tablet's clock is wrong counts from when that is set right: nothing before was ever missed."""
from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from app.domain.models import Schedule, State
from mir_sim import SimulatedRobot
from tests.support.seen import alarms
from tests.support.site import Site

NOW = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)
DAY = 86400.0
NEVER_SET = datetime(1970, 1, 1, 0, 5, tzinfo=UTC)
OF_THE_IMAGE = datetime(2026, 5, 9, 12, 0, tzinfo=UTC)       # a small computer without a battery goes on from the date of its image
BEHIND = datetime(2026, 11, 22, 23, 0, tzinfo=UTC)


def tablet(path, shows, robots=1):
    """A new tablet that shows that time; the robots' clocks are right."""
    site = Site(path, robots=robots, now=shows)
    for name in site.machines:
        site.machines[name] = SimulatedRobot(name, seed=1, clock=site.seconds, start=NOW, battery=90.0)
    return site


@pytest.fixture(params=[NEVER_SET, OF_THE_IMAGE], ids=["1970", "image"])
def site(request, tmp_path):
    site = tablet(tmp_path, request.param)
    yield site
    site.switch_off()


def set_up(site, start="2026-04-01T06:05"):
    robot, mission = site.add_robots()[0], site.add_mission("Deliver")
    return site.container.catalogue.save_schedule(Schedule(
        "S", robot.id, mission.id, datetime.fromisoformat(start), "UTC", "FREQ=DAILY", respect_working_days=False))


def set_right(site):
    site.clock.step((NOW - site.clock.now()).total_seconds() + site.seconds())


def stored(site, schedule):
    return site.container.repositories.schedules.get(site.container.db.read(), schedule.id)


def outcome(site):
    return [(run.planned_at, run.state) for run in site.executions()]


def test_set_up_without_a_network(site):
    """No robot answers until the clock is right."""
    site.network.down.add("R1")
    schedule = set_up(site)
    site.run(120)
    set_right(site)
    site.network.down.clear()
    site.run(600)
    assert outcome(site) == [(NOW.replace(minute=5), State.COMPLETED)]
    assert stored(site, schedule).changed_at >= NOW
    assert not {"executions_missed", "app_was_off"} & set(alarms(site))


def test_set_up_while_the_robots_contradict_the_clock(site):
    set_up(site)
    site.run(120)
    assert "clock_implausible" in alarms(site)
    set_right(site)
    site.run(600)
    assert outcome(site) == [(NOW.replace(minute=5), State.COMPLETED)]


def test_set_right_while_the_app_is_off_after_the_robots_contradicted_it(site):
    set_up(site)
    site.run(120)
    site.switch_off()
    set_right(site)
    site.switch_on()
    site.run(600)
    assert outcome(site) == [(NOW.replace(minute=5), State.COMPLETED)]


def test_a_clock_that_was_never_set_is_wrong_without_any_robot(tmp_path):
    site = tablet(tmp_path, NEVER_SET)
    site.network.down.add("R1")
    set_up(site)
    site.run(120)
    site.switch_off()
    set_right(site)
    site.network.down.clear()
    site.switch_on()
    site.run(600)
    assert outcome(site) == [(NOW.replace(minute=5), State.COMPLETED)]
    assert "app_was_off" not in alarms(site)
    site.switch_off()


def test_a_clock_that_is_hours_behind(tmp_path):
    """The robots show that it is, whatever the difference."""
    site = tablet(tmp_path, BEHIND)
    set_up(site, "2026-11-23T00:05")
    site.run(120)
    set_right(site)
    site.run(600)
    assert outcome(site) == []
    site.switch_off()


def test_what_was_planned_while_the_clock_was_right_is_missed(tmp_path):
    """The clock goes wrong, another schedule is made, and it is set right hours later."""
    site = tablet(tmp_path, NOW, robots=2)
    schedule = set_up(site, "2026-11-23T07:05")
    site.run(60)
    site.clock.step(-7 * 3600.0)
    site.run(60)
    assert "clock_implausible" in alarms(site)
    site.container.catalogue.save_schedule(replace(schedule, id=0, name="New", start=schedule.start.replace(hour=8)))
    site.clock.advance(4 * 3600.0)
    set_right(site)
    site.run(60)
    assert outcome(site) == [(NOW.replace(hour=7, minute=5), State.MISSED)]
    site.switch_off()


def test_a_sleep_of_two_days_is_no_clock_that_was_wrong(tmp_path):
    """A robot had shown that the clock was right."""
    site = tablet(tmp_path, NOW)
    set_up(site, "2026-11-23T07:05")
    site.run(60)
    site.clock.suspend(2 * DAY)
    site.run(60)
    assert [(row.state, row.starts) for row in site.executions()] == [(State.MISSED, 2)]
    assert "app_was_off" in alarms(site)
    site.switch_off()


def test_switched_off_for_two_days_without_any_robot_is_missed(tmp_path):
    """Nothing shows that the clock was wrong before."""
    site = tablet(tmp_path, NOW)
    site.network.down.add("R1")
    set_up(site, "2026-11-23T07:05")
    site.run(60)
    site.switch_off()
    site.clock.advance(2 * DAY)
    site.switch_on()
    site.run(60)
    assert [(row.state, row.starts) for row in site.executions()] == [(State.MISSED, 2)]
    site.switch_off()
