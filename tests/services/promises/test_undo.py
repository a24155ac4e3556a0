"""What is deleted, cancelled or skipped and brought back: it runs once, as it is defined then, or a sentence says why not."""

from __future__ import annotations

from dataclasses import replace

from app.domain.execution import Trigger
from app.domain.models import Connection, Overlap
from app.services.catalogue.undo import may_wait_again
from tests.services.story import *

MOVED = edit(at="24T06:05")
THERE_AND_BACK = each([delete(), undo()], [delete("mission"), undo()], [delete("robot"), undo()], [off(), 30, on()])
DELETIONS = each(delete(), delete("mission"), delete("robot"))
WAITS_OR_DOUBT = each([battery(12), 306], [post(LOST), 306])
FIRST_REMOVED = [plan(window=60), while_posting(delete("robot")), 310]
NEXT_IS_THERE = "the next start of its schedule is there already"
LONG_AWAY = "this start no longer waits and can't wait again"
SINCE = "its schedule has been changed since"

test_a_deletion_undone = cases_of(
    Story(
        "a waiting start is there again",
        [battery(12), plan(battery=30), 360, waits(BATTERY)],
        THERE_AND_BACK,
        [60, waits(BATTERY), battery(80), 300, ends(DONE), tries(1), items("Done")],
    ),
    Story(
        "a start that waits for its next try is there again",
        [plan(window=60), down("R1"), 306, states(WAITING)],
        DELETIONS,
        [3, undo(), up(), 600, items("Done")],
    ),
    Story(
        "a start in doubt runs once, within its window",
        [plan(window=60)],
        each([post(LOST), 306], [post(LATE, 30.0), 306], [post(ANSWER_LOST), 306]),
        DELETIONS,
        each(3, 120),
        [undo(), 500, items("Done")],
    ),
    Story(
        "the history is not read for it",
        each(set_up(history_limit=1), set_up(history_limit=None)),
        [plan(window=60, battery=30), plan("B", on=2)],
        each([battery(12, "R1"), 306], [post(LOST, robot="R1"), 306]),
        [delete("robot"), 240, undo(), battery(90), 1200],
        [runs(2), not_raised("duplicate_running")],
        robots=2,
    ),
    Story(
        "a restored start runs the mission that was corrected since",
        plan(window=60, battery=30),
        WAITS_OR_DOUBT,
        [delete(), mission(does="Home"), 3, undo(), battery(90), 500, did("Home")],
    ),
    Story(
        "a start paused in doubt stays so when its schedule is off and on, or deleted and restored",
        [plan(window=60), post(LOST), 306, pause(), 2],
        each([off(), 2, on()], [delete(), undo()]),
        [600, runs(0), ends(PAUSED), tries(1)],
    ),
    Story(
        "a start ended by switching off its robot stays so",
        [plan(window=60), post(LOST), 306],
        each(
            [robot_off(), 2, robot_on(), 2, delete(), 3, undo()],
            [robot_off(), 2, robot_on(), 2, delete(), 120, undo()],
            [robot_off(), 2, robot_on()],
            [robot_off(), 2, robot_on(), off(), 2, on()],
            [delete(), 2, robot_off(), 2, robot_on(), 3, undo()],
            [delete(), 2, robot_off(), 2, robot_on(), 120, undo()],
        ),
        [500, runs(0)],
    ),
    Story(
        "a start stopped by a person stays stopped",
        [battery(12), plan(battery=30), 360],
        each([robot_off(), 30, robot_on()], [pause(), 30, resume()]),
        [battery(80), 300, runs(0)],
    ),
    Story(
        "a start withdrawn before is not wanted again",
        [plan(window=60), post(LOST), 306],
        each(off(), MOVED),
        [delete(), 3, undo(), 500, runs(0), ends(CHANGED), tries(1)],
    ),
    Story(
        "a start in doubt is wanted again when its edit is undone",
        [plan(window=60), post(LOST), 306],
        each([off(), 3, on()], [edit(at="06:10"), 3, edit(at="06:05")]),
        [600, items("Done"), ends(DONE), tries(2)],
    ),
    Story(
        "a run is followed again when its robot is restored",
        [plan(), 320, states(EXECUTING), delete("robot"), 3, undo(), 300, ends(DONE), tries(1)],
    ),
    Story(
        "after the window nothing is restored",
        [
            battery(12),
            plan(battery=30),
            360,
            delete(),
            battery(80),
            1200,
            undo(),
            300,
            runs(0),
            states(State.CANCELLED),
        ],
    ),
    Story("a finished start does not run again", [plan(), 480, delete(), undo(), 300, sent(300), ends(DONE)]),
    Story(
        "one deletion is undone once",
        [set_up(history_limit=1), plan(window=60), plan("B", "06:08", window=60), hold("R1"), 310],
        [delete(), do(lambda s: s.noted.append(s.removed[0])), undo(), release(), 500, delete()],
        [refused(do(lambda s: s.container.catalogue.restore(s.noted[0]))), 60],
    ),
    Story(
        "a setting can be changed while a start of a deleted schedule is in doubt",
        [plan(window=60), post(LOST), 306, delete(), set_up(start_window_minutes=60), states(SUBMITTING), 500],
    ),
    Story(
        "all starts that waited together are there again",
        [plan(window=60, battery=30, every=5, overlap=Overlap.QUEUE), battery(12), 660, states(WAITING, WAITING)],
        [edit(overlap=Overlap.SKIP), delete(), undo(), states(WAITING, WAITING)],
        stays_open=True,
    ),
    Story(
        "a robot is restored even if the history has forgotten what may still arrive at it",
        [set_up(history_limit=1), plan(window=60), plan("B", on=2, every=5), post(LOST, robot="R1"), 420],
        [delete("robot"), true(lambda s: s.container.db.read().execute("SELECT * FROM watches").fetchall())],
        [400, undo(), true(lambda s: [robot.name for robot in s.container.catalogue.robots()] == ["R1", "R2"])],
        robots=2,
        stays_open=True,
    ),
    Story(
        "a start that was not sent is always in one state",
        [plan(window=60), while_posting(delete(), later(0.05, undo())), 500, items("Done")],
    ),
)

