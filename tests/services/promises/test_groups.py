"""Starts that any robot of a group may take: kept until one is free, given to one, and never to two."""

from __future__ import annotations

import sqlite3
from dataclasses import replace
from datetime import timedelta
from functools import partial
from itertools import pairwise

import pytest

from app.domain.choice import chosen, earlier_robots, stuck, stuck_since
from app.domain.execution import Trigger
from app.domain.models import Overlap, Place
from app.services.catalogue import group_edit
from tests.services.story import *

GroupStory = partial(Story, on="group", robots=3)
ABC = [plan(name) for name in "ABC"]
HOME = do(lambda s: s.add_mission("Home"))
LONG = plan(window=30)
FALLS_SILENT = do(lambda s: s.network.down.add(s.row().robot))
ALL_ANSWERS_LOST = [post(ANSWER_LOST, robot=name) for name in ("R1", "R2", "R3")]
ALL_LOST = [post(LOST, robot=name) for name in ("R1", "R2", "R3")]
NO_MORE_PLANNED = do(lambda s: s.network.planned.clear())


def lacks_mission(*names):
    return do(lambda s: [s.lose_mission(name) for name in names])


def one(state, robot=None):
    """The one start is in that state, on that robot or on any."""
    return true(
        lambda s: (
            [(r.state, bool(r.robot) if robot is None else r.robot) for r in s.executions()]
            == [(state, robot is None or robot)]
        )
    )


test_assigned = cases_of(
    GroupStory(
        "to a free robot at its instant",
        [plan(), 310, one(EXECUTING), runs(1)],
        true(
            lambda s: (
                (s.row().robot_group, s.row().submitted_at - s.row().planned_at < timedelta(seconds=0.5))
                == ("Hall", True)
            )
        ),
        200,
    ),
    GroupStory(
        "at one instant to different robots",
        [ABC, 310, true(lambda s: {r.robot for r in s.executions()} == {*s.machines}), 200],
    ),
    GroupStory(
        "an extra start waits for the first free robot",
        [
            ABC,
            plan("D"),
            303,
            waits(Wait.ROBOT),
            true(lambda s: s.executions(WAITING)[0].wait_details["group"] == "Hall"),
        ],
        [400, ends(DONE, DONE, DONE, DONE), runs(4)],
    ),
    GroupStory(
        "to another robot if the first refuses the connection",
        [plan(), 295, down("R1"), 60, runs(1), true(lambda s: s.row().robot in ("R2", "R3")), 200],
    ),
    GroupStory(
        "to no other while an answer is open",
        [POLLED_OFTEN, plan()],
        each([ALL_LOST, 340], [ALL_ANSWERS_LOST, 340], [ALL_ANSWERS_LOST, 300, FALLS_SILENT, off_for(), 32, up()]),
        [true(lambda s: s.row().robot_id), 700, ends(DONE), runs(1)],
    ),
    GroupStory(
        "to the others if one lacks the mission",
        plan(),
        each(
            [lacks_mission("R1"), 330, true(lambda s: s.row().robot in ("R2", "R3"))],
            [lacks_mission("R2"), 330, true(lambda s: s.row().robot in ("R1", "R3"))],
        ),
        [runs(1), 200],
        mark=OWN_MISSIONS,
    ),
    GroupStory(
        "to none if all refuse, and it says why",
        [plan(), lacks_mission("R1", "R2", "R3"), 330, ends((FAILED, ReasonCode.UNKNOWN_MISSION))],
        mark=OWN_MISSIONS,
    ),
    GroupStory(
        "to another if its robot is switched off a moment before",
        [plan(), 299.8, robot_off("R1", "R2"), 60, one(EXECUTING, "R3"), 200],
    ),
    GroupStory(
        "to none while all are held, and to the one that is released",
        [plan(), [hold(name) for name in ("R1", "R2", "R3")], 330, waits(Wait.ROBOT), robots("")],
        true(lambda s: {robot["out"] for robot in s.row().wait_details["robots"]} == {"held"}),
        [do(lambda s: s.container.holds.release(2)), 10, robots("R2"), 200],
    ),
    GroupStory(
        "at the last call into a queue",
        [
            plan(window=2),
            all_busy(30),
            410,
            states(WAITING),
            12,
            states(QUEUED),
            true(lambda s: s.row().choice["last_call"]),
        ],
        [8, true(lambda s: timedelta(seconds=4.5) < s.row().closes_at - s.row().submitted_at <= timedelta(seconds=5))],
        stays_open=True,
    ),
    GroupStory(
        "one after the other if its schedule queues, and the later one says what it waits for",
        [plan(every=1, overlap=Overlap.QUEUE, workdays=False, window=30), 370],
        true(lambda s: s.executions()[1].robot_id is None),
        true(lambda s: s.executions()[1].wait_details["before"] == s.executions()[0].planned_at.isoformat()),
        [600, true(lambda s: len([r for r in s.executions() if r.submitted_at]) > 3)],
        true(
            lambda s: all(
                a.ended_at <= b.submitted_at for a, b in pairwise(r for r in s.executions() if r.submitted_at)
            )
        ),
        stays_open=True,
    ),
    GroupStory(
        "after crashes at any time, once",
        [plan(), [[seconds, off_for(2)] for seconds in (301, 1, 5, 30)], 600, ends(DONE), runs(1)],
    ),
    GroupStory(
        "as defined when its robot is assigned, even if it was edited after the decision",
        [
            HOME,
            plan(),
            [hold(name) for name in ("R1", "R2", "R3")],
            310,
            edit(mission_id=2),
            release(),
            30,
            did("Home"),
        ],
        [true(lambda s: s.row().mission == "Home"), 200],
    ),
    GroupStory(
        "to a robot that drives to its charger, once it charges",
        [do(lambda s: s.add_mission("Return to charger"))],
        do(
            lambda s: [
                s.container.catalogue.change_idle_rule(number, mission_id=2, after_minutes=5) for number in (1, 2, 3)
            ]
        ),
        [plan(at="06:40"), 2405],
        true(
            lambda s: (
                [
                    r.submitted_at - r.planned_at < timedelta(seconds=3)
                    for r in s.executions()
                    if r.trigger is Trigger.SCHEDULED
                ]
                == [True]
            )
        ),
        stays_open=True,
        mark=SHOWS_CHARGING,
    ),
    GroupStory(
        "the choice names the advantage over other free robots",
        [[plan(f"{minute}", f"06:{minute:02}") for minute in (5, 20, 35)], 2200],
        true(lambda s: chosen(s.row("5").choice, "UTC") == "R1: free now · R2: free now · R3: free now"),
        true(
            lambda s: (
                chosen(s.row("35").choice, "UTC") == "R3: free now, has run less today · R1: free now · R2: free now"
            )
        ),
    ),
)


