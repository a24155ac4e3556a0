"""What tests of credentials share: robots that write down what they are sent, a tablet, and what people do at it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from app.container import Container
from app.domain.models import Connection, Mission, Robot
from app.mir.credentials import Token
from app.mir.errors import (
    RobotError,
)
from app.services.dispatch import messages
from app.services.dispatch.worker import RobotWorker
from tests.hostile.capture import Capture
from tests.support.edits import import_file
from tests.unit.mir.answers import MISSION

USER, PASSWORD = "scheduler", "a secret"

TOKEN = Token.derive(USER, PASSWORD).header
Listen = Callable[..., Capture]


def add(container: Container, address: str, **values: Any) -> Robot:
    return container.catalogue.save_robot(Robot("Aino", address, USER, **values), PASSWORD)


def stored(container: Container) -> Robot:
    (robot,) = container.catalogue.robots()
    return robot


def look(worker: RobotWorker) -> None:
    worker.handle(messages.Poll())
    worker.advance()


def poll(container: Container, rounds: int = 2) -> None:
    """As the robot's worker does after a restart."""
    worker = container.make_worker(stored(container))
    for _ in range(rounds):
        look(worker)
    worker.close()


def connection(container: Container) -> Connection:
    return container.snapshots.get(stored(container).id).connection


def import_robot(container: Container, **keys: Any) -> list[Any]:
    return import_file(container.catalogue, robots=[{"name": "Aino", **keys}])


def assert_needs_password(container: Container) -> None:
    robot = stored(container)
    assert (robot.token, robot.needs_password, robot.enabled) == (None, True, False)


def everything_an_operator_asks_for(container: Container, robot: Robot) -> None:
    operator = container.operator
    for ask in (
        lambda: operator.pause(robot.id),
        lambda: operator.resume(robot.id),
        lambda: operator.reset_errors(robot.id),
        lambda: operator.answer_prompt(robot.id, "guid", "Yes"),
        lambda: operator.clear_queue(robot.id),
        lambda: operator.cancel_item(robot.id, 7),
        lambda: operator.fetch_missions(robot.id),
        lambda: operator.test_connection(robot),
        lambda: container.robot_missions.parameters(robot.id, MISSION),
    ):
        with pytest.raises(RobotError):
            ask()
    container.robot_missions.learn_names(robot.id)
    container.maps.learn(robot.id, "a map")


def run_now(container: Container) -> Any:
    robot, mission = stored(container), container.catalogue.save_mission(Mission("Deliver", MISSION))
    row = container.operator.run_now(robot.id, mission.id)
    poll(container)
    return container.ledger.get(row.id)
