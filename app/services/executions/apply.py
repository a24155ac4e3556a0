"""The table of transitions: in which states an event may happen, what is checked again, and what is written with it;
and the one function that writes an execution's state and what goes with it, inside of the caller's transaction."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any, NamedTuple

from app.database.executions import ExecutionRepository
from app.database.group_executions import GroupExecutionRepository, Watch
from app.database.robots import Accepted, RobotRepository
from app.database.schedules import ScheduleRepository
from app.domain.execution import OPEN_STATES, Execution, State, Trigger
from app.services.executions.transitions import (
    BY_A_PERSON,
    MAY_BE_WITH_THE_ROBOT,
    NOT_WITH_THE_ROBOT,
    WITH_THE_ROBOT,
    Event,
    Transition,
    withdraw,
)
from app.services.executions.wanted import wanted

WATCHED_FOR = 600.0  # s that a robot is searched for a request that was given up, and again when it answers later

_EXECUTIONS, _STARTS = ExecutionRepository(), GroupExecutionRepository()
_ROBOTS, _SCHEDULES = RobotRepository(), ScheduleRepository()
_ENDS_BY = ("mission", "closes_at", "finish_by", "tried")  # what waits

Columns = dict[str, Any]


# ---------------------------------------------------------------------- checks: the columns to write, or None
def has_room(c: sqlite3.Connection, transition: Transition, columns: Columns) -> Columns | None:
    """There is room at its places."""
    return columns if _STARTS.full_place(c, transition.row) is None else None


def is_wanted(c: sqlite3.Connection, transition: Transition, columns: Columns) -> Columns | None:
    """The plan has it, and it is written as defined there now. Starts that only waited follow the plan already."""
    row, waits = transition.row, columns.get("state") is State.WAITING
    if waits and row.state is State.WAITING:
        return columns
    of_robot = columns if columns.get("robot_id") is not None else {}
    new = {name: of_robot[name] for name in ("robot_id", "mission_guid") if name in of_robot}
    defined = wanted(c, replace(row, tried=columns.get("tried", row.tried), **new)).columns
    if waits:
        return columns | dict(defined or {})
    return None if defined is None or "robot_id" in defined else columns | dict(defined)


def is_as_read(c: sqlite3.Connection, transition: Transition, columns: Columns) -> Columns | None:
    """The reason for its end is unchanged since it was read. Somebody may just have given it more time, or another
    mission."""
    row = transition.row
    stored = _EXECUTIONS.get(c, row.id) if row.state is State.WAITING else row
    is_same = stored is not None and all(getattr(stored, name) == getattr(row, name) for name in _ENDS_BY)
    return columns if is_same else None


def is_as_chosen(c: sqlite3.Connection, transition: Transition, columns: Columns) -> Columns | None:
    """The basis of the choice of its robot is unchanged since it was read."""
    may_get = _STARTS.may_be_bound(c, transition.row, columns["robot_id"], transition.into_queue)
    return columns if may_get else None


# ---------------------------------------------------------------------- effects
def note_begun(c: sqlite3.Connection, transition: Transition, made: Execution, now: datetime) -> None:
    """Its schedule has begun this instant. So a clock that is set back does not plan it again, even if the history has lost
    it."""
    if made.schedule_id is not None and made.state is not State.WAITING:
        _SCHEDULES.note_begun(c, made.schedule_id, made.planned_at)


def note_skip(c: sqlite3.Connection, transition: Transition, made: Execution, now: datetime) -> None:
    """Its schedule skips this instant if a person held or cancelled it. So it stays skipped if the clock is set back."""
    if made.schedule_id is not None and made.reason is not None and (made.held or made.reason.code in BY_A_PERSON):
        _SCHEDULES.skip(c, made.schedule_id, made.planned_at)


def note_accepted(c: sqlite3.Connection, transition: Transition, made: Execution, now: datetime) -> None:
    """The robot's last item; its idle period is used."""
    if made.robot_id is None or made.queue_id is None:
        return
    _ROBOTS.note_accepted(c, made.robot_id, Accepted(made.queue_id, made.token, made.mission_guid))
    if made.schedule_id is not None:
        _SCHEDULES.forget_skips(c, made.schedule_id, made.planned_at)
    if made.trigger is Trigger.IDLE:
        _ROBOTS.note_idle(c, made.robot_id, made.queue_id)


