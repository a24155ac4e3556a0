"""The robot on its own map: what is shown of it, and when nothing is."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Connection
from app.domain.robot import Pose
from app.screens.home.map import NO_MAP, robots_on_map
from app.screens.home.view import present
from tests.support.home_facts import EXECUTING, FACTS, HALL, NOW, READY, STOPPED, snapshot, with_aino


def test_the_robot_its_goal_and_the_places_are_on_the_map() -> None:
    view = present(FACTS, NOW).map
    assert view.picture is HALL
    assert view.at == HALL.fraction(18.0, 12.0)
    assert view.heading == 0.0
    line2 = next(place for place in HALL.places if place.name == "Line 2")
    assert view.path == (view.at, (line2.x, line2.y))
    assert view.label == "Line 2 · 12 m"
    assert {place.name for place in view.picture.places} >= {"Home", "Dock", "Line 2"}


def test_a_robot_that_does_not_move_has_no_goal() -> None:
    assert present(with_aino(replace(READY, mission_text="Moved to 'Line 2'")), NOW).map.path == ()


def test_two_places_that_could_be_meant_are_no_goal() -> None:
    status = replace(EXECUTING, mission_text="Moving from 'Line 1' to 'Line 2'")
    assert present(with_aino(status), NOW).map.path == ()


def test_a_stopped_robot_is_as_red_on_the_map_as_elsewhere() -> None:
    assert present(with_aino(STOPPED), NOW).map.tone == "fault"
    assert present(with_aino(READY), NOW).map.tone == "accent"


def test_an_old_place_looks_old_and_says_when_it_was_seen() -> None:
    view = present(with_aino(EXECUTING, age=300, connection=Connection.UNREACHABLE), NOW).map
    assert (view.tone, view.path, view.label) == ("offline", (), "seen 14:33")


@pytest.mark.parametrize("position", [None, Pose(500.0, 0.0, 0.0)])
def test_without_a_place_on_it_the_map_is_not_shown(position: Pose | None) -> None:
    assert present(with_aino(replace(EXECUTING, position=position)), NOW).map is NO_MAP


def test_nor_without_a_map_or_a_status() -> None:
    assert present(replace(FACTS, map=None), NOW).map is NO_MAP
    assert present(with_aino(None), NOW).map is NO_MAP


# ---------------------------------------------------------------------- all robots on it
def test_all_robots_on_the_map_are_there_the_abnormal_ones_in_words() -> None:
    elsewhere = replace(READY, map_id="another map")
    facts = replace(
        with_aino(STOPPED),
        snapshots={
            1: snapshot(1, STOPPED),
            2: snapshot(2, READY, age=900, connection=Connection.UNREACHABLE),
            3: snapshot(3, elsewhere),
        },
    )
    assert [(marker.name, marker.tone) for marker in robots_on_map(facts, NOW)] == [
        ("Aino · Stopped", "fault"),
        ("Veikko · No answer", "offline"),
    ]
    well = with_aino(EXECUTING)
    marker = robots_on_map(well, NOW)[0]
    assert (marker.name, marker.tone, marker.heading) == ("Aino", "accent", 0.0)
    assert (marker.x, marker.y) == HALL.fraction(18.0, 12.0)


def test_robots_that_need_help_come_first_then_the_shown_one() -> None:
    facts = replace(
        FACTS,
        settings=replace(FACTS.settings, selected_robot_id=2),
        snapshots={1: snapshot(1, READY), 2: snapshot(2, EXECUTING), 3: snapshot(3, STOPPED)},
    )
    assert [marker.name.split(" ")[0] for marker in robots_on_map(facts, NOW)] == [
        FACTS.robots[2].name,
        FACTS.robots[1].name,
        FACTS.robots[0].name,
    ]


def test_without_a_map_no_robot_is_on_it() -> None:
    assert robots_on_map(replace(FACTS, map=None), NOW) == ()
