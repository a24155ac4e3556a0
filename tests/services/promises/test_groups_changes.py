"""What people change while starts of a group wait, or are on their way: nothing is lost, and nothing kept from other robots."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from functools import partial

import pytest

from app.domain.models import HandOver, Mission, Overlap
from app.domain.reasons import sentence
from app.services.live.alarms import alarm_sentence
from app.services.live.changes import Topic
from tests.services.story import *

GroupStory = partial(Story, on="group", robots=3)
LONG = plan(window=30)
ALL_HELD = [hold(name) for name in ("R1", "R2", "R3")]
ELSEWHERE = true(lambda s: s.row("A").state is EXECUTING and s.row("A").robot != s.noted[0].robot)
NONE_OF = true(lambda s: s.network.posts(s.noted[0].robot) == [])
NO_ROBOT_ON = true(lambda s: sentence(s.row().reason, "UTC") == "No robot of Hall is switched on")


def of_its_robot(act):
    """Of the robot that the start was given to."""
    return do(lambda s: act(s, s.robot(s.noted[0].robot)))


HOLD_IT = of_its_robot(lambda s, robot: s.hold(robot.name))
SWITCH_IT_OFF = of_its_robot(lambda s, robot: s.switch(robot.name, on=False))
STOP_IT = of_its_robot(lambda s, robot: (s.machines[robot.name].pause(), s.clock.advance(2.5)))
IT_LEAVES = of_its_robot(
    lambda s, robot: s.container.catalogue.save_group(
        replace(s.group, members=tuple(key for key in s.group.members if key != robot.id))
    )
)
# Robots with a line of their own look again before they begin with what they were given.
LOOK_AGAIN = do(
    lambda s: [
        s.container.catalogue.save_robot(replace(robot, hand_over=HandOver.WHEN_FREE))
        for robot in s.container.catalogue.robots()
    ]
)


def just_assigned(*steps):
    """These happen when the start has just been given to a robot, which has not begun with it."""
    return [LOOK_AGAIN, when_assigned(*steps), LONG]


test_assigned_and_not_begun = cases_of(
    GroupStory(
        "held by a person it blocks no robot",
        [just_assigned(do(lambda s: s.container.operator.hold_starts([s.noted[0].id]))), 310, robots(""), waits(HOLD)],
        [
            [plan(name, "06:07") for name in "BCD"],
            120,
            true(lambda s: [s.row(n).state for n in "BCD"] == [EXECUTING] * 3),
        ],
        stays_open=True,
    ),
    GroupStory(
        "a held robot gives it back without counting an attempt",
        [just_assigned(HOLD_IT), 310, states(EXECUTING), tries(1)],
        [true(lambda s: all(not each["tries"] for each in s.row().tried.values())), 200],
    ),
    GroupStory(
        "a robot that was stopped since it was chosen gives it back", [just_assigned(STOP_IT), 330, ELSEWHERE, 200]
    ),
    GroupStory(
        "after its schedule is deleted and restored it is for all robots",
        [just_assigned(delete()), 302, HOLD_IT, undo(), 20, ELSEWHERE, 200],
    ),
    GroupStory(
        "edited after the choice it is sent as defined then",
        [do(lambda s: s.add_mission("Home")), when_assigned(before=[edit(mission_id=2)]), LONG, 310, did("Home")],
        [true(lambda s: s.row().mission == "Home"), 200],
    ),
    GroupStory(
        "nothing is sent to a robot that may no longer get it",
        each([when_assigned(states(SUBMITTING), SWITCH_IT_OFF)], [when_assigned(states(SUBMITTING), IT_LEAVES)]),
        [LONG, 330, states(EXECUTING), NONE_OF, 200],
    ),
    GroupStory(
        "it is not lost when its robot is deleted",
        [when_assigned(states(SUBMITTING), delete("robot")), LONG, 330, states(EXECUTING)],
        [true(lambda s: len(s.network.posts()) == 1), 200],
    ),
)


@pytest.mark.parametrize("cleanly", [True, False])
@OWN_NETWORK
def test_an_assigned_start_is_for_all_again_after_a_restart(group, cleanly):

    def crash(group):
        group.network.down |= {group.noted[0].robot}
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        play(group, just_assigned(do(crash)), 310)
    play(group, app_off(cleanly), app_on(), robots(""), 30, states(EXECUTING))


# ---------------------------------------------------------------------- while it waits
test_waiting = cases_of(
    GroupStory(
        "it ends when all robots are switched off",
        [LONG, ALL_HELD, 310, robot_off("R1", "R2", "R3"), 10, ends(REMOVED)],
    ),
    GroupStory(
        "with no robot switched on it says so",
        [plan(), robot_off("R1", "R2", "R3"), 310, states(State.CANCELLED), NO_ROBOT_ON],
    ),
    GroupStory(
        "another mission is tried after the first was refused",
        [do(lambda s: (s.add_mission("Home"), s.lose_mission("R1"))), LONG, hold("R2"), hold("R3"), 320],
        [true(lambda s: s.row().tried["1"]["is_for_good"]), edit(mission_id=2), 20, robots("R1"), did("Home"), 200],
    ),
    GroupStory(
        "its mission gets another name",
        [LONG, ALL_HELD, 310, mission(name="Bring"), do(lambda s: s.container.holds.release(1)), 20, robots("R1")],
        [true(lambda s: s.row().mission == "Bring"), 200],
    ),
    GroupStory(
        "it fails with the last refusal, and each one is reported",
        do(lambda s: (s.lose_mission("R2"), s.lose_mission("R3"))),
        do(
            lambda s: s.container.catalogue.save_mission(
                Mission("Deliver", "3d7c7c40-ce85-11ef-904a-000e8e9884ec", robot_id=1)
            )
        ),
        [hold("R2"), hold("R3"), LONG, 320],
        true(
            lambda s: alarm_sentence(s.container.alarms.open()[0]).startswith(
                "R1 did not take Deliver, others of Hall may take it: There is no mission Deliver"
            )
        ),
        [
            do(lambda s: s.container.holds.release(2)),
            20,
            do(lambda s: s.container.holds.release(3)),
            20,
            states(FAILED),
        ],
        true(lambda s: s.row().reason.details["robot"] == "R3"),
        mark=OWN_MISSIONS,
    ),
    GroupStory(
        "a robot whose connection is renewed is read as often as the others",
        [robot_off("R2", "R3"), LONG, hold("R1"), 310],
        do(
            lambda s: s.container.catalogue.save_robot(
                replace(s.robot("R1"), certificate_sha256=None, username="admin"), password="admin"
            )
        ),
        [0.5, release(), 4, true(lambda s: s.row().state is not WAITING), 200],
        mark=OWN_ADDRESS,
    ),
    GroupStory(
        "in doubt it is not listed as waiting",
        [plan(window=30, overlap=Overlap.PARALLEL), [post(LOST, robot=name) for name in ("R1", "R2", "R3")], 320],
        [states(SUBMITTING), true(lambda s: s.row().robot != "")],
        stays_open=True,
    ),
    GroupStory(
        "a Run now of a group that is deleted and restored waits again",
        [
            ALL_HELD,
            30,
            run_now(),
            3,
            true(lambda s: s.container.catalogue.waiting_for(s.group.id) == 1),
            delete("group"),
            3,
        ],
        [true(lambda s: sentence(s.row().reason, "UTC") == "The group Hall was removed"), undo(), release(), 20],
        [states(EXECUTING), 200],
    ),
    GroupStory(
        "a start that waits for the only robot is restored with it",
        [robot_off("R2", "R3"), hold("R1"), plan(window=60), 310, delete("robot"), 3, NO_ROBOT_ON],
        [undo(), release(), 20, states(EXECUTING), 200],
    ),
    GroupStory(
        "a robot's run continues when its group is deleted",
        [run_now(), 5, true(lambda s: s.container.catalogue.waiting_for(s.group.id) == 0), delete("group")],
        [until(lambda s: s.executions(COMPLETED)), ends(DONE)],
    ),
    Story(
        "no robot is kept for a planned start that is paused",
        plan("own", "06:06", on=1, priority=2),
        each(
            [
                do(lambda s: s.container.pausing.pause(1, s.clock.now() + timedelta(hours=1))),
                plan(),
                320,
                states(EXECUTING),
            ],
            [plan(), 320, states(WAITING), true(lambda s: s.row().wait_details.get("kept_for") == "Deliver")],
        ),
        on="group",
        stays_open=True,
    ),
    GroupStory(
        "a robot whose clock was set during a run is no worse than the others that day",
        [robot_off("R3"), plan(), until(lambda s: s.executions(EXECUTING)), do(lambda s: s.noted.append(s.row()))],
        of_its_robot(lambda s, robot: setattr(next(iter(s.queue(robot.name))), "started", "2016-11-23T06:05:00")),
        [240, true(lambda s: s.row().duration_s > 9 * 365 * DAY)],
        of_its_robot(
            lambda s, robot: [s.stranger_queues(robot={"R1": "R2", "R2": "R1"}[robot.name]) for _n in range(5)]
        ),
        [plan("B", "06:12"), do(lambda s: s.run(740 - s.seconds()))],
        true(lambda s: (s.row("B").state, s.row("B").robot) == (EXECUTING, s.noted[0].robot)),
        stays_open=True,
    ),
)


def test_what_waits_does_not_wake_everybody(group):
    """A changed sentence alone sends no message to a worker and no question about withdrawn starts."""
    seen = []
    group.container.changes.subscribe(lambda topic, about: seen.append(about) if topic is Topic.EXECUTIONS else None)
    play(group, ALL_HELD, [plan(name) for name in "ABCDE"])
    before = group.engine.plan_version
    group.run(310)
    group.engine.advance()
    assert {row.wait for row in group.executions()} == {Wait.ROBOT}
    assert None not in seen
    assert group.engine.plan_version <= before + 2


@pytest.mark.parametrize("what", ["schedule", "group", "mission"])
def test_a_made_name_of_a_group_that_comes_back_is_made_again_where_it_is_taken(group, what):
    catalogue, schedule = group.container.catalogue, group.plan("")
    assert catalogue.save_schedule(replace(schedule, name="")).name == schedule.name == "Deliver on Hall"
    play(group, delete(what))
    assert set(group.removed[0].made_names) == {schedule.id}
    other = group.add_mission("Collect empties")
    catalogue.save_schedule(
        replace(schedule, id=0, group_id=None, robot_id=1, mission_id=other.id, name="Deliver on Hall")
    )
    play(group, undo())
    assert (
        group.container.repositories.schedules.get(group.container.db.read(), schedule.id).name == "Deliver on Hall 2"
    )
