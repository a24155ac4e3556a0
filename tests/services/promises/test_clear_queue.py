"""The queue of a robot is cleared: what was to go goes, nothing else does, and nothing is sent before the robot has answered."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import HandOver
from app.mir.errors import RobotError
from tests.services.story import *

GROUP = {"on": "group", "robots": 3}
WHEN_FREE = do(lambda s: s.container.catalogue.save_robot(replace(s.robot("R1"), hand_over=HandOver.WHEN_FREE)))
TWO = [plan(window=60), plan("B", window=60)]
FLAT = [battery(12), plan(battery=30, window=60), 360, states(WAITING)]
CLEAR = ("DELETE", "/mission_queue")
ALL_CLEARED = true(lambda s: {row.reason and row.reason.code for row in s.executions()} == {ReasonCode.QUEUE_CLEARED})


def clear_refused(*steps):
    """Clear queue finds no connection; these happen while it is tried."""
    return [meets(*CLEAR, REFUSED), during("DELETE", *steps), refused(clear_queue(), error=RobotError)]


test_clear_queue = cases_of(
    Story(
        "a start that waits for the robot to become free ends",
        [WHEN_FREE, TWO, 330, others_continue()],
        each(meets(*CLEAR, SLOW, 0.3), meets(*CLEAR, SLOW, 3.0)),
        [clear_queue(), 600, runs(1), states(State.CANCELLED, State.CANCELLED)],
    ),
    Story(
        "a start about to be tried again ends",
        [plan(window=60), post(REFUSED), 300.5, waits(Wait.RETRY), others_continue(), 0.9, meets(*CLEAR, SLOW, 2.0)],
        [clear_queue(), 600, runs(0)],
    ),
    Story(
        "refused: waiting starts continue",
        [FLAT, clear_refused(), states(WAITING), battery(90), 60, runs(1), 200],
        mark=OWN_QUEUE,
    ),
    Story(
        "refused: a cancelled start in doubt stays cancelled",
        [plan(window=60), post(LOST), 310],
        each(cancel(), clear_queue()),
        [clear_refused(), 600, runs(0)],
        mark=OWN_QUEUE,
    ),
    Story(
        "refused: a cancel that the robot has not received stays",
        [
            plan(window=60),
            robot_pauses(),
            303,
            states(QUEUED),
            down(),
            cancel(),
            clear_refused(),
            up(),
            120,
            robot_goes_on(),
        ],
        [500, states(State.CANCELLED)],
    ),
    Story(
        "refused: a start held in that moment stays held",
        [FLAT, clear_refused(2, keep()), battery(90), 120, runs(0)],
        stays_open=True,
        mark=OWN_QUEUE,
    ),
    Story(
        "refused: a start undone in that moment waits again",
        FLAT,
        each([clear_refused(off(), on())], [clear_refused(delete()), undo()], [clear_refused(cancel()), want_again()]),
        [battery(90), 300, runs(1)],
        mark=OWN_QUEUE,
    ),
    Story(
        "refused: a start being sent is sent",
        plan(window=60),
        each([post(LOST), 394], [299.9]),
        [states(SUBMITTING), others_continue(), clear_refused(4), 600, runs(1)],
        mark=OWN_QUEUE,
    ),
    Story(
        "refused: the list of late starts continues",
        [plan(window=60), 200, off_for(200), 5, waits(Wait.LATE_START), clear_refused(), 10, runs(0)],
        with_window=True,
        stays_open=True,
        mark=OWN_QUEUE,
    ),
    Story(
        "its answer lost: waiting starts are not sent",
        READ_OFTEN,
        [WHEN_FREE, TWO, 303, states(EXECUTING, WAITING), others_continue(), meets(*CLEAR, ANSWER_LOST)],
        [refused(clear_queue(), error=RobotError), 600, runs(1)],
        mark=OWN_QUEUE,
    ),
    Story(
        "items cleared while the robot is read end as cleared",
        each([], do(lambda s: s.network.words.update(Aborted="Abgebrochen"))),
        [
            TWO,
            304,
            others_continue(),
            meets("GET", "/mission_queue/1", SLOW, 3.0),
            during("GET", later(1.0, clear_queue())),
        ],
        [60, ALL_CLEARED],
    ),
    Story(
        "it counts although the robot refuses an earlier cancel",
        [TWO, 304, meets("DELETE", "/mission_queue/2", NOT_FOUND), during("DELETE", clear_queue())],
        [
            refused(do(lambda s: s.container.operator.cancel_execution(s.row("B").id)), error=RobotError),
            60,
            ALL_CLEARED,
        ],
    ),
    Story(
        "a group's start goes to another robot while the best one's queue is cleared",
        [plan(window=60), battery(60, "R2", "R3"), do(lambda s: s.engine.watch(1))],
        each(298.0, 299.5),
        [others_continue(), meets(*CLEAR, SLOW, 9.0), clear_queue(), 30],
        true(lambda s: [(post.at < 301, post.robot != "R1") for post in s.network.posts()] == [(True, True)]),
        **GROUP,
        stays_open=True,
        mark=OWN_QUEUE,
    ),
    Story(
        "a group's start at a robot that leaves the group is not blocked for ever",
        [
            plan(battery=30, window=60),
            others_continue(),
            battery(12),
            330,
            give("R1"),
            10,
            states(WAITING),
            meets(*CLEAR, SLOW, 1.0),
        ],
        each(
            during("DELETE", robot_off("R1"), 2),
            during(
                "DELETE",
                do(lambda s: s.container.catalogue.save_group(replace(s.group, members=s.group.members[1:]))),
                2,
            ),
        ),
        [clear_queue(), battery(90), 600, true(lambda s: s.row().state in (State.CANCELLED, COMPLETED))],
        **GROUP,
    ),
    Story(
        "a group's start whose worker continues is not blocked for ever",
        [others_continue(), plan(window=60), WHEN_FREE, robot_off("R2", "R3"), 299.6],
        [do(lambda s: s._blocked.add(s._workers[1])), 0.3, states(WAITING), meets(*CLEAR, SLOW, 1.0)],
        [during("DELETE", do(lambda s: s._blocked.clear()), 2), clear_queue(), 600],
        true(lambda s: s.row().state in (State.CANCELLED, COMPLETED)),
        **GROUP,
    ),
)


class Killed(BaseException):
    pass


@OWN_QUEUE
def test_a_clear_that_was_killed_blocks_nothing_for_ever(s):

    def kill(s):
        raise Killed

    play(s, FLAT, meets(*CLEAR, REFUSED), during("DELETE", do(kill)))
    with pytest.raises(Killed):
        s.container.operator.clear_queue(1)
    play(s, off_for(), battery(90), 3900, true(lambda s: s.row().state in (COMPLETED, State.CANCELLED)))


def test_a_start_of_a_cleared_queue_is_assigned_to_no_other_robot(group):
    """It would end as cleared there, where nothing was cleared."""
    play(group, set_up(minimum_battery_percent=20), plan(window=60), battery(5), 330)
    with group.container.clearing.of(1) as cleared:
        cleared.add(group.row().id)  # it was R1's a moment ago
        play(group, refused(give("R2")))
    play(group, give("R2"), true(lambda s: s.row().robot == "R2"))
