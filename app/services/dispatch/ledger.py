"""The execution ledger: every change of an execution is one short transaction, published to listeners and written to the log.

Each method returns the row after its move, or None when the row had moved on in the meantime (somebody cancelled it): then nothing
was changed and the caller must not act on it.
"""
from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any

from app.database.connection import Database
from app.database.executions import UNBOUND, ExecutionFilter, ExecutionRepository, Unsent
from app.database.group_starts import FullPlace, GroupStartRepository, Watch, Watched
from app.database.robots import Accepted, RobotRepository
from app.database.settings import SettingsRepository
from app.domain.clock import Clock
from app.domain.drain import Used
from app.domain.message import Message
from app.domain.models import OPEN_STATES, Execution, Reason, ReasonCode, Robot, State, Trigger, Wait
from app.domain.reasons import sentence, to_store
from app.domain.robot import QueueItem
from app.services.dispatch.timing import WATCHED_FOR
from app.services.live.alarms import Alarms
from app.services.live.changes import NO_ROBOT, Changes, Topic
from app.services.planning.wanted import changed_since, why_unwanted

log = logging.getLogger("app.executions")
_ENDS_BY = ("mission", "closes_at", "finish_by", "tried")     # what waits
NOT_WITH_THE_ROBOT = (State.WAITING, State.SUBMITTING)       # or at least may be
WITH_THE_ROBOT = (State.QUEUED, State.EXECUTING)
MAY_BE_WITH_THE_ROBOT = (State.SUBMITTING, *WITH_THE_ROBOT)


@dataclass(frozen=True)
class Move:
    """A change of an execution that is still in one of the ``expected`` states."""
    execution: Execution
    expected: Sequence[State]
    columns: Mapping[str, Any]
    watch: Watch | None = None
    needs_room: bool = False             # at the places that its mission uses; else it is not made
    used: Used | None = None             # of its robot's battery, where that is known

    @property
    def is_end_by_judgement(self) -> bool:
        """By what was read of it a moment ago, and not because nobody wants it."""
        return self.columns.get("ended_at") is not None and self.columns["state"] is not State.CANCELLED

    @property
    def is_defined_anew(self) -> bool:
        """Whether it is about to be sent, or waits to be sent again: as its schedule is defined by now."""
        state = self.columns.get("state")
        return state is State.SUBMITTING or (state is State.WAITING and self.execution.state is State.SUBMITTING)


def taken_back(row: Execution) -> Reason | None:
    """Why it must not be sent (again). ``row`` was read a moment ago."""
    return Reason(row.cancel_code) if row.cancel_code else row.revoked


def was_replaced(row: Execution, serial_number: str | None) -> bool:
    """Whether another machine than the one it was sent to is the row's robot now."""
    return None not in (row.robot_serial, serial_number) and row.robot_serial != serial_number


