"""What an operator takes back while its outcome is unknown is never sent again (D1)."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta

import pytest

from app.domain.models import ReasonCode, State
from tests.support.network import Fate
from tests.support.seen import items, outcomes, robot_of, sent_at, states

SENT = 306.0  # s: the start at 06:05 has been submitted, and nobody knows whether it arrived


def _robot_off(site, schedule):
    site.container.catalogue.set_robot_enabled(schedule.robot_id, False)


def _deleted(site, schedule):
    site.container.catalogue.remove_schedule(schedule.id)


def _off(site, schedule):
    site.container.catalogue.set_schedule_enabled(schedule.id, False)


def _paused(site, schedule):
    site.container.pausing.pause(schedule.id, site.clock.now() + timedelta(days=1))


def _mission_removed(site, schedule):
    site.container.catalogue.remove_mission(schedule.mission_id)


def _moved_to_tomorrow(site, schedule):
    site.container.catalogue.save_schedule(replace(schedule, start=datetime.fromisoformat("2026-11-24T06:05")))


TAKEN_BACK = [
    pytest.param(_robot_off, (State.CANCELLED, ReasonCode.ROBOT_REMOVED, 1), id="robot switched off"),
    pytest.param(_deleted, (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED, 1), id="schedule deleted"),
    pytest.param(_off, (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED, 1), id="schedule switched off"),
    pytest.param(_paused, (State.SKIPPED, ReasonCode.HOLD, 1), id="schedule paused"),
    pytest.param(_mission_removed, (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED, 1), id="mission removed"),
    pytest.param(_moved_to_tomorrow, (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED, 1), id="schedule moved"),
]


@pytest.mark.parametrize(("take_back", "end"), TAKEN_BACK)
def test_what_is_taken_back_in_the_quiet_time_ends_with_that_reason_and_is_not_sent_again(site, plan, take_back, end):
    """Whether a start is still wanted is asked before every attempt, and it ends with that reason and its attempts."""
    schedule = plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(SENT)
    take_back(site, schedule)
    site.run(600)
    assert sent_at(site) == [300]
    assert items(site) == []
    assert outcomes(site) == [end]


def test_a_start_that_is_moved_in_the_quiet_time_runs_at_its_new_time_only(site, plan):
    """A schedule that is moved while the outcome of its start is unknown runs once, when it is planned now."""
    schedule = plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(SENT)
    site.container.catalogue.save_schedule(replace(schedule, start=datetime.fromisoformat("2026-11-23T06:20")))
    site.run(1200)
    assert sent_at(site) == [300, 1200]
    assert outcomes(site) == [(State.CANCELLED, ReasonCode.SCHEDULE_CHANGED, 1), (State.COMPLETED, None, 1)]


@pytest.mark.parametrize(("take_back", "end"), TAKEN_BACK)
def test_what_is_taken_back_between_two_tries_is_not_tried_again(site, plan, take_back, end):
    """A start that waits for its next try, since the robot refused the connection, ends at once."""
    schedule = plan("2026-11-23T06:05")
    site.network.down.add("R1")
    site.run(301)
    take_back(site, schedule)
    site.network.down.clear()
    site.run(600)
    assert (sent_at(site), items(site)) == ([], [])
    assert [each[:2] for each in outcomes(site)] == [end[:2]]


def test_what_is_held_in_the_quiet_time_waits_for_the_release(site, plan):
    """A hold of all robots holds a second attempt too."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(SENT)
    site.container.holds.hold("shift meeting")
    site.run(300)
    assert sent_at(site) == [300]
    site.container.holds.release()
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 2)]


@pytest.mark.parametrize("restarts", [False, True])
def test_a_robot_that_is_switched_off_is_followed_until_what_it_has_of_ours_has_ended(site, plan, restarts):
    """Switching a robot off sends nothing more to it, and what it is doing is read to its end, by the next run of the app too."""
    plan("2026-11-23T06:05")
    site.run(320)
    assert states(site) == ["Executing"]
    site.container.catalogue.set_robot_enabled(robot_of(site).id, False)
    if restarts:
        site.power_cut(5)
    site.run(300)
    assert states(site) == ["Done"]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


@pytest.mark.parametrize("restarts", [False, True])
@pytest.mark.parametrize("take_back", [_robot_off, _deleted, _mission_removed])
def test_what_did_arrive_before_it_was_taken_back_is_followed_to_its_end(site, plan, take_back, restarts):
    """The answer was lost and the robot runs it: the row says so, whatever was edited meanwhile."""
    schedule = plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(300.5)
    take_back(site, schedule)
    if restarts:
        site.power_cut(5)
    site.run(600)
    assert sent_at(site) == [300]
    assert states(site) == ["Done"]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


def test_what_a_removed_robot_may_have_is_ended_and_not_sent_again(site, plan):
    """Of a robot that is removed everything open ends at once."""
    schedule = plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(SENT)
    site.container.catalogue.remove_robot(schedule.robot_id)
    site.run(600)
    assert sent_at(site) == [300]
    assert outcomes(site) == [(State.CANCELLED, ReasonCode.ROBOT_REMOVED, 1)]
