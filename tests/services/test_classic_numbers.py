"""What a classic fleet may forget: the numbers of orders, which it then gives again, and the marks that it gave back when it was
checked up. No start is sent twice for that."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from types import SimpleNamespace

import pytest

from app.domain.execution import ReasonCode, State
from app.domain.models import ANY_VEHICLE, Connection, Fleet, Robot
from app.mir.classic_vehicle import OF_A_VEHICLE
from app.services.dispatch.observation import Observation
from mir_sim.fleets.orders import OrderState
from tests.support.network import Fate
from tests.support.site import FLEET, GUIDS, USER, Site

OTHERS = [pytest.param(20, id="others order past the number"), pytest.param(0, id="none order", marks=pytest.mark.long)]
UNKNOWN = (State.FAILED, ReasonCode.UNKNOWN_OUTCOME)
LATER = 86400.0  # s: orders of others that wait for tomorrow


@pytest.fixture
def returns_tokens():
    return True


@pytest.fixture
def site(tmp_path, returns_tokens):
    site = Site(tmp_path, target="classic", robots=2, token_field="description" if returns_tokens else "")
    if not returns_tokens:
        site.fleet.knobs = replace(site.fleet.knobs, description="none")
    site.add_robots()
    site.add_mission()
    yield site
    site.switch_off()


def others_order(site, count, mission="Home"):
    user = next(iter(site.fleet.site.table("/users")))
    for _ in range(count):
        site.fleet.book.submit(site.fleet.new_guid(), GUIDS[mission], user, site.fleet.now, earliest=LATER)


def settled(site):
    site.run_until(lambda: site.executions() and not any(state.is_open for state in site.states()))
    return site.the_row()


def ours(site):
    return [order for order in site.fleet.book if order.mission_id == GUIDS["Deliver"]]


def lose_the_answer(site, restarts=True, after=lambda: None):
    """``restarts``: the fleet has just forgotten what waited, so that its number is one that the app has seen. ``after``: a second
    later, long before the app looks."""
    others_order(site, 6)
    site.run(40)
    start = site.plan_once(1).start
    site.run_until(lambda: site.clock.now().replace(tzinfo=None) >= start - timedelta(seconds=1))
    if restarts:
        site.fleet.book.forget_waiting(reuse_numbers=True)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.network.submitted = lambda _one: site.at(1.0, after)


@pytest.mark.parametrize(("answers", "has_begun_again"), [((104, 105), False), ((104, 3), True)])
def test_an_answer_of_a_moment_ago_is_no_new_beginning(answers, has_begun_again):
    """All workers of a fleet share one for a second; a search may have shown a higher number since."""
    asked, clock = iter(answers), SimpleNamespace(monotonic=lambda: 7.0, now=lambda: None)
    client = SimpleNamespace(highest_queue_id=lambda: next(asked), capabilities=OF_A_VEHICLE)
    robot = Robot("Aino", "", fleet=Fleet("Hall", "http://hall"), vehicle="1")
    seen = Observation(robot, client, SimpleNamespace(clock=clock))
    seen.highest = 103
    seen.saw_id(105)
    for _ in answers:
        seen.read_highest()
    assert (seen.began_again_at == 7.0) is has_begun_again


def lose_all(site):
    """As a fleet that is installed new; its robots continue, and others order."""
    site.fleet.book._orders.clear()
    site.fleet.book._open.clear()
    site.fleet.book._last_number = 0
    site.at(8.0, lambda: others_order(site, 9))


@pytest.mark.parametrize("search", [200, 404], ids=["by search", "by list"])
@pytest.mark.parametrize("others", OTHERS)
def test_an_order_below_the_known_numbers_is_found_by_its_token(site, search, others):
    site.fleet.knobs = replace(site.fleet.knobs, search=search)
    lose_the_answer(site, after=lambda: others_order(site, others))
    row = settled(site)
    assert (row.state, len(ours(site)), row.queue_id) == (State.COMPLETED, 1, 2)


@pytest.mark.parametrize("returns_tokens", [False])
@pytest.mark.parametrize("others", OTHERS)
def test_without_tokens_a_start_is_sent_only_above_the_numbers_of_now(site, others):
    lose_the_answer(site, after=lambda: others_order(site, others))
    row = settled(site)
    assert (row.state, len(ours(site)), row.queue_id) == (State.COMPLETED, 1, 2)


@pytest.mark.parametrize("returns_tokens", [True, False], ids=["with tokens", "without"])
def test_a_start_that_may_have_been_taken_and_forgotten_is_not_sent_again(site):
    lose_the_answer(site, restarts=False, after=lambda: lose_all(site))
    row = settled(site)
    assert (row.state, row.reason.code, len(site.network.posts())) == (*UNKNOWN, 1)
    assert row.reason.details["problem"]["msgid"] == "its queue was reset"


def test_a_fleet_that_has_stopped_returning_tokens_gets_no_start_twice(site):
    site.fleet.knobs = replace(site.fleet.knobs, description="none")
    lose_the_answer(site, restarts=False)
    assert (settled(site).state, len(ours(site)), len(site.network.posts())) == (State.COMPLETED, 1, 1)
    assert [alarm.code for alarm in site.container.alarms.open()] == ["adopted_unproven"]


def test_an_order_of_a_person_is_not_taken_for_a_start_of_a_fleet_that_returns_tokens(site):
    """As the newest order of any of its robots shows."""
    site.container.operator.run_now(2, 1)
    settled(site)
    site.plan_once(1)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.network.submitted = lambda _one: site.stranger_queues(user=USER)
    site.run_until(lambda: len(site.network.posts("R1")) == 2)


@pytest.mark.parametrize("vehicle", ["1", ANY_VEHICLE])
def test_a_copy_that_ends_between_two_polls_is_reported(site, vehicle):
    """A network has doubled the request."""
    first = site.container.catalogue.robots()[0]
    either = Robot("Robot", "", fleet=first.fleet, vehicle=ANY_VEHICLE)
    robot = first if vehicle == "1" else site.container.catalogue.save_robot(either)
    site.container.catalogue.change_settings(poll_interval_seconds=600)
    site.run(30)

    def double(sent):
        user, wanted = next(iter(site.fleet.site.table("/users"))), site.fleet.vehicles[0] if vehicle == "1" else None
        site.fleet.book.submit(
            site.fleet.new_guid(), sent.mission_id, user, site.fleet.now, description=sent.token, wanted=wanted
        )

    site.network.submitted = lambda sent: site.at(1.0, lambda: double(sent))
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: sum(order.state is OrderState.DONE for order in ours(site)) == 2)
    site.run(700)
    assert [alarm.code for alarm in site.container.alarms.open()] == ["duplicate_running"]


@pytest.mark.parametrize(
    ("returns_tokens", "mission"), [(True, "Home"), pytest.param(False, "Deliver", marks=pytest.mark.long)]
)
def test_a_fleet_that_began_again_while_the_app_was_off_gets_no_start_twice(site, returns_tokens, mission):
    """The newest order that it took before shows it: its number is another's now. Without tokens and history, of one of
    another user for the same mission."""
    completed(site, 2)
    site.plan_once(1)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run_until(lambda: len(site.network.posts("R1")) == 1)
    if not returns_tokens:
        site.container.db.write(lambda c: c.execute("DELETE FROM executions WHERE state = 'completed'"))
    site.switch_off(cleanly=False)
    lose_all(site)
    site.clock.advance(60)
    others_order(site, 9, mission)
    site.switch_on()
    site.run_until(lambda: not any(state.is_open for state in site.states()))
    row = site.executions()[-1]
    assert (row.state, row.reason.code, len(site.network.posts("R1"))) == (*UNKNOWN, 1)


def test_a_fleet_that_had_no_orders_and_may_have_forgotten_its_first_does_not_get_it_again(site):
    begin_numbers_again(site)
    site.run(10)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.network.submitted = lambda _one: site.at(1.0, lambda: lose_all(site))
    site.container.operator.run_now(1, 1)
    row = settled(site)
    assert (row.state, row.reason.code, len(site.network.posts())) == (*UNKNOWN, 1)


def begin_numbers_again(site):
    """The fleet has lost all of its orders."""
    site.fleet.book._orders.clear()
    site.fleet.book._last_number = 0


def is_sent_again_though_a_person_queues_the_same(site):
    """The third request to R1 after one that was lost."""
    site.run(200)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.network.submitted = lambda _one: site.stranger_queues(user=USER)
    site.container.operator.run_now(1, 1)
    site.run(300)
    assert (site.container.alarms.open(), len(site.network.posts("R1"))) == ([], 3)


def completed(site, robot_id):
    """A start of a person's, to its end."""
    row = site.ended(site.container.operator.run_now(robot_id, 1))
    assert row.state is State.COMPLETED
    return row


