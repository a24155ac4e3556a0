"""Far ends: the last year of the calendar, a year of absence, a robot that moves or forgets (D15)."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from datetime import datetime

import pytest

from app.domain.models import ReasonCode, Schedule, State
from app.services.catalogue import configuration
from tests.support.network import Fate
from tests.support.seen import alarms, items, outcomes, reason, robot_of, sent_at, states
from tests.support.site import PASSWORD, Site

LONGEST_TRANSACTION = 0.1  # s of processor time: 50 ms, on a machine half as fast


# ---------------------------------------------------------------------- the last day
@pytest.mark.parametrize(
    "rule",
    [
        "FREQ=DAILY;UNTIL=99991231",
        "FREQ=MINUTELY;INTERVAL=30;UNTIL=99991231T235959",
        "FREQ=WEEKLY;UNTIL=99991231T235959Z",
    ],
)
def test_a_recurrence_until_the_end_of_the_calendar_runs(site, plan, rule):
    """UNTIL on the last day that there is means: for ever."""
    plan("2026-11-23T06:05", rule)
    site.run(600)
    assert outcomes(site)[:1] == [(State.COMPLETED, None, 1)]


def test_a_recurrence_until_the_end_of_the_calendar_can_be_imported(site, plan):
    """A file with it is read as any other."""
    schedule = {
        "name": "For ever",
        "robot": "R1",
        "mission": "Deliver",
        "start": "2026-11-23T06:05",
        "timezone": "UTC",
        "recurrence": "FREQ=DAILY;UNTIL=99991231",
    }
    content = json.dumps({"format": "amr-scheduler/1", "schedules": [schedule]}).encode()
    configuration.import_configuration(site.container.catalogue, content)
    assert [found.name for found in site.container.catalogue.schedules()] == ["For ever"]


# ---------------------------------------------------------------------- a long absence
def test_a_long_absence_is_written_in_short_transactions(site, plan, monkeypatch):
    """While many schedules find out what they missed in a year, others that want to write wait for 50 ms at most."""
    site.container.catalogue.change_settings(history_limit=None, poll_interval_seconds=3600)
    for _schedule in range(60):
        plan("2026-11-23T06:05", "FREQ=MINUTELY", respect_working_days=False)
    site.run(60)
    site.switch_off(cleanly=False)
    site.clock.advance(365 * 86400.0)
    site.switch_on()
    lasted = []
    write = site.container.db.write

    def timed(work, *arguments, **named):
        began = time.thread_time()
        try:
            return write(work, *arguments, **named)
        finally:
            lasted.append(time.thread_time() - began)

    monkeypatch.setattr(site.container.db, "write", timed)
    site.run(60.0)
    assert sum(row.starts > 525_000 for row in site.executions()) == 60
    assert max(lasted) < LONGEST_TRANSACTION


# ---------------------------------------------------------------------- another address
def move(site, address):
    robot = robot_of(site)
    site.container.catalogue.save_robot(replace(robot, address=address), PASSWORD)


@pytest.fixture
def moving(tmp_path):
    """R1 executes our mission; a second machine is on the network."""
    site = Site(tmp_path, robots=2)
    robot, mission = site.add_robots()[0], site.add_mission("Deliver")
    site.container.catalogue.remove_robot(robot.id + 1)
    site.container.catalogue.save_schedule(
        Schedule("S", robot.id, mission.id, datetime.fromisoformat("2026-11-23T06:05"), "UTC")
    )
    site.run(320)
    assert states(site) == ["Executing"]
    yield site
    site.switch_off()


def test_a_robot_that_is_found_at_a_new_address_goes_on(moving):
    """The same serial number is the same robot: its items are followed there."""
    site = moving
    site.machines["R7"] = site.machines["R1"]
    move(site, "http://r7")
    site.power_cut(5)
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


@pytest.mark.parametrize("is_accepted", [True, False], ids=["accepted as the new robot", "not accepted"])
def test_an_address_that_is_given_another_machine_leaves_the_outcome_unknown_and_says_why(moving, is_accepted):
    """What the robot at the old address did can't be asked any more; it has not vanished."""
    site = moving
    if is_accepted:
        site.container.catalogue.save_robot(
            replace(robot_of(site), serial_number=site.machines["R2"].serial_number), PASSWORD
        )
    move(site, "http://r2")
    site.power_cut(5)
    site.run(300)
    [row] = site.executions()
    assert (row.state, reason(row).code) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME)
    assert "address" in str(dict(reason(row).details))
    assert items(site, "R2") == []


@pytest.mark.parametrize("fate", [Fate.LOST, Fate.ANSWER_LOST])
@pytest.mark.parametrize("how", ["address", "serial_number"])
def test_what_may_be_on_one_machine_is_not_sent_to_the_one_that_takes_its_place(tmp_path, fate, how):
    """While an outcome is unknown the robot is replaced: a new address, or its own given to another machine, which a person accepts."""
    site = Site(tmp_path, robots=2)
    robot, mission = site.add_robots()[0], site.add_mission("Deliver")
    site.container.catalogue.remove_robot(robot.id + 1)
    other = site.machines["R2"]
    for _ in range(3):  # its queue numbers go on above those of R1
        site.stranger_queues(robot="R2")
    site.container.catalogue.save_schedule(
        Schedule("S", robot.id, mission.id, datetime.fromisoformat("2026-11-23T06:05"), "UTC")
    )
    site.network.next("POST", "/mission_queue", fate)
    site.run(300.6)
    if how == "address":
        site.container.catalogue.save_robot(
            replace(robot_of(site), address="http://r2", serial_number=other.serial_number), PASSWORD
        )
    else:
        site.machines["R1"] = other
        site.container.catalogue.save_robot(replace(robot_of(site), serial_number=other.serial_number), PASSWORD)
        site.power_cut(5)  # connections are made anew
    site.run(300)
    [row] = site.executions()
    assert (row.state, reason(row).code, row.attempts) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 1)
    assert len(items(site, "R2")) == 3
    assert "unknown_outcome" in alarms(site)
    site.switch_off()


# ---------------------------------------------------------------------- a robot that drops descriptions
@pytest.mark.parametrize("fate", [Fate.ANSWER_LOST, Fate.LATE, Fate.ERROR_AFTER])
def test_the_first_lost_answer_of_a_robot_that_drops_descriptions_is_not_sent_again(site, plan, fate):
    """While it isn't known whether a robot gives tokens back, an item that may be ours is taken for ours, and told."""
    site.network.forgets_descriptions = True
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", fate)
    site.run(900)
    assert sent_at(site) == [300]
    assert states(site) == ["Done"]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]
    assert alarms(site)


def test_a_lost_request_to_such_a_robot_is_sent_again(site, plan):
    """Where there is no item that may be ours, nothing arrived."""
    site.network.forgets_descriptions = True
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(900)
    assert len(sent_at(site)) == 2
    assert outcomes(site) == [(State.COMPLETED, None, 2)]
