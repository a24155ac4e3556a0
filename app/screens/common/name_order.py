"""Robots, groups, missions: by name, as in every list, and by id. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable
from operator import attrgetter
from typing import Protocol, TypeVar

_NUMBER = re.compile(r"(\d+)")
T = TypeVar("T")


class HasId(Protocol):
    @property
    def id(self) -> int: ...


Thing = TypeVar("Thing", bound=HasId)


def with_id(things: Iterable[Thing], wanted: int | None) -> Thing | None:
    return next((thing for thing in things if thing.id == wanted), None)


def by_name(things: Iterable[T], of: str = "name") -> tuple[T, ...]:
    """By the attribute ``of``, as people count: Robot 2 before Robot 10."""
    name = attrgetter(of)
    return tuple(
        sorted(
            things,
            key=lambda thing: [
                (int(part), "") if part.isdecimal() else (-1, part) for part in _NUMBER.split(name(thing).casefold())
            ],
        )
    )
