"""What a person does about a start of a group: give it to a robot, or run its mission on another one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.choice import chosen, earlier_robots, stuck, stuck_since
from app.domain.models import Group, InvalidInput, Place, ReasonCode, State, Wait
from tests.support.groups import Hall
from tests.support.network import QUEUE, Fate


@pytest.fixture
def hall(tmp_path):
    hall = Hall(tmp_path)
    hall.add_mission("Home")
    yield hall
    hall.switch_off()


@pytest.fixture
def operator(hall):
    return hall.container.operator


def all_busy(hall):
    for name in hall.machines:
        for _n in range(5):
            hall.stranger_queues(robot=name)


def waiting(hall, **values):
    all_busy(hall)
    hall.plan("A", **({"start_window_minutes": 30} | values))
    hall.run(310)
    return hall.run_of()


def stuck_start(hall):
    hall.plan("A", start_window_minutes=3)
    for name in hall.machines:
        hall.network.next("POST", QUEUE, Fate.LOST, robot=name)
    hall.run(301)
    hall.network.planned.clear()
    hall.network.down |= {hall.run_of().robot}
    hall.run(60)
    return hall.run_of()


# ---------------------------------------------------------------------- give to
def test_a_start_that_waits_goes_into_the_queue_of_the_robot_that_a_person_chooses(hall, operator):
    row = waiting(hall)
    operator.assign_robot(row.id, hall.robot("R3").id)
    hall.run(5)
    run = hall.run_of()
    assert (run.state, run.robot, chosen(run.choice, "UTC")) == (State.QUEUED, "R3", "R3: chosen by a person")


def test_a_start_that_a_person_puts_before_others_gets_the_first_robot_that_is_free(hall, operator):
    all_busy(hall)
    hall.plan("A", start_window_minutes=30)
    hall.plan("B", start_window_minutes=30)
    hall.run(310)
    later = max(hall.run_of("A"), hall.run_of("B"), key=lambda row: row.id)
    assert operator.prioritise(later.id, 1).priority == 1
    hall.machines["R1"].cancel_all()
    hall.run(5)
    assert [(row.id == later.id) for row in hall.executions() if row.robot] == [True]
    with pytest.raises(InvalidInput, match="does not wait"):
        operator.prioritise(later.id, 0)


@pytest.mark.parametrize("trouble", ["paused", "low"])
def test_the_robot_that_a_person_chose_gets_it_as_a_start_of_its_own(hall, operator, trouble):
    """A paused one keeps it in its queue; for its battery it waits there."""
    row = waiting(hall, minimum_battery_percent=30)
    machine = hall.machines["R3"]
    machine.set_battery(80.0 if trouble == "paused" else 10.0)
    if trouble == "paused":
        machine.pause()
    hall.run(10)
    operator.assign_robot(row.id, hall.robot("R3").id)
    hall.run(30)
    run = hall.run_of()
    assert (run.robot, run.state) == ("R3", State.QUEUED if trouble == "paused" else State.WAITING)
    assert run.state is State.QUEUED or run.wait is Wait.BATTERY


def test_it_is_given_once(hall, operator):
    row = waiting(hall)
    operator.assign_robot(row.id, 1)
    with pytest.raises(InvalidInput, match="does not wait for a robot any more"):
        operator.assign_robot(row.id, 2)
    hall.run(600)
    assert sum(item.description == row.token for item in hall.items()) == 1


@pytest.mark.parametrize(
    ("prepare", "problem"),
    [
        (lambda hall: hall.hold("R3"), "R3 is held back"),
        (lambda hall: hall.switch("R3", on=False), "R3 is switched off"),
        (
            lambda hall: hall.container.catalogue.save_group(Group("Hall", (1, 2), id=hall.group.id)),
            "R3 is no robot of Hall",
        ),
        (lambda hall: hall.container.operator.hold_starts([hall.run_of().id]), "does not wait for a robot any more"),
    ],
)
def test_what_can_not_be_given_is_refused(hall, operator, prepare, problem):
    row = waiting(hall)
    prepare(hall)
    with pytest.raises(InvalidInput, match=problem):
        operator.assign_robot(row.id, 3)


def test_nor_while_its_place_is_full(hall, operator):
    hall.container.catalogue.edit(lambda edit: edit.save_place(Place("Dock 2", 1, (1,))))
    hall.plan("B", start_window_minutes=30)
    hall.run(310)
    hall.plan("A", at="2026-11-23T06:06", start_window_minutes=30)
    hall.run(60)
    with pytest.raises(InvalidInput, match="Dock 2 is full: "):
        operator.assign_robot(hall.run_of().id, 3)


# ---------------------------------------------------------------------- start on another robot
def test_a_start_that_is_stuck_says_so_and_nobody_else_gets_it(hall):
    row = stuck_start(hall)
    since = stuck_since(row, hall.container.snapshots.get(row.robot_id))
    assert stuck(row.robot, since, "UTC") == f"{row.robot} may have it: silent since 06:05, nobody else gets it"
    hall.run(600)
    assert (hall.run_of().state, hall.run_of().reason.code) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME)
    assert len(hall.network.posts()) == 1


@pytest.mark.parametrize("minutes", [0, 10])
@pytest.mark.parametrize("name", [None, "R3"])
def test_its_mission_is_run_on_another_robot_as_a_start_of_its_own(hall, operator, minutes, name):
    row = stuck_start(hall)
    hall.run(60 * minutes)
    other = operator.start_on_another(row.id, name and hall.robot(name).id)
    hall.kick()
    hall.run(30)
    run = hall.container.ledger.get(other.id)
    assert (run.state, run.token != row.token, run.robot != row.robot) == (State.EXECUTING, True, True)
    assert name in (None, run.robot)


def test_what_is_known_is_not_started_again(hall, operator):
    hall.plan("A")
    hall.run(310)
    with pytest.raises(InvalidInput, match="known by now"):
        operator.start_on_another(hall.run_of().id)


def test_the_same_robot_is_no_other_one(hall, operator):
    row = stuck_start(hall)
    with pytest.raises(InvalidInput, match="choose another robot"):
        operator.start_on_another(row.id, row.robot_id)


# ---------------------------------------------------------------------- told
def test_a_start_that_moved_on_says_from_where(hall):
    hall.plan("A")
    hall.run(299.9)
    hall.network.next("POST", QUEUE, Fate.REFUSED, robot="R1")
    hall.run(30)
    run = hall.run_of()
    assert run.robot == "R2"
    assert earlier_robots(run.tried, run.robot).endswith("; given to R2")
    assert earlier_robots(run.tried, run.robot).startswith("R1: r1 refused the connection")


def given(hall, operator):
    """To R3, whose battery is too low, by a person."""
    row = waiting(hall, minimum_battery_percent=30)
    hall.machines["R3"].set_battery(10.0)
    hall.run(10)
    operator.assign_robot(row.id, hall.robot("R3").id)
    hall.run(10)
    return hall.run_of()


def comes_and_goes(hall):
    hall.hold("R3")
    hall.run(5)
    hall.container.holds.release(hall.robot("R3").id)


def power_cut(hall):
    hall.power_cut(5.0)


def edited(hall):
    hall.container.catalogue.save_robot(replace(hall.robot("R3"), username="admin"), password="admin")


@pytest.mark.parametrize("happens", [comes_and_goes, power_cut, edited])
def test_the_robot_that_a_person_chose_stays_the_one(hall, operator, happens):
    assert given(hall, operator).robot == "R3"
    happens(hall)
    hall.run(20)
    run = hall.run_of()
    assert (run.robot, run.wait, run.choice["by"]) == ("R3", Wait.BATTERY, "person")


def switched_off(hall):
    hall.switch("R3", on=False)


def removed_from_the_group(hall):
    group = hall.container.catalogue.edit(lambda edit: edit.the_group(hall.group.id))
    members = tuple(each for each in group.members if each != hall.robot("R3").id)
    hall.container.catalogue.edit(lambda edit: edit.save_group(replace(group, members=members)))


@pytest.mark.parametrize("happens", [switched_off, removed_from_the_group])
def test_unless_it_can_have_none_any_more(hall, operator, happens):
    given(hall, operator)
    happens(hall)
    hall.run(20)
    assert (hall.run_of().robot, hall.run_of().choice) == ("", {})
