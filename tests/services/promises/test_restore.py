"""After a backup was put back robots are asked for everything of the restored time before anything is sent; a copied data directory sends
nothing until a person has decided (D8, D9)."""

from __future__ import annotations

from app.domain.reasons import sentence, waiting_sentence
from app.screens.frame.facts import late_starts
from app.screens.frame.view import counting_down
from mir_sim.mission_queue import MissionQueue
from tests.services.story import *
from tests.support.site import Site

ONCE = true(lambda s: len(s.network.posts()) == 1)
TEN_OLDEST = do(lambda s: setattr(s.network, "short_lists", 10))
CLEANED_UP = do(lambda s: s.cancel_all())
OFF_AND_ON = [app_off(), do(lambda s: s.clock.advance(250)), app_on()]


@step
def backed_up_as_the_request_leaves(s):
    def met(where):
        if where == "after POST /mission_queue":
            s.network.interrupt = lambda where: None
            play(s, backup())

    s.network.interrupt = met


def failed_before(start):
    """A start that was tried before the backup and ran after it."""
    return [start, states(WAITING), backup(), up(), 200, items("Done"), restored(), 300, ONCE, ends(DONE)]


test_restored = cases_of(
    Story(
        "a start tried before the backup that ran since is not sent again",
        each(failed_before([plan(), down("R1"), 303]), failed_before([down("R1"), run_now(), 40])),
    ),
    Story(
        "a start missing in the backup is found on the robot",
        [plan(), 60, backup(), until(lambda s: s.executions(COMPLETED)), restored(), 300, ends(DONE), runs(1)],
        [raised("backup_restored"), not_raised("app_was_off")],
    ),
    Story(
        "restored by a clock that is days behind, then corrected: what ran since the backup was not missed",
        [plan(), 60, backup(), 350, ONCE, clock(-3 * 86400), 40, restored(), 60, clock(3 * 86400), 120],
        [raised("backup_restored"), not_raised("app_was_off")],
    ),
    Story(
        "an absence after the restore counts as usual",
        [60, backup()],
        each([], clock(3 * 86400, -3 * 86400)),
        [restored(), 60, off_for(600), 60, raised("app_was_off")],
    ),
    Story(
        "a robot whose items can only be read one by one answers too",
        [stranger("Home", count=350), CLEANED_UP, TEN_OLDEST, plan(window=60), 200, backup()],
        each(20, 400),
        [restored(), 900, ONCE, true(lambda s: [str(i.state) for i in s.all_items()].count("Done") == 1), ends(DONE)],
    ),
    Story(
        "restored with a clock that was behind: runs are not repeated",
        [plan(window=120), 200, backup(), 300, items("Done"), restored(behind=3600.0), 300, ONCE],
    ),
    Story(
        "restored with a clock far ahead: starts are a little late, only for minutes",
        [plan(at="06:10", every=10), 200, backup(), restored(behind=-3e8), 300, sent(), 200, off_for(20), 1300],
        sent(602, 1202, 1800),
        stays_open=True,
    ),
    Story(
        "restored while the tablet is ahead, then corrected: nothing is sent twice",
        [plan(window=60), clock(40), 120, backup(), 150, ONCE, restored(clock(-40)), 900, ONCE],
    ),
    Story(
        "restored by a clock set back since: a run whose time comes again is not repeated",
        [plan(window=60), 60, backup(), 350, ONCE, restored(clock(-200), behind=200.0), 900, ONCE, ends(DONE)],
    ),
    Story(
        "restored after the clock was set back: a run whose time comes again is not repeated",
        [plan(window=60), 60, backup(), 350, ONCE, clock(-300), 40, restored(), 900, ONCE, ends(DONE)],
    ),
    Story(
        "a run from before the robot's numbers began again is found if visible",
        [stranger(count=5), CLEANED_UP, plan(at="06:02"), plan("B", "06:10", window=60), 500, backup()],
        [do(lambda s: setattr(s.machines["R1"], "queue", MissionQueue())), 300, items("Done"), restored(), 120],
        [states(COMPLETED, COMPLETED), items("Done")],
        mark=OWN_QUEUE,
    ),
    Story(
        "a start waiting in the backup that ran since is not sent again",
        [battery(12), plan(battery=30)],
        each([303, backup()], [363, backup()]),
        [battery(90), 200, restored(), 300, ONCE, ends(DONE)],
    ),
    Story(
        "a start being sent when the backup was made is looked for",
        [
            plan(),
            post(ANSWER_LOST),
            backed_up_as_the_request_leaves(),
            500,
            items("Done"),
            restored(),
            300,
            ONCE,
            ends(DONE),
        ],
    ),
    Story(
        "a start cancelled since is sent at most once",
        [plan(), 60, backup(), 260, cancel(), 30, restored(), 300, ONCE, states(State.CANCELLED)],
    ),
    Story(
        "a start due after the restore is prepared as usual",
        [plan(every=10), 30, backup(), 400, restored(), 469.95],
        [true(lambda s: (s.row().planned_at.minute, s.row().state) == (15, SUBMITTING)), 300, sent(300, 900)],
        stays_open=True,
    ),
    Story(
        "before the first try after the restore the robot is asked, even if it answers late",
        each([], robot_pauses()),
        [plan(), down("R1"), 303, backup(), up(), 200, down("R1"), restored(), 60, up(), 300, runs(1)],
        true(lambda s: s.row().state in (QUEUED, COMPLETED)),
        stays_open=True,
    ),
)

