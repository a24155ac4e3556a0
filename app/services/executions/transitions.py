"""Every change of an execution's row: the event, and the columns that it writes. Pure: no SQL, no clock.

``app.services.executions.apply`` says in which states an event may happen, and writes it with everything that belongs to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from typing import Any

from app.domain import rules
from app.domain.execution import UNBOUND, Execution, Reason, ReasonCode, State, Wait
from app.domain.message import Message
from app.domain.models import Robot
from app.domain.robot import QueueItem

NOT_WITH_THE_ROBOT = (State.WAITING, State.SUBMITTING)  # or at least may be
WITH_THE_ROBOT = (State.QUEUED, State.EXECUTING)
MAY_BE_WITH_THE_ROBOT = (State.SUBMITTING, *WITH_THE_ROBOT)
BY_A_PERSON = (ReasonCode.USER_CANCELLED, ReasonCode.QUEUE_CLEARED)
_THE_ROBOT_FAILED = (ReasonCode.ROBOT_ABORTED, ReasonCode.VANISHED, ReasonCode.REFUSED)


class Event(StrEnum):
    """Why a row changes; the text is for the documentation."""

    WAIT = "it waits for something else"
    HOLD = "a person holds or releases it"
    REDEFINE = "its schedule, mission, settings or priority were edited"
    ASSIGN = "a robot of its group is chosen"
    UNASSIGN = "its robot can't begin it now: any of its group may get it"
    BEGIN = "it is about to be sent: the intent"
    NOT_SENT = "its request was never begun (a group's start whose robot was removed is cancelled)"
    ANSWER = "the robot answered without the number of an item"
    ACCEPT = "the robot has it"
    ADOPT = "it is found on a robot"
    FAIL = "an attempt failed and certainly put nothing on the robot"
    GIVE_BACK = "the same for a start of a group: another robot may get it"
    START = "the robot has begun it"
    COMPLETE = "the robot has done it"
    ABORT = "it was aborted, cancelled or deleted at the robot"
    GIVE_UP = "its outcome can't be found out"
    EXPIRE = "it was not sent in time"
    REFUSE = "it can't be sent, or was tried too often"
    WITHDRAW = "the plan no longer has it"
    CANCEL = "a person has cancelled it; if a robot may have it, the robot's answer decides"
    UNCANCEL = "the robot refused to cancel it"
    REPLACE = "a person has started it on another robot instead"
    WANT_AGAIN = "the edit that withdrew it while it was being sent was undone"
    REMOVE = "its robot or group was deleted"
    RESTORE = "the action that ended it was undone"
    MOVE = "newer rules or time zones give it another instant"
    REOPEN = "the robot has it after all, or as another item"


@dataclass(frozen=True)
class Transition:
    """A change of a row as it was read. It is not made if the row's state, or a waiting row's robot, has changed."""

    event: Event
    row: Execution
    columns: Mapping[str, Any]
    may_come: bool = False  # its request may still arrive at this robot
    into_queue: bool = False  # of a robot that has something of ours already
    went_well: bool | None = None  # its robot has completed it, or failed it; None: neither

    @property
    def after(self) -> Execution:
        """The row as it will be, for another transition after this one."""
        return replace(self.row, **self.columns)


def why_withdrawn(row: Execution) -> Reason | None:
    """Why it must not be sent (again). ``row`` was read a moment ago."""
    return Reason(row.cancel_code) if row.cancel_code else row.withdrawn


def was_given_up(row: Execution) -> bool:
    """Whether it ended because its outcome could not be found out."""
    return row.reason is not None and row.reason.code is ReasonCode.UNKNOWN_OUTCOME


def is_other_machine(row: Execution, serial_number: str | None) -> bool:
    """Whether another machine than the one it was sent to is the row's robot now."""
    return None not in (row.robot_serial, serial_number) and row.robot_serial != serial_number


# ---------------------------------------------------------------------- while it waits
def wait(row: Execution, why: Wait, **details: Any) -> list[Transition]:
    """What it waits for; none if unchanged. One to be listed late stays so."""
    if rules.is_listed_later(row):
        details |= rules.LISTED_LATER
    is_known = (row.wait, dict(row.wait_details)) == (why, details)
    return [] if is_known else [Transition(Event.WAIT, row, {"wait": why, "wait_details": details})]


def list_late(row: Execution, now: datetime, uncertain_through: datetime | None = None) -> Transition:
    """A late start is listed for some seconds from now on. One planned up to ``uncertain_through`` may have run, and is
    listed only once it is known that it has not."""
    if uncertain_through is not None and row.planned_at <= uncertain_through:
        late: dict[str, Any] = {"wait": Wait.ELSEWHERE, "wait_details": dict(rules.LISTED_LATER), "listed_until": None}
    else:
        late = {"wait": Wait.LATE_START, "wait_details": {}, "listed_until": now + rules.LATE_START_HOLD}
    return Transition(Event.WAIT, row, late)


