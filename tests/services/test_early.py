"""An intent is on disk and with its worker 0.1 s before its instant, unless something prevents the start; what happens in between is
respected."""
from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.models import ReasonCode, State, Wait
from app.domain.rules import INTENT_LEAD
from app.services.catalogue.pausing import Pausing
from app.services.dispatch.intents import PUT_OFF_AT_MOST, ROUND_TAKES
from tests.support.network import Fate

DUE = 300.0              # s from the beginning: 06:05
INSTANT = datetime(2026, 11, 23, 6, 5, tzinfo=UTC)
EARLIER = 0.05           # s before the instant, within INTENT_LEAD
DAY = 86400.0


def sent(site) -> list[str]:
    """Tokens of ours that the robot has ever had."""
    return [item.description for item in site.machines["R1"].queue if item.description]


def only_worker(site):
    [worker] = site._workers.values()
    return worker


def come_close(site) -> None:
    """The robot has been read ahead, and the instant is near enough."""
    site.run(DUE - 1.0)
    site.container.scheduler.due_soon()
    site.read_ahead(only_worker(site))
    site.clock.advance((INSTANT - site.clock.now()).total_seconds() - EARLIER)
    site.tick()


@pytest.fixture
def in_hand(site, plan):
    """A schedule whose next start is written down, taken in hand by its worker, and not yet due."""
    schedule = plan("2026-11-23T06:05", minimum_battery_percent=20)
    come_close(site)
    wait = only_worker(site).step(False, intents=site._intents.pop(1), changed=False)
    assert [run.state for run in site.executions()] == [State.SUBMITTING]
    assert 0 < wait <= EARLIER
    return schedule


def test_it_is_sent_at_its_instant_and_not_before(site, in_hand):
    site.run(EARLIER - 0.001)
    assert sent(site) == []
    site.run(0.001)
    [run] = site.executions()
    assert sent(site) == [run.token]
    assert run.created_at < INSTANT <= run.submitted_at < INSTANT + timedelta(seconds=0.1)
    assert run.attempts == 1


def test_nothing_is_written_earlier_than_that(site, plan):
    plan("2026-11-23T06:05")
    site.run(DUE - 1.0)
    site.read_ahead(only_worker(site))
    site.clock.advance((INSTANT - site.clock.now() - INTENT_LEAD).total_seconds() - 0.001)
    site.tick()
    assert site.executions() == []
    assert 0 < site.container.scheduler.seconds_to_next() < 0.03
    site.clock.advance(0.001)
    site.tick()
    assert [run.state for run in site.executions()] == [State.SUBMITTING]


# ---------------------------------------------------------------- what people do in that moment
def _switch_off(site, schedule):
    site.container.catalogue.set_schedule_enabled(schedule.id, False)
    return State.CANCELLED, ReasonCode.SCHEDULE_CHANGED


def _delete(site, schedule):
    site.container.catalogue.remove_schedule(schedule.id)
    return State.CANCELLED, ReasonCode.SCHEDULE_CHANGED


def _edit(site, schedule):
    stored = site.container.repositories.schedules.get(site.container.db.read(), schedule.id)
    site.container.catalogue.save_schedule(replace(stored, start=datetime(2026, 11, 23, 7, 0)))
    return State.CANCELLED, ReasonCode.SCHEDULE_CHANGED


def _pause_schedule(site, schedule):
    Pausing(site.container.db, site.clock, site.container.changes).pause(schedule.id, INSTANT + timedelta(hours=1))


def _pause(site, schedule):
    _pause_schedule(site, schedule)
    return State.SKIPPED, ReasonCode.HOLD


def _cancel(site, schedule):
    site.container.operator.cancel_execution(site.executions()[0].id)
    return State.CANCELLED, ReasonCode.USER_CANCELLED


def _switch_the_robot_off(site, schedule):
    robot = site.container.repositories.robots.get(site.container.db.read(), schedule.robot_id)
    site.container.catalogue.save_robot(replace(robot, enabled=False))
    return State.CANCELLED, ReasonCode.ROBOT_REMOVED


