"""The moves that an execution can make, each as the columns that it changes; the ledger makes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any

from app.database.executions import UNBOUND
from app.database.group_executions import Watch
from app.domain.clock import Clock
from app.domain.message import Message
from app.domain.models import Execution, Reason, ReasonCode, Robot, State, Wait
from app.domain.robot import QueueItem
from app.services.dispatch.timing import WATCHED_FOR

NOT_WITH_THE_ROBOT = (State.WAITING, State.SUBMITTING)  # or at least may be
WITH_THE_ROBOT = (State.QUEUED, State.EXECUTING)
MAY_BE_WITH_THE_ROBOT = (State.SUBMITTING, *WITH_THE_ROBOT)
_THE_ROBOT_FAILED = (ReasonCode.ROBOT_ABORTED, ReasonCode.VANISHED, ReasonCode.REFUSED)


@dataclass(frozen=True)
class Move:
    """A change of an execution that is still in one of the ``expected`` states."""

    execution: Execution
    expected: Sequence[State]
    columns: Mapping[str, Any]
    watch: Watch | None = None
    needs_room: bool = False  # at the places that its mission uses; else it is not made
    went_well: bool | None = None  # its robot has completed it, or failed it; None: neither

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


def is_other_machine(row: Execution, serial_number: str | None) -> bool:
    """Whether another machine than the one it was sent to is the row's robot now."""
    return None not in (row.robot_serial, serial_number) and row.robot_serial != serial_number


def _robot_failed(execution: Execution, code: object) -> bool:
    """Whether the robot is to blame. One that was not sent it could not fail it."""
    return code in _THE_ROBOT_FAILED and execution.state is not State.WAITING


