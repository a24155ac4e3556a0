"""Undone while a robot may have what was taken back; and what one failed read says of a robot, or one run of an alarm."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import pytest

from app.domain.models import Connection, Schedule, State
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import alarms, items, outcomes, robot_of, states
from tests.support.site import Site


@pytest.mark.parametrize("after", [3, 120])
def test_what_a_robot_switched_off_ended_stays_so_when_its_schedule_is_deleted_and_put_back(site, plan, after):
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.container.catalogue.set_robot_enabled(schedule.robot_id, False)
    site.run(2)
    site.container.catalogue.set_robot_enabled(schedule.robot_id, True)
    site.run(2)
    removed = site.container.catalogue.remove_schedule(schedule.id)
    site.run(after)
    site.container.catalogue.restore(removed)
    site.run(900)
    assert items(site) == [], outcomes(site)


def test_control_robot_switched_off_and_on(site, plan):
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    site.container.catalogue.set_robot_enabled(schedule.robot_id, False)
    site.run(2)
    site.container.catalogue.set_robot_enabled(schedule.robot_id, True)
    site.run(900)
    assert items(site) == [], outcomes(site)


@pytest.mark.parametrize("after", [3, 120])
def test_what_a_switched_off_robot_ended_while_its_schedule_was_deleted(site, plan, after):
    schedule = plan("2026-11-23T06:05", start_window_minutes=60)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(306)
    removed = site.container.catalogue.remove_schedule(schedule.id)
    site.run(2)
    site.container.catalogue.set_robot_enabled(schedule.robot_id, False)
    site.run(2)
    site.container.catalogue.set_robot_enabled(schedule.robot_id, True)
    site.run(after)
    site.container.catalogue.restore(removed)
    site.run(900)
    assert items(site) == [], outcomes(site)


def test_an_undo_never_leaves_a_start_in_doubt_at_no_robot(tmp_path):
    """The group's last robot is deleted while the connection for its start is made, and put back."""
    hall = Hall(tmp_path, robots=1)
    hall.plan(start_window_minutes=60)
    removed = []

    def remove(_robot, met):
        if met.method == "POST" and not removed:
            removed.append(hall.container.catalogue.remove_robot(hall.robot("R1").id))

    hall.network.next("POST", "/mission_queue", Fate.SLOW, 0.1)
    hall.network.met = remove
    hall.run(310)
    before = [(row.state, row.robot_id, row.reason) for row in hall.executions()]
    hall.network.met = None
    hall.container.catalogue.restore(removed[0])
    hall.run(3 * 3600)
    rows, sent = [(row.state, row.robot_id, row.reason) for row in hall.executions()], hall.items()
    hall.switch_off()
    assert removed
    assert [row[0] for row in rows] == [State.COMPLETED], (before, rows)
    assert len(sent) == 1


def test_an_undo_of_the_first_robot_does_not_open_what_the_second_had(tmp_path):
    hall = Hall(tmp_path, robots=2)
    hall.plan(start_window_minutes=60)
    removed = []

    def remove(robot, met):
        if met.method == "POST" and not removed:
            removed.append(
                hall.container.catalogue.remove_robot(
                    next(r.id for r in hall.container.catalogue.robots() if r.id == hall.executions()[0].robot_id)
                )
            )
            hall.network.next("POST", "/mission_queue", Fate.LOST)

    hall.network.next("POST", "/mission_queue", Fate.SLOW, 0.1)
    hall.network.met = remove
    hall.run(310)
    [row] = hall.executions()
    between = row.state, row.robot
    hall.container.catalogue.remove_robot(row.robot_id)
    hall.run(3)
    ended = [(row.state, row.robot_id, row.reason) for row in hall.executions()]
    hall.network.met = None
    hall.container.catalogue.restore(removed[0])
    hall.run(3 * 3600)
    rows = [(row.state, row.robot_id, row.reason) for row in hall.executions()]
    hall.switch_off()
    assert all(row[0] not in (State.WAITING, State.SUBMITTING) for row in rows), (between, ended, rows)


