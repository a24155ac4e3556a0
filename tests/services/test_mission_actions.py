"""A mission that brings the robot to its charger starts on a low battery, which is the one moment it is for; others wait."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Connection, Mission, Robot
from tests.support.network import Fate
from tests.support.seen import robot_of, sent_at
from tests.support.site import GUIDS


@pytest.fixture
def low(site):
    """R1 has 12 %, 20 % are wanted, and after 5 minutes of rest it is sent to its charger."""
    catalogue = site.container.catalogue
    catalogue.change_settings(minimum_battery_percent=20, poll_interval_seconds=30)
    site.machines["R1"].set_battery(12.0)
    mission = catalogue.save_mission(Mission("Return to charger", GUIDS["Return to charger"]))
    catalogue.change_idle_rule(robot_of(site).id, mission_id=mission.id, after_minutes=5)
    site.run(60)
    return site


def learn(site):
    charging = site.container.mission_actions
    charging.ask(charging.to_ask())


@pytest.fixture
def learnt(low):
    """What its missions do is known."""
    learn(low)
    return low


def named(site, name="Return to charger"):
    return next(mission for mission in site.container.catalogue.missions() if mission.name == name)


def test_a_robot_with_a_low_battery_is_sent_to_its_charger(learnt):
    learnt.run(600)
    assert named(learnt).charges
    assert len(sent_at(learnt)) == 1


def test_while_it_is_unknown_that_it_charges_it_waits_for_the_battery(low):
    low.run(600)
    assert sent_at(low) == []
    learn(low)
    low.run(60)
    assert len(sent_at(low)) == 1


def test_a_mission_that_delivers_waits_for_the_battery(low):
    catalogue = low.container.catalogue
    mission = named(low, "Deliver")
    catalogue.change_idle_rule(robot_of(low).id, mission_id=mission.id, after_minutes=5)
    learn(low)
    low.run(600)
    assert (named(low, "Deliver").charges, sent_at(low)) == (False, [])
    catalogue.save_mission(replace(mission, on_low_battery=True))
    low.run(60)
    assert len(sent_at(low)) == 1


def test_a_schedule_of_it_is_not_held_up_either(learnt, plan):
    learnt.container.catalogue.change_idle_rule(
        robot_of(learnt).id, mission_id=named(learnt).id, after_minutes=5, enabled=False
    )
    plan("2026-11-23T06:05", mission_id=named(learnt).id)
    learnt.run(400)
    assert len(sent_at(learnt)) == 1


def test_a_robot_that_does_not_answer_is_asked_again_and_none_twice(low):
    charging = low.container.mission_actions
    low.network.down.add("R1")
    [(_robot, guids)] = charging.to_ask()
    assert guids == [GUIDS["Return to charger"]]
    learn(low)
    low.network.down.clear()
    assert len(charging.to_ask()) == 1
    learn(low)
    assert charging.to_ask() == []


def test_a_robot_without_an_answer_changes_nothing_and_is_asked_again(learnt):
    learnt.switch_off()
    learnt.switch_on()
    learnt.run(60)
    learnt.network.next("GET", "/missions/" + named(learnt).guid, Fate.NOT_FOUND)
    learn(learnt)
    assert named(learnt).charges
    assert learnt.container.mission_actions.to_ask() == []
    learnt.run(700)
    assert len(sent_at(learnt)) == 1
    assert len(learnt.container.mission_actions.to_ask()) == 1


def test_what_is_known_of_a_guid_holds_for_every_mission_with_it(learnt):
    guid = named(learnt).guid
    other = learnt.container.catalogue.save_mission(replace(named(learnt), guid=GUIDS["Deliver kits to line 2"]))
    assert not other.charges
    learnt.container.catalogue.save_mission(replace(other, guid=guid))
    learn(learnt)
    assert named(learnt).charges


def test_as_many_robots_as_there_are_take_one_look_at_the_plan(low):
    catalogue, mission = low.container.catalogue, named(low)
    for number in range(50):
        robot = catalogue.save_robot(Robot(f"More {number}", f"10.0.1.{number}", "user"), "secret")
        catalogue.change_idle_rule(robot.id, mission_id=mission.id, enabled=number < 20)
        low.container.snapshots.update(robot.id, connection=Connection.CONNECTED)
    asked: list[str] = []
    low.container.db.read().set_trace_callback(asked.append)
    wanted = low.container.mission_actions.to_ask()
    low.container.db.read().set_trace_callback(None)
    assert (len(wanted), {guid for _robot, guids in wanted for guid in guids}) == (21, {mission.guid})
    assert len(asked) <= 3
