"""Puts the waiting executions of one robot on its queue, each exactly once (docs/reliability.md).

The robot's POST has no idempotency key and links drop answers, so the intent is on disk before the POST, and an unknown outcome is never
retried: the robot's queue is asked first. Called by the robot's worker only, one call at a time.
"""
from __future__ import annotations

import contextlib
import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from app.database.executions import Unsent
from app.domain import rules
from app.domain.clock import Clock
from app.domain.message import Message, message, message_of, render
from app.domain.models import Execution, Reason, ReasonCode, Robot, Settings, State, Wait
from app.domain.robot import QueueItem, RobotStatus
from app.mir.client import RobotClient
from app.mir.errors import Delivery, Rejected, RobotError, Unauthorized
from app.services.dispatch.ledger import Ledger, Move
from app.services.live.alarms import Alarms
from app.services.live.gaps import Downtime
from app.services.live.holds import Holds

log = logging.getLogger(__name__)

RECONCILE_EVERY = 2.0        # s between reads of a queue in which a submission may still appear
STATUS_IS_FRESH = 2.0        # s for which one status read serves several executions due together
RECHECK = 2.0                # s between checks of what an execution waits for (battery, hold)
HANDED_OVER_WITHIN = 2.0     # s that an intent may take from the planner to its worker
SEARCHED_AFTER_RESTORE = 1000    # newest queue items that are searched after a restore, for submissions that the backup does not know


@dataclass(frozen=True)
class Ready:
    """What is known of a robot to which something can go out at once: read a moment ago."""
    battery: float | None
    queue_floor: int


class WrongRobot(Exception):
    """Another serial number answers at this address."""

    def __init__(self, expected: str, found: str) -> None:
        self.expected, self.found = expected, found
        self.message = message("serial number {found} answers where {expected} was expected", found=found, expected=expected)
        super().__init__(render(self.message))


@dataclass
class _Memory:
    """What one robot's dispatch remembers between calls. All instants are monotonic, so a clock step moves none of them;
    lost with the process, which then waits the full quiet time again."""
    not_before: dict[int, float] = field(default_factory=dict)
    unknown_since: dict[int, float] = field(default_factory=dict)
    reconciled: set[int] = field(default_factory=set)    # never forgotten: an intent may be handed over after its reconciliation

    def forget_all_but(self, open_ids: set[int]) -> None:
        for memory in (self.not_before, self.unknown_since):
            for gone in memory.keys() - open_ids:
                del memory[gone]