def test_the_database_lets_no_start_change_from_one_robot_to_another(group):
    play(group, plan(), 310)
    with pytest.raises(sqlite3.IntegrityError, match="by way of none"):
        group.container.db.write(lambda c: c.execute("UPDATE executions SET robot_id = ?", (group.row().robot_id + 1,)))
    with pytest.raises(sqlite3.IntegrityError, match="needs a robot"):
        group.container.db.write(lambda c: c.execute("UPDATE executions SET robot_id = NULL"))


# ---------------------------------------------------------------------- by hand
WAITS = [HOME, all_busy(5), LONG, 310]
STUCK = [plan(window=3), ALL_LOST, 301, NO_MORE_PLANNED, do(lambda s: s.network.down.add(s.row().robot)), 60]
GIVEN_TO_R3 = [all_busy(5), plan(window=30, battery=30), 310, battery(10, "R3"), 10, give("R3"), 10, robots("R3")]
IT_STAYS = [20, robots("R3"), waits(BATTERY), true(lambda s: s.row().choice["by"] == "person")]
R3_LEAVES = do(lambda s: s.container.catalogue.save_group(replace(s.group, members=(1, 2))))
AS_ADMIN = do(lambda s: s.container.catalogue.save_robot(replace(s.robot("R3"), username="admin"), password="admin"))


@step
def first(s, name, priority):
    s.container.operator.prioritise(s.row(name).id, priority)


@step
def instead(s, name=None):
    robot_id = name and s.robot(name).id
    s.noted.append(s.container.operator.start_on_another(s.executions()[0].id, robot_id))
    s.kick()


