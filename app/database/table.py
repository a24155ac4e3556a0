"""What the repositories of configured things have in common: rows of one table, found by id and by name."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Mapping
from dataclasses import replace
from datetime import date, datetime
from typing import Any, ClassVar, Generic, TypeVar

from app.database.values import placeholders, to_json, to_text

T = TypeVar("T", bound=Any)  # a dataclass with an ``id`` and a ``name``
_REMOVED = "\x1f"  # between the name of a removed object and its id: it can't be typed


class Table(Generic[T]):
    """Objects by the rows of ``name``, with the present ones in the view ``current_<name>``. ``query`` selects the
    columns that ``read`` needs."""

    name: ClassVar[str]
    columns: ClassVar[tuple[str, ...]]  # that are written, each from the attribute of that name
    query: ClassVar[str]
    order: ClassVar[str] = "name"

    @staticmethod
    def read(row: sqlite3.Row) -> T:
        raise NotImplementedError

    def values(self, each: T) -> list[object]:
        """In the order of ``columns``."""
        return [to_column(getattr(each, column)) for column in self.columns]

    def all(self, c: sqlite3.Connection) -> list[T]:
        """In order of name, if they have one."""
        return self.select(c, f"ORDER BY {self.order}")

    def count(self, c: sqlite3.Connection) -> int:
        found: int = c.execute(f"SELECT count(*) FROM current_{self.name}").fetchone()[0]
        return found

    def names(self, c: sqlite3.Connection) -> set[str]:
        return {row[0] for row in c.execute(f"SELECT name FROM current_{self.name}")}

    def get(self, c: sqlite3.Connection, id_: int) -> T | None:
        return self.select_one(c, f"WHERE {self.name}.id = ?", id_)

    def by_name(self, c: sqlite3.Connection, name: str) -> T | None:
        return self.select_one(c, f"WHERE {self.name}.name = ?", name)

    def by_ids(self, c: sqlite3.Connection, ids: Collection[int]) -> dict[int, T]:
        """Those with these ids, by id."""
        return {each.id: each for each in self.select(c, f"WHERE {self.name}.id IN ({placeholders(ids)})", *ids)}

    def add(self, c: sqlite3.Connection, each: T) -> T:
        """Returns it with its id; one that it has already is kept."""
        columns = ("id", *self.columns)
        cursor = c.execute(
            f"INSERT INTO {self.name} ({', '.join(columns)}) VALUES ({placeholders(columns)})",
            (each.id or None, *self.values(each)),
        )
        added: T = replace(each, id=cursor.lastrowid or each.id)
        return added

    def update(self, c: sqlite3.Connection, each: T) -> None:
        changes = ", ".join(f"{column} = ?" for column in self.columns)
        c.execute(f"UPDATE {self.name} SET {changes} WHERE id = ?", (*self.values(each), each.id))

    def remove(self, c: sqlite3.Connection, id_: int, now: datetime) -> None:
        """It is removed, except for ``put_back``; its name is free."""
        c.execute(
            f"UPDATE {self.name} SET deleted_at = ?, name = name || '{_REMOVED}' || id WHERE id = ?",
            (to_text(now), id_),
        )

    def put_back(self, c: sqlite3.Connection, id_: int, removed_at: datetime) -> T | None:
        """What was removed then is there again; its name has to be written by ``update``, where it is still free. None: it was not
        removed then."""
        changed = c.execute(
            f"UPDATE {self.name} SET deleted_at = NULL WHERE id = ? AND deleted_at = ?", (id_, to_text(removed_at))
        )
        found: T | None = self.get(c, id_) if changed.rowcount else None
        return found and replace(found, name=found.name.partition(_REMOVED)[0])

    def purge(self, c: sqlite3.Connection) -> None:
        """Finally delete what was removed."""
        c.execute(f"DELETE FROM {self.name} WHERE deleted_at IS NOT NULL")

    def select_one(self, c: sqlite3.Connection, rest: str, *values: object) -> T | None:
        """The first row with this ``rest`` of a query."""
        row = c.execute(f"{self.query} {rest}", values).fetchone()
        return None if row is None else self.read(row)

    def select(self, c: sqlite3.Connection, rest: str, *values: object) -> list[T]:
        """All rows with this ``rest`` of a query."""
        return [self.read(row) for row in c.execute(f"{self.query} {rest}", values)]


def to_column(value: object) -> object:
    """As it is stored."""
    match value:
        case datetime():
            return to_text(value)
        case date():
            return value.isoformat()
        case Mapping():
            return to_json(value)
    return value
