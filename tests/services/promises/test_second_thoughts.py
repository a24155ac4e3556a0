"""Somebody changes his mind twice: takes back, undoes, edits, each while a start waits or is in doubt."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from app.database.backups import back_up, restore
from app.domain.models import Mission, ReasonCode, Schedule, State, Wait
from app.services.catalogue.undo import wait_again
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import items, outcomes, robot_of, sent_at, states
from tests.support.site import GUIDS, Site

TOMORROW = datetime.fromisoformat("2026-11-24T06:05")


def save(site, schedule, **changes):
    site.container.catalogue.save_schedule(replace(schedule, **changes))


def mission_of(site, name="Deliver"):
    return next(each for each in site.container.catalogue.missions() if each.name == name)


def _off(site, schedule):
    save(site, schedule, enabled=False)


def _moved(site, schedule):
    save(site, schedule, start=TOMORROW)


def _deleted(site, schedule):
    site.container.catalogue.remove_schedule(schedule.id)


def _paused(site, schedule):
    site.container.pausing.pause(schedule.id, datetime(2026, 11, 25, tzinfo=UTC))


# ---------------------------------------------------------------------- sent though not wanted any more
@pytest.mark.parametrize("take_back", [_off, _moved, _deleted, _paused])
def test_a_start_of_a_group_is_not_wanted_again_by_a_robot_s_undo_when_its_schedule_was_changed_meanwhile(
    hall, take_back
):
    """In doubt at R1; R1 is deleted, its schedule is taken back, R1 is put back."""
    schedule = hall.plan(start_window_minutes=60)
    hall.network.next("POST", "/mission_queue", Fate.LOST)
    hall.run(306)
    [row] = hall.executions(State.SUBMITTING)
    removed = hall.container.catalogue.remove_robot(row.robot_id)
    hall.run(3)
    take_back(hall, schedule)
    hall.run(3)
    hall.container.catalogue.restore(removed)
    hall.run(900)
    assert hall.items() == []


@pytest.mark.parametrize("take_back", [_off, _moved, _deleted, _paused])
def test_what_waited_for_a_group_s_last_robot_is_not_wanted_again_when_its_schedule_was_changed_meanwhile(
    tmp_path, take_back
):
    hall = Hall(tmp_path, robots=1)
    schedule = hall.plan(start_window_minutes=60)
    hall.network.down.add("R1")
    hall.machines["R1"].set_battery(1.0)
    hall.run(306)
    assert [row.state for row in hall.executions()] == [State.WAITING]
    removed = hall.container.catalogue.remove_robot(hall.robot("R1").id)
    hall.run(3)
    assert [row.state for row in hall.executions()] == [State.CANCELLED]
    take_back(hall, schedule)
    hall.network.down.clear()
    hall.machines["R1"].set_battery(90.0)
    hall.run(3)
    hall.container.catalogue.restore(removed)
    hall.run(900)
    sent = hall.items()
    hall.switch_off()
    assert sent == []


def test_what_was_paused_in_doubt_stays_so_when_its_schedule_is_switched_off_and_on(site, plan):
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    _paused(site, schedule)
    site.run(2)
    site.container.catalogue.set_schedule_enabled(schedule.id, False)
    site.run(2)
    site.container.catalogue.set_schedule_enabled(schedule.id, True)
    site.run(600)
    assert items(site) == []
    assert outcomes(site) == [(State.SKIPPED, ReasonCode.HOLD, 1)]


def test_what_was_paused_in_doubt_tells_so_when_its_schedule_is_deleted_and_put_back(site, plan):
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    _paused(site, schedule)
    site.run(2)
    site.container.catalogue.restore(site.container.catalogue.remove_schedule(schedule.id))
    site.run(600)
    assert items(site) == []
    assert outcomes(site) == [(State.SKIPPED, ReasonCode.HOLD, 1)]


def test_what_ended_with_a_robot_that_was_switched_off_stays_so_when_its_schedule_is_switched_off_and_on(site, plan):
    """As in test_what_a_person_has_stopped_stays_stopped."""
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.container.catalogue.set_robot_enabled(schedule.robot_id, False)
    site.run(2)
    site.container.catalogue.set_robot_enabled(schedule.robot_id, True)
    site.container.catalogue.set_schedule_enabled(schedule.id, False)
    site.run(2)
    site.container.catalogue.set_schedule_enabled(schedule.id, True)
    site.run(600)
    assert items(site) == []


# ---------------------------------------------------------------------- sent twice
def test_a_step_back_of_the_clock_after_a_restore_sends_nothing_twice(site, plan):
    """The tablet is 40 s ahead; a start runs; a backup of before it is restored; then the clock is set right."""
    plan("2026-11-23T06:05", start_window_minutes=60)
    site.clock.step(40)
    site.run(120)
    backup = site.directory / "before.db"
    back_up(site.container.db.path, backup)
    site.run(150)  # true 06:04:30; the tablet says 06:05:10
    assert len(sent_at(site)) == 1
    site.switch_off()
    restore(backup, site.container.db.path, site.clock.now())
    site.clock.step(-40)
    site.switch_on()
    site.run(900)
    assert len(sent_at(site)) == 1


# ---------------------------------------------------------------------- lost
def _remove_schedule(site, schedule):
    return site.container.catalogue.remove_schedule(schedule.id)


def _remove_mission(site, schedule):
    return site.container.catalogue.remove_mission(schedule.mission_id)


def _remove_robot(site, schedule):
    return site.container.catalogue.remove_robot(schedule.robot_id)


@pytest.mark.parametrize("remove", [_remove_schedule, _remove_mission, _remove_robot])
def test_undo_brings_back_what_waited_for_its_next_try(site, plan, remove):
    """Nothing of it was ever sent: the robot refused the connection."""
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.down.add("R1")
    site.run(306)
    [row] = site.executions(State.WAITING)
    assert row.attempts
    removed = remove(site, schedule)
    site.run(3)
    site.container.catalogue.restore(removed)
    site.network.down.clear()
    site.run(600)
    assert states(site) == ["Done"]


@pytest.mark.parametrize("remove", [_remove_schedule, _remove_mission, _remove_robot])
@pytest.mark.parametrize("after", [3, 120])
def test_undo_of_a_deletion_in_doubt_counts_after_the_quiet_time_too(site, plan, remove, after):
    """Within the start window, as for what waited."""
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    removed = remove(site, schedule)
    site.run(after)
    site.container.catalogue.restore(removed)
    site.run(900)
    assert states(site) == ["Done"]


@pytest.mark.parametrize("limit", [None, 1])
@pytest.mark.parametrize("how", ["in doubt", "waiting"])
def test_an_undo_does_not_read_the_history(tmp_path, limit, how):
    """With a history of one row and of all, the same is sent."""
    site = Site(tmp_path, robots=2)
    site.container.catalogue.change_settings(history_limit=limit)
    r1, r2 = site.add_robots()
    deliver = site.add_mission("Deliver")
    save_schedule = site.container.catalogue.save_schedule
    at = datetime.fromisoformat("2026-11-23T06:05")
    schedule = save_schedule(
        Schedule("A", r1.id, deliver.id, at, "UTC", start_window_minutes=60, minimum_battery_percent=30)
    )
    save_schedule(Schedule("B", r2.id, deliver.id, at, "UTC"))
    if how == "waiting":
        site.machines["R1"].set_battery(12.0)
    else:
        site.network.next("POST", "/mission_queue", Fate.LOST, robot="R1")
    site.run(306)
    removed = site.container.catalogue.remove_robot(r1.id)
    site.run(240)  # R2's ends: newer
    site.container.catalogue.restore(removed)
    site.machines["R1"].set_battery(90.0)
    site.run(1200)
    sent = [str(item.state) for item in items(site, "R1")]
    rows = [row.state for row in site.executions() if row.schedule_id == schedule.id]
    site.switch_off()
    assert sent == ["Done"], rows


# ---------------------------------------------------------------------- sent as it was, not as it is defined
@pytest.mark.parametrize("how", ["waiting", "in doubt"])
def test_what_comes_back_by_an_undo_runs_as_it_is_defined_by_then(site, plan, how):
    """Its mission was corrected while the schedule was deleted."""
    schedule = plan("2026-11-23T06:05", start_window_minutes=60, minimum_battery_percent=30)
    if how == "waiting":
        site.machines["R1"].set_battery(12.0)
    else:
        site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    removed = site.container.catalogue.remove_schedule(schedule.id)
    site.container.catalogue.save_mission(replace(mission_of(site), guid=GUIDS["Home"]))
    site.run(3)
    site.container.catalogue.restore(removed)
    site.machines["R1"].set_battery(90.0)
    site.run(900)
    assert [item.mission_id for item in items(site)] == [GUIDS["Home"]]


@pytest.mark.parametrize("how", ["waiting", "in doubt"])
def test_what_waits_takes_the_robot_s_own_mission_once_there_is_one(site, plan, how):
    plan("2026-11-23T06:05", start_window_minutes=60, minimum_battery_percent=30)
    if how == "waiting":
        site.machines["R1"].set_battery(12.0)
    else:
        site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.container.catalogue.save_mission(Mission("Deliver", GUIDS["Home"], robot_id=robot_of(site).id))
    site.run(3)
    site.machines["R1"].set_battery(90.0)
    site.run(900)
    assert [item.mission_id for item in items(site)] == [GUIDS["Home"]]


def test_what_a_person_gave_to_a_robot_of_its_group_follows_its_mission(hall):
    """Entered wrongly, corrected while the start waits for that robot's battery."""
    hall.plan(start_window_minutes=60, minimum_battery_percent=30)
    hall.network.down.update(hall.machines)
    hall.run(300.5)
    hall.container.operator.give_to(hall.executions()[0].id, hall.robot("R1").id)
    hall.network.down.clear()
    hall.machines["R1"].set_battery(12.0)
    hall.run(30)
    assert [(row.state, row.wait, row.robot) for row in hall.executions()] == [(State.WAITING, Wait.BATTERY, "R1")]
    hall.container.catalogue.save_mission(replace(mission_of(hall), guid=GUIDS["Home"]))
    hall.machines["R1"].set_battery(90.0)
    hall.run(600)
    assert [item.mission_id for item in hall.items()] == [GUIDS["Home"]]


