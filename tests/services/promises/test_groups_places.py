"""Places where only so many missions of this app may be at a time, and idle missions that leave robots free for starts of their group."""

from __future__ import annotations

from datetime import timedelta
from functools import partial

from app.domain.activity import is_charging
from app.domain.execution import Trigger
from app.domain.models import Group, Place
from app.domain.reasons import waiting_sentence
from app.services.catalogue import group_edit
from tests.services.story import *

GroupStory = partial(Story, on="group", robots=3)
HOME = do(lambda s: s.add_mission("Home"))
ABC = [plan(name) for name in "ABC"]
LONG = plan(window=30)
ALL_LOST = [post(LOST, robot=name) for name in ("R1", "R2", "R3")]
NO_MORE_PLANNED = do(lambda s: s.network.planned.clear())


def dock(most=1):
    """ "Deliver" uses a place with room for so many; "Home" does not."""
    return [
        HOME,
        do(lambda s: s.container.catalogue.edit(lambda edit: group_edit.save_place(edit, Place("Dock 2", most, (1,))))),
    ]


@step
def never_more_at_the_dock(s, most):
    for _n in range(60):
        s.run(10)
        there = [row for row in s.executions(SUBMITTING, QUEUED, EXECUTING) if row.mission == "Deliver"]
        assert len(there) <= most


test_places = cases_of(
    GroupStory("not more than there is room for", [dock(2), ABC, never_more_at_the_dock(2), ends(DONE, DONE, DONE)]),
    GroupStory(
        "starts of one robot respect them too",
        dock(),
        each([plan(on=1), plan("B")], [plan(), plan("B", on=1)]),
        [never_more_at_the_dock(1), ends(DONE, DONE)],
    ),
    GroupStory(
        "two robots at one instant share one",
        [dock(), plan(on=1), plan("B", on=2), 302, waits(Wait.PLACE), 400, ends(DONE, DONE)],
    ),
    GroupStory(
        "a start that waits for a place blocks no robot and names the occupant",
        [
            dock(),
            plan(),
            303,
            plan("B", "06:06"),
            plan("C", "06:06", mission_id=2),
            plan("D", "06:06", mission_id=2),
            65,
        ],
        true(lambda s: (s.row("B").wait, s.row("B").wait_details["robot"]) == (Wait.PLACE, s.row("A").robot)),
        true(lambda s: "Waits for Dock 2: " in waiting_sentence(s.row("B"))),
        true(lambda s: {s.row("C").state, s.row("D").state} <= {EXECUTING, COMPLETED}),
        stays_open=True,
    ),
    GroupStory(
        "an unknown outcome keeps it occupied",
        [dock(), LONG, ALL_LOST, 303, NO_MORE_PLANNED, plan("B", "06:06"), 80],
        true(lambda s: (s.row("A").state, s.row("B").wait) == (SUBMITTING, Wait.PLACE)),
        stays_open=True,
    ),
    GroupStory(
        "if it stays full the start ends",
        [
            dock(),
            plan(window=60),
            301,
            do(lambda s: s.machines[s.row().robot].pause()),
            plan("B", "06:06", window=1),
            130,
        ],
        true(lambda s: s.row("B").reason.code is ReasonCode.PLACE_BUSY),
        stays_open=True,
    ),
    GroupStory(
        "another group shares it",
        [dock(), do(lambda s: s.container.catalogue.edit(lambda edit: group_edit.save(edit, Group("Yard", (3,)))))],
        [plan(), plan("B", group_id=2), 303, waits(Wait.PLACE)],
        true(lambda s: len(s.executions(SUBMITTING, QUEUED, EXECUTING)) == 1),
        true(lambda s: s.executions(WAITING)[0].wait_details["until"].endswith(":00+00:00")),
        stays_open=True,
    ),
    GroupStory(
        "it stays occupied when the mission there is renamed",
        [dock(), plan(), plan("B", "06:06"), 320, mission(name="Deliver kits"), 45],
        true(lambda s: (s.row("A").state, s.row("B").wait) == (EXECUTING, Wait.PLACE)),
        stays_open=True,
    ),
    GroupStory(
        "a start that a person assigned to a robot that can't begin occupies none",
        [dock(), robot_off("R2", "R3"), stranger(count=9), plan(window=60, battery=50), 305, battery(20, "R1"), 10],
        [give("R1"), 10, waits(BATTERY), robot_on("R2"), plan("B", "06:07"), 110],
        true(lambda s: (s.row("B").state, s.row("B").robot) == (EXECUTING, "R2")),
        stays_open=True,
    ),
)

# ---------------------------------------------------------------------- idle missions
CHARGERS = [
    do(lambda s: s.add_mission("Return to charger")),
    [battery(60, "R1"), battery(90, "R2"), battery(80, "R3")],
    do(
        lambda s: [
            s.container.catalogue.change_idle_rule(number, mission_id=2, after_minutes=5) for number in (1, 2, 3)
        ]
    ),
]


def went(*names):
    """To their chargers."""
    return true(lambda s: {row.robot for row in s.executions() if row.trigger is Trigger.IDLE} == set(names))


test_idle = cases_of(
    GroupStory(
        "as many of the best placed robots stay free as there are starts soon",
        CHARGERS,
        each(
            [plan(at="06:11"), 540, went("R1", "R3")],
            [plan(at="06:11"), plan("B", "06:11"), 540, went("R1")],
            [[plan(name, "06:11") for name in "ABC"], 540, went()],
            [plan(at="06:30"), 540, went("R1", "R2", "R3")],
            [plan(at="06:11"), pause(1440), 540, went("R1", "R2", "R3")],
        ),
        now=BEGIN + timedelta(minutes=1),
        stays_open=True,
    ),
)


@SHOWS_CHARGING
def test_a_robot_that_charges_while_it_is_idle_is_foreseen_for_a_start(tmp_path):
    """It usually charges for an hour; a start of its group takes it away from there at once."""
    s = Stage(tmp_path, "group", 3, now=BEGIN + timedelta(minutes=1))
    play(s, CHARGERS, mission("Return to charger", usual_minutes=60), robot_off("R2", "R3"))
    s.run_until(lambda: is_charging(s.container.snapshots.get(1).status))
    play(s, plan(at=f"{s.clock.now() + timedelta(minutes=3):%H:%M}", window=5))
    [run] = s.container.plan.next(1)
    assert (run.robot.name, run.begins) == ("R1", run.at)
    play(s, 240, true(lambda s: s.row("A").robot == "R1"))
    s.switch_off()
