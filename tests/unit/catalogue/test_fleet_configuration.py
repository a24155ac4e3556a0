"""Fleets, and robots that are reached through them, in configuration files."""

from __future__ import annotations

import pytest

from app.domain.models import ANY_VEHICLE, FleetKind
from tests.support.errors import refuses

FLEET = {"name": "Hall", "address": "10.0.0.50", "username": "user", "password": "secret"}
ROBOT = {"name": "Bella", "fleet": "Hall", "vehicle": "7"}
ANY = {"name": "Any of Hall", "fleet": "Hall", "vehicle": "any", "hand_over": "when_free"}


@pytest.fixture
def hall(tablet):
    tablet.take(fleets=[FLEET], robots=[ROBOT, ANY])
    return tablet


def test_a_file_adds_a_fleet_and_its_robots(tablet):
    assert tablet.take(fleets=[FLEET], robots=[ROBOT, ANY]) == [
        "fleet Hall added",
        "robot Bella added",
        "robot Any of Hall added",
    ]
    (fleet,) = tablet.catalogue.fleets()
    assert (fleet.kind, fleet.address, fleet.enabled) == (FleetKind.CLASSIC, "http://10.0.0.50", True)
    bella, either = tablet.robots["Bella"], tablet.robots["Any of Hall"]
    assert (bella.fleet, bella.vehicle, bella.token, bella.enabled) == (fleet, "7", fleet.token, True)
    assert either.vehicle == ANY_VEHICLE


def test_what_is_exported_is_taken_as_it_is(hall):
    hall.take(fleets=[{"name": "Hall", "enabled": False}])
    found = hall.export()
    assert found["fleets"] == [
        {"name": "Hall", "address": "http://10.0.0.50", "kind": "classic", "username": "user", "enabled": False}
    ]
    assert found["robots"][1] == {"name": "Bella", "enabled": True, "idle": None, "fleet": "Hall", "vehicle": "7"}
    before = hall.robots, hall.catalogue.fleets()
    assert hall.take(found) == []
    assert (hall.robots, hall.catalogue.fleets()) == before


def test_without_a_password_a_fleet_is_off_and_says_so_once(tablet):
    lines = tablet.take(fleets=[{"name": "Hall", "address": "10.0.0.50", "username": "user"}], robots=[ROBOT])
    assert lines == ["fleet Hall added, it is switched off and needs a password", "robot Bella added"]
    assert not tablet.robots["Bella"].enabled
    assert tablet.take(fleets=[{"name": "Hall", "password": "secret"}]) == [
        "fleet Hall changed: In use no → yes, Password"
    ]
    assert tablet.robots["Bella"].enabled


def test_a_changed_connection_is_said_of_the_fleet(hall):
    hall.take(fleets=[{"name": "Hall", "address": "https://10.0.0.50", "password": "new"}])
    assert hall.take(fleets=[{"name": "Hall", "address": "http://10.0.0.50", "password": "other"}], robots=[ROBOT]) == [
        "fleet Hall changed: Address https://10.0.0.50 → 10.0.0.50, Password",
        "the connection to fleet Hall is no longer encrypted",
    ]


def test_robots_of_a_fleet_that_is_off_have_switches_of_their_own(hall):
    hall.take(fleets=[{"name": "Hall", "enabled": False}], robots=[{"name": "Bella", "enabled": False}])
    hall.take(fleets=[{"name": "Hall", "enabled": True}])
    assert [robot.enabled for robot in hall.robots.values()] == [True, False]  # any of it, Bella
    assert hall.robots["Any of Hall"].enabled


@pytest.mark.parametrize(
    ("sections", "field", "problem"),
    [
        ({"robots": [ROBOT]}, "robots[0].fleet", "there is no fleet Hall, add it"),
        ({"fleets": [{"name": "Hall"}]}, "fleets[0].address", "'address' is missing"),
        ({"fleets": [FLEET | {"kind": "other"}]}, "fleets[0].kind", "enter classic or enterprise"),
        ({"fleets": [FLEET, FLEET]}, "fleets[1].name", "Hall appears twice"),
        ({"fleets": [FLEET], "robots": [{"name": "B", "fleet": "Hall"}]}, "robots[0].vehicle", "needs its id"),
        ({"fleets": [FLEET], "robots": [ROBOT | {"vehicle": "a b"}]}, "robots[0].vehicle", "letters, digits"),
        ({"fleets": [FLEET], "robots": [ROBOT, ROBOT | {"name": "C"}]}, "robots[0].vehicle", "C, which is configured"),
        ({"robots": [{"name": "B", "vehicle": "7"}]}, "robots[0].address", "'address' is missing"),
        (
            {"fleets": [FLEET], "robots": [{"name": "B", "address": "10.0.0.50"}]},
            "fleets[0].address",
            "this is the address of B",
        ),
        *(
            ({"fleets": [FLEET], "robots": [ROBOT | {key: value}]}, f"robots[0].{key}", "has this from the fleet")
            for key, value in {
                "address": "10.0.0.7",
                "username": "user",
                "password": "x",
                "certificate_sha256": "ab" * 32,
            }.items()
        ),
    ],
)
def test_what_can_not_be_is_refused_at_its_place(tablet, sections, field, problem):
    before = tablet.everything()
    with refuses(field, problem):
        tablet.take(**sections)
    assert tablet.everything() == before


def test_two_fleets_may_swap_their_addresses(hall):
    hall.take(fleets=[FLEET | {"name": "Yard", "address": "10.0.0.60"}])
    hall.take(fleets=[FLEET | {"address": "10.0.0.60"}, FLEET | {"name": "Yard"}])
    assert [fleet.address for fleet in hall.catalogue.fleets()] == ["http://10.0.0.60", "http://10.0.0.50"]


def test_no_more_fleets_than_can_be_followed(tablet):
    with refuses("fleets", "more than the 20 allowed"):
        tablet.take(fleets=[FLEET | {"name": f"F{n}", "address": f"10.0.1.{n}"} for n in range(21)])
