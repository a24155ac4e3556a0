"""Housekeeping: the history is held to its limit, but what falls due goes first."""

from __future__ import annotations

from datetime import timedelta

import pytest

from app.database.execution_history import PRUNED_AT_ONCE, ExecutionHistory
from app.database.schedules import ScheduleRepository
from app.services.dispatch.timing import TIDIES_WITHIN, TIDY_EVERY
from tests.support.history import add_runs

LIMIT = 20


@pytest.fixture
def long_history(site) -> None:
    """Three pieces more than the limit, in a running app that has just tidied up."""
    site.run(1.0)
    site.container.catalogue.change_settings(history_limit=LIMIT)
    add_runs(site.container, LIMIT + 3 * PRUNED_AT_ONCE)
    site.container.ledger.grew = True


def kept(site) -> int:
    return len(site.executions())


def test_the_history_is_held_to_its_limit_when_nothing_else_is_to_be_done(site, long_history):
    site.run(1.0)
    assert kept(site) == LIMIT
    assert {run.token for run in site.executions()} == {str(3 * PRUNED_AT_ONCE + number) for number in range(LIMIT)}


def test_it_waits_while_something_is_due_in_a_moment_but_not_for_ever(site, long_history, monkeypatch):
    """Missions without a gap between them: one piece a minute."""
    soon = timedelta(seconds=0.01)
    monkeypatch.setattr(ScheduleRepository, "next_due", lambda _self, c, robot_id=None: site.clock.now() + soon)
    for _ in range(int(TIDIES_WITHIN / TIDY_EVERY) - 2):
        site.engine.advance()
        site.clock.advance(TIDY_EVERY)
    assert kept(site) == LIMIT + 3 * PRUNED_AT_ONCE
    for _ in range(4):
        site.engine.advance()
        site.clock.advance(TIDY_EVERY)
    assert kept(site) == LIMIT + 2 * PRUNED_AT_ONCE
    monkeypatch.undo()
    site.engine.advance()
    assert kept(site) == LIMIT


def test_nothing_is_counted_while_nothing_ended(site, monkeypatch):
    site.run(1.0)
    monkeypatch.setattr(ExecutionHistory, "surplus", lambda *_: pytest.fail("counted for nothing"))
    site.run(60.0)
