"""Robots that answer slowly, refuse, boot, are updated, know no search, or have items that can't be read: each start is followed by itself,
and one robot's trouble delays no other (D2, D7)."""

from __future__ import annotations

from datetime import timedelta

from app.domain.models import Connection, Overlap
from app.mir.errors import RobotError
from tests.services.story import *

CLEANED_UP = do(lambda s: s.cancel_all())
CONNECTED = true(lambda s: s.container.snapshots.get(1).connection is Connection.CONNECTED)


# ---------------------------------------------------------------------- items that can't be read
def spoilt(item=1):
    """From now on that item can't be read."""
    return each(do(lambda s: s.network.unreadable.add(("R1", item))), without_state(item))


def without_state(item=1):
    return do(lambda s: s.network.shown.update({("R1", item): {"state": None}}))


REPAIRED = do(lambda s: (s.network.unreadable.clear(), s.network.shown.clear()))


ARRIVES = do(lambda s: s.container.make_client(s.robot("R1")).enqueue(s.row().mission_guid, description=s.row().token))


def outcome(row):
    return row.state, row.reason and row.reason.code


def word(theirs, ours):
    return do(lambda s: s.network.words.update({theirs: ours}))


test_unreadable = cases_of(
    *(
        Story(
            f"one item holds up none of {others} others",
            [plan(priority=9), *(plan(f"B{number}") for number in range(others)), 310],
            spoilt(),
            [120 * others + 300, items(*["Done"] * (1 + others))],
            true(lambda s: {row.state for row in s.executions() if row.schedule != "A"} == {COMPLETED}),
        )
        for others in (1, 4)
    ),
    Story(
        "it is reported once, and its outcome is unknown when the list says that it is over",
        [plan(), 320],
        spoilt(),
        [
            30,
            items("Executing"),
            states(EXECUTING),
            true(lambda s: [a.count for a in s.container.alarms.open()] == [1]),
        ],
        [600, items("Done"), ends(UNKNOWN)],
    ),
    *(
        Story(
            f"the outcome of one of {1 + others} is unknown until it can be read again, after {spoilt_for} s",
            [plan(priority=9), *(plan(f"B{number}") for number in range(others)), 320],
            without_state() if others else spoilt(),  # many are read from one list
            [120 * others + 300, true(lambda s: outcome(s.row("A")) == UNKNOWN)],
            [spoilt_for, REPAIRED, 60, true(lambda s: {outcome(row) for row in s.executions()} == {DONE})],
            true(lambda s: "unknown_outcome" not in s.alarms()),
        )
        for spoilt_for in (3, 3600)
        for others in (0, 3)
    ),
    *(
        Story(
            f"the late request of a cancelled start is cancelled as number {number}",
            [plan(), post(LOST), *before, 60, robot_pauses(), 5, ARRIVES],
            spoilt(number),
            [60, items(*["Aborted"] * number), ends(CANCELLED), raised("late_cancelled")],
            mark=NUMBERED if number > 1 else None,
        )
        for number, before in ((1, [306, cancel(), 60]), (2, [450, cancel()]))
    ),
    Story("readable again it is followed further", [plan(), 320], spoilt(), [30, REPAIRED, 300, ends(DONE), tries(1)]),
    Story(
        "a stranger's stops nothing",
        [plan(), rest("Deliver"), 280, stranger()],
        spoilt(),
        [1220, states(COMPLETED, COMPLETED)],
    ),
    Story(
        "an unknown outcome is found next to a stranger's",
        [plan(), post(ANSWER_LOST), 300.1, stranger()],
        spoilt(2),
        [600, ends(DONE), tries(1)],
    ),
    Story(
        "ended with an unknown word it ends its row with that word",
        each(
            [word("Done", "Superseded"), plan(), 320],
            [
                word("Aborted", "Superseded"),
                plan(),
                320,
                do(lambda s: s.cancel_all()),
            ],
        ),
        [400, ends((FAILED, ReasonCode.ROBOT_ABORTED))],
        true(lambda s: "Superseded" in str(dict(s.row().reason.details))),
    ),
    Story(
        "an unknown word of a running one ends nothing",
        [word("Executing", "Negotiating"), plan(), 350, items("Executing")],
        [true(lambda s: s.row().state.is_open), 300, ends(DONE)],
    ),
    Story(
        "it does not block its robot for new starts",
        [plan(every=10, overlap=Overlap.QUEUE), 310],
        spoilt(),
        [650, items("Done", "Executing")],
        stays_open=True,
    ),
)