class Ledger:
    def __init__(self, db: Database, executions: ExecutionRepository, settings: SettingsRepository, clock: Clock, changes: Changes,
                 alarms: Alarms) -> None:
        self._db, self._executions, self._settings = db, executions, settings
        self._clock, self._changes, self._alarms, self._robots = clock, changes, alarms, RobotRepository()
        self._starts = GroupStartRepository()
        self.grew = True                     # rows ended since the history was last held to its limit

    # ------------------------------------------------------------------ reading
    def get(self, execution_id: int) -> Execution | None:
        return self._executions.get(self._db.read(), execution_id)

    def open_for(self, robot_id: int, states: Sequence[State] = OPEN_STATES) -> list[Execution]:
        return self._executions.open_for(self._db.read(), robot_id, states)

    def unsent_of(self, robot_id: int) -> list[Unsent]:
        """What waits for a robot, or is on its way to it, in short."""
        return self._executions.unsent_of(self._db.read(), robot_id)

    def unsent(self, ids: Sequence[int]) -> list[Execution]:
        """Those of these that still wait or are on their way."""
        return self._executions.in_states(self._db.read(), ids, NOT_WITH_THE_ROBOT)

    def has_sent(self, robot_id: int) -> bool:
        """Whether anything of ours is with this robot, or may be."""
        return self._executions.has_sent(self._db.read(), robot_id)

    def by_token(self, token: str) -> Execution | None:
        return self._executions.by_token(self._db.read(), token)

    def is_claimed(self, robot_id: int, queue_id: int) -> bool:
        """Whether that queue item is an execution's already."""
        return self._executions.is_claimed(self._db.read(), robot_id, queue_id)

    def planned_between(self, robot_id: int, start: datetime, end: datetime) -> list[Execution]:
        wanted = ExecutionFilter(robot_ids=[robot_id], start=start, end=end)
        return list(self._executions.stream(self._db.read(), wanted))

    def has_open_idle(self, robot_id: int) -> bool:
        return any(row.trigger is Trigger.IDLE for row in self.open_for(robot_id))

    # ------------------------------------------------------------------ moves
    def add(self, execution: Execution) -> Execution | None:
        """Write a new row; None when its token is already in the ledger."""
        return self._added(lambda c: self._executions.add_once(c, execution))

    def add_idle(self, execution: Execution, robot: Robot) -> None:
        """Write the row of an idle mission, unless ``robot`` or its rule has been changed since it was read. Its idle period has then had
        its mission."""
        def work(c: Any) -> Execution | None:
            now = self._robots.get(c, robot.id)
            if now is None or not now.enabled or (now.address, now.idle) != (robot.address, robot.idle):
                return None
            self._robots.note_idle(c, robot.id, execution.queue_floor)
            return self._executions.add_once(c, execution)
        self._added(work)

    def _added(self, work: Callable[[Any], Execution | None]) -> Execution | None:
        added = self._db.write(work)
        if added:
            self._announce(added)
        return added

    def note_idle_copy(self, robot_id: int, queue_id: int, *, runs: bool) -> None:
        """A second copy of an idle mission is no use of the robot by anybody: where it runs, it is what the robot did last by itself; where
        it does not, nothing must have been between."""
        last = self._robots.idle_queue_id(self._db.read(), robot_id) or 0
        if queue_id == last + 1 or (runs and queue_id > last):
            self._db.write(lambda c: self._robots.note_idle(c, robot_id, queue_id))

    def forget_idle(self, robot_id: int) -> None:
        """There was no idle mission in this idle period."""
        self._db.write(lambda c: self._robots.note_idle(c, robot_id, None))

    def waiting(self, execution: Execution, wait: Wait, **details: Any) -> list[Move]:
        """What holds a waiting execution; none where that is nothing new."""
        is_known = (execution.wait, dict(execution.wait_details)) == (wait, details)
        return [] if is_known else [Move(execution, (State.WAITING,), {"wait": wait, "wait_details": details})]

    def waits(self, execution: Execution, wait: Wait, **details: Any) -> Execution | None:
        """Note what holds a waiting execution; writes only when that is something new."""
        if (execution.wait, dict(execution.wait_details)) == (wait, details):
            return execution
        return self._change(execution, (State.WAITING,), quietly=execution.wait is wait, wait=wait, wait_details=details)

    def end(self, execution: Execution, reason: Reason) -> Execution | None:
        """End an open execution with a reason, whose code gives the state."""
        return next(iter(self.make([self.ended(execution, reason, (execution.state,))])), None)

    def make(self, moves: Sequence[Move], patient: bool = False, quietly: bool = False) -> list[Execution]:
        """Moves found by one read of a robot, in one transaction; the rows after those that could be made. Several moves of one
        execution are made in their order. ``patient`` ones may wait some ms to share a transaction; of ``quietly`` made ones the log says
        nothing: what follows within moments tells more."""
        if not moves:
            return []
        changed = self._db.write(lambda c: [row for move in moves if (row := self._made(c, move))], patient)
        for row in changed:
            if not quietly:
                log.info("%s", describe(row))
            if row.ended_at is not None:
                self.grew = True
                self.alarm_for(row)
        for robot_id in {row.robot_id or NO_ROBOT for row in changed}:
            self._changes.publish(Topic.EXECUTIONS, robot_id)
        return changed

    def _made(self, c: Any, move: Move) -> Execution | None:
        if move.needs_room and self._starts.full_place(c, move.execution):
            return None
        columns, expected = dict(move.columns), move.expected
        if State.WAITING in expected and move.is_end_by_judgement and not self._is_as_judged(c, move.execution):
            return None
        if move.is_defined_anew:
            anew = changed_since(c, replace(move.execution, tried=columns.get("tried", move.execution.tried)))
            if anew is None and columns["state"] is State.SUBMITTING:
                return None                              # nothing wants it any more: no intent, no request
            columns |= anew or {}
        if State.CANCELLED in expected and why_unwanted(c, move.execution):
            expected = (State.SUBMITTING,)
        if State.WAITING in expected:                    # which edits change too
            made = self._executions.change(c, move.execution.id, expected, of_robot=move.execution.robot_id, **columns)
        else:
            made = self._executions.change_owned(c, move.execution, expected, **columns)
        if made and made.state is State.WAITING and move.execution.state is State.SUBMITTING and (reason := taken_back(made)):
            made = self._executions.change_owned(c, made, (State.WAITING,), **self.ended(made, reason).columns)     # not even for a moment
        if made and made.state is State.QUEUED and made.queue_id is not None and made.robot_id is not None:
            self._robots.note_accepted(c, made.robot_id, Accepted(made.queue_id, made.token))
            if made.trigger is Trigger.IDLE:
                self._robots.note_idle(c, made.robot_id, made.queue_id)
        if made and move.watch is not None:
            self._starts.watch(c, move.watch)
        if made and move.used is not None and made.robot_id is not None:
            self._robots.note_used(c, made.robot_id, made.robot_serial, move.used)
        return made

    def _is_as_judged(self, c: Any, execution: Execution) -> bool:
        """Whether what its end rests on is still as it was read: somebody may just have given it more time, or another mission."""
        now = self._executions.get(c, execution.id)
        return now is not None and all(getattr(now, name) == getattr(execution, name) for name in _ENDS_BY)

    def begun(self, execution: Execution, robot: Robot, queue_floor: int | None) -> Move:
        """The intent on disk before the POST: ``submitting``, one attempt more, and the highest queue id known before it. The floor of the
        first attempt on this machine is kept: everything that this execution ever put there lies above it."""
        is_first = execution.queue_floor is None or was_replaced(execution, robot.serial_number)
        floor = queue_floor if is_first else execution.queue_floor
        return Move(execution, (State.WAITING,), {"state": State.SUBMITTING, "attempts": execution.attempts + 1, "queue_floor": floor,
                                                  "robot_address": robot.address, "robot_serial": robot.serial_number}, needs_room=True)

    def accepted(self, execution: Execution, robot: Robot, queue_id: int, since: datetime | None = None) -> Move:
        """The robot has it, (None:) since now. If this were never written, the robot would be asked."""
        return Move(execution, (State.SUBMITTING,), {
            "state": State.QUEUED, "queue_id": queue_id, "submitted_at": since or self._clock.now(), "robot_address": robot.address,
            "robot_serial": robot.serial_number})

    def adopted(self, execution: Execution, robot: Robot, item: QueueItem) -> Move:
        """It is on a robot already: the one that it waits for, or another one."""
        return Move(execution, (State.WAITING,), {
            "state": State.QUEUED, "queue_id": item.id, "token": item.description, "submitted_at": self._clock.now(),
            "attempts": max(1, execution.attempts), "queue_floor": item.id - 1, "robot_id": robot.id, "robot": robot.name,
            "robot_address": robot.address, "robot_serial": robot.serial_number})

    def given_back(self, execution: Execution, robot_id: int, tried: Mapping[str, Any], *, is_attempt: bool, may_come: bool) -> Move:
        """A start of a group of which certainly nothing is on this robot has none again. ``tried``: what became of it here. ``is_attempt``:
        it counts as one, also where it never reached the POST. ``may_come``: its request may still come here."""
        attempts = execution.attempts + (execution.state is State.WAITING and is_attempt)
        return Move(execution, NOT_WITH_THE_ROBOT, {
            **UNBOUND, "state": State.WAITING, "wait": Wait.ROBOT, "wait_details": {}, "attempts": attempts,
            "tried": {**execution.tried, str(robot_id): tried}}, self._watch(execution, robot_id) if may_come else None)

    def unbound_again(self, execution: Execution) -> Move:
        """A start of a group that its robot could not begin is for any of them again; nothing is held against this one."""
        return Move(execution, (State.WAITING,), UNBOUND)

    def give_back_bound(self, robot_id: int | None = None) -> None:
        """The same of all that waits for this robot, or for any, but where a person chose it."""
        robots = [robot for robot in self._starts.bound(self._db.read()) if robot_id in (None, robot)]
        if robots:
            self._db.write(lambda c: [self._executions.give_back(c, robot, but_persons=True) for robot in robots])
            self._changes.publish(Topic.EXECUTIONS, NO_ROBOT)

    def may_get(self, execution: Execution) -> bool:
        """Whether the robot that a start of a group was given to is still one that may get it."""
        return self._starts.may_get(self._db.read(), execution)

    def is_edited(self, execution: Execution) -> bool:
        """Whether its schedule or idle rule wants something else since its intent was written, or nothing."""
        return changed_since(self._db.read(), execution) != {}

    def is_wanted(self, execution: Execution) -> bool:
        """Whether anything still wants it, as it is or otherwise."""
        return changed_since(self._db.read(), execution) is not None

    def full_place(self, execution: Execution) -> FullPlace | None:
        """A place that it uses at which there is no room; None: there is room everywhere."""
        return self._starts.full_place(self._db.read(), execution)

    def bound(self, execution: Execution, robot: Robot, mission_guid: str, choice: Mapping[str, Any],
              intent_floor: int | None = None, approach_m: float | None = None) -> Move:
        """A robot of its group is chosen. What was ever sent to it lies above the floor of the first time, on the machine of that time.
        ``intent_floor``: it was never there, and is about to be sent; the highest queue id known of that robot. ``approach_m``: straight
        way to the mission's first stop, of a robot that goes there at once."""
        before = execution.tried.get(str(robot.id), {})
        columns: dict[str, Any] = {
            "robot_id": robot.id, "robot": robot.name, "mission_guid": mission_guid, "bound_at": self._clock.now(), "choice": choice,
            "approach_m": approach_m, "wait": Wait.DUE, "wait_details": {}, "queue_floor": before.get("floor"),
            "robot_serial": before.get("serial")}
        if intent_floor is not None:
            columns |= {**self.begun(execution, robot, intent_floor).columns, "queue_floor": intent_floor}
        return Move(execution, (State.WAITING,), columns)

    def bind(self, moves: Sequence[Move], into_queue: Collection[int] = (),
             hand_over: Callable[[Sequence[Execution]], None] = lambda intents: None) -> list[Execution]:
        """Those of these ``bound`` that could be made, in that order: unless anything has changed that the choice rested on.
        ``into_queue``: ids of those that go to their robot also where it has something of ours already. ``hand_over``: gives its worker
        what is to be sent at once."""
        def work(c: Any) -> list[Execution]:
            made = []
            for move in moves:
                row_id, robot_id = move.execution.id, move.columns["robot_id"]
                given = replace(move.execution, robot_id=robot_id, mission_guid=move.columns["mission_guid"])
                anew = changed_since(c, given)
                if anew is not None and self._starts.may_be_bound(c, move.execution, robot_id, row_id in into_queue):
                    made.append(self._executions.change(c, row_id, move.expected, **{**move.columns, **anew}))
            return [row for row in made if row is not None]
        rows = self._db.write(work) if moves else []
        hand_over([row for row in rows if row.state is State.SUBMITTING])          # before listeners are notified and read
        for row in rows:
            log.info("%s", describe(row))
            self._changes.publish(Topic.EXECUTIONS, row.robot_id)
        return rows

    def adopt(self, execution: Execution, robot: Robot, item: QueueItem) -> bool:
        """It is on a robot already: the one that it waits for, or another one, which it gets by way of none. Returns whether it still
        waited so."""
        moves = []
        if execution.robot_id not in (None, robot.id):
            moves.append(self.unbound_again(execution))
            execution = replace(execution, robot_id=None, robot="")
        return len(self.make([*moves, self.adopted(execution, robot, item)])) > len(moves)

    def watches_of(self, robot_id: int) -> list[Watched]:
        """What may still come to this robot though it was given up there, or may have come while nobody looked."""
        return self._starts.watches_of(self._db.read(), robot_id)

    def watch(self, execution: Execution, robot_id: int) -> None:
        """It may come to this robot, or run there, once more than wanted."""
        self._db.write(lambda c: self._starts.watch(c, self._watch(execution, robot_id)))

    def drop_watches(self, robot_id: int, tokens: Collection[str]) -> None:
        """The robot was searched for these when nothing could come any more."""
        self._db.write(lambda c: self._starts.drop_watches(c, robot_id, tokens), patient=True)

    def _watch(self, execution: Execution, robot_id: int | None) -> Watch:
        assert robot_id is not None, "it was sent to a robot"
        return Watch(execution.id, robot_id, execution.queue_floor or 0, self._clock.now() + timedelta(seconds=WATCHED_FOR))

    def unbound(self) -> list[Execution]:
        """What waits for a robot of a group, oldest first."""
        return self._starts.unbound(self._db.read())

    def not_tried(self, intent: Execution) -> Move:
        """An intent whose POST was not even begun; that of a group waits again though its robot has been removed meanwhile, where its plan
        still has it."""
        expected = (State.SUBMITTING,) if intent.group_id is None else (State.SUBMITTING, State.CANCELLED)
        return Move(intent, expected, {"state": State.WAITING, "attempts": intent.attempts - 1, "reason": None, "ended_at": None})

    def taken(self, execution: Execution) -> Move:
        """The robot has said so, and has given no number to find it by."""
        return Move(execution, (State.SUBMITTING,), {"submitted_at": self._clock.now()})

    def attempt_failed(self, execution: Execution, problem: Message, *, may_come: bool) -> Move:
        """An attempt that certainly put nothing on the robot. One that never reached the POST counts here. ``may_come``: as above. Where
        that was its first, nothing of it was ever there."""
        attempts = execution.attempts + (execution.state is State.WAITING)
        columns = {"state": State.WAITING, "attempts": attempts, "wait": Wait.RETRY, "wait_details": {"problem": problem}}
        if attempts == 1 and not may_come:
            columns["queue_floor"] = None
        return Move(execution, NOT_WITH_THE_ROBOT, columns, self._watch(execution, execution.robot_id) if may_come else None)

    def given_up(self, execution: Execution, reason: Reason) -> Move:
        """Ended without its outcome being known: it may be on the robot, or come there yet."""
        return replace(self.ended(execution, reason, (execution.state,)), watch=self._watch(execution, execution.robot_id))

    def started(self, execution: Execution, robot_delay_s: float | None, approach_m: float | None) -> Move:
        return Move(execution, (State.QUEUED,), {"state": State.EXECUTING, "started_at": self._clock.now(), "robot_delay_s": robot_delay_s,
                                                 "approach_m": approach_m})

    def completed(self, execution: Execution, duration_s: float | None, robot_delay_s: float | None, used: Used | None = None) -> Move:
        """Seen done; a fast one is first seen so, and then began about now."""
        now = self._clock.now()
        return Move(execution, WITH_THE_ROBOT, {"state": State.COMPLETED, "ended_at": now, "duration_s": duration_s,
                                                "robot_delay_s": robot_delay_s, "started_at": execution.started_at or now}, used=used)

    def ended(self, execution: Execution, reason: Reason, expected: Sequence[State] = WITH_THE_ROBOT,
              duration_s: float | None = None) -> Move:
        """Ended with a reason, whose code gives the state."""
        return Move(execution, expected, {"state": reason.state, "reason": reason, "ended_at": self._clock.now(), "duration_s": duration_s})

    def reopen(self, execution: Execution, robot: Robot, queue_id: int) -> Execution | None:
        """This robot has it after all, or another item than was thought: it is followed (again) to its end."""
        columns: dict[str, Any] = {"state": State.QUEUED, "queue_id": queue_id, "reason": None, "ended_at": None, "duration_s": None,
                                   "submitted_at": execution.submitted_at or self._clock.now()}
        moves = []
        if execution.robot_id != robot.id:                   # one of a group, which another one had been given, or none
            columns |= {"robot_id": robot.id, "robot": robot.name, "robot_address": robot.address, "robot_serial": robot.serial_number}
            moves = [Move(execution, (execution.state,), {"robot_id": None, "robot": ""})]
        moves.append(Move(execution, (execution.state,), columns))
        changed = self._db.write(lambda c: [self._executions.change(c, execution.id, move.expected, **move.columns) for move in moves])
        if changed[-1] is not None:
            self._announce(changed[-1])
            self._withdraw_alarms_of(execution)
        return changed[-1]

    def _withdraw_alarms_of(self, reopened: Execution) -> None:
        """It has not failed, as far as is known now."""
        if reopened.state is not State.FAILED or reopened.reason is None or reopened.ended_at is None:
            return
        if reopened.reason.code is ReasonCode.UNKNOWN_OUTCOME:
            self._alarms.withdraw("unknown_outcome", f"execution:{reopened.id}", reopened.ended_at)
        else:
            self._alarms.withdraw("execution_failed", _about(reopened), reopened.ended_at)

    def ask_cancel(self, executions: Sequence[Execution], code: ReasonCode | None) -> None:
        """Note that the operator has cancelled these (None: undo that); the robot's answer decides."""
        def work(c: Any) -> None:
            for execution in executions:
                self._executions.change(c, execution.id, OPEN_STATES, cancel_code=code)
        self._db.write(work)
        self._changes.publish(Topic.EXECUTIONS)

    def hold(self, ids: Collection[int], held: bool) -> int:
        """A person keeps these back while they wait, or lets them go; how many that was in time for."""
        columns: dict[str, Any] = {"held": held, "wait": Wait.HOLD if held else Wait.DUE, "wait_details": {}}
        changed = self._db.write(lambda c: [each for each in ids if self._executions.change(c, each, (State.WAITING,), **columns)])
        self._changes.publish(Topic.EXECUTIONS)
        return len(changed)

    def prune(self, has_time: Callable[[], bool]) -> None:
        """Hold the history to the newest N ended rows (the setting; None keeps all), in small pieces as long as there ``has_time``; the
        next call goes on. Costs nothing while nothing ended."""
        if not self.grew:
            return
        self.grew = False
        limit = self._settings.load(self._db.read()).history_limit
        if limit is None:
            return
        surplus = self._executions.surplus(self._db.read(), limit)
        while any(surplus):
            left = self._db.write(lambda c, surplus=surplus: self._executions.drop_oldest(c, surplus))  # type: ignore[misc]
            if any(left) and (left == surplus or not has_time()):
                self.grew = True
                return
            surplus = left

    def alarm_of_refusal(self, execution: Execution, robot: Robot, reason: Reason) -> None:
        """A robot has refused a start of a group for good, which another one may get."""
        self._alarms.raise_("start_refused", f"schedule:{execution.schedule_id}:robot:{robot.id}", mission=execution.mission,
                            robot=robot.name, robot_id=robot.id, group=execution.robot_group, reason=to_store(reason),
                            timezone=execution.timezone)

    def alarm_for(self, ended: Execution) -> None:
        """Raise the alarm of a failed or skipped execution, but of an idle mission that was overtaken, and of an unknown outcome, which has
        its own; repetitions of one schedule are counted."""
        code = {State.FAILED: "execution_failed", State.SKIPPED: "execution_skipped"}.get(ended.state)
        told_elsewhere = (ReasonCode.UNKNOWN_OUTCOME, *([ReasonCode.OVERLAP] if ended.trigger is Trigger.IDLE else []))
        if code and ended.reason and ended.reason.code not in told_elsewhere:
            self._alarms.raise_(code, _about(ended), mission=ended.mission, robot=ended.robot or ended.robot_group, robot_id=ended.robot_id,
                                reason=to_store(ended.reason), timezone=ended.timezone)

    # ------------------------------------------------------------------ inside
    def _change(self, execution: Execution, expected: Sequence[State], quietly: bool = False, **columns: Any) -> Execution | None:
        changed = self._db.write(lambda c: self._executions.change(c, execution.id, expected, **columns))
        if changed:
            self._announce(changed, quietly)
        return changed

    def _announce(self, execution: Execution, quietly: bool = False) -> None:
        if not quietly:
            log.info("%s", describe(execution))
        self._changes.publish(Topic.EXECUTIONS, execution.robot_id or NO_ROBOT)


def _about(ended: Execution) -> str:
    """The key of its alarm."""
    return f"schedule:{ended.schedule_id}" if ended.schedule_id else f"{ended.trigger}:{ended.robot_id}"


def describe(execution: Execution) -> str:
    """One English line for the log."""
    parts = [f"#{execution.id} {execution.mission!r} on {execution.robot!r} ({execution.trigger}): {execution.state}"]
    if execution.state is State.WAITING and execution.wait is not Wait.DUE:
        parts.append(f"[{execution.wait}]")
    if execution.queue_id is not None:
        parts.append(f"queue item {execution.queue_id}")
    if execution.attempts > 1:
        parts.append(f"attempt {execution.attempts}")
    if execution.reason:
        parts.append("– " + sentence(execution.reason, execution.timezone))
    return " ".join(parts)


def seconds_between(start: datetime | None, end: datetime | None) -> float | None:
    """The difference of two of the robot's own time stamps; its clock may be wrong, so only the difference counts."""
    if start is None or end is None:
        return None
    return max(0.0, (end - start).total_seconds())
