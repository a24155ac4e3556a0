"""A decision that was overtaken is not carried out: somebody changes the plan while a start waits, is given to a robot, or ends."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Mission, State, Wait
from app.services.dispatch import allocator
from app.services.dispatch.ledger import Ledger
from mir_sim import MISSIONS
from tests.support.network import Fate
from tests.support.seen import items, robot_of
from tests.support.site import GUIDS


def low_battery_start(site, plan, mission_id=None):
    site.machines["R1"].set_battery(12.0)
    plan("2026-11-23T06:05", minimum_battery_percent=30, **({} if mission_id is None else {"mission_id": mission_id}))
    site.run(360)
    assert [row.wait for row in site.executions()] == [Wait.BATTERY]


def test_no_intent_is_written_of_what_nothing_wants(site, plan):
    """Whatever may have left the row waiting: the question is part of the write."""
    schedule = plan("2026-11-23T06:05", minimum_battery_percent=30)
    site.machines["R1"].set_battery(12.0)
    site.run(360)
    [row], ledger, robot = site.executions(), site.container.ledger, robot_of(site)
    site.container.db.write(lambda c: c.execute("DELETE FROM schedules WHERE id = ?", (schedule.id,)))
    assert ledger.make([ledger.moves.begun(row, robot, 0)]) == []
    assert ledger.get(row.id).state is State.WAITING


# ---------------------------------------------------------------------- a robot's own mission
def test_what_waits_does_not_run_a_mission_that_was_deleted(site, plan):
    """The robot's own one was a mistake: the schedule goes on with the one for all robots, and so does its start."""
    own = site.container.catalogue.save_mission(Mission("Deliver", GUIDS["Home"], robot_id=robot_of(site).id))
    low_battery_start(site, plan, own.id)
    site.container.catalogue.remove_mission(own.id)
    site.machines["R1"].set_battery(80.0)
    site.run(300)
    assert [item.mission_id for item in items(site)] == [GUIDS["Deliver"]]


@pytest.mark.parametrize("how", ["own entered", "own deleted"])
def test_an_own_mission_entered_or_deleted_a_moment_before_the_instant_counts(site, plan, how):
    catalogue, wanted, values = site.container.catalogue, GUIDS["Home"], {}
    if how == "own deleted":
        own = catalogue.save_mission(Mission("Deliver", GUIDS["Home"], robot_id=robot_of(site).id))
        wanted, values = GUIDS["Deliver"], {"mission_id": own.id}
    plan("2026-11-23T06:05", **values)

    def act():
        assert [row.state for row in site.executions()] == [State.SUBMITTING]
        if how == "own entered":
            catalogue.save_mission(Mission("Deliver", GUIDS["Home"], robot_id=robot_of(site).id))
        else:
            catalogue.remove_mission(own.id)

    site.at(299.9, act)
    site.run(400)
    assert [item.mission_id for item in items(site)] == [wanted]


@pytest.fixture
def refused_idle(site):
    """An idle mission that the robot could not take yet waits for its next try."""
    home = site.add_mission("Home")
    site.container.catalogue.change_settings(poll_interval_seconds=120)
    site.container.catalogue.save_idle_rule(robot_of(site).id, home.id, after_minutes=5)
    return site, home


@pytest.mark.parametrize("fate", [Fate.REFUSED, Fate.LOST])
@pytest.mark.parametrize("how", ["own entered", "guid changed", "own deleted"])
def test_an_idle_mission_that_is_another_one_by_now_is_not_sent_as_it_was(refused_idle, how, fate):
    site, home = refused_idle
    catalogue, first = site.container.catalogue, GUIDS["Home"]
    if how == "own deleted":
        own = catalogue.save_mission(Mission("Home", MISSIONS[-1].guid, robot_id=robot_of(site).id))
        first = own.guid
    site.network.next("POST", "/mission_queue", fate)
    site.run_until(lambda: any(row.attempts for row in site.executions()), within=900)
    assert items(site) == []
    match how:
        case "own entered":
            catalogue.save_mission(Mission("Home", GUIDS["Deliver"], robot_id=robot_of(site).id))
        case "guid changed":
            catalogue.save_mission(replace(home, guid=GUIDS["Deliver"]))
        case _:
            catalogue.remove_mission(own.id)
    site.run(1200)
    assert first not in [item.mission_id for item in items(site)]


