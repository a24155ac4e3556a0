"""Groups and places in the plan: saved, named, deleted and undone, written to a file and read from it."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import datetime

import pytest

from app.domain.models import Group, HandOver, InvalidInput, Mission, Overlap, Place, Robot, Schedule
from app.services.catalogue.configuration import import_configuration
from app.services.catalogue.configuration.exporting import export_configuration
from tests.support.edits import import_file
from tests.support.site import Site

START = datetime(2026, 11, 23, 6, 5)


@pytest.fixture
def site(tmp_path):
    site = Site(tmp_path / "one", robots=5)
    site.add_robots()
    site.add_mission("Deliver")
    yield site
    site.switch_off()


@pytest.fixture
def elsewhere(tmp_path):
    """Another app, which has nothing yet."""
    other = Site(tmp_path / "two", robots=0)
    yield other.container
    other.switch_off()


@pytest.fixture
def catalogue(site):
    return site.container.catalogue


def hall(catalogue, **values):
    return catalogue.save_group(Group("Hall", tuple(robot.id for robot in catalogue.robots())[:4], **values))


def of_group(group, **values):
    return Schedule("Kits", None, 1, START, "UTC", group_id=group.id, **values)


@pytest.mark.parametrize(
    ("group", "problem"),
    [
        (Group("Hall"), "choose the robots"),
        (Group("Hall", (1, 99)), "robot no longer exists"),
        (Group("", (1,)), "enter a name"),
        (Group("Hall", (1, 2, 3), keep_free=1), "4 robots or more"),
        (Group("Hall", (1, 2, 3, 4), keep_free=4), "not all of them"),
        (Group("Hall", (1,), hand_over="now"), "enter at_once or when_free"),
    ],
)
def test_what_makes_no_group_is_refused(catalogue, group, problem):
    with pytest.raises(InvalidInput, match=problem):
        catalogue.save_group(group)


@pytest.mark.parametrize(
    ("schedule", "problem"),
    [
        (Schedule("Kits", None, 1, START, "UTC"), "choose a robot, or a group"),
        (Schedule("Kits", 1, 1, START, "UTC", group_id=1), "choose a robot, or a group"),
        (Schedule("Kits", 1, 1, START, "UTC", finish_by_minutes=30), "only for a group of robots"),
        (Schedule("Kits", 1, 1, START, "UTC", overlap=Overlap.PARALLEL), "only a group of robots can run"),
        (Schedule("Kits", None, 2, START, "UTC", group_id=1), "a group needs one for all robots"),
    ],
)
def test_a_schedule_is_for_a_robot_or_for_a_group(catalogue, schedule, problem):
    hall(catalogue)
    catalogue.save_mission(Mission("Own", "3d7c7c40-ce85-11ef-904a-000e8e9884ec", robot_id=1))
    with pytest.raises(InvalidInput, match=problem):
        catalogue.save_schedule(schedule)


def test_a_blank_name_is_made_of_mission_and_group(catalogue):
    group = hall(catalogue)
    assert catalogue.save_schedule(Schedule("", None, 1, START, "UTC", group_id=group.id)).name == "Deliver on Hall"


def test_a_deleted_group_takes_its_schedules_along_and_undo_brings_them_back(site, catalogue):
    group = hall(catalogue, keep_free=1)
    kept = catalogue.save_schedule(of_group(group, finish_by_minutes=45, overlap=Overlap.PARALLEL))
    removed = catalogue.remove_group(group.id)
    assert (catalogue.groups(), catalogue.schedules()) == ([], [])
    catalogue.restore(removed)
    [back] = catalogue.schedules()
    assert catalogue.groups() == [group]
    assert (back.id, back.group_id, back.finish_by_minutes, back.overlap) == (kept.id, group.id, 45, Overlap.PARALLEL)
    site.run(320)
    assert [run.robot_group for run in site.executions()] == ["Hall"]


# ---------------------------------------------------------------------- files
def test_what_is_exported_is_the_same_when_it_is_read_in_elsewhere(site, catalogue, elsewhere):
    group = hall(catalogue, hand_over=HandOver.AT_ONCE, keep_free=1)
    catalogue.save_schedule(of_group(group, finish_by_minutes=45, overlap=Overlap.PARALLEL))
    catalogue.save_place(Place("Dock 2", 3, (1,)))
    catalogue.edit(lambda edit: edit.robots.update(edit.c, replace(edit.the(Robot, 5), hand_over=HandOver.WHEN_FREE)))
    text = export_configuration(site.container.db.read())
    import_configuration(elsewhere.catalogue, text.encode())
    again = export_configuration(elsewhere.db.read())
    assert import_configuration(elsewhere.catalogue, text.encode()) == []
    assert _all_switched_on(again) == _all_switched_on(text)


def _all_switched_on(exported):
    """Without passwords they are off."""
    found = json.loads(exported)
    return {**found, "robots": [{**robot, "enabled": True} for robot in found["robots"]]}


@pytest.mark.parametrize(
    ("section", "problem"),
    [
        ({"schedules": [{"mission": "Deliver", "start": "2026-11-24T06:00"}]}, "name either a robot or a group"),
        (
            {"schedules": [{"robot": "R1", "group": "Hall", "mission": "Deliver", "start": "2026-11-24T06:00"}]},
            "name either a robot or a group",
        ),
        (
            {"schedules": [{"group": "Nowhere", "mission": "Deliver", "start": "2026-11-24T06:00"}]},
            "there is no group Nowhere",
        ),
        ({"groups": [{"name": "Hall", "robots": ["R1", "R9"]}]}, "there is no robot R9"),
        ({"groups": [{"name": "Hall", "robots": ["R1", "R1"]}]}, "a name appears twice"),
        ({"groups": [{"name": "Hall", "robots": ["R1"]}, {"name": "Hall", "robots": ["R2"]}]}, "Hall appears twice"),
        ({"missions": [{"name": "Deliver", "guid": "x", "places": ["Dock 9"]}]}, "there is no place Dock 9"),
    ],
)
def test_a_file_that_is_wrong_about_groups_says_where_and_changes_nothing(site, catalogue, section, problem):
    before = export_configuration(site.container.db.read())
    with pytest.raises(InvalidInput, match=problem):
        import_file(catalogue, **section)
    assert export_configuration(site.container.db.read()) == before


def test_a_group_that_keeps_none_free_any_more_is_saved_so(catalogue):
    hall(catalogue, keep_free=1)
    catalogue.remove_robot(1)
    saved = catalogue.save_group(replace(catalogue.groups()[0], members=(2, 3, 4, 5)))
    assert saved.keep_free == 0
    assert catalogue.groups() == [saved]


def test_a_group_keeps_fewer_free_when_a_robot_is_removed_and_again_as_many_when_that_is_undone(catalogue):
    group = hall(catalogue, keep_free=1)
    removed = catalogue.remove_robot(1)
    assert catalogue.groups()[0].keep_free == 0
    catalogue.restore(removed)
    assert catalogue.groups() == [group]


@pytest.mark.parametrize("goes", ["robot", "group"])
def test_a_group_that_comes_back_smaller_keeps_none_free(site, catalogue, goes):
    """Else no form, and no import of its own export, would take it."""
    group = hall(catalogue, keep_free=1)
    removed = catalogue.remove_robot(1) if goes == "robot" else catalogue.remove_group(group.id)
    catalogue.remove_robot(2)
    catalogue.restore(removed)
    assert (len(catalogue.groups()[0].members), catalogue.groups()[0].keep_free) == (3, 0)
    assert import_configuration(catalogue, export_configuration(site.container.db.read()).encode()) == []


def test_a_group_whose_last_robot_was_removed_can_be_written_and_read(site, catalogue, elsewhere):
    catalogue.save_group(Group("Yard", (5,)))
    catalogue.remove_robot(5)
    text = export_configuration(site.container.db.read())
    import_configuration(elsewhere.catalogue, text.encode())
    assert elsewhere.catalogue.groups()[0].members == ()


def test_a_file_takes_a_finish_by_away(site, catalogue):
    schedule = catalogue.save_schedule(of_group(hall(catalogue)))
    text = export_configuration(site.container.db.read())
    catalogue.save_schedule(replace(schedule, finish_by_minutes=45))
    import_configuration(catalogue, text.encode())
    assert catalogue.schedules()[0].finish_by_minutes is None


def test_a_file_moves_a_start_with_a_finish_by_to_one_robot(catalogue):
    schedule = catalogue.save_schedule(of_group(hall(catalogue), finish_by_minutes=45))
    moved = {"name": schedule.name, "robot": "R1", "mission": "Deliver", "start": "2026-11-23T06:05"}
    import_file(catalogue, schedules=[moved])
    [moved] = catalogue.schedules()
    assert (moved.robot_id, moved.finish_by_minutes) == (1, None)
