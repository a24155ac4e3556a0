"""Whether a robot can take a start of a group, and whether it is free, by its state read a moment ago. Pure
functions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from app.domain.activity import activity_of
from app.domain.choice import LEAVES_ROBOT_FREE
from app.domain.models import Execution, State, Trigger
from app.domain.robot import QueueItem, RobotState, RobotStatus

_WORKS = frozenset({RobotState.READY, RobotState.EXECUTING})
_AFTER_A_RUN = frozenset(
    {RobotState.ABORTED, RobotState.COMPLETED, RobotState.DOCKED, RobotState.DOCKING}
)  # for moments


def can_work(status: RobotStatus) -> bool:
    """It has no error, is not paused, stopped, driven by hand or mapping."""
    return status.state in _WORKS | _AFTER_A_RUN and not status.errors


def is_charging(status: RobotStatus | None) -> bool:
    """With a mission that ends by itself when something comes."""
    return status is not None and activity_of(status) == "charging"


def at_work(rows: Iterable[Execution], status: RobotStatus | None) -> list[Execution]:
    """A robot's open starts that block others: not its idle mission while it charges, and not starts that wait for
    something other than the robot."""
    return [
        row
        for row in rows
        if not (row.trigger is Trigger.IDLE and is_charging(status))
        and not (row.state is State.WAITING and row.wait in LEAVES_ROBOT_FREE)
    ]


def is_free(status: RobotStatus | None, queue: Sequence[QueueItem], rows: Iterable[Execution]) -> bool:
    """Ready, or charging, with an empty queue: between two missions it is ready for a moment. ``rows``: its open
    executions, except the one to be sent."""
    if status is None or not (status.state is RobotState.READY or is_charging(status)) or not can_work(status):
        return False
    return not at_work(rows, status) and not any(item.is_pending for item in queue)
