"""How long a robot will be busy and how long a start will take there, in seconds, from the newest completed runs. Pure functions."""
from __future__ import annotations

from bisect import bisect_right

from app.domain.models import DurationEstimate

UNKNOWN_S = 300.0            # of a mission of which nothing is known
FEW_RUNS = 3                 # fewer on one robot say less than those of its whole group
OVERDUE = 0.15               # of the usual time are left when a run has lasted longer than every one before
SECONDS_PER_METRE = 1.5      # of the straight way to the first place: a third of detour, at 0.9 m/s
SHORTEST_S = 20.0


def takes(own: DurationEstimate | None, of_group: DurationEstimate | None, metres_more: float = 0.0, *, slow: bool = False) -> float:
    """A whole run: of this robot's runs if there are enough, else of the group's, else as typed. ``metres_more``: how much farther than
    usual the mission's first place is. ``slow``: what nine of ten runs stay under."""
    known = own if own is not None and (own.typed or own.runs >= FEW_RUNS) else of_group or own
    if known is None:
        return UNKNOWN_S
    return max(SHORTEST_S, (known.slow_s if slow else known.median_s) + metres_more * SECONDS_PER_METRE)


def remaining(estimate: DurationEstimate | None, elapsed_s: float) -> float:
    """What is left of a run: the mean over the earlier ones that lasted longer than it has so far."""
    if estimate is None:
        return max(UNKNOWN_S - elapsed_s, UNKNOWN_S * OVERDUE)
    longer = estimate.samples_s[bisect_right(estimate.samples_s, elapsed_s):] or (
        (estimate.median_s,) if elapsed_s < estimate.median_s else ())
    return sum(longer) / len(longer) - elapsed_s if longer else estimate.median_s * OVERDUE
