"""The execution ledger: every change of an execution is one short transaction, published to listeners and written to the log.

Each method returns the row after its move, or None when the row had moved on in the meantime (somebody cancelled it): then nothing
was changed and the caller must not act on it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

from app.database.connection import Database
from app.database.executions import ExecutionFilter, ExecutionRepository, Unsent
from app.database.group_executions import FullPlace, GroupExecutionRepository, Watched
from app.database.robots import Accepted, RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain import rules
from app.domain.clock import Clock
from app.domain.models import OPEN_STATES, Execution, InvalidInput, Reason, ReasonCode, Robot, State, Trigger, Wait
from app.domain.reasons import sentence, to_store
from app.domain.robot import QueueItem
from app.services.dispatch.moves import NOT_WITH_THE_ROBOT, Move, Moves, taken_back
from app.services.live.alarms import Alarms
from app.services.live.changes import NO_ROBOT, Changes, Topic
from app.services.planning.wanted import changed_since, why_unwanted

log = logging.getLogger("app.executions")
_BY_A_PERSON = (ReasonCode.USER_CANCELLED, ReasonCode.QUEUE_CLEARED)
TOO_MANY = 3  # failures in a row, from which on an alarm names the robot
_ENDS_BY = ("mission", "closes_at", "finish_by", "tried")  # what waits


class Ledger:
    def __init__(
        self,
        db: Database,
        executions: ExecutionRepository,
        settings: SettingsRepository,
        clock: Clock,
        changes: Changes,
        alarms: Alarms,
    ) -> None:
        self._db, self._executions, self._settings = db, executions, settings
        self._clock, self._changes, self._alarms, self._robots = clock, changes, alarms, RobotRepository()
        self._starts, self._schedules, self.moves = GroupExecutionRepository(), ScheduleRepository(), Moves(clock)
        self.grew = True  # rows ended since the history was last held to its limit

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
    def add(self, execution: Execution, instead_of: Execution | None = None) -> Execution | None:
        """Write a new row; None when its token is already in the ledger. ``instead_of`` is not sent again: raises InvalidInput where that
        is so already, or it is not in doubt any more."""

        def work(c: Any) -> Execution | None:
            if instead_of is not None and self._executions.by_token(c, execution.token) is None:
                self._replace(c, instead_of, execution)
            return self._executions.add_once(c, execution)

        added = self._added(work)
        if instead_of is not None:
            self._changes.publish(Topic.EXECUTIONS)  # its next try may be about to leave
        return added

    def _replace(self, c: Any, before: Execution, by: Execution) -> None:
        """Judged in the same write, as two may ask for that at once."""
        row = self._executions.get(c, before.id)
        if row is not None and row.revoked is not None:
            other = self._instead_of(c, row)
            if other is None or not _never_reached_a_robot(other):
                raise _not_sent_again(row.revoked, row.robot)
        if row is None or row.robot_id != before.robot_id or not (row.state is State.SUBMITTING or _is_unknown(row)):
            raise InvalidInput("robot", "what became of it is known by now")
        instead = Reason(ReasonCode.USER_CANCELLED, {"instead": by.token})
        self._executions.change(c, row.id, (row.state,), revoked=instead)
        if (other := self._instead_of(c, row)) is not None:  # nor may an undo bring that one back
            self._executions.change(c, other.id, (other.state,), revoked=instead)

    def _instead_of(self, c: Any, row: Execution) -> Execution | None:
        """What was started on another robot in place of it."""
        return self._executions.by_token(c, row.revoked.details.get("instead", "")) if row.revoked is not None else None

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
        self._db.write(lambda c: self._note_used_by_idle(c, robot_id, queue_id, runs=runs))

    def _note_used_by_idle(self, c: Any, robot_id: int, queue_id: int, *, runs: bool = True) -> None:
        last = self._robots.idle_queue_id(c, robot_id) or 0
        if queue_id == last + 1 or (runs and queue_id > last):
            self._robots.note_idle(c, robot_id, queue_id)

    def forget_idle(self, robot_id: int) -> None:
        """There was no idle mission in this idle period."""
        self._db.write(lambda c: self._robots.note_idle(c, robot_id, None))

    def waits(self, execution: Execution, wait: Wait, **details: Any) -> Execution | None:
        """Note what holds a waiting execution; writes only when that is something new. One that is to be listed later stays so."""
        if rules.is_listed_later(execution):
            details |= rules.LISTED_LATER
        if (execution.wait, dict(execution.wait_details)) == (wait, details):
            return execution
        return self._change(
            execution, (State.WAITING,), quietly=execution.wait is wait, wait=wait, wait_details=details
        )

    def list_late(self, execution: Execution) -> None:
        """One that waits is a late start after all: it is listed for some seconds from now on."""
        until = self._clock.now() + rules.LATE_START_HOLD
        self._change(execution, (State.WAITING,), wait=Wait.LATE_START, wait_details={}, hold_until=until)

    def end(self, execution: Execution, reason: Reason) -> Execution | None:
        """End an open execution with a reason, whose code gives the state."""
        return next(iter(self.make([self.moves.ended(execution, reason, (execution.state,))])), None)

    def make(self, moves: Sequence[Move], patient: bool = False, quietly: bool = False) -> list[Execution]:
        """Moves found by one read of a robot, in one transaction; the rows after those that could be made. Several moves of one
        execution are made in their order. ``patient`` ones may wait some ms to share a transaction; of ``quietly`` made ones the log says
        nothing: what follows within moments tells more."""
        if not moves:
            return []
        made = self._db.write(lambda c: [(move, row) for move in moves if (row := self._made(c, move))], patient)
        changed = [row for _move, row in made]
        for row in changed:
            if not quietly:
                log.info("%s", describe(row))
            if row.ended_at is not None:
                self.grew = True
                self.alarm_for(row)
            if row.state is State.QUEUED:
                self._resolve_replacement(row)
        for robot_id in {row.robot_id or NO_ROBOT for row in changed}:
            self._changes.publish(Topic.EXECUTIONS, robot_id)
        for move, row in made:
            if move.went_well is not None and move.execution.robot_id is not None:
                self._judge_robot(move.execution.robot_id, row)
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
                return None  # nothing wants it any more: no intent, no request
            columns |= anew or {}
        if State.CANCELLED in expected and why_unwanted(c, move.execution):
            expected = (State.SUBMITTING,)
        if State.WAITING in expected:  # which edits change too
            made = self._executions.change(c, move.execution.id, expected, of_robot=move.execution.robot_id, **columns)
        else:
            made = self._executions.change_owned(c, move.execution, expected, **columns)
        if made and State.WAITING in move.expected:
            self._note_in_plan(c, made)
        if (
            made
            and made.state is State.WAITING
            and move.execution.state is State.SUBMITTING
            and (reason := taken_back(made))
        ):
            end = self.moves.ended(
                made, reason, (State.WAITING,)
            )  # here, as an undo may come in any moment between two writes
            made = self._executions.change_owned(c, made, end.expected, **end.columns)
        if made and made.state is State.QUEUED and made.queue_id is not None and made.robot_id is not None:
            self._robots.note_accepted(c, made.robot_id, Accepted(made.queue_id, made.token))
            if made.schedule_id is not None:
                self._schedules.forget_skips(c, made.schedule_id, made.planned_at)
            if made.trigger is Trigger.IDLE:
                self._robots.note_idle(c, made.robot_id, made.queue_id)
        if made and move.watch is not None:
            self._starts.watch(c, move.watch)
        if made and move.went_well is not None and move.execution.robot_id is not None:
            self._robots.note_outcome(c, move.execution.robot_id, move.went_well)
        return made

    def _note_in_plan(self, c: Any, row: Execution) -> None:
        """What the plan has to know when the clock is set back, whatever the history still has: that it was begun, or that a person did not
        want it, who skips it by that."""
        if row.schedule_id is None:
            return
        if row.state in (State.SUBMITTING, State.QUEUED):
            self._schedules.note_begun(c, row.schedule_id, row.planned_at)
        elif row.reason is not None and (row.held or row.reason.code in _BY_A_PERSON):
            self._schedules.skip(c, row.schedule_id, row.planned_at)

    def _is_as_judged(self, c: Any, execution: Execution) -> bool:
        """Whether what its end rests on is still as it was read: somebody may just have given it more time, or another mission."""
        now = self._executions.get(c, execution.id)
        return now is not None and all(getattr(now, name) == getattr(execution, name) for name in _ENDS_BY)

    def give_back_bound(self, robot_id: int | None = None) -> None:
        """What waits for this robot as one of a group, or for any robot so, may get another one, but where a person chose it."""
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

    def bind(
        self,
        moves: Sequence[Move],
        into_queue: Collection[int] = (),
        hand_over: Callable[[Sequence[Execution]], None] = lambda intents: None,
    ) -> list[Execution]:
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
            rows = [row for row in made if row is not None]
            for row in rows:
                self._note_in_plan(c, row)
            return rows

        rows = self._db.write(work) if moves else []
        hand_over([row for row in rows if row.state is State.SUBMITTING])  # before listeners are notified and read
        for row in rows:
            log.info("%s", describe(row))
            self._changes.publish(Topic.EXECUTIONS, row.robot_id)
        return rows

    def adopt(self, execution: Execution, robot: Robot, item: QueueItem) -> bool:
        """It is on a robot already: the one that it waits for, or another one, which it gets by way of none. Returns whether it still
        waited so."""
        moves = []
        if execution.robot_id not in (None, robot.id):
            moves.append(self.moves.unbound_again(execution))
            execution = replace(execution, robot_id=None, robot="")
        return len(self.make([*moves, self.moves.adopted(execution, robot, item)])) > len(moves)

    def watches_of(self, robot_id: int) -> list[Watched]:
        """What may still come to this robot though it was given up there, or may have come while nobody looked."""
        return self._starts.watches_of(self._db.read(), robot_id)

    def watch(self, execution: Execution, robot_id: int) -> None:
        """It may come to this robot, or run there, once more than wanted."""
        self._db.write(lambda c: self._starts.watch(c, self.moves.watch(execution, robot_id)))

    def drop_watches(self, robot_id: int, tokens: Collection[str]) -> None:
        """The robot was searched for these when nothing could come any more."""
        self._db.write(lambda c: self._starts.drop_watches(c, robot_id, tokens), patient=True)

    def unbound(self) -> list[Execution]:
        """What waits for a robot of a group, oldest first."""
        return self._starts.unbound(self._db.read())

    def reopen(self, execution: Execution, robot: Robot, queue_id: int) -> Execution | None:
        """This robot has it after all, or another item than was thought: it is followed (again) to its end."""
        columns: dict[str, Any] = {
            "state": State.QUEUED,
            "queue_id": queue_id,
            "reason": None,
            "ended_at": None,
            "duration_s": None,
            "submitted_at": execution.submitted_at or self._clock.now(),
        }
        moves = []
        if execution.robot_id != robot.id:  # one of a group, which another one had been given, or none
            columns |= {
                "robot_id": robot.id,
                "robot": robot.name,
                "robot_address": robot.address,
                "robot_serial": robot.serial_number,
            }
            moves = [Move(execution, (execution.state,), {"robot_id": None, "robot": ""})]
        moves.append(Move(execution, (execution.state,), columns))

        def work(c: Any) -> list[Execution | None]:
            changed = [self._executions.change(c, execution.id, move.expected, **move.columns) for move in moves]
            if changed[-1] is not None and execution.trigger is Trigger.IDLE:
                self._note_used_by_idle(c, robot.id, queue_id)
            return changed

        changed = self._db.write(work)
        if changed[-1] is not None:
            self._announce(changed[-1])
            self._withdraw_alarms_of(execution)
            self._resolve_replacement(changed[-1])
        return changed[-1]

    def _resolve_replacement(self, row: Execution) -> None:
        """Its robot has it after all, and a person has had it started on another one, which has that too or may get it; or an undo of its
        cancellation would."""
        other = self._instead_of(self._db.read(), row)
        if other is not None and _never_reached_a_robot(other):
            self._db.write(lambda c: self._executions.change(c, other.id, (other.state,), revoked=row.revoked))
        elif other is not None and _may_have_run(other):
            self._alarms.raise_(
                "started_twice",
                f"execution:{row.id}",
                mission=row.mission,
                robot=row.robot,
                robot_id=row.robot_id,
                other=other.robot or other.robot_group,
            )

    def _withdraw_alarms_of(self, reopened: Execution) -> None:
        """It has not failed, as far as is known now."""
        if reopened.state is not State.FAILED or reopened.reason is None or reopened.ended_at is None:
            return
        if reopened.reason.code is ReasonCode.UNKNOWN_OUTCOME:
            self._alarms.withdraw("unknown_outcome", f"execution:{reopened.id}", reopened.ended_at)
        else:
            self._alarms.withdraw("execution_failed", _about(reopened), reopened.ended_at)

    def ask_cancel(self, executions: Sequence[Execution]) -> list[int]:
        """Note that the operator has cancelled these; the robot's answer decides. Returns the ids of those that nobody had before."""
        return self._mark_cancelled([execution.id for execution in executions], ReasonCode.USER_CANCELLED)

    def withdraw_cancel(self, ids: Collection[int]) -> None:
        """The robot has refused to cancel these."""
        self._db.write(lambda c: self._executions.withdraw_cancel(c, ids))
        self._changes.publish(Topic.EXECUTIONS)

    def clear(self, ids: Collection[int]) -> None:
        """The queue in which these were, or were to be, was cleared: what no robot has ends."""
        self._mark_cancelled(ids, ReasonCode.QUEUE_CLEARED)
        waiting = (row for row in self.unsent([*ids]) if row.state is State.WAITING and row.cancel_code is not None)
        self.make(
            [self.moves.ended(row, Reason(row.cancel_code), (State.WAITING,)) for row in waiting if row.cancel_code]
        )

    def _mark_cancelled(self, ids: Collection[int], code: ReasonCode) -> list[int]:
        marked = self._db.write(lambda c: self._executions.mark_cancelled(c, ids, code))
        self._changes.publish(Topic.EXECUTIONS)
        return marked

    def hold(self, ids: Collection[int], held: bool) -> int:
        """A person keeps these back while they wait, or lets them go; how many that was in time for."""
        columns: dict[str, Any] = {"held": held, "wait": Wait.HOLD if held else Wait.DUE, "wait_details": {}}
        changed = self._db.write(
            lambda c: [each for each in ids if self._executions.change(c, each, (State.WAITING,), **columns)]
        )
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
        self._alarms.raise_(
            "start_refused",
            f"schedule:{execution.schedule_id}:robot:{robot.id}",
            mission=execution.mission,
            robot=robot.name,
            robot_id=robot.id,
            group=execution.robot_group,
            reason=to_store(reason),
            timezone=execution.timezone,
        )

    def alarm_for(self, ended: Execution) -> None:
        """Raise the alarm of a failed or skipped execution, but of an idle mission that was overtaken, and of an unknown outcome, which has
        its own; repetitions of one schedule are counted."""
        code = {State.FAILED: "execution_failed", State.SKIPPED: "execution_skipped"}.get(ended.state)
        told_elsewhere = (ReasonCode.UNKNOWN_OUTCOME, *([ReasonCode.OVERLAP] if ended.trigger is Trigger.IDLE else []))
        if code and ended.reason and ended.reason.code not in told_elsewhere:
            self._alarms.raise_(
                code,
                _about(ended),
                mission=ended.mission,
                robot=ended.robot or ended.robot_group,
                robot_id=ended.robot_id,
                reason=to_store(ended.reason),
                timezone=ended.timezone,
            )

    def _judge_robot(self, robot_id: int, row: Execution) -> None:
        """A robot that fails start after start has an alarm until it completes one. ``row``: the last one."""
        c = self._db.read()
        robot, failures = self._robots.get(c, robot_id), self._robots.failures(c, [robot_id]).get(robot_id, 0)
        if robot is not None and failures >= TOO_MANY:
            self._alarms.raise_about_robot("robot_fails", robot, count=failures, mission=row.mission)
        else:
            self._alarms.clear("robot_fails", f"robot:{robot_id}")

    # ------------------------------------------------------------------ inside
    def _change(
        self, execution: Execution, expected: Sequence[State], quietly: bool = False, **columns: Any
    ) -> Execution | None:
        changed = self._db.write(lambda c: self._executions.change(c, execution.id, expected, **columns))
        if changed:
            self._announce(changed, quietly)
        return changed

    def _announce(self, execution: Execution, quietly: bool = False) -> None:
        if not quietly:
            log.info("%s", describe(execution))
        self._changes.publish(Topic.EXECUTIONS, execution.robot_id or NO_ROBOT)


def _is_unknown(row: Execution) -> bool:
    return row.reason is not None and row.reason.code is ReasonCode.UNKNOWN_OUTCOME


def _never_reached_a_robot(row: Execution) -> bool:
    """Whether it has ended, and certainly never was on a robot."""
    return row.ended_at is not None and row.queue_id is None and not _may_be_there(row)


def _may_have_run(row: Execution) -> bool:
    return row.state.is_open or row.started_at is not None or _may_be_there(row)


def _may_be_there(row: Execution) -> bool:
    """Whether it ended while nobody knew whether its robot had it."""
    was_removed = row.reason is not None and row.reason.code is ReasonCode.ROBOT_REMOVED
    return _is_unknown(row) or (was_removed and not row.was_never_sent)


def _not_sent_again(why: Reason, robot: str) -> InvalidInput:
    match why.code:
        case ReasonCode.USER_CANCELLED:
            return InvalidInput("robot", "it has been started on another robot already")
        case ReasonCode.HOLD:
            return InvalidInput("robot", "its schedule has been paused since")
        case ReasonCode.ROBOT_REMOVED:
            return InvalidInput("robot", "{robot} has been switched off since", robot=robot)
    return InvalidInput("robot", "what planned it has been changed, switched off or deleted since")


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
