"""Idle missions of robots of a group: as many robots stay free as the group has starts in the next minutes."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.models import Trigger
from app.services.dispatch.availability import is_charging
from tests.support.groups import Hall


@pytest.fixture
def hall(tmp_path):
    hall = Hall(tmp_path, now=datetime(2026, 11, 23, 6, 1, tzinfo=UTC))
    charger = hall.add_mission("Return to charger")
    for name, battery in zip(hall.machines, (60.0, 90.0, 80.0), strict=True):
        hall.machines[name].set_battery(battery)
        hall.container.catalogue.save_idle_rule(hall.robot(name).id, charger.id, after_minutes=5)
    yield hall
    hall.switch_off()


def sent_home(hall):
    return {row.robot for row in hall.executions() if row.trigger is Trigger.IDLE}


@pytest.mark.parametrize(("starts", "went"), [(1, {"R1", "R3"}), (2, {"R1"}), (3, set())])
def test_the_best_placed_robots_stay_free(hall, starts, went):
    for name in "ABC"[:starts]:
        hall.plan(name, at="2026-11-23T06:11")
    hall.run(9 * 60)
    assert sent_home(hall) == went


def test_without_a_start_in_the_next_minutes_all_may_go(hall):
    hall.plan("A", at="2026-11-23T06:30")
    hall.run(9 * 60)
    assert sent_home(hall) == set(hall.machines)


def test_nor_for_one_that_is_paused(hall):
    schedule = hall.plan("A", at="2026-11-23T06:11")
    hall.container.pausing.pause(schedule.id, hall.clock.now() + timedelta(days=1))
    hall.run(9 * 60)
    assert sent_home(hall) == set(hall.machines)


def test_a_robot_that_charges_while_it_is_idle_is_foreseen_for_a_start(hall):
    """It usually charges for an hour; a start of its group takes it away from there at once."""
    charger = next(mission for mission in hall.container.catalogue.missions() if mission.name == "Return to charger")
    hall.container.catalogue.save_mission(replace(charger, usual_minutes=60))
    hall.only("R1")
    hall.run_until(lambda: is_charging(hall.container.snapshots.get(1).status))
    at = hall.clock.now() + timedelta(minutes=3)
    hall.plan("A", at=f"{at:%Y-%m-%dT%H:%M}", start_window_minutes=5)
    [run] = hall.container.plan.next(1)
    assert (run.robot.name, run.begins) == ("R1", run.at)
    hall.run(240)
    assert hall.run_of("A").robot == "R1"