test_a_deletion_undone_of_a_group = cases_of(
    Story(
        "a robot's undo restores no start that was withdrawn since",
        [plan(window=60), post(LOST), 306, delete("robot"), 3],
        each(off(), MOVED, delete(), pause()),
        [3, undo(0), 500, runs(0)],
        on="group",
        robots=3,
    ),
    Story(
        "the last robot's undo restores no start that was withdrawn since",
        [plan(window=60), down(), battery(1), 306, states(WAITING), delete("robot"), 3, states(State.CANCELLED)],
        each(off(), MOVED, delete(), pause()),
        [up(), battery(90), 3, undo(0), 500, runs(0)],
        on="group",
    ),
    Story("no start is left in doubt at no robot", FIRST_REMOVED, [undo(), 10800, ends(DONE), runs(1)], on="group"),
    Story(
        "the first robot's undo opens nothing that the second had",
        [plan(window=60), while_posting(delete("robot"), post(LOST)), 310, delete("robot"), 3],
        each([undo(0), 10800], [undo(0), 60, undo(0), 7200]),
        on="group",
        robots=2,
    ),
    Story(
        "no start is restored next to a later one of a schedule that skips",
        [robot_off("R2"), down("R1"), battery(1, "R1"), plan(window=60, every=10), 306],
        [delete("robot"), 60, robot_on("R2"), until(lambda s: s.executions(EXECUTING)), up(), battery(90), undo(), 8],
        true(lambda s: len(s.executions(SUBMITTING, QUEUED, EXECUTING)) == 1),
        on="group",
        robots=2,
        stays_open=True,
    ),
    Story(
        "a start that a deleted robot may have goes to no other by the undo of another deletion",
        plan(window=60),
        each(post(ANSWER_LOST), post(LATE, 30.0)),
        [until(lambda s: s.network.posts()), 0.5, states(SUBMITTING)],
        each(delete(), delete("mission"), delete("group")),
        [delete("robot"), 1, undo(0), 500, true(lambda s: len(s.network.posts()) == 1)],
        on="group",
        robots=2,
    ),
    Story(
        "a start that is given back while its deletion is undone",
        [plan(window=60), post(LOST), 306, delete(), 85, down("R2"), until(lambda s: not s.executions(SUBMITTING))],
        [undo(), up(), 500, runs(1)],
        on="group",
        robots=3,
    ),
)


WAITING_FOR_CHARGE = [battery(12), plan(rule="FREQ=DAILY", battery=30, window=20), 310, cancel()]

