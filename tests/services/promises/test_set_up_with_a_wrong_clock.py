"""What is made or changed while the tablet's clock is found wrong counts from when that is set right: nothing before was ever missed.
It was wrong where it showed a time before the app existed, or was set ahead to that of robots that had contradicted it. Every other start
that its clock passes over has a row."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from app.domain.models import Schedule, State
from app.services.dispatch.timing import CLOCKS_AGREE
from mir_sim import SimulatedRobot
from tests.support.seen import alarms
from tests.support.site import Site

NOW = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)
HOUR, DAY = 3600.0, 86400.0
NEVER_SET = datetime(1970, 1, 1, 0, 5, tzinfo=UTC)
OF_THE_IMAGE = datetime(2025, 1, 1, tzinfo=UTC)  # a small computer without a battery goes on from the date of its image
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
    return site.container.catalogue.save_schedule(
        Schedule(
            "S", robot.id, mission.id, datetime.fromisoformat(start), "UTC", "FREQ=DAILY", respect_working_days=False
        )
    )


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


def test_set_right_while_the_app_is_off(site):
    """No robot has ever contradicted the clock."""
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


def test_a_person_who_called_the_clock_of_1970_right_has_not_made_it_so(site):
    set_up(site)
    site.run(120)
    site.container.holds.confirm_clock()
    site.run(60)
    set_right(site)
    site.run(600)
    assert outcome(site) == [(NOW.replace(minute=5), State.COMPLETED)]


@pytest.mark.parametrize("robots_answer_after_s", [0, 300])
def test_a_clock_that_is_hours_behind(tmp_path, robots_answer_after_s):
    """The robots show that it is, and agree with it once it is set."""
    site = tablet(tmp_path, BEHIND)
    site.network.down.add("R1")
    site.at(robots_answer_after_s, site.network.down.clear)
    set_up(site, "2026-11-23T00:05")
    site.run(robots_answer_after_s + 120)
    assert "clock_implausible" in alarms(site)
    set_right(site)
    site.run(600)
    assert outcome(site) == []
    site.switch_off()


# ---------------------------------------------------------------------- a tablet that is right among robots that are wrong
def among_wrong_robots(path, ahead_s=HOUR, robots=1):
    """It is 06:00, and a schedule of 06:10 is made."""
    site = Site(path, robots=robots, now=NOW)
    for machine in site.machines.values():
        machine.clock.offset += ahead_s
    set_up(site, "2026-11-23T06:10")
    return site


def restart(site):
    site.switch_off()
    site.stay_off(90)
    site.switch_on()


DISTURBANCES = {
    "none": lambda site: None,
    "step": lambda site: site.clock.step(6),
    "sleep": lambda site: site.suspend(20),
    "sleep_of_the_difference": lambda site: site.suspend(HOUR),
    "restart": restart,
}


def put_robots_right(site):
    for machine in site.machines.values():
        machine.clock.offset = 0.0


def has_its_row(site):
    """The one start of that morning that was due is in the history as missed."""
    return [(run.planned_at, run.state) for run in site.executions()] == [(NOW.replace(minute=10), State.MISSED)]


@pytest.mark.parametrize(
    "end", [lambda site: site.container.holds.confirm_clock(), put_robots_right], ids=["person", "robots"]
)
@pytest.mark.parametrize("happens", DISTURBANCES.values(), ids=DISTURBANCES)
def test_no_start_vanishes_because_a_robot_is_wrong(tmp_path, happens, end):
    """Whatever happens to the tablet before a person says that its clock is right, or the robot's is put right."""
    site = among_wrong_robots(tmp_path)
    site.run(30 * 60)
    assert "clock_implausible" in alarms(site)
    happens(site)
    site.run(60)
    end(site)
    site.run(60)
    assert has_its_row(site)
    site.switch_off()


def test_a_robot_that_is_put_right_while_the_app_is_off(tmp_path):
    site = among_wrong_robots(tmp_path)
    site.run(30 * 60)
    site.switch_off()
    site.stay_off(HOUR)
    put_robots_right(site)
    site.switch_on()
    site.run(60)
    assert has_its_row(site)
    site.switch_off()


def test_a_step_of_seconds_is_not_what_made_the_clocks_agree(tmp_path):
    """The robot's clock is only just too far away, and no more after the step."""
    site = among_wrong_robots(tmp_path, ahead_s=CLOCKS_AGREE + 3.0)
    site.run(30 * 60)
    assert "clock_implausible" in alarms(site)
    site.clock.step(6)
    site.run(60)
    assert has_its_row(site)
    site.switch_off()


def test_another_robot_that_agrees_has_not_contradicted_the_clock(tmp_path):
    """The tablet sleeps for as long as the one robot's clock is ahead, then another one answers."""
    site = among_wrong_robots(tmp_path, robots=2)
    site.machines["R2"].clock.offset = 0.0
    site.network.down.add("R2")
    site.run(30 * 60)
    assert "clock_implausible" in alarms(site)
    site.network.down = {"R1"}
    site.suspend(HOUR)
    site.run(60)
    assert has_its_row(site)
    site.switch_off()


@pytest.mark.parametrize("seconds", [20, HOUR])
def test_robots_that_go_wrong_later(tmp_path, seconds):
    """They agreed at first; then a schedule is changed while they don't, and the tablet sleeps."""
    site = Site(tmp_path, robots=2, now=NOW)
    schedule = set_up(site, "2026-11-23T06:10")
    site.run(60)
    for machine in site.machines.values():
        machine.clock.offset = HOUR
    site.run(300)
    assert "clock_implausible" in alarms(site)
    site.container.catalogue.save_schedule(replace(schedule, priority=1))
    site.run(30 * 60)
    site.suspend(seconds)
    site.run(60)
    site.container.holds.confirm_clock()
    site.run(60)
    assert has_its_row(site)
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