class Moves:
    """Of a row as it was read; ``Ledger.make`` makes none of a row that has moved on."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def waiting(self, execution: Execution, wait: Wait, **details: Any) -> list[Move]:
        """What holds a waiting execution; none where that is nothing new."""
        is_known = (execution.wait, dict(execution.wait_details)) == (wait, details)
        return [] if is_known else [Move(execution, (State.WAITING,), {"wait": wait, "wait_details": details})]

    def begun(self, execution: Execution, robot: Robot, queue_floor: int | None) -> Move:
        """The intent on disk before the POST: ``submitting``, one attempt more, and the highest queue id known before it. The floor of the
        first attempt on this machine is kept: everything that this execution ever put there lies above it."""
        is_first = execution.queue_floor is None or is_other_machine(execution, robot.serial_number)
        floor = queue_floor if is_first else execution.queue_floor
        return Move(
            execution,
            (State.WAITING,),
            {
                "state": State.SUBMITTING,
                "attempts": execution.attempts + 1,
                "queue_floor": floor,
                "robot_address": robot.address,
                "robot_serial": robot.serial_number,
            },
            needs_room=True,
        )

    def accepted(self, execution: Execution, robot: Robot, queue_id: int, since: datetime | None = None) -> Move:
        """The robot has it, (None:) since now. If this were never written, the robot would be asked."""
        return Move(
            execution,
            (State.SUBMITTING,),
            {
                "state": State.QUEUED,
                "queue_id": queue_id,
                "submitted_at": since or self._clock.now(),
                "robot_address": robot.address,
                "robot_serial": robot.serial_number,
            },
        )

    def adopted(self, execution: Execution, robot: Robot, item: QueueItem) -> Move:
        """It is on a robot already: the one that it waits for, or another one."""
        return Move(
            execution,
            (State.WAITING,),
            {
                "state": State.QUEUED,
                "queue_id": item.id,
                "token": item.description,
                "submitted_at": self._clock.now(),
                "attempts": max(1, execution.attempts),
                "queue_floor": item.id - 1,
                "robot_id": robot.id,
                "robot": robot.name,
                "robot_address": robot.address,
                "robot_serial": robot.serial_number,
            },
        )

    def bound(
        self,
        execution: Execution,
        robot: Robot,
        mission_guid: str,
        choice: Mapping[str, Any],
        intent_floor: int | None = None,
    ) -> Move:
        """A robot of its group is chosen. What was ever sent to it lies above the floor of the first time, on the machine of that time.
        ``intent_floor``: it was never there, and is about to be sent; the highest queue id known of that robot."""
        before = execution.tried.get(str(robot.id), {})
        columns: dict[str, Any] = {
            "robot_id": robot.id,
            "robot": robot.name,
            "mission_guid": mission_guid,
            "bound_at": self._clock.now(),
            "choice": choice,
            "wait": Wait.DUE,
            "wait_details": {},
            "queue_floor": before.get("floor"),
            "robot_serial": before.get("serial"),
        }
        if intent_floor is not None:
            columns |= {**self.begun(execution, robot, intent_floor).columns, "queue_floor": intent_floor}
        return Move(execution, (State.WAITING,), columns)

    def given_back(
        self, execution: Execution, robot_id: int, tried: Mapping[str, Any], *, is_attempt: bool, may_come: bool
    ) -> Move:
        """A start of a group of which certainly nothing is on this robot has none again. ``tried``: what became of it here. ``is_attempt``:
        it counts as one, also where it never reached the POST. ``may_come``: its request may still come here."""
        attempts = execution.attempts + (execution.state is State.WAITING and is_attempt)
        return Move(
            execution,
            NOT_WITH_THE_ROBOT,
            {
                **UNBOUND,
                "state": State.WAITING,
                "wait": Wait.ROBOT,
                "wait_details": {},
                "attempts": attempts,
                "tried": {**execution.tried, str(robot_id): tried},
            },
            self.watch(execution, robot_id) if may_come else None,
            went_well=False if may_come or _robot_failed(execution, tried.get("code")) else None,
        )

    def unbound_again(self, execution: Execution) -> Move:
        """A start of a group that its robot could not begin is for any of them again; nothing is held against this one."""
        return Move(execution, (State.WAITING,), UNBOUND)

    def not_tried(self, intent: Execution) -> Move:
        """An intent whose POST was not even begun; that of a group waits again though its robot has been removed meanwhile, where its plan
        still has it."""
        expected = (State.SUBMITTING,) if intent.group_id is None else (State.SUBMITTING, State.CANCELLED)
        return Move(
            intent,
            expected,
            {"state": State.WAITING, "attempts": intent.attempts - 1, "reason": None, "ended_at": None},
        )

    def in_doubt(self, execution: Execution, answer: Mapping[str, Any], *, is_taken: bool) -> Move:
        """The robot has answered, and not with a number to find it by. ``is_taken``: it has said that it took it."""
        taken = {"submitted_at": self._clock.now()} if is_taken else {}
        return Move(execution, (State.SUBMITTING,), {"wait_details": answer, **taken})

    def attempt_failed(self, execution: Execution, problem: Message, *, may_come: bool, is_first: bool) -> Move:
        """An attempt that certainly put nothing on the robot. One that never reached the POST counts here. ``may_come``: as above.
        ``is_first``: nothing of it can have been there before."""
        attempts = execution.attempts + (execution.state is State.WAITING)
        columns = {
            "state": State.WAITING,
            "attempts": attempts,
            "wait": Wait.RETRY,
            "wait_details": {"problem": problem},
        }
        if is_first and not may_come:
            columns["queue_floor"] = None
        return Move(
            execution, NOT_WITH_THE_ROBOT, columns, self.watch(execution, execution.robot_id) if may_come else None
        )

    def given_up(self, execution: Execution, reason: Reason) -> Move:
        """Ended without its outcome being known: it may be on the robot, or come there yet."""
        return replace(
            self.ended(execution, reason, (execution.state,)), watch=self.watch(execution, execution.robot_id)
        )

    def started(self, execution: Execution, robot_delay_s: float | None) -> Move:
        return Move(
            execution,
            (State.QUEUED,),
            {
                "state": State.EXECUTING,
                "started_at": self._clock.now(),
                "robot_delay_s": robot_delay_s,
            },
        )

    def completed(self, execution: Execution, duration_s: float | None, robot_delay_s: float | None) -> Move:
        """Seen done; a fast one is first seen so, and then began about now."""
        now = self._clock.now()
        return Move(
            execution,
            WITH_THE_ROBOT,
            {
                "state": State.COMPLETED,
                "ended_at": now,
                "duration_s": duration_s,
                "robot_delay_s": robot_delay_s,
                "started_at": execution.started_at or now,
            },
            went_well=True,
        )

    def ended(
        self,
        execution: Execution,
        reason: Reason,
        expected: Sequence[State] = WITH_THE_ROBOT,
        duration_s: float | None = None,
    ) -> Move:
        """Ended with a reason, whose code gives the state."""
        return Move(
            execution,
            expected,
            {"state": reason.state, "reason": reason, "ended_at": self._clock.now(), "duration_s": duration_s},
            went_well=False if _robot_failed(execution, reason.code) else None,
        )

    def watch(self, execution: Execution, robot_id: int | None) -> Watch:
        assert robot_id is not None, "it was sent to a robot"
        return Watch(
            execution.id, robot_id, execution.queue_floor or 0, self._clock.now() + timedelta(seconds=WATCHED_FOR)
        )
