"""What people change while starts of a group wait, or are on their way: nothing is lost, and nothing kept from other robots."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.models import HandOver, Mission, Overlap, ReasonCode, State, Wait
from app.domain.reasons import sentence
from app.services.dispatch.ledger import Ledger
from app.services.live.alarms import alarm_sentence
from app.services.live.changes import Topic
from tests.support.groups import Hall
from tests.support.network import QUEUE, Fate


@pytest.fixture
def bound(hall, monkeypatch):
    """A start that has just been given to a robot, which has not begun with it: ``act`` happens in that moment. Robots with a line of
    their own look again before they begin."""

    def when_bound(act, **values):
        for robot in hall.container.catalogue.robots():
            hall.container.catalogue.save_robot(replace(robot, hand_over=HandOver.WHEN_FREE))
        bind = Ledger.bind

        def and_then(ledger, *args):
            rows = bind(ledger, *args)
            monkeypatch.setattr(Ledger, "bind", bind)
            act(rows[0])
            return rows

        monkeypatch.setattr(Ledger, "bind", and_then)
        hall.plan("A", **({"start_window_minutes": 30} | values))

    return when_bound


# ---------------------------------------------------------------------- given to a robot that can't begin
@pytest.mark.parametrize("cleanly", [True, False])
def test_what_was_given_to_a_robot_is_for_all_again_when_the_app_comes_back(hall, bound, cleanly):
    def crash(row):
        hall.network.down |= {row.robot}
        raise KeyboardInterrupt

    bound(crash)
    with pytest.raises(KeyboardInterrupt):
        hall.run(310)
    hall.switch_off(cleanly=cleanly)
    hall.switch_on()
    assert hall.run_of().robot_id is None
    hall.run(30)
    assert hall.run_of().state is State.EXECUTING


def test_a_start_that_a_person_keeps_back_keeps_no_robot(hall, bound):
    bound(lambda row: hall.container.operator.hold_starts([row.id]))
    hall.run(310)
    assert (hall.run_of().robot_id, hall.run_of().wait) == (None, Wait.HOLD)
    for name in "BCD":
        hall.plan(name, at="2026-11-23T06:07")
    hall.run(120)
    assert [hall.run_of(name).state for name in "BCD"] == [State.EXECUTING] * 3


def test_a_robot_that_is_held_gives_back_what_it_has_not_begun_and_that_is_no_attempt(hall, bound):
    bound(lambda row: hall.hold(row.robot))
    hall.run(310)
    run = hall.run_of()
    assert (run.state, run.attempts) == (State.EXECUTING, 1)
    assert all(not each["tries"] for each in run.tried.values())


def test_a_robot_that_was_stopped_since_it_was_chosen_gives_it_back(hall, bound):
    stopped = []

    def stop(row):
        stopped.append(row.robot)
        hall.machines[row.robot].pause()
        hall.clock.advance(2.5)

    bound(stop)
    hall.run(330)
    assert (hall.run_of().state, hall.run_of().robot not in stopped) == (State.EXECUTING, True)


def test_when_a_deleted_schedule_is_put_back_its_start_is_for_all_robots(hall, bound):
    removed = []

    def delete(row):
        removed.append((row.robot, hall.container.catalogue.remove_schedule(row.schedule_id)))

    bound(delete)
    hall.run(302)
    robot, what = removed[0]
    hall.hold(robot)
    hall.container.catalogue.restore(what)
    hall.run(20)
    assert (hall.run_of().state, hall.run_of().robot != robot) == (State.EXECUTING, True)


@pytest.mark.parametrize("goes", ["schedule", "group", "mission"])
def test_a_made_name_of_a_group_that_comes_back_is_made_anew_where_it_is_taken(hall, goes):
    catalogue, schedule = hall.container.catalogue, hall.plan("")
    assert catalogue.save_schedule(replace(schedule, name="")).name == schedule.name == "Deliver on Hall"
    removed = {
        "schedule": catalogue.remove_schedule,
        "group": catalogue.remove_group,
        "mission": catalogue.remove_mission,
    }[goes]({"schedule": schedule.id, "group": hall.group.id, "mission": schedule.mission_id}[goes])
    assert set(removed.made_names) == {schedule.id}
    hall.add_mission("Collect empties")
    other = next(mission for mission in catalogue.missions() if mission.name == "Collect empties")
    catalogue.save_schedule(
        replace(schedule, id=0, group_id=None, robot_id=1, mission_id=other.id, name="Deliver on Hall")
    )
    catalogue.restore(removed)
    assert hall.container.repositories.schedules.get(hall.container.db.read(), schedule.id).name == "Deliver on Hall 2"


# ---------------------------------------------------------------------- on its way
@pytest.fixture
def held(hall, monkeypatch):
    """``act`` happens when the intent is on the disk, before the request leaves."""

    def before_the_post(act, **values):
        hall.plan("A", **({"start_window_minutes": 30} | values))
        bind = Ledger.bind

        def and_then(ledger, *args):
            rows = bind(ledger, *args)
            assert rows[0].state is State.SUBMITTING
            monkeypatch.setattr(Ledger, "bind", bind)
            act(rows[0])
            return rows

        monkeypatch.setattr(Ledger, "bind", and_then)
        hall.run(330)

    return before_the_post


@pytest.mark.parametrize("how", ["switched off", "left"])
def test_nothing_is_sent_to_a_robot_that_may_not_get_it_any_more(hall, held, how):
    gone = []

    def act(row):
        gone.append(row.robot)
        if how == "left":
            members = tuple(key for key in hall.group.members if key != row.robot_id)
            hall.container.catalogue.save_group(replace(hall.group, members=members))
        else:
            hall.switch(row.robot, on=False)

    held(act)
    assert hall.run_of().state is State.EXECUTING
    assert [post.robot for post in hall.network.posts() if post.robot == gone[0]] == []


def test_a_robot_that_is_deleted_loses_no_start_of_its_group(hall, held):
    held(lambda row: hall.container.catalogue.remove_robot(row.robot_id))
    assert hall.run_of().state is State.EXECUTING
    assert len(hall.network.posts()) == 1


# ---------------------------------------------------------------------- while it waits
def test_when_all_robots_are_switched_off_it_ends(hall):
    hall.plan("A", start_window_minutes=30)
    for name in hall.machines:
        hall.hold(name)
    hall.run(310)
    hall.only()
    hall.run(10)
    assert (hall.run_of().state, hall.run_of().reason.code) == (State.CANCELLED, ReasonCode.ROBOT_REMOVED)


def test_another_mission_is_tried_where_the_first_was_refused(hall):
    """On the only robot that is not held."""
    hall.add_mission("Home")
    hall.lose_mission("R1")
    schedule = hall.plan("A", start_window_minutes=30)
    hall.hold("R2"), hall.hold("R3")
    hall.run(320)
    assert hall.run_of().tried["1"]["is_for_good"]
    hall.container.catalogue.save_schedule(replace(schedule, mission_id=2))
    hall.run(20)
    assert (hall.run_of().mission, hall.run_of().robot) == ("Home", "R1")


def test_a_mission_that_gets_another_name_is_still_found(hall):
    hall.plan("A", start_window_minutes=30)
    for name in hall.machines:
        hall.hold(name)
    hall.run(310)
    mission = hall.container.catalogue.missions()[0]
    hall.container.catalogue.save_mission(replace(mission, name="Bring"))
    hall.container.holds.release(1)
    hall.run(20)
    assert (hall.run_of().mission, hall.run_of().robot) == ("Bring", "R1")


def test_the_last_refusal_is_why_it_fails_and_each_is_told(hall):
    """First the one that refuses the user, later the others, which have no such mission."""
    hall.lose_mission("R2"), hall.lose_mission("R3")
    hall.container.catalogue.save_mission(Mission("Deliver", "3d7c7c40-ce85-11ef-904a-000e8e9884ec", robot_id=1))
    hall.hold("R2"), hall.hold("R3")
    hall.plan("A", start_window_minutes=30)
    hall.run(320)
    [alarm] = hall.container.alarms.open()
    assert alarm_sentence(alarm).startswith(
        "R1 did not take Deliver, which is left to others of Hall: The robot has no mission Deliver"
    )
    hall.container.holds.release(2)
    hall.run(20)
    hall.container.holds.release(3)
    hall.run(20)
    assert (hall.run_of().state, hall.run_of().reason.details["robot"]) == (State.FAILED, "R3")


def test_a_last_call_comes_five_seconds_before_the_window_closes(hall):
    hall.plan("A", start_window_minutes=2)
    for name in hall.machines:
        for _n in range(30):
            hall.stranger_queues(robot=name)
    hall.run(430)
    run = hall.run_of()
    assert timedelta(seconds=4.5) < run.closes_at - run.submitted_at <= timedelta(seconds=5)


def test_a_robot_that_joins_is_read_as_often_as_the_others(hall):
    """Its connection is made anew while something waits for it."""
    hall.only("R1")
    hall.plan("A", start_window_minutes=30)
    hall.hold("R1")
    hall.run(310)
    hall.container.catalogue.save_robot(
        replace(hall.robot("R1"), certificate_sha256=None, username="admin"), password="admin"
    )
    hall.run(0.5)
    hall.container.holds.release(1)
    hall.run(4)
    assert hall.run_of().state is not State.WAITING


def test_a_robot_whose_clock_was_set_during_a_run_is_no_worse_than_the_others_that_day(hall):
    """It says that it ran for years. The other one is busy for a while."""
    hall.only("R1", "R2")
    hall.plan("A")
    hall.run_until(lambda: bool(hall.executions(State.EXECUTING)))
    ran = hall.run_of().robot
    (item,) = hall.machines[ran].queue
    item.started = "2016-11-23T06:05:00"
    hall.run(240)
    assert hall.run_of().duration_s > 9 * 365 * 86400
    for _n in range(5):
        hall.stranger_queues(robot={"R1": "R2", "R2": "R1"}[ran])
    hall.plan("B", at="2026-11-23T06:12")
    hall.run_until(lambda: f"{hall.clock.now():%H:%M:%S}" >= "06:12:20")
    assert (hall.run_of("B").state, hall.run_of("B").robot) == (State.EXECUTING, ran)


def test_what_waits_does_not_wake_everybody(hall):
    """No robot's worker is told, and nothing that was taken back is asked for, because a sentence changes."""
    seen = []
    hall.container.changes.subscribe(lambda topic, about: seen.append(about) if topic is Topic.EXECUTIONS else None)
    for name in hall.machines:
        hall.hold(name)
    for name in "ABCDE":
        hall.plan(name)
    before = hall.engine.plan_version
    hall.run(310)
    hall.engine.advance()
    assert {row.wait for row in hall.executions()} == {Wait.ROBOT}
    assert None not in seen
    assert hall.engine.plan_version <= before + 2


