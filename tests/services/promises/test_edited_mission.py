"""A mission, or the one that a robot has of its own, is edited while a start of it waits or is in doubt: that runs as it is then."""

from __future__ import annotations

from mir_sim import MISSIONS
from tests.services.story import *

BOTH = ("robot", "group")
IN_DOUBT = [post(LOST), 306]
GIVEN_TO_R1 = [plan(window=60, battery=30), down(), 300.5, give("R1"), up()]
RESTING = [do(lambda s: s.add_mission("Home")), set_up(poll_interval_seconds=120), rest()]

test_a_mission_edited = cases_of(
    Story(
        "a start that waits or is in doubt follows it",
        [plan()],
        each([post(LOST), 301], [post(REFUSED), 301]),
        [mission(does="Home"), 600, did("Home"), ends(DONE)],
    ),
    Story(
        "a start that waits or is in doubt takes the robot's own mission",
        plan(window=60, battery=30),
        each([battery(12), 306], IN_DOUBT),
        [own_mission(), 3, battery(90), 500, did("Home")],
    ),
    Story(
        "the robot's own one was a mistake and is deleted while its start waits",
        [own_mission(), battery(12), plan(battery=30, mission_id=2), 360, delete("own mission"), battery(80), 300],
        did("Deliver"),
    ),
    Story(
        "an own one is entered or deleted a moment before",
        each(
            [plan(), later(299.9, states(SUBMITTING), own_mission()), 400, did("Home")],
            [
                own_mission(),
                plan(mission_id=2),
                later(299.9, states(SUBMITTING), delete("own mission")),
                400,
                did("Deliver"),
            ],
        ),
    ),
    Story(
        "a start of a group follows it to another name",
        plan(window=60),
        each(
            [IN_DOUBT, mission(name="Bring")], [down(), 300.5, give("R1"), up(), mission(name="Bring"), robot_off("R1")]
        ),
        [500, ends(DONE), true(lambda s: s.row().mission == "Bring")],
        on="group",
        robots=3,
    ),
    Story(
        "a start that a person assigned follows it",
        [GIVEN_TO_R1, battery(12), 30, waits(BATTERY), mission(does="Home"), battery(90), 600, did("Home")],
        on="group",
        robots=3,
    ),
    Story(
        "a start that a person assigned does not run a deleted mission",
        [own_mission(), plan(window=60, battery=30), battery(12), 310, give("R1"), 30, delete("own mission")],
        [battery(80, "R1"), 60, did("Deliver"), 300],
        on="group",
        robots=3,
    ),
    Story(
        "a start that a person assigned follows an edit while its request is made",
        [do(lambda s: s.add_mission("Home")), plan(window=60), down(), 300.5, give("R1"), up()],
        [while_posting(states(SUBMITTING), edit(mission_id=2)), 600],
        [ends(DONE), did("Home"), true(lambda s: s.row().mission == "Home")],
        on="group",
        robots=3,
    ),
    Story(
        "a start waits for no battery once its mission needs none",
        [set_up(minimum_battery_percent=30), battery(12), plan(window=60), 306, states(WAITING)],
        [mission(on_low_battery=True), 600, states(COMPLETED)],
        on=BOTH,
    ),
)

test_an_idle_mission_edited = cases_of(
    Story(
        "not sent yet, it follows its mission",
        RESTING,
        each([post(LOST)], [post(REFUSED)]),
        [until(lambda s: s.executions() and s.row().attempts), runs(0)],
        each(
            [mission("Home", does="Deliver"), 1200, did("Deliver")],
            [
                own_mission("Deliver", "Home"),
                1200,
                true(lambda s: GUIDS["Home"] not in [i.mission_id for i in s.items()]),
            ],
        ),
    ),
    Story(
        "nothing of a deleted mission is sent",
        [RESTING, own_mission(MISSIONS[-1].name, "Home")],
        each([post(LOST)], [post(REFUSED)]),
        [until(lambda s: s.executions() and s.row().attempts), runs(0), delete("own mission"), 1200],
        true(lambda s: MISSIONS[-1].guid not in [item.mission_id for item in s.items()]),
    ),
    Story(
        "another mission is sent in the same idle period if the first was never sent",
        RESTING,
        each([post(LOST)], [post(REFUSED)]),
        [until(lambda s: s.executions() and s.row().attempts), rest("Deliver"), 1800, did("Deliver")],
    ),
    Story(
        "it is sent in the same idle period when its rule or mission is restored",
        RESTING,
        each([post(LOST)], [post(REFUSED)]),
        until(lambda s: s.executions() and s.row().attempts),
        each([rest(enabled=False), 5, rest()], [delete("Home"), undo()]),
        [1800, items("Done")],
    ),
    Story(
        "no longer needed after a lost request it raises no alarm",
        [RESTING, post(LOST), until(lambda s: s.network.posts()), later(60, stranger()), 300],
        [not_raised(), true(lambda s: [row.reason.code for row in s.executions()] == [ReasonCode.OVERLAP])],
    ),
)
