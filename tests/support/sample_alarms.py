"""The alarms that the app would have of what a sample shows, so that its banner and its bell agree with its robots."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from app.domain.capabilities import OF_A_ROBOT
from app.domain.models import Alarm, Connection, Robot
from app.domain.robot import RobotStatus
from app.mir.errors import RobotError, Unreachable
from app.screens.frame.facts import OpenIssues
from app.screens.home.facts import HomeFacts
from app.services.dispatch.observation import Observation
from app.services.live.alarms import Prompts, alarm_of
from app.services.live.changes import Changes
from app.services.live.snapshots import Snapshots
from tests.support.clock import VirtualClock
from tests.support.home_facts import ago

RAISED_MINUTES_AGO = {"emergency_stop": 2, "robot_error": 4, "question": 3}


class Raised:
    """Takes alarms of robots, as of when the sample has them."""

    def __init__(self, facts: HomeFacts) -> None:
        self._facts = facts
        self.alarms: list[Alarm] = []

    def raise_about_robot(self, code: str, robot: Robot, **details: Any) -> None:
        minutes, since = RAISED_MINUTES_AGO.get(code), self._facts.snapshots[robot.id].since
        at = ago(minutes=minutes) if minutes is not None else since or ago()
        self.alarms.append(alarm_of(code, f"robot:{robot.id}", at, {"robot": robot.name, **details}))

    def clear(self, code: str, key: str) -> None:
        self.alarms = [alarm for alarm in self.alarms if (alarm.code, alarm.key) != (code, key)]


def issues_of(facts: HomeFacts) -> OpenIssues:
    """With the unacknowledged alarms of its robots and with its holds."""
    raised, changes, robots = Raised(facts), Changes(), {robot.id: robot for robot in facts.robots}
    snapshots = Snapshots(changes)
    Prompts(snapshots, raised, changes, robots.get)
    shared: Any = SimpleNamespace(
        clock=VirtualClock(ago()),
        snapshots=snapshots,
        alarms=raised,
        settings=lambda: facts.settings,
        tablet=SimpleNamespace(has_no_network=False),
    )
    for robot in facts.robots:
        snapshot = facts.snapshots.get(robot.id)
        if robot.enabled and snapshot is not None and snapshot.status is not None:
            _observe(robot, snapshot.connection, snapshot.status, shared)
    return OpenIssues([replace(alarm, id=n) for n, alarm in enumerate(raised.alarms, 1)], facts.holds)


def _observe(robot: Robot, connection: Connection, status: RobotStatus, shared: Any) -> None:
    """Twice: once is not enough for "no answer"."""

    def answer() -> RobotStatus:
        if connection is Connection.UNREACHABLE:
            raise Unreachable(code="no_answer", address=robot.address.removeprefix("http://"))
        return status

    client: Any = SimpleNamespace(status=answer, capabilities=OF_A_ROBOT)
    observation = Observation(robot, client, shared)
    for _poll in range(2):
        with suppress(RobotError):
            observation.read_status()
