"""Constraints, refusals and the ways a submission can go wrong: what each execution ends as, and what the robot really has."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest

from app.domain.models import Mission, Overlap, ReasonCode, State, Wait
from app.services.dispatch import messages
from mir_sim import world
from mir_sim.mission_queue import MissionQueue
from tests.support.network import Fate

LINE_1 = world.BY_NAME["Line 1"].guid


def items(site):
    return list(site.machines["R1"].queue)


def outcome(site):
    return [(run.state, run.reason and run.reason.code) for run in site.executions()]


# ---------------------------------------------------------------- constraints
def test_a_low_battery_waits_and_runs_when_charged(site, plan):
    site.machines["R1"].set_battery(12.0)
    plan("2026-11-23T06:05", minimum_battery_percent=30)
    site.run(310)
    [run] = site.executions()
    assert (run.state, run.wait, run.attempts) == (State.WAITING, Wait.BATTERY, 0)
    site.machines["R1"].set_battery(80.0)
    site.run(10)
    assert items(site)


def test_a_battery_low_all_window_long_is_skipped_with_the_numbers(site, plan):
    site.machines["R1"].set_battery(12.0)
    plan("2026-11-23T06:05", minimum_battery_percent=30, start_window_minutes=5)
    site.run(700)
    [run] = site.executions()
    assert (run.state, run.reason.code) == (State.SKIPPED, ReasonCode.BATTERY_LOW)
    assert run.reason.details["minimum"] == 30
    assert round(run.reason.details["battery"]) in (11, 12)
    assert items(site) == []


def test_an_emergency_stop_hides_the_battery_so_a_minimum_is_not_met(site, plan):
    site.machines["R1"].press_emergency_stop(True)
    plan("2026-11-23T06:05", minimum_battery_percent=1)
    site.run(310)
    assert site.executions()[0].wait is Wait.BATTERY


def test_the_general_minimum_holds_unless_the_schedule_says_none(site, plan):
    site.machines["R1"].set_battery(12.0)
    site.container.catalogue.change_settings(minimum_battery_percent=30)
    plan("2026-11-23T06:05", name="inherits")
    plan("2026-11-23T06:05", name="none", minimum_battery_percent=0)
    site.run(310)
    assert {run.schedule: run.state is State.WAITING for run in site.executions()} == {"inherits": True, "none": False}


@pytest.mark.parametrize(("overlap", "expected"), [(Overlap.SKIP, State.SKIPPED), (Overlap.QUEUE, State.QUEUED)])
def test_the_previous_run_still_open(site, plan, overlap, expected):
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=1", overlap=overlap)
    site.run(305)
    site.machines["R1"].pause()
    site.run(60)
    first, second = site.executions()[:2]
    assert first.state.is_open
    assert second.state is expected
    if expected is State.SKIPPED:
        assert second.reason.code is ReasonCode.OVERLAP


def test_a_busy_robot_gets_it_in_its_own_queue(site, plan):
    container = site.container
    robot, mission = (
        container.repositories.robots.all(container.db.read())[0],
        container.repositories.missions.all(container.db.read())[0],
    )
    plan("2026-11-23T06:05")
    site.run(298)
    container.operator.run_now(robot.id, mission.id)
    site.kick()
    site.run(4)
    assert [run.state for run in site.executions()] == [State.EXECUTING, State.QUEUED]
    assert [str(item.state) for item in items(site)] == ["Executing", "Pending"]


def test_higher_priority_goes_first_among_those_due_together(site, plan):
    plan("2026-11-23T06:05", name="a")
    plan("2026-11-23T06:05", name="b", priority=5)
    site.run(305)
    assert [run.schedule for run in sorted(site.executions(), key=lambda run: run.queue_id)] == ["b", "a"]
    assert [item.priority for item in items(site)] == [5, 0]


def test_parameters_travel_by_input_name(site):
    container = site.container
    mission = site.add_mission("Go to position")
    robot = container.repositories.robots.all(container.db.read())[0]
    container.operator.run_now(robot.id, mission.id, {"Position": LINE_1})
    site.kick()
    site.run(5)
    [item] = items(site)
    assert [(p["input_name"], p["value"]) for p in item.parameters] == [("Position", LINE_1)]


# ---------------------------------------------------------------- holds
def test_a_hold_keeps_it_waiting_and_the_window_ends_it_as_skipped(site, plan):
    site.container.holds.hold("shift meeting")
    plan("2026-11-23T06:05", start_window_minutes=5)
    site.run(310)
    assert site.executions()[0].wait is Wait.HOLD
    site.run(300)
    assert outcome(site) == [(State.SKIPPED, ReasonCode.HOLD)]
    assert items(site) == []


def test_a_released_hold_lets_it_go(site, plan):
    site.container.holds.hold("shift meeting", until=datetime(2026, 11, 23, 6, 10, tzinfo=UTC))
    plan("2026-11-23T06:05")
    site.run(590)
    assert items(site) == []
    site.run(20)
    assert len(items(site)) == 1


# ---------------------------------------------------------------- refusals
def test_a_mission_that_the_robot_does_not_have(site, plan):
    container = site.container
    mission = container.catalogue.save_mission(Mission("Gone", "00000000-0000-0000-0000-000000000000"))
    robot = container.repositories.robots.all(container.db.read())[0]
    container.operator.run_now(robot.id, mission.id)
    site.kick()
    site.run(5)
    [run] = site.executions()
    assert (run.state, run.reason.code, run.attempts) == (State.FAILED, ReasonCode.UNKNOWN_MISSION, 1)


def test_a_wrong_password_fails_at_once(site, plan):
    container = site.container
    robot = container.repositories.robots.all(container.db.read())[0]
    container.catalogue.save_robot(robot, password="changed on the robot")
    site.switch_off()
    site.switch_on()
    plan("2026-11-23T06:05")
    site.run(305)
    assert outcome(site) == [(State.FAILED, ReasonCode.UNAUTHORIZED)]
    assert [alarm.code for alarm in site.container.alarms.open()].count("unauthorized") == 1


def test_another_machine_at_the_address_gets_nothing(site, plan):
    site.run(60)
    site.machines["R1"].serial_number = "somebody else"
    plan("2026-11-23T06:05")
    site.run(400)
    [run] = site.executions()
    assert (run.state, run.reason.code) == (State.FAILED, ReasonCode.WRONG_ROBOT)
    assert run.reason.details["found"] == "somebody else"
    assert items(site) == []
    assert "wrong_robot" in [alarm.code for alarm in site.container.alarms.open()]


def test_retry_limit_zero_means_no_second_try(site, plan):
    site.container.catalogue.change_settings(retry_limit=0)
    plan("2026-11-23T06:05")
    site.network.down.add("R1")
    site.run(330)
    [run] = site.executions()
    assert (run.reason.code, run.attempts) == (ReasonCode.RETRY_LIMIT, 1)


def test_the_window_ends_the_tries_too(site, plan):
    plan("2026-11-23T06:05", start_window_minutes=1)
    site.network.down.add("R1")
    site.run(400)
    [run] = site.executions()
    assert run.reason.code is ReasonCode.WINDOW_CLOSED
    assert run.ended_at - run.planned_at < timedelta(seconds=80)


# ---------------------------------------------------------------- unknown outcomes
UNKNOWN = [Fate.LOST, Fate.ANSWER_LOST, Fate.LATE, Fate.ERROR_BEFORE, Fate.ERROR_AFTER, Fate.PAGE, Fate.CUT]


@pytest.mark.parametrize("fate", UNKNOWN)
def test_an_unknown_outcome_ends_as_exactly_one_item(site, plan, fate):
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", fate)
    site.run(900)
    [run] = site.executions()
    assert run.state is State.COMPLETED
    assert [item.id for item in items(site)] == [run.queue_id]
    assert run.attempts == (2 if fate in (Fate.LOST, Fate.ERROR_BEFORE) else 1)


@pytest.mark.parametrize("fate", UNKNOWN)
def test_the_tablet_dies_while_the_outcome_is_unknown(site, plan, fate):
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", fate)
    site.run(306)
    site.switch_off(cleanly=False)
    site.clock.advance(20)
    site.switch_on()
    site.run(900)
    assert outcome(site) == [(State.COMPLETED, None)]
    assert len(items(site)) == 1


def test_cancelled_while_unknown_is_never_sent_again(site, plan):
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.container.operator.cancel_execution(site.executions()[0].id)
    site.run(600)
    assert outcome(site) == [(State.CANCELLED, ReasonCode.USER_CANCELLED)]
    assert items(site) == []


def test_a_copy_that_lands_after_all_is_cancelled_and_alarmed(site, plan):
    """Later than the quiet time, which no protocol can exclude: the copy is found pending and taken back."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.machines["R1"].pause()
    token = site.executions()[0].token
    site.run(120)
    robot = site.container.repositories.robots.all(site.container.db.read())[0]
    client = site.container.make_client(robot)
    client.enqueue(site.executions()[0].mission_guid, description=token)
    site.run(60)
    assert [str(item.state) for item in items(site)] == ["Pending", "Aborted"]
    assert "duplicate_healed" in [alarm.code for alarm in site.container.alarms.open()]


