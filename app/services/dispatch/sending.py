"""The only way of starts into a robot's queue, each exactly once (docs/reliability.md).

The robot's POST has no idempotency key and links drop answers, so the intent is on disk before the POST, and an unknown
outcome is never retried: the robot's queue is asked first. Before every attempt, and at the end of every wait, it
checks whether the start was withdrawn. Used by the robot's worker only.

A start whose answer was lost is in doubt from before its request was sent (``_post``; ``in_doubt`` looks for it).
``outcomes`` writes how each has ended here.

A robot of a fleet is sent to through the fleet, in the same way: "the robot's queue" is the fleet's orders then. Where
only mission, user and number would tell its order there from others, the numbers are read again just before the request
(``_is_below``).
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from app.database.executions import Unsent
from app.database.values import to_text
from app.domain import rules
from app.domain.activity import can_work
from app.domain.capabilities import FindBy
from app.domain.choice import may_change_robot
from app.domain.execution import Execution, State, Trigger, Wait
from app.mir.errors import Delivery, NotWanted, RobotError, Unnumbered
from app.mir.target import Target
from app.services.allocation.situation import Ineligible
from app.services.dispatch.attempt import Attempt, Phase, answer_in_doubt, intent_of, refusal
from app.services.dispatch.context import Context
from app.services.dispatch.duplicates import Duplicates
from app.services.dispatch.in_doubt import InDoubt
from app.services.dispatch.observation import Observation
from app.services.dispatch.outcomes import Outcomes, is_own
from app.services.dispatch.timing import INTENT_LEAD, RECHECK
from app.services.dispatch.waiting import Waiting
from app.services.executions import transitions
from app.services.executions.transitions import Event

log = logging.getLogger(__name__)

STARTED_TOGETHER = 8  # that wait for one robot, with one write; all are looked for should the app be killed then


class Sending:
    """``is_still_idle`` asks again whether an idle mission may start; ``on_sent`` is called once the robot has answered one, or has not."""

    def __init__(
        self,
        client: Target,
        context: Context,
        observation: Observation,
        duplicates: Duplicates,
        is_still_idle: Callable[[Execution], bool],
        on_sent: Callable[[], None],
    ) -> None:
        self._client, self._s, self._ledger, self._clock = client, context, context.ledger, context.clock
        self._seen, self._duplicates, self._robot_id = observation, duplicates, observation.robot.id
        self._is_still_idle, self._on_sent = is_still_idle, on_sent
        self.outcomes = Outcomes(client, context, observation, duplicates)
        self.doubt = InDoubt(client, context, observation, duplicates, self.outcomes)
        self.attempts = self.outcomes.attempts
        self._waiting = Waiting(context, self.outcomes.later, self._robot_id)
        self.waits_for_free_robot = False  # something waits until the robot is free

    # ------------------------------------------------------------------ called by the worker
    def take_over(self, intent: Execution, plan_version: int) -> None:
        """Send it at its instant. One that came after it was looked for is not sent."""
        if intent_of(intent) not in self.doubt.recovered:
            ahead = min(max(0.0, (intent.planned_at - self._clock.now()).total_seconds()), INTENT_LEAD)
            self.attempts[intent.id] = Attempt(Phase.READY, self._clock.monotonic() + ahead, intent, plan_version)

    def send_due(self) -> None:
        """Intents whose instant has come, in dispatch order. One that can't be sent now is handled like any waiting
        start."""
        mono = self._clock.monotonic()
        due = [attempt.row for attempt in self.attempts.of(Phase.READY) if attempt.row and attempt.wake_at <= mono]
        for intent in rules.in_dispatch_order(due):
            attempt = self.attempts.get(intent.id)
            # It may have been judged already, while the robot was asked why it refused another.
            if attempt is None or attempt.phase is not Phase.READY:
                continue
            if self._is_wanted(intent, attempt.plan_version) and self._can_send(intent):
                self._post(intent, attempt.plan_version)
                self._on_sent()
            else:
                self.outcomes.not_sent([intent])

    def run(self, only: int | None = None) -> None:
        """Handle all executions that no robot has yet; ``only`` this one."""
        self.outcomes.note()
        if self._seen.fresh_status is not None:
            self.attempts.wake_unanswered()
        unsent = [each for each in self._ledger.unsent_of(self._robot_id) if only in (None, each.id)]
        ids = {each.id for each in unsent}
        self.outcomes.forget_all_but(ids)
        self._waiting.forget_all_but(ids)
        is_held = self._s.holds.active(self._robot_id) is not None
        self.waits_for_free_robot = False
        now, mono = to_text(self._clock.now()), self._clock.monotonic()
        awake = [each.id for each in unsent if self._is_awake(each, is_held, now, mono)]
        starts: list[Execution] = []
        unreachable: list[Execution] = []
        trouble: RobotError | None = None  # asked once, and written once, for all that wait
        for row in rules.in_dispatch_order(self._ledger.unsent(awake)):
            if row.state is State.SUBMITTING:
                self.doubt.look_for(row)
            elif self._may_try(row):
                if trouble := trouble or self._seen.trouble():
                    unreachable.append(row)
                elif self.attempts.wake_unanswered():
                    self.run(only)  # the first that was due asked it: all go that waited for its answer, in their order
                    return
                elif self._is_ready(row, starts):
                    starts.append(row)
                    if len(starts) == STARTED_TOGETHER:
                        self._start(starts)
        self._start(starts)
        if trouble:
            self.outcomes.read_failed(unreachable, trouble)
            self.attempts.wait_for_answer(row.id for row in unreachable)
        self.outcomes.note()

    def close(self, untaken: Sequence[Execution] = ()) -> None:
        """Intents not sent yet wait again; those of a group for any of its robots."""
        self.outcomes.note()
        for intent in untaken:
            self.take_over(intent, 0)
        self.outcomes.not_sent([attempt.row for attempt in self.attempts.of(Phase.READY) if attempt.row])
        self._ledger.unassign(self._robot_id)

    # ------------------------------------------------------------------ waiting
    def _can_send(self, intent: Execution) -> bool:
        status = self._seen.fresh_status
        if status is None or not self._seen.robot.enabled or self._waiting.why_robot(intent, self._seen, status):
            return False
        return can_work(status) or not may_change_robot(intent)

    def _is_wanted(self, intent: Execution, plan_version: int) -> bool:
        """Whether it may leave as it is in hand. ``plan_version``: of the plan that the intent was written from."""
        if plan_version != self._s.plan_version():
            row = self._ledger.get(intent.id)
            if (
                row is None
                or row.state is not State.SUBMITTING
                or self._ledger.wanted(row).columns != {}
                or self._waiting.why_full(row)
            ):
                return False
            intent = row
        is_held = self._waiting.why_held(intent) or self._waiting.why_early(intent)
        return self._clock.now() < intent.closes_at and not is_held

    def _is_awake(self, unsent: Unsent, is_held: bool, now: str, mono: float) -> bool:
        """Whether it has to be handled now. Hundreds may wait for an unreachable robot: each is loaded only when it is
        due."""
        attempt = self.attempts.get(unsent.id)
        is_due = attempt is None or attempt.wake_at <= mono
        if unsent.state == State.SUBMITTING:
            return is_due and attempt is not None and attempt.phase is Phase.IN_DOUBT
        # What a person had it wait for is over; or they are judged together.
        is_let_go = unsent.wait in (Wait.DUE, Wait.ROBOT)
        return bool(is_due or is_held or is_let_go or unsent.is_cancelled or now >= unsent.closes_at)

    def _may_try(self, row: Execution) -> bool:
        """Whether to try this waiting execution now; otherwise it is ended, left waiting, or given back to its
        group."""
        verdict = self._ledger.wanted(row)
        stays = is_own(row, verdict)
        if (stays or self._seen.robot.enabled) and self._waiting.may_be_tried(row, verdict.why, needs_room=stays):
            return True
        if not stays:
            self.outcomes.unassign(row)
        return False

    # ------------------------------------------------------------------ an attempt
    def _is_ready(self, row: Execution, before: list[Execution]) -> bool:
        """Whether it can be sent after those ``before`` it; otherwise it waits, or the robot has it, or it has
        ended."""
        try:
            status = self._seen.recent_status()
            waits = self._waiting.why_robot(row, self._seen, status)
            if may_change_robot(row) and (waits is None or waits.wait is Wait.BATTERY):
                if not can_work(status):
                    self.outcomes.unassign(row)
                    return False
                if waits:
                    self.outcomes.give_back([row], Ineligible.LOW_BATTERY)
                    return False
            if waits := waits or self._waiting.why_in_line(row, self._seen, status, before):
                self.waits_for_free_robot |= waits.wait is Wait.ROBOT
                self._waiting.put_off(row, waits)
                return False
            if row.trigger is Trigger.IDLE:
                self._start(before)
                if not self._is_still_idle(row):
                    self._ledger.end(Event.EXPIRE, row, rules.reason_overtaken(row, self._clock.now()))
                    self._ledger.note_last_use(self._robot_id, None)  # it may begin again
                    return False
            if self._seen.highest is None:
                self._seen.read_highest()
            already_there = self._duplicates.own.of(row) if row.attempts and row.queue_floor is not None else []
            if (
                not already_there
                and self._values(row) is None
                and (refused := self._s.parameters.refusal(row, self._robot_id, self._client))
            ):
                self.outcomes.refused([row], refused)
                return False
        except RobotError as problem:
            self.outcomes.read_failed([row], problem)
            return False
        if already_there:
            for intent in self.outcomes.begin([row]):
                self.outcomes.found(intent, already_there)
        return not already_there

    def _values(self, row: Execution) -> Mapping[str, Any] | None:
        """The parameters to send; None: the robot has to be asked first."""
        return self._s.parameters.to_send(self._robot_id, row.mission_guid, row.mission, row.parameters)

    def _start(self, rows: list[Execution]) -> None:
        """Their intents with one write, then each like those the planner has written. Empties ``rows``."""
        # The questions for them may have taken longer than the status is valid.
        if rows and (trouble := self._seen.trouble()):
            self.outcomes.read_failed(rows, trouble)
        elif rows:
            plan_version = self._s.plan_version()
            for intent in self.outcomes.begin(rows):
                self.take_over(intent, plan_version)
            for row in rows:
                if row.id not in self.attempts:  # it has moved on, or somebody was quicker at a place that it uses
                    self.outcomes.later(row, RECHECK)
            self.send_due()
        rows.clear()

    def _post(self, intent: Execution, plan_version: int) -> None:
        """``description`` carries the token; ``message`` is for people and the robot overwrites it. Any unforeseen
        error leaves it in doubt. Until it is sent, which may take a while, it may be withdrawn."""

        def is_wanted() -> bool:
            return self._seen.may_be_sent_by and self._is_wanted(intent, plan_version)

        try:
            if (values := self._values(intent)) is None or self._is_below(intent):
                self.outcomes.not_sent([intent])
                return
        except RobotError as error:
            self.outcomes.failed([intent], error.message)
            return
        self.doubt.mark(intent)
        try:
            queue_id = self._client.enqueue(
                intent.mission_guid,
                description=intent.token,
                text=intent.label,
                priority=intent.priority,
                parameters=values,
                is_wanted=is_wanted,
            )
        except RobotError as error:
            self._not_accepted(intent, error)
        else:
            self.outcomes.accepted(intent, queue_id)

    def _is_below(self, intent: Execution) -> bool:
        """Whether ids have begun again since the intent, where only they would tell its order from others. Raises
        RobotError."""
        floor = intent.queue_floor or 0
        return self._client.capabilities.find_by is FindBy.MATCH and self._seen.read_highest(floor) < floor

    def _not_accepted(self, intent: Execution, error: RobotError) -> None:
        """Whether anything of it may be on the robot decides what follows."""
        self._seen.invalidate_status()
        if isinstance(error, NotWanted) and self._clock.now() < intent.closes_at:
            self.outcomes.not_sent([intent])
        elif error.delivery is Delivery.NOT_SENT:
            self.outcomes.failed([intent], error.message)
        elif error.delivery is Delivery.REFUSED:
            if reason := refusal(self._client, intent, error):
                self.outcomes.refused_as_sent(intent, reason)
            else:
                self.outcomes.failed([intent], error.message)
        else:
            is_taken = isinstance(error, Unnumbered)
            self.doubt.mark(intent, is_taken=is_taken)  # the quiet time begins now
            if answer := answer_in_doubt(intent, error):
                taken_at = self._clock.now() if is_taken else None
                self._ledger.apply([transitions.answer(intent, answer, taken_at)], quietly=True)
            log.warning(
                "#%d on %r: outcome unknown, looking at the robot's queue (%s)",
                intent.id,
                self._seen.robot.name,
                error.text,
            )
