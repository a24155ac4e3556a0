"""How long the newest completed runs of each mission on each robot took. Triggers of the database keep that, in the statement by which one
completes, apart from the history, which may be pruned to nothing."""
from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from math import ceil
from statistics import median
from typing import NamedTuple

from app.domain.models import DurationEstimate


class RunDuration(NamedTuple):
    """One row as it is stored."""
    robot_id: int
    mission_guid: str
    ended_at: str
    execution_id: int
    duration_s: float


class DurationRepository:
    def usual(self, c: sqlite3.Connection, robot_id: int, mission_guid: str) -> DurationEstimate | None:
        """Of the newest 20 completed runs of at most a day of that mission on that robot; None when there is none. P90 by nearest rank."""
        rows = c.execute("SELECT duration_s FROM run_durations WHERE robot_id = ? AND mission_guid = ?", (robot_id, mission_guid))
        lasted = sorted(row[0] for row in rows)
        return DurationEstimate(median(lasted), lasted[ceil(0.9 * len(lasted)) - 1], tuple(lasted)) if lasted else None

    # ------------------------------------------------------------------ a robot that is removed takes its own with it
    def of_robot(self, c: sqlite3.Connection, robot_id: int) -> list[RunDuration]:
        return [RunDuration(*row) for row in c.execute(
            "SELECT robot_id, mission_guid, ended_at, execution_id, duration_s FROM run_durations WHERE robot_id = ?", (robot_id,))]

    def put_back(self, c: sqlite3.Connection, runs: Iterable[RunDuration]) -> None:
        """What such a robot had, when it is there again."""
        c.executemany("INSERT INTO run_durations (robot_id, mission_guid, ended_at, execution_id, duration_s) VALUES (?, ?, ?, ?, ?)", runs)
