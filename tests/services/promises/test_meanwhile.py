"""What happens between a decision and what carries it out: somebody acts while the robot is asked, or a start is given back."""
from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import pytest

from app.domain.models import Connection, HandOver, Overlap, Place, Schedule, State, Wait
from app.mir.errors import RobotError
from app.services.dispatch.ledger import Ledger
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import items, outcomes, robot_of
from tests.support.site import Site

AT = "2026-11-23T06:05"
LONG = {"start_window_minutes": 60}


@pytest.fixture
def hall(tmp_path):
    hall = Hall(tmp_path)
    yield hall
    hall.switch_off()


@pytest.fixture
def two(tmp_path):
    """A site with R1 and R2."""
    site = Site(tmp_path, robots=2)
    site.add_robots()
    yield site
    site.switch_off()


def stored(site, schedule: Schedule) -> Schedule:
    return site.container.repositories.schedules.get(site.container.db.read(), schedule.id)


# ---------------------------------------------------------------------- the queue is cleared
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


# ---------------------------------------------------------------------- switched on again
@pytest.mark.parametrize("how", ["planned", "run now"])
@pytest.mark.parametrize("slow", [0.0, 8.0])
def test_a_robot_switched_on_while_its_answer_is_slow_gets_what_is_due_then(site, plan, how, slow):
    site.network.others_wait = False
    plan("2026-11-23T06:04")
    if how == "planned":
        plan(AT, **LONG)
    robot = robot_of(site)
    site.run(245)
    site.container.catalogue.set_robot_enabled(robot.id, False)
    site.run(50)
    if slow:
        site.network.next("GET", "/mission_queue/1", Fate.SLOW, slow)

    def switch_on() -> None:
        site.container.catalogue.set_robot_enabled(robot.id, True)
        if how == "run now":
            site.container.operator.run_now(robot.id, site.container.catalogue.missions()[0].id)
    site.at(4.5, switch_on)
    site.run(600)
    assert len(items(site)) == 2, outcomes(site)


# ---------------------------------------------------------------------- while the connection is made
@pytest.mark.parametrize("where", ["schedule", "settings"])
def test_what_is_beyond_its_window_by_now_is_not_sent(site, plan, where):
    window = {} if where == "settings" else LONG
    if where == "settings":
        site.container.catalogue.change_settings(start_window_minutes=60)
    schedule = plan(AT, minimum_battery_percent=30, **window)
    site.machines["R1"].set_battery(12.0)
    site.run(900)

    def shorten(_robot, met) -> None:
        if met.method == "POST":
            if where == "settings":
                site.container.catalogue.change_settings(start_window_minutes=1)
            else:
                site.container.catalogue.save_schedule(replace(schedule, start_window_minutes=1))
    site.network.next("POST", "/mission_queue", Fate.SLOW, 0.1)
    site.network.met = shorten
    site.machines["R1"].set_battery(90.0)
    site.run(60)
    assert items(site) == [], outcomes(site)


def test_a_place_that_a_mission_is_said_to_use_a_moment_before_its_instant_counts(two):
    r1, r2 = two.container.catalogue.robots()
    deliver, home, catalogue = two.add_mission("Deliver"), two.add_mission("Home"), two.container.catalogue
    dock = catalogue.edit(lambda edit: edit.save_place(Place("Dock", most=1, missions=(home.id,))))
    catalogue.save_schedule(Schedule("A", r1.id, home.id, datetime.fromisoformat("2026-11-23T06:04"), "UTC"))
    catalogue.save_schedule(Schedule("B", r2.id, deliver.id, datetime.fromisoformat(AT), "UTC", **LONG))
    two.at(242, lambda: two.container.operator.pause(r1.id))
    two.at(299.9, lambda: catalogue.edit(lambda edit: edit.use_places(deliver, [dock.id])))
    two.run(303)
    assert items(two, "R2") == []
    two.container.operator.resume(r1.id)
    two.run(60)
    assert len(items(two, "R2")) == 1


