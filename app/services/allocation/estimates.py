"""How long a robot will be busy and how long a start will take there, in seconds, from the newest completed runs. Pure functions."""

from __future__ import annotations

from bisect import bisect_right
from statistics import median

from app.domain.models import DurationEstimate

UNKNOWN_S = 300.0  # of a mission of which nothing is known
FEW_RUNS = 3  # fewer on one robot say less than those of its whole group
OVERDUE = 0.15  # of the usual time are left when a run has lasted longer than every one before
SECONDS_PER_METRE = 1.5  # of the straight way to the first stop: a third of detour, at 0.9 m/s
SHORTEST_S = 20.0


def takes(
    own: DurationEstimate | None, of_group: DurationEstimate | None, way_m: float | None = None, *, slow: bool = False
) -> float:
    """A whole run: of this robot's runs if there are enough, else of the group's, else as typed. ``way_m``: straight to the mission's first
    stop; None: not known. ``slow``: what nine of ten runs stay under."""
    known = own if own is not None and (own.typed or own.runs >= FEW_RUNS) else of_group or own
    if known is None:
        return UNKNOWN_S
    usual_way = next(
        (median(each.ways_m) for each in (known, of_group) if each is not None and len(each.ways_m) >= FEW_RUNS), None
    )
    more = 0.0 if way_m is None or usual_way is None else (way_m - usual_way) * SECONDS_PER_METRE
    return max(SHORTEST_S, (known.slow_s if slow else known.median_s) + more)


def remaining(estimate: DurationEstimate | None, elapsed_s: float) -> float:
    """What is left of a run: the mean over the earlier ones that lasted longer than it has so far."""
    if estimate is None:
        return max(UNKNOWN_S - elapsed_s, UNKNOWN_S * OVERDUE)
    longer = estimate.samples_s[bisect_right(estimate.samples_s, elapsed_s) :] or (
        (estimate.median_s,) if elapsed_s < estimate.median_s else ()
    )
    return sum(longer) / len(longer) - elapsed_s if longer else estimate.median_s * OVERDUE
