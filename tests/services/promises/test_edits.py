"""What waits follows the edit of its schedule, and an undo brings it back (D6)."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta

import pytest

from app.domain.models import ReasonCode, State, Wait
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import items, outcomes, sent_at
from tests.support.site import GUIDS

TEN_PAST = datetime.fromisoformat("2026-11-23T06:10")


@pytest.fixture
def waiting(site, plan):
    """Makes a schedule of 06:05 that waits since then for a battery of 30 %, which has 12 %."""

    def make(recurrence=None):
        site.machines["R1"].set_battery(12.0)
        schedule = plan("2026-11-23T06:05", recurrence, minimum_battery_percent=30)
        site.run(360)
        assert [row.state for row in site.executions()] == [State.WAITING]
        return schedule

    return make


def keep_instant(site, schedule, **changes):
    site.container.catalogue.save_schedule(replace(schedule, **changes))


@pytest.mark.parametrize("recurrence", [None, "FREQ=DAILY"])
def test_a_minimum_that_is_lowered_lets_what_waits_for_it_go(site, waiting, recurrence):
    """An edit that keeps instant and robot changes the waiting start in place."""
    keep_instant(site, waiting(recurrence), minimum_battery_percent=5)
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]
    assert len(items(site)) == 1


@pytest.mark.parametrize("recurrence", [None, "FREQ=DAILY"])
def test_what_waits_goes_on_waiting_when_its_schedule_is_renamed(site, waiting, recurrence):
    """It waits under the new name, and runs when the robot is charged."""
    keep_instant(site, waiting(recurrence), name="New name")
    site.run(60)
    assert [(row.state, row.schedule) for row in site.executions()] == [(State.WAITING, "New name")]
    site.machines["R1"].set_battery(80.0)
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


def test_what_waits_runs_the_mission_that_its_schedule_has_now(site, waiting):
    """A start that has not been sent is sent as it is planned now: mission, parameters, priority."""
    home = site.add_mission("Home")
    keep_instant(site, waiting(), mission_id=home.id, priority=3)
    site.machines["R1"].set_battery(80.0)
    site.run(300)
    assert [(item.mission_id, item.priority) for item in items(site)] == [(home.guid, 3)]
    assert [(row.state, row.mission) for row in site.executions()] == [(State.COMPLETED, "Home")]


def test_a_longer_window_keeps_what_waits_for_longer(site, waiting):
    """The window of a waiting start is its schedule's."""
    keep_instant(site, waiting(), start_window_minutes=60)
    site.run(1200)
    site.machines["R1"].set_battery(80.0)
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


# ---------------------------------------------------------------------- while it is on its way
@pytest.mark.parametrize("restarts", [False, True])
@pytest.mark.parametrize("fate", [Fate.LOST, Fate.ERROR_BEFORE])
def test_what_is_edited_in_the_quiet_time_is_sent_as_it_is_defined_then(site, plan, fate, restarts):
    """The first request did not arrive: the second one is for the mission that the schedule has by now."""
    home, schedule = site.add_mission("Home"), plan("2026-11-23T06:05", priority=1)
    site.network.next("POST", "/mission_queue", fate)
    site.run(306)
    keep_instant(site, schedule, mission_id=home.id, priority=3, start_window_minutes=60, name="New name")
    if restarts:
        site.power_cut(5)
    site.run(600)
    assert [(item.mission_id, item.priority) for item in items(site)] == [(home.guid, 3)]
    [row] = site.executions()
    assert (row.state, row.mission, row.schedule, row.attempts) == (State.COMPLETED, "Home", "New name", 2)
    assert row.closes_at == row.planned_at + timedelta(minutes=60)


def test_what_did_arrive_before_it_was_edited_stays_what_it_is(site, plan):
    """The history tells what has run."""
    home, schedule = site.add_mission("Home"), plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(306)
    keep_instant(site, schedule, mission_id=home.id)
    site.run(600)
    assert [item.mission_id for item in items(site)] == [site.executions()[0].mission_guid] != [home.guid]
    assert [(row.state, row.mission) for row in site.executions()] == [(State.COMPLETED, "Deliver")]


def test_what_is_edited_a_moment_before_its_instant_leaves_as_it_is_defined_then(site, plan):
    """It is on the disk and with its robot's worker by then."""
    home, schedule = site.add_mission("Home"), plan("2026-11-23T06:05")
    written = []

    def edit():
        written.extend(site.executions(State.SUBMITTING))
        keep_instant(site, schedule, mission_id=home.id)

    site.at(299.9, edit)
    site.run(400)
    assert len(written) == 1
    assert [item.mission_id for item in items(site)] == [home.guid]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]
    assert sent_at(site) == [300]


