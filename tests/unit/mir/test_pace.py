"""A robot that allows few requests is asked less often; commands of a person are sent at once."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from responses import RequestsMock

from app.domain.check_up import Rest
from app.domain.robot import RobotState
from app.mir.client import RobotClient
from app.mir.transport import OF_ALL, Pace
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


class Clock:
    """``waited``: seconds in all."""

    def __init__(self) -> None:
        self.now = self.waited = 0.0

    def __call__(self) -> float:
        return self.now

    def wait(self, seconds: float) -> None:
        self.now += seconds
        self.waited += seconds


@pytest.fixture
def clock(robot: RobotClient, responses: RequestsMock) -> Clock:
    """The clock of a robot that allows one request in 10 s and just had one."""
    clock = Clock()
    robot.pace, robot.serial_number = Pace(clock, clock.wait), STATUS["serial_number"]
    robot.pace.rest = Rest(1, 10.0)
    robot.pace.wait(OF_ALL)
    responses.assert_all_requests_are_fired = False
    for add in (responses.get, responses.put):
        add(f"{API}/status", json=STATUS)
    responses.delete(f"{API}/mission_queue", status=204)
    responses.delete(f"{API}/mission_queue/7", status=204)
    return clock


@pytest.mark.parametrize("name", ORDERS)
def test_commands_of_a_person_do_not_wait(robot: RobotClient, clock: Clock, name: str) -> None:
    """The serial number is compared first, which takes a request more."""
    ORDERS[name](robot)
    assert clock.waited == 0.0


def test_commands_of_a_person_count(robot: RobotClient, clock: Clock) -> None:
    robot.set_state(RobotState.PAUSE)
    clock.now += 9.0
    robot.set_state(RobotState.READY)
    robot.status()
    assert clock.now == pytest.approx(19.0, abs=0.1)
