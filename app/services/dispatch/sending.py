"""The only way of starts into a robot's queue, each exactly once (docs/reliability.md).

The robot's POST has no idempotency key and links drop answers, so the intent is on disk before the POST, and an unknown
outcome is never retried: the robot's queue is asked first. Before every attempt, and at the end of every wait, it
checks whether the start was withdrawn. Used by the robot's worker only.

A start whose answer was lost is in doubt from before its request was sent (``_post``). Every 2 s the robot's queue is
searched for its token (``_reconcile``). Found: it is accepted, nothing is sent again. Not found after the quiet time:
the attempt has failed, and is repeated within the window and the retry limit, unless the robot has said why it can't
take it. If the robot can't be asked until the quiet time has passed and the window has closed, it ends as unknown, with
an alarm (``_give_up``).

A robot of a fleet is sent to through the fleet, in the same way: "the robot's queue" is the fleet's orders then. What the
target can do decides how a start is found there (``Capabilities.find_by``): by its id, which is the token; by its token,
whatever its number; or only by mission, user and number, which are read again just before the request (``_is_below``).
A fleet that may have forgotten orders, or begun their numbers again, since a start was sent leaves it unknown.
"""

from __future__ import annotations

import contextlib
import logging
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any

from app.database.executions import Unsent
from app.database.values import to_text
from app.domain import rules
from app.domain.activity import can_work
from app.domain.capabilities import FindBy
from app.domain.choice import may_change_robot
from app.domain.message import Message, message
from app.domain.models import Execution, Reason, ReasonCode, State, Trigger, Wait
from app.domain.robot import QueueItem
from app.mir.errors import (
    Ambiguous,
    AnotherFleet,
    AnotherRobot,
    Delivery,
    NotWanted,
    RobotError,
    Unauthorized,
    Unnumbered,
    VehicleUnavailable,
)
from app.mir.target import Target
from app.services.allocation.situation import Ineligible
from app.services.dispatch.attempt import Attempt, Attempts, Phase, answer_in_doubt, intent_of, refusal, tried_here
from app.services.dispatch.context import Context
from app.services.dispatch.duplicates import Duplicates
from app.services.dispatch.observation import Observation
from app.services.dispatch.timing import INTENT_LEAD, RECHECK, RECONCILE_EVERY
from app.services.dispatch.waiting import Waiting
from app.services.executions import transitions
from app.services.executions.transitions import WITH_THE_ROBOT, Event, Transition, is_other_machine
from app.services.executions.wanted import Verdict

log = logging.getLogger(__name__)