ON_R1 = [plan(window=30), 60]
NOTHING_ON_R1 = true(lambda s: s.network.posts("R1") == [])
BACK_AND_RAN_ON_R2 = [ON_R1, backup(), edit(robot_id=2), 340, items("Done")]
IS_R2S = true(lambda s: [(row.robot, row.state) for row in s.executions()] == [("R2", COMPLETED)])

test_on_another_robot_since = cases_of(
    Story(
        "a run on another robot is not sent to the one named in the backup",
        each(
            [BACK_AND_RAN_ON_R2, restored()],
            [ON_R1, post(LATE, 50.0), backup(), edit(robot_id=2), 250, items(), restored()],
            [ON_R1, robot_off("R2"), backup(), robot_on("R2"), edit(robot_id=2), 340, items("Done"), restored()],
        ),
        [600, NOTHING_ON_R1, IS_R2S, items("Done")],
        robots=3,
    ),
    Story(
        "a start still running on another robot is followed there",
        [ON_R1, backup(), edit(robot_id=2), robot_pauses("R2"), 340, restored(), 30],
        true(lambda s: [(row.robot, row.state) for row in s.executions()] == [("R2", QUEUED)]),
        [robot_goes_on("R2"), 120, IS_R2S, NOTHING_ON_R1],
        robots=3,
    ),
    Story(
        "another robot that answers late is waited for, and the start says so",
        [BACK_AND_RAN_ON_R2, down("R2"), restored(), 300, states(WAITING)],
        true(lambda s: waiting_sentence(s.row()) == "May have run already, waits until 06:35 for an answer from R2"),
        [up(), 120, NOTHING_ON_R1, IS_R2S],
        robots=3,
    ),
    Story(
        "nothing is sent when it never answers, and the reason says so",
        [BACK_AND_RAN_ON_R2, down("R2"), restored(), 2400, NOTHING_ON_R1],
        true(lambda s: sentence(s.row().reason, "UTC").endswith("it may have run already, and R2 did not answer")),
        true(lambda s: sentence(s.row().reason, "UTC").startswith("Its start window closed at 06:35: ")),
        robots=3,
    ),
    Story(
        "a start that no robot has is sent once all have answered",
        [ON_R1, hold(), 260, backup(), restored(), release(), 100],
        [true(lambda s: [(p.robot, round(p.at / 10)) for p in s.network.posts()] == [("R1", 41)]), 200],
        robots=3,
    ),
    Story(
        "an absent robot delays no start after the restore",
        [ON_R1, down("R3"), backup(), restored(), 200, off_for(60), 60],
        [true(lambda s: [round(post.at / 10) for post in s.network.posts("R1")] == [32]), 200],
        robots=3,
    ),
)

