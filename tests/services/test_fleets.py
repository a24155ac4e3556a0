"""Robots of a fleet: nothing is sent by itself before it was checked up, and a change of the fleet reaches them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.database.fleets import FleetRepository
from app.domain.check_up import RobotProfile
from app.domain.execution import ReasonCode, State, Wait
from app.domain.message import render
from app.domain.models import Fleet, Group, Robot
from app.domain.reasons import sentence, waiting_sentence
from app.services.live.changes import Topic
from tests.support.edits import import_file
from tests.support.site import PASSWORD, USER, Site


@pytest.fixture
def site(tmp_path):
    site = Site(tmp_path, target="classic")
    site.catalogue = site.container.catalogue
    site.hall = site.catalogue.save_fleet(
        Fleet("Hall", "http://fleet", username=USER, identity=site.identity), password=PASSWORD
    )
    site.robot = site.catalogue.save_robot(Robot("Bella", "", fleet=site.hall, vehicle=site._vehicle_ids["R1"]))
    site.mission = site.add_mission()
    yield site
    site.switch_off()


def check_up(site):
    """As if a check-up had found something out."""
    fleet = site.catalogue.fleets()[0]
    profile = RobotProfile(fleet.identity, fleet.software)
    site.container.db.write(lambda c: FleetRepository().update(c, replace(fleet, profile=profile)))
    site.container.changes.publish(Topic.ROBOTS)


def test_a_start_waits_for_the_check_up_and_says_so(site):
    site.plan_once(site.robot.id, 1, start_window_minutes=3)
    site.run(90)
    row = site.the_row()
    assert (row.state, row.wait) == (State.WAITING, Wait.CHECK_UP)
    assert waiting_sentence(row, "UTC").startswith("The fleet Hall has to be checked up first, waits until")
    check_up(site)
    site.run_until(lambda: site.the_row().state is State.COMPLETED)
    assert site.the_row().attempts == 1


def test_one_that_waited_too_long_says_why(site):
    site.plan_once(site.robot.id, 1, start_window_minutes=3)
    site.run(250)
    row = site.the_row()
    assert (row.state, row.reason.code) == (State.FAILED, ReasonCode.WINDOW_CLOSED)
    assert sentence(row.reason, "UTC").endswith("the fleet Hall was not checked up")
    assert row.attempts == 0


def test_a_robot_that_a_file_switches_off_stays_off_with_its_fleet(site):
    site.catalogue.save_fleet(replace(site.hall, enabled=False))
    (line,) = import_file(site.catalogue, robots=[{"name": "Bella", "enabled": False}])
    assert render(line) == "robot Bella changed: In use yes → no"
    site.catalogue.save_fleet(replace(site.catalogue.fleets()[0], enabled=True))
    assert not site.catalogue.robots()[0].enabled


def test_a_group_chooses_none_of_its_robots(site):
    site.plan_once(None, 1, group_id=site.catalogue.save_group(Group("G", (site.robot.id,))).id)
    site.run(70)
    assert site.the_row().wait is Wait.ROBOT
    check_up(site)
    site.run_until(lambda: site.the_row().state is State.COMPLETED)


def test_nothing_starts_while_it_is_idle(site):
    site.run(10)
    site.catalogue.change_idle_rule(site.robot.id, mission_id=site.mission.id, after_minutes=5)
    site.run(400)
    assert site.executions() == []


def test_a_person_may_start_one_now(site):
    site.run(10)
    site.container.operator.run_now(site.robot.id, site.mission.id)
    site.run_until(lambda: site.the_row().state is State.COMPLETED)


def test_its_robots_are_asked_as_it_is_entered_now(site):
    site.run(10)
    moved = replace(site.hall, address="http://other", username="admin")
    token = site.catalogue.change(site.hall, moved, password="admin").token
    site.run(10)
    (robot,) = site.engine._robots()
    worker = site._workers[robot.id]
    assert (worker.robot, worker._client.address.netloc) == (robot, "other")
    assert (robot.token, robot.address) == (token, "http://other")
