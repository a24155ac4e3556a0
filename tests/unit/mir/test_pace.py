"""A robot that allows few requests is asked less often; commands of a person are sent at once."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from responses import RequestsMock

from app.domain.check_up import Rest
from app.domain.robot import RobotState
from app.mir.client import RobotClient
from app.mir.transport import OF_ALL, Pace
from tests.support.clock import VirtualClock
from tests.unit.mir.answers import STATUS

API = "http://robot.test/api/v2.0.0"
ORDERS: dict[str, Callable[[RobotClient], object]] = {
    "pause": lambda robot: robot.set_state(RobotState.PAUSE),
    "resume": lambda robot: robot.set_state(RobotState.READY),
    "reset errors": lambda robot: robot.clear_error(),
    "answer": lambda robot: robot.answer_prompt("guid", "Yes"),
    "cancel": lambda robot: robot.cancel(7),
    "clear": lambda robot: robot.clear_queue(),
}


@pytest.fixture
def clock(robot: RobotClient, responses: RequestsMock) -> VirtualClock:
    """The clock of a robot that allows one request in 10 s and just had one."""
    clock = VirtualClock()
    robot.pace, robot.serial_number = Pace(clock.monotonic, clock.sleep), STATUS["serial_number"]
    robot.pace.rest = Rest(1, 10.0)
    robot.pace.wait(OF_ALL)
    responses.assert_all_requests_are_fired = False
    for add in (responses.get, responses.put):
        add(f"{API}/status", json=STATUS)
    responses.delete(f"{API}/mission_queue", status=204)
    responses.delete(f"{API}/mission_queue/7", status=204)
    return clock


@pytest.mark.parametrize("name", ORDERS)
def test_commands_of_a_person_do_not_wait(robot: RobotClient, clock: VirtualClock, name: str) -> None:
    """The serial number is compared first, which takes a request more."""
    ORDERS[name](robot)
    assert clock.elapsed() == 0.0


def test_commands_of_a_person_count(robot: RobotClient, clock: VirtualClock) -> None:
    robot.set_state(RobotState.PAUSE)
    clock.advance(9.0)
    robot.set_state(RobotState.READY)
    robot.status()
    assert clock.elapsed() == pytest.approx(19.0, abs=0.1)
