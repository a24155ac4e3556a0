"""What the repositories of configured things have in common: rows of one table, found by id and by name."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Mapping
from dataclasses import replace
from datetime import date, datetime
from typing import Any, ClassVar, Generic, TypeVar

from app.database.values import placeholders, to_json, to_text

T = TypeVar("T", bound=Any)  # a dataclass with an ``id``


class Table(Generic[T]):
    """Objects by the rows of ``name``; what goes along when one is removed is said in the schema. ``query`` selects what ``read`` needs."""

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
        found: int = c.execute(f"SELECT count(*) FROM {self.name}").fetchone()[0]
        return found

    def get(self, c: sqlite3.Connection, id_: int) -> T | None:
        return self.select_one(c, f"WHERE {self.name}.id = ?", id_)

    def by_name(self, c: sqlite3.Connection, name: str) -> T | None:
        return self.select_one(c, f"WHERE {self.name}.name = ?", name)

    def by_ids(self, c: sqlite3.Connection, ids: Collection[int]) -> dict[int, T]:
        """Those with these ids, by id."""
        return {each.id: each for each in self.select(c, f"WHERE {self.name}.id IN ({placeholders(ids)})", *ids)}

    def add(self, c: sqlite3.Connection, each: T) -> T:
        """Returns it with its id; one that is given (an undone removal) is kept."""
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

    def remove(self, c: sqlite3.Connection, id_: int) -> None:
        c.execute(f"DELETE FROM {self.name} WHERE id = ?", (id_,))

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
