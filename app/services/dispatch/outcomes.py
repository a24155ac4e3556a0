"""Writes the outcome of each start at its robot: begun, taken, failed, refused, given back to its group, or not sent after
all; and when one that continues to wait is looked at again. The last four certainly put nothing on the robot."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Sequence
from datetime import datetime

from app.domain import rules
from app.domain.choice import may_change_robot
from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger
from app.domain.message import Message
from app.domain.robot import QueueItem
from app.mir.errors import AnotherFleet, AnotherRobot, RobotError, Unauthorized
from app.mir.target import Target
from app.services.allocation.situation import Ineligible
from app.services.dispatch.attempt import Attempt, Attempts, Phase, tried_here
from app.services.dispatch.context import Context
from app.services.dispatch.duplicates import Duplicates
from app.services.dispatch.observation import Observation
from app.services.executions import transitions
from app.services.executions.transitions import Event, Transition
from app.services.executions.wanted import Verdict


class Outcomes:
    """Of the starts on one robot."""

    def __init__(self, client: Target, context: Context, observation: Observation, duplicates: Duplicates) -> None:
        self._client, self._s, self._ledger, self._clock = client, context, context.ledger, context.clock
        self._seen, self._duplicates, self._robot_id = observation, duplicates, observation.robot.id
        self.attempts = Attempts()
        self._first: set[int] = set()  # never sent here before they were begun
        duplicates.own.note_accepted = self.note

    def begin(self, rows: list[Execution]) -> list[Execution]:
        """Returns their intents, of those that may still be sent."""
        robot, floor, now = self._seen.robot, self._seen.highest, self._clock.now()
        self._first |= {row.id for row in rows if row.queue_floor is None}
        return self._ledger.apply([transitions.begin(row, robot, floor, now) for row in rows], quietly=True)

    def accepted(self, intent: Execution, queue_id: int, since: datetime | None = None) -> None:
        self._seen.saw_id(queue_id)
        self.attempts[intent.id] = Attempt(
            Phase.ACCEPTED,
            math.inf,
            accepted=transitions.accept(intent, self._seen.robot, queue_id, since or self._clock.now()),
        )

    def note(self) -> None:
        """Write accepted executions. The write may wait: if it were lost, the robot would be asked."""
        accepted = [attempt.accepted for attempt in self.attempts.of(Phase.ACCEPTED) if attempt.accepted]
        rows = self._ledger.apply(accepted, patient=True)
        for each in accepted:
            del self.attempts[each.row.id]
        for row in rows:
            if row.cancel_code and row.queue_id is not None:  # cancelled while it was being sent
                self._duplicates.cancel(row.queue_id, row)

    def found(self, row: Execution, items: list[QueueItem], left_at: datetime | None = None) -> None:
        """``left_at``: when its request was sent, if known: robots' times have no known zone."""
        first, *later = items
        self.accepted(row, first.id, left_at)
        self.note()
        for item in later:
            if not self._duplicates.cancel_copy(item, row):
                self._duplicates.watch_from(row, first.id)

    def read_failed(self, rows: list[Execution], error: RobotError) -> None:
        """A read before the POST failed: final for another robot or user, otherwise a failed attempt of each."""
        match error:
            case AnotherRobot():
                serials = {name: error.params[name] for name in ("expected", "found")}
                fleet = {"fleet": True} if isinstance(error, AnotherFleet) else {}
                self.refused(rows, Reason(ReasonCode.WRONG_ROBOT, {**serials, **fleet}))
            case Unauthorized():
                self.refused(rows, Reason(ReasonCode.UNAUTHORIZED, {"problem": error.message}))
            case _:
                self.failed(rows, error.message)

    def refused(self, rows: Sequence[Execution], reason: Reason, *, may_come: bool = False) -> None:
        """Finally refused by this robot: the start ends, or one of a group goes to another robot. ``may_come``: it was
        sent."""
        self.give_back([row for row in rows if row.group_id is not None], reason=reason, may_come=may_come)
        ends = [row for row in rows if row.group_id is None]
        self._ledger.apply([transitions.end(Event.REFUSE, row, reason, may_come=may_come) for row in ends])
        for row in rows:
            self.attempts.pop(row.id, None)

    def refused_as_sent(self, row: Execution, reason: Reason, *, may_come: bool = False) -> None:
        """A refusal usually means that the mission was edited: why the robot refuses the parameters, if it says so."""
        if row.parameters and reason.code is ReasonCode.REFUSED:
            with contextlib.suppress(RobotError):
                reason = self._s.parameters.refusal(row, self._robot_id, self._client) or reason
        self.refused([row], reason, may_come=may_come)

    def give_back(
        self,
        rows: Sequence[Execution],
        out: Ineligible = Ineligible.TRIED,
        *,
        problem: Message = "",
        reason: Reason | None = None,
        may_come: bool = False,
    ) -> None:
        """Group starts that are certainly not here are for any robot of the group again; this robot is excluded for a
        while, or for good if it has refused (``reason``) or was tried too often."""
        settings, now, is_attempt = self._s.settings(), self._clock.now(), out is Ineligible.TRIED
        found: list[Transition] = []
        for row in rows:
            tried = tried_here(row, self._seen.robot, settings, now, out, problem, reason, may_come=may_come)
            found.append(transitions.give_back(row, self._robot_id, tried, is_attempt=is_attempt, may_come=may_come))
            self.attempts.pop(row.id, None)
            if reason:
                self._ledger.alarm_of_refusal(row, self._seen.robot, reason)
        self._ledger.apply(found)

    def failed(self, rows: list[Execution], problem: Message, waited: bool = False) -> None:
        """Certainly nothing on the robot: try again later (at once if it has ``waited`` enough), or end it as tried too
        often."""
        self.give_back([row for row in rows if row.group_id is not None], problem=problem, may_come=waited)
        rows = [row for row in rows if row.group_id is None]
        settings, ends = self._s.settings(), []
        failed = [transitions.fail(row, problem, may_come=waited, is_first=self._is_first(row)) for row in rows]
        self._first -= {row.id for row in rows} if waited else set()
        tried = self._ledger.apply(failed)  # it may have been written though it raises
        for waiting in tried:
            self.attempts.pop(waiting.id, None)
            if waiting.ended_at is None:
                if reason := rules.after_failed_attempt(waiting, settings, problem):
                    ends.append(transitions.withdraw(waiting, reason))
                else:
                    self.later(waiting, 0.0 if waited else rules.back_off(waiting.attempts, settings))
        self._forget_idle([*tried, *self._ledger.apply(ends)])

    def _is_first(self, row: Execution) -> bool:
        """Whether it can't have arrived here before its last attempt. For an idle mission the floor stays: it also
        shows that the robot was not used since."""
        was_sent_once = row.state is State.SUBMITTING and row.attempts == 1
        return (was_sent_once or row.id in self._first) and row.trigger is not Trigger.IDLE

    def not_sent(self, intents: Sequence[Execution]) -> None:
        """Unsent intents wait again, or end if they were withdrawn."""
        for intent in intents:
            self.attempts.pop(intent.id, None)
        found = [transitions.not_sent(intent, is_first=self._is_first(intent)) for intent in intents]
        for waiting in self._ledger.apply(found):
            if waiting.ended_at is not None:
                self._forget_idle([waiting])
            elif is_own(waiting, self._ledger.wanted(waiting)):
                self.later(waiting, 0.0)
            else:
                self.unassign(waiting)

    def unassign(self, row: Execution) -> None:
        """An unsent start of a group that can't be sent here now, without an error."""
        self._ledger.apply([transitions.unassign(row)], quietly=True)
        self.attempts.pop(row.id, None)

    def _forget_idle(self, ended: Iterable[Execution]) -> None:
        """A withdrawn idle mission is not here: its idle period counts as unused."""
        if any(row.trigger is Trigger.IDLE and row.withdrawn is not None for row in ended):
            self._ledger.note_last_use(self._robot_id, None)

    def later(self, row: Execution, seconds: float) -> None:
        """Look at it again then, or when its window closes."""
        until_closed = max(0.0, (row.closes_at - self._clock.now()).total_seconds())
        self.attempts[row.id] = Attempt(Phase.BACKOFF, self._clock.monotonic() + min(seconds, until_closed))

    def forget_all_but(self, unsent: set[int]) -> None:
        kept = (Phase.ACCEPTED, Phase.READY)  # what is held is judged at its instant
        for key in [key for key, attempt in self.attempts.items() if key not in unsent and attempt.phase not in kept]:
            del self.attempts[key]
        self._first &= unsent


def is_own(row: Execution, verdict: Verdict) -> bool:
    """Whether it waits for this robot, and for no other."""
    return not may_change_robot(row) and "robot_id" not in (verdict.columns or {})
