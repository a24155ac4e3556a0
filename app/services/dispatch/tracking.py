"""Follows what was accepted to its end, by queue id and never by the robot's state; each row by itself."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime

from app.domain.execution import Execution, Reason, ReasonCode, State
from app.domain.message import message
from app.domain.robot import QueueItem, QueueState
from app.mir.errors import NO_LIST, Rejected, RobotError, RobotFault, Unreadable
from app.mir.robot_vocabulary import USER_REQUEST, as_stored
from app.mir.target import Target
from app.services.dispatch.context import Context
from app.services.dispatch.duplicates import Duplicates
from app.services.dispatch.observation import Observation
from app.services.dispatch.timing import GONE_FOR
from app.services.executions import transitions
from app.services.executions.transitions import WITH_THE_ROBOT, Event, Transition

log = logging.getLogger(__name__)

MANY = 3  # open executions that are asked for in one request instead of one each


class Tracking:
    """One robot's accepted executions. Raises RobotError when the robot can't be asked: rows stay open. ``on_pause`` is
    called between two requests, so that starts due in between need not wait for all of them."""

    def __init__(
        self,
        client: Target,
        context: Context,
        observation: Observation,
        duplicates: Duplicates,
        on_pause: Callable[[], None],
    ) -> None:
        self._client, self._s, self._ledger = client, context, context.ledger
        self._seen, self._duplicates, self._on_pause = observation, duplicates, on_pause
        self._missing_since: dict[
            int, float
        ] = {}  # queue ids that the robot does not seem to have (any more), on the monotonic clock
        self._unreadable: set[int] = set()  # queue ids about which an alarm was raised

    def follow(self, serial_number: str | None, open_ids: set[int] | None = None) -> None:
        """Ask for every queued or executing item by its id; for many together, where the robot can be asked so. The
        results are written together. ``serial_number``: of the answering machine, if known. ``open_ids`` are those of
        the robot's list of open items, if it was read a moment ago."""
        if self._s.clearing.is_of(self._seen.robot.id):
            return  # what the robot has cancelled a moment ago is the operator's wish
        accepted = [(row, row.queue_id) for row in self.give_up_moved(serial_number) if row.queue_id is not None]
        items = self._items_from(min(queue_id for _row, queue_id in accepted)) if len(accepted) >= MANY else {}
        found: list[Transition] = []
        try:
            for row, queue_id in accepted:
                found += self._follow(row, queue_id, items.get(queue_id), open_ids)
        finally:
            self._ledger.apply(found)
        ids = {queue_id for _row, queue_id in accepted}
        self._missing_since = {key: since for key, since in self._missing_since.items() if key in ids}
        self._unreadable &= ids

    def give_up_moved(self, serial_number: str | None) -> list[Execution]:
        """Another machine answers, and the address was changed since some were accepted: what became of these can't be asked any more.
        Returns the others."""
        robot, problem = (
            self._seen.robot,
            message("the robot's address has been changed, and another machine answers there"),
        )
        rows = self._ledger.open_for(robot.id, WITH_THE_ROBOT)
        moved = [
            row
            for row in rows
            if row.robot_address not in (None, robot.address)
            and serial_number
            and row.robot_serial not in (None, serial_number)
        ]
        self._ledger.apply([self._duplicates.give_up(row, problem, may_come=False) for row in moved])
        return [row for row in rows if row not in moved]

    def _items_from(self, lowest: int) -> dict[int, QueueItem]:
        try:
            return {item.id: item for item in self._client.items_after(lowest - 1) if item.state_text}
        except NO_LIST:  # or too many at once, or one of them can't be read: one by one then
            return {}

    def _follow(
        self, row: Execution, queue_id: int, item: QueueItem | None, open_ids: set[int] | None
    ) -> list[Transition]:
        if item is None:
            self._on_pause()
            try:
                item = self._client.queue_item(queue_id, row.token)
            except (Rejected, RobotFault, Unreadable) as error:
                if not isinstance(error, Rejected) or error.status not in (404, 410):
                    return self._not_readable(row, queue_id, error, open_ids)
                return [self._vanished(row, queue_id)] if self._has_been_missing(queue_id) else []
        if not self._duplicates.own.is_ours(row, item):
            return [self._vanished(row, queue_id)]
        if row.cancel_code and item.state.is_open:
            self._duplicates.cancel(queue_id, row, runs=not item.is_pending)  # the first request may have been lost
        return self._transitions(row, item, open_ids)

    def _vanished(self, row: Execution, queue_id: int) -> Transition:
        details = {"queue_id": queue_id, **({} if self._client.capabilities.own_queue else {"fleet": True})}
        return transitions.end(Event.ABORT, row, Reason(ReasonCode.VANISHED, details))

    def _has_been_missing(self, queue_id: int) -> bool:
        """A booting robot may not know its queue yet: it has to give the same answer again after a while."""
        mono = self._s.clock.monotonic()
        return mono - self._missing_since.setdefault(queue_id, mono) >= GONE_FOR

    def _is_over(self, queue_id: int, open_ids: set[int] | None) -> bool:
        """Whether the robot neither lists it among the open ones nor runs it now."""
        status = self._seen.fresh_status
        if open_ids is None or queue_id in open_ids or status is None or status.mission_queue_id == queue_id:
            return False
        return self._has_been_missing(queue_id)

    def _not_readable(
        self, row: Execution, queue_id: int, error: RobotError, open_ids: set[int] | None
    ) -> list[Transition]:
        """An unreadable item delays no other: one alarm, repeated reading, and given up when its time is over. It stays
        watched, as it may be readable later."""
        if self._is_over(queue_id, open_ids):
            return [self._duplicates.give_up(row, error.message)]
        if queue_id not in self._unreadable:
            self._unreadable.add(queue_id)
            self._seen.raise_about(row, "item_unreadable", queue_id=queue_id, problem=error.message)
        return []

    def _transitions(self, row: Execution, item: QueueItem, open_ids: set[int] | None) -> list[Transition]:
        """With the robot that a fleet has chosen, written once, by its name here if it is in the plan."""
        found = self._states(row, item, open_ids)
        if not found or not self._seen.robot.is_any or row.taken_by or not item.vehicle_name:
            return found
        mates = [each for each in self._s.robots.all(self._s.db.read()) if each.fleet_id == self._seen.robot.fleet_id]
        name = next((each.name for each in mates if each.vehicle == item.vehicle), item.vehicle_name)
        return [replace(each, columns={**each.columns, "taken_by": name}) for each in found]

    def _states(self, row: Execution, item: QueueItem, open_ids: set[int] | None) -> list[Transition]:
        """What brings the execution to the state of its queue item."""
        now, delay = self._s.clock.now(), seconds_between(item.ordered, item.started)
        duration = seconds_between(item.started, item.finished)
        if item.state is QueueState.DONE:
            return [transitions.complete(row, now, duration, delay)]
        found = []
        if item.state is not QueueState.PENDING and row.state is State.QUEUED and item.started is not None:
            found.append(transitions.start(row, now, delay))
        is_unknown = item.state is QueueState.UNKNOWN
        if not is_unknown:
            self._missing_since.pop(item.id, None)
        if item.state is QueueState.ABORTED or (
            is_unknown and (item.finished is not None or self._is_over(item.id, open_ids))
        ):
            if self._s.clearing.is_of(self._seen.robot.id):
                return []  # begun while this robot was read
            if not item.state_text and not row.cancel_code:
                return [
                    self._duplicates.give_up(row, message("the fleet no longer shows how it ended"), may_come=False)
                ]
            says_why = self._client.capabilities.failure_text
            # A person may have cancelled it since.
            why = why_aborted(self._ledger.get(row.id) or row, item, says_why=says_why)
            row = found[-1].after if found else row
            found.append(transitions.end(Event.ABORT, row, why, duration_s=duration))
        return found


def why_aborted(row: Execution, item: QueueItem, *, says_why: bool = True) -> Reason:
    """Cancelled by a person, or failed with the robot's message, or with its final state if that is unknown. Without
    its own message, a robot returns the text that was sent."""
    words = "" if item.message == as_stored(row.label) else item.message
    if row.cancel_code:
        return Reason(row.cancel_code)
    if item.state is QueueState.UNKNOWN:
        words = f"{item.state_text}: {words}" if words else item.state_text
    elif words.lower().startswith(USER_REQUEST.lower()):
        return Reason(ReasonCode.USER_CANCELLED, {} if says_why else {"fleet": True})
    return Reason(ReasonCode.ROBOT_ABORTED, {"message": words} if words or says_why else {"fleet": True})


def seconds_between(start: datetime | None, end: datetime | None) -> float | None:
    """The difference of two of the robot's own time stamps; its clock may be wrong, so only the difference counts."""
    if start is None or end is None:
        return None
    return max(0.0, (end - start).total_seconds())