def test_an_edit_after_the_clock_was_set_back_counts_too(site, plan):
    """By the tablet's clock it is older than the start."""
    home, schedule = site.add_mission("Home"), plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.clock.step(-30)
    site.run(1)
    keep_instant(site, schedule, mission_id=home.id)
    site.run(900)
    assert [item.mission_id for item in items(site)] == [home.guid]


@pytest.mark.parametrize("fate", [Fate.LOST, Fate.REFUSED])
def test_what_waits_or_is_in_doubt_follows_its_mission(site, plan, fate):
    """A mission that was entered wrongly is another one of the robot by now."""
    schedule = plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", fate)
    site.run(301)
    mission = next(each for each in site.container.catalogue.missions() if each.id == schedule.mission_id)
    site.container.catalogue.save_mission(replace(mission, guid=GUIDS["Home"]))
    site.run(600)
    assert [item.mission_id for item in items(site)] == [GUIDS["Home"]]
    assert [row.state for row in site.executions()] == [State.COMPLETED]


def test_a_minimum_that_is_raised_while_the_robot_is_read_for_a_start_counts(site, plan):
    """The answer to the read is slow; it says 90 %."""
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.others_wait = False
    site.network.down.add("R1")
    site.run(310)
    site.network.down.clear()
    site.network.next("GET", "/status", Fate.SLOW, 8.0)
    site.network.met = lambda _robot, met: (
        met.fate is Fate.SLOW and site.at(3.0, lambda: keep_instant(site, schedule, minimum_battery_percent=100))
    )
    site.run(90)
    assert site.network.counts[Fate.SLOW] == 1
    assert sent_at(site) == []
    assert [row.wait for row in site.executions()] == [Wait.BATTERY]


# ---------------------------------------------------------------------- undone while it is on its way
def _delete_robot(site, schedule):
    return site.container.catalogue.remove_robot(schedule.robot_id)


def _delete_schedule(site, schedule):
    return site.container.catalogue.remove_schedule(schedule.id)


def _delete_mission(site, schedule):
    return site.container.catalogue.remove_mission(schedule.mission_id)


@pytest.mark.parametrize("fate", [Fate.LOST, Fate.LATE, Fate.ANSWER_LOST])
@pytest.mark.parametrize("remove", [_delete_robot, _delete_schedule, _delete_mission])
def test_what_is_in_doubt_when_it_is_deleted_runs_once_when_that_is_undone(site, plan, remove, fate):
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", fate, 30.0 if fate is Fate.LATE else None)
    site.run(306)
    removed = remove(site, schedule)
    site.run(3)
    site.container.catalogue.restore(removed)
    site.run(900)
    assert [str(item.state) for item in items(site)] == ["Done"]
    assert [row.state for row in site.executions()] == [State.COMPLETED]


@pytest.mark.parametrize("take_back", ["switched off", "moved"])
def test_what_was_taken_back_before_it_was_deleted_stays_so_when_that_is_undone(site, plan, take_back):
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    tomorrow = {"start": datetime.fromisoformat("2026-11-24T06:05")}
    keep_instant(site, schedule, **({"enabled": False} if take_back == "switched off" else tomorrow))
    removed = _delete_schedule(site, schedule)
    site.run(3)
    site.container.catalogue.restore(removed)
    site.run(900)
    assert items(site) == []
    assert outcomes(site) == [(State.CANCELLED, ReasonCode.SCHEDULE_CHANGED, 1)]


def test_what_runs_when_its_robot_is_deleted_is_followed_on_when_that_is_undone(site, plan):
    schedule = plan("2026-11-23T06:05")
    site.run(320)
    assert [row.state for row in site.executions()] == [State.EXECUTING]
    removed = _delete_robot(site, schedule)
    site.run(3)
    site.container.catalogue.restore(removed)
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


@pytest.mark.parametrize("there_and_back", ["switched off and on", "moved and back"])
def test_what_is_in_doubt_is_wanted_again_when_its_edit_is_taken_back(site, plan, there_and_back):
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    keep_instant(
        site, schedule, **({"enabled": False} if there_and_back == "switched off and on" else {"start": TEN_PAST})
    )
    site.run(3)
    keep_instant(site, schedule)
    site.run(600)
    assert [str(item.state) for item in items(site)] == ["Done"]
    assert outcomes(site) == [(State.COMPLETED, None, 2)]


def test_a_window_that_is_made_longer_in_doubt_counts_though_the_robot_is_gone(site, plan):
    schedule = plan("2026-11-23T06:05", start_window_minutes=5)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.network.down.add("R1")
    keep_instant(site, schedule, start_window_minutes=60)
    site.run(600)
    site.network.down.clear()
    site.run(600)
    assert [row.state for row in site.executions()] == [State.COMPLETED]


