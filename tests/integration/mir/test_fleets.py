"""The app and a fleet over sockets: its robots are found, added, and take missions."""

from __future__ import annotations

import pytest

import mir_sim
from app.container import Container
from app.domain.execution import State
from app.domain.models import ANY_VEHICLE, Connection, Fleet, FleetKind, Mission
from tests.support.process import wait_for
from tests.unit.sim.asking import GUIDS

PASSWORDS = {FleetKind.CLASSIC: "scheduler", FleetKind.ENTERPRISE: "mir_scheduler"}


@pytest.fixture
def app(tmp_path):
    app = Container.open(tmp_path / "data")
    app.runner.start()
    yield app
    app.close()


@pytest.mark.parametrize("kind", FleetKind)
def test_robots_of_a_fleet_are_found_and_take_missions(app, kind):
    with mir_sim.serve(robots=2, fleet=kind, time_scale=50) as served:
        url = served.above.url
        fleet = app.catalogue.save_fleet(Fleet("Hall", url, kind, "scheduler"), password=PASSWORDS[kind])
        either, *others = (found.vehicle for found in app.fleets.find(fleet.id))
        reached = [(robot.name, robot.url.removeprefix("http://")) for robot in served.robots]
        assert [(vehicle.name, vehicle.ip) for vehicle in others] == reached
        robots = app.fleets.add(fleet.id, [either, others[1]])
        assert [robot.vehicle for robot in robots] == [ANY_VEHICLE, others[1].id]
        mission = app.catalogue.save_mission(Mission("Home", GUIDS["Home"]))
        wait_for(lambda: all(app.snapshots.get(each.id).connection is Connection.CONNECTED for each in robots))
        rows = [app.operator.run_now(robot.id, mission.id) for robot in robots]
        wait_for(lambda: all(app.history.get(row.id).state is State.COMPLETED for row in rows))
        first, second = (app.history.get(row.id) for row in rows)
        assert first.taken_by in {vehicle.name for vehicle in others}
        assert (second.taken_by, second.robot) == ("", others[1].name)
