"""Starts of groups in odd circumstances: a robot silent for a moment, a clock that is set, robots that forget."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Group, ReasonCode, State, Wait
from app.services.dispatch.timing import LOOKS_FOR
from tests.support.network import QUEUE, Fate
from tests.support.site import GUIDS


def test_one_lost_connection_does_not_end_a_start_that_has_to_be_finished_in_time(hall):
    """A start with a time to be done by is skipped in its first second, because the one free robot refused a connection once and the
    other one is busy for long; 2 s later the free one would have taken it, with half an hour to spare."""
    hall.only("R1", "R2")
    hall.run(5)
    for _ in range(9):
        hall.stranger_queues(robot="R2")
    hall.network.next("POST", QUEUE, Fate.REFUSED, robot="R1")
    hall.plan(start_window_minutes=30, finish_by_minutes=30)
    hall.run(330)
    row = hall.run_of()
    assert (row.state, row.reason) == (State.EXECUTING, None)
    assert row.robot == "R1"


def test_a_robot_that_was_silent_at_the_instant_may_still_do_it_in_time(hall):
    """The same where the free robot only missed one look: the start is given up although half an hour is left."""
    hall.only("R1", "R2")
    hall.run(5)
    for _ in range(9):
        hall.stranger_queues(robot="R2")
    hall.plan(start_window_minutes=30, finish_by_minutes=30)
    hall.run(290)
    hall.network.down.add("R1")
    hall.at(20, hall.network.down.clear)
    hall.run(60)
    assert hall.run_of().state is State.EXECUTING


def test_a_clock_that_is_set_back_bars_no_robot_for_that_long(hall):
    """Run now on a group, the first connection is refused, the tablet's clock is set back by an hour: the mission stays away for an hour
    though the robot is there and free."""
    hall.only("R1")
    hall.run(30)
    hall.network.next("POST", QUEUE, Fate.REFUSED, robot="R1")
    hall.container.operator.run_on_any(hall.group.id, 1)
    hall.run(1)
    hall.clock.step(-3600)
    hall.run(300)
    assert hall.executions()[0].state in (State.EXECUTING, State.COMPLETED)


@pytest.mark.parametrize("why", ["held", "battery"])
def test_a_start_of_one_robot_that_waits_for_something_else_keeps_it_from_no_group(hall, why):
    """A start planned on R1 is kept back by a person, or waits for a fuller battery: until its window closes, here 10 hours, R1 stands idle
    while starts of its group wait for a robot, and say that R1 is busy."""
    hall.only("R1")
    hall.plan(
        "F",
        robot_id=1,
        group_id=None,
        start_window_minutes=600,
        minimum_battery_percent=99 if why == "battery" else None,
    )
    if why == "held":
        hall.hold("R1")
    hall.run(310)
    if why == "held":
        hall.container.operator.hold_starts([hall.run_of("F").id])
        hall.container.holds.release(1)
    assert hall.run_of("F").state is State.WAITING
    hall.plan("G", at="2026-11-23T06:10", start_window_minutes=600)
    hall.run(600)
    assert hall.run_of("G").state in (State.EXECUTING, State.COMPLETED)


def begin_with_two_that_wait(hall):
    """G for a robot of the group, all of which are busy, F for a fuller battery."""
    hall.plan("G", start_window_minutes=60)
    hall.plan("F", robot_id=1, group_id=None, minimum_battery_percent=99, start_window_minutes=60)
    for name in hall.machines:
        for _ in range(9):
            hall.stranger_queues(robot=name)
    hall.run(330)


def test_what_waits_while_the_clock_can_not_be_right_says_so(hall):
    """A start of one robot, and one of a group, which does not go on saying what its robots did before."""
    begin_with_two_that_wait(hall)
    hall.clock.step(2400)
    hall.run(30)
    assert [hall.run_of(name).wait for name in "FG"] == [Wait.CLOCK, Wait.CLOCK]


def test_what_waited_is_there_again_once_a_clock_that_was_months_behind_is_set_right(hall):
    """By such a clock its instant is still to come."""
    begin_with_two_that_wait(hall)
    waited = [hall.run_of(name).token for name in "FG"]
    hall.clock.step(-200 * 86400)
    hall.run(30)
    assert hall.container.holds.active().clock
    hall.clock.step(200 * 86400)
    hall.run(30)
    assert [(hall.run_of(name).state, hall.run_of(name).token) for name in "FG"] == [
        (State.WAITING, token) for token in waited
    ]


def test_what_a_robot_that_forgets_tokens_may_have_is_given_to_no_other(hall):
    """Its queue can't prove that a request did not come, which here comes two minutes late."""
    hall.network.latest, hall.network.forgets_descriptions = 200.0, True
    hall.only("R1", "R2")
    hall.plan("before", at="2026-11-23T06:01")
    hall.run(200)
    robot = hall.run_of("before").robot
    hall.only(robot)
    hall.network.next("POST", QUEUE, Fate.LATE, 120.0, robot=robot)
    hall.plan(start_window_minutes=30)
    hall.run(110)
    for name in ("R1", "R2"):
        hall.switch(name, on=True)
    hall.run(1200)
    run = hall.run_of()
    assert (run.state, run.robot, run.reason.code) == (State.FAILED, robot, ReasonCode.UNKNOWN_OUTCOME)
    assert len(hall.items()) == 2
    assert "unknown_outcome" in hall.alarms()


