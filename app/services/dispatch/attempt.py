"""A start being sent: what its worker knows about it and its row does not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, auto

from app.domain.models import Execution
from app.services.executions.transitions import Transition


class Phase(Enum):
    READY = auto()  # its intent is on disk, its instant is still to come
    BACKOFF = auto()  # it waits, and is looked at again at ``wake_at``
    IN_DOUBT = auto()  # its request may have reached the robot, or still may
    ACCEPTED = auto()  # the robot has it; not written yet


@dataclass(slots=True)
class Attempt:
    """``wake_at`` and ``in_doubt_since`` on the monotonic clock, so that no step of the wall clock moves them."""

    phase: Phase
    wake_at: float
    row: Execution | None = None  # READY: the intent
    plan_version: int = 0  # READY: of the plan that the intent was written from
    in_doubt_since: float = math.inf
    is_taken: bool = False  # IN_DOUBT: the robot has it; only its number is not known
    accepted: Transition | None = None


def intent_of(row: Execution) -> tuple[object, ...]:
    """Identifies an intent of a row: a start of a group may come to the same robot again."""
    return row.id, row.attempts, row.bound_at


class Attempts(dict[int, Attempt]):
    """Those of one robot, by the id of their execution. A row in state ``submitting`` that is not here belongs to a
    process that has ended."""

    def of(self, phase: Phase) -> Iterator[Attempt]:
        return (attempt for attempt in self.values() if attempt.phase is phase)

    def next_at(self) -> float:
        return min((attempt.wake_at for attempt in self.values()), default=math.inf)

    def next_ready_at(self) -> float:
        return min((attempt.wake_at for attempt in self.of(Phase.READY)), default=math.inf)

    def may_be_with_the_robot(self) -> bool:
        return any(attempt.phase in (Phase.IN_DOUBT, Phase.ACCEPTED) for attempt in self.values())
