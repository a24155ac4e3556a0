"""A fleet's robots: asked, compared with those of the plan, added."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.database.connection import Database
from app.domain.message import render
from app.domain.models import ANY_VEHICLE, Fleet, InvalidInput, Robot
from app.domain.robot import FleetIdentity, Vehicle
from app.mir.credentials import Token
from app.mir.errors import Unreachable
from app.services.catalogue.catalogue import Catalogue
from app.services.robots.fleets import Fleets
from tests.support.clock import VirtualClock

BELLA, CARA = Vehicle("7", "Bella", "S7", "MiR250", "10.0.0.7"), Vehicle("8", "Aino", "", "MiR100", "10.0.0.8")


class Hall:
    """A plan with a fleet, and what the fleet answers."""

    def __init__(self, path) -> None:
        self.clock = VirtualClock()
        self.db = Database.open(path / "data" / "a.db", clock=self.clock, durable=False)
        self.catalogue = Catalogue(self.db, self.clock)
        self.asked: list[Fleet] = []
        self.says: FleetIdentity | None = FleetIdentity("Hall 1", "2.13.5", (CARA, BELLA))
        self.fleets = Fleets(self.catalogue, self._ask, self.clock)
        self.id = self.catalogue.save_fleet(Fleet("Hall", "10.0.0.50", username="user"), password="secret").id

    def _ask(self, fleet: Fleet) -> FleetIdentity:
        self.asked.append(fleet)
        if self.says is None:
            raise Unreachable(address="10.0.0.50")
        return self.says

    def pass_time(self, seconds: float) -> None:
        self.clock.advance(seconds)
        self.fleets.tick()
        if self.fleets._thread is not None:
            self.fleets._thread.join(10)

    @property
    def fleet(self) -> Fleet:
        return self.catalogue.fleets()[0]

    def warnings(self) -> dict[str, str]:
        return {each.vehicle.id: render(each.warning) for each in self.fleets.find(self.id)}


@pytest.fixture
def hall(tmp_path):
    hall = Hall(tmp_path)
    yield hall
    hall.db.close()


def test_its_robots_are_found_by_name_after_any_of_them(hall):
    found = hall.fleets.find(hall.id)
    assert [each.vehicle.name for each in found] == ["Any of Hall", "Aino", "Bella"]
    assert [(each.robot, each.others, each.warning) for each in found] == [(None, (), "")] * 3
    assert (hall.fleet.identity, hall.fleet.software) == ("Hall 1", "2.13.5")


def test_those_chosen_are_added_by_free_names(hall):
    hall.catalogue.save_robot(Robot("aino", "10.0.0.1", "user"), password="secret")
    either, cara, bella = (each.vehicle for each in hall.fleets.find(hall.id))
    added = hall.fleets.add(hall.id, [either, cara, bella])
    assert [robot.name for robot in added] == ["Any of Hall", "Aino 2", "Bella"]
    assert [(robot.vehicle, robot.serial_number, robot.model) for robot in added] == [
        (ANY_VEHICLE, None, None),
        ("8", None, "MiR100"),
        ("7", "S7", "MiR250"),
    ]
    assert [each.robot and each.robot.name for each in hall.fleets.find(hall.id)] == ["Any of Hall", "Aino 2", "Bella"]
    with pytest.raises(InvalidInput, match="Bella, which is configured already"):
        hall.fleets.add(hall.id, [bella])


def test_a_robot_that_is_reached_directly_too_is_warned_about(hall):
    direct = hall.catalogue.save_robot(Robot("Direct", "10.0.0.99", "user", serial_number="S7"), password="secret")
    by_address = hall.catalogue.save_robot(Robot("Other", "https://10.0.0.8", "user"), password="secret")
    assert [each.others for each in hall.fleets.find(hall.id)] == [(), (by_address,), (direct,)]
    assert hall.warnings()["7"] == (
        "Direct is the same robot, reached in another way: starts for both end up on one robot"
    )


def test_addresses_count_where_a_serial_number_is_not_known(hall):
    hall.catalogue.save_robot(Robot("Another", "10.0.0.7", "user", serial_number="S1"), password="secret")
    assert hall.warnings()["7"] == ""


def test_a_robot_of_two_fleets_is_warned_about(hall):
    other = hall.catalogue.save_fleet(Fleet("Yard", "10.0.0.51", username="user"), password="secret")
    hall.fleets.add(other.id, [replace(BELLA, name="B")])
    assert hall.warnings() == {
        ANY_VEHICLE: "",
        "8": "",
        "7": "B is the same robot, reached in another way: starts for both end up on one robot",
    }


def test_another_fleet_at_the_address_is_refused(hall):
    hall.fleets.find(hall.id)
    hall.says = replace(hall.says, identity="Hall 2")
    with pytest.raises(InvalidInput, match="another fleet answers at this address: Hall 2 instead of Hall 1"):
        hall.fleets.find(hall.id)
    assert hall.fleet.identity == "Hall 1"


def test_fleets_are_asked_once_an_hour_who_they_are(hall):
    hall.pass_time(0)
    assert (hall.fleet.identity, hall.fleet.software) == ("Hall 1", "2.13.5")
    hall.says = replace(hall.says, software="3.3.3")
    for seconds, software in ((3000, "2.13.5"), (700, "3.3.3")):
        hall.pass_time(seconds)
        assert hall.fleet.software == software


def test_a_fleet_that_is_not_known_yet_is_soon_asked_again(hall):
    said, hall.says = hall.says, None
    hall.pass_time(0)
    assert hall.fleet.identity is None
    hall.says = said
    hall.pass_time(40)
    assert hall.fleet.identity == "Hall 1"


def test_a_fleet_without_a_password_is_not_asked(hall):
    hall.catalogue.save_fleet(replace(hall.fleet, address="10.0.0.60"))
    with pytest.raises(InvalidInput, match="until its password is entered"):
        hall.fleets.find(hall.id)
    assert hall.asked == []


def test_a_connection_is_tested_as_it_was_entered(hall):
    assert hall.fleets.test_connection(Fleet("New", "10.0.0.70", username="me"), "x") == hall.says
    assert (hall.asked[-1].address, hall.asked[-1].token) == ("http://10.0.0.70", Token.derive("me", "x").header)
    hall.fleets.test_connection(replace(hall.fleet, name="Hall A"))
    assert hall.asked[-1].token == hall.fleet.token
    with pytest.raises(InvalidInput, match="enter the password"):
        hall.fleets.test_connection(replace(hall.fleet, address="10.0.0.70"))
    assert hall.fleet.identity is None
