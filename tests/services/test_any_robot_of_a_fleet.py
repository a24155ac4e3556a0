"""A start for any robot of a fleet says which robot the fleet chose for it."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.models import ANY_VEHICLE, Group, Robot, Schedule, State
from app.mir.classic_vehicle import ClassicVehicle
from app.services.files.history_export import write_history
from mir_sim.fleets.classic_orders import Shown
from mir_sim.fleets.orders import OrderState
from tests.support.site import Site


@pytest.fixture
def site(tmp_path):
    site = Site(tmp_path, target="classic")
    site.hall = site.add_fleet()
    site.add_mission()
    yield site
    site.switch_off()


def add(site, vehicle):
    return site.container.catalogue.save_robot(Robot("Any of Hall", "", fleet=site.hall, vehicle=vehicle))


def run_one(site, vehicle):
    robot = add(site, vehicle)
    site.run(10)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: [row.state for row in site.executions()] == [State.COMPLETED])
    return site.executions()[0]


def test_the_robot_that_has_it_is_written_once(site, monkeypatch):
    ask, names = ClassicVehicle.queue_item, iter(["R1"])

    def with_other_names(self, queue_id, token=""):
        item = ask(self, queue_id, token)
        return replace(item, vehicle_name=next(names, "R2")) if item.vehicle else item

    monkeypatch.setattr(ClassicVehicle, "queue_item", with_other_names)
    row = run_one(site, ANY_VEHICLE)
    assert (row.taken_by, row.ran_on) == ("R1", "Any of Hall (R1)")
    file = io.StringIO(newline="")
    write_history(site.container.db.read(), file)
    (cells,) = csv.DictReader(io.StringIO(file.getvalue()))
    assert (cells["robot"], cells["taken_by"]) == ("Any of Hall", "R1")


def test_a_robot_that_was_named_needs_no_other_name(site):
    row = run_one(site, site._vehicle_ids["R1"])
    assert (row.taken_by, row.ran_on) == ("", "Any of Hall")


@pytest.mark.parametrize("vehicle", [ANY_VEHICLE, "1"])
@pytest.mark.parametrize("of_group", [False, pytest.param(True, marks=pytest.mark.long)])
def test_the_fleet_looks_after_the_batteries_of_those_it_chooses(site, vehicle, of_group):
    robot, save = add(site, vehicle), site.container.catalogue
    site.machines["R1"].set_battery(20.0)
    target = {"group_id": save.save_group(Group("G", (robot.id,))).id} if of_group else {"robot_id": robot.id}
    start = (site.clock.now() + timedelta(minutes=1)).replace(tzinfo=None, second=0, microsecond=0)
    plan = Schedule("S", None, 1, start, "UTC", minimum_battery_percent=50.0, respect_working_days=False)
    save.save_schedule(replace(plan, **target))
    site.run(90)
    (row,) = site.executions()
    assert (row.state is not State.WAITING) is (vehicle == ANY_VEHICLE)


def test_what_a_named_robot_has_is_not_cancelled_though_its_robot_is_not_shown_yet(site, monkeypatch):
    full = Shown.full
    monkeypatch.setattr(Shown, "full", lambda self: full(self) | {"robot_id": 0})
    monkeypatch.setattr(site.fleet.book, "_assign", lambda *_args, **_options: None)  # it lets orders wait
    add(site, ANY_VEHICLE)
    save = site.container.catalogue
    named = save.save_robot(Robot("Named", "", fleet=site.hall, vehicle=site._vehicle_ids["R1"]))
    group = save.save_group(Group("G", (named.id,)))
    start = (site.clock.now() + timedelta(minutes=1)).replace(tzinfo=None, second=0, microsecond=0)
    plan = Schedule("S", None, 1, start, "UTC", respect_working_days=False, group_id=group.id)
    save.save_schedule(plan)
    site.run_until(lambda: [row.state for row in site.executions()] == [State.QUEUED])
    site.run(60)
    assert [row.state for row in site.executions()] == [State.QUEUED]
    assert [order.state for order in site.fleet.book] == [OrderState.WAITING]
