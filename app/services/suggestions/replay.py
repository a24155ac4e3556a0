"""What the last weeks would have been like with one schedule at another time or on another robot. Pure; times are seconds of one clock.

Each of its starts is taken out of what its robot did and put in elsewhere: it waits until that robot was through with what it had then.
That what came behind it would have been earlier is not counted, nor that robots differ in speed.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

LATE_S = 300.0  # after its planned instant
NEXT_S = 10.0  # between two runs of a queue, at most
HOUR = 3600.0
DAY = 24 * HOUR


class Start(NamedTuple):
    """A planned start of the past. ``robot``: where it ran, or was to run; 0: nobody had been chosen. ``low_battery``: it was given up for
    that; without ``started`` it never ran."""

    id: int
    schedule: int
    robot: int
    planned: float
    started: float | None
    ended: float | None
    low_battery: bool = False

    @property
    def late_s(self) -> float:
        return DAY if self.started is None else max(0.0, self.started - self.planned)

    @property
    def is_late(self) -> bool:
        return self.late_s > LATE_S


class Busy(NamedTuple):
    """A robot was not free. ``start``: of which planned start; 0: of none. ``planned``: when it fell due, which is its place in the queue.
    ``why``: what it did (see ``Cause``), ``mission`` where it is known."""

    begins: float
    ends: float
    start: int = 0
    planned: float | None = None
    why: str = "busy"
    mission: str = ""


@dataclass(frozen=True)
class Replay:
    """Of ``starts``, in each half of the days: how many there were and how many came late. ``harm``: starts of others newly late."""

    starts: tuple[int, int]
    late: tuple[int, int]
    harm: int

    @property
    def number(self) -> int:
        return sum(self.late)


class Past:
    def __init__(self, starts: Sequence[Start], busy: Mapping[int, Iterable[Busy]]) -> None:
        self.of_schedule: dict[int, list[Start]] = defaultdict(list)
        self._busy = {robot: sorted(spans) for robot, spans in busy.items()}
        self._queues = {
            robot: [
                (span.begins, span.ends, span.start, -inf if span.planned is None else span.planned) for span in spans
            ]
            for robot, spans in self._busy.items()
        }
        self._begins = {robot: [span.begins for span in spans] for robot, spans in self._busy.items()}
        self._in_time: dict[int, list[float]] = defaultdict(list)  # planned, by robot
        self._low: dict[int, list[float]] = defaultdict(list)
        for start in sorted(starts, key=lambda one: one.planned):
            self.of_schedule[start.schedule].append(start)
            if start.low_battery:
                self._low[start.robot].append(start.planned)
            elif not start.is_late:
                self._in_time[start.robot].append(start.planned)

    def wait_s(self, robot: int, at: float, without: int) -> float:
        """Until that robot was through with what it had then, a start taken out."""
        spans, until = self._queues.get(robot, ()), at
        number = max(0, bisect_right(self._begins.get(robot, ()), at) - 1)
        while number < len(spans):
            begins, ends, start, planned = spans[number]
            if begins > until + NEXT_S:
                break
            if ends > until and planned <= at and (start != without or not without):
                until = ends
            number += 1
        return until - at

    def blocked_by(self, start: Start) -> Busy | None:
        """What its robot did when it fell due."""
        spans = self._busy.get(start.robot, ())
        number = bisect_right(self._begins.get(start.robot, ()), start.planned + NEXT_S) - 1
        if number < 0 or spans[number].ends <= start.planned or spans[number].start == start.id:
            return None
        return spans[number]

    def had_low_battery(self, robot: int, at: float) -> bool:
        """Something was given up for its battery within an hour."""
        times = self._low.get(robot, ())
        return bisect_left(times, at + HOUR) > bisect_right(times, at - HOUR)

    def _harm(self, robot: int, begins: float, ends: float, own: Start) -> int:
        """Starts of others that were in time and would not have been."""
        times = self._in_time.get(robot, ())
        number = max(0, bisect_left(times, ends - LATE_S) - bisect_left(times, begins))
        is_own = own.robot == robot and not own.is_late and begins <= own.planned < ends - LATE_S
        return number - is_own

    def replay(
        self, schedule: int, shift: float, robots: Sequence[int], lasts: float, most: tuple[float, float] = (inf, inf)
    ) -> Replay | None:
        """``lasts``: of a start that never ran. None as soon as more than ``most`` in either half of the days would have come late."""
        late, starts, harm = [0, 0], [0, 0], 0
        for start, half in self._in_halves(schedule):
            starts[half] += 1
            at = start.planned + shift
            usable = [robot for robot in robots if not self.had_low_battery(robot, at)]
            wait, robot = min(((self.wait_s(robot, at, start.id), robot) for robot in usable), default=(DAY, 0))
            late[half] += wait > LATE_S
            if late[half] > most[half]:
                return None
            if not usable:
                continue
            took = start.ended - start.started if start.started is not None and start.ended is not None else lasts
            harm += self._harm(robot, at + wait, at + wait + took, start)
        return Replay((starts[0], starts[1]), (late[0], late[1]), harm)

    def late_in_halves(self, schedule: int) -> tuple[int, int]:
        """How many came late on every other day, and on the days between."""
        late = [0, 0]
        for start, half in self._in_halves(schedule):
            late[half] += start.is_late
        return late[0], late[1]

    def _in_halves(self, schedule: int) -> Iterator[tuple[Start, int]]:
        day, half = None, 1
        for start in self.of_schedule[schedule]:
            if start.planned // DAY != day:
                day, half = start.planned // DAY, 1 - half
            yield start, half