NONE_LISTED = true(lambda s: counting_down(late_starts(s.executions(), {})) == [])
LISTED = until(lambda s: counting_down(late_starts(s.executions(), {})), 120)

test_with_a_window = cases_of(
    Story(
        "no robot is asked about starts that have run",
        [plan(), 200, backup(), 250, ONCE, restored(), [[1, NONE_LISTED] for _second in range(200)], ends(DONE), ONCE],
        with_window=True,
    ),
    Story(
        "a start that has not run is listed for half a minute once that is known",
        [plan(), 200, backup(), OFF_AND_ON, restored()],
        each([30, NONE_LISTED], [20, hold("R1"), 10, release()], [20, hold("R1"), 300, release()]),
        [LISTED, sent(), 28, sent(), 32, ONCE, 200],
        with_window=True,
    ),
)

MOVE_HERE = do(lambda s: s.container.tablet.move_here())
VIEW_ONLY = do(lambda s: s.container.tablet.view_only())
TWO_TABLETS = on_copy(raised("two_tablets"))
R1_HELD = true(lambda s: s.container.holds.active(1) is not None)
OFTEN = [plan(every=10), 30, copied()]

test_copied_to_another_tablet = cases_of(
    Story("both run each start once", [plan(), 30, copied(), on_both(420), items("Done"), ends(DONE)]),
    Story(
        "nothing is sent until a person decides",
        [plan(), 30, copied(), on_copy(420, true(lambda s: s.container.tablet.is_copy), states(WAITING)), sent()],
    ),
    Story(
        "a second app on the same tablet sends nothing either",
        [plan(), 30, copied(tablet=Site.tablet), on_both(420), items("Done"), on_copy(states(WAITING)), ends(DONE)],
    ),
    Story(
        "moved here, the old tokens are looked for and new ones used",
        [
            plan(every=10),
            post(ANSWER_LOST),
            300.5,
            copied(),
            on_copy(MOVE_HERE, 900, ends(DONE, DONE)),
            items("Done", "Done"),
        ],
        stays_open=True,
    ),
    Story(
        "moved here, an earlier run on another robot is not sent again",
        [ON_R1, copied(), edit(robot_id=2), 340, items("Done"), on_copy(MOVE_HERE, 600, IS_R2S), NOTHING_ON_R1],
        robots=3,
    ),
    Story("viewed only, nothing is sent", [plan(), 30, copied(), on_copy(VIEW_ONLY, 1500), sent()]),
    Story(
        "if both tablets run after a move everything is held and reported",
        [OFTEN, on_copy(MOVE_HERE), on_both(420), on_copy(R1_HELD), TWO_TABLETS, true(lambda s: len(s.items()) <= 2)],
        stays_open=True,
    ),
    Story(
        "the alarm of it ends with the hold that it asks to release",
        [POLLED_OFTEN, OFTEN, on_copy(MOVE_HERE), on_both(300), on_copy(release(), 30)],
        on_copy(true(lambda s: s.container.holds.active(1) is None)),
        on_copy(
            true(lambda s: [bool(a.cleared_at) for a in s.container.alarms.open() if a.code == "two_tablets"] == [True])
        ),
        stays_open=True,
    ),
    Story(
        "the other tablet is found even if its mission ended before the robot was read",
        [OFTEN, on_copy(set_up(poll_interval_seconds=480), MOVE_HERE), on_both(800), TWO_TABLETS],
        stays_open=True,
    ),
    Story(
        "a Run now on it is refused and says why",
        [plan(), 30, copied()],
        each([], on_copy(VIEW_ONLY)),
        on_copy(refused(run_now(), "is a copy"), states()),
    ),
)

test_history = cases_of(
    Story(
        "the list of old tokens is limited",
        [set_up(history_limit=3, poll_interval_seconds=600), plan(every=5), 3600],
        true(lambda s: [row.planned_at.minute for row in s.executions(COMPLETED)] == [45, 50, 55]),
        stays_open=True,
    ),
)
