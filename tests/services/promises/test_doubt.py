"""What became of a request, or of what a robot took, is not known for a while: of several items of one start exactly one runs, its row
says what its item says (D8)."""

from __future__ import annotations

from app.domain.models import Connection
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.client import RobotClient
from app.mir.enterprise_vehicle import EnterpriseVehicle
from mir_sim.mission_queue import MissionQueue
from tests.services.story import *
from tests.support import targets

RARELY = set_up(poll_interval_seconds=600)
NOT_FOR_A_WHILE = [down("R1"), 120, up()]
CLEANED_UP = do(lambda s: s.cancel_all())
FAILED_UNKNOWN = [ends(UNKNOWN), tries(1)]
WINDOW_OVER = (FAILED, ReasonCode.WINDOW_CLOSED)
CONNECTED = true(lambda s: s.container.snapshots.get(1).connection is Connection.CONNECTED)


@step
def begin_again(s):
    """The robot's numbers do."""
    s.machines["R1"].catch_up()
    s.machines["R1"].queue = MissionQueue()


@step
def copied(s):
    """The network has doubled the request."""
    row = s.row()
    s.noted.append(s.container.make_client(s.robot("R1")).enqueue(row.mission_guid, description=row.token))


def reports_item(number):
    """Of the robot's items that one, from 1."""
    alarms = lambda s: [alarm.details.get("queue_id") for alarm in s.container.alarms.open()]  # noqa: E731
    return true(lambda s: s.items()[number - 1].id in alarms(s))


LATE_FIRST = [plan(), post(LATE, 130.0), 385, hold(), 45.5, release()]  # lands just before the second try

test_copies = cases_of(
    Story(
        "a late item that arrives just before the second try is the app's",
        [LATE_FIRST, 900, ends(DONE), true(lambda s: s.row().queue_id == s.items()[0].id and len(s.doubled()) == 0)],
    ),
    Story(
        "of two that both wait the earlier one stays",
        [RARELY, robot_pauses(), plan(), post(LATE, 110.0), 500, items("Pending", "Aborted"), robot_goes_on(), 600],
        [ends(DONE), true(lambda s: s.row().queue_id == min(item.id for item in s.items()))],
        mark=NUMBERED,
    ),
    Story(
        "a first try that arrives after the second is cancelled even if robots are rarely polled",
        [RARELY, plan(), post(LATE, 110.0), 900, sent(300, 395), items("Done", "Aborted"), raised("duplicate_healed")],
        mark=NUMBERED,
    ),
    Story(
        "a second copy that ran unseen is reported once, also by the next run of the app",
        [plan(), post(LATE, 220.0)],
        each([515, NOT_FOR_A_WHILE], [500, off_for(), 10, NOT_FOR_A_WHILE]),
        [300, items("Done", "Done"), reports_item(2)],
        true(lambda s: [a.count for a in s.container.alarms.open() if a.code == "duplicate_running"] == [1]),
        doubles=True,
        mark=NUMBERED,
    ),
    Story(
        "a running copy of a cancelled start is stopped",
        [plan(), post(LATE, 130.0), 400, cancel(), 300, items("Aborted", "Aborted"), ends(CANCELLED), tries(2)],
        raised("late_cancelled"),
        mark=NUMBERED,
    ),
    Story(
        "a copy that could not be cancelled and ran is not reported as cancelled",
        [plan(), post(LATE, 130.0), 320, off(), 100],
        each(*(meets("DELETE", "/mission_queue/1", fate, count=200) for fate in (LOST, REFUSED))),
        [300, items("Done"), ends(DONE), tries(1), not_raised("late_cancelled")],
    ),
    Story(
        "a copy that could not be cancelled at once is reported when it runs",
        [plan(), post(ANSWER_LOST), 303, copied(), meets("DELETE", "/mission_queue/2", LOST, count=50), 400],
        [items("Done", "Done"), raised("duplicate_running")],
        doubles=True,
        mark=NUMBERED,
    ),
    Story(
        "a copy that arrived while its start waited is seen once that has ended",
        [plan(window=5), post(LATE, 120.0), 310, hold(), 800, ends(DONE)],
    ),
)

GIVEN_UP = [plan(window=5), post(ANSWER_LOST), 300.5, down("R1")]
SILENT = [GIVEN_UP, 400, ends(UNKNOWN)]  # it has the item, and can't be asked
COMES_LATE = [set_up(unknown_outcome_quiet_seconds=400), plan(window=5), post(LATE, 461.5), 745, ends(WINDOW_OVER)]
UNSEARCHABLE = [
    [GIVEN_UP, 900, begin_again(), stranger("Home", count=150), CLEANED_UP],
    do(lambda s: setattr(s.network, "short_lists", 10)),
    up(),
]

