from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain import rules
from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger, Wait
from app.domain.models import Mission, Robot, Schedule, Settings

NOON = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
SETTINGS = Settings(minimum_battery_percent=30)
DELIVER = Mission("Deliver", "guid")


def row(**changes) -> Execution:
    closes = NOON + timedelta(minutes=15)
    return replace(
        Execution(Trigger.SCHEDULED, 1, "Aino", "Deliver", "guid", NOON, closes, NOON, "token", "UTC"), **changes
    )


def schedule(**changes) -> Schedule:
    return replace(Schedule("S", 1, 1, datetime(2026, 11, 23, 12, 0), "UTC"), **changes)


@pytest.mark.parametrize(("window", "minutes"), [(None, 15), (0, 1), (1, 1), (60, 60)])
def test_the_window_is_never_shorter_than_a_minute(window, minutes):
    assert rules.closes_at(NOON, window, SETTINGS) == NOON + timedelta(minutes=minutes)


@pytest.mark.parametrize(("own", "limit"), [(None, 30), (40, 40), (0, None)])
def test_a_schedules_battery_limit_inherits_the_setting_and_zero_means_none(own, limit):
    assert rules.minimum_battery(schedule(minimum_battery_percent=own), DELIVER, SETTINGS) == limit


@pytest.mark.parametrize("mission", [replace(DELIVER, on_low_battery=True), replace(DELIVER, charges=True)])
def test_a_mission_that_runs_on_low_battery_has_only_the_limit_of_its_schedule(mission):
    assert rules.minimum_battery(None, DELIVER, SETTINGS) == 30
    assert rules.minimum_battery(None, mission, SETTINGS) is None
    assert rules.minimum_battery(schedule(), mission, SETTINGS) is None
    assert rules.minimum_battery(schedule(minimum_battery_percent=40), mission, SETTINGS) == 40


@pytest.mark.parametrize(
    ("battery", "minimum", "allowed"),
    [(30.0, 30.0, True), (29.9, 30.0, False), (None, 30.0, False), (float("nan"), 30.0, False), (None, None, True)],
)
def test_an_unknown_battery_never_satisfies_a_minimum(battery, minimum, allowed):
    assert rules.battery_allows(battery, minimum) is allowed


def test_tries_are_2_4_8_seconds_apart_and_at_most_a_poll_interval():
    assert [rules.back_off(n, SETTINGS) for n in range(1, 7)] == [2, 4, 8, 16, 30, 30]
    assert rules.back_off(5, Settings(poll_interval_seconds=1)) == 1
    assert rules.back_off(10_000, SETTINGS) == 30


@pytest.mark.parametrize(("limit", "attempts", "ends"), [(10, 10, False), (10, 11, True), (0, 1, True), (1, 1, False)])
def test_retry_limit_n_allows_one_and_n_attempts(limit, attempts, ends):
    reason = rules.after_failed_attempt(row(attempts=attempts), Settings(retry_limit=limit), "no answer")
    assert (reason is not None) is ends
    if reason:
        assert reason.code is ReasonCode.RETRY_LIMIT
        assert reason.details["attempts"] == attempts


@pytest.mark.parametrize(
    ("execution", "was_down", "code", "state"),
    [
        (
            row(wait=Wait.BATTERY, wait_details={"battery": 12, "minimum": 30}),
            False,
            ReasonCode.BATTERY_LOW,
            State.SKIPPED,
        ),
        (row(wait=Wait.HOLD), False, ReasonCode.HOLD, State.SKIPPED),
        (row(wait=Wait.LATE_START), False, ReasonCode.APP_DOWN, State.MISSED),
        (row(wait=Wait.CHECK_UP), True, ReasonCode.WINDOW_CLOSED, State.FAILED),
        (row(wait=Wait.CLOCK), False, ReasonCode.CLOCK_IMPLAUSIBLE, State.MISSED),
        (row(wait=Wait.ELSEWHERE), True, ReasonCode.WINDOW_CLOSED, State.FAILED),
        (row(), True, ReasonCode.APP_DOWN, State.MISSED),
        (row(), False, ReasonCode.WINDOW_CLOSED, State.FAILED),
        (row(attempts=3, wait=Wait.RETRY), True, ReasonCode.WINDOW_CLOSED, State.FAILED),
    ],
)
def test_a_closed_window_ends_with_what_held_the_execution(execution, was_down, code, state):
    reason = rules.reason_window_closed(execution, was_down)
    assert (reason.code, reason.state) == (code, state)