def hold(row: Execution, held: bool) -> Transition:
    return Transition(Event.HOLD, row, {"held": held, "wait": Wait.HOLD if held else Wait.DUE, "wait_details": {}})


def redefine(row: Execution, **columns: Any) -> Transition:
    return Transition(Event.REDEFINE, row, columns)


def assign(
    row: Execution,
    robot: Robot,
    mission_guid: str,
    choice: Mapping[str, Any],
    now: datetime,
    *,
    intent_floor: int | None = None,
    into_queue: bool = False,
) -> Transition:
    """Everything ever sent to this robot has ids above the floor of the first time, on the machine of that time.
    ``intent_floor``: it was never there, and is about to be sent; the highest known queue id of that robot."""
    before = row.tried.get(str(robot.id), {})
    columns: dict[str, Any] = {
        "robot_id": robot.id,
        "robot": robot.name,
        "mission_guid": mission_guid,
        "bound_at": now,
        "choice": choice,
        "wait": Wait.DUE,
        "wait_details": {},
        "queue_floor": before.get("floor"),
        "robot_serial": before.get("serial"),
    }
    if intent_floor is not None:
        columns |= {**begin(row, robot, intent_floor, now).columns, "queue_floor": intent_floor}
    return Transition(Event.ASSIGN, row, columns, into_queue=into_queue)


def unassign(row: Execution) -> Transition:
    """Nothing is held against this robot."""
    return Transition(Event.UNASSIGN, row, UNBOUND)


# ---------------------------------------------------------------------- being sent
def begin(row: Execution, robot: Robot, queue_floor: int | None, now: datetime) -> Transition:
    """The intent on disk before the POST, one attempt more, and the highest queue id known before it. The floor of the
    first attempt on this machine stays: everything that this execution ever put there has ids above it, unless a fleet
    has begun its numbers again."""
    is_first = row.queue_floor is None or is_other_machine(row, robot.serial_number)
    is_below = robot.fleet is not None and (queue_floor or 0) < (row.queue_floor or 0)
    return Transition(
        Event.BEGIN,
        row,
        {
            "state": State.SUBMITTING,
            "attempts": row.attempts + 1,
            "begun_at": now,
            "queue_floor": queue_floor if is_first or is_below else row.queue_floor,
            **_sent_to(robot),
        },
    )


def not_sent(intent: Execution, *, is_first: bool) -> Transition:
    """A group's start waits again even if its robot was removed since, if the plan still has it. ``is_first``: it can't have
    been there before, so no item is its own."""
    columns = {"state": State.WAITING, "attempts": intent.attempts - 1, "reason": None, "ended_at": None}
    if is_first:
        columns["queue_floor"] = None
    return Transition(Event.NOT_SENT, intent, columns)


def answer(row: Execution, said: Mapping[str, Any], taken_at: datetime | None) -> Transition:
    """``taken_at``: when the robot has accepted it; None: it has not."""
    taken = {"submitted_at": taken_at} if taken_at else {}
    return Transition(Event.ANSWER, row, {"wait_details": said, **taken})


def accept(row: Execution, robot: Robot, queue_id: int, since: datetime) -> Transition:
    """If this were never written, the robot would be asked."""
    return Transition(
        Event.ACCEPT, row, {"state": State.QUEUED, "queue_id": queue_id, "submitted_at": since, **_sent_to(robot)}
    )


def adopt(row: Execution, robot: Robot, item: QueueItem, now: datetime) -> Transition:
    """On the robot that it waits for, or on another one."""
    return Transition(
        Event.ADOPT,
        row,
        {
            **(UNBOUND if row.robot_id != robot.id else {}),
            "state": State.QUEUED,
            "queue_id": item.id,
            "token": item.description,
            "submitted_at": now,
            "attempts": max(1, row.attempts),
            "queue_floor": item.id - 1,
            "robot_id": robot.id,
            "robot": robot.name,
            **_sent_to(robot),
        },
    )


def fail(row: Execution, problem: Message, *, may_come: bool, is_first: bool) -> Transition:
    """An attempt that never reached the POST counts too. ``is_first``: it can't have been there before."""
    columns = {
        "state": State.WAITING,
        "attempts": row.attempts + (row.state is State.WAITING),
        "wait": Wait.RETRY,
        "wait_details": {"problem": problem},
    }
    if is_first and not may_come:
        columns["queue_floor"] = None
    return Transition(Event.FAIL, row, columns, may_come)