# ---------------------------------------------------------------------- there and back
@pytest.mark.parametrize("why", ["battery", "unreachable", "refused"])
@pytest.mark.parametrize("how", ["moved", "off and on"])
def test_a_start_that_nothing_was_sent_of_is_there_again(site, plan, why, how):
    schedule = plan(AT, minimum_battery_percent=30, **LONG)
    if why == "battery":
        site.machines["R1"].set_battery(12.0)
    elif why == "unreachable":
        site.network.down.add("R1")
    else:
        site.run(299.9)
        site.network.down.add("R1")
    site.run(330 - site.seconds())
    away, back = (({"start": datetime.fromisoformat("2026-11-23T06:50")}, {"start": datetime.fromisoformat(AT)}) if how == "moved"
                  else ({"enabled": False}, {"enabled": True}))
    site.container.catalogue.save_schedule(replace(stored(site, schedule), **away))
    site.run(3)
    site.container.catalogue.save_schedule(replace(stored(site, schedule), **back))
    site.network.down.clear()
    site.machines["R1"].set_battery(90.0)
    site.run(300)
    assert len(items(site)) == 1, (outcomes(site), stored(site, schedule).next_at)


# ---------------------------------------------------------------------- undone in that moment
def test_what_is_taken_back_and_given_back_is_never_in_between(site, plan, monkeypatch):
    """The schedule's deletion is undone in the very moment in which its start was found not to have left."""
    schedule = plan(AT, **LONG)
    removed, undone, make = [], [], Ledger.make

    def remove(_robot, met) -> None:
        if met.method == "POST" and not removed:
            removed.append(site.container.catalogue.remove_schedule(schedule.id))

    def and_then(ledger, moves, *args, **how):
        rows = make(ledger, moves, *args, **how)
        if removed and not undone and rows:
            undone.append(site.container.catalogue.restore(removed[0]))
        return rows

    site.network.next("POST", "/mission_queue", Fate.SLOW, 0.1)
    site.network.met = remove
    monkeypatch.setattr(Ledger, "make", and_then)
    site.run(900)
    assert undone
    assert len(items(site)) == 1, outcomes(site)


def test_a_group_start_is_there_again_when_undone_as_it_is_given_back(hall):
    schedule = hall.plan(**LONG)
    hall.network.next("POST", "/mission_queue", Fate.LOST)
    hall.run(306)
    removed = hall.container.catalogue.remove_schedule(schedule.id)
    hall.run(85)
    hall.network.down.add("R2")
    hall.run_until(lambda: hall.executions()[0].state is not State.SUBMITTING)
    hall.container.catalogue.restore(removed)
    hall.network.down.clear()
    hall.run(900)
    assert len(hall.items()) == 1, outcomes(hall)


def test_undo_brings_back_all_that_waited_beside_each_other(site, plan):
    schedule = plan(AT, "FREQ=MINUTELY;INTERVAL=5", minimum_battery_percent=30, overlap=Overlap.QUEUE, **LONG)
    site.machines["R1"].set_battery(12.0)
    site.run(660)
    assert [row.state for row in site.executions()] == [State.WAITING] * 2
    site.container.catalogue.save_schedule(replace(schedule, overlap=Overlap.SKIP))
    site.container.catalogue.restore(site.container.catalogue.remove_schedule(schedule.id))
    assert [row.state for row in site.executions()] == [State.WAITING] * 2


# ---------------------------------------------------------------------- others
def test_no_robot_is_chosen_for_what_nothing_wants(hall):
    schedule = hall.plan(minimum_battery_percent=30, **LONG)
    for machine in hall.machines.values():
        machine.set_battery(12.0)
    hall.run(330)
    hall.container.db.write(lambda c: c.execute("DELETE FROM schedules WHERE id = ?", (schedule.id,)))
    for machine in hall.machines.values():
        machine.set_battery(90.0)
    hall.run(120)
    assert hall.items() == []


def test_hundreds_that_wait_for_a_dead_robot_keep_nobody_waiting(two):
    r1, r2 = two.container.catalogue.robots()
    deliver, at = two.add_mission(), datetime.fromisoformat(AT)
    for number in range(100):
        two.container.catalogue.save_schedule(Schedule(f"A{number}", r1.id, deliver.id, at, "UTC"))
    two.container.catalogue.save_schedule(Schedule("B", r2.id, deliver.id, at, "UTC"))
    two.network.down.add("R1")
    two.run(299.95)
    assert [(row.schedule, row.state) for row in two.executions()] == [("B", State.SUBMITTING)], "its intent is there before its instant"


def test_what_runs_is_followed_where_the_queue_can_t_be_read(site, plan):
    """One of the robot's answers is no list of items; each item can be asked for."""
    plan(AT)
    site.run(300.5)                                # before it is polled
    site.network.next("POST", "/mission_queue/search", Fate.PAGE, count=1000)
    site.run(120)
    assert site.container.snapshots.get(robot_of(site).id).connection is Connection.NOT_A_ROBOT
    assert [row.state for row in site.executions()] == [State.COMPLETED], outcomes(site)
