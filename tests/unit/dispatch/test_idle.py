from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.models import DayException, IdleRule, Settings
from app.domain.robot import RobotState, RobotStatus
from app.services.dispatch.idle import IdleSituation, IdleWatch, idle_mission_is_due, is_idle
from app.services.planning.working_days import WorkingCalendar

MONDAY = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
READY = RobotStatus(state=RobotState.READY, battery_percentage=80.0)
RULE = IdleRule(mission_id=1, after_minutes=10)
LONG_ENOUGH = IdleSituation(
    600.0, READY, highest_queue_id=40, last_queue_id=None, next_planned_at=None, minimum_battery=None
)


def test_time_counts_only_what_was_seen_without_a_break():
    watch = IdleWatch()
    watch.saw(True, 40, 0.0, 90.0)
    watch.saw(True, 40, 60.0, 90.0)
    assert watch.seconds(60.0) == 60.0
    watch.saw(True, 40, 200.0, 90.0)  # not polled for 140 s
    assert watch.seconds(200.0) == 0.0
    watch.not_seen()
    watch.saw(True, 40, 210.0, 90.0)
    assert watch.seconds(230.0) == 20.0
    watch.saw(False, 40, 240.0, 90.0)
    assert watch.seconds(240.0) == 0.0


@pytest.mark.parametrize("highest", [41, 3, None])
def test_a_run_between_two_polls_ends_the_idle_period(highest):
    """Only the queue's highest id shows it; a lower one means that the queue was reset."""
    watch = IdleWatch()
    watch.saw(True, 40, 0.0, 90.0)
    watch.saw(True, highest, 60.0, 90.0)
    assert watch.seconds(60.0) == 0.0
    watch.saw(True, highest, 90.0, 90.0)
    assert watch.seconds(90.0) == 30.0


@pytest.mark.parametrize("state", [s for s in RobotState if s is not RobotState.READY])
def test_only_a_ready_robot_without_queue_is_idle(state):
    assert is_idle(READY, has_queue_items=False)
    assert not is_idle(READY, has_queue_items=True)
    assert not is_idle(RobotStatus(state=state), has_queue_items=False)


@pytest.mark.parametrize(
    ("rule", "situation", "settings", "due"),
    [
        (RULE, LONG_ENOUGH, Settings(), True),
        (None, LONG_ENOUGH, Settings(), False),
        (replace(RULE, enabled=False), LONG_ENOUGH, Settings(), False),
        (RULE, replace(LONG_ENOUGH, idle_seconds=599.9), Settings(), False),
        (RULE, replace(LONG_ENOUGH, last_queue_id=40), Settings(), False),  # once per idle period
        (RULE, replace(LONG_ENOUGH, last_queue_id=39), Settings(), True),  # something else ran since
        (RULE, replace(LONG_ENOUGH, last_queue_id=4000), Settings(), True),  # the robot's queue was reset
        (RULE, replace(LONG_ENOUGH, next_planned_at=MONDAY + timedelta(minutes=4)), Settings(), False),
        (RULE, replace(LONG_ENOUGH, next_planned_at=MONDAY + timedelta(minutes=5)), Settings(), True),
        (RULE, LONG_ENOUGH, Settings(working_days=("TU",)), False),
        (RULE, replace(LONG_ENOUGH, minimum_battery=81), Settings(), False),
        (
            RULE,
            replace(LONG_ENOUGH, status=replace(READY, battery_percentage=None), minimum_battery=1),
            Settings(),
            False,
        ),
    ],
)
def test_when_the_idle_mission_starts(rule, situation, settings, due):
    assert idle_mission_is_due(rule, situation, settings, WorkingCalendar(settings), MONDAY) is due


@pytest.mark.parametrize(("zone", "due"), [("Europe/Helsinki", True), ("UTC", False)])
def test_the_working_day_is_the_local_one(zone, due):
    sunday_night_utc, settings = (
        datetime(2026, 11, 22, 23, 0, tzinfo=UTC),
        Settings(timezone=zone),
    )  # Monday 01:00 in Helsinki
    assert idle_mission_is_due(RULE, LONG_ENOUGH, settings, WorkingCalendar(settings), sunday_night_utc) is due


@pytest.mark.parametrize(("is_working", "working_days", "due"), [(False, ("MO",), False), (True, ("TU",), True)])
def test_an_exception_of_the_calendar_beats_the_day_of_the_week(is_working, working_days, due):
    settings = Settings(working_days=working_days)
    calendar = WorkingCalendar(settings, [DayException("Inventory", MONDAY.date(), MONDAY.date(), is_working)])
    assert idle_mission_is_due(RULE, LONG_ENOUGH, settings, calendar, MONDAY) is due
