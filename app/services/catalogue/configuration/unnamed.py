"""Names for schedules of a file that have none: "<mission> on <robot>", with a number when that is taken."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from app.domain.models import Schedule


class Unnamed:
    """The unnamed schedules of one mission on one robot. ``names`` are tried in that order; ``taken`` are those that the file uses, to
    which the caller adds each one given; ``stored`` finds a schedule by name. Each name is looked up once, however many there are."""

    def __init__(self, names: Iterator[str], taken: set[str], stored: Callable[[str], Schedule | None]) -> None:
        self._names, self._taken, self._stored = names, taken, stored
        self._free = ""  # the first name that nothing has
        self._passed: list[Schedule] = []  # stored under the names before it
        self._found: dict[
            tuple[str, ...], tuple[list[int], dict[tuple[object, ...], deque[str]]]
        ] = {}  # by the keys that are given

    def name_of(self, values: Mapping[str, Any]) -> str:
        """The name of the stored schedule that has these values: importing a file twice must not plan everything twice. Else a free one."""
        while not self._free or self._free in self._taken:
            self._advance()
        keys = tuple(values)
        (seen,), found = entry = self._found.setdefault(keys, ([0], {}))
        for schedule in self._passed[seen:]:
            found.setdefault(_comparable({key: getattr(schedule, key) for key in keys}), deque()).append(schedule.name)
        entry[0][0] = len(self._passed)
        same = found.get(_comparable(values), deque())
        while same:
            if (name := same.popleft()) not in self._taken:
                return name
        return self._free

    def _advance(self) -> None:
        name = next(self._names)
        if name in self._taken:
            return
        stored = self._stored(name)
        if stored is None:
            self._free = name
        else:
            self._passed.append(stored)


def _comparable(values: Mapping[str, Any]) -> tuple[object, ...]:
    return tuple(
        json.dumps(value, sort_keys=True) if isinstance(value, Mapping) else value for value in values.values()
    )
