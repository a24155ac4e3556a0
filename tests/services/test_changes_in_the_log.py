"""Every change that a person makes is one line of the log, once it is committed: what it was and what it is now, and no secret."""

from __future__ import annotations

import logging
from dataclasses import replace
from datetime import UTC, date, datetime

import pytest

from app.domain.models import Between, DayException, InvalidInput, Mission, Robot, Schedule
from app.process.log_file import one_line
from app.services.catalogue import robot_edit, settings_edit
from tests.support.clock import VirtualClock
from tests.support.edits import skip_next
from tests.support.planner import insert_due

NOW = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)  # Monday
HOSTILE = "A\n2026-11-23 06:00:00 ERROR \x1b[31m"


@pytest.fixture
def clock():
    return VirtualClock(NOW)


@pytest.fixture
def app(container, caplog):
    app = container
    app.catalogue.change_settings(timezone="UTC")
    app.catalogue.save_robot(Robot("Aino", "10.0.0.1", "user"), "secret")
    app.catalogue.save_mission(Mission("Deliver", "guid-1"))
    app.catalogue.save_schedule(Schedule("Daily", 1, 1, datetime(2026, 11, 23, 6, 30), "UTC", "FREQ=DAILY"))
    caplog.set_level(logging.INFO)
    caplog.clear()
    return app


@pytest.fixture
def new_lines(caplog):
    """The lines since it was asked last."""

    def lines() -> list[str]:
        found = [record.getMessage() for record in caplog.records]
        caplog.clear()
        return found

    return lines


def test_settings(app, new_lines):
    app.catalogue.change_settings(retry_limit=3, minimum_battery_percent=20, working_days=("MO", "SA"))
    assert new_lines() == [
        "settings changed: minimum_battery_percent none → 20.0, retry_limit 10 → 3, working_days MO TU WE TH FR → MO SA"
    ]
    app.catalogue.change_settings(retry_limit=3)
    app.catalogue.change_settings(selected_robot_id=1)
    assert new_lines() == []


def test_missions(app, new_lines):
    mission = app.catalogue.save_mission(Mission("Charge", "guid-2", robot_id=1))
    app.catalogue.save_mission(replace(mission, favourite=True, usual_minutes=5, robot_id=None))
    app.catalogue.restore(app.catalogue.remove_mission(mission.id))
    assert new_lines() == [
        "mission 'Charge' of robot 'Aino' added",
        "mission 'Charge' changed: usual_minutes none → 5, favourite no → yes, robot 'Aino' → none",
        "mission 'Charge' removed, and 0 schedules with it",
        "mission 'Charge' put back",
    ]


def test_idle_rules(app, new_lines):
    app.catalogue.change_idle_rule(1, mission_id=1)
    app.catalogue.change_idle_rule(1, mission_id=1, after_minutes=25, enabled=False)
    app.catalogue.edit(lambda edit: robot_edit.set_idle_rule(edit, 1, None))
    assert new_lines() == [
        "idle automation of robot 'Aino': mission none → 'Deliver', after_minutes none → 10, enabled none → yes",
        "idle automation of robot 'Aino': after_minutes 10 → 25, enabled yes → no",
        "idle automation of robot 'Aino': mission 'Deliver' → none, after_minutes 25 → none, enabled no → none",
    ]


def test_robots_and_never_a_password(app, new_lines):
    robot = app.catalogue.save_robot(replace(app.catalogue.robot(1), address="10.0.0.2"), "another")
    app.catalogue.save_robot(replace(robot, enabled=False), "a third")
    app.catalogue.restore(app.catalogue.remove_robot(1))
    lines = new_lines()
    assert lines == [
        "robot 'Aino' changed: address 'http://10.0.0.1' → 'http://10.0.0.2', another password",
        "robot 'Aino' changed: enabled yes → no, another password",
        "robot 'Aino' removed, and 1 schedules with it",
        "robot 'Aino' put back",
        "schedule 'Daily' put back",
    ]