test_a_cancel_undone = cases_of(
    Story(
        "it runs once, and its undo pressed twice says so",
        [WAITING_FOR_CHARGE, true(lambda s: may_wait_again(s.row())), 3, want_again(), states(WAITING)],
        each([], [off_for()]),
        [battery(80), 600, ends(DONE), runs(1), refused(want_again(), LONG_AWAY), runs(1)],
    ),
    Story("while it is cancelled nothing is sent", [WAITING_FOR_CHARGE, battery(80), 600, runs(0)]),
    Story(
        "a start that may have been sent stays cancelled",
        [post(REFUSED), plan(window=20), 301, cancel(), tries(1), refused(want_again(), LONG_AWAY)],
    ),
    Story(
        "a cause that would have ended it keeps it ended",
        [WAITING_FOR_CHARGE, 1],
        each(
            [1200, refused(want_again(), "it is too late for this start")],
            [edit(at="09:05"), refused(want_again(), SINCE)],
            [off(), refused(want_again(), SINCE)],
            [pause(), refused(want_again(), SINCE)],
            [delete(), refused(want_again(), "this schedule no longer exists")],
            [robot_off(), refused(want_again(), "is switched off in Settings")],
            [delete("robot"), refused(want_again(), "this robot no longer exists")],
        ),
        [battery(80), 600, runs(0)],
    ),
    Story(
        "a next start that would have been skipped replaces it",
        battery(12),
        each(
            [plan(every=5, battery=30, window=20), 310, cancel(), 300, refused(want_again(), NEXT_IS_THERE)],
            [
                plan(every=5, battery=30, window=20, overlap=Overlap.QUEUE),
                310,
                cancel(),
                300,
                want_again(),
                waits(*[BATTERY] * 2),
            ],
        ),
        stays_open=True,
    ),
    Story(
        "any robot of a group gets it again",
        [stranger(robot=name, count=5) for name in ("R1", "R2", "R3")],
        [plan(window=30), 310, cancel(), 2, want_again(), 5, states(WAITING)],
        [true(lambda s: s.row().robot_id is None), 1500, states(COMPLETED)],
        on="group",
        robots=3,
    ),
    Story(
        "it runs its mission as defined then",
        [battery(12), plan(window=60, battery=30), 306, cancel(), 3, states(State.CANCELLED), mission(does="Home")],
        [want_again(), battery(90), 600, did("Home")],
    ),
    Story(
        "an idle mission can't be undone",
        [WAITING_FOR_CHARGE, true(lambda s: not may_wait_again(replace(s.row(), trigger=Trigger.IDLE)))],
    ),
)


test_one_failed_read = cases_of(
    Story(
        "an alarm of an earlier run stays when a later one turns out to have arrived",
        READ_OFTEN,
        [plan(every=10, window=1), mission(guid="00000000-0000-0000-0000-000000000001"), 310, states(FAILED)],
        [raised("execution_failed"), mission(does="Deliver"), set_up(unknown_outcome_quiet_seconds=60), 585],
        [post(LATE, 201.5), later(8, down()), later(185, up()), 150, raised("execution_failed", "unknown_outcome")],
        [300, states(FAILED, COMPLETED), raised("execution_failed")],
    ),
    Story(
        "between two polls it makes no robot unreachable for the rest",
        [set_up(poll_interval_seconds=600), plan(), 310, meets("GET", "/mission_queue/1", REFUSED), 20],
        [true(lambda s: s.container.snapshots.get(1).connection is Connection.CONNECTED), items("Executing")],
        stays_open=True,
    ),
    Story(
        "two of them a minute apart raise no alarm",
        [set_up(poll_interval_seconds=600), plan(), 305, meets("GET", "/mission_queue/1", REFUSED), 62],
        [meets("GET", "/mission_queue/1", REFUSED), 6, not_raised("unreachable")],
        stays_open=True,
    ),
    Story(
        "a group's start is on time long afterwards",
        [set_up(poll_interval_seconds=600), plan(), plan("B", "06:07"), 304],
        [meets("GET", "/mission_queue/1", REFUSED, robot=name) for name in ("R1", "R2")],
        [300, sent(300, 420)],
        on="group",
        robots=2,
    ),
    Story(
        "a robot with a readable status but never a queue raises an alarm",
        each(set_up(poll_interval_seconds=30), set_up(poll_interval_seconds=120)),
        60,
        each(
            *(
                [
                    meets("GET", "/mission_queue", fate, count=5000),
                    meets("POST", "/mission_queue/search", fate, count=5000),
                ]
                for fate in (REFUSED, ERROR_BEFORE, LOST)
            )
        ),
        [1200, true(lambda s: {"unreachable", "not_a_robot"} & set(s.alarms()))],
    ),
)
