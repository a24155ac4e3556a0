"""What falls due at a robot that was read a moment ago is written together with the intent of its first attempt, and sent at once."""
from __future__ import annotations

import pytest

from app.domain.models import Execution, ReasonCode, State, Wait
from tests.support.network import Fate

DUE = 300.0              # s from the beginning: 06:05
QUIET = 90.0             # s until a submission of unknown outcome is sent again


def sent(site) -> list[str]:
    """Tokens of ours that the robot has ever had."""
    return [item.description for item in site.machines["R1"].queue if item.description]


def insert_due(site) -> list[State]:
    """Let the instant come, but no worker; returns the rows' states."""
    site.container.scheduler.due_soon()
    [worker] = site._workers.values()
    site.read_ahead(worker)
    site.clock.advance(1.05)
    site.tick()
    return [run.state for run in site.executions()]


@pytest.fixture
def held_up(site, plan, monkeypatch) -> list[Execution]:
    """An intent is written, and does not reach its worker."""
    plan("2026-11-23T06:05")
    site.run(DUE - 1.0)
    intents: list[Execution] = []
    monkeypatch.setattr(site.container.loop, "hand_over", intents.append)
    assert insert_due(site) == [State.SUBMITTING]
    return intents


def test_row_and_intent_are_one_write_and_the_post_is_next(site, plan):
    plan("2026-11-23T06:05")
    site.run(DUE - 1.0)
    assert insert_due(site) == [State.SUBMITTING]
    [run] = site.executions()
    assert run.attempts == 1
    assert sent(site) == []
    asked: list[str] = []
    site.network.interrupt = lambda where: asked.append(where.removeprefix("before ")) if where.startswith("before ") else None
    site.run(0.1)
    assert asked[0] == "POST /mission_queue"
    assert sent(site) == [run.token]
    assert [run.state for run in site.executions()] == [State.QUEUED]


def test_a_power_cut_before_the_post_loses_nothing_and_doubles_nothing(site, plan):
    plan("2026-11-23T06:05")
    site.run(DUE - 1.0)
    assert insert_due(site) == [State.SUBMITTING]
    site.switch_off(cleanly=False)
    site.switch_on()
    site.run(QUIET / 2)
    assert sent(site) == []                       # it could be on its way
    site.run(QUIET)
    [run] = site.executions()
    assert sent(site) == [run.token]
    assert run.attempts == 2


def test_one_that_the_worker_has_begun_to_look_for_is_not_sent_beside_that(site, held_up):
    """The row is seen in the ledger before it is handed over: the wait is longer, nothing is doubled."""
    site.kick()
    site.run(10.0)
    [intent] = held_up
    site._hand_over(intent)
    site.run(10.0)
    assert sent(site) == []
    site.run(QUIET)
    assert sent(site) == [intent.token]


def test_one_that_comes_when_all_is_over_is_not_sent_again(site, held_up):
    """However long the scheduler's thread stood still: it was looked for meanwhile, not found, and sent as a second attempt."""
    site.run(2 * QUIET)
    [intent] = held_up
    assert sent(site) == [intent.token]
    [worker] = site._workers.values()
    site.read_ahead(worker)                         # something else is due
    assert worker.ready() is not None
    site._hand_over(intent)
    site.run(10.0)
    assert sent(site) == [intent.token]


def test_one_that_comes_a_moment_later_is_sent_at_once(site, held_up):
    site.kick()
    site.run(0.5)                                 # the worker meets it in the ledger
    [intent] = held_up
    site._hand_over(intent)
    site.run(0.5)
    assert sent(site) == [intent.token]


def test_nor_does_it_wait_when_the_robot_has_to_be_read_again(site, held_up):
    site.kick()
    site.run(0.2)                                 # the worker meets it in the ledger, and gives it two seconds
    site.clock.advance(1.0)                       # until then the status is too old
    [worker] = site._workers.values()
    assert worker.ready() is None
    [intent] = held_up
    site._hand_over(intent)
    site.run(0.2)
    assert sent(site) == [intent.token]


