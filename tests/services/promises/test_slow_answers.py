"""A slow but good answer delays its own robot by its length and no more (D2)."""

from __future__ import annotations

from datetime import datetime, timedelta

import pytest

from app.domain.models import Schedule, State, Wait
from tests.support.network import Fate
from tests.support.seen import items, outcome
from tests.support.site import Site

START = datetime.fromisoformat("2026-11-23T06:05")
BEFORE_SIX = 14.5  # s at which the site begins
DUE = BEFORE_SIX + 300.0
SIX = datetime.fromisoformat("2026-11-23T06:00+00:00")


@pytest.fixture
def fleet(tmp_path):
    """Makes a site with a start at 06:05 on each robot and a poll that begins half a second before it. ``due``: true time of the start."""
    sites = []

    def make(robots: int = 1, **values) -> Site:
        site = Site(tmp_path, robots=robots, now=SIX - timedelta(seconds=BEFORE_SIX))
        sites.append(site)
        site.container.catalogue.change_settings(poll_interval_seconds=14)
        mission = site.add_mission("Deliver")
        for robot in site.add_robots():
            site.container.catalogue.save_schedule(
                Schedule(f"S{robot.id}", robot.id, mission.id, START, "UTC", **values)
            )
        return site

    yield make
    for site in sites:
        site.switch_off()


def lateness(site, robot="R1"):
    return [post.at - DUE for post in site.network.posts(robot)]


@pytest.mark.parametrize("window", [1, 15])
@pytest.mark.parametrize("lasts", [3.0, 4.5, 9.0])
def test_a_read_that_is_answered_slowly_over_the_instant_delays_the_start_by_its_rest(fleet, lasts, window):
    """A start whose robot is being read when it falls due leaves when that answer is there, as its first attempt."""
    site = fleet(start_window_minutes=window)
    site.run(DUE - 0.55)
    site.network.next("GET", "*", Fate.SLOW, lasts)
    site.run(200)
    [row] = site.executions()
    assert outcome(row) == (State.COMPLETED, None, 1)
    [late] = lateness(site)
    assert late <= lasts + 0.5
    assert [item.description for item in items(site)] == [row.token]


def test_a_second_try_leaves_though_each_look_for_the_first_takes_three_seconds(site, plan):
    """Longer than a status holds: it is read once more, and then the start leaves."""
    plan("2026-11-23T06:05")
    site.network.others_wait = False
    site.network.next("POST", "/mission_queue", Fate.REFUSED)
    for _n in range(100):
        site.network.next("POST", "/mission_queue/search", Fate.SLOW, 3.0)
    site.run(300 + 60)
    [row] = site.executions()
    assert (row.attempts, len(items(site))) == (2, 1)


def test_what_is_held_while_the_robot_is_read_for_a_start_is_not_sent(site, plan):
    """A second try asks the robot what became of the first; before the slow answer comes, somebody holds the robot."""
    plan("2026-11-23T06:05", start_window_minutes=60, minimum_battery_percent=30)
    site.network.others_wait = False
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(320)
    site.machines["R1"].set_battery(12.0)
    site.run_until(lambda: [row.wait for row in site.executions()] == [Wait.BATTERY])
    site.machines["R1"].set_battery(90.0)
    site.network.next("POST", "/mission_queue/search", Fate.SLOW, 4.0, count=2)
    site.at(3.0, lambda: site.container.holds.hold("a meeting"))
    site.run(60)
    assert [post.fate for post in site.network.posts()] == [Fate.LOST]
    [row] = site.executions()
    assert (row.state, row.wait) == (State.WAITING, Wait.HOLD)


def test_a_submission_that_is_answered_slowly_is_accepted_when_it_is(site, plan):
    """The robot's good answer to the POST after 9 s is an answer: nothing is looked for, nothing sent again."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.SLOW, 9.0)
    site.run(315)
    [row] = site.executions()
    assert (row.state, row.attempts) == (State.EXECUTING, 1)
    assert len(items(site)) == 1


@pytest.mark.parametrize("before", [0.1, 0.55, 1.3])
def test_a_slow_robot_delays_nobody_else(fleet, before):
    """While one robot takes 9 s to answer, the other one's start leaves in its moment."""
    site = fleet(robots=2)
    site.run(DUE - before)
    site.network.next("*", "*", Fate.SLOW, 9.0, robot="R1")
    site.run(60)
    [late] = lateness(site, "R2")
    assert late <= 0.2