def _take_the_robot_away(site, schedule):
    site.container.catalogue.remove_robot(schedule.robot_id)
    return State.CANCELLED, ReasonCode.ROBOT_REMOVED


@pytest.mark.parametrize("change", [_switch_off, _delete, _edit, _pause, _cancel, _switch_the_robot_off, _take_the_robot_away])
def test_what_is_revoked_in_that_moment_is_not_sent(site, in_hand, change):
    site.clock.advance(0.01)
    outcome = change(site, in_hand)
    site.run(600.0)
    run = site.executions()[0]
    assert (run.state, run.reason.code) == outcome
    assert sent(site) == []


def test_what_is_revoked_never_counts_as_tried(site, in_hand):
    site.clock.advance(0.01)
    _switch_off(site, in_hand)
    site.run(1.0)
    [run] = site.executions()
    assert run.attempts == 0
    assert run.ended_at >= run.planned_at


def test_a_hold_in_that_moment_stops_it(site, in_hand):
    site.container.holds.hold("cleaning")
    site.run(10.0)
    [run] = site.executions()
    assert (run.state, run.wait, run.attempts) == (State.WAITING, Wait.HOLD, 0)
    assert sent(site) == []


def test_another_schedule_that_is_changed_stops_nothing(site, plan, in_hand):
    plan("2026-11-23T09:00", name="another")
    site.run(0.1)
    assert len(sent(site)) == 1


def test_the_ledger_is_not_asked_while_nobody_changes_anything(site, in_hand, monkeypatch):
    """It would be one more wait between the instant and the POST."""
    asked = []
    monkeypatch.setattr(site.container.ledger, "revocation_reason", asked.append)
    site.run(EARLIER + 0.01)
    assert len(sent(site)) == 1
    assert asked == []


# ---------------------------------------------------------------- what prevents a start is judged at the instant
@pytest.mark.parametrize("obstacle", ["paused", "held", "low battery", "not read", "one before", "still running", "switched off robot"])
def test_what_something_stands_in_the_way_of_is_not_written_early(site, plan, obstacle):
    if obstacle == "one before":
        site.machines["R1"].set_battery(20.0)
        plan("2026-11-23T06:04", minimum_battery_percent=50)
    schedule = plan("2026-11-23T06:05", "FREQ=DAILY", minimum_battery_percent=50 if obstacle == "low battery" else 0)
    match obstacle:
        case "paused":
            _pause_schedule(site, schedule)
        case "held":
            site.container.holds.hold("cleaning")
        case "low battery":
            site.machines["R1"].set_battery(20.0)
        case "not read":
            site.network.next("GET", "/status", Fate.REFUSED)
        case "switched off robot":
            _switch_the_robot_off(site, schedule)
        case "still running":
            site.container.db.write(lambda c: c.execute(
                """INSERT INTO executions (trigger, schedule_id, robot_id, robot, mission, mission_guid, timezone, token, state, planned_at,
                                           closes_at, created_at) VALUES ('scheduled', ?, 1, 'R1', 'Deliver', 'g', 'UTC', 't', 'executing',
                   '2026-11-22T06:05:00.000000Z', '2026-11-22T06:35:00.000000Z', '2026-11-22T06:05:00.000000Z')""", (schedule.id,)))
    if obstacle in ("not read", "still running"):
        site.run(DUE - 1.0)
        site.clock.advance(0.95)
        if obstacle == "still running":
            site.read_ahead(only_worker(site))
            site.clock.step(-0.4)
        site.tick()
    else:
        come_close(site)
    assert [run for run in site.executions() if run.planned_at == INSTANT] == []
    site.clock.advance(EARLIER)
    site.tick()
    assert len([run for run in site.executions() if run.planned_at == INSTANT]) == 1


# ---------------------------------------------------------------- clocks, stops, trouble
@pytest.mark.parametrize("step", [-3600.0, -DAY, 40.0])
def test_a_clock_that_is_set_in_that_moment_neither_delays_nor_doubles(site, in_hand, step):
    site.clock.step(step)
    site.run(EARLIER + 0.01)
    assert len(sent(site)) == 1
    site.run(2 * 3600.0)
    assert len(sent(site)) == 1
    assert len(site.executions()) == 1


