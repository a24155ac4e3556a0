"""When more runs need something than there is room for: the robots of a group, or a place. Pure. A run needs it from
its instant for its usual duration. Times are of any one type with an order.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator
from datetime import datetime
from itertools import accumulate
from typing import NamedTuple


class Span(NamedTuple):
    begins: datetime
    ends: datetime


class Overload(NamedTuple):
    """From ``at`` on there are too many: ``number`` need it then. ``until``: when there is probably room for all of
    them again."""

    at: datetime
    number: int
    until: datetime


class Occupancy:
    """How many want it at each moment. Spans that touch don't overlap."""

    def __init__(self, spans: Iterable[Span]) -> None:
        steps = Counter[datetime]()
        for span in spans:
            if span.begins < span.ends:
                steps[span.begins] += 1
                steps[span.ends] -= 1
        self._times = sorted(steps)
        self._numbers = list(accumulate(steps[time] for time in self._times))

    def at(self, moment: datetime) -> int:
        place = bisect_right(self._times, moment)
        return self._numbers[place - 1] if place else 0

    def most(self, begins: datetime, ends: datetime) -> int:
        """The largest number at any moment in [begins, ends)."""
        first, last = bisect_right(self._times, begins), bisect_left(self._times, ends)
        return max(self.at(begins), *self._numbers[first:last], 0)

    def overloads(self, room: int) -> Iterator[Overload]:
        """In order of time."""
        begun: Overload | None = None
        for time, number in zip(self._times, self._numbers, strict=True):
            if number > room and begun is None:
                begun = Overload(time, number, time)
            elif number <= room and begun is not None:
                yield begun._replace(until=time)
                begun = None

    def first_overload(self, room: int, begins: datetime, ends: datetime) -> Overload | None:
        """The first one in [begins, ends), with the runs that need it from ``begins`` on."""
        for found in self.overloads(room):
            if found.until > begins and found.at < ends:
                return found if found.at >= begins else Overload(begins, self.at(begins), found.until)
        return None


def merged(spans: Iterable[Span]) -> list[Span]:
    """Of one robot: what overlaps is one span, as it wants the robot only once."""
    return [Span(begins, ends) for begins, _number, ends in Occupancy(spans).overloads(0)]
