"""Edits and withdrawals while a start waits or is in doubt: it is sent once as defined then, or not at all."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, timedelta

import pytest

from app.domain.models import Connection, HandOver, Overlap, Place
from app.services.catalogue import group_edit
from app.services.dispatch import allocator
from app.services.executions import transitions
from app.services.executions.transitions import Event
from tests.services.story import *
from tests.support.examples import at_night
from tests.support.moments import once

IN_DOUBT = [post(LOST), 306]
FLAT = [battery(12), plan(battery=30), 360, waits(BATTERY)]
ALL_HELD = [hold(name) for name in ("R1", "R2", "R3")]
WITHDRAWN = (
    (robot_off(), REMOVED),
    (delete(), CHANGED),
    (off(), CHANGED),
    (pause(), PAUSED),
    (delete("mission"), CHANGED),
    (edit(at="24T06:05"), CHANGED),
    (delete("robot"), REMOVED),
)

test_withdrawn = cases_of(
    Story(
        "in doubt it is not sent again and says so",
        [plan(), IN_DOUBT],
        each(*([act, 450, runs(0), ends(end), tries(1)] for act, end in WITHDRAWN)),
        sent(300),
    ),
    Story(
        "between two tries it is not tried again",
        [plan(), down("R1"), 301],
        each(*([act, up(), 600, ends(end)] for act, end in WITHDRAWN)),
        [sent(), runs(0)],
    ),
    Story(
        "in doubt and cancelled, its schedule deleted afterwards: it ends as cancelled",
        [plan(), IN_DOUBT, cancel(), 2, delete(), 450, runs(0), ends(CANCELLED), tries(1)],
        on=("robot", "group"),
    ),
    Story(
        "moved in the quiet time it runs at its new time only",
        [plan(), IN_DOUBT, edit(at="06:20"), 1200, sent(300, 1200), ends(CHANGED, DONE), tries(1, 1)],
    ),
    Story(
        "moved while it waits it runs at its new time only",
        [FLAT, edit(at="06:10"), battery(80), 600, sent(600), ends(CHANGED, DONE), tries(0, 1)],
    ),
    Story(
        "a hold stops a second try too",
        [plan(), IN_DOUBT, hold(), 300, sent(300), release(), 300, ends(DONE), tries(2)],
    ),
    Story(
        "a robot's run is followed to its end after it is switched off",
        [plan(), 320, items("Executing"), robot_off()],
        each([], off_for()),
        [300, items("Done"), ends(DONE), tries(1)],
    ),
    Story(
        "an arrived item is followed to its end",
        [plan(), post(ANSWER_LOST), 300.5],
        each(robot_off(), delete(), delete("mission")),
        each([], off_for()),
        [600, sent(300), items("Done"), ends(DONE), tries(1)],
    ),
)

test_edited = cases_of(
    Story(
        "a lower minimum releases a start that waits for it",
        each(plan(battery=30), plan(battery=30, rule="FREQ=DAILY")),
        [battery(12), 360, waits(BATTERY), edit(battery=5), 300, ends(DONE), tries(1), runs(1)],
    ),
    Story(
        "a renamed one keeps waiting",
        each(plan(battery=30), plan(battery=30, rule="FREQ=DAILY")),
        [battery(12), 360, edit(name="New"), 60, waits(BATTERY), true(lambda s: s.row("New"))],
        [battery(80), 300, ends(DONE), tries(1)],
    ),
    Story(
        "it runs the mission, with the priority, that its schedule has now",
        [do(lambda s: s.add_mission("Home")), FLAT, edit(mission_id=2, priority=3), battery(80), 300],
        [
            did("Home"),
            true(lambda s: s.items()[0].priority == s.priority(3)),
            ends(DONE),
            true(lambda s: s.row().mission == "Home"),
        ],
    ),
    Story(
        "a longer window keeps it longer",
        each([FLAT, edit(window=60)], [set_up(start_window_minutes=3), FLAT, set_up(start_window_minutes=60)]),
        [900, battery(80), 300, ends(DONE)],
    ),
    Story(
        "in doubt with an absent robot a longer window counts",
        [plan(window=5), IN_DOUBT, down("R1"), edit(window=60), 600, up(), 600, ends(DONE)],
    ),
    Story(
        "in the quiet time: the second try is as defined then",
        do(lambda s: s.add_mission("Home")),
        each([plan(), post(LOST)], [plan(priority=1), post(ERROR_BEFORE)]),
        [306, edit(mission_id=2, priority=3, window=60, name="New")],
        each([], off_for()),
        [600, did("Home"), true(lambda s: s.all_items()[0].priority == s.priority(3)), ends(DONE), tries(2)],
        true(lambda s: (s.row().mission, s.row().closes_at - s.row().planned_at) == ("Home", timedelta(minutes=60))),
    ),
    Story(
        "a group's start in doubt goes to any robot as defined then",
        [do(lambda s: s.add_mission("Home")), plan(window=30), IN_DOUBT, edit(mission_id=2, priority=3), 600],
        [
            did("Home"),
            true(lambda s: s.items()[0].priority == s.priority(3)),
            ends(DONE),
            true(lambda s: s.row().mission == "Home"),
        ],
        on="group",
        robots=3,
    ),
    Story(
        "an arrived item stays unchanged",
        [do(lambda s: s.add_mission("Home")), plan(), post(ANSWER_LOST), 306, edit(mission_id=2), 600],
        [did("Deliver"), ends(DONE), true(lambda s: s.row().mission == "Deliver")],
    ),
    Story(
        "a moment before its instant",
        [do(lambda s: s.add_mission("Home")), plan(), later(299.9, states(SUBMITTING), edit(mission_id=2)), 400],
        [did("Home"), sent(300), ends(DONE), tries(1)],
    ),
    Story(
        "after the clock was set back, although it looks older",
        [do(lambda s: s.add_mission("Home")), plan(window=60), IN_DOUBT, clock(-30), 1, edit(mission_id=2), 900],
        did("Home"),
    ),
    Story(
        "a higher minimum, while the robot is read for it, counts",
        [plan(window=60), others_continue(), down("R1"), 310, up(), meets("GET", "/status", SLOW, 8.0)],
        [during("GET", later(3.0, edit(battery=100))), 90, sent(), waits(BATTERY)],
        stays_open=True,
    ),
    Story(
        "a shorter window while the connection is made: it is not sent",
        battery(12),
        each(
            [plan(window=60, battery=30), 900, while_posting(edit(window=1))],
            [set_up(start_window_minutes=60), plan(battery=30), 900, while_posting(set_up(start_window_minutes=1))],
        ),
        [battery(90), 60, runs(0)],
    ),
    Story(
        "an unsent start is there again after its robot is deleted and restored",
        plan(window=60, battery=30),
        each(
            [battery(12), 330],
            [down("R1"), 330],
            [299.9, down("R1"), 30.1],
            [post(REFUSED), 300.3],
            [post(REFUSED, count=2), 304],
        ),
        each([off(), on()], [off(), 3, on()], [edit(at="06:50"), 3, edit(at="06:05")]),
        [up(), battery(90), 300, runs(1)],
    ),
    Story(
        "a start without a connection is there again on another robot",
        plan(window=60),
        each([post(REFUSED), 300.3, tries(1)], [post(REFUSED, count=2), 304, tries(2)]),
        [edit(robot_id=2), 300, runs(1)],
        robots=2,
    ),
    Story(
        "a group's start without a connection is there again",
        [robot_off("R2", "R3"), plan(window=60), post(REFUSED), 300.3, tries(1), states(WAITING)],
        [off(), on(), 300, runs(1)],
        on="group",
        robots=3,
    ),
    Story(
        "a start that a person ends ends although it was edited in that moment",
        [FLAT, meets("DELETE", "/mission_queue", SLOW, 3.0), during("DELETE", edit(window=60)), clear_queue()],
        states(State.CANCELLED),
    ),
    Story(
        "too late, or with a time limit, edited a moment before",
        each(
            [plan(window=3), ALL_HELD, later(479, edit(window=60)), later(540, release()), 900],
            [plan(window=30, finish_by=10), ALL_HELD, later(590, edit(finish_by=None)), later(960, release()), 1300],
            [plan(window=30, finish_by=10), ALL_HELD, later(590, edit(finish_by=60)), later(960, release()), 1300],
        ),
        states(COMPLETED),
        on="group",
        robots=3,
    ),
)

test_a_robot_edited = cases_of(
    Story(
        "switched on while its answer is slow it gets the start that is due then",
        [others_continue(), plan("before", "06:04")],
        each(
            [plan(window=60), 245, robot_off(), 50, later(4.5, robot_on())],
            [245, robot_off(), 50, later(4.5, robot_on(), run_now())],
        ),
        each([], meets("GET", "/mission_queue/1", SLOW, 8.0)),
        [600, runs(2)],
    ),
    Story(
        "switched on a moment before it gets the Run now of its group",
        [60, robot_off("R1", "R2", "R3"), 60, robot_on("R1"), run_now(), 300, states(COMPLETED)],
        on="group",
        robots=3,
    ),
    Story(
        "switched on while its answer is slow it gets the start of its group",
        [others_continue(), plan(window=30), later(280, do(lambda s: s.container.operator.run_now(1, 1))), 292],
        [robot_off("R1", "R2", "R3"), later(4.0, meets("GET", "*", SLOW, 8.0, robot="R1"))],
        [
            during("GET", later(1.0, robot_on("R1"))),
            16,
            true(lambda s: s.robot("R1").enabled and s.row("A").state.is_open),
        ],
        [500, true(lambda s: s.row("A").state is COMPLETED)],
        on="group",
        robots=3,
    ),
    Story(
        "hundreds of starts for a dead robot delay no other",
        [[plan(f"S{number}", on=1) for number in range(100)], plan("B", on=2), down("R1"), 299.95],
        true(lambda s: [(row.schedule, row.state) for row in s.executions()] == [("B", SUBMITTING)]),
        robots=2,
        stays_open=True,
        mark=OWN_NETWORK,
    ),
    *(
        Story(
            f"a run and {len(others)} others are followed if the queue can't be read",
            [plan(priority=9), *map(plan, others), 300.5],
            [meets("POST", "/mission_queue/search", Fate.PAGE, count=5000), 120 + 200 * len(others)],
            ends(*[DONE] * (1 + len(others))),
            true(lambda s: s.container.snapshots.get(1).connection is Connection.NOT_A_ROBOT),
        )
        for others in ([], ["B", "C"])
    ),
    Story(
        "a place assigned to a mission a moment before counts",
        [
            do(
                lambda s: (
                    s.add_mission("Home"),
                    s.container.catalogue.save_place(Place("Dock", 1, (2,))),
                )
            )
        ],
        [plan("A", "06:04", mission_id=2), plan("B", on=2, window=60)],
        later(242, do(lambda s: s.container.operator.pause(1))),
        later(
            299.9, do(lambda s: s.container.catalogue.edit(lambda edit: group_edit.use_places(edit, s.mission(), [1])))
        ),
        [303, did("Home"), do(lambda s: s.container.operator.resume(1)), 60, did("Home", "Deliver"), 200],
        robots=2,
    ),
    Story(
        "a start being sent is not skipped, and no other instead of it",
        [plan(rule="FREQ=HOURLY"), 299.9],
        refused(do(lambda s: s.container.pausing.skip(1, instant("06:05").replace(tzinfo=UTC))), "has passed"),
        [60, runs(1), states(EXECUTING)],
        stays_open=True,
    ),
    Story(
        "undo restores the start that waited while another one ran",
        READ_OFTEN,
        do(lambda s: s.container.catalogue.save_robot(replace(s.robot("R1"), hand_over=HandOver.WHEN_FREE))),
        plan(window=60, every=5, overlap=Overlap.QUEUE),
        each(
            [303, robot_pauses(), 357, states(EXECUTING, WAITING)],
            [299, hold(), 2, keep(), release(), 302, robot_pauses(), 57, states(WAITING, EXECUTING)],
        ),
        [do(lambda s: s.noted.append(s.states())), edit(overlap=Overlap.SKIP)],
        [delete(), undo(), true(lambda s: s.states() == s.noted[-1])],
        stays_open=True,
    ),
)


# ---------------------------------------------------------------------- between a decision and what carries it out
def just_after(monkeypatch, owner, name, act):
    """Once, when that was called."""
    usual = getattr(owner, name)

    def and_then(*arguments, **named):
        found = usual(*arguments, **named)
        if act(found):
            monkeypatch.setattr(owner, name, usual)
        return found

    monkeypatch.setattr(owner, name, and_then)


@pytest.mark.parametrize(
    "withdrawal", [off(), delete(), edit(at="09:05"), edit(at="09:05", group_id=None, robot_id=2)], ids=str
)
def test_a_start_withdrawn_after_its_robot_was_deleted_is_not_sent_to_another(group, withdrawal):
    """The intent is on the disk, and the worker has not closed yet."""
    play(group, plan(window=30))
    act = [states(SUBMITTING), delete("robot"), withdrawal]
    once(group.container.ledger, Event.ASSIGN, after=lambda rows: play(group, *act))
    play(group, 600, sent())


def test_a_mission_edited_between_intent_and_request_leaves_as_it_is_then(group):
    play(group, plan(window=30))
    once(group.container.ledger, Event.ASSIGN, after=lambda rows: play(group, states(SUBMITTING), mission(does="Home")))
    play(group, 330, did("Home"))


@pytest.mark.parametrize("by", at_night(None, 60))
def test_a_time_to_be_done_by_that_is_put_off_while_it_is_decided_counts(group, monkeypatch, by):
    play(group, plan(window=30, finish_by=10), ALL_HELD, later(900, release()))

    def put_off(decisions):
        return any(each.too_late for each in decisions) and [play(group, edit(finish_by=by))]

    just_after(monkeypatch, allocator, "choose", put_off)
    play(group, 1500, states(COMPLETED))


@pytest.mark.long
def test_a_window_that_is_made_longer_while_it_is_ended_counts(group):
    play(group, plan(window=3), ALL_HELD, later(600, release()))
    once(group.container.ledger, Event.EXPIRE, before=lambda: play(group, edit(window=60)))
    play(group, 900, states(COMPLETED))


@pytest.mark.parametrize("on", ["robot", "group"])
def test_of_what_nothing_wants_no_intent_is_written(tmp_path, on):
    """Any cause that may have left the row waiting."""
    s = Stage(tmp_path, on, 1)
    play(s, battery(12), plan(battery=30, window=60), 330, states(WAITING))
    s.container.db.write(lambda c: c.execute("DELETE FROM schedules"))
    if on == "robot":
        ledger = s.container.ledger
        assert ledger.apply([transitions.begin(s.row(), s.robot("R1"), 0, s.clock.now())]) == []
        assert ledger.get(s.row().id).state is WAITING
    play(s, battery(90), 120, runs(0))
    s.switch_off()
