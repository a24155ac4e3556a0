"""What Settings says of fleets and of the robots that they have."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.check_up import RobotProfile
from app.domain.models import ANY_VEHICLE, Fleet, FleetKind, Robot
from app.domain.robot import FleetIdentity, Vehicle
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.fleets_view import fleet_found, fleet_items, fleet_note, to_be_added, vehicle_items
from app.screens.settings.removals import fleet_question
from app.screens.settings.view import NoticeView
from app.services.robots.fleets import FoundVehicle

HALL = Fleet("Hall 2", "http://10.0.0.5", id=3, identity="hall", profile=RobotProfile("hall", None))
BELLA = Robot("Bella", "", id=1, fleet=HALL, vehicle="7")
AINO = Robot("Aino", "10.0.0.7", id=2)
ANY, ONE, TWO, TWIN = (
    FoundVehicle(Vehicle(ANY_VEHICLE, "Hall 2")),
    FoundVehicle(Vehicle("7", "MiR 7"), robot=BELLA),
    FoundVehicle(Vehicle("8", "MiR 8")),
    FoundVehicle(Vehicle("9", "MiR 9"), others=(AINO,)),
)


@pytest.mark.parametrize(
    ("fleet", "says"),
    [
        (HALL, ""),
        (replace(HALL, needs_password=True, enabled=False), "Needs a password"),
        (replace(HALL, enabled=False), "Off"),
        (replace(HALL, profile=None), "Not checked up"),
        (replace(HALL, identity=None, profile=RobotProfile(None, None)), "Give the app its own user at the fleet"),
    ],
)
def test_a_row_says_what_has_to_be_done(fleet, says):
    either = replace(BELLA, name="Hall 2", id=3, vehicle=ANY_VEHICLE)  # which is no robot to count
    (item,) = fleet_items(SettingsFacts(robots=(AINO, BELLA, either), fleets=(fleet,)), {})
    assert (item.support, item.meta) == ("MiR Fleet · 1 robot", says)


def test_a_row_and_its_note_say_how_far_the_check_up_is():
    under_way = NoticeView("Is being checked up: 5 s of about 45 s", tone="accent")
    fleet = replace(HALL, profile=None)
    (item,) = fleet_items(SettingsFacts(fleets=(fleet,)), {HALL.id: under_way})
    assert item.meta == fleet_note(SettingsFacts(), fleet, under_way).text == under_way.text


def test_without_robots_it_has_its_address():
    enterprise = replace(HALL, kind=FleetKind.ENTERPRISE)
    (item,) = fleet_items(SettingsFacts(fleets=(enterprise,)), {})
    assert item.support == "Fleet Enterprise · 10.0.0.5"


def test_its_note_names_its_robots():
    facts = SettingsFacts(robots=(AINO, BELLA), fleets=(HALL,))
    assert fleet_note(facts, HALL, NoticeView()).text == "In use here: Bella"
    assert fleet_note(SettingsFacts(), HALL, NoticeView()).text == "In use here: none yet"


def test_the_answer_counts_robots():
    assert fleet_found(FleetIdentity(None, "3.5.4", (ONE.vehicle,))).text == "The fleet answers, with 1 robot"


def test_what_was_found_is_added_once_and_warned_about():
    items = vehicle_items([ANY, ONE, TWO, TWIN], (AINO, BELLA), HALL)
    assert [item.title for item in items] == ["Any robot of the fleet", "MiR 7", "MiR 8", "MiR 9"]
    assert [item.meta for item in items] == ["", "Added", "", ""]
    assert [bool(item.actions) for item in items] == [True, False, True, True]
    assert items[3].note.startswith("Aino is the same robot, reached in another way")
    assert to_be_added([ANY, ONE, TWO, TWIN], (AINO, BELLA), HALL) == [ANY.vehicle, TWO.vehicle]


def test_its_robots_go_with_it():
    assert fleet_question(SettingsFacts(robots=(AINO,)), HALL) == ""
    assert "This goes with it: Bella." in fleet_question(SettingsFacts(robots=(AINO, BELLA)), HALL)
