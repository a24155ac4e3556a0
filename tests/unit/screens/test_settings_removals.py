"""What goes with a mission, a robot or a group that is deleted, as the question and the message say it."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

from app.domain.models import Group, IdleRule, Mission, Robot, Schedule
from app.screens.common.mission_names import MissionNames
from app.screens.settings import removals
from app.screens.settings.facts import SettingsFacts

AINO, SISU = (
    Robot("Aino", "http://10.40.12.21", "scheduler", id=1, idle=IdleRule(11, 15)),
    Robot("Sisu", "https://sisu", "scheduler", id=2),
)
DELIVER, CHARGE = Mission("Deliver kits", "guid-deliver", id=10), Mission("Charge", "guid-charge", id=11)
COILS = Mission("Coils", "guid-coils", id=12, robot_id=2)
MORNING = Schedule("", 1, 10, datetime(2026, 11, 23, 6, 30), "Europe/Helsinki", id=20)
HALL = Group("Hall 1", (1, 2), id=1)


def facts(**values):
    return SettingsFacts(
        **{"robots": (AINO, SISU), "missions": (DELIVER, CHARGE, COILS), "schedules": (MORNING,), **values}
    )


def test_a_mission_takes_its_schedules_and_idle_rules_along():
    assert removals.mission_question(facts(), COILS) == ""
    assert removals.mission_question(facts(), CHARGE) == "This goes with it: idle automation on Aino."
    assert removals.mission_question(facts(), DELIVER).splitlines() == [
        "This schedule goes with it:",
        "Deliver kits on Aino",
    ]
    both = facts(schedules=(MORNING, replace(MORNING, id=21, mission_id=11, name="Night")))
    assert removals.mission_question(both, CHARGE).splitlines() == [
        "This schedule goes with it:",
        "Night",
        "",
        "This goes with it: idle automation on Aino.",
    ]


def test_schedules_of_one_mission_differ_by_their_values():
    dock = "a1c4e008-5d0f-11ef-93c1-0001297b6e20"
    known = facts(
        schedules=(replace(MORNING, parameters={"goal": dock}),), mission_names=MissionNames(names={dock: "Dock 3"})
    )
    assert removals.mission_question(known, DELIVER).splitlines()[1] == "Deliver kits · Dock 3 on Aino"


def test_users_of_a_robots_mission_continue_with_that_for_all():
    used = facts(
        missions=(COILS, replace(COILS, id=13, robot_id=None)), schedules=(replace(MORNING, robot_id=2, mission_id=12),)
    )
    assert removals.mission_question(used, COILS) == ""


def test_a_robot_names_its_schedules_and_groups_as_far_as_they_can_be_read():
    many = tuple(replace(MORNING, id=20 + n, name=f"Round {n}") for n in range(9))
    question = removals.robot_question(
        facts(schedules=many, groups=(HALL, Group("Hall 2", (2,), id=2))), AINO
    ).splitlines()
    assert question[0] == "These 9 schedules go with it:"
    assert question[1:8] == [*(f"Round {n}" for n in range(6)), "and 3 more"]
    assert question[9:11] == ["This goes with it: its idle automation.", "It leaves the group Hall 1."]
    assert not any("No robot is left" in line for line in question)


def test_a_robot_says_which_group_is_empty_without_it():
    night = Group("Night", (AINO.id,), id=2)
    question = removals.robot_question(facts(groups=(HALL, night)), AINO).splitlines()
    assert question[-3:-1] == [
        "It leaves the groups Hall 1, Night.",
        "No robot is left in Night: starts that wait for one are cancelled.",
    ]


def test_a_group_names_its_schedules_and_what_waits():
    hall_facts = facts(schedules=(replace(MORNING, robot_id=None, group_id=1),), groups=(HALL,))
    assert removals.group_question(hall_facts, HALL, waiting=2).splitlines() == [
        "This schedule goes with it:",
        "Deliver kits on Hall 1",
        "",
        "2 starts that wait for one of its robots are cancelled.",
        "Its robots stay, and running missions continue.",
    ]
