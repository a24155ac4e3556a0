"""With a window, everything that would start late after an absence is listed with its Hold button first (D10)."""

from __future__ import annotations

from datetime import datetime

import pytest

from app.domain.models import Schedule, State, Wait
from tests.support.network import Fate
from tests.support.seen import items, outcomes, robot_of, sent_at
from tests.support.site import Site

OFF = 300.0
LISTED = 28.0  # s of the 30 in which the list is shown


@pytest.fixture
def window(tmp_path):
    """The app with a window, with a start at 06:05."""
    site = Site(tmp_path, with_window=True)
    robot, mission = site.add_robots()[0], site.add_mission("Deliver")
    start = datetime.fromisoformat("2026-11-23T06:05")
    site.container.catalogue.save_schedule(
        Schedule("S", robot.id, mission.id, start, "UTC", minimum_battery_percent=30)
    )
    yield site
    site.switch_off()


def _for_battery(site):
    site.machines["R1"].set_battery(12.0)
    site.run(310)
    site.machines["R1"].set_battery(80.0)


def _for_its_next_try(site):
    site.network.down.add("R1")
    site.run(310)
    site.network.down.clear()


def _for_a_hold(site):
    site.container.holds.hold("shift meeting", until=datetime.fromisoformat("2026-11-23T06:08+00:00"))
    site.run(310)


def _started_by_hand(site):
    site.network.down.add("R1")
    site.container.operator.run_now(robot_of(site).id, site.container.catalogue.missions()[0].id)
    site.run(100)
    site.network.down.clear()


def _not_yet_due(site):
    site.run(200)


WAITS = [_for_battery, _for_its_next_try, _for_a_hold, _started_by_hand]


@pytest.mark.parametrize("cleanly", [False, True])
@pytest.mark.parametrize("waits", [*(waits for waits in WAITS), _not_yet_due])
def test_what_would_start_late_is_listed_first(window, waits, cleanly):
    """Whatever it waited for: after an absence a person sees it for 30 s, with time to hold it, and then it starts once."""
    site = window
    waits(site)
    late = len(site.executions()) or 1
    site.switch_off(cleanly=cleanly)
    site.clock.advance(OFF)
    site.switch_on()
    site.run(LISTED)
    rows = site.executions()[:late]
    assert sent_at(site) == []
    assert [(row.state, row.wait) for row in rows] == [(State.WAITING, Wait.LATE_START)] * late
    site.run(300)
    assert [row.state for row in site.executions()[:late]] == [State.COMPLETED] * late
    assert len(items(site)) == len(site.executions())


def test_the_very_first_run_may_end_before_its_first_heartbeat(window):
    """Where nothing tells since when the app was off, what is late is listed all the same."""
    site = window
    site.power_cut(OFF + 60)
    site.run(LISTED)
    assert sent_at(site) == []
    site.run(60)
    assert len(items(site)) == 1


@pytest.mark.parametrize("waits", WAITS)
def test_a_hold_that_is_set_on_the_list_keeps_it_from_starting(window, waits):
    """The Hold button holds what is listed."""
    site = window
    waits(site)
    site.power_cut(OFF)
    site.run(10)
    site.container.holds.hold("power cut")
    site.run(300)
    assert sent_at(site) == []


@pytest.mark.parametrize("waits", [_for_battery, _for_its_next_try])
def test_without_a_window_there_is_nobody_to_ask(tmp_path, waits):
    """Headless, what is still within its window starts at once."""
    site = Site(tmp_path)
    robot, mission = site.add_robots()[0], site.add_mission("Deliver")
    start = datetime.fromisoformat("2026-11-23T06:05")
    site.container.catalogue.save_schedule(
        Schedule("S", robot.id, mission.id, start, "UTC", minimum_battery_percent=30)
    )
    waits(site)
    site.power_cut(OFF)
    site.run(200)
    assert [row.state for row in site.executions()] == [State.COMPLETED]
    site.switch_off()


@pytest.mark.parametrize("waits", [_for_battery, _for_its_next_try])
def test_a_short_restart_lists_nothing(window, waits):
    """A restart of ten seconds is no absence: what waited goes on."""
    site = window
    waits(site)
    site.power_cut(10.0)
    site.run(LISTED)
    assert len(sent_at(site)) == 1


def test_a_sleep_of_the_tablet_is_an_absence_too(window):
    """What waited when the tablet fell asleep is listed when it wakes."""
    site = window
    _for_battery(site)
    site.suspend(OFF)
    site.run(LISTED)
    assert sent_at(site) == []
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


def test_what_may_be_on_the_robot_is_looked_for_and_not_sent_late_without_a_list(window):
    """A start whose request was lost just before the power cut is not sent in the first 30 s either."""
    site = window
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(301)
    site.power_cut(OFF)
    site.run(LISTED)
    assert len(sent_at(site)) == 1
