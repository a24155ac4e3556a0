"""A second before something is due its robot's status is read, so that at the instant only the intent and the POST remain."""
from __future__ import annotations

from itertools import pairwise

import pytest

from app.domain.models import State
from app.services.dispatch.scheduler import PREFETCH_LEAD, PREFETCH_TOGETHER
from app.services.dispatch.worker import PREFETCH_SPREAD, phase_of
from tests.support.network import Fate

DUE = 300.0              # s from the beginning: 06:05


@pytest.fixture
def requests(site, plan) -> list[str]:
    """What has been asked of the robot since the moment before the schedule is due."""
    plan("2026-11-23T06:05")
    site.run(DUE - 1.0)
    asked: list[str] = []
    site.network.interrupt = lambda where: asked.append(where.removeprefix("before ")) if where.startswith("before ") else None
    return asked


def test_each_instant_is_reported_once_and_only_shortly_before(site, plan):
    scheduler = site.container.scheduler
    plan("2026-11-23T06:05")
    site.run(DUE - 5.0)
    assert scheduler.due_soon() == set()
    site.clock.advance(4.0)
    assert scheduler.due_soon() == {1}
    assert scheduler.due_soon() == set()
    site.clock.advance(0.6)
    assert scheduler.due_soon() == set()
    site.clock.step(-0.6)                          # set back: it may be announced again, which costs one status read
    site.clock.step(-3600.0)
    assert scheduler.due_soon() == set()


def test_at_the_instant_only_the_post_remains(site, requests):
    [worker] = site._workers.values()
    site.read_ahead(worker)
    assert requests == ["GET /status"]
    requests.clear()
    site.run(1.05)
    assert requests[0] == "POST /mission_queue"
    assert [run.state for run in site.executions()] == [State.QUEUED]


def test_a_look_ahead_that_fails_is_no_attempt(site, requests):
    [worker] = site._workers.values()
    site.network.next("GET", "/status", Fate.REFUSED)
    site.read_ahead(worker)
    site.run(1.05)
    assert requests[:3] == ["GET /status", "GET /status", "POST /mission_queue"]
    [run] = site.executions()
    assert (run.state, run.attempts) == (State.QUEUED, 1)


def test_what_is_due_does_not_wait_for_a_poll(site, requests):
    """The poll of 06:05:00 comes together with the schedule."""
    site.run(1.05)
    assert requests[:2] == ["GET /status", "POST /mission_queue"]


def test_a_robot_is_read_ahead_when_its_turn_comes(site, requests):
    [worker] = site._workers.values()
    wait = worker.step(False, due_soon=True, changed=False)
    assert requests == []
    assert 0 < wait < PREFETCH_SPREAD
    site.clock.advance(wait)
    worker.step(False, changed=False)
    assert requests == ["GET /status"]


def test_many_robots_take_turns_and_all_are_read_before_the_instant():
    """What else falls due in the second before must not wait for two hundred reads in one moment."""
    assert (PREFETCH_LEAD - PREFETCH_TOGETHER).total_seconds() - 0.2 > PREFETCH_SPREAD
    turns = sorted(PREFETCH_SPREAD * phase_of(number) for number in range(1, 201))
    assert max(later - earlier for earlier, later in pairwise(turns)) <= 2.5 * PREFETCH_SPREAD / 200