# ---------------------------------------------------------------------- slow answers
BEFORE_SIX = 14.5  # s at which these begin, so that a poll begins half a second before the start
DUE = BEFORE_SIX + 300.0
SLOW_SITE = {"now": BEGIN - timedelta(seconds=BEFORE_SIX)}
POLLED = set_up(poll_interval_seconds=14)


def late_by(most, robot="R1"):
    return true(lambda s: [post.at - DUE <= most for post in s.network.posts(robot)] == [True])


test_slow = cases_of(
    *(
        Story(
            "a reading during the instant delays the start until its end",
            POLLED,
            each(plan(window=1), plan(window=15)),
            [DUE - 0.55, meets("GET", "*", SLOW, lasts), 200, ends(DONE), tries(1), late_by(lasts + 0.5), runs(1)],
            **SLOW_SITE,
        )
        for lasts in (3.0, 4.5, 9.0)
    ),
    Story(
        "a slow robot delays no other",
        [POLLED, plan(), plan("B", on=2)],
        each(*(DUE - before for before in (0.1, 0.55, 1.3))),
        [meets("*", "*", SLOW, 9.0, robot="R1"), 60, late_by(0.2, "R2"), 200],
        robots=2,
        **SLOW_SITE,
    ),
    Story(
        "a second try is sent although each search for the first takes three seconds",
        [plan(), others_continue(), post(REFUSED), meets("POST", "/mission_queue/search", SLOW, 3.0, count=100), 360],
        [tries(2), runs(1), 200],
    ),
    Story(
        "a second try held while the robot is asked about the first is not sent",
        [plan(window=60, battery=30), others_continue(), post(LOST), 320, battery(12)],
        [
            until(lambda s: s.row().wait is BATTERY),
            battery(90),
            meets("POST", "/mission_queue/search", SLOW, 4.0, count=2),
        ],
        [later(3.0, hold()), 60, sent(300), waits(HOLD)],
        stays_open=True,
    ),
    Story(
        "a good answer to the request itself after nine seconds is an answer",
        [plan(), post(SLOW, 9.0), 315, states(EXECUTING), tries(1), runs(1), 200],
    ),
)

# ---------------------------------------------------------------------- robots that refuse, boot, are updated or know no search
TEN_OLDEST = [stranger("Home", count=20), CLEANED_UP, 1, do(lambda s: setattr(s.network, "short_lists", 10))]


@step
def updated(s, forgets):
    """The robot restarts with a software that gives descriptions back, or doesn't."""
    s.machines["R1"].catch_up()
    s.machines["R1"].reboot(30.0)
    s.network.forgets_descriptions = forgets
    s.run(120)


THREE = [plan(), plan("B", "06:15"), plan("C", "06:35")]