# ---------------------------------------------------------------------- the mission of a group's start that has a robot
def test_what_a_person_gave_to_a_robot_does_not_run_a_mission_that_was_deleted(hall):
    own = hall.container.catalogue.save_mission(Mission("Deliver", GUIDS["Home"], robot_id=1))
    hall.plan(start_window_minutes=60, minimum_battery_percent=30)
    for machine in hall.machines.values():
        machine.set_battery(12.0)
    hall.run(310)
    hall.container.operator.give_to(hall.run_of().id, 1)
    hall.run(30)
    hall.container.catalogue.remove_mission(own.id)
    hall.machines["R1"].set_battery(80.0)
    hall.run(60)
    assert [item.mission_id for item in hall.items()] == [GUIDS["Deliver"]]


def test_a_mission_edited_between_intent_and_request_leaves_as_it_is_by_then(hall, monkeypatch):
    hall.plan(start_window_minutes=30)
    bind = Ledger.bind

    def and_then(ledger, *args):
        rows = bind(ledger, *args)
        assert rows[0].state is State.SUBMITTING
        monkeypatch.setattr(Ledger, "bind", bind)
        mission = hall.container.catalogue.missions()[0]
        hall.container.catalogue.save_mission(replace(mission, guid=GUIDS["Home"]))
        return rows

    monkeypatch.setattr(Ledger, "bind", and_then)
    hall.run(330)
    assert [item.mission_id for item in hall.items()] == [GUIDS["Home"]]


def test_a_priority_edited_in_doubt_counts_for_what_is_sent_again(hall):
    schedule = hall.plan(start_window_minutes=30)
    hall.network.next("POST", "/mission_queue", Fate.LOST)
    hall.run(306)
    hall.container.catalogue.save_schedule(replace(schedule, priority=3))
    hall.run(300)
    assert [item.priority for item in hall.items()] == [3]


# ---------------------------------------------------------------------- lost
def test_a_robot_that_is_switched_on_a_moment_before_gets_the_run_now_of_its_group(hall):
    hall.run(60)
    hall.only()
    hall.run(60)
    hall.switch("R1", on=True)
    hall.container.operator.run_on_any(hall.group.id, 1)
    hall.run(300)
    assert [row.state for row in hall.executions()] == [State.COMPLETED]


def late_edit(hall, monkeypatch, **changes):
    """An edit that is made while the allocator decides about the start."""
    schedule = next(each for each in hall.container.repositories.schedules.all(hall.container.db.read()))
    choose = allocator.choose

    def and_then(situation):
        decisions = choose(situation)
        if any(each.too_late for each in decisions):
            monkeypatch.setattr(allocator, "choose", choose)
            hall.container.catalogue.save_schedule(replace(schedule, **changes))
        return decisions

    monkeypatch.setattr(allocator, "choose", and_then)


@pytest.mark.parametrize("by", [None, 60])
def test_finish_by_edited_a_moment_before_counts(hall, by):
    schedule = hall.plan(start_window_minutes=30, finish_by_minutes=10)
    for name in hall.machines:
        hall.hold(name)
    hall.at(590, lambda: hall.container.catalogue.save_schedule(replace(schedule, finish_by_minutes=by)))
    hall.at(900, lambda: [hall.container.holds.release(robot_id) for robot_id in hall.group.members])
    hall.run(1500)
    assert hall.run_of().state is State.COMPLETED


def test_window_edited_a_moment_before_counts(hall):
    schedule = hall.plan(start_window_minutes=10)
    for name in hall.machines:
        hall.hold(name)
    hall.at(899, lambda: hall.container.catalogue.save_schedule(replace(schedule, start_window_minutes=60)))
    hall.at(1000, lambda: [hall.container.holds.release(robot_id) for robot_id in hall.group.members])
    hall.run(1500)
    assert hall.run_of().state is State.COMPLETED


@pytest.mark.parametrize("by", [None, 60])
def test_a_time_to_be_done_by_that_is_put_off_while_it_is_decided_counts(hall, monkeypatch, by):
    hall.plan(start_window_minutes=30, finish_by_minutes=10)
    for name in hall.machines:
        hall.hold(name)
    late_edit(hall, monkeypatch, finish_by_minutes=by)
    hall.at(900, lambda: [hall.container.holds.release(robot_id) for robot_id in hall.group.members])
    hall.run(1500)
    assert hall.run_of().state is State.COMPLETED


