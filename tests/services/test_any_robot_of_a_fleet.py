"""A start for any robot of a fleet says which robot the fleet chose for it. The fleet's client is a robot's here, whose
items name the robot once they run."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.check_up import RobotProfile
from app.domain.models import ANY_VEHICLE, Fleet, Group, Robot, Schedule, State
from app.mir.client import RobotClient
from app.services.files.history_export import write_history
from tests.support.site import PASSWORD, USER, Site


@pytest.fixture
def site(tmp_path, monkeypatch):
    site, ask = Site(tmp_path, robots=1), RobotClient.queue_item
    site.chosen = ["Bella", "Cara"]  # at each question, the last for ever

    def item(self, queue_id, token=""):
        found = ask(self, queue_id, token)
        name = site.chosen.pop(0) if len(site.chosen) > 1 else site.chosen[0]
        return found if found.is_pending else replace(found, vehicle="7", vehicle_name=name)

    monkeypatch.setattr(RobotClient, "queue_item", item)
    site.fleet = site.container.catalogue.save_fleet(
        Fleet("Hall", "http://r1", username=USER, profile=RobotProfile(None, None)), password=PASSWORD
    )
    site.add_mission()
    yield site
    site.switch_off()


def add(site, vehicle):
    return site.container.catalogue.save_robot(Robot("Any of Hall", "", fleet=site.fleet, vehicle=vehicle))


def run_one(site, vehicle):
    robot = add(site, vehicle)
    site.run(10)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: [row.state for row in site.executions()] == [State.COMPLETED])
    return site.executions()[0]


def test_the_robot_that_has_it_is_written_once(site):
    row = run_one(site, ANY_VEHICLE)
    assert (row.taken_by, row.ran_on) == ("Bella", "Any of Hall (Bella)")
    file = io.StringIO(newline="")
    write_history(site.container.db.read(), file)
    (cells,) = csv.DictReader(io.StringIO(file.getvalue()))
    assert (cells["robot"], cells["taken_by"]) == ("Any of Hall", "Bella")


def test_a_robot_that_was_named_needs_no_other_name(site):
    row = run_one(site, "7")
    assert (row.taken_by, row.ran_on) == ("", "Any of Hall")


@pytest.mark.parametrize("vehicle", [ANY_VEHICLE, "7"])
@pytest.mark.parametrize("of_group", [False, True])
def test_the_fleet_looks_after_the_batteries_of_those_it_chooses(site, vehicle, of_group):
    robot, save = add(site, vehicle), site.container.catalogue
    site.machines["R1"].set_battery(20.0)
    target = {"group_id": save.save_group(Group("G", (robot.id,))).id} if of_group else {"robot_id": robot.id}
    start = (site.clock.now() + timedelta(minutes=1)).replace(tzinfo=None, second=0, microsecond=0)
    plan = Schedule("S", None, 1, start, "UTC", minimum_battery_percent=50.0, respect_working_days=False)
    save.save_schedule(replace(plan, **target))
    site.run(180)
    (row,) = site.executions()
    assert (row.state is not State.WAITING) is (vehicle == ANY_VEHICLE)
