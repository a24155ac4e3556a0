"""Robots that refuse, boot, are updated or know no search: what is then said, sent and not sent."""

from __future__ import annotations

import pytest

from app.domain.models import Connection, ReasonCode, State
from tests.support.network import Fate
from tests.support.seen import alarms, items, outcomes, sent_at, states


# ---------------------------------------------------------------------- Cancel
@pytest.mark.parametrize("fate", [Fate.REFUSED, Fate.LOST, Fate.ERROR_BEFORE])
def test_cancel_while_the_robot_can_t_be_reached_is_kept_and_carried_out_when_it_can(site, plan, fate):
    """Cancel is no error then: the row says that it will be cancelled, and it is, as soon as the robot answers."""
    plan("2026-11-23T06:05")
    site.run(320)
    site.network.next("DELETE", "*", fate, count=3)
    row = site.container.operator.cancel_execution(site.executions()[0].id)
    assert (row.state.is_open, row.cancel_code) == (True, ReasonCode.USER_CANCELLED)
    site.run(60)
    assert states(site) == ["Aborted"]
    assert outcomes(site) == [(State.CANCELLED, ReasonCode.USER_CANCELLED, 1)]


def test_cancel_while_the_robot_is_gone_for_long_is_not_forgotten(site, plan):
    """It is carried out even by the next run of the app; what has ended by then says how it ended."""
    site.machines["R1"].pause()
    plan("2026-11-23T06:05")
    site.run(320)
    site.network.down.add("R1")
    site.container.operator.cancel_execution(site.executions()[0].id)
    site.run(600)
    site.power_cut(20)
    site.network.down.clear()
    site.run(60)
    assert states(site) == ["Aborted"]
    assert outcomes(site) == [(State.CANCELLED, ReasonCode.USER_CANCELLED, 1)]


def test_what_ended_before_the_robot_could_be_told_of_the_cancellation_says_how_it_ended(site, plan):
    """The robot's answer decides."""
    plan("2026-11-23T06:05")
    site.run(320)
    site.network.down.add("R1")
    site.container.operator.cancel_execution(site.executions()[0].id)
    site.run(300)
    site.network.down.clear()
    site.run(60)
    assert states(site) == ["Done"]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


# ---------------------------------------------------------------------- booting
@pytest.mark.parametrize("count", [1, 2])
def test_a_robot_whose_interface_has_only_just_come_up_has_lost_nothing(site, plan, count):
    """One answer 404 for an item that was there a moment ago is no proof that it is gone."""
    plan("2026-11-23T06:05")
    site.run(320)
    site.network.next("GET", "/mission_queue/1", Fate.NOT_FOUND, count=count)
    site.run(300)
    assert states(site) == ["Done"]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


def test_a_robot_that_has_no_interface_yet_is_tried_again(site, plan):
    """404 for everything, while the start is due: it is sent a moment later."""
    plan("2026-11-23T06:05")
    site.run(298)
    site.network.next("*", "*", Fate.NOT_FOUND, count=4)
    site.run(300)
    assert [row.state for row in site.executions()] == [State.COMPLETED]
    assert len(items(site)) == 1


def test_a_start_that_meets_such_a_robot_is_sent_again_a_moment_later(site, plan):
    """404 for the submission alone, from a robot that has the mission, is nothing that a person could mend."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.NOT_FOUND)
    site.run(600)
    assert outcomes(site) == [(State.COMPLETED, None, 2)]
    assert len(items(site)) == 1


# ---------------------------------------------------------------------- no search, no pages
@pytest.fixture
def simple(site):
    """R1 has twenty old items and lists the oldest ten, whatever it is asked."""
    for _ in range(20):
        site.stranger_queues("Home")
    site.machines["R1"].cancel_all()
    site.run(1)
    site.network.short_lists = 10
    return site


@pytest.mark.parametrize("fate", [Fate.ANSWER_LOST, Fate.LATE, Fate.ERROR_AFTER])
def test_without_proof_of_absence_nothing_is_sent_again(simple, plan, fate):
    """An item that isn't in a list of the oldest may be there all the same."""
    site = simple
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", fate)
    site.run(1500)
    assert sent_at(site) == [300]
    [(state, code, attempts)] = outcomes(site)
    assert (state, attempts) == (State.COMPLETED, 1) or (code, attempts) == (ReasonCode.UNKNOWN_OUTCOME, 1)
    assert state is State.COMPLETED or "unknown_outcome" in alarms(site)