def test_a_window_that_is_made_longer_while_it_is_looked_at_counts(hall, monkeypatch):
    schedule = hall.plan(start_window_minutes=10)
    for name in hall.machines:
        hall.hold(name)
    end = Ledger.end

    def and_then(ledger, row, reason):
        monkeypatch.setattr(Ledger, "end", end)
        hall.container.catalogue.save_schedule(replace(schedule, start_window_minutes=60))
        return end(ledger, row, reason)

    monkeypatch.setattr(Ledger, "end", and_then)
    hall.at(1000, lambda: [hall.container.holds.release(robot_id) for robot_id in hall.group.members])
    hall.run(1500)
    assert hall.run_of().state is State.COMPLETED


def test_what_a_person_ends_ends_though_it_was_edited_in_that_moment(site, plan):
    """The queue is cleared; while the robot answers that, somebody makes the start's window longer."""
    schedule = plan("2026-11-23T06:05", minimum_battery_percent=30)
    site.machines["R1"].set_battery(12.0)
    site.run(360)
    site.network.next("DELETE", "/mission_queue", Fate.SLOW, 3.0)
    edited = []

    def edit(_robot, met):
        if met.method == "DELETE":
            edited.append(site.container.catalogue.save_schedule(replace(schedule, start_window_minutes=60)))

    site.network.met = edit
    site.container.operator.clear_queue(robot_of(site).id)
    assert edited
    assert [row.state for row in site.executions()] == [State.CANCELLED]


def test_a_robot_that_is_switched_on_while_its_answer_is_slow_gets_the_start_of_its_group(hall):
    """It was off, and is read because something of ours runs there; that answer takes 8 s."""
    hall.network.others_wait = False
    hall.plan("A", start_window_minutes=30)
    hall.at(280, lambda: hall.container.operator.run_now(1, 1))
    hall.run(292)
    assert hall.executions()[0].state in (State.QUEUED, State.EXECUTING)
    hall.only()
    slow = []

    def met(robot, planned):
        if planned.fate is Fate.SLOW and not slow:
            slow.append(hall.seconds())
            hall.at(1.0, lambda: hall.switch("R1", on=True))

    hall.network.met = met
    hall.at(4.0, lambda: hall.network.next("GET", "*", Fate.SLOW, 8.0, robot="R1"))
    hall.run(16)
    assert slow
    assert slow[0] < 299 < slow[0] + 8
    assert hall.robot("R1").enabled
    assert hall.run_of("A").state is not State.CANCELLED
    hall.run(900)
    assert hall.run_of("A").state is State.COMPLETED


# ---------------------------------------------------------------------- sent though taken back
@pytest.mark.parametrize(
    "how", ["schedule deleted", "schedule switched off", "schedule moved", "schedule to another robot"]
)
def test_what_was_taken_back_after_its_robot_was_deleted_is_not_sent_to_another(hall, monkeypatch, how):
    """The intent is on the disk; its robot is deleted, then the start is not wanted any more, before the worker has closed."""
    schedule = hall.plan(start_window_minutes=30, at="2026-11-23T06:05")
    catalogue, bind = hall.container.catalogue, Ledger.bind

    def and_then(ledger, *args):
        rows = bind(ledger, *args)
        assert rows[0].state is State.SUBMITTING
        monkeypatch.setattr(Ledger, "bind", bind)
        catalogue.remove_robot(rows[0].robot_id)
        match how:
            case "schedule deleted":
                catalogue.remove_schedule(schedule.id)
            case "schedule switched off":
                catalogue.save_schedule(replace(schedule, enabled=False))
            case "schedule moved":
                catalogue.save_schedule(replace(schedule, start=schedule.start.replace(hour=9)))
            case "schedule to another robot":
                catalogue.save_schedule(
                    replace(
                        schedule,
                        group_id=None,
                        robot_id=next(each.id for each in catalogue.robots()),
                        start=schedule.start.replace(hour=9),
                    )
                )
        return rows

    monkeypatch.setattr(Ledger, "bind", and_then)
    hall.run(600)
    assert hall.network.posts() == []