def test_an_alarm_of_an_earlier_run_of_the_schedule_stays_when_a_later_one_turns_out_to_have_arrived(site, plan):
    """The one before failed for good; of the next nothing was known, and then its item is there."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10", start_window_minutes=1)
    deliver = next(each for each in site.container.catalogue.missions() if each.name == "Deliver")
    site.container.catalogue.save_mission(replace(deliver, guid="00000000-0000-0000-0000-000000000001"))
    site.run(310)
    assert [row.state for row in site.executions()] == [State.FAILED]
    assert alarms(site) == ["execution_failed"]
    site.container.catalogue.save_mission(deliver)
    site.container.catalogue.change_settings(unknown_outcome_quiet_seconds=60)
    site.run(585)
    site.network.next("POST", "/mission_queue", Fate.LATE, 200.0)
    site.at(8, lambda: site.network.down.add("R1"))
    site.at(185, site.network.down.clear)
    site.run(150)
    assert sorted(set(alarms(site)) - {"unreachable"}) == ["execution_failed", "unknown_outcome"], outcomes(site)
    site.run(300)
    assert [row.state for row in site.executions()] == [State.FAILED, State.COMPLETED]
    assert "execution_failed" in alarms(site)


def test_an_undo_does_not_bring_a_start_beside_a_later_one_of_a_schedule_that_skips(tmp_path):
    hall = Hall(tmp_path, robots=2)
    hall.switch("R2", on=False)
    hall.network.down.add("R1")
    hall.machines["R1"].set_battery(1.0)
    hall.plan(start_window_minutes=60, recurrence="FREQ=MINUTELY;INTERVAL=10")
    hall.run(306)
    removed = hall.container.catalogue.remove_robot(hall.robot("R1").id)
    hall.run(60)
    hall.switch("R2", on=True)
    hall.run_until(lambda: any(row.state is State.EXECUTING for row in hall.executions()), within=900)
    hall.network.down.clear()
    hall.machines["R1"].set_battery(90.0)
    hall.container.catalogue.restore(removed)
    hall.run(8)
    rows = [(row.state, row.planned_at.strftime("%H:%M"), row.robot) for row in hall.executions()]
    hall.switch_off()
    assert sum(row[0] in (State.SUBMITTING, State.QUEUED, State.EXECUTING) for row in rows) == 1, rows


def test_one_read_that_fails_between_two_polls_does_not_make_a_robot_unreachable_for_the_rest(site, plan):
    """All is read well again 2 s later, but its queue as a whole is read with the next poll only."""
    site.container.catalogue.change_settings(poll_interval_seconds=600)
    plan("2026-11-23T06:05")
    site.run(310)
    site.network.next("GET", "/mission_queue/1", Fate.REFUSED)
    site.run(20)
    seen = site.container.snapshots.get(robot_of(site).id)
    assert (seen.connection, states(site)) == (Connection.CONNECTED, ["Executing"]), seen.problem


def test_two_such_reads_a_minute_apart_raise_no_alarm(site, plan):
    site.container.catalogue.change_settings(poll_interval_seconds=600)
    plan("2026-11-23T06:05")
    site.run(305)
    site.network.next("GET", "/mission_queue/1", Fate.REFUSED)
    site.run(62)
    site.network.next("GET", "/mission_queue/1", Fate.REFUSED)
    site.run(6)
    assert "unreachable" not in alarms(site), states(site)


@pytest.mark.parametrize("fate", [Fate.REFUSED, Fate.ERROR_BEFORE, Fate.LOST])
@pytest.mark.parametrize("polls", [30, 120])
def test_a_robot_that_tells_its_status_but_never_its_queue_is_an_alarm(site, fate, polls):
    """However the queue fails to come."""
    site.container.catalogue.change_settings(poll_interval_seconds=polls)
    site.run(60)
    site.network.next("GET", "/mission_queue", fate, count=5000)
    site.run(1200)
    assert "unreachable" in alarms(site) or "not_a_robot" in alarms(site), site.container.snapshots.get(
        robot_of(site).id
    ).connection


def test_a_robot_comes_back_though_the_history_has_forgotten_what_may_still_come_to_it(tmp_path):
    site = Site(tmp_path, robots=2)
    site.container.catalogue.change_settings(history_limit=1)
    r1, r2 = site.add_robots()
    deliver = site.add_mission("Deliver")
    at = datetime.fromisoformat("2026-11-23T06:05")
    site.container.catalogue.save_schedule(Schedule("A", r1.id, deliver.id, at, "UTC", start_window_minutes=60))
    site.container.catalogue.save_schedule(
        Schedule("B", r2.id, deliver.id, at, "UTC", recurrence="FREQ=MINUTELY;INTERVAL=5")
    )
    site.network.next("POST", "/mission_queue", Fate.LOST, robot="R1")
    site.run(300 + 120)
    removed = site.container.catalogue.remove_robot(r1.id)
    assert removed.watches
    site.run(400)
    site.container.catalogue.restore(removed)
    names = [robot.name for robot in site.container.catalogue.robots()]
    site.switch_off()
    assert names == ["R1", "R2"]


def test_a_group_start_is_on_time_after_one_read_that_failed_long_before(tmp_path):
    hall = Hall(tmp_path, robots=2)
    hall.container.catalogue.change_settings(poll_interval_seconds=600)
    hall.plan()
    hall.plan("B", "2026-11-23T06:07")
    hall.run(304)
    for name in hall.machines:
        hall.network.next("GET", "/mission_queue/1", Fate.REFUSED, robot=name)
    hall.run(300)
    sent = [round(post.at, 1) for post in hall.network.posts("*")]
    hall.switch_off()
    assert sent == [300.0, 420.0], sent


@pytest.mark.parametrize("what", ["schedule", "mission", "group"])
@pytest.mark.parametrize("fate", [Fate.ANSWER_LOST, Fate.LATE])
def test_what_a_deleted_robot_may_have_goes_to_no_other_by_the_undo_of_another_deletion(tmp_path, what, fate):
    """In doubt at R1, which has it; its schedule (mission, group) is deleted, then R1; only the first deletion is undone."""
    hall = Hall(tmp_path, robots=2)
    schedule = hall.plan(start_window_minutes=60)
    hall.network.next("POST", "/mission_queue", fate, *([30.0] if fate is Fate.LATE else []))
    hall.run_until(lambda: bool(hall.network.posts("*")), within=400)
    hall.run(1)
    [row] = hall.executions(State.SUBMITTING)
    catalogue = hall.container.catalogue
    match what:
        case "schedule":
            removed = catalogue.remove_schedule(schedule.id)
        case "mission":
            removed = catalogue.remove_mission(schedule.mission_id)
        case _:
            removed = catalogue.edit(lambda edit: edit.remove_group(hall.group.id))
    catalogue.remove_robot(row.robot_id)
    hall.run(1)
    catalogue.restore(removed)
    hall.run(900)
    sent, rows = (
        [post.robot for post in hall.network.posts("*")],
        [(each.state, each.robot, each.reason) for each in hall.executions()],
    )
    hall.switch_off()
    assert len(sent) == 1, rows


def test_the_last_undo_leaves_no_start_in_a_state_for_ever(tmp_path):
    """As above with two robots; then the second one's deletion is undone too."""
    hall = Hall(tmp_path, robots=2)
    hall.plan(start_window_minutes=60, recurrence="FREQ=MINUTELY;INTERVAL=30")
    hall.network.next("POST", "/mission_queue", Fate.SLOW, 0.1)
    removed = []

    def remove(robot, met):
        if met.method == "POST" and not removed:
            removed.append(hall.container.catalogue.remove_robot(hall.executions()[0].robot_id))
            hall.network.next("POST", "/mission_queue", Fate.LOST)

    hall.network.met = remove
    hall.run(310)
    hall.network.met = None
    [row] = hall.executions()
    second = hall.container.catalogue.remove_robot(row.robot_id)
    hall.run(3)
    hall.container.catalogue.restore(removed[0])
    hall.run(60)
    hall.container.catalogue.restore(second)
    hall.run(2 * 3600)
    rows = [(each.state, each.robot, each.planned_at.strftime("%H:%M")) for each in hall.executions()]
    hall.switch_off()
    assert State.SUBMITTING not in [each[0] for each in rows], rows
