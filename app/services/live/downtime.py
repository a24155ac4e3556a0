"""Times in which nothing could be started: the app was off, the tablet slept, its clock could not be trusted, or its disk was full."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

from app.domain.clock import MOMENT
from app.domain.message import Message

HEARTBEAT_EVERY = 15.0  # s; a power cut is known to about this precision
UNKNOWN_START = datetime(1, 1, 1, tzinfo=UTC)  # the start of a gap whose beginning is not known
SHORTEST_ABSENCE = timedelta(seconds=60)  # a shorter gap is a restart or a slow moment, not an absence


@dataclass(frozen=True)
class Gap:
    start: datetime
    end: datetime
    clock: bool = False  # the clock was not plausible, rather than the app off or asleep
    problem: Message | None = None  # why nothing could be written, while the app was on


class Downtime:
    """The gaps of this run of the app, newest last; written by the scheduler thread, read by all robot workers."""

    KEPT = 100

    def __init__(self) -> None:
        self._gaps: list[Gap] = []  # replaced with each change: it may be read at the same time

    def add(self, gap: Gap) -> None:
        self._gaps = [*self._gaps, gap][-self.KEPT :]

    def forget_future(self, now: datetime) -> None:
        """The clock has been set back: later times that it showed say nothing about the future."""
        self._gaps = [replace(gap, end=min(gap.end, now)) for gap in self._gaps if gap.start < now]

    def at(self, instant: datetime) -> Gap | None:
        """The gap that this instant fell into."""
        return next((gap for gap in reversed(self._gaps) if gap.start <= instant <= gap.end), None)

    def edges(self) -> list[datetime]:
        """Between two of them, the later one included, ``at`` says the same of every instant."""
        begins = [max(gap.start, UNKNOWN_START + MOMENT) - MOMENT for gap in self._gaps]
        return [*begins, *(gap.end for gap in self._gaps)]

    def overlaps(self, start: datetime, end: datetime) -> bool:
        """Whether the app was away for any of this time."""
        return any(gap.start < end and start < gap.end for gap in self._gaps if gap.problem is None)
