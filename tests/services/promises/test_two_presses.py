"""What a person presses twice, or too late: a start goes to another robot once, a queue is cleared once, what was seen is skipped."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from app.domain import choice
from app.domain.reasons import sentence, waiting_sentence
from app.services.dispatch.ledger import Ledger
from tests.services.story import *

ALREADY = "started on another robot already"
NOTE = do(lambda s: s.noted.append(s.executions()[0]))
FALLS_SILENT = do(lambda s: s.network.down.add(s.row().robot))
IN_DOUBT = [plan(window=60), post(LOST), 302, FALLS_SILENT, 8, states(SUBMITTING), NOTE]  # never there
IS_THERE = [plan(window=10), post(ANSWER_LOST), 300, FALLS_SILENT, 20, NOTE]
LIMITS = each(set_up(history_limit=None), set_up(history_limit=1))
SECOND, THIRD = 0, 1
PRESSED = "7c9e6679-7425-40de-944b-e07fc1f90ae7"  # the token of a press
GROUP = {"on": "group", "robots": 3}


def other(s, number):
    """One of the robots that the start is not at."""
    return [robot for robot in s.container.catalogue.robots() if robot.id != s.noted[0].robot_id][number]


@step
def instead(s, number=None, token=None):
    """The start that was noted first is started on another robot, or on any."""
    robot_id = None if number is None else other(s, number).id
    s.noted.append(s.container.operator.start_on_another(s.noted[0].id, robot_id, token))


def at_second(act):
    return do(lambda s: act(s, other(s, SECOND)))


@step
def undo_if_it_may_be(s):
    with suppress(InvalidInput):
        s.container.catalogue.wait_again(s.noted[-1].id)


def reports_of(s):
    """The robots that alarms of two starts name."""
    cases_of = [alarm.details for alarm in s.container.alarms.open() if alarm.code == "started_twice"]
    return [(details["robot"], details["other"]) for details in cases_of]


HOLD_SECOND = at_second(lambda s, robot: s.hold(robot.name))
RELEASE_SECOND = at_second(lambda s, robot: s.container.holds.release(robot.id))
REMOVE_SECOND = at_second(lambda s, robot: s.removed.append(s.container.catalogue.remove_robot(robot.id)))
LOSE_MISSION = at_second(lambda s, robot: s.lose_mission(robot.name))
CANCEL = do(lambda s: s.container.operator.cancel_execution(s.noted[-1].id))

test_started_on_another = cases_of(
    Story(
        "it is not sent again",
        [IN_DOUBT, instead(token=PRESSED), 30],
        each(
            [], [3700, true(lambda s: s.row("A").reason.code is ReasonCode.UNKNOWN_OUTCOME)], [app_off(False), app_on()]
        ),
        [instead(token=PRESSED), true(lambda s: s.noted[-1].token == PRESSED)],  # the same press, arrived twice
        [refused(instead(), ALREADY), 600, runs(1)],
        **GROUP,
        stays_open=True,
    ),
    Story(
        "nor when its outcome stays unknown",
        [IN_DOUBT, 3700, ends(UNKNOWN), instead(), refused(instead(), ALREADY), 200],
        **GROUP,
    ),
    Story(
        "a withdrawn one is not sent again",
        IN_DOUBT,
        each(
            [off(), refused(instead(), "changed, switched off or deleted")],
            [pause(), refused(instead(), "paused since")],
        ),
        true(lambda s: len(s.executions()) == 1),
        **GROUP,
        stays_open=True,
    ),
    Story(
        "it is not sent again to the robot where it was lost",
        [plan(window=60), post(LOST), 310, NOTE, states(SUBMITTING), instead(THIRD), 600, runs(1)],
        on=("group", "robot"),
        robots=3,
    ),
    Story(
        "it is not sent again when its robot was deleted and is restored",
        [IN_DOUBT, instead(), 30, delete("robot"), 5, up(), undo(), 500, runs(1)],
        **GROUP,
    ),
    Story(
        "while the connection of its next try is made, that try is not sent",
        [plan(window=60), post(LOST), 310, NOTE, states(SUBMITTING)],
        while_posting(
            do(
                lambda s: s.container.operator.start_on_another(
                    s.noted[0].id,
                    next(s.robot(n).id for n in ("R3", "R2") if n not in (s.noted[0].robot, s.executions()[0].robot)),
                )
            )
        ),
        [600, runs(1), true(lambda s: len(s.executions()) == 2)],
        on=("group", "robot"),
        robots=3,
    ),
    Story(
        "if the second failed a third one may",
        IN_DOUBT,
        each([LOSE_MISSION, instead(SECOND), 5], [HOLD_SECOND, instead(SECOND), 5, CANCEL]),
        [60, runs(0), instead(THIRD), refused(instead(SECOND)), 60, runs(1)],
        **GROUP,
        stays_open=True,
        mark=OWN_MISSIONS,
    ),
    Story(
        "a third one may with any history",
        [set_up(history_limit=1), IN_DOUBT, HOLD_SECOND, instead(SECOND), 2, CANCEL],
        do(lambda s: s.noted.append(s.container.operator.run_now(other(s, THIRD).id, 1))),
        [2, CANCEL, 40, instead(THIRD), 200, runs(2)],
        **GROUP,
        stays_open=True,
        mark=OWN_NETWORK,
    ),
    Story(
        "removing the robot that may have it does not count as a failure",
        [IN_DOUBT, post(ANSWER_LOST), later(0.5, at_second(lambda s, robot: s.network.down.add(robot.name)))],
        [do(lambda s: s.noted.append(other(s, THIRD))), instead(SECOND), 3, REMOVE_SECOND, 60],
        refused(do(lambda s: s.container.operator.start_on_another(s.noted[0].id, s.noted[1].id))),
        **GROUP,
        stays_open=True,
    ),
    Story(
        "of two others one gets it even if a cancel is undone",
        [
            IN_DOUBT,
            HOLD_SECOND,
            instead(SECOND),
            2,
            CANCEL,
            do(lambda s: s.noted.append(s.noted[-1])),
            instead(THIRD),
            2,
        ],
        [do(lambda s: s.noted.append(s.noted[-2])), undo_if_it_may_be(), RELEASE_SECOND, 120, runs(1)],
        **GROUP,
        stays_open=True,
    ),
    Story(
        "of two others one gets it even if the second is restored",
        LIMITS,
        [IN_DOUBT, do(lambda s: s.noted.extend([other(s, SECOND), other(s, THIRD)])), HOLD_SECOND, instead(SECOND), 2],
        each(
            [REMOVE_SECOND, 5],
            [do(lambda s: s.switch(s.noted[1].name, on=False)), 5],
            [do(lambda s: s.container.operator.hold_starts([s.noted[-1].id])), 1, REMOVE_SECOND, 5],
        ),
        [do(lambda s: s.container.operator.start_on_another(s.noted[0].id, s.noted[2].id)), 60],
        [
            do(lambda s: play(s, undo()) if s.removed else s.switch(s.noted[1].name, on=True)),
            2,
            release(),
            let_go(),
            200,
        ],
        runs(1),
        **GROUP,
        stays_open=True,
    ),
    Story(
        "without another robot it says so",
        [IN_DOUBT, HOLD_SECOND, do(lambda s: s.hold(other(s, THIRD).name)), instead(), 10],
        each(
            do(lambda s: [s.switch(other(s, number).name, on=False) for number in (SECOND, THIRD)]),
            do(lambda s: s.container.catalogue.save_group(replace(s.group, members=(s.noted[0].robot_id,)))),
        ),
        [30, do(lambda s: s.noted.append(s.container.ledger.get(s.noted[-1].id)))],
        true(lambda s: sentence(s.noted[-1].reason, "UTC") == "No other robot of Hall is switched on"),
        **GROUP,
        stays_open=True,
    ),
    Story(
        "a robot that has it after all is an alarm",
        [IS_THERE, instead()],
        each(30, [900, true(lambda s: s.executions()[0].state is FAILED)]),
        [not_raised("started_twice"), up(), 120],
        true(lambda s: reports_of(s) == [(s.noted[0].robot, s.container.ledger.get(s.noted[-1].id).robot)]),
        **GROUP,
        stays_open=True,
        mark=OWN_NETWORK,
    ),
    Story(
        "two robots having it is reported with any history",
        [set_up(history_limit=1), IS_THERE, instead(SECOND)],
        each(120, 500),
        [do(lambda s: s.container.operator.run_now(other(s, THIRD).id, 1)), 300],
        [do(lambda s: s.container.operator.run_now(other(s, THIRD).id, 1)), 300, up(), 200, raised("started_twice")],
        **GROUP,
        stays_open=True,
    ),
    Story(
        "no alarm where the second was cancelled before it began",
        [IS_THERE, at_second(lambda s, robot: s.stranger_queues(robot=robot.name)), 5, instead(SECOND), 3, CANCEL, 10],
        [
            true(lambda s: s.container.ledger.get(s.noted[-1].id).started_at is None),
            up(),
            120,
            not_raised("started_twice"),
        ],
        **GROUP,
        stays_open=True,
    ),
    Story(
        "an undone cancel of it is reported if the first robot had it",
        [IS_THERE, HOLD_SECOND, instead(SECOND), 2, CANCEL, up(), 5, undo_if_it_may_be(), RELEASE_SECOND, 120],
        true(lambda s: len(s.all_items()) == 1 or "started_twice" in s.alarms()),
        **GROUP,
        stays_open=True,
        doubles=True,
    ),
)


@OWN_NETWORK
def test_two_presses_at_once_start_it_once(group, monkeypatch):
    """The second one has read the row before the first one wrote."""
    play(group, IN_DOUBT)
    add = Ledger.add

    def after_another(ledger, *arguments):
        monkeypatch.setattr(Ledger, "add", add)
        play(group, instead())
        return add(ledger, *arguments)

    monkeypatch.setattr(Ledger, "add", after_another)
    play(group, refused(instead(), ALREADY), 30, runs(1))


@OWN_NETWORK
def test_the_history_knows_what_was_started_instead_of_what(group):
    play(group, IN_DOUBT)
    [row], history = group.noted, group.container.history
    assert history.replacements([row]) == {}
    play(group, instead(token=PRESSED), 30)
    new = group.container.ledger.by_token(PRESSED)
    [found] = set(history.replacements([row]).values())
    assert (found.id, found.robot, found.other, found.other_robot) == (row.id, row.robot, new.id, new.robot)
    assert history.replacements([new])[new.id] == found, "also where the list holds only one of them"


def test_of_what_was_started_on_another_robot_it_is_said_that_it_is_not_sent_again(group):
    play(group, IN_DOUBT, 30)
    [row] = group.noted
    snapshot = group.container.snapshots.get(row.robot_id)
    assert choice.stuck_since(row, snapshot) is not None
    play(group, instead())
    row = group.container.ledger.get(row.id)
    assert choice.stuck_since(row, snapshot) is None
    assert waiting_sentence(row) == "Not sent again, asking whether it has arrived"


# ---------------------------------------------------------------------- skip
HOURLY = plan(rule="FREQ=HOURLY")
SKIP_0605 = skip("06:05")

test_skip = cases_of(
    Story(
        "nothing if the start that was seen is no longer planned",
        HOURLY,
        each(edit(at="06:02"), edit(at="06:20")),
        refused(SKIP_0605, "no longer has this start"),
    ),
    Story(
        "pressed twice it skips one start",
        each(plan(), HOURLY),
        [SKIP_0605, SKIP_0605, states(State.SKIPPED)],
    ),
)