def note_ran_idle(c: sqlite3.Connection, transition: Transition, made: Execution, now: datetime) -> None:
    """The robot's idle period is used, if it is an idle mission."""
    if made.trigger is Trigger.IDLE and made.robot_id is not None and made.queue_id is not None:
        note_used_by_idle(c, made.robot_id, made.queue_id)


def watch_for_late(c: sqlite3.Connection, transition: Transition, made: Execution, now: datetime) -> None:
    """A request that may still arrive is watched for."""
    if transition.may_come:
        watch(c, transition.row, transition.row.robot_id, now)


def note_outcome(c: sqlite3.Connection, transition: Transition, made: Execution, now: datetime) -> None:
    """The robot's success or failure is counted."""
    if transition.went_well is not None and transition.row.robot_id is not None:
        _ROBOTS.note_outcome(c, transition.row.robot_id, transition.went_well)


def note_used_by_idle(c: sqlite3.Connection, robot_id: int, queue_id: int, *, runs: bool = True) -> None:
    """A second copy of an idle mission does not count as use of the robot: if it ``runs``, it is the robot's last idle
    mission; if not, nothing may have come between."""
    last = _ROBOTS.idle_queue_id(c, robot_id) or 0
    if queue_id == last + 1 or (runs and queue_id > last):
        _ROBOTS.note_idle(c, robot_id, queue_id)


def watch(c: sqlite3.Connection, row: Execution, robot_id: int | None, now: datetime) -> None:
    """It may arrive at this robot, or run there, once too often."""
    assert robot_id is not None, "it was sent to a robot"
    _STARTS.watch(c, Watch(row.id, robot_id, row.queue_floor or 0, now + timedelta(seconds=WATCHED_FOR)))


# ---------------------------------------------------------------------- the table
Check = Callable[[sqlite3.Connection, Transition, Columns], Columns | None]
Effect = Callable[[sqlite3.Connection, Transition, Execution, datetime], None]


class Rule(NamedTuple):
    """``targets``: the possible new states; none: the state stays."""

    sources: Sequence[State]
    targets: Sequence[State] = ()
    checks: Sequence[Check] = ()
    effects: Sequence[Effect] = ()


_WAITING, _SUBMITTING, _QUEUED, _EXECUTING = OPEN_STATES
_FAILED, _CANCELLED, _SKIPPED, _MISSED = State.FAILED, State.CANCELLED, State.SKIPPED, State.MISSED