SENT_TOGETHER = timedelta(minutes=5)  # of two starts: clocks can't be trusted to tell which was first
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
        self._seen, self._duplicates = observation, duplicates
        self._is_still_idle, self._on_sent = is_still_idle, on_sent
        self.attempts = Attempts()
        self._first: set[int] = set()  # never sent here before they were begun
        self._recovered: set[tuple[object, ...]] = set()  # intents that were looked for as lost ones
        self._waiting = Waiting(context, self._later, observation.robot.id)
        duplicates.own.note_accepted = self.note
        self.waits_for_free_robot = False  # something waits until the robot is free

    # ------------------------------------------------------------------ called by the worker
    def recover(self) -> None:
        """Rows in state submitting that no worker has: their process has ended, or the database failed in between. Each
        is looked for on the robot as if its request had just been sent."""
        for row in self._ledger.open_for(self._robot_id, (State.SUBMITTING,)):
            attempt = self.attempts.get(row.id)
            if attempt is None or attempt.phase is Phase.BACKOFF:  # it does not know that its intent was written
                self._recovered.add(intent_of(row))
                # It may have left this moment.
                self._mark_in_doubt(row, self._client.timeouts.total, is_taken=row.submitted_at is not None)
        for row in self._ledger.open_for(self._robot_id, (State.SUBMITTING, *WITH_THE_ROBOT)):
            self._note_sent(row)
        self._duplicates.watch_again()

    def _note_sent(self, row: Execution) -> None:
        """So that it can be found by what it is, and no other's order is taken for it. Nothing is noted if that may be one
        that another robot of the fleet has run."""
        robot, now, sent_at = self._seen.robot, self._clock.now(), _sent_at(row)
        if self._client.capabilities.find_by is not FindBy.ID:
            return
        if now < sent_at:  # by a clock that was set back
            return
        robots = [each for each in self._s.robots.all(self._s.db.read()) if each.fleet_id == robot.fleet_id]
        ids = [each.id for each in robots if each.id == robot.id or each.is_any or robot.is_any]
        ended = self._ledger.ended_since(ids, row.mission_guid, sent_at - SENT_TOGETHER)
        is_open = (
            other.mission_guid == row.mission_guid
            for id_ in ids
            if id_ != robot.id
            for other in self._ledger.open_for(id_, (State.SUBMITTING, *WITH_THE_ROBOT))
        )
        if ended is None or any(other.robot_id != robot.id for other in ended) or any(is_open):
            return
        for each in (*ended, row):
            date = _sent_at(each)
            self._client.note_sent(each.token, each.mission_guid, max(0.0, (now - date).total_seconds()), date)

    def take_over(self, intent: Execution, plan_version: int) -> None:
        """Send it at its instant. One that came after it was looked for is not sent."""
        if intent_of(intent) not in self._recovered:
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
                self._release([intent])

    def run(self, only: int | None = None) -> None:
        """Handle all executions that no robot has yet; ``only`` this one."""
        self.note()
        unsent = [each for each in self._ledger.unsent_of(self._robot_id) if only in (None, each.id)]
        self._forget_all_but({each.id for each in unsent})
        is_held = self._s.holds.active(self._robot_id) is not None
        self.waits_for_free_robot = False
        now, mono = to_text(self._clock.now()), self._clock.monotonic()
        awake = [each.id for each in unsent if self._is_awake(each, is_held, now, mono)]
        starts: list[Execution] = []
        unreachable: list[Execution] = []
        trouble: RobotError | None = None  # asked once, and written once, for all that wait
        for row in rules.in_dispatch_order(self._ledger.unsent(awake)):
            if row.state is State.SUBMITTING:
                self._reconcile(row)
            elif self._may_try(row):
                if trouble := trouble or self._seen.trouble():
                    unreachable.append(row)
                elif self._is_ready(row, starts):
                    starts.append(row)
                    if len(starts) == STARTED_TOGETHER:
                        self._start(starts)
        self._start(starts)
        if trouble:
            self._read_failed(unreachable, trouble)
        self.note()

    def note(self) -> None:
        """Write accepted executions. The write may wait: if it were lost, the robot would be asked."""
        accepted = [attempt.accepted for attempt in self.attempts.of(Phase.ACCEPTED) if attempt.accepted]
        if not accepted:
            return
        rows = self._ledger.apply(accepted, patient=True)
        for each in accepted:
            del self.attempts[each.row.id]
        for row in rows:
            if row.cancel_code and row.queue_id is not None:  # cancelled while it was being sent
                self._duplicates.cancel(row.queue_id, row)

    def close(self, untaken: Sequence[Execution] = ()) -> None:
        """Intents not sent yet wait again; those of a group for any of its robots."""
        self.note()
        for intent in untaken:
            self.take_over(intent, 0)
        self._release([attempt.row for attempt in self.attempts.of(Phase.READY) if attempt.row])
        self._ledger.unassign(self._robot_id)

    # ------------------------------------------------------------------ waiting
    @property
    def _robot_id(self) -> int:
        return self._seen.robot.id

    def _can_send(self, intent: Execution) -> bool:
        status = self._seen.fresh_status
        if status is None or not self._seen.robot.enabled or self._waiting.why_robot(intent, self._seen, status):
            return False
        return can_work(status) or not may_change_robot(intent)

    def _is_wanted(self, intent: Execution, plan_version: int) -> bool:
        """Whether it may leave as it is in hand. ``plan_version``: of the plan that the intent was written from."""
        if plan_version != self._s.plan_version():
            row = self._ledger.get(intent.id)
            if row is None or row.state is not State.SUBMITTING or self._ledger.wanted(row).columns != {}:
                return False
            if self._waiting.why_full(row):
                return False
            intent = row
        is_held = self._waiting.why_held(intent) or self._waiting.why_early(intent)
        return self._clock.now() < intent.closes_at and not is_held

    def _release(self, intents: Sequence[Execution]) -> None:
        """Unsent intents wait again, or end if they were withdrawn."""
        for intent in intents:
            self.attempts.pop(intent.id, None)
        for waiting in self._ledger.apply([transitions.not_sent(intent) for intent in intents]):
            if waiting.ended_at is not None:
                self._forget_idle([waiting])
            elif _is_own(waiting, self._ledger.wanted(waiting)):
                self._later(waiting, 0.0)
            else:
                self._release_robot(waiting)

    def _release_robot(self, row: Execution) -> None:
        """An unsent start of a group that can't be sent here now, without an error."""
        self._ledger.apply([transitions.unassign(row)], quietly=True)
        self.attempts.pop(row.id, None)

    def _forget_all_but(self, unsent: set[int]) -> None:
        kept = (Phase.ACCEPTED, Phase.READY)  # what is held is judged at its instant
        for key in [key for key, attempt in self.attempts.items() if key not in unsent and attempt.phase not in kept]:
            del self.attempts[key]
        self._first &= unsent
        self._waiting.forget_all_but(unsent)

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

    def _later(self, row: Execution, seconds: float) -> None:
        """Look at it again then, or when its window closes."""
        until_closed = max(0.0, (row.closes_at - self._clock.now()).total_seconds())
        self.attempts[row.id] = Attempt(Phase.BACKOFF, self._clock.monotonic() + min(seconds, until_closed))

    def _may_try(self, row: Execution) -> bool:
        """Whether to try this waiting execution now; otherwise it is ended, left waiting, or given back to its
        group."""
        verdict = self._ledger.wanted(row)
        is_own = _is_own(row, verdict)
        if (is_own or self._seen.robot.enabled) and self._waiting.may_be_tried(row, verdict.why, needs_room=is_own):
            return True
        if not is_own:
            self._release_robot(row)
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
                    self._release_robot(row)
                    return False
                if waits:
                    self._give_back([row], Ineligible.LOW_BATTERY)
                    return False
            if waits := waits or self._waiting.why_in_line(row, self._seen, status, before):
                self.waits_for_free_robot |= waits.wait is Wait.ROBOT
                self._waiting.put_off(row, waits)
                return False
            if row.trigger is Trigger.IDLE:
                self._start(before)
                if not self._is_still_idle(row):
                    self._ledger.end(Event.EXPIRE, row, rules.reason_overtaken(row, self._clock.now()))
                    self._ledger.forget_idle(self._robot_id)  # it may begin again
                    return False
            if self._seen.highest is None:
                self._seen.read_highest()
            already_there = self._duplicates.own.of(row) if row.attempts and row.queue_floor is not None else []
            if (
                not already_there
                and self._values(row) is None
                and (refused := self._s.parameters.refusal(row, self._robot_id, self._client))
            ):
                self._refused([row], refused)
                return False
        except RobotError as problem:
            self._read_failed([row], problem)
            return False
        if already_there:
            for intent in self._begin([row]):
                self._found(intent, already_there)
        return not already_there

    def _values(self, row: Execution) -> Mapping[str, Any] | None:
        """The parameters to send; None: the robot has to be asked first."""
        return self._s.parameters.to_send(self._robot_id, row.mission_guid, row.mission, row.parameters)

    def _start(self, rows: list[Execution]) -> None:
        """Their intents with one write, then each like those the planner has written. Empties ``rows``."""
        if rows and (
            trouble := self._seen.trouble()
        ):  # the questions for them may have taken longer than the status is valid
            self._read_failed(list(rows), trouble)
        elif rows:
            plan_version = self._s.plan_version()
            for intent in self._begin(rows):
                self.take_over(intent, plan_version)
            for row in rows:
                if row.id not in self.attempts:  # it has moved on, or somebody was quicker at a place that it uses
                    self._later(row, RECHECK)
            self.send_due()
        rows.clear()

    def _begin(self, rows: list[Execution]) -> list[Execution]:
        robot, floor, now = self._seen.robot, self._seen.highest, self._clock.now()
        self._first |= {row.id for row in rows if row.queue_floor is None}
        return self._ledger.apply([transitions.begin(row, robot, floor, now) for row in rows], quietly=True)

    def _read_failed(self, rows: list[Execution], error: RobotError) -> None:
        """A read before the POST failed: final for another robot or user, otherwise a failed attempt of each."""
        match error:
            case AnotherRobot():
                details = {name: error.params[name] for name in ("expected", "found")}
                if isinstance(error, AnotherFleet):
                    details["fleet"] = True
                reason = Reason(ReasonCode.WRONG_ROBOT, details)
            case Unauthorized():
                reason = Reason(ReasonCode.UNAUTHORIZED, {"problem": error.message})
            case _:
                self._failed(rows, error.message)
                return
        self._refused(rows, reason)

    def _refused(self, rows: Sequence[Execution], reason: Reason, *, may_come: bool = False) -> None:
        """Finally refused by this robot: the start ends, or one of a group goes to another robot. ``may_come``: it was
        sent."""
        self._give_back([row for row in rows if row.group_id is not None], reason=reason, may_come=may_come)
        ends = [row for row in rows if row.group_id is None]
        self._ledger.apply([transitions.end(Event.REFUSE, row, reason, may_come=may_come) for row in ends])
        for row in rows:
            self.attempts.pop(row.id, None)

    def _give_back(
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
        settings, now, found = self._s.settings(), self._clock.now(), list[Transition]()
        for row in rows:
            tried = tried_here(row, self._seen.robot, settings, now, out, problem, reason, may_come=may_come)
            is_attempt = out is Ineligible.TRIED
            found.append(transitions.give_back(row, self._robot_id, tried, is_attempt=is_attempt, may_come=may_come))
            self.attempts.pop(row.id, None)
            if reason:
                self._ledger.alarm_of_refusal(row, self._seen.robot, reason)
        self._ledger.apply(found)

    def _failed(self, rows: list[Execution], problem: Message, waited: bool = False) -> None:
        """Certainly nothing on the robot: try again later (at once if it has ``waited`` enough), or end it as tried too
        often."""
        self._give_back([row for row in rows if row.group_id is not None], problem=problem, may_come=waited)
        rows = [row for row in rows if row.group_id is None]
        settings, ends = self._s.settings(), []
        failed = [transitions.fail(row, problem, may_come=waited, is_first=self._is_first(row)) for row in rows]
        self._first -= {row.id for row in rows} if waited else set()
        tried = self._ledger.apply(failed)  # it may have been written though it raises
        for waiting in tried:
            if waiting.ended_at is not None:
                self.attempts.pop(waiting.id, None)
            elif reason := rules.after_failed_attempt(waiting, settings, problem):
                ends.append(transitions.withdraw(waiting, reason))
                self.attempts.pop(waiting.id, None)
            else:
                self._later(waiting, 0.0 if waited else rules.back_off(waiting.attempts, settings))
        self._forget_idle([*tried, *self._ledger.apply(ends)])

    def _is_first(self, row: Execution) -> bool:
        """Whether it can't have arrived here before its last attempt. For an idle mission the floor stays: it also
        shows that the robot was not used since."""
        is_first = (row.state is State.SUBMITTING and row.attempts == 1) or row.id in self._first
        return is_first and row.trigger is not Trigger.IDLE

    def _forget_idle(self, ended: Iterable[Execution]) -> None:
        """A withdrawn idle mission is not here: its idle period counts as unused."""
        if any(row.trigger is Trigger.IDLE and row.withdrawn is not None for row in ended):
            self._ledger.forget_idle(self._robot_id)

    def _post(self, intent: Execution, plan_version: int) -> None:
        """``description`` carries the token; ``message`` is for people and the robot overwrites it. Any unforeseen
        error leaves it in doubt. Until it is sent, which may take a while, it may be withdrawn."""

        def is_wanted() -> bool:
            return self._seen.may_be_sent_by and self._is_wanted(intent, plan_version)

        try:
            if (values := self._values(intent)) is None or self._is_below(intent):
                self._release([intent])
                return
        except RobotError as error:
            self._failed([intent], error.message)
            return
        self._mark_in_doubt(intent)
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
            self._accepted(intent, queue_id)

    def _is_below(self, intent: Execution) -> bool:
        """Whether ids have begun again since the intent, where only they would tell its order from others. Raises
        RobotError."""
        floor = intent.queue_floor or 0
        return self._client.capabilities.find_by is FindBy.MATCH and self._seen.read_highest(floor) < floor

    def _not_accepted(self, intent: Execution, error: RobotError) -> None:
        """Whether anything of it may be on the robot decides what follows."""
        self._seen.invalidate_status()
        if isinstance(error, NotWanted) and self._clock.now() < intent.closes_at:
            self._release([intent])
        elif error.delivery is Delivery.NOT_SENT:
            self._failed([intent], error.message)
        elif error.delivery is Delivery.REFUSED:
            if reason := refusal(self._client, intent, error):
                self._refused([intent], self._said_of_parameters(intent, reason))
            else:
                self._failed([intent], error.message)
        else:
            is_taken = isinstance(error, Unnumbered)
            self._mark_in_doubt(intent, is_taken=is_taken)  # the quiet time begins now
            if answer := answer_in_doubt(intent, error):
                taken_at = self._clock.now() if is_taken else None
                self._ledger.apply([transitions.answer(intent, answer, taken_at)], quietly=True)
            log.warning(
                "#%d on %r: outcome unknown, looking at the robot's queue (%s)",
                intent.id,
                self._seen.robot.name,
                error.text,
            )

    def _accepted(self, intent: Execution, queue_id: int, since: datetime | None = None) -> None:
        self._seen.saw_id(queue_id)
        self.attempts[intent.id] = Attempt(
            Phase.ACCEPTED,
            math.inf,
            accepted=transitions.accept(intent, self._seen.robot, queue_id, since or self._clock.now()),
        )

    # ------------------------------------------------------------------ in doubt
    def _mark_in_doubt(self, row: Execution, ahead: float = 0.0, *, is_taken: bool = False) -> None:
        """``ahead``: s from now until its request times out. One that ``is_taken`` is looked for at once, one that is
        found by its id, without a search, soon."""
        mono = self._clock.monotonic() + ahead
        by_id = self._client.capabilities.find_by is FindBy.ID
        wake_at = mono if is_taken else mono + (RECONCILE_EVERY / 2 if by_id else RECONCILE_EVERY)
        before = self.attempts.get(row.id)
        sent_since = before and before.sent_since  # the tablet may have slept during the request
        since = (row.begun_at or row.planned_at) if ahead else sent_since or self._clock.now()
        self.attempts[row.id] = Attempt(
            Phase.IN_DOUBT, wake_at, row, in_doubt_since=mono, sent_since=since, is_taken=is_taken
        )

    def _since(self, at: datetime | None, mono: float) -> float:
        """Seconds, at most: neither a sleep of the tablet nor a clock that is set back shortens them."""
        now = self._clock.now()
        return max((now - (at or now)).total_seconds(), self._clock.monotonic() - mono)

    def _note_not_there(self, attempt: Attempt) -> None:
        """The robot was asked for it just now."""
        before = attempt.asked_at or (attempt.sent_since, attempt.in_doubt_since)
        attempt.unasked = max(attempt.unasked, self._since(*before))
        attempt.asked_at = self._clock.now(), self._clock.monotonic()

    def _reconcile(self, row: Execution) -> None:
        """Look for it on the robot. It is sent again only if it is certainly not there and no request can still
        arrive."""
        attempt = self.attempts[row.id]
        quiet_left = self._seen.quiet_seconds - (self._clock.monotonic() - attempt.in_doubt_since)
        is_closed = self._clock.now() >= row.closes_at
        try:
            if self._is_other_machine(row):
                self._give_up(row, message("the robot has been replaced by another machine"))
                return
            if found := self._duplicates.own.of(row):
                in_doubt = max(0.0, self._clock.monotonic() - attempt.in_doubt_since)
                self._found(row, found, self._clock.now() - timedelta(seconds=in_doubt))
                return
            self._note_not_there(attempt)
            age = self._since(attempt.sent_since, attempt.in_doubt_since)
            if quiet_left <= 0 and (
                problem := self._duplicates.own.why_uncertain(
                    row, attempt.is_taken, may_change_robot(row), age, attempt.unasked
                )
            ):
                self._give_up(row, problem)
                return
        except RobotError as error:
            if quiet_left <= 0 and (is_closed or isinstance(error, Ambiguous)):
                self._give_up(row, error.message)
            else:
                attempt.wake_at = self._clock.monotonic() + 2 * RECONCILE_EVERY
            return
        if quiet_left > 0:
            attempt.wake_at = self._clock.monotonic() + min(RECONCILE_EVERY, quiet_left)
        else:
            self._is_not_there(row)
            self._duplicates.watch_for(row)

    def _is_other_machine(self, row: Execution) -> bool:
        """Whether another machine answers, whose queue must not be read as the robot's. A fleet that has lost contact with
        the robot is the known fleet, and is asked if it is known how orders are recognised there. Raises RobotError."""
        try:
            status = self._seen.read_status()
        except VehicleUnavailable:
            if self._client.capabilities.find_by is not FindBy.ID and self._seen.known is None:
                raise
            return False
        if is_other_machine(row, status.serial_number):
            return True
        self._seen.identify()  # with other software it may answer in another way
        return False

    def _is_not_there(self, row: Execution) -> None:
        """Not on the robot: failed, or refused if the robot said why."""
        answer = row.wait_details.get("answer")
        if row.wait_details.get("is_reason") and self._ledger.wanted(row).why is None:
            self._refused(
                [row], self._said_of_parameters(row, Reason(ReasonCode.REFUSED, {"problem": answer})), may_come=True
            )
        else:
            self._failed([row], answer or message("the robot did not receive it"), waited=True)

    def _said_of_parameters(self, row: Execution, refused: Reason) -> Reason:
        """A refusal usually means that the mission was edited: why the robot refuses the parameters, if it says so."""
        if row.parameters and refused.code is ReasonCode.REFUSED:
            with contextlib.suppress(RobotError):
                return self._s.parameters.refusal(row, self._robot_id, self._client) or refused
        return refused

    def _found(self, row: Execution, items: list[QueueItem], left_at: datetime | None = None) -> None:
        """``left_at``: when its request was sent, if known: robots' times have no known zone."""
        first, *later = items
        self._accepted(row, first.id, left_at)
        self.note()
        for item in later:
            if not self._duplicates.cancel_copy(item, row):
                self._duplicates.watch_from(row, first.id)

    def _give_up(self, row: Execution, problem: Message) -> None:
        self._ledger.apply([self._duplicates.give_up(row, problem)])
        self.attempts.pop(row.id, None)


def _is_own(row: Execution, verdict: Verdict) -> bool:
    """Whether it waits for this robot, and for no other."""
    return not may_change_robot(row) and "robot_id" not in (verdict.columns or {})


def _sent_at(row: Execution) -> datetime:
    """When its first attempt was, at the earliest."""
    return (row.begun_at if row.attempts == 1 else None) or row.planned_at
