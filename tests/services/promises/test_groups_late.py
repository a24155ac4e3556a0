"""A start given up on one robot of a group that arrives there after all: handled correctly wherever the start is
then."""

from __future__ import annotations

from functools import partial

from tests.services.story import *

GroupStory = partial(Story, on="group", robots=3)
LONG = plan(window=30)
ALL_HELD = [hold(name) for name in ("R1", "R2", "R3")]
NO_MORE_PLANNED = do(lambda s: s.network.planned.clear())
NOTE = do(lambda s: s.noted.append(s.row("A")))
ONLY_R1 = robot_off("R2", "R3")


def given_up(late, window=30):
    """The first request, to any robot, hangs and arrives that much later."""
    return [plan(window=window), [post(LATE, late, robot=n) for n in ("R1", "R2", "R3")], 301, NO_MORE_PLANNED, NOTE]


RELEASED = until(lambda s: s.row("A").robot_id is None, 130)
IS_THAT = true(lambda s: (s.row("A").state, s.row("A").robot) == (COMPLETED, s.noted[0].robot))
RAN_ONCE = true(lambda s: len([item for item in s.all_items() if item.started]) == 1)


def busy_there(count=20):
    return do(lambda s: [s.stranger_queues(robot=s.noted[0].robot) for _n in range(count)])


def ours_started(number):
    return true(lambda s: len([i for i in s.all_items() if i.description == s.row("A").token and i.started]) == number)


test_late = cases_of(
    GroupStory(
        "while no robot has it again the late item counts",
        READ_OFTEN,
        each(
            [given_up(200.0), ALL_HELD, 140, robots(""), down(), 300, up(), 60],
            [given_up(400.0, 1), ALL_HELD, 140, states(FAILED), off_for(3600), 60],
        ),
        [IS_THAT, runs(1)],
    ),
    GroupStory(
        "the late item counts even if the start waits for another robot already",
        [given_up(130.0), ALL_HELD, RELEASED],
        do(lambda s: s.network.next("GET", "/mission_queue", SLOW, 8.0, robot=s.noted[0].robot)),
        [60, true(lambda s: s.row().robot == s.noted[0].robot), 300, states(COMPLETED), RAN_ONCE],
    ),
    GroupStory(
        "a start that ended without a robot is corrected",
        [given_up(300.0, 3), ALL_HELD, 220, ends((FAILED, ReasonCode.NO_ROBOT)), 70, down()],
        each(300, 12),
        [up(), 360, RAN_ONCE, IS_THAT],
    ),
    GroupStory(
        "a pending late item is cancelled and reported",
        [given_up(300.0, 3), busy_there(), ALL_HELD, 340, states(FAILED), raised("late_cancelled")],
        true(lambda s: {str(i.state) for i in s.items() if i.description == s.row().token} == {"Aborted"}),
    ),
    GroupStory(
        "while another robot has it, a pending late item is cancelled, a running one reported",
        READ_OFTEN,
        given_up(131.5),
        60,
        each(
            [busy_there(), 600, ours_started(1), raised("duplicate_healed")],
            [600, ours_started(2), raised("duplicate_running")],
        ),
        true(lambda s: s.row().state is COMPLETED and s.row().robot != s.noted[0].robot),
        doubles=True,
        mark=NUMBERED,
    ),
    GroupStory(
        "cancelled by a person on the other robot it is stopped on the first",
        [given_up(130.0), until(lambda s: s.row().robot not in ("", s.noted[0].robot), 200), 3, cancel(), 120],
        [true(lambda s: {str(item.state) for item in s.items()} == {"Aborted"}), raised("late_cancelled")],
        mark=NUMBERED,
    ),
    GroupStory(
        "a start that may still arrive is not pruned",
        READ_OFTEN,
        [given_up(400.0, 3), ALL_HELD, set_up(history_limit=1), 220, do(lambda s: s.container.holds.release(2))],
        [plan("B", "06:12", on=2), plan("C", "06:14", on=2), 700, raised("late_cancelled"), ours_started(0)],
        true(lambda s: s.row("A").robot == ""),
    ),
    GroupStory(
        "a restored robot is searched again",
        [given_up(200.0), ALL_HELD, RELEASED],
        do(lambda s: s.removed.append(s.container.catalogue.remove_robot(s.noted[0].robot_id))),
        [5, undo(), 120, true(lambda s: s.row().robot == s.noted[0].robot)],
        stays_open=True,
    ),
    GroupStory(
        "another machine at the address has its own numbers",
        [ONLY_R1, stranger(count=30), do(lambda s: s.cancel_all()), 30, LONG, post(LOST)],
        until(lambda s: s.executions() and s.row().tried, 500),
        true(lambda s: s.row().tried["1"]["floor"] >= 30),
        true(lambda s: s.row().tried["1"]["serial"] == s.robot("R1").serial_number),
        stays_open=True,
        mark=OWN_ADDRESS,
    ),
    GroupStory(
        "everything sent to a robot has ids above its first floor",
        [robot_off("R2", "R3"), LONG, 295, down("R1"), 10, up(), post(LATE, 89.0), 60],
        [do(lambda s: s.noted.append(s.row().queue_floor)), true(lambda s: s.noted[0] is not None)],
        [until(lambda s: s.row().robot_id is None or s.row().submitted_at, 200), 600, runs(1)],
        true(lambda s: s.row().queue_floor == s.noted[0]),
    ),
    GroupStory(
        "figures count starts that ended without a robot",
        [ALL_HELD, plan(window=2), 430, ends((FAILED, ReasonCode.NO_ROBOT)), robots("")],
        true(lambda s: s.container.kpis.facts().failed == 1),
        true(lambda s: [robot.robot for robot in s.container.kpis.facts().robots] == ["R1", "R2", "R3"]),
    ),
)
