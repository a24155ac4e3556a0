"""MiR Fleets, through which robots may be reached."""

from __future__ import annotations

import sqlite3
from datetime import datetime

from app.database.check_ups import profile_of, profile_text
from app.database.table import Table
from app.domain.models import Fleet, FleetKind


class FleetRepository(Table[Fleet]):
    name = "fleets"
    columns = (
        "name",
        "address",
        "kind",
        "username",
        "token",
        "certificate_sha256",
        "enabled",
        "needs_password",
        "identity",
        "software",
        "profile",
    )
    query = "SELECT * FROM current_fleets AS fleets"

    @staticmethod
    def read(row: sqlite3.Row) -> Fleet:
        return fleet_of(row)

    def values(self, each: Fleet) -> list[object]:
        found = dict(zip(self.columns, super().values(each), strict=True))
        return list((found | {"profile": each.profile and profile_text(each.profile)}).values())

    def remove(self, c: sqlite3.Connection, id_: int, now: datetime) -> None:
        """The token stays with the deletion, for an undo."""
        super().remove(c, id_, now)
        c.execute("UPDATE fleets SET token = NULL WHERE id = ?", (id_,))

    def robot_ids(self, c: sqlite3.Connection, fleet_id: int) -> list[int]:
        """Of its robots that are in the plan, in order."""
        rows = c.execute("SELECT id FROM current_robots WHERE fleet_id = ? ORDER BY id", (fleet_id,))
        return [row[0] for row in rows]

    def note_identity(self, c: sqlite3.Connection, asked: Fleet, identity: str | None, software: str | None) -> bool:
        """Store what the fleet says of itself; returns whether it was stored: not if ``asked`` has been edited since,
        so that it may be another one. A known identity stays."""
        if self.get(c, asked.id) != asked:
            return False
        c.execute(
            "UPDATE fleets SET identity = coalesce(identity, ?), software = ? WHERE id = ?",
            (identity, software, asked.id),
        )
        return True


COLUMNS_OF_FLEET = ", ".join(f"fleets.{column} AS fleet_{column}" for column in FleetRepository.columns)


def fleet_of(row: sqlite3.Row, prefix: str = "") -> Fleet:
    """From its columns, whose names begin with ``prefix``."""
    values = {name: row[prefix + name] for name in ("id", *FleetRepository.columns)}
    return Fleet(
        **values
        | {
            "kind": FleetKind(values["kind"]),
            "enabled": bool(values["enabled"]),
            "needs_password": bool(values["needs_password"]),
            "profile": None if values["profile"] is None else profile_of(values["profile"]),
        }
    )
