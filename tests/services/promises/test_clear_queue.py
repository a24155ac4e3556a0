"""The queue of a robot is cleared: what was to go goes, nothing else does, and nothing is sent before the robot has answered."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import pytest

from app.domain.models import HandOver, InvalidInput, ReasonCode, Schedule, State, Wait
from app.mir.errors import RobotError
from tests.support.network import Fate
from tests.support.seen import alarms, items, outcomes, robot_of
from tests.support.site import Site

AT = "2026-11-23T06:05"
LONG = {"start_window_minutes": 60}
CLEAR = ("DELETE", "/mission_queue")


def stored(site, schedule: Schedule) -> Schedule:
    return site.container.repositories.schedules.get(site.container.db.read(), schedule.id)


def clear_in_vain(site, meanwhile=lambda: None, robot_id=None):
    """Clear queue finds no connection; ``meanwhile`` happens while it is tried."""

    def met(_robot, planned) -> None:
        if planned.method == "DELETE":
            site.network.met = lambda robot, planned: None
            meanwhile()

    site.network.next(*CLEAR, Fate.REFUSED)
    site.network.met = met
    with pytest.raises(RobotError):
        site.container.operator.clear_queue(robot_id or robot_of(site).id)


def waiting_for_battery(site, plan):
    schedule = plan(AT, minimum_battery_percent=30, **LONG)
    site.machines["R1"].set_battery(12.0)
    site.run(360)
    (row,) = site.executions()
    assert row.state is State.WAITING
    return schedule, row


def in_doubt(site, plan):
    plan(AT, **LONG)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run(310)
    (row,) = site.executions()
    assert row.state is State.SUBMITTING
    return row


@pytest.mark.parametrize("seconds", [0.3, 3.0])
def test_clear_queue_ends_what_waits_for_a_robot_that_becomes_free_by_it(site, plan, seconds):
    site.container.catalogue.save_robot(replace(robot_of(site), hand_over=HandOver.WHEN_FREE))
    for _n in range(2):
        plan(AT, **LONG)
    site.run(330)
    site.network.others_wait = False
    site.network.next("DELETE", "/mission_queue", Fate.SLOW, seconds)
    site.container.operator.clear_queue(robot_of(site).id)
    site.run(600)
    assert len(items(site)) == 1, outcomes(site)
    assert [row.state for row in site.executions()] == [State.CANCELLED] * 2


def test_clear_queue_ends_what_is_about_to_be_tried_again(site, plan):
    plan(AT, **LONG)
    site.network.next("POST", "/mission_queue", Fate.REFUSED)
    site.run(300.5)
    assert [row.wait for row in site.executions()] == [Wait.RETRY]
    site.network.others_wait = False
    site.run(0.9)
    site.network.next("DELETE", "/mission_queue", Fate.SLOW, 2.0)
    site.container.operator.clear_queue(robot_of(site).id)
    site.run(600)
    assert items(site) == [], outcomes(site)


def test_a_queue_that_could_not_be_cleared_goes_on(site, plan):
    plan(AT, minimum_battery_percent=30, **LONG)
    site.machines["R1"].set_battery(12.0)
    site.run(360)
    site.network.next("DELETE", "/mission_queue", Fate.REFUSED)
    with pytest.raises(RobotError):
        site.container.operator.clear_queue(robot_of(site).id)
    assert [(row.state, row.held) for row in site.executions()] == [(State.WAITING, False)]
    site.machines["R1"].set_battery(90.0)
    site.run(60)
    assert len(items(site)) == 1


@pytest.mark.parametrize("cancelled_by", ["cancel", "clear queue"])
def test_a_clear_in_vain_does_not_undo_a_cancel_of_what_is_in_doubt(site, plan, cancelled_by):
    row = in_doubt(site, plan)
    if cancelled_by == "cancel":
        site.container.operator.cancel_execution(row.id)
    else:
        site.container.operator.clear_queue(robot_of(site).id)  # the robot has done it
    clear_in_vain(site)
    site.run(600)
    assert items(site) == [], outcomes(site)


def test_a_clear_in_vain_does_not_undo_a_cancel_of_what_the_robot_has_not_heard_of(site, plan):
    """Queued at a paused robot; the cancel finds no connection and is to be made up for as soon as the robot answers."""
    plan(AT, **LONG)
    site.container.operator.pause(robot_of(site).id)
    site.run(303)
    (row,) = site.executions()
    assert row.state is State.QUEUED
    site.network.down.add("R1")
    site.container.operator.cancel_execution(row.id)
    clear_in_vain(site)
    site.network.down.clear()
    site.run(120)
    site.container.operator.resume(robot_of(site).id)
    site.run(900)
    assert [row.state for row in site.executions()] == [State.CANCELLED], outcomes(site)


def test_a_clear_in_vain_does_not_let_go_what_a_person_holds_meanwhile(site, plan):
    _schedule, row = waiting_for_battery(site, plan)

    def hold() -> None:
        site.run(2)
        assert site.container.operator.hold_starts([row.id]) == 1

    clear_in_vain(site, hold)
    site.machines["R1"].set_battery(90.0)
    site.run(120)
    assert items(site) == [], outcomes(site)


def test_what_waits_is_not_sent_after_a_clear_whose_answer_was_lost(site, plan):
    site.container.catalogue.save_robot(replace(robot_of(site), hand_over=HandOver.WHEN_FREE))
    for _n in range(2):
        plan(AT, **LONG)
    site.run(303)
    assert [row.state for row in site.executions()] == [State.EXECUTING, State.WAITING]
    site.network.others_wait = False
    site.network.next(*CLEAR, Fate.ANSWER_LOST)
    with pytest.raises(RobotError):
        site.container.operator.clear_queue(robot_of(site).id)
    site.run(600)
    assert len(items(site)) == 1, outcomes(site)  # here: cancelled as queue_cleared, and the other one completed


@pytest.mark.parametrize("what", ["its worker goes on", "taken from the group", "switched off"])
def test_a_groups_start_is_not_kept_back_by_nobody(hall, what):
    """Clear queue on the robot that has a start of its group, with nothing sent; the robot clears its queue."""
    r1 = hall.robot("R1")
    hall.network.others_wait = False
    worker = hall._workers.get(r1.id)
    if what == "its worker goes on":
        hall.plan(**LONG)
        hall.container.catalogue.save_robot(replace(r1, hand_over=HandOver.WHEN_FREE))
        hall.only("R1")
        hall.run(299.6)
        worker = hall._workers[r1.id]
        hall._blocked.add(worker)  # its thread waits for an answer of R1
        hall.run(0.3)
    else:
        hall.plan(minimum_battery_percent=30, **LONG)
        for machine in hall.machines.values():
            machine.set_battery(12.0)
        hall.run(330)
        hall.container.operator.give_to(hall.executions()[0].id, r1.id)
        hall.run(10)
    (row,) = hall.executions()
    assert (row.state, row.robot) == (State.WAITING, "R1")

    def meanwhile(_robot, met) -> None:
        if met.method != "DELETE":
            return
        hall.network.met = lambda robot, met: None
        if what == "its worker goes on":
            hall._blocked.discard(worker)  # it has its answer
        elif what == "switched off":
            hall.switch("R1", on=False)
        else:
            hall.container.catalogue.edit(
                lambda edit: edit.save_group(replace(hall.group, members=hall.group.members[1:]))
            )
        hall.run(2)

    hall.network.next(*CLEAR, Fate.SLOW, 1.0)
    hall.network.met = meanwhile
    hall.container.operator.clear_queue(r1.id)
    for machine in hall.machines.values():
        machine.set_battery(90.0)
    hall.run(600)
    (row,) = hall.executions()
    assert row.state in (State.CANCELLED, State.COMPLETED), (row.state, row.robot, row.wait, row.held)


def test_a_start_is_not_kept_back_for_ever_by_an_app_that_was_killed(site, plan):
    waiting_for_battery(site, plan)

    class Killed(BaseException):
        pass

    def kill(_robot, met) -> None:
        if met.method == "DELETE":
            raise Killed

    site.network.next(*CLEAR, Fate.REFUSED)
    site.network.met = kill
    with pytest.raises(Killed):
        site.container.operator.clear_queue(robot_of(site).id)
    site.network.met = lambda robot, met: None
    site.power_cut(5)
    site.machines["R1"].set_battery(90.0)
    site.run(3900)
    (row,) = site.executions()
    assert row.state in (State.COMPLETED, State.CANCELLED), (outcomes(site), row.held, row.reason)


@pytest.mark.parametrize("what", ["off and on", "deleted and undone", "cancelled and undone"])
def test_what_is_undone_while_a_clear_is_tried_in_vain_is_there_again(site, plan, what):
    schedule, row = waiting_for_battery(site, plan)
    catalogue, removed = site.container.catalogue, []

    def act() -> None:
        if what == "off and on":
            catalogue.save_schedule(replace(stored(site, schedule), enabled=False))
            catalogue.save_schedule(replace(stored(site, schedule), enabled=True))
        elif what == "deleted and undone":
            removed.append(catalogue.remove_schedule(schedule.id))
        else:
            site.container.operator.cancel_execution(row.id)

    clear_in_vain(site, act)
    if what == "deleted and undone":
        catalogue.restore(removed[0])
    elif what == "cancelled and undone":
        catalogue.wait_again(row.id)
    site.machines["R1"].set_battery(90.0)
    site.run(300)
    assert len(items(site)) == 1, (outcomes(site), site.executions()[0].held, stored(site, schedule).next_at)


@pytest.mark.parametrize("what", ["about to be sent", "in doubt"])
def test_what_is_on_its_way_during_a_clear_in_vain_is_sent(site, plan, what):
    plan(AT, **LONG)
    if what == "in doubt":
        site.network.next("POST", "/mission_queue", Fate.LOST)
        site.run(394)  # the quiet time is over in a moment
    else:
        site.run(299.9)
    assert [row.state for row in site.executions()] == [State.SUBMITTING]
    site.network.others_wait = False
    clear_in_vain(site, lambda: site.run(4))  # as long as a connection is tried for
    site.run(600)
    assert len(items(site)) == 1, outcomes(site)


def test_a_clear_in_vain_does_not_end_the_list_of_late_starts(tmp_path):
    site = Site(tmp_path, with_window=True)
    site.add_robots()
    deliver = site.add_mission()
    site.container.catalogue.save_schedule(
        Schedule("A", robot_of(site).id, deliver.id, datetime.fromisoformat(AT), "UTC", **LONG)
    )
    site.run(200)
    site.power_cut(200)
    site.run(5)
    assert [row.wait for row in site.executions()] == [Wait.LATE_START]
    clear_in_vain(site)
    site.run(10)
    posts = items(site)
    site.switch_off()
    assert posts == []


@pytest.mark.parametrize("begun", [298.0, 299.5])
def test_a_groups_start_goes_to_another_robot_while_the_queue_of_the_best_one_is_being_cleared(hall, begun):
    hall.plan("A", **LONG)
    for name in ("R2", "R3"):
        hall.machines[name].set_battery(60.0)
    hall.engine.watch(hall.robot("R1").id)
    hall.run(begun)
    hall.network.others_wait = False
    hall.network.next(*CLEAR, Fate.SLOW, 9.0)
    hall.container.operator.clear_queue(hall.robot("R1").id)
    hall.run(30)
    (post,) = hall.network.posts()
    assert post.at < 301
    assert post.robot != "R1"


def test_what_is_to_go_with_a_cleared_queue_is_given_to_no_other_robot(hall):
    """It would end as cleared there, where nothing was cleared."""
    hall.plan("A", **LONG)
    for machine in hall.machines.values():
        machine.set_battery(5.0)
    hall.container.catalogue.change_settings(minimum_battery_percent=20)
    hall.run(330)
    row, give_to = hall.run_of(), hall.container.operator.give_to
    with hall.container.clearing.of(hall.robot("R1").id) as cleared:
        cleared.rows = frozenset([row.id])  # it was R1's a moment ago
        with pytest.raises(InvalidInput):
            give_to(row.id, hall.robot("R2").id)
    assert give_to(row.id, hall.robot("R2").id).robot == "R2"


@pytest.mark.parametrize("has_other_words", [False, True])
def test_what_is_cleared_while_the_robot_is_read_ends_as_cleared(site, plan, has_other_words):
    """The worker has read the row, and waits for what the robot says of the one before."""
    site.network.words = {"Aborted": "Abgebrochen"} if has_other_words else {}
    for _n in range(2):
        plan(AT, **LONG)
    site.run(304)
    assert site.executions()[1].state is State.QUEUED
    site.network.others_wait = False
    begun = []

    def clear(_robot, met):
        if met.method == "GET" and not begun:
            begun.append(True)
            site.at(1.0, lambda: site.container.operator.clear_queue(robot_of(site).id))

    site.network.next("GET", "/mission_queue/1", Fate.SLOW, 3.0)
    site.network.met = clear
    site.run(60)
    assert {row.reason and row.reason.code for row in site.executions()} == {ReasonCode.QUEUE_CLEARED}, (
        outcomes(site),
        alarms(site),
    )


def test_a_clear_counts_though_the_robot_refuses_the_cancel_that_was_pressed_before(site, plan):
    for _n in range(2):
        plan(AT, **LONG)
    site.run(304)
    row = site.executions()[1]
    site.network.next("DELETE", f"/mission_queue/{row.queue_id}", Fate.NOT_FOUND)

    def clear(_robot, met):
        if met.method == "DELETE":
            site.network.met = lambda robot, met: None
            site.container.operator.clear_queue(row.robot_id)

    site.network.met = clear
    with pytest.raises(RobotError):
        site.container.operator.cancel_execution(row.id)
    site.run(60)
    assert {row.reason and row.reason.code for row in site.executions()} == {ReasonCode.QUEUE_CLEARED}, outcomes(site)
