"""Runs of the history: invented ones, and what it has."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any
from uuid import uuid4

from app.container import Container
from app.database.execution_history import ExecutionFilter
from app.domain.execution import Execution, State, Trigger


def add_runs(container: Container, count: int) -> None:
    """So many completed ones of Deliver on R1, one a second from now; their tokens are "0", "1" and so on."""
    now = container.clock.now()
    rows = [_run(now, token=str(number), ended_at=now + timedelta(seconds=number)) for number in range(count)]
    container.db.write(lambda c: container.repositories.executions.add_many(c, rows))


def add_run(container: Container, at: datetime, **values: Any) -> None:
    """One of that instant which is over, completed unless ``values`` of the row say otherwise."""
    run = _run(at, **{"token": str(uuid4()), "ended_at": at} | values)
    container.db.write(lambda c: container.repositories.executions.add_each_once(c, [run])[0])


def last_ended(container: Container, count: int) -> list[Execution]:
    """The newest that are over, newest first."""
    rows, now = container.history.page(ExecutionFilter(), size=1000).rows, container.clock.now()
    ended = [row for row in rows if row.ended_at is not None and row.ended_at <= now]
    return sorted(ended, key=lambda row: (row.ended_at, row.id), reverse=True)[:count]


def _run(at: datetime, **values: Any) -> Execution:
    usual = {"trigger": Trigger.MANUAL, "robot_id": 1, "mission": "Deliver", "mission_guid": "guid", "closes_at": at}
    usual |= {"robot": "R1", "timezone": "UTC", "state": State.COMPLETED}
    return Execution(planned_at=at, created_at=at, **usual | values)
