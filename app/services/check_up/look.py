"""What every part of a check-up works with."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

from app.domain.check_up import Finding, Level, Progress, RobotProfile, Topic
from app.domain.message import Message
from app.mir.errors import RobotError
from app.mir.probe import Answer, Probe


class NotWanted(Exception):
    """Somebody has ended the check-up."""


@dataclass
class Look:
    """One check-up under way: what it asks, and what it has found so far.

    Attributes:
        now: the tablet's time, aware UTC. pause: lets so many seconds pass.
        zone: IANA name of the zone that the plan is in.
        is_wanted: whether the check-up is to go on; asked between questions.
        told: called with how far it is.
        same_machine: names of the other robots in the list that have this serial number.
        seen: fields of the robot's profile, by name.
        entries: the newest items of its queue when it was read, as they came.
    """

    probe: Probe
    zone: str = "UTC"
    now: Callable[[], datetime] = lambda: datetime.now(UTC)
    pause: Callable[[float], None] = time.sleep
    is_wanted: Callable[[], bool] = lambda: True
    told: Callable[[Progress], None] = lambda progress: None
    same_machine: Callable[[str], Sequence[str]] = lambda serial_number: ()
    findings: list[Finding] = field(default_factory=list)
    seen: dict[str, Any] = field(default_factory=dict)
    entries: Sequence[Mapping[str, Any]] = ()

    def green(self, topic: Topic, says: Message, means: Message = "") -> None:
        self._found(topic, Level.GREEN, says, means)

    def amber(self, topic: Topic, says: Message, means: Message) -> None:
        self._found(topic, Level.AMBER, says, means)

    def red(self, topic: Topic, says: Message, means: Message) -> None:
        self._found(topic, Level.RED, says, means)

    def _found(self, topic: Topic, level: Level, says: Message, means: Message) -> None:
        self.findings.append(Finding(topic, level, says, means))

    def check_is_wanted(self) -> None:
        """Raises NotWanted."""
        if not self.is_wanted():
            raise NotWanted

    def at(self, says: Message, done: float, of: float) -> None:
        """How far it is, in seconds. Raises NotWanted."""
        self.check_is_wanted()
        self.told(Progress(says, done, of))

    def profile(self, serial_number: str | None, software: str | None) -> RobotProfile:
        return RobotProfile(serial_number, software, **self.seen)


def why(answer: Answer | RobotError) -> Message:
    """The sentence of what went wrong."""
    error = answer.error if isinstance(answer, Answer) else answer
    return error.message if error is not None else ""
