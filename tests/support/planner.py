"""The planner of an app alone, without the engine's rounds and without robots' workers."""

from __future__ import annotations

from app.container import Container
from app.services.dispatch.planner import DueBatch, Planner


def insert_due(container: Container) -> DueBatch:
    """What has fallen due gets its rows; no robot is ready for anything."""
    planner = Planner(
        container.db,
        clock=container.clock,
        downtime=container.downtime,
        alarms=container.alarms,
        ledger=container.ledger,
        changes=container.changes,
        restored_starts=container.restored_starts,
        hold_late_starts=False,
    )
    return planner.insert_due(lambda robot_id: None, lambda intents: None)