RULES: Mapping[Event, Rule] = {
    Event.WAIT: Rule([_WAITING]),
    Event.HOLD: Rule([_WAITING]),
    Event.REDEFINE: Rule(NOT_WITH_THE_ROBOT),
    Event.ASSIGN: Rule([_WAITING], NOT_WITH_THE_ROBOT, [is_as_chosen, is_wanted], [note_begun]),
    Event.UNASSIGN: Rule([_WAITING]),
    Event.BEGIN: Rule([_WAITING], [_SUBMITTING], [has_room, is_wanted], [note_begun]),
    Event.NOT_SENT: Rule([_SUBMITTING], [_WAITING], [is_wanted]),
    Event.ANSWER: Rule([_SUBMITTING]),
    Event.ACCEPT: Rule([_SUBMITTING], [_QUEUED], effects=[note_accepted]),
    Event.ADOPT: Rule([_WAITING], [_QUEUED], effects=[note_begun, note_accepted]),
    Event.FAIL: Rule(NOT_WITH_THE_ROBOT, [_WAITING], [is_wanted], [watch_for_late]),
    Event.GIVE_BACK: Rule(NOT_WITH_THE_ROBOT, [_WAITING], [is_wanted], [watch_for_late, note_outcome]),
    Event.START: Rule([_QUEUED], [_EXECUTING]),
    Event.COMPLETE: Rule(WITH_THE_ROBOT, [State.COMPLETED], effects=[note_outcome]),
    Event.ABORT: Rule(WITH_THE_ROBOT, [_FAILED, _CANCELLED], effects=[note_outcome]),
    Event.GIVE_UP: Rule(MAY_BE_WITH_THE_ROBOT, [_FAILED], effects=[watch_for_late]),
    Event.EXPIRE: Rule([_WAITING], [_FAILED, _SKIPPED, _MISSED], [is_as_read], [note_skip]),
    Event.REFUSE: Rule(NOT_WITH_THE_ROBOT, [_FAILED], [is_as_read], [watch_for_late, note_outcome]),
    Event.WITHDRAW: Rule(NOT_WITH_THE_ROBOT, [_SUBMITTING, _CANCELLED, _SKIPPED]),
    Event.CANCEL: Rule(OPEN_STATES, [*MAY_BE_WITH_THE_ROBOT, _CANCELLED], effects=[note_skip]),
    Event.UNCANCEL: Rule(OPEN_STATES),
    Event.REPLACE: Rule(tuple(State)),
    Event.WANT_AGAIN: Rule([_SUBMITTING]),
    Event.REMOVE: Rule(OPEN_STATES, [_CANCELLED]),
    Event.RESTORE: Rule([_CANCELLED], OPEN_STATES),
    Event.MOVE: Rule([_SKIPPED]),
    Event.REOPEN: Rule(tuple(State), [_QUEUED], effects=[note_ran_idle]),
}


def apply_in(c: sqlite3.Connection, transition: Transition, now: datetime) -> Execution | None:
    """Apply it and return the row. None: the row has changed, a check failed, or nothing would change: nothing was written,
    and the caller must not act on it."""
    rule, row = RULES[transition.event], transition.row
    columns: Columns | None = dict(transition.columns)
    if not columns or row.state not in rule.sources:
        return None
    for check in rule.checks:
        if (columns := check(c, transition, columns)) is None:
            return None
    state = columns.get("state", row.state)
    if state is not row.state and not state.is_open:
        columns["ended_at"] = now
    made = _write(c, transition, columns)
    if made is None:
        return None
    for effect in rule.effects:
        effect(c, transition, made, now)
    if made.state is State.WAITING and row.state is State.SUBMITTING and (why := wanted(c, made).why):
        return apply_in(c, withdraw(made, why), now)  # here: an undo may come between two transactions
    return made


def _write(c: sqlite3.Connection, transition: Transition, columns: Columns) -> Execution | None:
    """Only if the row is in the state from which its columns were made; a waiting row must also have the same robot."""
    row, robot_id = transition.row, columns.get("robot_id", transition.row.robot_id)
    expected = _expected(c, transition)
    if None not in (row.robot_id, robot_id) and row.robot_id != robot_id:  # by way of none, as the database demands
        if _EXECUTIONS.change(c, row, expected, robot_id=None, robot="") is None:
            return None
        row = replace(row, robot_id=None)
    if State.WAITING in RULES[transition.event].sources:
        return _EXECUTIONS.change(c, row, expected, **columns)
    return _EXECUTIONS.change_owned(c, row, expected, **columns)


def _expected(c: sqlite3.Connection, transition: Transition) -> Sequence[State]:
    row = transition.row
    if transition.event is Event.NOT_SENT and row.group_id is not None and wanted(c, row, reopen=True).why is None:
        return row.state, State.CANCELLED  # with its robot, which was removed
    return (row.state,)
