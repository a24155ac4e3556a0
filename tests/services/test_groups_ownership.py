"""A start of a group goes out through the worker that it was given to, at once, or another robot gets it: whatever happens in between."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import State
from app.services.dispatch import messages
from app.services.dispatch.timing import INTENT_LEAD, LIVE_EVERY
from tests.support.groups import Hall
from tests.support.network import QUEUE, Fate

DUE = 300.0
SLOW = 8.0  # s that a robot takes for an answer


@pytest.fixture
def hall(tmp_path):
    hall = Hall(tmp_path, robots=1)
    yield hall
    hall.switch_off()


def came_up(hall, when) -> list[str]:
    """What reaches the robot's worker from the moment in which this ``when`` holds of its message."""
    seen, post = [], hall.post

    def posted(robot_id, message):
        post(robot_id, message)
        if seen or when(message):
            seen.append(type(message).__name__)

    hall.post = posted
    return seen


@pytest.mark.parametrize("keeps_waiting", [False, True])
def test_a_robot_whose_connection_is_edited_while_a_start_is_on_its_way_gets_it(hall, keeps_waiting):
    """Its worker waits for a slow answer when the start comes; a new one takes its place."""
    robot = hall.robot("R1")
    hall.plan("A", start_window_minutes=30)
    hall.run(DUE - 0.5)
    hall.network.next("GET", QUEUE, Fate.SLOW, SLOW, robot="R1")
    hall.at(0.45 - INTENT_LEAD, lambda: hall.post(robot.id, messages.Poll()))
    hall.at(
        1.5, lambda: hall.container.catalogue.save_robot(replace(hall.robot("R1"), username="admin"), password="admin")
    )
    if keeps_waiting:
        hall.at(2.0, lambda: hall.hold("R1"))
        hall.at(40.0, lambda: hall.container.holds.release(robot.id))
    hall.run(60.0)
    run = hall.run_of()
    assert (run.state, run.attempts) == (State.EXECUTING, 1)
    assert [item.description for item in hall.items()] == [run.token]


def test_a_new_worker_of_a_robot_begins_when_the_one_before_has_ended(hall):
    """Two could have the same start in hand."""
    asked: list[float] = []
    hall.run(DUE)
    hall.network.interrupt = lambda where: asked.append(hall.seconds() - DUE)
    hall.network.next("GET", QUEUE, Fate.SLOW, SLOW, robot="R1")
    hall.post(hall.robot("R1").id, messages.Poll())
    hall.at(
        1.0, lambda: hall.container.catalogue.save_robot(replace(hall.robot("R1"), username="admin"), password="admin")
    )
    hall.run(SLOW + 2.0)
    assert [at for at in asked if 1.0 < at < SLOW] == []
    assert [at for at in asked if at > SLOW]


def test_an_old_row_that_is_begun_after_a_failure_of_the_database_is_not_taken_for_a_lost_one(hall):
    hall.hold("R1")
    hall.plan("A")
    hall.run(DUE + 5.0)
    hall.post(robot_id := hall.robot("R1").id, hall._workers[robot_id].expect_recovery())
    hall.container.holds.release(robot_id)
    hall.run(3.0)
    assert (hall.run_of().state, hall.run_of().attempts) == (State.EXECUTING, 1)


def test_its_worker_has_a_start_before_it_hears_of_any_change(hall):
    """Else it would begin to read the robot first, and the start would wait for that."""
    hall.plan("A")
    hall.run(DUE - INTENT_LEAD - 0.01)
    posted = came_up(hall, lambda message: isinstance(message, messages.Start | messages.LedgerChanged))
    hall.run(0.5)
    assert posted[0] == "Start"


def test_a_robot_that_is_about_to_get_a_start_is_not_read_for_another_that_waits(hall):
    """Hundreds of such reads at once would delay what goes out at that instant."""
    hall.plan("A")
    hall.plan("B")
    hall.run(DUE - INTENT_LEAD - 0.01)
    asked: list[str] = []
    hall.network.interrupt = asked.append
    hall.run(INTENT_LEAD)
    assert sorted(run.state for run in hall.executions()) == [State.SUBMITTING, State.WAITING]
    assert asked == []
    hall.run(0.1)
    assert asked[0] == "before POST /mission_queue"
    hall.run(3 * LIVE_EVERY)
    assert "before GET /status" in asked


def two(tmp_path) -> Hall:
    hall = Hall(tmp_path, robots=2)
    hall.plan("A", minimum_battery_percent=30)
    hall.run(DUE - INTENT_LEAD - 0.01)
    return hall


def stops(hall, name):
    hall.machines[name].press_emergency_stop(True)


def runs_low(hall, name):
    hall.machines[name].set_battery(10.0)


@pytest.mark.parametrize("happens", [stops, runs_low])
def test_a_robot_that_turns_out_unfit_between_choice_and_start_is_not_sent_it(tmp_path, happens):
    """Its worker has read it in between."""
    hall, chosen = two(tmp_path), []

    def posted(robot_id, message):
        if isinstance(message, messages.Start) and not chosen:
            chosen.append(hall.container.catalogue.robot(robot_id).name)
            happens(hall, chosen[0])
            post(robot_id, messages.Poll())
            hall._go_on(robot_id)
        post(robot_id, message)

    post, hall.post = hall.post, posted
    hall.run(20.0)
    run = hall.run_of()
    assert run.state is State.EXECUTING
    assert [run.robot] != chosen
    assert len(hall.items()) == 1
    hall.switch_off()
