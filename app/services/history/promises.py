"""What the app said beforehand against what came: how long runs would take, wherever it says "until about" or "nine of ten within"."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import timedelta
from itertools import groupby
from statistics import median

from app.database.connection import Database
from app.database.group_kpi import timed_runs
from app.database.kpi import EARLIEST
from app.database.values import to_instant, to_text
from app.domain.clock import Clock
from app.services.history.kpi import KpiFilter, span_of
from app.services.planning.durations import percentile

RESTS_ON = 20  # newest completed runs of a mission on a robot, as wherever the app estimates
LEAST = 5  # earlier runs: with fewer nothing was promised that could be kept
BEFORE = timedelta(days=28)  # in which the runs that a promise rests on are looked for

Timed = tuple[str, float]  # when a run ended, as text, and how many s it took


@dataclass(frozen=True)
class Kept:
    """Of ``runs`` that began with an estimate: how many took no longer than nine of ten before them, and the median of how far they were
    from the usual duration, in s, and of nine of ten."""

    runs: int = 0
    kept: int = 0
    off_p50_s: float | None = None
    off_p90_s: float | None = None

    @property
    def share(self) -> float | None:
        """Should be 0.9."""
        return self.kept / self.runs if self.runs else None


def kept(histories: Iterable[Sequence[Timed]], since: str) -> Kept:
    """``histories``: completed runs of one mission on one robot each, oldest first; those that ended from ``since`` on count."""
    number, held, off = 0, 0, list[float]()
    for runs in histories:
        earlier: deque[float] = deque(maxlen=RESTS_ON)
        for ended_at, seconds in runs:
            if ended_at >= since and len(earlier) >= LEAST:
                known = sorted(earlier)
                number += 1
                held += seconds <= known[math.ceil(0.9 * len(known)) - 1]
                off.append(abs(seconds - median(known)))
            earlier.append(seconds)
    off.sort()
    return Kept(number, held, percentile(off, 50), percentile(off, 90))


class PromiseFigures:
    def __init__(self, db: Database, clock: Clock) -> None:
        self._db, self._clock = db, clock

    def of(self, wanted: KpiFilter | None = None) -> Kept:
        """Of the runs that completed in the period."""
        span = span_of(wanted, self._clock.now())
        begin = EARLIEST if span.start == EARLIEST else to_text(to_instant(span.start) - BEFORE)
        rows = timed_runs(self._db.read(), begin, span.end, span.robot_ids)
        histories = (
            [(ended_at, seconds) for *_, ended_at, seconds in those] for _, those in groupby(rows, lambda row: row[:2])
        )
        return kept(histories, span.start)
