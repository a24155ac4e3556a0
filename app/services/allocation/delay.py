"""By how much planned starts would come late because of what is given to robots now."""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Mapping, Sequence

from app.services.allocation.belief import Coming


def delay(coming: Sequence[Coming], free_s: Mapping[int, float]) -> float:
    """Weighted seconds. ``free_s``: when each robot that can be used is free. A start that any of several robots may take gets, of those
    free in time, the one that is free last: it leaves the others to what comes before."""
    total = 0.0
    of_groups: dict[tuple[int, ...], list[float]] = {}
    for start in coming:
        if start.is_fixed:
            total += start.weight * max(0.0, free_s.get(start.members[0], 0.0) - start.planned_s)
            continue
        times = of_groups.get(start.members)
        if times is None:
            times = of_groups[start.members] = sorted(
                free_s[robot_id] for robot_id in start.members if robot_id in free_s
            )
        if times:
            begins = max(times.pop(max(0, bisect_right(times, start.planned_s) - 1)), start.planned_s)
            total += start.weight * (begins - start.planned_s)
            insort(times, begins + start.lasts_s)
    return total