@pytest.mark.parametrize("is_given", [False, True])
def test_a_start_of_a_group_follows_its_mission_to_another_name(tmp_path, is_given):
    """In doubt at a robot, or given to one which can't get it."""
    hall = Hall(tmp_path)
    hall.plan(start_window_minutes=60)
    if is_given:
        hall.network.down.update(hall.machines)
        hall.run(300.5)
        hall.container.operator.give_to(hall.executions()[0].id, hall.robot("R1").id)
        hall.network.down.clear()
    else:
        hall.network.next("POST", "/mission_queue", Fate.LOST)
        hall.run(306)
    mission = next(each for each in hall.container.catalogue.missions() if each.name == "Deliver")
    hall.container.catalogue.save_mission(replace(mission, name="Bring"))
    if is_given:
        hall.switch("R1", on=False)
    hall.run(900)
    assert [(row.state, row.mission) for row in hall.executions()] == [(State.COMPLETED, "Bring")]
    hall.switch_off()


def test_of_a_group_too(tmp_path):
    """Given back by the robot that did not receive it, it goes to any of them as it is defined then."""
    hall = Hall(tmp_path)
    home, schedule = hall.add_mission("Home"), hall.plan()
    hall.network.next("POST", "/mission_queue", Fate.LOST)
    hall.run(306)
    keep_instant(hall, schedule, mission_id=home.id)
    hall.run(600)
    assert [item.mission_id for item in hall.items()] == [home.guid]
    assert [(row.state, row.mission) for row in hall.executions()] == [(State.COMPLETED, "Home")]
    hall.switch_off()


def _schedule(site, schedule):
    site.container.catalogue.restore(site.container.catalogue.remove_schedule(schedule.id))


def _mission(site, schedule):
    site.container.catalogue.restore(site.container.catalogue.remove_mission(schedule.mission_id))


def _robot(site, schedule):
    site.container.catalogue.restore(site.container.catalogue.remove_robot(schedule.robot_id))


def _off_and_on(site, schedule):
    site.container.catalogue.set_schedule_enabled(schedule.id, False)
    site.run(30)
    site.container.catalogue.set_schedule_enabled(schedule.id, True)


def _robot_off_and_on(site, schedule):
    site.container.catalogue.set_robot_enabled(schedule.robot_id, False)
    site.run(30)
    site.container.catalogue.set_robot_enabled(schedule.robot_id, True)


def _pause_and_resume(site, schedule):
    site.container.pausing.pause(schedule.id, datetime.fromisoformat("2026-11-25T06:00+00:00"))
    site.run(30)
    site.container.pausing.resume(schedule.id)


@pytest.mark.parametrize("there_and_back", [_schedule, _mission, _robot, _off_and_on])
def test_undo_brings_back_what_was_waiting(site, waiting, there_and_back):
    """A row that an edit ended, without ever being sent, is open again for the same instant, within its window."""
    there_and_back(site, waiting())
    site.run(60)
    assert [row.state for row in site.executions()] == [State.WAITING]
    site.machines["R1"].set_battery(80.0)
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]
    assert len(items(site)) == 1


@pytest.mark.parametrize("there_and_back", [_robot_off_and_on, _pause_and_resume])
def test_what_a_person_has_stopped_stays_stopped(site, waiting, there_and_back):
    """A robot that is switched on again and a pause that ends start with what comes next: what they ended stays so."""
    there_and_back(site, waiting())
    site.machines["R1"].set_battery(80.0)
    site.run(300)
    assert [row.state.is_open for row in site.executions()] == [False]
    assert items(site) == []


def test_undo_after_the_window_brings_nothing_back(site, waiting):
    """A start whose window has closed meanwhile is over."""
    removed = site.container.catalogue.remove_schedule(waiting().id)
    site.machines["R1"].set_battery(80.0)
    site.run(1200)
    site.container.catalogue.restore(removed)
    site.run(300)
    assert items(site) == []
    assert [row.state for row in site.executions()] == [State.CANCELLED]


def test_what_was_sent_is_not_opened_again_by_an_undo(site, plan):
    """A start that ran once does not run again because its schedule was deleted and brought back."""
    schedule = plan("2026-11-23T06:05")
    site.run(480)
    _schedule(site, schedule)
    site.run(300)
    assert sent_at(site) == [300]
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


def test_an_edit_that_moves_the_instant_ends_what_waits_and_runs_at_the_new_one(site, waiting):
    """The old instant ends with its reason, the new one is another start."""
    keep_instant(site, waiting(), start=TEN_PAST)
    site.machines["R1"].set_battery(80.0)
    site.run(600)
    assert outcomes(site) == [(State.CANCELLED, ReasonCode.SCHEDULE_CHANGED, 0), (State.COMPLETED, None, 1)]
    assert sent_at(site) == [600]
