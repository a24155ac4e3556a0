"""Messages between the engine and a robot's worker. A worker gets them in the order in which they were sent."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from app.domain.execution import Execution
from app.domain.models import Robot


@dataclass(frozen=True)
class Readiness:
    """A worker's facts about a robot that can get a start at once: read a moment ago."""

    battery: float | None
    queue_floor: int
    uncertain_through: datetime | None  # starts planned up to then may already be on the robot


@dataclass(frozen=True)
class Poll:
    """Read everything."""


@dataclass(frozen=True)
class Prefetch:
    """Something falls due in about a second: read the status ahead, so that then only the POST remains."""


@dataclass(frozen=True)
class Start:
    """An intent that is on disk, to be sent at its instant; from now on the worker owns this row. ``plan_version`` was read before it was
    written."""

    intent: Execution
    plan_version: int


@dataclass(frozen=True)
class LedgerChanged:
    """Something may wait, or may have been withdrawn."""


@dataclass(frozen=True)
class RobotEdited:
    """Its name, its idle rule, or whether it is switched on."""

    robot: Robot


@dataclass(frozen=True)
class OnScreen:
    """Whether it is on screen."""

    is_watched: bool


@dataclass(frozen=True)
class NeededByGroup:
    """Whether a start waits for it, or for another robot of its group."""

    is_sought: bool


@dataclass(frozen=True)
class Recover:
    """The last writes are unknown: the database failed and works again, or a round ended in an error. ``number``: the
    call of ``RobotWorker.expect_recovery``."""

    number: int


@dataclass(frozen=True)
class ClockJumped:
    """The tablet slept, or its clock was set: the robot's activity was not seen."""


Message = Poll | Prefetch | Start | LedgerChanged | RobotEdited | OnScreen | NeededByGroup | Recover | ClockJumped