test_given_up = cases_of(
    Story(
        "it is searched for again after any absence of the robot",
        GIVEN_UP,
        each(1800, 3 * 3600),
        [FAILED_UNKNOWN, up(), 120, ends(DONE), tries(1)],
    ),
    Story(
        "a copy that could not be cancelled after a long absence is followed when it runs",
        [RARELY, robot_pauses(), GIVEN_UP, 1800, meets("DELETE", "/mission_queue/1", LOST, count=50), up()],
        [until(lambda s: len(s.network.planned) < 50), robot_goes_on(), 900, items("Done"), ends(DONE), tries(1)],
    ),
    Story(
        "a copy that arrived while the app was off is found by the next run",
        [set_up(history_limit=1), plan(window=60), hold(), 300 + 3550, post(LATE, 400.0), release(), 100],
        [ends(WINDOW_OVER), tries(1)],
        each(
            off_for(5 * 3600),
            off_for(900),
        ),
        [60, items("Done"), ends(DONE), tries(1)],
    ),
    Story(
        "a queue that can't be searched makes a robot unreadable only for a while", [UNSEARCHABLE, 2 * 3600, CONNECTED]
    ),
    Story(
        "a later given-up start is found once the search for the older one has ended",
        [UNSEARCHABLE, 3400, plan("B", "07:17", window=1), post(ANSWER_LOST)],
        do(lambda s: s.run(4620.5 - s.seconds())),
        [down("R1"), 150, up(), ends(UNKNOWN, UNKNOWN), 120, states(FAILED, COMPLETED)],
        mark=READ_AT_ONCE,
    ),
    Story(
        "its only item, too late, is cancelled while it waits and reported correctly",
        robot_pauses(),
        each([SILENT, up(), 120], [COMES_LATE, 120]),
        [items("Aborted"), not_raised("duplicate_healed"), reports_item(1), robot_goes_on(), 300, states(FAILED)],
    ),
    Story(
        "its only item corrects the row once it is known to have run",
        [SILENT, items("Done"), up(), 300, states(COMPLETED), not_raised("duplicate_running")],
    ),
    Story(
        "its only item corrects the row while it runs",
        READ_OFTEN,
        POLLED_OFTEN,
        each([robot_pauses(), SILENT, items("Pending")], [COMES_LATE, items()]),
        [robot_goes_on(), 30, up(), 30, items("Executing"), states(EXECUTING), 300, states(COMPLETED)],
        not_raised("duplicate_running"),
    ),
    Story(
        "a withdrawn start that still ran says so",
        [plan(), post(LATE, 130.0), 310, off(), 115, ends(CHANGED), NOT_FOR_A_WHILE, 120, items("Done"), ends(DONE)],
    ),
    Story(
        "it is found although the robot's numbers have begun again",
        [stranger(count=3), CLEANED_UP, plan(window=1), post(LATE, 300.0), 420, ends(WINDOW_OVER), begin_again(), 175],
        [down("R1"), 180, items("Done"), up(), 100, ends(DONE)],
        mark=OWN_QUEUE,
    ),
)


def searches(monkeypatch):
    """The numbers above which a robot's items are asked for from now on."""
    where = {"classic": ClassicVehicle, "enterprise": EnterpriseVehicle}.get(targets.chosen, RobotClient)
    search, floors = where.items_after, []

    def noting(client, floor, *more, **tokens):
        floors.append(floor)
        return search(client, floor, *more, **tokens)

    monkeypatch.setattr(where, "items_after", noting)
    return floors


@NUMBERED
def test_what_was_searched_is_not_searched_again(s, monkeypatch):
    """A robot has thousands of items, and is read every 2 s while a request may still arrive."""
    play(s, RARELY, plan(), post(LATE, 110.0), 500)
    floors = searches(monkeypatch)
    s.run(60)
    assert len(floors) >= 20
    assert set(floors) == {max(item.id for item in s.items())}


@NUMBERED
def test_a_copy_that_could_not_be_cancelled_at_once_is_cancelled_soon_without_reading_the_history(s, monkeypatch):
    """The robot is on screen, so its queue is read between polls."""
    play(s, stranger("Home", count=20), CLEANED_UP, RARELY, 10, do(lambda s: s.engine.watch(1)), plan(), 296)
    play(s, stranger("Home", count=5), copied())
    floors = searches(monkeypatch)
    play(s, meets("DELETE", f"/mission_queue/{s.noted[-1]}", LOST), 30, raised("duplicate_healed"))
    assert next(str(item.state) for item in s.all_items() if item.id == s.noted[-1]) == "Aborted"
    assert min(floors) >= 20
