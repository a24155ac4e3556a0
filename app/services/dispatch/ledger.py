"""The execution ledger: every change of an execution is one short transaction, published to listeners and written to
the log.

A row that had changed before (somebody cancelled it) is not changed, and is not among those returned: the caller must
not act on it.
"""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable, Collection, Iterable, Sequence
from datetime import datetime

from app.database.connection import Database
from app.database.execution_history import ExecutionFilter, ExecutionHistory
from app.database.executions import ExecutionRepository, Unsent
from app.database.group_executions import FullPlace, GroupExecutionRepository, Watched
from app.database.robots import RobotRepository
from app.database.settings import SettingsRepository
from app.domain.choice import may_change_robot
from app.domain.clock import Clock
from app.domain.execution import OPEN_STATES, Execution, Reason, ReasonCode, State, Trigger, Wait
from app.domain.models import InvalidInput, Robot
from app.domain.reasons import sentence, to_store
from app.services.executions import transitions
from app.services.executions.apply import apply_in, note_used_by_idle, watch
from app.services.executions.transitions import NOT_WITH_THE_ROBOT, Event, Transition, was_given_up
from app.services.executions.wanted import Verdict, wanted
from app.services.live.alarms import Alarms
from app.services.live.changes import NO_ROBOT, Changes, Topic

log = logging.getLogger("app.executions")
_BY_A_PERSON = (Event.HOLD, Event.REDEFINE, Event.CANCEL, Event.UNCANCEL)  # asked for again before anything leaves
TOO_MANY = 3  # failures in a row, from which on an alarm names the robot