@pytest.mark.parametrize(
    ("wait", "code"),
    [
        (Wait.DUE, ReasonCode.OVERLAP),
        (Wait.RETRY, ReasonCode.OVERLAP),
        (Wait.HOLD, ReasonCode.OVERLAP),  # no start window has closed
        (Wait.BATTERY, ReasonCode.BATTERY_LOW),
    ],
)
def test_an_idle_mission_that_was_overtaken_says_what_had_held_it_up(wait, code):
    assert rules.reason_overtaken(row(trigger=Trigger.IDLE, wait=wait), NOON).code is code


def test_due_together_on_one_robot_goes_by_priority_then_time_then_name():
    late, early = row(id=1, planned_at=NOON + timedelta(minutes=1), schedule="a"), row(id=2, schedule="b")
    first_by_name, urgent = row(id=3, schedule="a"), row(id=4, priority=5, planned_at=NOON + timedelta(minutes=9))
    assert [e.id for e in rules.in_dispatch_order([late, early, first_by_name, urgent])] == [4, 3, 2, 1]


def test_an_idle_mission_goes_after_all_that_was_planned():
    idle, planned = row(id=1, trigger=Trigger.IDLE), row(id=2, planned_at=NOON + timedelta(minutes=9))
    assert [e.id for e in rules.in_dispatch_order([idle, planned])] == [2, 1]


def test_a_token_belongs_to_install_schedule_and_instant():
    install = "5f0c2f0e-7f0a-4d8b-9a8a-0c1c2d3e4f50"
    token = rules.token_of(install, 7, NOON)
    assert len(token) == 36
    assert token == rules.token_of(install, 7, NOON.astimezone())
    assert (
        len(
            {
                token,
                rules.token_of(install, 8, NOON),
                rules.token_of(install, 7, NOON + timedelta(minutes=1)),
                rules.token_of("5f0c2f0e-7f0a-4d8b-9a8a-0c1c2d3e4f51", 7, NOON),
            }
        )
        == 4
    )


# ---------------------------------------------------------------------- new rows
INSTALL, AINO, DELIVER = (
    "5f0c2f0e-7f0a-4d8b-9a8a-0c1c2d3e4f50",
    Robot("Aino", "http://a", id=3),
    Mission("Deliver", "guid", id=8),
)


def test_an_occurrence_takes_over_what_its_schedule_and_the_settings_say():
    own = schedule(id=7, priority=5, parameters={"cart": 1}, timezone="Europe/Helsinki", start_window_minutes=3)
    made = rules.scheduled(own, AINO, DELIVER, SETTINGS, INSTALL, NOON, NOON + timedelta(seconds=1))
    assert made == Execution(
        Trigger.SCHEDULED,
        3,
        "Aino",
        "Deliver",
        "guid",
        NOON,
        NOON + timedelta(minutes=3),
        NOON + timedelta(seconds=1),
        rules.token_of(INSTALL, 7, NOON),
        "Europe/Helsinki",
        schedule_id=7,
        schedule="S",
        priority=5,
        parameters={"cart": 1},
        minimum_battery_percent=30,
    )
    ended = rules.ended(made, Reason(ReasonCode.HOLD), NOON)
    assert (ended.state, ended.reason.code, ended.ended_at, ended.token) == (
        State.SKIPPED,
        ReasonCode.HOLD,
        NOON,
        made.token,
    )


@pytest.mark.parametrize(("trigger", "minimum"), [(Trigger.MANUAL, None), (Trigger.IDLE, 30)])
def test_a_start_without_a_schedule_is_due_now_in_the_zone_of_the_settings(trigger, minimum):
    made = rules.one_off(trigger, AINO, DELIVER, replace(SETTINGS, timezone="Asia/Tokyo"), NOON, "t", queue_floor=4)
    assert made == Execution(
        trigger,
        3,
        "Aino",
        "Deliver",
        "guid",
        NOON,
        NOON + timedelta(minutes=15),
        NOON,
        "t",
        "Asia/Tokyo",
        minimum_battery_percent=minimum,
        queue_floor=4,
    )