def test_what_a_person_gave_to_a_robot_of_its_group_follows_an_edit_while_its_request_is_made(hall):
    """The schedule has another mission by now; the row says so, so what is sent has to be that one."""
    home, schedule = hall.add_mission("Home"), hall.plan(start_window_minutes=60)
    hall.network.down.update(hall.machines)
    hall.run(300.5)
    hall.container.operator.give_to(hall.executions()[0].id, hall.robot("R1").id)
    hall.network.down.clear()
    hall.network.next("POST", "/mission_queue", Fate.SLOW, 0.1)
    edited = []

    def edit(_robot, met):  # while the connection is made
        if met.method == "POST":
            edited.append(hall.executions()[0].state)
            save(hall, schedule, mission_id=home.id)

    hall.network.met = edit
    hall.run(600)
    assert edited == [State.SUBMITTING]
    assert [(row.state, row.mission) for row in hall.executions()] == [(State.COMPLETED, "Home")]
    assert [item.mission_id for item in hall.items()] == [home.guid]


def test_a_start_whose_cancellation_is_undone_runs_its_mission_as_it_is_by_then(site, plan):
    plan("2026-11-23T06:05", start_window_minutes=60, minimum_battery_percent=30)
    site.machines["R1"].set_battery(12.0)
    site.run(306)
    [row] = site.executions(State.WAITING)
    site.container.operator.cancel_execution(row.id)
    site.run(3)
    assert [each.state for each in site.executions()] == [State.CANCELLED]
    site.container.catalogue.save_mission(replace(mission_of(site), guid=GUIDS["Home"]))
    site.container.catalogue.edit(lambda edit: wait_again(edit, row.id))
    site.machines["R1"].set_battery(90.0)
    site.run(600)
    assert [item.mission_id for item in items(site)] == [GUIDS["Home"]]


