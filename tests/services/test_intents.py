"""What falls due at a robot that was read a moment ago is written together with the intent of its first attempt, and sent at once."""

from __future__ import annotations

import pytest

from app.domain.models import ReasonCode, State, Wait
from app.services.dispatch.timing import INTENT_LEAD
from tests.support.network import Fate
from tests.support.seen import tokens

DUE = 300.0  # s from the beginning: 06:05
QUIET = 90.0  # s until a submission of unknown outcome is sent again


def insert_due(site) -> list[State]:
    """Let the instant come with its robot read a moment ago, but no worker go on; returns the rows' states."""
    site.run(DUE - INTENT_LEAD - 0.01 - site.seconds())
    site.clock.advance(INTENT_LEAD + 0.05)
    site.engine.advance()
    return [run.state for run in site.executions()]


def test_row_and_intent_are_one_write_and_the_post_is_next(site, plan):
    plan("2026-11-23T06:05")
    assert insert_due(site) == [State.SUBMITTING]
    [run] = site.executions()
    assert run.attempts == 1
    assert tokens(site) == []
    asked: list[str] = []
    site.network.interrupt = lambda where: (
        asked.append(where.removeprefix("before ")) if where.startswith("before ") else None
    )
    site.run(0.1)
    assert asked[0] == "POST /mission_queue"
    assert tokens(site) == [run.token]
    assert [run.state for run in site.executions()] == [State.QUEUED]


def test_a_power_cut_before_the_post_loses_nothing_and_doubles_nothing(site, plan):
    plan("2026-11-23T06:05")
    assert insert_due(site) == [State.SUBMITTING]
    site.switch_off(cleanly=False)
    site.switch_on()
    site.run(QUIET / 2)
    assert tokens(site) == []  # it could be on its way
    site.run(QUIET)
    [run] = site.executions()
    assert tokens(site) == [run.token]
    assert run.attempts == 2


@pytest.mark.parametrize("obstacle", ["held", "low battery", "not read", "one before"])
def test_whatever_needs_a_second_look_is_written_as_waiting(site, plan, obstacle):
    if obstacle == "one before":
        site.machines["R1"].set_battery(20.0)
        plan("2026-11-23T06:04", minimum_battery_percent=50)
    plan("2026-11-23T06:05", minimum_battery_percent=50 if obstacle == "low battery" else 0)
    site.run(DUE - 5.0)
    if obstacle == "held":
        site.container.holds.hold("cleaning")
    elif obstacle == "low battery":
        site.machines["R1"].set_battery(20.0)
    elif obstacle == "not read":
        site.clock.advance(5.05)
        site.engine.advance()
        assert [run.state for run in site.executions()] == [State.WAITING]
        return
    assert set(insert_due(site)) == {State.WAITING}


def test_those_due_together_go_in_their_order(site, plan):
    for name, priority in (("late", 0), ("early", 0), ("first", 5)):
        plan("2026-11-23T06:05", name=name, priority=priority)
    assert insert_due(site) == [State.SUBMITTING] * 3
    site.run(0.1)
    runs = {run.token: run.schedule for run in site.executions()}
    assert [runs[token] for token in tokens(site)] == ["first", "early", "late"]


@pytest.mark.parametrize("fate", [Fate.REFUSED, Fate.ANSWER_LOST])
def test_when_the_first_meets_trouble_the_others_wait(site, plan, fate):
    """None of them is thrown at a robot that has just failed, and none is doubled or lost."""
    for number in range(3):
        plan("2026-11-23T06:05", name=f"S{number}")
    assert insert_due(site) == [State.SUBMITTING] * 3
    site.network.down.add("R1")
    if fate is Fate.ANSWER_LOST:
        site.network.next("POST", "/mission_queue", fate)
    site.run(0.1)
    first, *others = site.executions()
    assert first.state is (State.WAITING if fate is Fate.REFUSED else State.SUBMITTING)
    assert [(run.state, run.attempts) for run in others] == [
        (State.WAITING, 1)
    ] * 2  # their own look at the robot brought nothing
    site.network.down.clear()
    site.run(2 * QUIET)
    assert sorted(tokens(site)) == sorted(run.token for run in site.executions())


def test_a_hold_that_comes_between_stops_it(site, plan):
    plan("2026-11-23T06:05")
    assert insert_due(site) == [State.SUBMITTING]
    site.container.holds.hold("cleaning")
    site.run(10.0)
    [run] = site.executions()
    assert (run.state, run.wait, run.attempts) == (State.WAITING, Wait.HOLD, 0)
    assert tokens(site) == []


def test_one_that_is_cancelled_on_its_way_is_cancelled_on_the_robot(site, plan):
    """As with every POST."""
    plan("2026-11-23T06:05")
    assert insert_due(site) == [State.SUBMITTING]
    [run] = site.executions()

    def cancel(where: str) -> None:
        if where == "after POST /mission_queue":
            site.network.interrupt = lambda where: None
            site.container.operator.cancel_execution(run.id)

    site.network.interrupt = cancel
    site.run(30.0)
    [run] = site.executions()
    assert (run.state, run.reason.code) == (State.CANCELLED, ReasonCode.USER_CANCELLED)
    assert len(tokens(site)) == 1
    assert not any(item.state in ("Pending", "Executing") for item in site.machines["R1"].queue)


def test_what_falls_due_while_the_writer_is_waited_for_goes_along(site, plan, monkeypatch):
    plan("2026-11-23T06:05")
    plan("2026-11-23T06:06", name="second")
    site.run(DUE - 0.5)
    site.engine.advance()  # its heartbeat is written
    write, rows_after = site.container.db.write, []

    def late(work, patient=False):
        if not rows_after:
            site.clock.advance(62.0)
        result = write(work, patient)
        rows_after.append(len(site.executions()))
        return result

    site.clock.advance(0.55)
    monkeypatch.setattr(site.container.db, "write", late)
    site.engine.advance()
    assert rows_after[0] == 2
