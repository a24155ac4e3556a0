"""Robots of a group that fail, fall silent or lack the mission, clocks that are set, workers that change: each start runs once."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from functools import partial

import pytest

from app.database.errors import DatabaseUnavailable
from app.domain.choice import chosen
from app.domain.models import Group
from app.services.catalogue import group_edit
from app.services.dispatch import messages
from app.services.dispatch.ledger import TOO_MANY
from app.services.dispatch.timing import INTENT_LEAD, LIVE_EVERY, LOOKS_FOR
from mir_sim.mission_queue import ItemState
from tests.services.story import *

GroupStory = partial(Story, on="group", robots=3)
LONG = plan(window=30)
BY_ANY = do(lambda s: s.container.operator.run_on_any(s.group.id, 1))
ONLY_R1, R1_AND_R2 = robot_off("R2", "R3"), robot_off("R3")


def raises(error):
    def act(s):
        raise error

    return do(act)


test_odd = cases_of(
    GroupStory(
        "one refused connection, or reading, ends no start with a time limit",
        [R1_AND_R2, 5, stranger(robot="R2", count=9)],
        each(
            [post(REFUSED, robot="R1"), plan(window=30, finish_by=30), 330],
            [plan(window=30, finish_by=30), 290, down("R1"), later(20, up()), 60],
        ),
        [states(EXECUTING), robots("R1"), 200],
    ),
    GroupStory(
        "a clock that is set back excludes no robot for that long",
        [ONLY_R1, 30, post(REFUSED, robot="R1"), BY_ANY, 1, clock(-3600), 300],
        true(lambda s: s.row().state in (EXECUTING, COMPLETED)),
    ),
    GroupStory(
        "a robot's start that waits for something else does not block it for groups",
        ONLY_R1,
        each(
            [plan("F", on=1, window=600), hold("R1"), 310, keep(), release()],
            [plan("F", on=1, window=600, battery=99), 310],
        ),
        [plan("G", "06:10", window=600), 600, true(lambda s: s.row("F").state is WAITING)],
        true(lambda s: s.row("G").state in (EXECUTING, COMPLETED)),
        stays_open=True,
    ),
    GroupStory(
        "a start that waits while the clock is wrong says so, and keeps waiting afterwards",
        [POLLED_OFTEN, plan("G", window=60), plan("F", on=1, battery=99, window=60), all_busy(), 330],
        do(lambda s: s.noted.extend(sorted(row.token for row in s.executions(WAITING)))),
        each(
            [clock(2400), 30, waits(Wait.CLOCK, Wait.CLOCK)],
            [clock(-200 * DAY), 30, true(lambda s: s.container.holds.active().clock), clock(200 * DAY), 30],
        ),
        true(lambda s: sorted(row.token for row in s.executions(WAITING)) == s.noted),
        stays_open=True,
    ),
    GroupStory(
        "a start that a robot without tokens may have is assigned to no other",
        [do(lambda s: (setattr(s.network, "latest", 200.0), setattr(s.network, "forgets_descriptions", True)))],
        [R1_AND_R2, plan("before", "06:01"), 200, do(lambda s: s.noted.append(s.row("before").robot))],
        do(lambda s: (s.only(s.noted[0]), s.network.next("POST", "/mission_queue", LATE, 120.0, robot=s.noted[0]))),
        [LONG, 110, robot_on("R1", "R2"), 1200, raised("unknown_outcome"), runs(2)],
        true(lambda s: (s.row("A").robot, s.row("A").reason.code) == (s.noted[0], ReasonCode.UNKNOWN_OUTCOME)),
        mark=OWN_WORDS,
    ),
    GroupStory(
        "a decision that can't be written is tried again",
        [when_assigned(before=[raises(DatabaseUnavailable("nothing can be written"))]), plan(), 330],
        [true(lambda s: s.row().submitted_at), 200],
    ),
)


# ---------------------------------------------------------------------- silent, or without the mission
def reports_of(row) -> list[dict]:
    return [*row.choice.get("robots", ()), *row.wait_details.get("robots", ())]


ALL_FREE = true(
    lambda s: reports_of(s.row()) == [{"robot": n} for n in sorted(s.machines, key=lambda n: n != s.row().robot)]
)
NONE_SILENT = [
    [0.5, true(lambda s: "out" not in [key for each in reports_of(s.row()) for key in each])] for _n in range(60)
]


def lost_by(*names):
    """They have lost the mission, as their lists say."""

    def act(s):
        for name in names:
            s.lose_mission(name)
        for name in s.machines:
            s.container.robot_missions.learn_names(s.robot(name).id)

    return do(act)


test_silent = cases_of(
    GroupStory(
        "robots that answer are read before one is chosen, and none is called silent",
        75,
        each([BY_ANY, 1], [meets("GET", "/status", SLOW, 0.4, robot="R1"), BY_ANY, 2]),
        [true(lambda s: s.row().state is not WAITING), ALL_FREE, 200],
    ),
    GroupStory(
        "a hanging robot is not waited for for long",
        [75, meets("GET", "*", SLOW, 8.0, robot="R1"), BY_ANY, 1, true(lambda s: s.row().state is not WAITING), 200],
    ),
    GroupStory(
        "a hanging robot of another group is not waited for at all",
        do(lambda s: s.container.catalogue.edit(lambda edit: group_edit.save(edit, replace(s.group, members=(2, 3))))),
        do(lambda s: s.container.catalogue.edit(lambda edit: group_edit.save(edit, Group("Yard", (1,))))),
        [plan(), plan("B", group_id=2), 298, meets("GET", "*", SLOW, 8.0, robot="R1"), 15],
        true(lambda s: [post.at > 305 for post in s.network.posts("R1")] == [True]),
        true(lambda s: [p.at < 300 + LOOKS_FOR / 2 for p in s.network.posts() if p.robot != "R1"] == [True]),
        200,
        mark=OWN_NETWORK,
    ),
    GroupStory("none is called silent between two reads", [all_busy(), plan(), 303, NONE_SILENT], stays_open=True),
    GroupStory(
        "a robot known to lack the mission is passed over without an alarm",
        [lost_by("R1", "R2"), stranger(robot="R3", count=9), plan(), 320, not_raised()],
        true(
            lambda s: (
                [(each["robot"], each.get("out")) for each in reports_of(s.row())]
                == [("R3", None), ("R1", "lacks_mission"), ("R2", "lacks_mission")]
            )
        ),
        stays_open=True,
        mark=OWN_MISSIONS,
    ),
    GroupStory(
        "if none would be left they are still asked",
        [lost_by("R1", "R2", "R3"), plan(), 320, ends((FAILED, ReasonCode.UNKNOWN_MISSION))],
        mark=OWN_MISSIONS,
    ),
    GroupStory(
        "an old list excludes no robot",
        [lost_by("R1"), R1_AND_R2, down("R2"), 3700, plan(at="07:05"), 220, true(lambda s: "1" in s.row().tried)],
        stays_open=True,
    ),
    GroupStory(
        "an old list does not exclude the only possible robot",
        lost_by("R1"),
        do(lambda s: s.machines["R1"].site.table("/missions").add({"guid": GUIDS["Deliver"], "name": "Deliver"})),
        [hold("R2"), hold("R3"), plan(), 320, states(EXECUTING), robots("R1"), 200],
        mark=OWN_MISSIONS,
    ),
)


# ---------------------------------------------------------------------- a robot that fails start after start
STARTS = 5


@step
def r1_aborts(s, times=1000):
    """It ends every mission at once and is Ready again; apart from that it is the best of equals."""
    machine = s.machines["R1"]
    s.noted.append(times)  # how often it still does

    def abort():
        if machine.run is not None and s.noted[0] > 0:
            s.noted[0] -= 1
            machine.controller.end(ItemState.ABORTED, "Mission cannot be completed")
        s.at(1.0, abort)

    s.at(1.0, abort)


def often(starts=STARTS, **values):
    return [plan(rule=f"FREQ=MINUTELY;INTERVAL=10;COUNT={starts}", **values), 300 + starts * 600]


@step
def plan_in_five(s, name="later", **values):
    play(s, plan(name, f"23T{s.clock.now() + timedelta(minutes=5):%H:%M}", **values))


def alarm_of(s):
    return next((alarm for alarm in s.container.alarms.open() if alarm.code == "robot_fails"), None)


def counted(number):
    return true(lambda s: (alarm_of(s).key, alarm_of(s).details["count"]) == ("robot:1", number))


NO_ALARM = true(lambda s: alarm_of(s) is None)
NOT_HELD_AGAINST = [plan_in_five(), 400, true(lambda s: "failed" not in chosen(s.row("later").choice, "UTC"))]

test_failing = cases_of(
    GroupStory(
        "other free robots go first and the choice says why",
        [r1_aborts(), often(), states(FAILED, *[COMPLETED] * 4)],
        true(lambda s: [row.robot == "R1" for row in s.executions()] == [True, False, False, False, False]),
        true(lambda s: "R1: free now, its last start failed" in chosen(s.executions()[1].choice, "UTC")),
    ),
    GroupStory(
        "the only robot still gets every start and an alarm names it",
        [r1_aborts(), ONLY_R1, often(), robots(*["R1"] * STARTS), counted(STARTS)],
    ),
    GroupStory("two failures raise no alarm", [r1_aborts(), ONLY_R1, often(TOO_MANY - 1), NO_ALARM]),
    GroupStory(
        "its own starts count as those of its group, over restarts of the app",
        r1_aborts(),
        [[plan(f"own {n}", f"06:{5 + 5 * n:02}", on=1), 400, off_for()] for n in range(TOO_MANY)],
        [plan_in_five("A", rule="FREQ=MINUTELY;INTERVAL=10;COUNT=2"), 1500, counted(TOO_MANY)],
        true(lambda s: "R1" not in [row.robot for row in s.executions()[TOO_MANY:]]),
        true(lambda s: f"R1: free now, {TOO_MANY} starts failed in a row" in chosen(s.row("A").choice, "UTC")),
    ),
    GroupStory(
        "its first success ends the alarm and the count of failures",
        [r1_aborts(TOO_MANY), ONLY_R1, often(TOO_MANY), do(lambda s: s.container.operator.run_now(1, 1)), 300],
        [true(lambda s: alarm_of(s).cleared_at), robot_on("R2"), NOT_HELD_AGAINST],
    ),
    GroupStory(
        "starts cancelled by a person do not count as failures",
        [ONLY_R1, plan(rule=f"FREQ=MINUTELY;INTERVAL=10;COUNT={STARTS}"), 300],
        [[until(lambda s: s.executions(EXECUTING)), cancel(), 600] for _start in range(STARTS)],
        [ends(*[CANCELLED] * STARTS), NO_ALARM],
    ),
    GroupStory(
        "one that answers every start with an error is passed over too",
        [
            post(LOST, robot="R1", count=STARTS),
            often(),
            true(lambda s: "R1" not in {row.robot for row in s.executions()}),
        ],
        true(lambda s: all(r.submitted_at - r.planned_at < timedelta(seconds=3) for r in s.executions()[1:])),
    ),
    GroupStory(
        "starts refused by the app itself do not count as failures",
        [down(), later(60, up())],
        plan(rule="FREQ=MINUTELY;INTERVAL=10;COUNT=4", parameters={"Speed": 1}),
        [plan("own", on=1, rule="FREQ=MINUTELY;INTERVAL=10;COUNT=4", parameters={"Speed": 1}), 3000],
        [true(lambda s: {row.state for row in s.executions()} == {FAILED}), sent(), NO_ALARM, NOT_HELD_AGAINST],
    ),
)


def test_the_failed_start_has_its_alarm_though_that_of_the_robot_cannot_be_written(group, monkeypatch):

    def fail(*_values, **_details):
        raise DatabaseUnavailable("the disk is full")

    monkeypatch.setattr(group.container.alarms, "raise_about_robot", fail)
    play(group, r1_aborts(), ONLY_R1, often(TOO_MANY))
    assert [alarm.count for alarm in group.container.alarms.open() if alarm.code == "execution_failed"] == [TOO_MANY]


# ---------------------------------------------------------------------- the worker that a start is given to
DUE = 300.0
AS_ADMIN = do(lambda s: s.container.catalogue.save_robot(replace(s.robot("R1"), username="admin"), password="admin"))
POLL = do(lambda s: s.post(1, messages.Poll()))
JUST_BEFORE = DUE - INTENT_LEAD - 0.01

test_worker = cases_of(
    Story(
        "a robot whose connection is edited while a start is sent gets it",
        [LONG, DUE - 0.5, meets("GET", "/mission_queue", SLOW, 8.0, robot="R1"), later(0.45 - INTENT_LEAD, POLL)],
        later(1.5, AS_ADMIN),
        each([], [later(2.0, hold("R1")), later(40.0, release())]),
        [60, states(EXECUTING), tries(1), runs(1), 200],
        on="group",
        mark=OWN_ADDRESS,
    ),
    Story(
        "an old row begun after a failure of the database is not taken for a lost one",
        READ_OFTEN,
        [hold("R1"), plan(), DUE + 5, do(lambda s: s.post(1, s._workers[1].expect_recovery())), release(), 3],
        [states(EXECUTING), tries(1), 200],
        on="group",
    ),
)


@pytest.fixture
def s(tmp_path):
    s = Stage(tmp_path, "group", 1)
    yield s
    s.switch_off()


def asked_of(s) -> list:
    """What robots are asked for from now on, and when."""
    asked = []
    s.network.interrupt = lambda where: asked.append((where, s.seconds() - DUE))
    return asked


@OWN_ADDRESS
def test_a_new_worker_of_a_robot_begins_when_the_one_before_has_ended(s):
    """Two could have the same start in hand."""
    s.run(DUE)
    asked = asked_of(s)
    play(s, meets("GET", "/mission_queue", SLOW, 8.0, robot="R1"), POLL, later(1.0, AS_ADMIN), 10)
    assert [at for _where, at in asked if 1.0 < at < 8.0] == []
    assert [at for _where, at in asked if at > 8.0]


def test_its_worker_has_a_start_before_it_hears_of_any_change(s):
    """Else it would begin to read the robot first, and the start would wait for that."""
    play(s, plan(), JUST_BEFORE)
    usual, seen = s.post, []

    def post(robot_id, message):
        usual(robot_id, message)
        seen.append(type(message))

    s.post = post
    s.run(0.5)
    assert next(each for each in seen if each in (messages.Start, messages.LedgerChanged)) is messages.Start


def test_a_robot_that_is_about_to_get_a_start_is_not_read_for_another_that_waits(s):
    """Hundreds of such reads at once would delay what goes out at that instant."""
    play(s, plan(), plan("B"), JUST_BEFORE)
    asked = asked_of(s)
    s.run(INTENT_LEAD)
    assert sorted(run.state for run in s.executions()) == [SUBMITTING, WAITING]
    assert asked == []
    s.run(0.1)
    assert asked[0][0] == "before POST /mission_queue"
    s.run(3 * LIVE_EVERY)
    assert "before GET /status" in [where for where, _at in asked]


@pytest.mark.parametrize("how", ["stops", "runs low"])
def test_a_robot_that_turns_out_unfit_between_choice_and_start_is_not_sent_it(tmp_path, how):
    """Its worker has read it in between."""
    s = Stage(tmp_path, "group", 2)
    play(s, plan(battery=30), JUST_BEFORE)
    usual, chosen = s.post, []

    def post(robot_id, message):
        if isinstance(message, messages.Start) and not chosen:
            chosen.append(f"R{robot_id}")
            machine = s.machines[chosen[0]]
            machine.press_emergency_stop(True) if how == "stops" else machine.set_battery(10.0)
            s.as_for_a_second()
            usual(robot_id, messages.Poll())
            s._go_on(robot_id)
        usual(robot_id, message)

    s.post = post
    play(s, 20, states(EXECUTING), runs(1))
    assert [s.row().robot] != chosen
    s.switch_off()