def give_back(
    row: Execution, robot_id: int, tried: Mapping[str, Any], *, is_attempt: bool, may_come: bool
) -> Transition:
    """``tried``: its outcome here. ``is_attempt``: it counts as one, even if it never reached the POST."""
    columns = {
        **UNBOUND,
        "state": State.WAITING,
        "wait": Wait.ROBOT,
        "wait_details": {},
        "attempts": row.attempts + (row.state is State.WAITING and is_attempt),
        "tried": {**row.tried, str(robot_id): tried},
    }
    went_well = False if may_come or _robot_failed(row, tried.get("code")) else None
    return Transition(Event.GIVE_BACK, row, columns, may_come, went_well=went_well)


# ---------------------------------------------------------------------- with the robot
def start(row: Execution, now: datetime, robot_delay_s: float | None) -> Transition:
    return Transition(Event.START, row, {"state": State.EXECUTING, "started_at": now, "robot_delay_s": robot_delay_s})


def complete(row: Execution, now: datetime, duration_s: float | None, robot_delay_s: float | None) -> Transition:
    """Seen as done; a fast one is first seen in that state, and then began about now."""
    return Transition(
        Event.COMPLETE,
        row,
        {
            "state": State.COMPLETED,
            "duration_s": duration_s,
            "robot_delay_s": robot_delay_s,
            "started_at": row.started_at or now,
        },
        went_well=True,
    )


def reopen(row: Execution, robot: Robot, queue_id: int, now: datetime) -> Transition:
    """It is followed (again) to its end. A group's start may have been assigned to another robot, or to none."""
    columns: dict[str, Any] = {
        "state": State.QUEUED,
        "queue_id": queue_id,
        "reason": None,
        "ended_at": None,
        "duration_s": None,
        "submitted_at": row.submitted_at or now,
    }
    if row.robot_id != robot.id:
        columns |= {"robot_id": robot.id, "robot": robot.name, **_sent_to(robot)}
    return Transition(Event.REOPEN, row, columns)


# ---------------------------------------------------------------------- its end
def end(
    event: Event, row: Execution, reason: Reason, *, duration_s: float | None = None, may_come: bool = False
) -> Transition:
    """The reason's code gives the state."""
    columns = {"state": reason.state, "reason": reason, "duration_s": duration_s}
    went_well = False if _robot_failed(row, reason.code) else None
    return Transition(event, row, columns, may_come, went_well=went_well)


def withdraw(row: Execution, reason: Reason) -> Transition:
    """Waiting starts end. Starts being sent are marked; a change of the plan, which may be undone, replaces no other
    reason."""
    if row.state is State.WAITING:
        is_refused, is_by_a_person = reason.state is State.FAILED, reason.code in BY_A_PERSON
        event = Event.CANCEL if is_by_a_person else Event.REFUSE if is_refused else Event.WITHDRAW
        return end(event, row, reason)
    is_free = row.withdrawn is None or row.withdrawn.code is ReasonCode.SCHEDULE_CHANGED
    return Transition(Event.WITHDRAW, row, {"withdrawn": reason} if is_free else {})


def cancel(row: Execution, code: ReasonCode) -> Transition:
    """Starts that only wait end if the whole queue is cleared, even if the robot later refuses to cancel one of it."""
    if row.state is State.WAITING and code is ReasonCode.QUEUE_CLEARED:
        return Transition(Event.CANCEL, row, {**end(Event.CANCEL, row, Reason(code)).columns, "cancel_code": code})
    is_new = row.cancel_code is None or code is ReasonCode.QUEUE_CLEARED
    return Transition(Event.CANCEL, row, {"cancel_code": code} if is_new and code is not row.cancel_code else {})


def uncancel(row: Execution) -> Transition:
    is_asked = row.cancel_code is ReasonCode.USER_CANCELLED
    return Transition(Event.UNCANCEL, row, {"cancel_code": None} if is_asked else {})


def want_again(row: Execution) -> Transition:
    is_edit = row.withdrawn is not None and row.withdrawn.code is ReasonCode.SCHEDULE_CHANGED
    return Transition(Event.WANT_AGAIN, row, {"withdrawn": None} if is_edit else {})


def restore(row: Execution, as_it_was: Execution) -> Transition:
    was = {name: value for name, value in vars(as_it_was).items() if value != getattr(row, name)}
    return Transition(Event.RESTORE, row, was)


def replaced(row: Execution, instead: Reason) -> Transition:
    """Nor may an undo bring it back."""
    return Transition(Event.REPLACE, row, {"withdrawn": instead})


def _sent_to(robot: Robot) -> dict[str, Any]:
    return {"robot_address": robot.address, "robot_serial": robot.serial_number}


def _robot_failed(row: Execution, code: object) -> bool:
    """Whether the robot has failed it: not if it was never sent to it."""
    return code in _THE_ROBOT_FAILED and row.state is not State.WAITING
