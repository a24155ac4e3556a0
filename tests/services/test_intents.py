"""What falls due at a robot that was read a moment ago is written together with the intent of its first attempt, and sent at once."""

from __future__ import annotations

from app.domain.execution import ReasonCode, State
from app.services.dispatch.timing import INTENT_LEAD
from tests.support.seen import tokens

DUE = 300.0  # s from the beginning: 06:05


def insert_due(site) -> list[State]:
    """Reach the instant with its robot read a moment ago, but without a step of a worker; returns the rows' states."""
    site.run(DUE - INTENT_LEAD - 0.01 - site.seconds())
    site.clock.advance(INTENT_LEAD + 0.05)
    site.engine.advance()
    return site.states()


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
