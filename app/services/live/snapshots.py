"""The last known state of every robot, written by the robot workers and read by all others."""

from __future__ import annotations

import threading
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

from app.domain.models import RobotSnapshot, Settings
from app.services.live.changes import Changes, Topic


class Snapshots:
    def __init__(self, changes: Changes) -> None:
        self._changes = changes
        self._lock = threading.Lock()
        self._by_robot: dict[int, RobotSnapshot] = {}

    def get(self, robot_id: int) -> RobotSnapshot:
        return self._by_robot.get(robot_id) or RobotSnapshot(robot_id)

    def update(self, robot_id: int, **values: Any) -> RobotSnapshot:
        """Replace some fields, and notify listeners."""
        with self._lock:
            self._by_robot[robot_id] = snapshot = replace(self.get(robot_id), **values)
        self._changes.publish(Topic.SNAPSHOT, robot_id)
        return snapshot

    def forget(self, robot_id: int) -> None:
        with self._lock:
            self._by_robot.pop(robot_id, None)
        self._changes.publish(Topic.SNAPSHOT, robot_id)


STALE_POLLS = 3


def is_stale(read_at: datetime | None, now: datetime, settings: Settings) -> bool:
    """Whether a value read at that time is too old to be trusted: older than 3 polls."""
    return read_at is None or now - read_at > max(STALE_POLLS * settings.poll_interval, timedelta(seconds=6))
