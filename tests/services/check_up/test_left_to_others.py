"""A trial and its clean-up leave things of others alone: holds, missions, robots, the data of another tablet."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.check_up import Level, Topic
from app.domain.execution import Execution, State
from app.domain.message import render
from app.domain.models import Mission
from app.mir.transport import Response
from mir_sim import MISSIONS, Request
from mir_sim.api import BASE
from mir_sim.exchange import exchange
from tests.support.check_up_site import CheckedRobot
from tests.support.findings import says, why_not_tried
from tests.support.recorded_robot import TOKEN

HOME = next(mission.guid for mission in MISSIONS if mission.name == "Home")
QUEUE = "/mission_queue"
FORBIDDEN = Response(403, b'{"error_human": "no"}', {})
WAITING = "Waiting until it is ready"


def queue_by_hand(robot: CheckedRobot) -> int:
    """On the robot's own page, by the app's user."""
    headers = {"content-type": "application/json", "accept-language": "en_US", "authorization": TOKEN.header}
    body = f'{{"mission_id": "{HOME}"}}'.encode()
    assert exchange(robot.machine, Request("POST", f"{BASE}{QUEUE}", {}, headers, body)).response.status == 201
    robot.machine.catch_up()
    return max(item.id for item in robot.machine.queue)


def once(says: str, work):
    """Called at the first such progress report."""
    done = []

    def on_progress(progress):
        if render(progress.says) == says and not done:
            done.append(True)
            work()

    return on_progress


def test_a_persons_hold_set_while_it_waits_stays(robot):
    clean = once(WAITING, lambda: robot.container.holds.hold("Cleaning", robot_id=robot.id))
    report = robot.trial(on_progress=clean)
    assert [hold.reason for hold in robot.container.holds.current()] == ["Cleaning"]
    assert robot.asked.writes == []
    assert why_not_tried(report) == "Not tried: Aino is on hold (Cleaning): check up when it is released"


def run_now(robot: CheckedRobot) -> Execution:
    mission = robot.container.catalogue.save_mission(Mission("Home", HOME))
    return robot.container.operator.run_now(robot.id, mission.id)


def test_a_start_that_is_on_its_way_is_not_taken_for_the_trials(robot):
    robot.leave(queued=HOME)
    row = run_now(robot)
    robot.container.db.write(lambda c: c.execute("UPDATE executions SET state = 'submitting' WHERE id = ?", (row.id,)))
    number = queue_by_hand(robot)  # its order has arrived, and the answer not yet
    assert robot.container.ledger.get(row.id).state is State.SUBMITTING
    assert robot.check_ups.put_back(robot.id) is None
    assert f"DELETE {QUEUE}/{number}" not in robot.asked.writes


def test_a_mission_queued_by_hand_during_it_is_not_cancelled(robot):
    made = []
    report = robot.trial(
        "Home",
        on_progress=once("Queueing missions", lambda: made.append(queue_by_hand(robot))),
        is_wanted=lambda: len(robot.asked.writes) < 4,
    )
    robot.machine.catch_up()
    [item] = [item for item in robot.machine.queue if item.id == made[0]]
    assert str(item.state) in ("Pending", "Executing", "Done")
    assert f"DELETE {QUEUE}/{made[0]}" not in robot.asked.writes
    assert not report.is_complete
    robot.check_nothing_is_left()


def test_changes_of_a_check_up_are_undone_by_the_next_with_a_mission(robot):
    hold = robot.container.holds.hold("Check-up", robot.asked.clock.now().replace(year=2027), robot.id)
    robot.leave(is_paused=True, queued=HOME, hold=hold.id)
    robot.machine.pause()
    assert robot.trial().is_complete
    robot.check_is_restored()


def test_nothing_is_undone_from_a_copy(robot):
    robot.leave(is_paused=True, queued=HOME)
    robot.machine.pause()
    robot.container.holds.is_copy = "this data was copied from another tablet"
    robot.clean_up()
    assert robot.check_ups.run(robot.id).is_complete
    assert (robot.asked.writes, robot.check_ups.left_behind()) == ([], [robot.id])


def test_another_machine_at_the_address_is_left_alone(robot):
    """Of a robot whose serial number the app never stored."""
    robot.container.db.write(lambda c: c.execute("UPDATE robots SET serial_number = NULL"))
    robot.leave(serial_number="of another", queue_floor=0, is_paused=True, queued=HOME)
    robot.machine.pause()
    assert robot.check_ups.put_back(robot.id) is None
    assert (robot.asked.writes, robot.check_ups.left_behind()) == ([], [])


@pytest.mark.parametrize("most", [1, 100], ids=["ended by a person", "to its end"])
def test_a_robot_that_does_not_let_the_mission_be_removed_is_released(robot, most):
    """It holds no start, and what people do with it until the mission can be removed stays so."""
    robot.asked.gives(FORBIDDEN, lambda method, path: method == "DELETE" and path.startswith("/missions/"))
    report = robot.trial(is_wanted=lambda: robot.asked.writes.count(f"POST {QUEUE}") < most)
    assert says(report, Topic.LEFT)[0] is Level.RED
    assert robot.check_ups.left_behind() == [robot.id]
    assert [alarm.code for alarm in robot.container.alarms.open()] == ["check_up_left"]
    assert (robot.machine.paused, robot.container.holds.current()) == (False, [])
    robot.asked.behave()
    robot.machine.pause()
    robot.container.holds.hold("Cleaning", robot_id=robot.id)
    assert robot.check_ups.put_back(robot.id) is None
    assert robot.machine.paused
    assert [hold.reason for hold in robot.container.holds.current()] == ["Cleaning"]


@pytest.mark.parametrize(
    "date", ["Fri, 31 Dec 9999 23:59:59 GMT", "Mon, 01 Jan 0001 00:00:00 GMT", "Fri, 31 Dec 9999 23:59:59 -2359"]
)
def test_a_clock_beyond_all_years_is_a_finding(robot, date):
    robot.asked.meddle = lambda method, path, answer: replace(answer, headers={**answer.headers, "Date": date})
    report = robot.check_ups.run(robot.id)
    assert report.is_complete
    assert [finding.level for finding in report.findings if finding.topic is Topic.CLOCK] != [Level.GREEN]