def test_a_start_of_a_group_waits_for_no_battery_once_its_mission_needs_none(hall):
    """As test_a_minimum_that_is_lowered_lets_what_waits_for_it_go, and as a start of a robot does."""
    hall.container.catalogue.change_settings(minimum_battery_percent=30)
    for machine in hall.machines.values():
        machine.set_battery(12.0)
    hall.plan(start_window_minutes=60)
    hall.run(306)
    assert [row.state for row in hall.executions()] == [State.WAITING]
    hall.container.catalogue.save_mission(replace(mission_of(hall), on_low_battery=True))
    hall.run(600)
    assert [row.state for row in hall.executions()] == [State.COMPLETED]


# ---------------------------------------------------------------------- idle
@pytest.fixture
def resting(site):
    home = site.add_mission("Home")
    site.container.catalogue.change_settings(poll_interval_seconds=120)
    site.container.catalogue.save_idle_rule(robot_of(site).id, home.id, after_minutes=5)
    return site


@pytest.mark.parametrize("fate", [Fate.LOST, Fate.REFUSED])
def test_an_idle_mission_that_was_not_sent_follows_its_mission(resting, fate):
    """A mission that was entered wrongly is another one by now."""
    site = resting
    site.network.next("POST", "/mission_queue", fate)
    site.run_until(lambda: bool(site.network.counts[fate]), within=900)
    site.container.catalogue.save_mission(replace(mission_of(site, "Home"), guid=GUIDS["Deliver"]))
    site.run(1200)
    assert [item.mission_id for item in items(site)] == [GUIDS["Deliver"]]