def test_on_such_a_robot_a_lost_request_is_sent_again_only_with_proof(simple, plan):
    """Either its numbers show that nothing arrived, one by one, or the outcome stays unknown and a person is told."""
    site = simple
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.at(310.0, lambda: site.stranger_queues("Home"))
    site.run(1500)
    [(state, code, attempts)] = outcomes(site)
    assert (state, attempts) == (State.COMPLETED, 2) or (code, "unknown_outcome" in alarms(site)) == (
        ReasonCode.UNKNOWN_OUTCOME,
        True,
    )
    assert [item.description for item in items(site)].count(site.executions()[0].token) == attempts - 1


def test_on_such_a_robot_with_a_long_history_a_lost_answer_is_found(simple, plan):
    """Its list ends far below what is new, but numbers lead up to it."""
    site = simple
    for _ in range(150):
        site.stranger_queues("Home")
    site.machines["R1"].cancel_all()
    plan("2026-11-23T06:05")
    plan("2026-11-23T06:06")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(600)
    assert outcomes(site) == [(State.COMPLETED, None, 1)] * 2
    assert sent_at(site) == [pytest.approx(300, abs=1), pytest.approx(360, abs=1)]


def test_what_was_never_sent_is_not_looked_for(simple, plan):
    """Not even after a restart: a search from the first number on would read the robot's whole history again and again."""
    site = simple
    for _ in range(150):
        site.stranger_queues("Home")
    site.machines["R1"].cancel_all()
    plan("2026-11-23T06:05")
    site.at(290, lambda: site.network.down.add("R1"))
    site.run(1300)
    assert outcomes(site)[0][2] > 1
    site.network.down.clear()
    site.power_cut(5)
    site.run(60)
    assert site.container.snapshots.get(1).connection is Connection.CONNECTED


def test_on_such_a_robot_starts_run_as_on_any(simple, plan):
    """While answers arrive there is nothing to look for."""
    plan("2026-11-23T06:05")
    simple.run(600)
    assert outcomes(simple) == [(State.COMPLETED, None, 1)]


# ---------------------------------------------------------------------- asleep between connecting and sending
@pytest.mark.parametrize("asleep", [1000.0, 86400.0])
def test_a_tablet_that_sleeps_between_connecting_and_sending_sends_nothing_after_the_window(site, plan, asleep):
    """Whether the window is open is asked once the connection stands, just before the request leaves."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ASLEEP, asleep)
    site.run(600)
    assert items(site) == []
    [(state, _code, _attempts)] = outcomes(site)
    assert not state.is_open


@pytest.mark.parametrize("asleep", [3.0, 300.0])
def test_a_tablet_that_sleeps_for_less_than_the_window_sends_once(site, plan, asleep):
    """Late, and within its window."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ASLEEP, asleep)
    site.run(600)
    assert [row.state for row in site.executions()] == [State.COMPLETED]
    assert len(items(site)) == 1


# ---------------------------------------------------------------------- a software update
def update(site, *, forgets):
    """The robot restarts with a software that gives descriptions back, or doesn't."""
    site.machines["R1"].catch_up()
    site.machines["R1"].reboot(30.0)
    site.network.forgets_descriptions = forgets
    site.run(120)


def test_after_an_update_that_drops_tokens_a_lost_answer_is_not_sent_again(site, plan):
    """That tokens came back once doesn't prove that they still do."""
    plan("2026-11-23T06:05")
    plan("2026-11-23T06:15")
    plan("2026-11-23T06:35")
    site.run(600)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.at(310.0, lambda: site.stranger_queues("Deliver"))
    site.run(700)
    update(site, forgets=True)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(1500)
    assert len([at for at in sent_at(site) if at > 2000]) == 1
    assert [row.state for row in site.executions()] == [State.COMPLETED] * 3


def test_after_an_update_that_gives_tokens_back_a_stranger_s_item_is_not_taken_for_ours(site, plan):
    """That tokens were lost once doesn't make another person's mission ours."""
    site.network.forgets_descriptions = True
    plan("2026-11-23T06:05")
    plan("2026-11-23T06:15")
    plan("2026-11-23T06:35")
    site.run(600)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(600)
    update(site, forgets=False)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.at(2100 - site.seconds() + 10.0, lambda: site.stranger_queues("Deliver", user="distributor"))
    site.run(1500)
    assert [row.state for row in site.executions()] == [State.COMPLETED] * 3
    assert len({row.queue_id for row in site.executions()} & {item.id for item in items(site) if item.description}) == 3
