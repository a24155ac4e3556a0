"""Changes of missions and settings, and several at once: checked first, whole, with all that follows from them."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from types import SimpleNamespace

import pytest

from app.domain.execution import ReasonCode, State
from app.domain.models import DayException, Group, HandOver, IdleRule, InvalidInput, Mission, Place, Robot, Settings
from app.domain.robot import MissionParameter
from app.mir.credentials import Token
from app.services.catalogue import mission_edit, robot_edit, settings_edit
from app.services.live.changes import Topic
from tests.support.errors import refuses
from tests.unit.catalogue.world import MISSIONS, ROBOTS, SCHEDULES


# ---------------------------------------------------------------------- missions
@pytest.mark.parametrize("guid", ["", " ", "a b", "x" * 65, "a/b", "ä"])
def test_a_guid_is_letters_digits_and_hyphens(world, guid):
    with refuses("guid", "guid"):
        world.catalogue.save_mission(Mission("New", guid))


@pytest.mark.parametrize("minutes", [0, -5, 1441, 2.5, True, "12"])
def test_a_usual_duration_is_a_whole_number_of_minutes_of_a_day(world, minutes):
    with refuses("usual_minutes", "a whole number from 1 to 1440"):
        world.catalogue.save_mission(replace(world.mission, usual_minutes=minutes))
    assert MISSIONS.get(world.db.read(), world.mission.id) == world.mission


@pytest.mark.parametrize("minutes", [1, 1440, None])
def test_a_usual_duration_is_kept_or_removed(world, minutes):
    typed = world.catalogue.save_mission(replace(world.mission, usual_minutes=12))
    world.catalogue.save_mission(replace(typed, usual_minutes=minutes))
    assert MISSIONS.get(world.db.read(), world.mission.id).usual_minutes == minutes


def test_a_robots_own_mission_takes_over_what_is_planned_there(world, bella):
    here, there = world.schedule(), world.schedule(name="There", robot_id=bella.id)
    world.catalogue.change_idle_rule(world.robot.id, mission_id=world.mission.id)
    own = world.catalogue.save_mission(Mission("Deliver", "guid-2", robot_id=world.robot.id))
    assert (world.stored(here).mission_id, world.stored(there).mission_id) == (own.id, world.mission.id)
    assert ROBOTS.get(world.db.read(), world.robot.id).idle.mission_id == own.id
    assert world.schedule(name="Later").mission_id == own.id
    world.catalogue.remove_mission(own.id)
    assert world.stored(here).mission_id == world.mission.id


def test_a_mission_of_another_robot_cannot_be_planned(world, bella):
    own = world.catalogue.save_mission(Mission("Home", "guid-2", robot_id=bella.id))
    with refuses("mission", "another robot only"):
        world.schedule(mission_id=own.id)
    with refuses("mission", "another robot only"):
        world.catalogue.change_idle_rule(world.robot.id, mission_id=own.id)


@pytest.mark.parametrize("general_first", [True, False])
def test_a_robots_own_mission_is_used_again_in_any_order_of_restoring(world, general_first):
    own = world.catalogue.save_mission(Mission("Deliver", "guid-2", robot_id=world.robot.id))
    schedule = world.schedule()
    world.catalogue.change_idle_rule(world.robot.id, mission_id=own.id)
    removed = [world.catalogue.remove_mission(id_) for id_ in (own.id, world.mission.id)]
    for each in reversed(removed) if general_first else removed:
        world.catalogue.restore(each)
    assert world.stored(schedule).mission_id == own.id
    assert ROBOTS.get(world.db.read(), world.robot.id).idle.mission_id == own.id


def test_a_robots_own_mission_is_used_when_the_one_for_all_comes_by_its_name(world):
    schedule = world.schedule()
    removed = world.catalogue.remove_mission(world.mission.id)
    own = world.catalogue.save_mission(Mission("Deliver", "guid-2", robot_id=world.robot.id))
    home = world.catalogue.save_mission(Mission("Home", "guid-3"))
    other = world.schedule(name="Other", mission_id=home.id)
    own_home = world.catalogue.save_mission(Mission("Rest", "guid-4", robot_id=world.robot.id))
    world.catalogue.restore(removed)
    assert world.stored(schedule).mission_id == own.id
    world.catalogue.save_mission(replace(home, name="Rest"))
    assert world.stored(other).mission_id == own_home.id


@pytest.mark.parametrize("what", ["schedule", "robot", "group"])
def test_undo_refuses_what_used_a_mission_that_is_only_another_robots_since(world, bella, what):
    catalogue, robot_id = world.catalogue, world.robot.id
    if what == "schedule":
        removed = catalogue.remove_schedule(world.schedule().id)
    elif what == "robot":
        catalogue.change_idle_rule(robot_id, mission_id=world.mission.id)
        removed = catalogue.remove_robot(robot_id)
    else:
        group = catalogue.save_group(Group("Carts", (robot_id, bella.id)))
        world.schedule(robot_id=None, group_id=group.id)
        removed = catalogue.remove_group(group.id)
    catalogue.save_mission(replace(world.mission, robot_id=bella.id))
    with refuses(
        "mission", "the mission Deliver is for (another robot only|one robot only, a group needs one for all)"
    ):
        catalogue.restore(removed)
    general = catalogue.save_mission(Mission("Deliver", "guid-2"))
    catalogue.restore(removed)
    used = [schedule.mission_id for schedule in catalogue.schedules()]
    used += [robot.idle.mission_id for robot in catalogue.robots() if robot.idle]
    assert used == [general.id]


def test_undo_refuses_a_mission_that_a_restored_robot_would_have_to_use(world, bella):
    world.catalogue.change_idle_rule(world.robot.id, mission_id=world.mission.id)
    robot = world.catalogue.remove_robot(world.robot.id)
    world.catalogue.save_mission(replace(world.mission, robot_id=bella.id))
    mission = world.catalogue.remove_mission(world.mission.id)
    world.catalogue.restore(robot)
    with refuses("robot", "the mission Deliver is used on other robots too"):
        world.catalogue.restore(mission)


def test_a_mission_is_deleted_and_restored_with_schedules_and_idle_rules(world):
    schedule = world.schedule()
    waiting = world.row(schedule)
    with_rule = world.catalogue.change_idle_rule(world.robot.id, mission_id=world.mission.id)
    removed = world.catalogue.remove_mission(world.mission.id)
    assert (MISSIONS.all(world.db.read()), SCHEDULES.all(world.db.read())) == ([], [])
    assert world.outcome(waiting) == (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED)
    world.catalogue.restore(removed)
    assert ROBOTS.all(world.db.read()) == [with_rule]
    assert [found.id for found in SCHEDULES.all(world.db.read())] == [schedule.id]


@pytest.mark.parametrize("minutes", [4, 31, 7.5, True])
def test_idle_time_is_5_to_30_minutes(world, minutes):
    with refuses("after_minutes", "5 to 30"):
        world.catalogue.change_idle_rule(world.robot.id, mission_id=world.mission.id, after_minutes=minutes)


def test_an_idle_rule_can_be_removed(world):
    assert world.catalogue.change_idle_rule(
        world.robot.id, mission_id=world.mission.id, after_minutes=30, enabled=False
    ).idle == IdleRule(world.mission.id, 30, False)
    world.catalogue.edit(lambda edit: robot_edit.set_idle_rule(edit, world.robot.id, None))
    assert ROBOTS.get(world.db.read(), world.robot.id) == world.robot


# ---------------------------------------------------------------------- settings
def test_settings_are_stored_and_announced(world):
    assert world.catalogue.change_settings(retry_limit=3, history_limit=None).retry_limit == 3
    assert world.announced == [Topic.SETTINGS]
    world.announced.clear()
    world.catalogue.change_settings(retry_limit=3)
    assert world.announced == []


@pytest.mark.parametrize(
    "changes",
    [
        {"poll_interval_seconds": 0},
        {"poll_interval_seconds": 3601},
        {"poll_interval_seconds": None},
        {"retry_limit": -1},
        {"retry_limit": 21},
        {"retry_limit": True},
        {"minimum_battery_percent": -1},
        {"minimum_battery_percent": 100.5},
        {"working_days": []},
        {"working_days": ["MO", "MO"]},
        {"working_days": ["Monday"]},
        {"working_days": "MO"},
        {"timezone": "Nowhere"},
        {"start_window_minutes": 1441},
        {"history_limit": 0},
        {"unknown_outcome_quiet_seconds": 4},
        {"unknown_outcome_quiet_seconds": 601},
        {"install_id": "x"},
        {"poll_interval": 3},
    ],
)
def test_an_invalid_setting_is_reported_at_its_field_and_changes_nothing(world, changes):
    with refuses(next(iter(changes))):
        world.catalogue.change_settings(**changes, theme="dark")
    assert world.catalogue.change_settings() == Settings()


def test_other_working_days_replan_what_respects_them(world):
    daily, free = world.schedule(), world.schedule(name="Free", respect_working_days=False)
    weekend = world.schedule(name="Weekend", recurrence="FREQ=WEEKLY;BYDAY=SU")
    once = world.schedule(name="Once", recurrence=None)
    assert weekend.next_at is None
    world.catalogue.change_settings(working_days=["SU"])
    assert (
        world.stored(daily).next_at.isoformat()
        == "2026-11-29T06:30:00+00:00"
        == world.stored(weekend).next_at.isoformat()
    )
    assert (world.stored(free), world.stored(once)) == (free, once)
    assert world.stored(daily).changed_at == daily.changed_at


# ---------------------------------------------------------------------- together
def test_several_changes_are_made_all_or_not_at_all(world):
    def work(edit):
        settings_edit.change(edit, retry_limit=1)
        mission_edit.save(edit, Mission("New", "guid-7"))
        mission_edit.save(edit, Mission("New", "guid-8"))

    with pytest.raises(InvalidInput):
        world.catalogue.edit(work)
    assert world.catalogue.change_settings().retry_limit == 10
    assert MISSIONS.all(world.db.read()) == [world.mission]
    assert world.announced == []


# ---------------------------------------------------------------------- places
@pytest.mark.parametrize("place_first", [True, False])
@pytest.mark.parametrize("undone_first", [True, False])
def test_a_place_and_its_mission_are_linked_again_in_any_order_of_restoring(world, home, place_first, undone_first):
    place = world.catalogue.save_place(Place("Dock 2", 3, (home.id,)))
    acts = [lambda: world.catalogue.remove_place(place.id), lambda: world.catalogue.remove_mission(home.id)]
    removed = [act() for act in (acts if place_first else acts[::-1])]
    for each in removed if undone_first else removed[::-1]:
        world.catalogue.restore(each)
    assert world.catalogue.places() == [place]


def test_a_use_that_was_restored_is_not_restored_again(world, home):
    place = world.catalogue.save_place(Place("Dock 2", 3, (home.id,)))
    removed = [world.catalogue.remove_place(place.id), world.catalogue.remove_mission(home.id)]
    for each in removed:
        world.catalogue.restore(each)
    world.catalogue.save_place(replace(place, missions=()))
    world.catalogue.restore(world.catalogue.remove_mission(home.id))
    assert world.catalogue.places() == [replace(place, missions=())]


def test_a_restored_place_keeps_its_remaining_missions(world, home):
    place = world.catalogue.save_place(Place("Dock 2", 1, (world.mission.id, home.id)))
    removed = world.catalogue.remove_place(place.id)
    world.catalogue.remove_mission(home.id)
    world.catalogue.restore(removed)
    assert world.catalogue.places() == [replace(place, missions=(world.mission.id,))]


def test_a_deleted_place_is_not_restored_to_a_name_in_use(world):
    removed = world.catalogue.remove_place(world.catalogue.save_place(Place("Dock 2", 1)).id)
    other = world.catalogue.save_place(Place("Dock 2", 2))
    with refuses("name", "there is a place Dock 2 already"):
        world.catalogue.restore(removed)
    assert world.catalogue.places() == [other]


def test_the_names_of_groups_differ_in_more_than_capital_letters(world):
    group = world.catalogue.save_group(Group("Hall", (world.robot.id,)))
    with refuses("name", "there is a group Hall already"):
        world.catalogue.save_group(Group("hall", (world.robot.id,)))
    with refuses("name", f"there is a robot {world.robot.name} already"):
        world.catalogue.save_group(Group(world.robot.name.swapcase(), (world.robot.id,)))
    with refuses("name", "there is a group Hall already"):
        world.catalogue.save_robot(Robot("Hall", "10.0.0.2", "user"))
    assert world.catalogue.save_group(replace(group, name="HALL")).name == "HALL"


@pytest.mark.parametrize(
    ("of", "first", "second"),
    [
        (lambda world: world.robot, {"name": "Alma"}, {"enabled": False}),
        (
            lambda world: world.catalogue.save_group(Group("Carts", (world.robot.id,))),
            {"name": "Hall"},
            {"hand_over": HandOver.AT_ONCE},
        ),
        (lambda world: world.catalogue.save_place(Place("Lift", 1)), {"most": 2}, {"name": "Door"}),
        (lambda world: world.mission, {"name": "Home"}, {"usual_minutes": 5}),
        (lambda world: world.schedule(), {"priority": 1}, {"start_window_minutes": 5}),
        (
            lambda world: world.catalogue.save_days(DayException("Feast", date(2026, 12, 7), date(2026, 12, 7))),
            {"name": "Fair"},
            {"is_working": True},
        ),
    ],
    ids=["robot", "group", "place", "mission", "schedule", "days"],
)
def test_of_two_changes_at_the_same_time_both_stay_and_each_is_undone_alone(world, of, first, second):
    catalogue, read = world.catalogue, of(world)
    once = catalogue.change(read, replace(read, **first))
    twice = catalogue.change(read, replace(read, **second))
    assert {name: getattr(twice, name) for name in first | second} == first | second
    back = catalogue.change_back(read, once)
    assert {name: getattr(back, name) for name in first | second} == {
        name: getattr(read, name) for name in first
    } | second
    with refuses("name", "was changed again, so nothing is undone"):
        catalogue.change_back(read, once)


def test_what_was_chosen_together_is_not_written_over_what_was_chosen_elsewhere(world, home):
    catalogue, opened = world.catalogue, world.schedule()
    group = catalogue.save_group(Group("Carts", (world.robot.id,)))
    catalogue.change(opened, replace(opened, robot_id=None, group_id=group.id, finish_by_minutes=90))
    catalogue.change(opened, replace(opened, recurrence="FREQ=WEEKLY;BYDAY=MO"))
    later = catalogue.change(opened, replace(opened, parameters={"count": 5}))
    assert (later.group_id, later.recurrence, later.parameters) == (group.id, "FREQ=WEEKLY;BYDAY=MO", {"count": 5})
    for changes in (
        {"start": opened.start.replace(hour=5)},
        {"finish_by_minutes": 20},
        {"parameters": {"height": 2}},
        {"mission_id": home.id},
    ):
        with pytest.raises(InvalidInput, match="Morning has been changed since you opened it"):
            catalogue.change(opened, replace(opened, **changes))
    assert catalogue.change(opened, replace(opened, priority=1)) == replace(later, priority=1)


def test_a_new_connection_is_written_whole_and_leaves_the_rest_as_it_is(world):
    catalogue, read = world.catalogue, world.robot
    catalogue.change(read, replace(read, name="Alma", username="someone"))
    entered = replace(read, address="http://10.0.0.9", serial_number="7", model="MiR250")
    later = catalogue.change(read, entered, password="new", is_tested=True)
    assert (later.name, later.username, later.address, later.model) == (
        "Alma",
        read.username,
        entered.address,
        "MiR250",
    )
    assert later.token == Token.derive(read.username, "new").header
    assert not later.needs_password


def test_a_name_that_says_what_it_does_follows_a_change_of_the_robot(world):
    catalogue, read = world.catalogue, world.catalogue.save_schedule(replace(world.schedule(), name=""))
    other = catalogue.save_robot(Robot("Sisu", "http://10.0.0.9", "distributor"), "secret")
    assert catalogue.change(read, replace(read, robot_id=other.id)).name == f"{world.mission.name} on Sisu"
    typed = catalogue.change(read, replace(read, name="Early"))
    assert catalogue.change(typed, replace(typed, robot_id=read.robot_id)).name == "Early"


def test_a_changed_schedule_gets_no_parameters_that_its_robot_refuses(world):
    read, asked = world.schedule(), (MissionParameter("battery", choices=(("high", "High"),)),)
    world.catalogue.parameters = SimpleNamespace(known_from_any=lambda _robot, _guid: asked)
    with refuses("parameters", "low"):
        world.catalogue.change(read, replace(read, parameters={"battery": "low"}))


def test_a_change_of_an_idle_rule_is_undone_alone_and_only_as_long_as_it_is_so(world, home):
    catalogue = world.catalogue
    before = catalogue.change_idle_rule(world.robot.id, mission_id=world.mission.id, after_minutes=10).idle
    catalogue.change_idle_rule(world.robot.id, mission_id=home.id)
    catalogue.change_idle_rule(world.robot.id, after_minutes=20)
    undone = catalogue.idle_rule_back(world.robot.id, before, {"mission_id": home.id}).idle
    assert (undone.mission_id, undone.after_minutes) == (world.mission.id, 20)
    with refuses("name", "Aino was changed again, so nothing is undone"):
        catalogue.idle_rule_back(world.robot.id, before, {"mission_id": home.id})
    new = {"mission_id": world.mission.id}
    assert not catalogue.idle_rule_back(world.robot.id, None, new).idle.enabled