class Dispatcher:
    def __init__(self, robot: Robot, client: RobotClient, *, ledger: Ledger, clock: Clock, holds: Holds, alarms: Alarms, downtime: Downtime,
                 settings: Callable[[], Settings], restored_at: datetime | None, read_status: Callable[[], RobotStatus],
                 queue_floor: Callable[[], int | None]) -> None:
        self._robot, self._client = robot, client
        self._ledger, self._clock, self._holds, self._alarms, self._downtime = ledger, clock, holds, alarms, downtime
        self._settings, self._restored_at, self._read_status, self._queue_floor = settings, restored_at, read_status, queue_floor
        self.user_name = ""                               # who we are to the robot, once it has been asked
        self._tokens_come_back: bool | None = None        # not known yet
        self._memory = _Memory()
        self._handed_over: set[int] = set()               # in this call: executions that the robot has now
        self._taken: list[Move] = []                      # accepted by the robot, not yet written to the ledger
        self._status_read = (-math.inf, None, None)  # type: tuple[float, RobotStatus | None, Exception | None]

    def run(self, only: int | None = None) -> float:
        """Do what can be done now; returns the seconds until the next call is wanted (inf: when something changes)."""
        self.note()
        unsent = self._unsent(only)
        open_ids = {each.id for each in unsent}
        self._memory.forget_all_but(open_ids)
        self._handed_over.clear()
        unreachable: list[Execution] = []
        for execution in rules.in_dispatch_order(self._ledger.unsent([each.id for each in unsent if self._is_awake(each)])):
            if execution.state is State.SUBMITTING:
                self._reconcile(execution)
            elif self._is_to_be_tried(execution):
                if self._status_now()[0] is None:
                    unreachable.append(execution)
                else:
                    self._try(execution)
        if unreachable:
            self._read_failed(unreachable, self._status_now()[1])
        return math.inf if open_ids <= self._handed_over else self._next_call(only)

    def ready(self) -> Ready | None:
        """What the robot's last status says, if it is recent enough to send without reading it again; else None. Changes nothing: the
        scheduler's thread may call it."""
        read_at, status, _error = self._status_read
        floor = self._queue_floor()
        if status is None or floor is None or self._clock.monotonic() - read_at > STATUS_IS_FRESH:
            return None
        if self._restored_at is not None or self._holds.active(self._robot.id):
            return None
        return Ready(status.battery_percentage, floor)

    def send(self, intent: Execution, needs_recheck: bool = True) -> bool:
        """The first attempt of an execution whose intent was written for its instant; returns whether the robot has accepted it. ``note``
        writes that to the ledger.

        Not sent: one that ``run`` is reconciling already; one whose robot is not ready any more (the last submission got no answer, or a
        hold was set), which then waits like any other; one that was cancelled or whose schedule was changed, which is checked when it
        ``needs_recheck``, and which then ends.
        """
        if intent.id in self._memory.reconciled:
            return False
        is_revoked = needs_recheck and self._ledger.revocation_reason(intent) is not None
        if is_revoked or self.ready() is None or self._clock.now() >= intent.closes_at:
            self._ledger.release_unsent([intent])
            self._memory.not_before.pop(intent.id, None)         # it is no longer being handed over
            return False
        return self._send(intent, self._settings())

    def note(self) -> None:
        """Write what the robot has accepted. It may wait: were it lost, reconciliation would find it on the robot."""
        if not self._taken:
            return
        for accepted in self._ledger.make(self._taken, patient=True):
            if accepted.cancel_code and accepted.queue_id is not None:        # cancelled while it was on its way
                self._cancel_item(accepted.queue_id)
        self._taken.clear()

    def prepare(self) -> None:
        """Something falls due in about a second: read the status ahead, so that then only the intent and the POST remain."""
        if self._clock.monotonic() - self._status_read[0] > STATUS_IS_FRESH / 2:
            with contextlib.suppress(RobotError, WrongRobot):         # it is asked again at the instant itself, and only that counts
                self._status_read = (self._clock.monotonic(), self._read_status(), None)

    def _unsent(self, only: int | None) -> list[Unsent]:
        return [each for each in self._ledger.unsent_of(self._robot.id) if only in (None, each.id)]

    def _is_awake(self, unsent: Unsent) -> bool:
        """Whether it has to be handled now. Hundreds may wait for an unreachable robot: each is loaded when its time has come."""
        return (unsent.state is State.SUBMITTING or unsent.is_cancelled or self._clock.now() >= unsent.closes_at
                or self._memory.not_before.get(unsent.id, -math.inf) <= self._clock.monotonic()
                or self._holds.active(self._robot.id) is not None)

    def _next_call(self, only: int | None) -> float:
        waits = [math.inf]
        now, mono = self._clock.now(), self._clock.monotonic()
        for unsent in self._unsent(only):
            until = self._memory.not_before.get(unsent.id, mono) - mono
            if unsent.state is State.WAITING:
                until = min(until, (unsent.closes_at - now).total_seconds())
            waits.append(max(0.0, until))
        return min(waits)

    def _later(self, execution: Execution, seconds: float) -> None:
        self._memory.not_before[execution.id] = self._clock.monotonic() + seconds

    # ------------------------------------------------------------------ waiting
    def _is_to_be_tried(self, execution: Execution) -> bool:
        """One waiting execution: whether it is to be tried now; else it is ended here, or left waiting."""
        now = self._clock.now()
        if execution.cancel_code:
            self._ledger.end(execution, Reason(execution.cancel_code))
        elif now >= execution.closes_at:
            was_down = self._downtime.overlaps(execution.planned_at, execution.closes_at)
            self._ledger.end(execution, rules.when_window_closed(execution, was_down))
        elif hold := self._holds.active(self._robot.id):
            self._ledger.waits(execution, Wait.CLOCK if hold.clock else Wait.HOLD, hold=hold.reason)
            self._later(execution, RECHECK)
        elif timedelta() < (early := execution.planned_at - now) <= rules.INTENT_LEAD:     # released by a worker that was closed
            self._later(execution, early.total_seconds())
        elif not self._is_held_for_late_start(execution):
            return self._memory.not_before.get(execution.id, -math.inf) <= self._clock.monotonic()
        return False

    def _is_held_for_late_start(self, execution: Execution) -> bool:
        """A late start after the app was off is listed for some seconds first, on the monotonic clock from when it is first seen."""
        if execution.hold_until is None or execution.wait is not Wait.LATE_START:
            return False
        if execution.id not in self._memory.not_before:
            left = (execution.hold_until - self._clock.now()).total_seconds()
            self._later(execution, min(max(left, 0.0), rules.LATE_START_HOLD.total_seconds()))
        return self._memory.not_before[execution.id] > self._clock.monotonic()

    def _try(self, execution: Execution) -> None:
        """Send it, if the battery allows that and the robot's queue can be read. The status was read a moment ago."""
        settings, (status, _error) = self._settings(), self._status_now()
        battery, minimum = status.battery_percentage if status else None, execution.minimum_battery_percent
        if not rules.battery_allows(battery, minimum):
            self._ledger.waits(execution, Wait.BATTERY, battery=battery, minimum=minimum)
            self._later(execution, RECHECK)
            return
        try:
            floor = self._queue_floor()
            if floor is None:
                floor = self._client.highest_queue_id() or 0
            already_there = self._from_before_restore(execution, floor)
        except RobotError as problem:
            self._read_failed([execution], problem)
            return
        if self._clock.now() >= execution.closes_at:
            return                                    # the reads took too long; ended by the next call
        if intent := self._ledger.begin_attempt(execution, floor):
            if already_there:
                self._found(intent, already_there)
            else:
                self._send(intent, settings)
                self.note()

    def _from_before_restore(self, execution: Execution, floor: int) -> list[QueueItem]:
        """A restored backup may not know that this occurrence was sent already; its token is the same, so the robot's queue shows it."""
        if self._restored_at is None or execution.planned_at > self._restored_at or execution.attempts:
            return []
        newest = self._client.items_after(max(0, floor - SEARCHED_AFTER_RESTORE))
        return sorted((item for item in newest if item.description == execution.token), key=lambda item: item.id)

    def _status_now(self) -> tuple[RobotStatus | None, Exception | None]:
        """One status read serves all that fall due together: reachability, serial number and battery are judged on it."""
        read_at, status, error = self._status_read
        if self._clock.monotonic() - read_at > STATUS_IS_FRESH:
            try:
                status, error = self._read_status(), None
            except (RobotError, WrongRobot) as problem:
                status, error = None, problem
            self._status_read = (self._clock.monotonic(), status, error)
        return status, error

    def _read_failed(self, executions: list[Execution], error: Exception | None) -> None:
        """A read before the POST brought nothing: final for a wrong robot or user, else an attempt of each that failed."""
        match error:
            case WrongRobot():
                self._end_all(executions, Reason(ReasonCode.WRONG_ROBOT, {"expected": error.expected, "found": error.found}))
            case Unauthorized():
                self._end_all(executions, Reason(ReasonCode.UNAUTHORIZED, {"problem": error.message}))
            case _:
                self._attempts_failed(executions, "" if error is None else message_of(error), self._settings())

    def _end_all(self, executions: list[Execution], reason: Reason) -> None:
        self._ledger.make([self._ledger.ended(execution, reason, (execution.state,)) for execution in executions])

    def _attempts_failed(self, executions: list[Execution], problem: Message, settings: Settings, waited: bool = False) -> None:
        """Certainly nothing on the robot: try again later (at once, when it has ``waited`` enough), or give up at the retry limit."""
        given_up: list[Move] = []
        for waiting in self._ledger.make([self._ledger.attempt_failed(execution, problem) for execution in executions]):
            cancelled = Reason(waiting.cancel_code) if waiting.cancel_code else None
            if reason := cancelled or rules.after_failed_attempt(waiting, settings, problem):
                given_up.append(self._ledger.ended(waiting, reason, (State.WAITING,)))
            else:
                self._later(waiting, 0.0 if waited else rules.back_off(waiting.attempts, settings))
        self._ledger.make(given_up)

    # ------------------------------------------------------------------ submitting
    def _send(self, intent: Execution, settings: Settings) -> bool:
        """The POST itself; returns whether the robot has it. ``description`` carries the token; ``message`` is for people and the robot
        overwrites it."""
        try:
            queue_id = self._client.enqueue(intent.mission_guid, description=intent.token, text=intent.schedule or intent.mission,
                                            priority=intent.priority, parameters=dict(intent.parameters))
        except RobotError as error:
            self._not_accepted(intent, error, settings)
            return False
        self._adopt(intent, queue_id)
        return True

    def _not_accepted(self, intent: Execution, error: RobotError, settings: Settings) -> None:
        if error.delivery is Delivery.NOT_SENT:
            self._status_read = (-math.inf, None, None)
            self._attempts_failed([intent], error.message, settings)
        elif error.delivery is Delivery.REFUSED:
            self._ledger.end(intent, self._refusal(intent, error))
        else:
            log.warning("#%d on %r: outcome unknown, looking at the robot's queue (%s)", intent.id, self._robot.name, error.text)
            self._status_read = (-math.inf, None, None)
            self._memory.unknown_since[intent.id] = self._clock.monotonic()
            self._later(intent, RECONCILE_EVERY)

    def _refusal(self, intent: Execution, error: RobotError) -> Reason:
        """What the operator has to mend. A 400 or 404 may mean the mission: the robot is asked whether it has it."""
        if isinstance(error, Unauthorized):
            return Reason(ReasonCode.UNAUTHORIZED, {"problem": error.message})
        if isinstance(error, Rejected) and error.status in (400, 404):
            try:
                self._client.mission(intent.mission_guid)
            except Rejected as answer:
                if answer.status in (404, 410):
                    return Reason(ReasonCode.UNKNOWN_MISSION, {"mission": intent.mission})
            except RobotError as unheard:
                log.info("Whether %r has mission %s could not be asked: %s", self._robot.name, intent.mission_guid, unheard.text)
        return Reason(ReasonCode.REFUSED, {"problem": error.message})

    def _adopt(self, intent: Execution, queue_id: int) -> None:
        self._taken.append(self._ledger.accepted(intent, queue_id))
        self._handed_over.add(intent.id)

    def _cancel_item(self, queue_id: int) -> None:
        try:
            self._client.cancel(queue_id)
        except RobotError as error:
            log.warning("Item %d of %r could not be cancelled yet: %s", queue_id, self._robot.name, error.text)

    # ------------------------------------------------------------------ unknown outcome
    def _reconcile(self, intent: Execution) -> None:
        """Reconcile a submission of unknown outcome with the robot's queue."""
        if self._may_be_on_its_way(intent):
            self._later(intent, HANDED_OVER_WITHIN)
            return
        self._memory.reconciled.add(intent.id)
        now = self._clock.monotonic()
        since = self._memory.unknown_since.setdefault(intent.id, now)    # after a restart the quiet time counts from zero
        if self._memory.not_before.get(intent.id, -math.inf) > now:
            return
        settings = self._settings()
        quiet_is_over = now - since >= settings.unknown_outcome_quiet_seconds
        window_is_over = self._clock.now() >= intent.closes_at
        try:
            self._read_status()                        # never read another machine's queue as this one's
            found = self._items_of(intent)
            if found:
                self._found(intent, found)
                return
            if quiet_is_over and intent.queue_floor and (self._client.highest_queue_id() or 0) < intent.queue_floor:
                self._give_up_unknown(intent, message("its queue was reset"))
                return
        except (RobotError, WrongRobot) as error:
            if quiet_is_over and window_is_over:
                self._give_up_unknown(intent, message_of(error))
            else:
                self._later(intent, min(rules.back_off(2, settings), RECONCILE_EVERY * 2))
            return
        if not quiet_is_over:
            self._later(intent, min(RECONCILE_EVERY, settings.unknown_outcome_quiet_seconds - (now - since)))
        else:
            self._absent(intent, window_is_over, settings)

    def _may_be_on_its_way(self, intent: Execution) -> bool:
        """Just written by the planner and not handed over yet. By the wall clock: a wrong answer delays, but sends nothing."""
        age = abs((self._clock.now() - intent.created_at).total_seconds())
        return intent.attempts == 1 and intent.id not in self._memory.unknown_since and age < HANDED_OVER_WITHIN

    def _items_of(self, intent: Execution) -> list[QueueItem]:
        """The items that this submission put on the robot, by its token; oldest first."""
        newer = sorted(self._client.items_after(intent.queue_floor or 0), key=lambda item: item.id)
        found = [item for item in newer if item.description == intent.token]
        if found or not newer or self._gives_tokens_back():
            return found
        return [item for item in newer if self._may_be_of(intent, item)][:1]

    def _gives_tokens_back(self) -> bool:
        """Whether this robot returns a description as it was sent, judged by the newest item of ours that it has. MiR's definition says so;
        that every software does is a guess."""
        if self._tokens_come_back is None:
            last = self._ledger.last_accepted(self._robot.id)
            try:
                item = self._client.queue_item(last.queue_id) if last and last.queue_id is not None else None
            except Rejected:                          # deleted, or its id is another item's now
                item = None
            if last is None or item is None or item.mission_id != last.mission_guid:
                return True
            self._tokens_come_back = item.description == last.token
        return self._tokens_come_back

    def _may_be_of(self, intent: Execution, item: QueueItem) -> bool:
        """Without tokens: the same mission, put there since by the same user, claimed by no other execution."""
        return (item.mission_id == intent.mission_guid and item.created_by_name in ("", self.user_name or item.created_by_name)
                and not self._ledger.is_claimed(self._robot.id, item.id))

    def _found(self, intent: Execution, items: list[QueueItem]) -> None:
        self._memory.unknown_since.pop(intent.id, None)
        first, *copies = items
        self._adopt(intent, first.id)
        self.note()
        for copy in copies:
            self.cancel_duplicate(copy, intent)

    def cancel_duplicate(self, item: QueueItem, execution: Execution) -> None:
        """A later item with a token that is already claimed is cancelled while it is pending, and an alarm is raised."""
        if item.is_pending:
            self._cancel_item(item.id)
        self._alarms.raise_("duplicate_healed" if item.is_pending else "duplicate_running", f"execution:{execution.id}",
                            robot=self._robot.name, robot_id=self._robot.id, mission=execution.mission, queue_id=item.id)

    def _give_up_unknown(self, intent: Execution, problem: Message) -> None:
        self._alarms.raise_("unknown_outcome", f"execution:{intent.id}", robot=self._robot.name, robot_id=self._robot.id,
                            mission=intent.mission, problem=problem)
        self._ledger.end(intent, Reason(ReasonCode.UNKNOWN_OUTCOME, {"problem": problem}))

    def _absent(self, intent: Execution, window_is_over: bool, settings: Settings) -> None:
        """Not on the robot, and no request can still arrive: as if the attempt had failed."""
        self._memory.unknown_since.pop(intent.id, None)
        problem = message("the robot did not receive it")
        if window_is_over and not intent.cancel_code and intent.attempts <= settings.retry_limit:
            self._ledger.end(intent, Reason(ReasonCode.WINDOW_CLOSED, {"attempts": intent.attempts, "until": intent.closes_at.isoformat(),
                                                                      "problem": problem}))
        else:
            self._attempts_failed([intent], problem, settings, waited=True)   # the quiet time was wait enough
