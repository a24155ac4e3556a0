"""Prompts of robots that wait for a person: an alarm each, until it is answered or the robot drops it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from app.database.errors import DatabaseError
from app.domain.models import Robot
from app.domain.robot import UserPrompt
from app.services.live.alarms import Alarms
from app.services.live.changes import Changes, Topic
from app.services.live.snapshots import Snapshots

CODE = "question"


class Prompts:
    """Works on the thread of the robot's worker, which publishes its snapshots and raises its other alarms."""

    def __init__(
        self, snapshots: Snapshots, alarms: Alarms, changes: Changes, robot: Callable[[int], Robot | None]
    ) -> None:
        self._snapshots, self._alarms, self._robot = snapshots, alarms, robot
        self._prompts: dict[
            int, UserPrompt | None
        ] = {}  # of robots that have been read since the start; None: no question
        changes.subscribe(self._on_change)

    def answered(self, robot_id: int, guid: str, answer: str) -> None:
        """The robot has taken an answer from here."""
        with suppress(DatabaseError):
            self._alarms.note_answer(f"robot:{robot_id}", guid, answer)

    def _on_change(self, topic: Topic, about: int | None) -> None:
        if topic is Topic.SNAPSHOT and about is not None:
            with suppress(DatabaseError):  # has its own alarm; the next snapshot is looked at again
                self._check(about)

    def _check(self, robot_id: int) -> None:
        status = self._snapshots.get(robot_id).status
        if status is None:  # removed or switched off, with its alarms; or not read yet
            self._prompts.pop(robot_id, None)
            return
        prompt = status.user_prompt
        if robot_id in self._prompts and self._prompts[robot_id] == prompt:
            return
        before = self._prompts.get(robot_id)
        if prompt is None or (before is not None and before.guid != prompt.guid):
            self._alarms.clear(CODE, f"robot:{robot_id}")
        if prompt is not None and (robot := self._robot(robot_id)) is not None:
            self._alarms.raise_about_robot(
                CODE, robot, question=prompt.question, answers=list(prompt.options), guid=prompt.guid
            )
        self._prompts[robot_id] = prompt
