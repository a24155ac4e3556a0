"""The alarms that the app would have of what a sample shows, so that its banner and its bell agree with its robots."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime

from app.domain.models import Alarm, Connection, Robot, RobotSnapshot
from app.domain.problems import in_words
from app.domain.robot import RobotState, RobotStatus
from app.screens.frame.facts import OpenIssues
from app.screens.home.facts import HomeFacts
from app.services.live.alarms import alarm_of
from tests.support.home_facts import ago

RAISED_MINUTES_AGO = {"emergency_stop": 2, "robot_error": 4, "question": 3}


def issues_of(facts: HomeFacts) -> OpenIssues:
    """With those of its robots that nobody has acknowledged, and its holds."""
    found = [alarm for robot in facts.robots if robot.enabled for alarm in _alarms(robot, facts.snapshots.get(robot.id))]
    return OpenIssues([replace(alarm, id=n) for n, alarm in enumerate(found, 1)], facts.holds)


def _alarms(robot: Robot, snapshot: RobotSnapshot | None) -> Iterator[Alarm]:
    """As app/services/dispatch/observation.py and live/questions.py raise them."""
    def raised(code: str, at: datetime, **details: object) -> Alarm:
        return alarm_of(code, f"robot:{robot.id}", at, {"robot": robot.name, **details})

    status = snapshot.status if snapshot else None
    if snapshot is None:
        return
    if snapshot.connection is Connection.UNREACHABLE:
        yield raised("unreachable", snapshot.since or ago(), problem=snapshot.problem)
    elif status is not None:
        for code, details in _conditions(status):
            yield raised(code, ago(minutes=RAISED_MINUTES_AGO[code]), **details)


def _conditions(status: RobotStatus) -> Iterator[tuple[str, dict[str, object]]]:
    if status.state is RobotState.EMERGENCY_STOP:
        yield "emergency_stop", {}
    if status.state is RobotState.ERROR:
        yield "robot_error", {"problem": in_words(status.errors)}
    if status.user_prompt is not None:
        yield "question", {"question": status.user_prompt.question, "answers": list(status.user_prompt.options)}


def conditions(issues: OpenIssues) -> set[tuple[str, str]]:
    """Codes and keys of the alarms that last, those of a robot among them."""
    return {(alarm.code, alarm.key) for alarm in issues.alarms if alarm.cleared_at is None}
