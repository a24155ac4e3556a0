"""What is said when a fleet is silent, has lost an order, or one of its robots."""

from __future__ import annotations

import pytest

from app.domain.activity import NO_DATA
from app.domain.execution import State
from app.domain.models import ANY_VEHICLE, Connection, Robot
from app.domain.reasons import sentence
from tests.support.site import Site


@pytest.fixture
def site(tmp_path):
    site = Site(tmp_path, target="classic")
    site.hall = site.add_fleet()
    site.add_mission()
    yield site
    site.switch_off()


def add(site, name, vehicle):
    return site.container.catalogue.save_robot(Robot(name, "", fleet=site.hall, vehicle=vehicle))


def test_a_silent_fleet_differs_from_a_robot_that_it_has_lost(site):
    named = add(site, "R1", site._vehicle_ids["R1"])
    either = add(site, "Hall", ANY_VEHICLE)
    site.run(10)
    site.fleet.cut_off({"R1"})
    site.run(120)
    snapshots = site.container.snapshots
    assert (snapshots.get(named.id).connection, snapshots.get(named.id).fleet_failed) == (Connection.UNREACHABLE, False)
    assert snapshots.get(either.id).connection is Connection.CONNECTED
    site.fleet.restart(300)
    site.run(120)
    assert [snapshots.get(robot.id).fleet_failed for robot in (either, named)] == [True, True]
    assert [alarm.details.get("fleet") for alarm in site.container.alarms.open()] == [site.hall.name, None]


def test_an_order_that_its_fleet_has_lost_is_said_in_words_of_fleets(site):
    robot = add(site, "Hall", ANY_VEHICLE)
    site.run(10)
    site.stranger_queues()
    site.run(5)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: site.states() == [State.QUEUED])
    site.fleet.restart(5, forgets_waiting=True)
    site.run_until(lambda: not site.executions()[0].state.is_open)
    assert sentence(site.executions()[0].reason, "UTC") == "The fleet no longer has this order"


def test_the_robot_that_took_an_order_has_its_name_of_the_plan(site):
    either = add(site, "Hall", ANY_VEHICLE)
    for name, number in site._vehicle_ids.items():
        add(site, f"{name} of Hall", number)  # its name at the fleet is another robot's here
    site.run(10)
    site.container.operator.run_now(either.id, 1)
    site.run_until(lambda: site.states() == [State.COMPLETED])
    assert site.executions()[0].taken_by.endswith(" of Hall")


def test_only_robots_have_times_in_use(site):
    either, named = add(site, "Hall", ANY_VEHICLE), add(site, "R1", site._vehicle_ids["R1"])
    began = site.clock.now()
    site.run(300)
    found = site.container.robot_states.timelines(began, site.clock.now(), [either.id, named.id])
    known = {one.robot_id: any(span.activity != NO_DATA for span in one.spans) for one in found}
    assert known == {named.id: True}


def test_only_missions_that_people_made_are_fetched(site):
    found = site.container.operator.fetch_missions(add(site, "Hall", ANY_VEHICLE).id)
    names = [mission.name for mission in found]
    assert "Deliver" in names
    assert not {"ChargeAtStation", "GoToPositionPrototype", "Move"} & set(names)