def test_a_start_in_doubt_is_not_told_as_one_that_waits(hall):
    hall.plan("A", start_window_minutes=30, overlap=Overlap.PARALLEL)
    for name in hall.machines:
        hall.network.next("POST", QUEUE, Fate.LOST, robot=name)
    hall.run(320)
    assert (hall.run_of().state, hall.run_of().robot != "") == (State.SUBMITTING, True)


# ---------------------------------------------------------------------- what is paused
@pytest.mark.parametrize("is_paused", [True, False])
def test_no_robot_is_kept_for_a_planned_start_that_is_paused(tmp_path, is_paused):
    hall = Hall(tmp_path, robots=1)
    own = hall.plan("own", at="2026-11-23T06:06", robot_id=hall.robot("R1").id, group_id=None, priority=2)
    if is_paused:
        hall.container.pausing.pause(own.id, hall.clock.now() + timedelta(hours=1))
    hall.plan("A")
    hall.run(320)
    assert hall.run_of().state is (State.EXECUTING if is_paused else State.WAITING)
    assert hall.run_of().wait_details.get("kept_for") == (None if is_paused else "Deliver")
    hall.switch_off()


# ---------------------------------------------------------------------- deleted, and put back
def test_a_run_now_of_a_group_that_is_deleted_and_put_back_waits_again(hall):
    """As its planned starts do."""
    for name in hall.machines:
        hall.hold(name)
    hall.run(30)
    hall.container.operator.run_on_any(hall.group.id, 1)
    hall.run(3)
    assert hall.container.catalogue.waiting_for(hall.group.id) == 1
    removed = hall.container.catalogue.remove_group(hall.group.id)
    hall.run(3)
    [row] = hall.executions()
    assert sentence(row.reason, row.timezone) == "The group Hall was removed"
    hall.container.catalogue.restore(removed)
    for hold in (1, 2, 3):
        hall.container.holds.release(hold)
    hall.run(20)
    assert hall.executions()[0].state is State.EXECUTING


def test_what_waits_for_the_only_robot_of_a_group_comes_back_with_it(hall):
    hall.only("R1")
    hall.hold("R1")
    hall.plan(start_window_minutes=60)
    hall.run(310)
    removed = hall.container.catalogue.remove_robot(1)
    hall.run(3)
    assert sentence(hall.run_of().reason, "UTC") == "No robot of Hall is switched on"
    hall.container.catalogue.restore(removed)
    hall.container.holds.release(1)
    hall.run(20)
    assert hall.run_of().state is State.EXECUTING


def test_a_start_of_a_group_with_no_robot_switched_on_says_so(hall):
    hall.plan()
    hall.only()
    hall.run(310)
    assert (hall.run_of().state, sentence(hall.run_of().reason, "UTC")) == (
        State.CANCELLED,
        "No robot of Hall is switched on",
    )


def test_what_a_robot_has_of_a_group_that_is_deleted_goes_on(hall):
    hall.container.operator.run_on_any(hall.group.id, 1)
    hall.run(5)
    assert hall.container.catalogue.waiting_for(hall.group.id) == 0
    hall.container.catalogue.remove_group(hall.group.id)
    hall.run_until(lambda: bool(hall.executions(State.COMPLETED)))
    assert len(hall.executions()) == 1
