"""What a worker's rounds leave undone: with fifty robots and hundreds of missions a minute, everything needless makes others late."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import pytest

from app.domain.execution import State
from app.mir.client import RobotClient
from app.mir.errors import Unreachable
from app.services.dispatch.sending import STARTED_TOGETHER
from app.services.dispatch.timing import LIVE_EVERY, PUT_OFF_AT_MOST
from app.services.dispatch.worker import RobotWorker
from tests.support.seen import robot_of

DUE = 300.0  # s from the beginning: 06:05
COUNT = 10


@pytest.fixture
def ledger(site, monkeypatch) -> SimpleNamespace:
    """What is asked of the ledger from here on: ``looks`` for what waits, sizes of the ``writes`` that change rows."""
    seen, real = SimpleNamespace(looks=0, writes=[]), site.container.ledger
    unsent_of, apply = real.unsent_of, real.apply

    def look(robot_id):
        seen.looks += 1
        return unsent_of(robot_id)

    def write(found, **how):
        seen.writes += [len(found)] if found else []
        return apply(found, **how)

    monkeypatch.setattr(real, "unsent_of", look)
    monkeypatch.setattr(real, "apply", write)
    return seen


def plan_each(plan, *names) -> None:
    for name in names:
        plan("2026-11-23T06:05", name=str(name))


def test_what_is_held_is_sent_without_opening_the_ledger(site, plan, ledger, monkeypatch):
    """It would be one more wait between the instant and the POST."""
    monkeypatch.setattr(site.container.ledger, "get", lambda _id: pytest.fail("the row was read"))
    plan("2026-11-23T06:05")
    site.run(DUE - 0.05)
    [worker] = site._workers.values()
    ledger.looks = 0
    site.clock.advance(0.05)
    wait = worker.advance()
    assert site.states() == [State.QUEUED]
    assert ledger.looks == 0
    assert 0.5 * LIVE_EVERY <= wait <= 1.5 * LIVE_EVERY  # then its way is followed


def test_what_could_not_be_sent_is_taken_up_again(site, plan, ledger):
    plan("2026-11-23T06:05")
    site.run(DUE - 0.05)
    [worker] = site._workers.values()
    site.network.down.add("R1")
    site.clock.advance(0.05)
    wait = worker.advance()
    assert (site.executions()[0].state, site.executions()[0].attempts) == (State.WAITING, 1)
    site.network.down.clear()
    site.clock.advance(wait)
    worker.advance()  # without a message that its time has come
    assert site.executions()[0].state is State.QUEUED


def test_starts_that_wait_for_an_absent_robot_are_one_write_a_try(site, plan, ledger):
    plan_each(plan, *range(COUNT))
    site.run(DUE - 1.0)
    site.network.down.add("R1")
    site.run(2.0)
    assert [run.attempts for run in site.executions()] == [1] * COUNT
    assert ledger.writes == [COUNT]
    site.network.down.clear()
    ledger.writes.clear()
    site.run(60.0)
    assert all(run.queue_id for run in site.executions())
    assert ledger.writes[:2] == [STARTED_TOGETHER, COUNT - STARTED_TOGETHER]  # their intents


def test_what_comes_for_a_robot_that_does_not_answer_is_judged_together(site, ledger):
    robot, mission = robot_of(site), site.add_mission("Home")
    site.network.down.add("R1")
    site.run(2 * 30.0)  # polls that failed
    ledger.looks = 0
    for number in range(COUNT):
        site.at(0.05 * number, lambda: site.container.operator.run_now(robot.id, mission.id))
    site.run(0.05 * COUNT + PUT_OFF_AT_MOST)
    assert [run.attempts for run in site.executions()] == [1] * COUNT
    assert ledger.looks <= 3
    ledger.looks = 0
    site.run(20.0)
    assert sum(run.attempts for run in site.executions()) >= 3 * COUNT  # 2, 4 and 8 s later
    assert ledger.looks <= 6, "not one by one"
    site.network.down.clear()
    site.run(60.0)
    assert all(run.queue_id for run in site.executions())


def test_one_that_is_cancelled_while_another_of_the_same_write_is_sent_is_not_sent(site, plan, monkeypatch):
    plan_each(plan, "first", "second")
    site.network.down.add("R1")
    site.run(DUE + 1.0)
    site.network.down.clear()
    _first, second = site.executions()
    send, sent = RobotClient.enqueue, []

    def slowly(client, *arguments, text, **rest):
        sent.append(text)
        site.container.operator.cancel_execution(second.id)
        return send(client, *arguments, text=text, **rest)

    monkeypatch.setattr(RobotClient, "enqueue", slowly)
    site.run(60.0)
    assert sent == ["first"]
    assert site.executions()[1].state is State.CANCELLED


def test_what_one_look_brings_is_one_write(site, plan, ledger):
    plan_each(plan, *range(COUNT))
    site.run(DUE + 2.0)
    site.machines["R1"].cancel_all()
    ledger.writes.clear()
    assert site.states(after=2 * LIVE_EVERY) == [State.CANCELLED] * COUNT
    assert ledger.writes[0] >= COUNT


def test_a_look_that_breaks_off_keeps_what_it_has_seen(site, plan, monkeypatch):
    plan_each(plan, "first", "second")
    site.run(DUE + 2.0)
    _first, second = site.executions()
    site.machines["R1"].cancel_all()
    read = RobotClient.queue_item

    def breaks_off(client, queue_id, token):
        if queue_id == second.queue_id:
            raise Unreachable(address="r1")
        return read(client, queue_id, token)

    monkeypatch.setattr(RobotClient, "queue_item", breaks_off)
    site.run(2 * LIVE_EVERY)
    first, second = site.executions()
    assert not first.state.is_open
    assert second.state.is_open


def test_many_robots_are_looked_at_evenly_over_time():
    """Also when all of them were sent to in one moment; the one on screen keeps its two seconds."""

    def pause(number: int, watched: bool = False) -> float:
        return RobotWorker._staggered(SimpleNamespace(_watched=watched, robot=SimpleNamespace(id=number)), LIVE_EVERY)

    for robots in (range(1, 51), range(100, 200, 2)):
        moments = sorted(pause(number) for number in robots)
        assert moments[0] >= 0.5 * LIVE_EVERY
        assert moments[-1] <= 1.5 * LIVE_EVERY
        assert max(later - earlier for earlier, later in pairwise(moments)) <= 2.5 * LIVE_EVERY / len(robots)
    assert pause(7, watched=True) == LIVE_EVERY