@pytest.mark.long
@pytest.mark.parametrize("returns_tokens", [False])
def test_an_earlier_start_with_the_same_number_does_not_hide_an_order(site):
    """The fleet has begun its numbers again hours before."""
    site.run(10)
    for _ in range(3):
        completed(site, 1)
    begin_numbers_again(site)
    site.run(600)
    completed(site, 1)
    site.run(600)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    completed(site, 1)
    assert len(site.network.posts("R1")) == 5


@pytest.mark.long
def test_the_last_order_of_the_robot_itself_shows_whether_tokens_come_back(site):
    """Another robot's has a higher number, of before the fleet began its numbers again."""
    site.run(10)
    site.fleet.book._last_number = 50
    site.run(30)
    completed(site, 2)
    begin_numbers_again(site)
    site.run(120)
    completed(site, 1)
    is_sent_again_though_a_person_queues_the_same(site)


@pytest.mark.long
def test_a_number_that_was_given_again_shows_nothing_about_tokens(site):
    """The robot's last order is of before the fleet began its numbers again, the other robot's of afterwards."""
    site.run(10)
    completed(site, 1)
    begin_numbers_again(site)
    site.run(120)
    for _ in range(2):
        completed(site, 2)
    is_sent_again_though_a_person_queues_the_same(site)


@pytest.mark.long
def test_an_earlier_order_that_can_be_read_in_lists_only_keeps_no_start_back(site):
    site.run(10)
    assert completed(site, 1).queue_id == 2  # the first is its check-up's, and the network counts from the app's
    site.network.unreadable.update({("R1", 1), (FLEET, 1)})
    site.network.next("POST", "/mission_queue", Fate.LOST)
    completed(site, 1)
    assert len(site.network.posts("R1")) == 3


def test_a_search_among_more_orders_than_one_call_reads_is_continued_by_the_next(site):
    """Of a fleet with short lists only: others ordered much while the app was off, soon after its last start."""
    site.network.short_lists = 3
    site.run(10)
    completed(site, 1)
    site.switch_off()
    site.clock.advance(1200)
    others_order(site, 120)
    site.switch_on()
    site.run(180)
    found = site.container.snapshots.get(1)
    assert (found.connection, found.problem) == (Connection.CONNECTED, "")
