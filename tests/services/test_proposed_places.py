"""Positions to which several missions drive, on several robots, are proposed as places."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Mission, Place
from mir_sim.world import BY_NAME
from tests.support.groups import Hall
from tests.support.site import GUIDS


@pytest.fixture
def hall(tmp_path):
    """Two robots; line 1 is where two of three missions go."""
    hall = Hall(tmp_path, robots=2)
    for name in ("Waste to compactor", "Home"):
        hall.add_mission(name)
    hall.run(5)
    hall.learn_stops()
    yield hall
    hall.switch_off()


def proposed(hall):
    missions = {mission.id: mission.name for mission in hall.container.catalogue.missions()}
    return [(place.name, [missions[key] for key in place.missions]) for place in hall.container.proposed_places.all()]


LINE_1 = ("Line 1", ["Deliver", "Waste to compactor"])


def test_where_missions_of_several_robots_meet(hall):
    assert proposed(hall) == [LINE_1]


def test_the_one_with_the_most_missions_comes_first(hall):
    for name in ("Collect empties", "Wait at home"):
        hall.add_mission(name)
    hall.learn_stops()
    assert proposed(hall) == [
        ("Line 1", ["Collect empties", "Deliver", "Waste to compactor"]),
        ("Home", ["Home", "Wait at home"]),
    ]


def test_robots_own_missions_of_one_name_are_several(hall):
    catalogue, r1 = hall.container.catalogue, hall.robot("R1")
    [waste] = [mission for mission in catalogue.missions() if mission.name == "Waste to compactor"]
    catalogue.remove_mission(waste.id)
    catalogue.save_mission(Mission("Deliver", GUIDS["Waste to compactor"], robot_id=r1.id))
    hall.learn_stops()
    assert proposed(hall) == [("Line 1", ["Deliver", "Deliver"])]


def test_of_one_robot_s_missions_none_is_proposed(hall):
    catalogue, r1 = hall.container.catalogue, hall.robot("R1")
    for mission in catalogue.missions():
        catalogue.save_mission(replace(mission, robot_id=r1.id))
    assert proposed(hall) == []


@pytest.mark.parametrize("place", [Place("line 1", 1), Place("Dock 2", 3, (1, 2)), Place("Dock 2", 3, (1, 2, 3))])
def test_what_is_a_place_already_is_not_proposed(hall, place):
    hall.container.catalogue.save_place(place)
    assert proposed(hall) == []


def test_a_place_that_only_some_of_them_use_is_another_one(hall):
    hall.container.catalogue.save_place(Place("Dock 2", 1, (1,)))
    assert proposed(hall) == [LINE_1]


def test_one_that_was_declined_stays_away(hall):
    hall.container.proposed_places.decline(BY_NAME["Line 1"].guid)
    assert proposed(hall) == []
    hall.switch_off()
    hall.switch_on()
    assert proposed(hall) == []


def test_the_entry_of_a_charger_is_none_and_the_charger_is_one(hall):
    for name in ("Return to charger", "Charge to 80 %"):
        hall.add_mission(name)
    hall.learn_stops()
    assert [name for name, _missions in proposed(hall)] == ["Charger", "Line 1"]
