"""A second before something is due its robot's status is read, so that at the instant only the POST remains."""

from __future__ import annotations

from itertools import pairwise

import pytest

from app.domain.execution import State
from app.services.dispatch import messages
from app.services.dispatch.timing import INTENT_LEAD, PREFETCH_LEAD, PREFETCH_SPREAD, PREFETCH_TOGETHER
from app.services.dispatch.worker import phase_of
from tests.support.network import Fate
from tests.support.seen import requests

DUE = 300.0  # s from the beginning: 06:05


@pytest.fixture
def asked(site, plan) -> list[str]:
    """What has been asked of the robot since some seconds before the schedule is due."""
    plan("2026-11-23T06:05")
    site.run(DUE - 5.0)
    return requests(site)


def test_the_robot_is_read_once_and_only_shortly_before(site, asked):
    site.run(5.0 - PREFETCH_LEAD)
    assert asked == []
    site.run(PREFETCH_LEAD - INTENT_LEAD)
    assert asked == ["GET /status"]


def test_two_instants_close_together_are_announced_together(site, plan, asked):
    plan("2026-11-23T06:05", name="another")
    site.run(5.0 - INTENT_LEAD)
    assert asked == ["GET /status"]


def test_an_instant_that_a_clock_set_back_has_put_off_is_not_announced(site, asked):
    site.clock.step(-3600.0)
    site.run(5.0 - INTENT_LEAD)
    assert asked == []


def test_at_the_instant_only_the_post_remains(site, asked):
    """And the poll of 06:05:00, which comes together with the schedule."""
    site.run(5.0 - INTENT_LEAD / 2)
    asked.clear()
    site.run(INTENT_LEAD)
    assert asked[0] == "POST /mission_queue"
    assert site.states() == [State.QUEUED]


def test_so_it_does_where_the_queue_could_not_be_read_when_the_app_began(site, plan):
    site.container.catalogue.change_settings(poll_interval_seconds=600)
    plan("2026-11-23T06:05")
    site.run(DUE - 30.0)
    site.switch_off()
    site.network.next("GET", "/mission_queue", Fate.REFUSED, count=2)
    site.switch_on()
    site.run(30.0 - INTENT_LEAD / 2)
    asked = requests(site)
    site.run(INTENT_LEAD)
    assert asked[0] == "POST /mission_queue"


def test_a_read_ahead_that_fails_is_no_attempt(site, asked):
    site.network.next("GET", "/status", Fate.REFUSED)
    site.run(5.1)
    assert asked[:3] == ["GET /status", "GET /status", "POST /mission_queue"]
    [run] = site.executions()
    assert (run.state, run.attempts) == (State.QUEUED, 1)


def test_a_robot_is_read_ahead_when_its_turn_comes(site, asked):
    [worker] = site._workers.values()
    worker.handle(messages.Prefetch())
    wait = worker.advance()
    assert asked == []
    assert 0 < wait < PREFETCH_SPREAD
    site.clock.advance(wait)
    worker.advance()
    assert asked == ["GET /status"]


def test_many_robots_take_turns_and_all_are_read_before_the_intents_are_written():
    """What else falls due in the second before must not wait for two hundred reads in one moment."""
    assert PREFETCH_LEAD - PREFETCH_TOGETHER - INTENT_LEAD > PREFETCH_SPREAD
    turns = sorted(PREFETCH_SPREAD * phase_of(number) for number in range(1, 201))
    assert max(later - earlier for earlier, later in pairwise(turns)) <= 2.5 * PREFETCH_SPREAD / 200