test_odd_robots = cases_of(
    Story(
        "a cancel that can't be sent is carried out when it can",
        [plan(), 320],
        each(*(meets("DELETE", "*", fate, count=3) for fate in (REFUSED, LOST, ERROR_BEFORE))),
        [cancel(), true(lambda s: s.row().state.is_open and s.row().cancel_code is ReasonCode.USER_CANCELLED), 60],
        [items("Aborted"), ends(CANCELLED), tries(1)],
    ),
    Story(
        "a cancel is not forgotten after a long absence of the robot",
        [robot_pauses(), plan(), 320, down("R1"), cancel(), 600, off_for(20), up(), 60],
        [items("Aborted"), ends(CANCELLED), tries(1)],
    ),
    Story(
        "an item that ended before keeps its outcome",
        [plan(), 320, down(), cancel(), 300, up(), 60, ends(DONE), tries(1)],
    ),
    Story(
        "a cancel that the robot refused is not carried out later",
        [plan(window=60), plan("B", window=60), 304, meets("DELETE", "/mission_queue/2", NOT_FOUND)],
        each(
            refused(do(lambda s: s.container.operator.cancel_execution(s.row("B").id)), error=RobotError),
            refused(do(lambda s: s.container.operator.cancel_item(1, s.row("B").queue_id)), error=RobotError),
        ),
        [600, states(COMPLETED, COMPLETED)],
    ),
    Story(
        "an interface that has just started has lost nothing",
        [plan(), 320],
        each(*(meets("GET", "/mission_queue/1", NOT_FOUND, count=count) for count in (1, 2))),
        [300, items("Done"), ends(DONE), tries(1)],
    ),
    Story(
        "a robot that has no interface yet is tried again",
        plan(),
        each([298, meets("*", "*", NOT_FOUND, count=4), 300], [post(NOT_FOUND), 600, tries(2)]),
        [ends(DONE), runs(1)],
    ),
    Story(
        "without proof that it is not there nothing is sent again",
        [TEN_OLDEST, plan()],
        each(post(ANSWER_LOST), post(LATE), post(ERROR_AFTER)),
        [1500, sent(300), tries(1), true(lambda s: s.row().state is COMPLETED or "unknown_outcome" in s.alarms())],
        true(lambda s: s.row().state is COMPLETED or s.row().reason.code is ReasonCode.UNKNOWN_OUTCOME),
    ),
    Story(
        "a lost request is sent again only with proof, or reported to a person",
        [TEN_OLDEST, plan(), post(LOST), later(310.0, stranger("Home")), 1500],
        true(
            lambda s: (
                (s.row().state, s.row().attempts) == (COMPLETED, 2)
                or (s.row().reason.code is ReasonCode.UNKNOWN_OUTCOME and "unknown_outcome" in s.alarms())
            )
        ),
        true(lambda s: [i.description for i in s.all_items()].count(s.row().token) == s.row().attempts - 1),
    ),
    Story(
        "with a long history a lost answer is found",
        [TEN_OLDEST, stranger("Home", count=150), CLEANED_UP, plan(), plan("B", "06:06"), post(ANSWER_LOST), 600],
        [ends(DONE, DONE), tries(1, 1), true(lambda s: [post.at // 30 for post in s.network.posts()] == [10, 12])],
    ),
    Story(
        "a start that was never sent is not looked for",
        [TEN_OLDEST, stranger("Home", count=150), CLEANED_UP, plan(), later(290, down("R1")), 1300],
        [true(lambda s: s.row().attempts > 1), up(), off_for(), 60, CONNECTED],
    ),
    Story("on such a robot starts run as on any other", [TEN_OLDEST, plan(), 600, ends(DONE), tries(1)]),
    Story(
        "a sleep between connecting and sending: after the window nothing is sent, within it once",
        plan(),
        each(*([post(Fate.ASLEEP, seconds), 600, runs(0)] for seconds in (1000.0, DAY))),
    ),
    Story(
        "after a sleep shorter than the window it is sent once",
        plan(),
        each(*([post(Fate.ASLEEP, seconds), 600, runs(1), ends(DONE)] for seconds in (3.0, 300.0))),
    ),
    Story(
        "after an update that drops tokens a lost answer is not sent again",
        [THREE, 600, post(LOST), later(310.0, stranger()), 700, updated(True), post(ANSWER_LOST), 1500],
        [states(COMPLETED, COMPLETED, COMPLETED), true(lambda s: len([at for at in sent_at(s) if at > 2000]) == 1)],
    ),
    Story(
        "after an update that returns tokens a stranger's item is not taken for the app's",
        [do(lambda s: setattr(s.network, "forgets_descriptions", True)), THREE, 600, post(ANSWER_LOST), 600],
        [updated(False), post(LOST)],
        do(lambda s: s.at(2110 - s.seconds(), lambda: s.stranger_queues(user="distributor"))),
        [1500, states(COMPLETED, COMPLETED, COMPLETED)],
        true(lambda s: len({row.queue_id for row in s.executions()} & {i.id for i in s.items() if i.description}) == 3),
    ),
    Story(
        "where tokens are lost, a start that was never sent is not taken to be another one's item",
        do(lambda s: setattr(s.network, "forgets_descriptions", True)),
        [plan(), plan("B"), post(ERROR_AFTER)],
        each([290, down("R1"), 110, up()], later(299.9, meets("GET", "/status", REFUSED, count=2))),
        [900, ends(DONE, DONE), runs(2)],
        true(lambda s: sorted(post.token for post in s.network.posts()) == sorted(row.token for row in s.executions())),
    ),
)
