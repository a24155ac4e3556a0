"""The robot's mission queue, which is also its history: items are added and never removed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any


class ItemState(StrEnum):
    """States of a queue item, as the API writes them."""

    PENDING = "Pending"
    EXECUTING = "Executing"
    ABORT = "Abort"  # shortly, while a cancelled mission is being stopped (reported)
    DONE = "Done"
    ABORTED = "Aborted"


USER_ABORT = "Aborted - User Request"  # by this exact text clients distinguish a cancellation from a failure


@dataclass
class QueueAction:
    """A started action of an item."""

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
    """One entry of the queue. Timestamps are naive local time of the robot, None until set."""

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
    actions: list[QueueAction] = field(default_factory=list)

    def finish(self, state: ItemState, when: str, message: str) -> None:
        self.state, self.finished, self.message = state, when, message
        if self.actions and self.actions[-1].finished is None:
            self.actions[-1].finished = when
            self.actions[-1].message = message

    def value(self, name: str) -> Any:
        """One field, without building the whole item: queues are long."""
        return getattr(self, name) if name in PLAIN_FIELDS else (self.full() | self.summary())[name]

    def summary(self) -> dict[str, Any]:
        """The fields that a list shows."""
        return {"url": f"/v2.0.0/mission_queue/{self.id}", "state": str(self.state), "id": self.id}

    def full(self) -> dict[str, Any]:
        """All fields, as recorded."""
        return {
            "actions": f"/v2.0.0/mission_queue/{self.id}/actions",
            "allowed_methods": ["PUT", "GET", "DELETE"],
            "control_posid": "0",
            "control_state": 0,
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


PLAIN_FIELDS = frozenset(
    (
        "id",
        "mission_id",
        "ordered",
        "created_by_id",
        "message",
        "description",
        "fleet_schedule_guid",
        "priority",
        "state",
        "started",
        "finished",
    )
)


class MissionQueue:
    """All items by ascending id."""

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
        """Append an item. Raises ValueError when its id isn't above all others."""
        if item.id < self.next_id:
            raise ValueError(f"queue id {item.id} is not above {self.next_id - 1}")
        self._items[item.id] = item
        if item.state is ItemState.PENDING:
            self._pending.append(item.id)

    def pending(self) -> list[QueueItem]:
        """Pending items in the order in which they will start: by id, since new items go to the end. Priority has no effect (guess)."""
        return [self._items[item_id] for item_id in self._pending]

    def leave_pending(self, item: QueueItem) -> None:
        self._pending.remove(item.id)