class Ledger:
    def __init__(self, db: Database, clock: Clock, changes: Changes, alarms: Alarms) -> None:
        self._db, self._clock, self._changes, self._alarms = db, clock, changes, alarms
        self._executions, self._starts = ExecutionRepository(), GroupExecutionRepository()
        self._robots, self._settings, self._history = RobotRepository(), SettingsRepository(), ExecutionHistory()
        self.grew = True  # rows ended since the history was last held to its limit

    # ------------------------------------------------------------------ reading
    def get(self, execution_id: int) -> Execution | None:
        return self._executions.get(self._db.read(), execution_id)

    def open_for(self, robot_id: int, states: Sequence[State] = OPEN_STATES) -> list[Execution]:
        return self._executions.open_for(self._db.read(), robot_id, states)

    def unsent_of(self, robot_id: int) -> list[Unsent]:
        """Starts that wait for a robot or are being sent to it, in short."""
        return self._executions.unsent_of(self._db.read(), robot_id)

    def unsent(self, ids: Sequence[int]) -> list[Execution]:
        """Those of these that still wait or are on their way."""
        return self._executions.in_states(self._db.read(), ids, NOT_WITH_THE_ROBOT)

    def has_sent(self, robot_id: int) -> bool:
        """Whether anything of ours is with this robot, or may be."""
        return self._executions.has_sent(self._db.read(), robot_id)

    def by_token(self, token: str) -> Execution | None:
        return self._executions.by_token(self._db.read(), token)

    def is_claimed(self, robot_id: int, queue_id: int, since: datetime | None = None) -> bool:
        """Whether that queue item belongs to an execution, and to one that had not ended at ``since``."""
        return self._executions.is_claimed(self._db.read(), robot_id, queue_id, since)

    def planned_between(self, robot_id: int, start: datetime, end: datetime) -> list[Execution]:
        """Asked of this robot, without what its fleet had it do for any robot."""
        wanted = ExecutionFilter(robot_ids=[robot_id], start=start, end=end)
        return [row for row in self._history.stream(self._db.read(), wanted) if row.robot_id == robot_id]

    def ended_since(self, robot_ids: Sequence[int], mission_guid: str, since: datetime) -> list[Execution] | None:
        """Those of this mission that these robots may have had. None: the history may have dropped some."""
        c = self._db.read()
        limit = self._settings.load(c).history_limit
        return self._history.ended_since(c, robot_ids, mission_guid, since, limit)

    # ------------------------------------------------------------------ new rows
    def add(self, execution: Execution, instead_of: Execution | None = None) -> Execution | None:
        """Write a new row; None if its token is already in the ledger. ``instead_of`` is not sent again: raises
        InvalidInput if it was already replaced, or is no longer in doubt."""

        def work(c: sqlite3.Connection) -> Execution | None:
            if instead_of is not None and self._executions.by_token(c, execution.token) is None:
                self._replace(c, instead_of, execution)
            return self._executions.add_once(c, execution)

        added = self._added(work)
        if instead_of is not None:
            self._changes.publish(Topic.EXECUTIONS)  # its next try may be about to leave
        return added

    def _replace(self, c: sqlite3.Connection, before: Execution, by: Execution) -> None:
        """Decided in the same write, as two may ask for it at once."""
        row = self._executions.get(c, before.id)
        other = None if row is None else self._instead_of(c, row)
        if row is not None and row.withdrawn is not None and (other is None or not _never_reached_a_robot(other)):
            raise _not_sent_again(row.withdrawn, row.robot)
        if row is None or row.robot_id != before.robot_id or not (row.state is State.SUBMITTING or was_given_up(row)):
            raise InvalidInput("robot", "its outcome is known already")
        instead = Reason(ReasonCode.USER_CANCELLED, {"instead": by.token})
        for each in filter(None, (row, other)):
            apply_in(c, transitions.replaced(each, instead), self._clock.now())

    def _instead_of(self, c: sqlite3.Connection, row: Execution) -> Execution | None:
        """Its replacements on other robots."""
        return (
            self._executions.by_token(c, row.withdrawn.details.get("instead", ""))
            if row.withdrawn is not None
            else None
        )

    def add_idle(self, execution: Execution, robot: Robot, last_use: int | None) -> None:
        """Write the row of an idle mission, unless ``robot`` or its rule has been changed since it was read. Its idle period has then had
        its mission. ``last_use``: the id by which it is seen whether the robot is used again."""

        def work(c: sqlite3.Connection) -> Execution | None:
            now = self._robots.get(c, robot.id)
            if now is None or not now.enabled or (now.address, now.idle) != (robot.address, robot.idle):
                return None
            self._robots.note_idle(c, robot.id, last_use)
            return self._executions.add_once(c, execution)

        self._added(work)

    def _added(self, work: Callable[[sqlite3.Connection], Execution | None]) -> Execution | None:
        added = self._db.write(work)
        if added:
            log.info("%s", describe(added))
            self._changes.publish(Topic.EXECUTIONS, added.robot_id or NO_ROBOT)
        return added

    # ------------------------------------------------------------------ changes of rows
    def apply(
        self,
        found: Sequence[Transition],
        *,
        patient: bool = False,
        quietly: bool = False,
        hand_over: Callable[[Execution], None] = lambda intent: None,
    ) -> list[Execution]:
        """Apply these in one transaction, several of one execution in their order. Returns the rows that were changed.
        ``patient`` ones may wait some ms to share a transaction; ``quietly`` applied ones are not logged, as a more
        informative change follows. ``hand_over`` gives workers what must be sent at once."""
        return self.apply_found(lambda c: found, patient, quietly, hand_over) if found else []

    def apply_found(
        self,
        find: Callable[[sqlite3.Connection], Iterable[Transition]],
        patient: bool = False,
        quietly: bool = False,
        hand_over: Callable[[Execution], None] = lambda intent: None,
    ) -> list[Execution]:
        """The same of what is found in the transaction itself."""

        def work(c: sqlite3.Connection) -> list[tuple[Transition, Execution]]:
            now = self._clock.now()
            return [(each, row) for each in find(c) if (row := apply_in(c, each, now))]

        made = self._db.write(work, patient)
        rows = [row for _transition, row in made]
        for row in rows:
            if row.state is State.SUBMITTING:
                hand_over(row)  # before listeners are notified and read
        for transition, row in made:
            self._announce(transition, row, quietly)
        by_a_person = any(transition.event in _BY_A_PERSON for transition, _row in made)
        for robot_id in {None} if by_a_person else {row.robot_id or NO_ROBOT for row in rows}:
            self._changes.publish(Topic.EXECUTIONS, robot_id)
        for transition, row in made:
            if transition.went_well is not None and transition.row.robot_id is not None:
                self._judge_robot(transition.row.robot_id, row)
        return rows

    def _announce(self, transition: Transition, row: Execution, quietly: bool) -> None:
        if not quietly:
            log.info("%s", describe(row))
        if row.ended_at is not None and transition.row.ended_at is None:
            self.grew = True
            self.alarm_for(row)
        if transition.event is Event.REOPEN:
            self._withdraw_alarms_of(transition.row)
        if transition.event in (Event.ACCEPT, Event.ADOPT, Event.REOPEN):
            self._resolve_replacement(row)

    def waits(self, row: Execution, why: Wait, **details: object) -> None:
        """Store what a waiting one waits for, if that has changed."""
        self.apply(transitions.wait(row, why, **details), quietly=row.wait is why)

    def end(self, event: Event, row: Execution, reason: Reason) -> list[Execution]:
        """End one with a reason, whose code gives the state."""
        return self.apply([transitions.end(event, row, reason)])

    def _apply_to(
        self,
        ids: Collection[int],
        states: Sequence[State],
        make: Callable[[Execution], Transition],
        quietly: bool = True,
    ) -> list[Execution]:
        """Change those of these that are still in one of the states."""
        return self.apply_found(lambda c: map(make, self._executions.in_states(c, [*ids], states)), quietly=quietly)

    def cancel(self, ids: Collection[int], code: ReasonCode) -> list[int]:
        """A person has cancelled these, or cleared their queue: the robot's answer decides about those it may have.
        Returns the ids of those newly cancelled."""
        is_quiet = code is ReasonCode.USER_CANCELLED
        return [row.id for row in self._apply_to(ids, OPEN_STATES, lambda row: transitions.cancel(row, code), is_quiet)]

    def uncancel(self, ids: Collection[int]) -> None:
        """The robot has refused to cancel these."""
        self._apply_to(ids, OPEN_STATES, transitions.uncancel)

    def hold(self, ids: Collection[int], held: bool) -> int:
        """A person holds these while they wait, or lets them go; how many that was in time for."""
        return len(self._apply_to(ids, [State.WAITING], lambda row: transitions.hold(row, held)))

    def unassign(self, robot_id: int | None = None) -> None:
        """Group starts that wait for this robot, or for any robot, may get another one, except if a person chose it."""
        robots = [robot for robot in self._starts.bound(self._db.read()) if robot_id in (None, robot)]

        def find(c: sqlite3.Connection) -> Iterable[Transition]:
            waiting = (row for robot in robots for row in self._executions.open_for(c, robot, [State.WAITING]))
            return [transitions.unassign(row) for row in waiting if may_change_robot(row)]

        if robots:
            self.apply_found(find, quietly=True)

    # ------------------------------------------------------------------ robots and watches
    def note_idle_copy(self, robot_id: int, queue_id: int, *, runs: bool) -> None:
        """Of an idle mission ``queue_id`` is one too many."""
        self._db.write(lambda c: note_used_by_idle(c, robot_id, queue_id, runs=runs))

    def note_last_use(self, robot_id: int, queue_id: int | None) -> None:
        """Only idle missions have come since the last one, this is the newest: the robot was not used. None: there was
        no idle mission in this idle period."""
        self._db.write(lambda c: self._robots.note_idle(c, robot_id, queue_id))

    def wanted(self, execution: Execution) -> Verdict:
        """Whether its plan still has it, as it is or otherwise."""
        return wanted(self._db.read(), execution)

    def full_place(self, execution: Execution) -> FullPlace | None:
        """A full place that it uses; None: none is full."""
        return self._starts.full_place(self._db.read(), execution)

    def watches_of(self, robot_id: int) -> list[Watched]:
        """Starts that may still arrive at this robot though they were given up there, or may have arrived unseen."""
        return self._starts.watches_of(self._db.read(), robot_id)

    def watch(self, execution: Execution, robot_id: int) -> None:
        """It may arrive at this robot, or run there, once too often."""
        self._db.write(lambda c: watch(c, execution, robot_id, self._clock.now()))

    def drop_watches(self, robot_id: int, tokens: Collection[str]) -> None:
        """The robot was searched for these when nothing could arrive any longer."""
        self._db.write(lambda c: self._starts.drop_watches(c, robot_id, tokens), patient=True)

    def unbound(self) -> list[Execution]:
        """What waits for a robot of a group, oldest first."""
        return self._starts.unbound(self._db.read())

    def _resolve_replacement(self, row: Execution) -> None:
        """Its robot has it after all, and a person has started it on another one too; or undoing its cancellation would
        send it again."""
        other = self._instead_of(self._db.read(), row)
        if other is not None and row.withdrawn is not None and _never_reached_a_robot(other):
            self.apply([transitions.replaced(other, row.withdrawn)], quietly=True)
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
        if was_given_up(reopened):
            self._alarms.withdraw("unknown_outcome", f"execution:{reopened.id}", reopened.ended_at)
        else:
            self._alarms.withdraw("execution_failed", _about(reopened), reopened.ended_at)

    def prune(self, has_time: Callable[[], bool]) -> None:
        """Prune the history to the newest N ended rows (the setting; None keeps all), in small pieces while it
        ``has_time``; the next call continues. Costs nothing while nothing ended."""
        if not self.grew:
            return
        self.grew = False
        limit = self._settings.load(self._db.read()).history_limit
        if limit is None:
            return
        surplus = self._history.surplus(self._db.read(), limit)
        while any(surplus):
            left = self._db.write(lambda c, surplus=surplus: self._history.drop_oldest(c, surplus))  # type: ignore[misc]
            if any(left) and (left == surplus or not has_time()):
                self.grew = True
                return
            surplus = left

    def alarm_of_refusal(self, execution: Execution, robot: Robot, reason: Reason) -> None:
        """A robot has finally refused a start of a group, which another robot may get."""
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
        """Raise the alarm of a failed or skipped execution, except for an idle mission that is not needed, and an
        unknown outcome, which has its own; repetitions of one schedule are counted."""
        code = {State.FAILED: "execution_failed", State.SKIPPED: "execution_skipped"}.get(ended.state)
        alarmed_elsewhere = (
            ReasonCode.UNKNOWN_OUTCOME,
            *([ReasonCode.OVERLAP] if ended.trigger is Trigger.IDLE else []),
        )
        if code and ended.reason and ended.reason.code not in alarmed_elsewhere:
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


def _never_reached_a_robot(row: Execution) -> bool:
    """Whether it has ended, and certainly never was on a robot."""
    return row.ended_at is not None and row.queue_id is None and not _may_be_there(row)


def _may_have_run(row: Execution) -> bool:
    return row.state.is_open or row.started_at is not None or _may_be_there(row)


def _may_be_there(row: Execution) -> bool:
    """Whether it ended while it was not known whether its robot had it."""
    was_removed = row.reason is not None and row.reason.code is ReasonCode.ROBOT_REMOVED
    return was_given_up(row) or (was_removed and not row.was_never_sent)


def _not_sent_again(why: Reason, robot: str) -> InvalidInput:
    match why.code:
        case ReasonCode.USER_CANCELLED:
            return InvalidInput("robot", "it has been started on another robot already")
        case ReasonCode.HOLD:
            return InvalidInput("robot", "its schedule has been paused since")
        case ReasonCode.ROBOT_REMOVED:
            return InvalidInput("robot", "{robot} has been switched off since", robot=robot)
    return InvalidInput("robot", "its schedule has been changed, switched off or deleted since")


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
