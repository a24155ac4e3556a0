"""A history of invented runs."""

from __future__ import annotations

from datetime import timedelta

from app.container import Container
from app.domain.models import Execution, State, Trigger


def add_runs(container: Container, count: int) -> None:
    """So many completed ones of Deliver on R1, one a second from now; their tokens are "0", "1" and so on."""
    now = container.clock.now()
    rows = [
        Execution(
            trigger=Trigger.MANUAL,
            robot_id=1,
            robot="R1",
            mission="Deliver",
            mission_guid="guid",
            timezone="UTC",
            token=str(number),
            planned_at=now,
            closes_at=now,
            created_at=now,
            state=State.COMPLETED,
            ended_at=now + timedelta(seconds=number),
        )
        for number in range(count)
    ]
    container.db.write(lambda c: container.repositories.executions.add_many(c, rows))
