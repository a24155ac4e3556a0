"""The robot's mission queue: a history that only grows, and the items of it that are still open."""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any


class ItemState(StrEnum):
    """States of a queue item as they stand on the wire."""

    PENDING = "Pending"
    EXECUTING = "Executing"
    ABORT = "Abort"            # reported: for a moment, while a cancelled mission is being stopped
    DONE = "Done"
    ABORTED = "Aborted"

    @property
    def is_open(self) -> bool:
        return self in (ItemState.PENDING, ItemState.EXECUTING, ItemState.ABORT)


USER_ABORT = "Aborted - User Request"     # clients tell a cancellation from a failure by exactly this text


@dataclass
class QueueAction:
    """One action of an item that has been started."""

    id: int
    action_id: str
    action_type: str
    parameters: list[dict[str, Any]]
    started: str
    finished: str | None = None
    state: str = ""
    message: str = ""


@dataclass
class QueueItem:
    """One entry of the queue. Timestamps are the robot's naive local time, None until set."""

    id: int
    mission_id: str
    ordered: str
    created_by_id: str
    created_by_name: str
    message: str = ""
    description: str = ""
    fleet_schedule_guid: str = ""
    priority: int = 0
    parameters: list[dict[str, Any]] = field(default_factory=list)
    state: ItemState = ItemState.PENDING
    started: str | None = None
    finished: str | None = None
    control_state: int = 0
    actions: list[QueueAction] = field(default_factory=list)

    def finish(self, state: ItemState, when: str, message: str) -> None:
        self.state, self.finished, self.message = state, when, message
        if self.actions and self.actions[-1].finished is None:
            self.actions[-1].finished = when
            self.actions[-1].message = message

    def value(self, name: str) -> Any:
        """One field, without building the whole item: histories are long."""
        return getattr(self, name) if name in PLAIN_FIELDS else (self.full() | self.summary())[name]

    def summary(self) -> dict[str, Any]:
        """What the bare list shows of an item."""
        return {"url": f"/v2.0.0/mission_queue/{self.id}", "state": str(self.state), "id": self.id}

    def full(self) -> dict[str, Any]:
        """The item as recorded on robots."""
        return {
            "actions": f"/v2.0.0/mission_queue/{self.id}/actions",
            "allowed_methods": ["PUT", "GET", "DELETE"],
            "control_posid": "0",
            "control_state": self.control_state,
            "created_by": f"/v2.0.0/users/{self.created_by_id}",
            "created_by_id": self.created_by_id,
            "created_by_name": self.created_by_name,
            "description": self.description,
            "finished": self.finished,
            "fleet_schedule_guid": self.fleet_schedule_guid,
            "id": self.id,
            "message": self.message,
            "mission": f"/v2.0.0/missions/{self.mission_id}",
            "mission_id": self.mission_id,
            "ordered": self.ordered,
            "parameters": self.parameters,
            "priority": self.priority,
            "started": self.started,
            "state": str(self.state),
        }


PLAIN_FIELDS = frozenset(("id", "mission_id", "ordered", "created_by_id", "message", "description", "fleet_schedule_guid", "priority",
                          "state", "started", "finished"))


class MissionQueue:
    """All items by ascending id. Nothing is ever taken out."""

    def __init__(self) -> None:
        self._items: dict[int, QueueItem] = {}
        self._pending: list[int] = []

    def __iter__(self) -> Iterator[QueueItem]:
        return iter(self._items.values())

    def __len__(self) -> int:
        return len(self._items)

    @property
    def next_id(self) -> int:
        return next(reversed(self._items), 0) + 1

    def get(self, item_id: int) -> QueueItem | None:
        return self._items.get(item_id)

    def add(self, item: QueueItem) -> None:
        """Put an item at the end. Raises ValueError when its id isn't above all others."""
        if item.id < self.next_id:
            raise ValueError(f"queue id {item.id} is not above {self.next_id - 1}")
        self._items[item.id] = item
        if item.state is ItemState.PENDING:
            self._pending.append(item.id)

    def pending(self) -> list[QueueItem]:
        """Items that wait, in the order in which they will start: that of their ids, whatever their priority (MiR's definition says so)."""
        return [self._items[item_id] for item_id in self._pending]

    def leave_pending(self, item: QueueItem) -> None:
        self._pending.remove(item.id)
