"""What missions ask for when they are queued, as each robot has said when it was asked last."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from app.domain.robot import MissionParameter


class MissionParameterRepository:
    def get(self, c: sqlite3.Connection, robot_id: int, guid: str) -> Sequence[MissionParameter] | None:
        """None: the robot has not said it, or what is stored can't be used."""
        return _read(
            c.execute(
                "SELECT parameters FROM mission_parameters WHERE robot_id = ? AND mission_guid = ?", (robot_id, guid)
            ).fetchone()
        )

    def of_any(self, c: sqlite3.Connection, guid: str) -> Sequence[MissionParameter] | None:
        """As any robot has said: the same guid is the same mission."""
        return _read(
            c.execute("SELECT parameters FROM mission_parameters WHERE mission_guid = ? LIMIT 1", (guid,)).fetchone()
        )

    def put(self, c: sqlite3.Connection, said: Mapping[tuple[int, str], Sequence[MissionParameter]]) -> None:
        """By robot and guid, in the place of what was said before. Nothing is kept of a robot that has been removed, nor of a mission that
        is not configured."""
        c.executemany(
            """INSERT INTO mission_parameters (robot_id, mission_guid, parameters) SELECT id, ?, ? FROM robots WHERE id = ?
                         ON CONFLICT DO UPDATE SET parameters = excluded.parameters""",
            [
                (guid, json.dumps([asdict(parameter) for parameter in parameters]), robot_id)
                for (robot_id, guid), parameters in said.items()
            ],
        )
        c.execute("DELETE FROM mission_parameters WHERE mission_guid NOT IN (SELECT guid FROM missions)")


def _read(row: sqlite3.Row | None) -> Sequence[MissionParameter] | None:
    try:
        return None if row is None else tuple(map(_parameter, json.loads(row[0])))
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return None


def _parameter(found: dict[str, Any]) -> MissionParameter:
    for name in ("name", "label", "type", "sets", "unit"):
        if not isinstance(found[name], str):
            raise TypeError(name)
    for name in ("minimum", "maximum"):
        found[name] = None if found[name] is None else float(found[name])
    return MissionParameter(
        **{
            **found,
            **{
                name: tuple((value, str(label)) for value, label in found[name])
                for name in ("choices", "on_other_maps")
            },
        }
    )
