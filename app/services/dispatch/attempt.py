"""A start being sent: what its worker knows about it, and why a robot did not take it."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import Enum, auto
from http import HTTPStatus
from typing import Any, NamedTuple

from app.database.values import to_text
from app.domain import rules
from app.domain.execution import Execution, Reason, ReasonCode
from app.domain.message import Message, message
from app.domain.models import Robot, Settings
from app.mir.errors import NotAMir, Refusal, Rejected, RobotError, RobotFault, Unauthorized, Unreadable
from app.mir.target import Target
from app.services.allocation.situation import Ineligible
from app.services.executions.transitions import Transition, is_other_machine

log = logging.getLogger(__name__)

OF_A_PROXY = (HTTPStatus.BAD_GATEWAY, HTTPStatus.GATEWAY_TIMEOUT)


class Phase(Enum):
    READY = auto()  # its intent is on disk, its instant is in the future
    BACKOFF = auto()  # it waits, and is looked at again at ``wake_at``
    IN_DOUBT = auto()  # its request may have reached the robot, or still may
    ACCEPTED = auto()  # the robot has it; not written yet


class Moment(NamedTuple):
    """On three clocks: one of them may be set, the last stops while the app is off."""

    by_fleet: datetime
    by_tablet: datetime
    mono: float


@dataclass(slots=True)
class Attempt:
    """``wake_at`` and ``in_doubt_since`` on the monotonic clock, so that no step of the wall clock moves them."""

    phase: Phase
    wake_at: float
    row: Execution | None = None  # READY: the intent
    plan_version: int = 0  # READY: of the plan that the intent was written from
    is_unanswered: bool = False  # BACKOFF: its robot could not be read; it is looked at once any read succeeds
    in_doubt_since: float = math.inf
    sent_since: Moment | None = None  # IN_DOUBT: the earliest that it may have been sent
    asked_at: Moment | None = None  # IN_DOUBT: when the robot last did not show it
    unasked: float = 0.0  # IN_DOUBT: s, the longest between two such answers
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

    def wait_for_answer(self, ids: Iterable[int]) -> None:
        """Their robot could not be read: until it can be, or each is due again."""
        for attempt in filter(None, map(self.get, ids)):
            attempt.is_unanswered = True

    def wake_unanswered(self) -> bool:
        """The robot was read. Returns whether anything waited for that."""
        found = [attempt for attempt in self.of(Phase.BACKOFF) if attempt.is_unanswered]
        for attempt in found:
            attempt.wake_at, attempt.is_unanswered = -math.inf, False
        return bool(found)

    def may_be_with_the_robot(self) -> bool:
        return any(attempt.phase in (Phase.IN_DOUBT, Phase.ACCEPTED) for attempt in self.values())


# ---------------------------------------------------------------------- not taken: nothing of it is on the robot then
def refusal(client: Target, intent: Execution, error: RobotError) -> Reason | None:
    """The problem for the operator to solve. A 400 or 404 may mean the mission: the robot is asked whether it has it.
    None: a 404 that does not mean the mission; the robot's interface has only just come up."""
    if isinstance(error, Unauthorized):
        return Reason(ReasonCode.UNAUTHORIZED, {"problem": error.message})
    if isinstance(error, Rejected) and error.status in (400, 404):
        try:
            client.mission(intent.mission_guid)
        except Rejected as answer:
            if answer.status in (404, 410):
                return Reason(ReasonCode.UNKNOWN_MISSION, {"mission": intent.mission})
        except RobotError as unheard:
            log.info(
                "Whether %r has mission %s could not be asked: %s", intent.robot, intent.mission_guid, unheard.text
            )
        if error.status == 404:
            return None
    return Reason(ReasonCode.REFUSED, {"problem": error.message})


def answer_in_doubt(start: Execution, error: RobotError) -> Mapping[str, Any]:
    """An answer that does not say whether the start was taken: ``answer`` is its sentence, ``is_reason`` whether it
    explains why the robot can't take it, so that another try would end the same way. Empty: no answer."""
    if isinstance(error, Refusal) and error.reason:
        sentence = message("the robot answered: {reason} (status {status})", reason=error.reason, status=error.status)
        return {"answer": sentence, "is_reason": _is_reason(start, error)}
    return {"answer": error.message} if isinstance(error, Refusal | NotAMir | Unreadable) else {}


def _is_reason(start: Execution, error: Refusal) -> bool:
    """A busy robot (503) or a proxy may answer differently the next time, and so may one with a general error; but
    robots answer unknown parameters in that way."""
    return (
        isinstance(error, RobotFault)
        and error.status not in OF_A_PROXY
        and bool(start.parameters or not _is_name_of_status(error))
    )


def _is_name_of_status(error: Refusal) -> bool:
    try:
        return str(error.reason).strip(" .").casefold() == HTTPStatus(error.status).phrase.casefold()
    except ValueError:  # a status without a name
        return False


def tried_here(
    row: Execution,
    robot: Robot,
    settings: Settings,
    now: datetime,
    out: Ineligible,
    problem: Message,
    reason: Reason | None,
    *,
    may_come: bool,
) -> Mapping[str, Any]:
    """The outcome of a group's start on this robot, which is excluded for a while, or for good if it has refused
    (``reason``) or was tried too often. With the floor and serial number of the first time that it may have arrived
    (``may_come``): everything ever sent to that machine lies above."""
    before = row.tried.get(str(robot.id), {})
    tries = before.get("tries", 0) + (out is Ineligible.TRIED)
    is_for_good = reason is not None or tries > settings.retry_limit
    until = row.closes_at if is_for_good else now + timedelta(seconds=rules.back_off(max(tries, 1), settings))
    is_first = before.get("floor") is None or is_other_machine(row, before.get("serial"))
    return {
        "robot": robot.name,
        "out": str(out),
        "tries": tries,
        "at": to_text(now),
        "until": to_text(until),
        "is_for_good": is_for_good,
        "floor": (row.queue_floor if may_come else None) if is_first else before["floor"],
        "serial": row.robot_serial if is_first else before.get("serial"),
        "problem": reason.details.get("problem", "") if reason else problem,
        **({"code": str(reason.code)} if reason else {}),
    }
