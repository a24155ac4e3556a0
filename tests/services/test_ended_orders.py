"""Fleet Enterprise before 1.5: an order that has ended is known only by what it is."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.execution import ReasonCode, State, Trigger
from app.services.robots.fleets import Fleets
from tests.support.network import Fate
from tests.support.site import FLEET

KEYS = {"the same key": "mir_scheduler", "another key": "mir_other"}


@pytest.fixture
def furnished(enterprise, monkeypatch):
    """A fleet that forgets the ids of ended orders, and so many of its robots. When it is asked who it is, a test says."""
    monkeypatch.setattr(Fleets, "tick", lambda _self: None)
    return lambda robots=1: enterprise(robots, version="1.4.2", ids_kept=0.0)


def planned(site, robot, minutes=2):
    return site.plan_once(robot.id, minutes, name=robot.name, start_window_minutes=600)


def ran(site, robot, mission=1):
    assert site.ended(site.container.operator.run_now(robot.id, mission)).state is State.COMPLETED


def lose_the_answer(site, robot, number=1):
    """To a start whose order is the fleet's so many-th."""
    planned(site, robot)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run_until(lambda: len(site.queue("R1")) == number)
    site.run(0.5)


def kill_while_it_is_sent(site, off):
    site.run_until(lambda: any(row.state is State.SUBMITTING for row in site.executions()))
    site.run(0.5)
    site.power_cut(off)
    site.run(400)


@pytest.mark.parametrize("key", KEYS.values(), ids=KEYS)
def test_a_start_whose_order_ended_unseen_is_not_sent_twice_after_the_key_was_replaced(furnished, key):
    """The check-up has noted what lists called the old key."""
    site, robot = furnished()
    ran(site, robot)
    site.container.catalogue.save_fleet(site.container.catalogue.fleets()[0], password=key)
    site.container.fleets._identify_all(site.container.catalogue.fleets())
    site.run(120)
    planned(site, robot)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run_until(lambda: len(site.queue("R1")) == 2)
    site.without_link(120)
    site.run(600)
    assert len(site.queue("R1")) == 2


@pytest.mark.long
def test_an_order_of_the_old_key_is_not_taken_for_another_clients_once_the_new_key_has_run_one(furnished):
    """The key is replaced while an order of before the app was killed is looked for."""
    site, robot = furnished()
    site.container.catalogue.change_settings(unknown_outcome_quiet_seconds=300)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: len(site.queue("R1")) == 1)
    site.run(0.5)
    site.switch_off(cleanly=False)
    site.clock.advance(120)
    site.network.down.update([*site.machines, FLEET])
    site.switch_on()
    site.container.catalogue.save_fleet(site.container.catalogue.fleets()[0], password=KEYS["another key"])
    site.run(30)
    site.network.down.clear()
    site.container.fleets._identify_all(site.container.catalogue.fleets())
    site.add_mission("Home")
    site.container.operator.run_now(robot.id, 2)
    site.run(600)
    assert len(site.queue("R1")) == 2


def test_of_two_starts_of_one_mission_only_the_one_that_ran_is_completed(furnished):
    """The first is accepted and waits, the request of the second is lost; no link until the first has ended."""
    site, robot = furnished()
    site.stranger_queues("Home")
    site.run(2)
    first = site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: site.container.ledger.get(first.id).state is State.QUEUED)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    second = site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: site.container.ledger.get(second.id).state is State.SUBMITTING)
    site.without_link(400)
    site.run(900)
    rows = [site.container.ledger.get(row.id) for row in (first, second)]
    assert [(row.state, row.reason and row.reason.code) for row in rows] == [
        (State.COMPLETED, None),
        (State.FAILED, ReasonCode.UNKNOWN_OUTCOME),
    ]


@pytest.mark.long
def test_a_start_that_was_lost_long_ago_hides_no_later_one(furnished):
    site, robot = furnished()
    ran(site, robot)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    lost = site.container.operator.run_now(robot.id, 1)
    site.run(10)
    site.container.operator.cancel_execution(lost.id)
    site.run(1200)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    later = site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: len(site.queue("R1")) == 2)
    site.without_link(120)
    site.run(600)
    assert [site.container.ledger.get(row.id).state for row in (lost, later)] == [State.CANCELLED, State.COMPLETED]


