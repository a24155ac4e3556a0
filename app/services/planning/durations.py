"""How long a mission takes: an estimate for the next run, and a comparison by day with what it took before the period. Pure functions."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from itertools import pairwise

from app.domain.models import DurationEstimate, Mission

MOST_MISSIONS = 5  # that are looked at
DURATIONS_OF = 5_000  # newest completed runs of a mission in the period
BASELINE_OF = 200  # newest completed runs before it, from which the usual range is computed
LEAST_BASELINE = 10  # fewer do not


@dataclass(frozen=True)
class Band:
    """The usual range: of ``count`` runs, four fifths took between ``p10_s`` and ``p90_s``."""

    count: int
    p10_s: float
    p50_s: float
    p90_s: float


@dataclass(frozen=True)
class DayMedian:
    day: date
    count: int
    median_s: float


@dataclass(frozen=True)
class Trend:
    """Of one mission. ``count`` completed runs in the period; ``median_s`` over the newest 5,000 of them; ``days`` those with any, oldest
    first; ``usual`` None without enough runs before the period."""

    guid: str
    mission: str
    count: int
    median_s: float
    usual: Band | None
    days: Sequence[DayMedian]

    @property
    def is_longer(self) -> bool:
        """The median run of the period took longer than nine of ten runs before it."""
        return self.usual is not None and self.median_s > self.usual.p90_s

    @property
    def is_shorter(self) -> bool:
        return self.usual is not None and self.median_s < self.usual.p10_s


def expected(learned: DurationEstimate | None, mission: Mission | None) -> DurationEstimate | None:
    """How long the next run will take: as the runs on that robot did or, without any, as a person typed it; None: not known."""
    if learned is not None or mission is None or mission.usual_minutes is None:
        return learned
    seconds = mission.usual_minutes * 60.0
    return DurationEstimate(seconds, seconds, typed=True)


def pooled(estimates: Sequence[DurationEstimate]) -> DurationEstimate | None:
    """Of the runs of several robots together; None without any."""
    samples = sorted(seconds for each in estimates for seconds in each.samples_s)
    if not samples:
        return None
    return DurationEstimate(percentile(samples, 50) or 0.0, percentile(samples, 90) or 0.0, tuple(samples))


def percentile(ordered: Sequence[float], percent: float) -> float | None:
    """By nearest rank: the smallest value that at least so many percent are not above."""
    if not ordered:
        return None
    return ordered[max(0, math.ceil(percent / 100 * len(ordered)) - 1)]


def band(seconds: Sequence[float]) -> Band | None:
    """The usual range of these runs; None when they are too few."""
    if len(seconds) < LEAST_BASELINE:
        return None
    ordered = sorted(seconds)
    p10, p50, p90 = (percentile(ordered, percent) or 0.0 for percent in (10, 50, 90))
    return Band(len(ordered), p10, p50, p90)


def trend(
    guid: str,
    mission: str,
    count: int,
    runs: Sequence[tuple[str, float]],
    before: Sequence[float],
    days: Sequence[tuple[date, str]],
) -> Trend:
    """``runs`` (ended, seconds), at least one; ``before`` seconds; ``days`` (date, its first instant) in order. Instants are text."""
    ordered: list[tuple[str, float]] = sorted((ended_at, seconds) for ended_at, seconds in runs)
    ended = [ended_at for ended_at, _ in ordered]
    edges = [*(bisect_left(ended, start) for _, start in days), len(ordered)]
    parts = [sorted(seconds for _, seconds in ordered[first:last]) for first, last in pairwise(edges)]
    medians = [
        DayMedian(day, len(part), percentile(part, 50) or 0.0)
        for (day, _), part in zip(days, parts, strict=True)
        if part
    ]
    return Trend(
        guid, mission, count, percentile(sorted(seconds for _, seconds in ordered), 50) or 0.0, band(before), medians
    )
