"""An intent is on disk and with its worker 0.25 s before its instant, unless something prevents the start; what happens in between is
respected."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.execution import State
from app.services.dispatch import messages
from app.services.dispatch.timing import INTENT_LEAD, PUT_OFF_AT_MOST, ROUND_TAKES
from tests.support.seen import tokens

DUE = 300.0  # s from the beginning: 06:05
INSTANT = datetime(2026, 11, 23, 6, 5, tzinfo=UTC)
EARLIER = 0.05  # s before the instant, within INTENT_LEAD


def only_worker(site):
    [worker] = site._workers.values()
    return worker


def come_close(site) -> list:
    """The robot has been read ahead, and the instant is near enough; returns the intents that its worker has not been given yet."""
    site.run(DUE - INTENT_LEAD - 0.01 - site.seconds())
    site.clock.advance((INSTANT - site.clock.now()).total_seconds() - EARLIER)
    site.engine.advance()
    inbox, site._inboxes[1] = site._inboxes[1], []
    return [message.intent for message in inbox if isinstance(message, messages.Start)]


def give(site, *intents) -> float:
    """Its worker gets these, and continues; returns the seconds until its next call."""
    worker = only_worker(site)
    for intent in intents:
        worker.handle(messages.Start(intent, site.engine.plan_version))
    return worker.advance()


@pytest.fixture
def in_hand(site, plan):
    """A schedule whose next start is written down, taken in hand by its worker, and not yet due."""
    schedule = plan("2026-11-23T06:05", minimum_battery_percent=20)
    assert site.states(after=DUE - EARLIER) == [State.SUBMITTING]
    assert 0 < only_worker(site).advance() <= EARLIER
    return schedule


def test_it_is_sent_at_its_instant_and_not_before(site, in_hand):
    site.run(EARLIER - 0.002)
    assert tokens(site) == []
    site.run(0.002)
    [run] = site.executions()
    assert tokens(site) == [run.token]
    assert run.created_at < INSTANT <= run.submitted_at < INSTANT + timedelta(seconds=0.1)
    assert run.attempts == 1


def test_nothing_is_written_earlier_than_that(site, plan):
    plan("2026-11-23T06:05")
    site.run(DUE - INTENT_LEAD - 0.002)
    assert site.executions() == []
    assert 0 < site.engine.advance() < 0.03
    assert site.states(after=0.027) == [State.SUBMITTING]


# ---------------------------------------------------------------- clocks, stops, trouble
def test_a_worker_that_is_closed_releases_what_it_holds(site, in_hand):
    robot = only_worker(site).robot
    site.close(robot.id)
    [run] = site.executions()
    assert (run.state, run.attempts) == (State.WAITING, 0)
    site.open(site.container.make_worker(robot))  # another takes its place, and does not send it early either
    site.run(1.0)
    [run] = site.executions()
    assert tokens(site) == [run.token]
    assert run.submitted_at >= INSTANT


def test_one_that_was_never_taken_in_hand_is_given_back_too(site, plan):
    plan("2026-11-23T06:05")
    intents = come_close(site)
    only_worker(site).close(intents)
    assert [(run.state, run.attempts) for run in site.executions()] == [(State.WAITING, 0)]


def test_an_unexpected_error_with_one_leaves_the_others_in_hand(site, plan):
    for name in ("first", "second"):
        plan("2026-11-23T06:05", name=name)
    give(site, *come_close(site))
    left = [RuntimeError("planted")]

    def fails_once(where: str) -> None:
        if where == "before POST /mission_queue" and left:
            raise left.pop()

    site.network.interrupt = fails_once
    site.clock.advance(EARLIER)
    worker = only_worker(site)
    with pytest.raises(RuntimeError):
        worker.advance()
    worker.handle(worker.expect_recovery())  # as the runner does
    worker.advance()
    first, second = sorted(site.executions(), key=lambda run: run.schedule)
    assert tokens(site) == [second.token]
    assert first.state is State.SUBMITTING  # in doubt
    site.run(120.0)
    assert tokens(site) == [second.token, first.token]


# ---------------------------------------------------------------- what gives way
def test_a_round_gives_way_to_what_is_due_in_a_moment(site, in_hand):
    asked: list[str] = []
    site.network.interrupt = asked.append
    site.run(EARLIER - ROUND_TAKES / 2)
    site.engine.poll(1)
    site.run(ROUND_TAKES / 4)
    assert asked == []
    site.run(ROUND_TAKES / 2)
    assert asked[0] == "before POST /mission_queue"
    assert "before GET /status" in asked  # the poll that was asked for is not forgotten


def test_nor_does_it_keep_asking_for_its_round(site, in_hand):
    """It sleeps until the start, though its next read is due."""
    site.run(EARLIER - ROUND_TAKES / 2)
    worker = only_worker(site)
    worker.handle(messages.OnScreen(True))  # read at once
    assert worker.advance() == pytest.approx(ROUND_TAKES / 2, abs=0.001)


def test_but_not_for_ever(site, plan):
    """Missions without a gap between them: robot and ledger are still checked."""
    plan("2026-11-23T06:05")
    [intent] = come_close(site)
    asked: list[str] = []
    site.network.interrupt = asked.append
    steps, began = 0, site.clock.monotonic()
    while "before GET /status" not in asked:
        following = replace(intent, id=1000 + steps, planned_at=site.clock.now() + timedelta(seconds=0.03))
        if steps == 0:
            only_worker(site).handle(messages.Poll())
        give(site, following)
        site.clock.advance(0.01)
        steps += 1
    assert PUT_OFF_AT_MOST <= site.clock.monotonic() - began <= PUT_OFF_AT_MOST + 0.3


def test_what_the_robot_has_taken_is_written_down_when_there_is_time(site, plan):
    """Two starts 20 ms apart: the second does not wait for the note of the first, and one write notes both."""
    plan("2026-11-23T06:05", name="first")
    plan("2026-11-23T06:05", name="second")
    first, second = come_close(site)
    give(site, first, replace(second, planned_at=second.planned_at + timedelta(seconds=0.02)))
    site.clock.advance(EARLIER)
    only_worker(site).advance()
    assert len(tokens(site)) == 1
    assert {run.state for run in site.executions()} == {State.SUBMITTING}
    site.clock.advance(0.02)
    only_worker(site).advance()
    assert len(tokens(site)) == 2
    assert {run.state for run in site.executions()} == {State.QUEUED}