test_by_hand = cases_of(
    GroupStory(
        "assigned to a robot it goes into its queue",
        [
            WAITS,
            give("R3"),
            5,
            one(QUEUED, "R3"),
            true(lambda s: chosen(s.row().choice, "UTC") == "R3: chosen by a person"),
        ],
        [refused(give("R2"), "no longer waits for a robot"), 900, ends(DONE)],
    ),
    GroupStory(
        "put before others it gets the first free robot",
        [all_busy(5), LONG, plan("B", window=30), 310, first("B", 1), do(lambda s: s.cancel_all()), 5],
        [
            true(lambda s: (s.row("B").robot, s.row("A").robot) == ("R1", "")),
            refused(first("B", 0), "no longer waits"),
            900,
        ],
    ),
    GroupStory(
        "the robot that a person chose gets it like its own start",
        [all_busy(5), plan(window=30, battery=30), 310],
        each(
            [battery(80, "R3"), robot_pauses("R3"), 10, give("R3"), 30, one(QUEUED, "R3")],
            [battery(10, "R3"), 10, give("R3"), 30, one(WAITING, "R3"), waits(BATTERY)],
        ),
        stays_open=True,
    ),
    GroupStory(
        "an impossible assignment is refused",
        WAITS,
        each(
            [hold("R3"), refused(give("R3"), "R3 is on hold")],
            [robot_off("R3"), refused(give("R3"), "R3 is switched off")],
            [R3_LEAVES, refused(give("R3"), "R3 is no robot of Hall")],
            [keep(), refused(give("R3"), "no longer waits for a robot")],
        ),
        stays_open=True,
    ),
    GroupStory(
        "nor while its place is full",
        do(lambda s: s.container.catalogue.edit(lambda edit: group_edit.save_place(edit, Place("Dock 2", 1, (1,))))),
        [plan("B", window=30), 310, plan(at="06:06", window=30), 60, refused(give("R3"), "Dock 2 is full: ")],
        stays_open=True,
    ),
    GroupStory(
        "the robot that a person chose stays the one",
        GIVEN_TO_R3,
        each([hold("R3"), 5, release()], off_for()),
        IT_STAYS,
        stays_open=True,
    ),
    GroupStory(
        "it stays the one with another user and password",
        [GIVEN_TO_R3, AS_ADMIN, IT_STAYS],
        stays_open=True,
        mark=OWN_ADDRESS,
    ),
    GroupStory(
        "unless that robot can take no starts",
        GIVEN_TO_R3,
        each(robot_off("R3"), R3_LEAVES),
        [20, robots(""), true(lambda s: s.row().choice == {})],
        stays_open=True,
    ),
    GroupStory(
        "a stuck start says so, and goes to no other",
        [STUCK, do(lambda s: s.noted.append(s.row()))],
        true(
            lambda s: (
                stuck(s.row().robot, stuck_since(s.row(), s.container.snapshots.get(s.row().robot_id)), "UTC")
                == f"{s.row().robot} may have it, no answer since 06:05: it goes to no other robot"
            )
        ),
        [600, ends(UNKNOWN), true(lambda s: len(s.network.posts()) == 1)],
    ),
    GroupStory(
        "a stuck start is run on another robot as a separate start",
        STUCK,
        each([], 600),
        each(instead(), instead("R3")),
        30,
        true(lambda s: s.row("").state is EXECUTING and s.row("").robot != s.executions()[0].robot),
        stays_open=True,
    ),
    GroupStory(
        "the same robot does not count as another one",
        [
            STUCK,
            refused(
                do(lambda s: s.container.operator.start_on_another(s.row().id, s.row().robot_id)),
                "choose another robot",
            ),
        ],
        stays_open=True,
    ),
    GroupStory(
        "a start with a known outcome is not started again",
        [plan(), 310, refused(instead(), "its outcome is known already"), 200],
    ),
    GroupStory(
        "a start that changed robots names the earlier ones",
        [plan(), 299.9, post(REFUSED, robot="R1"), 30, robots("R2")],
        true(lambda s: earlier_robots(s.row().tried, "R2").startswith("R1 refused the connection")),
        [true(lambda s: earlier_robots(s.row().tried, "R2").endswith(" · assigned to R2")), 200],
    ),
)
