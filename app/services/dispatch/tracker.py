"""Follows what was accepted to its end, by queue id and never by the robot's state."""
from __future__ import annotations

import logging
from collections.abc import Sequence

from app.domain.models import Execution, Reason, ReasonCode, Robot, State
from app.domain.robot import QueueItem, QueueState
from app.mir.client import RobotClient
from app.mir.errors import Rejected, RobotError, Unreadable
from app.services.dispatch.dispatcher import Dispatcher
from app.services.dispatch.ledger import WITH_THE_ROBOT, Ledger, Move, seconds_between

log = logging.getLogger(__name__)

USER_REQUEST = "aborted - user request"       # the message of a cancellation in the robot's language en_US

MANY = 3                     # open executions that are asked for in one request instead of one each


class Tracker:
    """One robot's accepted executions. Called by its worker only. Raises RobotError when the robot can't be asked: rows stay open."""

    def __init__(self, robot: Robot, client: RobotClient, ledger: Ledger, dispatcher: Dispatcher) -> None:
        self._robot, self._client, self._ledger, self._dispatcher = robot, client, ledger, dispatcher

    def follow(self) -> None:
        """Ask for every queued or executing item by its id; for many together, where the robot can be asked so. What that brought is
        written together."""
        executions = self._ledger.open_for(self._robot.id, WITH_THE_ROBOT)
        accepted = [(execution, execution.queue_id) for execution in executions if execution.queue_id is not None]
        items = self._items_from(min(queue_id for _, queue_id in accepted)) if len(accepted) >= MANY else {}
        moves: list[Move] = []
        try:
            for execution, queue_id in accepted:
                moves += self._follow(execution, queue_id, items.get(queue_id))
        finally:
            self._ledger.make(moves)

    def _items_from(self, lowest: int) -> dict[int, QueueItem]:
        try:
            return {item.id: item for item in self._client.items_after(lowest - 1)}
        except Unreadable:                                # too many at once: one by one then
            return {}

    def _follow(self, execution: Execution, queue_id: int, item: QueueItem | None) -> list[Move]:
        vanished = [self._ledger.ended(execution, Reason(ReasonCode.VANISHED, {"queue_id": queue_id}))]
        try:
            item = item or self._client.queue_item(queue_id)
        except Rejected as error:
            if error.status in (404, 410):
                return vanished
            raise
        if not is_ours(execution, item):
            return vanished
        if execution.cancel_code and item.is_open:
            self._ask_again(queue_id)
        return self._moves(execution, item)

    def _moves(self, execution: Execution, item: QueueItem) -> list[Move]:
        """What brings the execution to the state of its queue item."""
        delay = seconds_between(item.ordered, item.started)
        duration = seconds_between(item.started, item.finished)
        if item.state is QueueState.DONE:
            return [self._ledger.completed(execution, duration, delay)]
        moves = []
        if item.state is not QueueState.PENDING and execution.state is State.QUEUED and item.started is not None:
            moves.append(self._ledger.started(execution, delay))
        if item.state is QueueState.ABORTED:
            moves.append(self._ledger.ended(execution, why_aborted(execution, item), duration_s=duration))
        return moves

    def _ask_again(self, queue_id: int) -> None:
        """A cancellation that the robot has not carried out yet (the first request may have been lost)."""
        try:
            self._client.cancel(queue_id)
        except RobotError as error:
            log.info("Item %d of %r could not be cancelled yet: %s", queue_id, self._robot.name, error.text)

    def cancel_duplicates(self, open_items: Sequence[QueueItem]) -> None:
        """Search the robot's open items for a second copy of ours: a request that arrived after all."""
        for item in open_items:
            if not looks_like_token(item.description):
                continue
            execution = self._ledger.by_token(item.description)
            if execution is None or execution.queue_id == item.id or execution.robot_id != self._robot.id:
                continue
            if execution.state not in (State.SUBMITTING, State.WAITING):      # these are still being reconciled
                self._dispatcher.cancel_duplicate(item, execution)


def looks_like_token(description: str) -> bool:
    return len(description) == 36 and description.count("-") == 4


def is_ours(execution: Execution, item: QueueItem) -> bool:
    """Whether the item under our id is the one we put there; after a reset of the robot's database the number may be somebody else's.

    The token is the proof; a robot that doesn't give ``description`` back is judged by the mission.
    """
    if looks_like_token(item.description):
        return item.description == execution.token
    return item.mission_id in (None, "", execution.mission_guid)


def why_aborted(execution: Execution, item: QueueItem) -> Reason:
    """Cancelled by a person, or failed with the robot's message."""
    message = (item.message or "").strip()
    if execution.cancel_code:
        return Reason(execution.cancel_code)
    if message.lower().startswith(USER_REQUEST):
        return Reason(ReasonCode.USER_CANCELLED)
    return Reason(ReasonCode.ROBOT_ABORTED, {"message": message})
