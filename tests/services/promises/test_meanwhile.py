"""What happens between a decision and what carries it out: somebody acts while the robot is asked, or a start is given back."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import pytest

from app.database.rehearsal import Rehearsal
from app.domain.models import Connection, HandOver, InvalidInput, Overlap, Place, Schedule, State
from app.services.catalogue import configuration
from app.services.dispatch.ledger import Ledger
from tests.support.network import Fate
from tests.support.seen import items, outcomes, robot_of
from tests.support.site import Site

AT = "2026-11-23T06:05"
LONG = {"start_window_minutes": 60}


@pytest.fixture
def two(tmp_path):
    """A site with R1 and R2."""
    site = Site(tmp_path, robots=2)
    site.add_robots()
    yield site
    site.switch_off()


def stored(site, schedule: Schedule) -> Schedule:
    return site.container.repositories.schedules.get(site.container.db.read(), schedule.id)


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
    away, back = (
        ({"start": datetime.fromisoformat("2026-11-23T06:50")}, {"start": datetime.fromisoformat(AT)})
        if how == "moved"
        else ({"enabled": False}, {"enabled": True})
    )
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


@pytest.mark.parametrize("begun", [0, 1])
def test_undo_brings_back_what_waited_beside_one_that_runs(site, plan, begun):
    """The other one, an earlier or a later one, has begun."""
    site.container.catalogue.save_robot(replace(robot_of(site), hand_over=HandOver.WHEN_FREE))
    schedule = plan(AT, "FREQ=MINUTELY;INTERVAL=5", overlap=Overlap.QUEUE, **LONG)
    if begun:
        site.run(299)
        site.container.holds.hold("cleaning", None)
        site.run(2)
        site.container.operator.hold_starts([row.id for row in site.executions()])
        site.container.holds.release(None)
    site.at((303, 603)[begun] - site.seconds(), lambda: site.container.operator.pause(robot_of(site).id))
    site.run(660 - site.seconds())
    before = [State.WAITING, State.EXECUTING] if begun else [State.EXECUTING, State.WAITING]
    assert [row.state for row in site.executions()] == before, outcomes(site)
    site.container.catalogue.save_schedule(replace(schedule, overlap=Overlap.SKIP))
    site.container.catalogue.restore(site.container.catalogue.remove_schedule(schedule.id))
    assert [row.state for row in site.executions()] == before, outcomes(site)


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
    assert [(row.schedule, row.state) for row in two.executions()] == [("B", State.SUBMITTING)], (
        "its intent is there before its instant"
    )


def test_what_runs_is_followed_where_the_queue_can_t_be_read(site, plan):
    """One of the robot's answers is no list of items; each item can be asked for."""
    plan(AT)
    site.run(300.5)  # before it is polled
    site.network.next("POST", "/mission_queue/search", Fate.PAGE, count=1000)
    site.run(120)
    assert site.container.snapshots.get(robot_of(site).id).connection is Connection.NOT_A_ROBOT
    assert [row.state for row in site.executions()] == [State.COMPLETED], outcomes(site)


@pytest.mark.parametrize("own", [True, False])
def test_what_is_started_on_another_robot_is_not_sent_again_where_it_was_lost(hall, own):
    """The dialog: 'If R1 has it after all, it runs twice.' R1 never had it."""
    hall.plan(**(LONG | ({"robot_id": hall.robot("R1").id, "group_id": None} if own else {})))
    hall.network.next("POST", "/mission_queue", Fate.LOST)
    hall.run(310)
    row = hall.run_of()
    assert row.state is State.SUBMITTING
    other = next(hall.robot(name) for name in ("R3", "R2") if name != row.robot)
    hall.container.operator.start_on_another(row.id, other.id)
    hall.run(600)
    assert len(hall.items()) == 1, outcomes(hall)


@pytest.mark.parametrize("how", ["off and on", "to another robot"])
@pytest.mark.parametrize("fails", [1, 2])
def test_a_start_whose_posts_found_no_connection_is_there_again(two, how, fails):
    r1, r2 = two.container.catalogue.robots()
    deliver, save = two.add_mission(), two.container.catalogue.save_schedule
    schedule = save(Schedule("A", r1.id, deliver.id, datetime.fromisoformat(AT), "UTC", **LONG))
    two.network.next("POST", "/mission_queue", Fate.REFUSED, robot="R1", count=fails)
    two.run_until(
        lambda: [(row.attempts, row.state) for row in two.executions()] == [(fails, State.WAITING)], within=900
    )
    if how == "off and on":
        save(replace(stored(two, schedule), enabled=False))
        save(replace(stored(two, schedule), enabled=True))
    else:
        save(replace(stored(two, schedule), robot_id=r2.id))
    two.run(300)
    assert len(items(two, "R1") + items(two, "R2")) == 1, (outcomes(two), stored(two, schedule).next_at)


def test_a_groups_start_whose_post_found_no_connection_is_there_again(hall):
    schedule, save = hall.plan(**LONG), hall.container.catalogue.save_schedule
    hall.only("R1")
    hall.network.next("POST", "/mission_queue", Fate.REFUSED)
    hall.run(300.3)
    assert [(row.attempts, row.state) for row in hall.executions()] == [(1, State.WAITING)]
    save(replace(stored(hall, schedule), enabled=False))
    save(replace(stored(hall, schedule), enabled=True))
    hall.run(300)
    assert len(hall.items()) == 1, (outcomes(hall), stored(hall, schedule).next_at)


@pytest.mark.parametrize("what", ["priority", "tried"])
def test_what_happens_to_a_groups_start_while_an_import_is_rehearsed_stays(hall, monkeypatch, what):
    hall.container.catalogue.change_settings(start_window_minutes=60)
    if what == "priority":
        hall.plan(minimum_battery_percent=30)
        for machine in hall.machines.values():
            machine.set_battery(12.0)
        hall.run(330)
    else:
        hall.only("R1")
        hall.plan()
        hall.network.next("POST", "/mission_queue", Fate.LOST)
        hall.run(391)  # in doubt, and not found soon
        assert hall.run_of().state is State.SUBMITTING
    close, acted = Rehearsal.close, []

    def and_then(rehearsal) -> None:
        close(rehearsal)
        if not acted:
            acted.append(True)
            if what == "priority":
                hall.container.operator.prioritise(hall.run_of().id, 50)
            else:
                hall.run_until(lambda: bool(hall.run_of().tried), within=100)

    monkeypatch.setattr(Rehearsal, "close", and_then)
    content = b'{"format": "amr-scheduler/1", "settings": {"start_window_minutes": 45}}'
    configuration.import_configuration(hall.container.catalogue, content)
    row = hall.run_of()
    assert row.priority == 50 if what == "priority" else row.tried, (row.priority, row.tried)


def test_a_start_that_is_on_its_way_is_not_skipped_and_no_other_in_its_place(site, plan):
    """0.1 s before 06:05, the next start that is on screen, its row is there and the schedule says 07:05."""
    schedule = plan(AT, "FREQ=HOURLY")
    site.run(299.9)
    with pytest.raises(InvalidInput, match="has passed"):
        site.container.pausing.skip_next(schedule.id, schedule.next_at)
    site.run(60)
    assert len(items(site)) == 1
    assert [row.state for row in site.executions()] == [State.EXECUTING]