def test_an_item_that_is_gone_from_the_robot_has_vanished(site, plan):
    plan("2026-11-23T06:05")
    site.run(306)
    site.machines["R1"].queue = MissionQueue()
    site.run(60)
    assert outcome(site) == [(State.FAILED, ReasonCode.VANISHED)]


def test_the_robot_stays_silent_until_the_window_is_over(site, plan):
    plan("2026-11-23T06:05", start_window_minutes=5)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.network.down.add("R1")
    site.run(600)
    assert outcome(site) == [(State.FAILED, ReasonCode.UNKNOWN_OUTCOME)]
    assert [alarm.code for alarm in site.container.alarms.open()].count("unknown_outcome") == 1
    assert "execution_failed" not in [
        alarm.code for alarm in site.container.alarms.open()
    ]  # that would be the same again


@pytest.mark.parametrize("others_fail", [False, True])
def test_once_its_outcome_is_known_no_alarm_asks_for_it(site, plan, others_fail):
    plan("2026-11-23T06:05", start_window_minutes=5)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(306)
    site.network.down.add("R1")
    if others_fail:
        site.container.alarms.raise_("unknown_outcome", "execution:99", robot="R1", mission="Home", problem="none")
    site.run(600)
    assert "unknown_outcome" in [alarm.code for alarm in site.container.alarms.open()]
    site.network.down.clear()
    site.run(60)
    assert outcome(site) == [(State.COMPLETED, None)]
    left = [
        alarm.key for alarm in site.container.alarms.open() if alarm.code in ("unknown_outcome", "execution_failed")
    ]
    assert left == ["execution:99"] * others_fail


