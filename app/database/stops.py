"""Positions that missions drive to, by the missions' guids: the same guid is the same mission, on whichever robot it is."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence

from app.domain.robot import Spot, Stop


class StopRepository:
    def of(self, c: sqlite3.Connection, mission_guid: str) -> tuple[Stop, ...]:
        """In order; empty also where no robot has told them."""
        return tuple(
            map(_stop, c.execute("SELECT * FROM mission_stops WHERE mission_guid = ? ORDER BY number", (mission_guid,)))
        )

    def all(self, c: sqlite3.Connection) -> dict[str, tuple[Stop, ...]]:
        """Of missions that drive anywhere."""
        found: dict[str, tuple[Stop, ...]] = {}
        for row in c.execute("SELECT * FROM mission_stops ORDER BY mission_guid, number"):
            found[row["mission_guid"]] = (*found.get(row["mission_guid"], ()), _stop(row))
        return found

    def keep(self, c: sqlite3.Connection, told: Mapping[str, Sequence[Stop]]) -> None:
        """Instead of what was known of these missions; of missions that are not configured any more nothing is."""
        c.executemany("DELETE FROM mission_stops WHERE mission_guid = ?", [(guid,) for guid in told])
        c.executemany(
            "INSERT INTO mission_stops VALUES (?, ?, ?, ?, ?, ?, ?)",
            [
                (guid, number, stop.position, stop.name, *(stop.spot or (None, None, None)))
                for guid, stops in told.items()
                for number, stop in enumerate(stops)
            ],
        )
        c.execute("DELETE FROM mission_stops WHERE mission_guid NOT IN (SELECT guid FROM missions)")


def _stop(row: sqlite3.Row) -> Stop:
    is_known = None not in (row["map_id"], row["x"], row["y"])
    return Stop(row["position"], row["name"], Spot(row["map_id"], row["x"], row["y"]) if is_known else None)
