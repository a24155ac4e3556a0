"""A file that changes a robot's address takes its password away: production stops, an alarm says so, and the question ends."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.execution import State
from app.domain.models import Priority, Schedule
from app.services.live.alarms import alarm_sentence
from tests.support.edits import import_file, switch_robot
from tests.support.seen import requests
from tests.support.site import PASSWORD


@pytest.fixture
def running(site):
    """One run is with the robot."""
    (robot,) = site.container.catalogue.robots()
    mission = site.add_mission()
    start = site.clock.now().replace(tzinfo=None, second=0, microsecond=0)
    site.container.catalogue.save_schedule(
        Schedule("S", robot.id, mission.id, start, "UTC", respect_working_days=False, start_window_minutes=60)
    )
    site.run_until(lambda: site.executions(State.EXECUTING))
    return robot


def let_import_change_the_user(site):
    robot = {"name": "R1", "address": "http://r1", "username": "somebody else"}
    import_file(site.container.catalogue, robots=[robot])


def enter_password(site):
    (robot,) = site.container.catalogue.robots()
    site.container.catalogue.save_robot(replace(robot, username="distributor"), PASSWORD)


def alarms(site):
    return [
        alarm for alarm in site.container.alarms.open() if alarm.code == "needs_password" and alarm.cleared_at is None
    ]


def test_a_missing_password_is_an_alarm_until_it_is_entered(site):
    let_import_change_the_user(site)
    (alarm,) = alarms(site)
    assert alarm.priority is Priority.HIGH
    assert alarm_sentence(alarm) == "R1 is switched off until its password is entered, nothing is sent"
    enter_password(site)
    assert alarms(site) == []


def test_a_robot_that_a_person_switched_off_raises_no_alarm(site):
    (robot,) = site.container.catalogue.robots()
    switch_robot(site.container.catalogue, robot.id, False)
    let_import_change_the_user(site)
    assert alarms(site) == []


def test_without_it_nothing_is_asked_and_the_run_is_found_afterwards(site, running):
    let_import_change_the_user(site)
    asked = requests(site)
    site.run(600.0)
    assert asked == []
    assert site.executions(State.EXECUTING)
    enter_password(site)
    site.run_until(lambda: site.executions(State.COMPLETED))


def test_a_robot_that_is_switched_off_and_silent_is_asked_rarely_and_said_once(site, running, caplog):
    switch_robot(site.container.catalogue, running.id, False)
    site.network.down.add("R1")
    asked = requests(site)
    with caplog.at_level("INFO"):
        site.run(600.0)
    lines = [record for record in caplog.records if "which is switched off, could not be read" in record.getMessage()]
    assert len(lines) == 1
    assert 5 < len(asked) < 100
    site.network.down.clear()
    site.run_until(lambda: site.executions(State.COMPLETED))
