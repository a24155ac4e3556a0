"""How long the newest completed runs of each mission on each robot took, and from how far away they began. Triggers of the database keep
that, in the statement by which one completes, apart from the history, which may be pruned to nothing."""

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
    approach_m: float | None = None


class DurationRepository:
    def usual(self, c: sqlite3.Connection, robot_id: int, mission_guid: str) -> DurationEstimate | None:
        """Of the newest 20 completed runs of at most a day of that mission on that robot; None when there is none. P90 by nearest rank."""
        rows = c.execute(
            "SELECT duration_s, approach_m FROM run_durations WHERE robot_id = ? AND mission_guid = ?",
            (robot_id, mission_guid),
        ).fetchall()
        lasted, ways = sorted(row[0] for row in rows), sorted(row[1] for row in rows if row[1] is not None)
        return (
            DurationEstimate(median(lasted), lasted[ceil(0.9 * len(lasted)) - 1], tuple(lasted), tuple(ways))
            if lasted
            else None
        )

    # ------------------------------------------------------------------ a robot that is removed takes its own with it
    def of_robot(self, c: sqlite3.Connection, robot_id: int) -> list[RunDuration]:
        return [
            RunDuration(*row)
            for row in c.execute(
                f"SELECT {', '.join(RunDuration._fields)} FROM run_durations WHERE robot_id = ?", (robot_id,)
            )
        ]

    def put_back(self, c: sqlite3.Connection, runs: Iterable[RunDuration]) -> None:
        """What such a robot had, when it is there again."""
        c.executemany(f"INSERT INTO run_durations ({', '.join(RunDuration._fields)}) VALUES (?, ?, ?, ?, ?, ?)", runs)