def test_schedules(app, new_lines):
    schedule = app.catalogue.schedules()[0]
    app.catalogue.save_schedule(
        replace(
            schedule,
            start=datetime(2026, 11, 23, 8, 0),
            recurrence="FREQ=MINUTELY;INTERVAL=5",
            between=Between(datetime.min.time(), datetime.min.time().replace(hour=9)),
            parameters={"x": 1.5},
        )
    )
    app.catalogue.save_schedule(replace(schedule, id=None, name="Second", enabled=False))
    app.catalogue.remove_schedule(schedule.id)
    assert new_lines() == [
        "schedule 'Daily' changed: start 2026-11-23T06:30 → 2026-11-23T08:00, "
        "recurrence 'FREQ=DAILY' → 'FREQ=MINUTELY;INTERVAL=5', between none → 00:00–09:00, parameters {} → {'x': 1.5}",
        "schedule 'Second' added",
        "schedule 'Daily' removed",
    ]


def test_days_off(app, new_lines):
    days = app.catalogue.save_days(DayException("Audit", date(2026, 12, 1), date(2026, 12, 2)))
    app.catalogue.save_days(replace(days, is_working=True, last_day=date(2026, 12, 1), yearly=True))
    app.catalogue.restore(app.catalogue.remove_days(days.id))
    changed = "extra working days 'Audit' 2026-12-01 of each year"
    assert new_lines() == [
        "days off 'Audit' 2026-12-01–2026-12-02 added",
        f"days off 'Audit' 2026-12-01–2026-12-02 → {changed}",
        f"{changed} removed",
        f"{changed} put back",
    ]


def test_pauses_and_skips(app, new_lines):
    app.pausing.unskip(1, skip_next(app, 1))
    app.pausing.pause(1, datetime(2026, 11, 25, tzinfo=UTC))
    app.pausing.resume(1)
    at, end = "2026-11-23T06:30+00:00", "2026-11-25T00:00+00:00"
    assert new_lines() == [
        f"schedule 'Daily': the start at {at} is skipped",
        f"schedule 'Daily': the start at {at} is not skipped any more",
        f"schedule 'Daily' changed: paused until none → {end}",
        f"schedule 'Daily' changed: paused until {end} → none",
    ]


def test_holds(app, new_lines):
    app.holds.hold("a visit")
    app.holds.hold(until=datetime(2026, 11, 24, tzinfo=UTC), robot_id=1)
    app.holds.release()
    app.holds.release(1)
    app.holds.release(1)
    end = "until 2026-11-24T00:00+00:00"
    assert new_lines() == [
        "hold of all robots: none → until it is released, 'a visit'",
        f"hold of robot 'Aino': none → {end}",
        "hold of all robots: until it is released, 'a visit' → none",
        f"hold of robot 'Aino': {end} → none",
    ]


def test_single_starts_that_are_held(app, new_lines):
    app.clock.step(31 * 60)
    insert_due(app)
    new_lines()
    app.operator.hold_starts([1])
    app.operator.hold_starts([1])
    app.operator.hold_starts([1], held=False)
    app.operator.hold_starts([99])
    assert new_lines() == [
        "1 of 1 starts kept back: #1 'Deliver' on 'Aino'",
        "1 of 1 starts let go: #1 'Deliver' on 'Aino'",
    ]


def test_a_name_is_on_one_line_and_shows_no_escapes(app, new_lines):
    app.holds.hold("line 1\nline 2\x1b[31m")
    app.catalogue.edit(lambda edit: edit.notes.append(f"robot {HOSTILE!r} added"))
    for line in new_lines():
        assert line == one_line(line)


def test_uncommitted_changes_are_not_reported(app, new_lines):
    with pytest.raises(InvalidInput):
        app.catalogue.edit(lambda edit: [settings_edit.change(edit, retry_limit=3), edit.the(Robot, 99)])
    with pytest.raises(InvalidInput):
        app.pausing.pause(1, NOW)
    assert new_lines() == []