def test_a_worker_that_is_closed_releases_what_it_holds(site, in_hand):
    only_worker(site).close()
    [run] = site.executions()
    assert (run.state, run.attempts) == (State.WAITING, 0)
    site._workers.clear()                       # another takes its place, and does not send it early either
    site.run(1.0)
    [run] = site.executions()
    assert sent(site) == [run.token]
    assert run.submitted_at >= INSTANT


def test_one_that_was_never_taken_in_hand_is_given_back_too(site, plan):
    plan("2026-11-23T06:05")
    come_close(site)
    only_worker(site).close(site._intents.pop(1))
    assert [(run.state, run.attempts) for run in site.executions()] == [(State.WAITING, 0)]


def test_a_power_cut_in_that_moment_loses_nothing_and_doubles_nothing(site, in_hand):
    site.switch_off(cleanly=False)
    site.switch_on()
    site.run(300.0)
    [run] = site.executions()
    assert sent(site) == [run.token]


def test_an_unexpected_error_with_one_leaves_the_others_in_hand(site, plan, monkeypatch):
    for name in ("first", "second"):
        plan("2026-11-23T06:05", name=name)
    come_close(site)
    worker = only_worker(site)
    worker.step(False, intents=site._intents.pop(1), changed=False)
    enqueue, left = worker.client.enqueue, [RuntimeError("planted")]

    def fails_once(*args, **options):
        if left:
            raise left.pop()
        return enqueue(*args, **options)

    monkeypatch.setattr(worker.client, "enqueue", fails_once)
    site.clock.advance(EARLIER)
    with pytest.raises(RuntimeError):
        worker.step(False, changed=False)
    worker.step(False, changed=False)
    second = next(run for run in site.executions() if run.schedule == "second")
    assert sent(site) == [second.token]


# ---------------------------------------------------------------- what gives way
def test_a_round_gives_way_to_what_is_due_in_a_moment(site, in_hand):
    worker = only_worker(site)
    asked: list[str] = []
    site.network.interrupt = asked.append
    site.clock.advance(EARLIER - ROUND_TAKES / 2)
    wait = worker.step(True, changed=False)
    assert asked == []
    assert wait == pytest.approx(ROUND_TAKES / 2)
    site.clock.advance(wait)
    worker.step(False, changed=False)
    assert asked[0] == "before POST /mission_queue"
    assert "before GET /status" in asked                       # the poll that was asked for is not forgotten


def test_but_not_for_ever(site, plan):
    """Missions without a gap between them: robot and ledger are looked at all the same."""
    plan("2026-11-23T06:05")
    come_close(site)
    worker = only_worker(site)
    [intent] = site._intents.pop(1)
    asked: list[str] = []
    site.network.interrupt = asked.append
    steps, began = 0, site.clock.monotonic()
    while "before GET /status" not in asked:
        following = replace(intent, id=1000 + steps, planned_at=site.clock.now() + timedelta(seconds=0.03))
        worker.step(steps == 0, intents=[following], changed=False)
        site.clock.advance(0.01)
        steps += 1
    assert PUT_OFF_AT_MOST <= site.clock.monotonic() - began <= PUT_OFF_AT_MOST + 0.3


def test_what_the_robot_has_taken_is_written_down_when_there_is_time(site, plan):
    """Two starts 20 ms apart: the second does not wait for the note of the first, and one write notes both."""
    plan("2026-11-23T06:05", name="first")
    plan("2026-11-23T06:05", name="second")
    come_close(site)
    worker = only_worker(site)
    first, second = site._intents.pop(1)
    worker.step(False, intents=[first, replace(second, planned_at=second.planned_at + timedelta(seconds=0.02))], changed=False)
    site.clock.advance(EARLIER)
    worker.step(False, changed=False)
    assert len(sent(site)) == 1
    assert {run.state for run in site.executions()} == {State.SUBMITTING}
    site.clock.advance(0.02)
    worker.step(False, changed=False)
    assert len(sent(site)) == 2
    assert {run.state for run in site.executions()} == {State.QUEUED}