# ---------------------------------------------------------------------- who is silent, and who lacks the mission
def told(row) -> list[dict]:
    return [*row.choice.get("robots", ()), *row.wait_details.get("robots", ())]


def test_robots_that_answer_are_read_before_one_is_chosen(hall):
    """Nobody has looked at them for a while when a person starts a mission."""
    hall.run(75)
    hall.container.operator.run_on_any(hall.group.id, 1)
    hall.run(1)
    [row] = hall.executions()
    assert row.state is not State.WAITING
    assert told(row) == [{"robot": row.robot}, *({"robot": name} for name in hall.machines if name != row.robot)]


def test_none_is_called_silent_while_it_answers(hall):
    """One takes 0.4 s to say how it is, and the others have done so long before."""
    hall.run(75)
    hall.network.next("GET", "/status", Fate.SLOW, 0.4, robot="R1")
    hall.container.operator.run_on_any(hall.group.id, 1)
    hall.run(2)
    [row] = hall.executions()
    assert row.state is not State.WAITING
    assert told(row) == [{"robot": row.robot}, *({"robot": name} for name in hall.machines if name != row.robot)]


def test_one_that_hangs_is_not_waited_for_for_long(hall):
    hall.run(75)
    hall.network.next("GET", "*", Fate.SLOW, 8.0, robot="R1")
    hall.container.operator.run_on_any(hall.group.id, 1)
    hall.run(1)
    assert hall.executions()[0].state is not State.WAITING


def test_one_of_another_group_that_hangs_is_not_waited_for_at_all(hall):
    one, *others = (robot.id for robot in hall.container.catalogue.robots())
    hall.container.catalogue.edit(lambda edit: edit.save_group(replace(hall.group, members=tuple(others))))
    another = hall.container.catalogue.edit(lambda edit: edit.save_group(Group("Yard", (one,))))
    hall.plan("A")
    hall.plan("B", group_id=another.id)
    hall.run(298)
    hall.network.next("GET", "*", Fate.SLOW, 8.0, robot="R1")
    hall.run(15)
    posted = {one.robot: one.at - 300 for one in hall.network.posts()}
    assert posted.pop("R1") > 5
    assert [at < LOOKS_FOR / 2 for at in posted.values()] == [True]


def test_none_is_called_silent_between_two_reads(hall):
    for name in hall.machines:
        for _ in range(9):
            hall.stranger_queues(robot=name)
    hall.plan()
    hall.run(303)
    for _ in range(60):
        hall.run(0.5)
        assert "out" not in [key for each in told(hall.run_of()) for key in each]


@pytest.fixture
def lost(hall):
    """R1 has lost the mission, as its list says."""

    def lose(*names):
        for name in names:
            hall.lose_mission(name)
        for name in hall.machines:
            hall.container.robot_missions.learn_names(hall.robot(name).id)

    return lose


def test_a_robot_that_is_known_to_lack_the_mission_is_passed_by_without_an_alarm(hall, lost):
    lost("R1", "R2")
    for _ in range(9):
        hall.stranger_queues(robot="R3")
    hall.plan()
    hall.run(320)
    row = hall.run_of()
    assert [(each["robot"], each.get("out")) for each in told(row)] == [
        ("R3", None),
        ("R1", "lacks_mission"),
        ("R2", "lacks_mission"),
    ]
    assert hall.alarms() == []


def test_where_none_would_be_left_they_are_asked_all_the_same(hall, lost):
    """A list may be an hour old."""
    lost(*hall.machines)
    hall.plan()
    hall.run(320)
    assert hall.run_of().reason.code is ReasonCode.UNKNOWN_MISSION


def test_a_list_that_is_old_excludes_nobody(hall, lost):
    lost("R1")
    hall.only("R1")
    hall.switch("R2", on=True)
    hall.network.down.add("R2")
    hall.run(3700)
    hall.plan(at="2026-11-23T07:05")
    hall.run(220)
    assert str(hall.robot("R1").id) in hall.run_of().tried


def test_a_list_that_is_old_keeps_the_only_robot_that_could_from_no_start(hall, lost):
    """The mission has been put there since the list was read; the others are held."""
    lost("R1")
    hall.machines["R1"].site.table("/missions").add({"guid": GUIDS["Deliver"], "name": "Deliver"})
    hall.hold("R2")
    hall.hold("R3")
    hall.plan()
    hall.run(320)
    assert (hall.run_of().state, hall.run_of().robot) == (State.EXECUTING, "R1")