@pytest.mark.long
def test_what_was_lost_before_the_app_was_killed_is_sent_again_though_the_mission_ran_long_before(furnished):
    site, robot = furnished()
    ran(site, robot)
    site.run(1200)
    planned(site, robot)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    kill_while_it_is_sent(site, 60)
    assert (site.states(), len(site.queue("R1"))) == ([State.COMPLETED] * 2, 2)


@pytest.mark.long
@pytest.mark.parametrize(
    ("ahead", "off", "back"), [(0, 1800, 1200), (540, 300, 540), (540, 4000, 540), (-540, 300, -540)]
)
def test_what_was_sent_is_found_though_the_clock_was_set_while_the_app_was_off(furnished, ahead, off, back):
    """It was wrong by less than what puts it in doubt, and is right now; or it was right."""
    site, robot = furnished()
    site.clock.step(ahead)
    site.run(60)
    lose_the_answer(site, robot)
    site.switch_off(cleanly=False)
    site.clock.advance(off)
    site.clock.step(-back)
    site.switch_on()
    site.run(900)
    assert (site.states(), len(site.queue("R1"))) == ([State.COMPLETED], 1)


@pytest.mark.long
def test_what_a_fleet_has_forgotten_is_not_sent_again_though_its_clock_was_set_back(furnished):
    site, robot = furnished()
    site.fleet.knobs = replace(site.fleet.knobs, version="1.5.0", orders_kept=3600.0)
    ran(site, robot)
    lose_the_answer(site, robot, number=2)
    site.switch_off(cleanly=False)
    site.clock.advance(4000)
    site.fleet.clock.offset -= 540
    site.switch_on()
    site.run(900)
    assert len(site.network.posts("R1")) == 2
    assert site.executions()[-1].reason.code is ReasonCode.UNKNOWN_OUTCOME


@pytest.mark.long
def test_what_was_sent_is_not_sent_again_after_the_clock_was_set_back_where_the_fleets_time_was_not_noted(furnished):
    """As earlier releases did not."""
    site, robot = furnished()
    site.clock.step(540)
    site.run(60)
    lose_the_answer(site, robot)
    site.container.db.write(lambda c: c.execute("UPDATE executions SET queue_floor = 0"))
    site.switch_off(cleanly=False)
    site.clock.advance(300)
    site.clock.step(-540)
    site.switch_on()
    site.run(900)
    row = site.the_row()
    assert (row.state, row.reason.code, len(site.queue("R1"))) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 1)


@pytest.mark.long
def test_a_start_for_another_robot_does_not_hide_the_order_of_this_one(furnished):
    """Both start the same mission when the app is killed."""
    site, first, second = furnished(2)
    planned(site, first)
    planned(site, second)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST, robot="R1")
    site.run_until(lambda: len(site.queue("R1")) == 1)
    kill_while_it_is_sent(site, 300)
    assert [(row.state, len(site.queue(row.robot))) for row in site.executions()] == [(State.COMPLETED, 1)] * 2


@pytest.mark.long
@pytest.mark.parametrize("limit", [None, 1], ids=["history of all", "history of one row"])
def test_another_start_that_has_ended_is_not_taken_for_one_that_was_lost(furnished, limit):
    """The same mission ran a minute before on that robot, and another robot ran something since."""
    site, first, second = furnished(2)
    site.container.catalogue.change_settings(history_limit=limit)
    plan = planned(site, first, 6)
    site.run_until(lambda: site.clock.now().replace(tzinfo=None) >= plan.start - timedelta(seconds=110))
    site.add_mission("Home")
    ran(site, first)
    ran(site, second, 2)
    site.container.ledger.prune(lambda: True)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    kill_while_it_is_sent(site, 60)
    (lost,) = [row for row in site.executions() if row.trigger is Trigger.SCHEDULED]
    assert (lost.state, lost.reason.code, len(site.queue("R1"))) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 1)