@pytest.mark.parametrize("fate", [Fate.LOST, Fate.REFUSED])
def test_another_idle_mission_is_sent_in_the_same_rest_where_the_first_one_never_was_there(resting, fate):
    """In doubt, its rule gets another mission; the first turns out never to have arrived."""
    site = resting
    site.network.next("POST", "/mission_queue", fate)
    site.run_until(lambda: bool(site.network.counts[fate]), within=900)
    site.container.catalogue.save_idle_rule(robot_of(site).id, mission_of(site).id, after_minutes=5)
    site.run(1800)
    assert [item.mission_id for item in items(site)] == [GUIDS["Deliver"]]


def _rule_off_and_on(site):
    robot = robot_of(site)
    site.container.catalogue.save_idle_rule(robot.id, robot.idle.mission_id, after_minutes=5, enabled=False)
    site.run(5)
    site.container.catalogue.save_idle_rule(robot.id, robot.idle.mission_id, after_minutes=5)


def _mission_deleted_and_back(site):
    site.container.catalogue.restore(site.container.catalogue.remove_mission(mission_of(site, "Home").id))


@pytest.mark.parametrize("there_and_back", [_rule_off_and_on, _mission_deleted_and_back])
@pytest.mark.parametrize("fate", [Fate.LOST, Fate.REFUSED])
def test_an_idle_mission_comes_in_the_same_rest_when_its_rule_is_there_again(resting, there_and_back, fate):
    site = resting
    site.network.next("POST", "/mission_queue", fate)
    site.run_until(lambda: bool(site.network.counts[fate]), within=900)
    there_and_back(site)
    site.run(1800)
    assert states(site) == ["Done"]


def test_an_idle_mission_that_was_overtaken_after_a_lost_request_raises_no_alarm(resting):
    """One try of three was made, and a person uses the robot: that is no failure."""
    site = resting
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run_until(lambda: bool(sent_at(site)), within=900)
    site.at(60, lambda: site.stranger_queues("Deliver"))
    site.run(300)
    assert [alarm.code for alarm in site.container.alarms.open()] == []
    assert [row.reason.code for row in site.executions()] == [ReasonCode.OVERLAP]


# ---------------------------------------------------------------------- settings
def test_a_window_that_is_made_longer_in_the_settings_counts_for_what_waits(site, plan):
    """As it does for what is in doubt, and as the schedule's own does."""
    site.container.catalogue.change_settings(start_window_minutes=3)
    plan("2026-11-23T06:05", start_window_minutes=None, minimum_battery_percent=30)
    site.machines["R1"].set_battery(12.0)
    site.run(306)
    site.container.catalogue.change_settings(start_window_minutes=60)
    site.run(600)
    site.machines["R1"].set_battery(90.0)
    site.run(300)
    assert states(site) == ["Done"]


def test_a_setting_can_be_changed_while_a_start_of_a_deleted_schedule_is_in_doubt(site, plan):
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.container.catalogue.remove_schedule(schedule.id)
    site.container.catalogue.change_settings(start_window_minutes=60)
    assert [row.state for row in site.executions()] == [State.SUBMITTING]
