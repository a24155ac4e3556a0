"""The common data of a check-up: the robot, and the findings so far."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from app.domain.check_up import Finding, Level, Progress, Topic
from app.domain.clock import Clock
from app.domain.message import Message, message
from app.domain.models import Robot
from app.domain.robot import Identity, RobotStatus
from app.mir import parse
from app.mir.errors import RobotError
from app.mir.raw_client import RawClient

Found = tuple[Level, Message, Message]  # a finding without its topic


class Cancelled(Exception):
    """A person has ended the check-up."""


@dataclass
class CheckUpSession:
    """One check-up under way: its questions, and its findings so far.

    Attributes: zone: IANA name of the zone that the plan is in. is_wanted: whether to continue; called between
    questions. on_progress: called with the progress. length_s: approximate length of the whole check-up. other_robots:
    the rest of the list. facts: fields of the robot's profile, by name. identity: of the answering machine; until
    known, the stored one. entries: the newest items of its queue, raw; [] if they can't be read. newest_id: the highest
    number in it; 0: it is empty, None: it could not be read.
    """

    robot: RawClient
    clock: Clock
    zone: str
    is_wanted: Callable[[], bool] = lambda: True
    on_progress: Callable[[Progress], None] = lambda progress: None
    length_s: float = math.inf
    other_robots: Sequence[Robot] = ()
    findings: list[Finding] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)
    identity: Identity = field(default_factory=lambda: Identity(RobotStatus()))
    entries: Sequence[parse.Object] = ()
    newest_id: int | None = None

    def identify(self) -> Identity:
        """Raises RobotError."""
        self.identity = self.robot.client.identify()
        return self.identity

    def add(self, topic: Topic, found: Found | None) -> None:
        if found is not None:
            self.findings.append(Finding(topic, *found))

    def status(self) -> RobotStatus | None:
        """Without a pause before it. None: it does not answer."""
        try:
            return self.robot.client.status()
        except RobotError:
            return None

    def check_is_wanted(self) -> None:
        """Raises Cancelled."""
        if not self.is_wanted():
            raise Cancelled

    def at(self, says: Message, done_s: float) -> None:
        """How far it is. Raises Cancelled."""
        self.check_is_wanted()
        self.on_progress(Progress(says, min(done_s, self.length_s), self.length_s))


def _found(level: Level, says: Message, means: Message = "", **values: object) -> Found:
    """``says``, ``means``: English texts with placeholders for ``values``, or whole messages."""

    def sentence(text: Message) -> Message:
        return message(text, **values) if isinstance(text, str) and text else text

    return level, sentence(says), sentence(means)


green, amber, red = partial(_found, Level.GREEN), partial(_found, Level.AMBER), partial(_found, Level.RED)