@pytest.mark.parametrize("obstacle", ["held", "low battery", "not read", "one before"])
def test_whatever_needs_a_second_look_is_written_as_waiting(site, plan, obstacle):
    if obstacle == "one before":
        site.machines["R1"].set_battery(20.0)
        plan("2026-11-23T06:04", minimum_battery_percent=50)
    plan("2026-11-23T06:05", minimum_battery_percent=50 if obstacle == "low battery" else 0)
    site.run(DUE - 1.0)
    if obstacle == "held":
        site.container.holds.hold("cleaning")
    elif obstacle == "low battery":
        site.machines["R1"].set_battery(20.0)
    elif obstacle == "not read":
        site.clock.advance(1.05)
        site.tick()
        assert [run.state for run in site.executions()] == [State.WAITING]
        return
    assert set(insert_due(site)) == {State.WAITING}


def test_those_due_together_go_in_their_order(site, plan):
    for name, priority in (("late", 0), ("early", 0), ("first", 5)):
        plan("2026-11-23T06:05", name=name, priority=priority)
    site.run(DUE - 1.0)
    assert insert_due(site) == [State.SUBMITTING] * 3
    site.run(0.1)
    runs = {run.token: run.schedule for run in site.executions()}
    assert [runs[token] for token in sent(site)] == ["first", "early", "late"]


@pytest.mark.parametrize("fate", [Fate.REFUSED, Fate.ANSWER_LOST])
def test_when_the_first_meets_trouble_the_others_wait(site, plan, fate):
    """None of them is thrown at a robot that has just failed, and none is doubled or lost."""
    for number in range(3):
        plan("2026-11-23T06:05", name=f"S{number}")
    site.run(DUE - 1.0)
    assert insert_due(site) == [State.SUBMITTING] * 3
    [worker] = site._workers.values()
    site.network.down.add("R1")
    if fate is Fate.ANSWER_LOST:
        site.network.next("POST", "/mission_queue", fate)
    worker.step(False, intents=site._intents.pop(worker.robot.id), changed=False)
    first, *others = site.executions()
    assert first.state is (State.WAITING if fate is Fate.REFUSED else State.SUBMITTING)
    assert [(run.state, run.attempts) for run in others] == [(State.WAITING, 1)] * 2      # their own look at the robot brought nothing
    site.network.down.clear()
    site.run(2 * QUIET)
    assert sorted(sent(site)) == sorted(run.token for run in site.executions())


def test_a_hold_that_comes_between_stops_it(site, plan):
    plan("2026-11-23T06:05")
    site.run(DUE - 1.0)
    assert insert_due(site) == [State.SUBMITTING]
    site.container.holds.hold("cleaning")
    site.run(10.0)
    [run] = site.executions()
    assert (run.state, run.wait, run.attempts) == (State.WAITING, Wait.HOLD, 0)
    assert sent(site) == []


def test_one_that_is_cancelled_on_its_way_is_cancelled_on_the_robot(site, plan):
    """As with every POST."""
    plan("2026-11-23T06:05")
    site.run(DUE - 1.0)
    assert insert_due(site) == [State.SUBMITTING]
    [run] = site.executions()

    def cancel(where: str) -> None:
        if where == "before POST /mission_queue":
            site.network.interrupt = lambda where: None
            site.container.operator.cancel_execution(run.id)

    site.network.interrupt = cancel
    site.run(30.0)
    [run] = site.executions()
    assert (run.state, run.reason.code) == (State.CANCELLED, ReasonCode.USER_CANCELLED)
    assert len(sent(site)) == 1
    assert not any(item.state in ("Pending", "Executing") for item in site.machines["R1"].queue)


def test_what_falls_due_while_the_writer_is_waited_for_goes_along(site, plan, monkeypatch):
    plan("2026-11-23T06:05")
    plan("2026-11-23T06:06", name="second")
    site.run(DUE - 1.0)
    write, rows_after = site.container.db.write, []

    def late(work, patient=False):
        if not rows_after:
            site.clock.advance(62.0)
        result = write(work, patient)
        rows_after.append(len(site.executions()))
        return result
    site.clock.advance(1.05)
    monkeypatch.setattr(site.container.db, "write", late)
    site.container.planner.insert_due()
    assert rows_after[0] == 2
