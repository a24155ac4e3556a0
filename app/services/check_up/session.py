"""What every part of a check-up works with: the robot, and what was found of it so far."""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Concatenate, ParamSpec

from app.domain.check_up import Finding, Level, Progress, RobotProfile, Topic
from app.domain.message import Message, message
from app.domain.robot import Identity, RobotStatus
from app.mir.errors import RobotError
from app.mir.raw_client import Answer, RawClient

P = ParamSpec("P")
Found = tuple[Level, Message, Message]  # a finding without its topic


class Cancelled(Exception):
    """A person has ended the check-up."""


@dataclass
class CheckUpSession:
    """One check-up under way: what it asks, and what it has found so far.

    Attributes:
        now: the tablet's time, aware UTC. pause: lets so many seconds pass.
        zone: IANA name of the zone that the plan is in.
        is_wanted: whether the check-up is to go on; asked between questions.
        on_progress: called with how far it is.
        length_s: of the whole check-up, about.
        same_machine: names of the other robots in the list that have this serial number.
        facts: fields of the robot's profile, by name.
        identity: who answers; until that is known, who it was before.
        entries: the newest items of its queue when it was read, as they came; [] where they can't be read. newest_id: the highest number
            in it; 0: it is empty, None: it could not be read.
    """

    robot: RawClient
    zone: str = "UTC"
    now: Callable[[], datetime] = lambda: datetime.now(UTC)
    pause: Callable[[float], None] = time.sleep
    is_wanted: Callable[[], bool] = lambda: True
    on_progress: Callable[[Progress], None] = lambda progress: None
    length_s: float = math.inf
    same_machine: Callable[[str], Sequence[str]] = lambda serial_number: ()
    findings: list[Finding] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)
    identity: Identity = field(default_factory=lambda: Identity(RobotStatus()))
    entries: Sequence[Mapping[str, Any]] = ()
    newest_id: int | None = None
    answers: dict[str, Answer] = field(default_factory=dict)

    def once(self, path: str) -> Answer:
        """Asked for the first time, then as it was answered."""
        return self.answers.get(path) or self.answers.setdefault(path, self.robot.get(path))

    def add(self, topic: Topic, found: Found | None) -> None:
        if found is not None:
            self.findings.append(Finding(topic, *found))

    def status(self) -> RobotStatus | None:
        """Without a pause before it. None: it does not answer."""
        try:
            return self.robot.status()
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

    def profile(self) -> RobotProfile:
        return RobotProfile(self.identity.serial_number, self.identity.software, **self.facts)


def green(says: Message, means: Message = "") -> Found:
    return Level.GREEN, says, means


def amber(says: Message, means: Message) -> Found:
    return Level.AMBER, says, means


def red(says: Message, means: Message) -> Found:
    return Level.RED, says, means


Look = Callable[Concatenate[CheckUpSession, P], Found | None]
Probe = Callable[Concatenate[CheckUpSession, P], None]


def probe(topic: Topic) -> Callable[[Look[P]], Probe[P]]:
    """For a function that looks at one topic: what it returns becomes the finding of that topic; None: there is nothing to say."""

    def decorate(look: Look[P]) -> Probe[P]:
        @functools.wraps(look)
        def add(session: CheckUpSession, /, *args: P.args, **values: P.kwargs) -> None:
            session.add(topic, look(session, *args, **values))

        return add

    return decorate


def why(answer: Answer | RobotError) -> Message:
    """The sentence of what went wrong."""
    error = answer.error if isinstance(answer, Answer) else answer
    return error.message if error is not None else message("its answer is no list")
