"""A row that says ``submitting`` belongs to one worker: the one that got it. A row on its way to its worker is
not searched for; a row of an earlier process is searched for on the robot and never sent as if for the first time."""

from __future__ import annotations

import pytest

from app.database.connection import DatabaseUnavailable
from app.domain.execution import State
from app.services.dispatch import messages
from app.services.dispatch.timing import INTENT_LEAD
from tests.support.seen import requests, tokens

DUE = 300.0  # s from the beginning: 06:05
QUIET = 90.0  # s until a submission of unknown outcome is sent again
R1 = 1


@pytest.fixture
def asked(site) -> list[str]:
    """Every request to a robot from here on."""
    return requests(site)


@pytest.fixture
def on_its_way(site, plan, monkeypatch) -> messages.Start:
    """An intent is on disk, and has not reached its worker yet, though other messages do."""
    plan("2026-11-23T06:05")
    site.run(DUE - INTENT_LEAD - 0.01)
    kept: list[messages.Start] = []
    post = site.post
    monkeypatch.setattr(
        site, "post", lambda key, each: kept.append(each) if isinstance(each, messages.Start) else post(key, each)
    )
    site.clock.advance(0.02)
    site.engine.advance()
    monkeypatch.undo()
    assert site.states() == [State.SUBMITTING]
    [start] = kept
    return start


def check_was_sent(site, attempts: int = 1) -> None:
    """The robot has the only start once, after so many attempts."""
    [run] = site.executions()
    assert (tokens(site), run.attempts) == ([run.token], attempts)


def test_what_is_on_its_way_to_its_worker_is_not_looked_for(site, on_its_way, asked):
    site.kick()
    site.run(1.0)
    assert "POST /mission_queue" not in asked
    site.post(R1, on_its_way)
    site.run(0.1)
    check_was_sent(site)


@pytest.mark.parametrize("late", [3.0, 600.0])
def test_however_late_it_comes_it_is_sent_once(site, on_its_way, late):
    """The robot has to be read again first, which does not count as an attempt."""
    site.run(late)
    site.post(R1, on_its_way)
    site.run(10.0)
    check_was_sent(site)


def test_nothing_is_written_ahead_for_a_worker_that_is_still_to_look_for_what_it_may_have_lost(site, plan):
    """A row that it finds is then certainly not being sent to it."""
    plan("2026-11-23T06:05")
    site.run(DUE - INTENT_LEAD - 0.1)
    worker = site._workers[R1]
    assert worker.readiness() is not None
    first, second = worker.expect_recovery(), worker.expect_recovery()
    for number, message in enumerate((first, second)):
        assert worker.readiness() is None, number
        site.post(R1, message)
        site.run(0.02)
    assert worker.readiness() is not None


def test_what_was_written_while_the_database_failed_is_looked_for(site, on_its_way):
    """Its write was committed, but the scheduler got an error: no worker has the row."""
    site.post(R1, site._workers[R1].expect_recovery())
    site.run(QUIET / 2)
    assert [(run.state, run.attempts) for run in site.executions()] == [(State.SUBMITTING, 1)]
    site.run(QUIET)
    assert len(tokens(site)) == 1


def test_a_start_that_is_searched_for_is_not_sent(site, on_its_way, asked):
    """The worker has met an error and looks for all that the ledger has as submitted, before this one reaches it."""
    site.post(R1, site._workers[R1].expect_recovery())
    site.run(1.0)
    site.post(R1, on_its_way)
    site.run(QUIET - 5.0)
    assert tokens(site) == []  # it might be another's
    site.run(QUIET)
    check_was_sent(site, attempts=2)
    assert asked.count("POST /mission_queue") == 1


def test_a_start_searched_for_and_sent_is_not_sent_again(site, on_its_way, asked):
    """However long the scheduler's thread stood still."""
    site.post(R1, site._workers[R1].expect_recovery())
    site.run(2 * QUIET)
    assert asked.count("POST /mission_queue") == 1
    site.post(R1, messages.Prefetch())  # something else is due: the robot has just been read
    site.run(1.0)
    site.post(R1, on_its_way)
    site.run(2 * QUIET)
    assert asked.count("POST /mission_queue") == 1


def test_after_an_error_what_the_worker_has_in_hand_stays_its_own(site, plan, asked):
    plan("2026-11-23T06:05")
    site.run(DUE - 0.05)
    site.post(R1, site._workers[R1].expect_recovery())
    site.run(0.06)
    check_was_sent(site)


def test_a_new_worker_looks_for_what_the_one_before_has_left_submitted(site, on_its_way, asked):
    """As after a power cut."""
    worker = site._workers[R1]
    site.close(R1)
    site.open(site.container.make_worker(worker.robot))
    site.run(QUIET / 2)
    assert tokens(site) == []
    assert [path for path in asked if path.startswith("POST /mission_queue/search")]
    site.run(QUIET)
    check_was_sent(site, attempts=2)


def test_an_intent_whose_write_is_said_to_have_failed_is_looked_for(site, plan, monkeypatch):
    """It had waited before: the worker knows its state from before the write."""
    site.machines["R1"].set_battery(10.0)
    plan("2026-11-23T06:05", minimum_battery_percent=20)
    site.run(DUE + 5.0)
    site.machines["R1"].set_battery(90.0)
    write = site.container.db.write

    def fail_after_the_intent(work, patient=False):
        done = write(work, patient)
        if isinstance(done, list) and any(row.state is State.SUBMITTING for _move, row in done):
            monkeypatch.undo()
            raise DatabaseUnavailable("committed all the same")
        return done

    monkeypatch.setattr(site.container.db, "write", fail_after_the_intent)
    site.run(5.0)
    assert (site.states(), tokens(site)) == ([State.SUBMITTING], [])
    site.run(QUIET + 10.0)
    check_was_sent(site, attempts=2)