def test_what_is_found_late_was_sent_when_its_request_left_and_not_when_it_was_found(site, plan):
    """Its answer was lost and the robot silent for ten minutes: the run is not told to have been late."""
    plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(306)
    site.network.down.add("R1")
    site.run(600)
    site.network.down.clear()
    site.run(60)
    [run] = site.executions()
    assert run.state is State.COMPLETED
    assert 0 <= (run.submitted_at - run.planned_at).total_seconds() < 40  # a lost answer is given up after 30 s


def test_a_failure_that_turns_out_to_be_none_is_no_alarm_any_more(site, plan):
    """Given up at the second attempt; the first one's request comes a moment later, and runs."""
    site.container.catalogue.change_settings(retry_limit=1, unknown_outcome_quiet_seconds=5)
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LATE, 60)
    site.network.next("POST", "/mission_queue", Fate.REFUSED)
    site.run(340)
    assert outcome(site) == [(State.FAILED, ReasonCode.RETRY_LIMIT)]
    assert "execution_failed" in [alarm.code for alarm in site.container.alarms.open()]
    site.run(120)
    assert outcome(site) == [(State.COMPLETED, None)]
    assert [alarm.code for alarm in site.container.alarms.open()] == []


def test_an_unreachable_robot_leaves_running_executions_open(site, plan):
    plan("2026-11-23T06:05")
    site.run_until(lambda: site.executions(State.EXECUTING))
    site.network.down.add("R1")
    site.run(4 * 3600)
    assert site.executions()[0].state is State.EXECUTING
    site.network.down.clear()
    site.run(60)
    assert outcome(site) == [(State.COMPLETED, None)]


def test_clear_queue_takes_what_runs_what_is_queued_and_what_waits(site, plan):
    container = site.container
    plan("2026-11-23T06:05", name="runs")
    plan("2026-11-23T06:05", name="queued")
    plan("2026-11-23T06:05", name="waits", minimum_battery_percent=99)
    site.run(310)
    container.operator.clear_queue(container.repositories.robots.all(container.db.read())[0].id)
    site.kick()
    site.run(30)
    assert outcome(site) == [(State.CANCELLED, ReasonCode.QUEUE_CLEARED)] * 3


def test_a_mission_cancelled_on_the_robot_is_cancelled_here(site, plan):
    plan("2026-11-23T06:05")
    site.run_until(lambda: site.executions(State.EXECUTING))
    site.container.make_client(site.container.repositories.robots.all(site.container.db.read())[0]).cancel(
        site.executions()[0].queue_id
    )
    site.run(60)
    assert outcome(site) == [(State.CANCELLED, ReasonCode.USER_CANCELLED)]


def test_a_poll_in_the_moment_of_aborting_waits_for_what_the_robot_says(site, plan):
    """``Abort`` has no message yet: judged then, a cancellation would look like a failure."""
    plan("2026-11-23T06:05")
    site.run_until(lambda: site.executions(State.EXECUTING))
    [run] = site.executions()
    robot = site.container.repositories.robots.all(site.container.db.read())[0]
    site.container.make_client(robot).cancel(run.queue_id)
    assert str(items(site)[0].state) == "Abort"
    worker = site.container.make_worker(robot)
    worker.handle(messages.Poll())
    worker.advance()
    assert site.executions()[0].state is State.EXECUTING
    site.run(60)
    assert outcome(site) == [(State.CANCELLED, ReasonCode.USER_CANCELLED)]
