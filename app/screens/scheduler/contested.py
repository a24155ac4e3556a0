"""Which planned starts the conflicts of the plan are about. Pure."""
from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator
from datetime import timedelta

from app.domain.conflicts import ConflictCode
from app.services.planning.overlaps import ASSUMED_S
from app.services.planning.planned import Conflict, PlannedRun

SHOWN = (ConflictCode.TOO_FEW_ROBOTS, ConflictCode.PLACE_FULL, ConflictCode.CRITICAL_BEHIND)


class Contested:
    """``conflicts`` in order of time; those of one group or place don't overlap."""

    def __init__(self, conflicts: Iterable[Conflict]) -> None:
        self._found = defaultdict[Hashable, list[Conflict]](list)
        for conflict in conflicts:
            if conflict.code in SHOWN:
                for key in _keys(conflict):
                    self._found[key].append(conflict)

    def of(self, run: PlannedRun) -> list[Conflict]:
        """Those that this start has a part in."""
        ends = run.at + timedelta(seconds=run.usual_s or ASSUMED_S)
        crowds = [("group", run.group.id)] if run.group is not None else []
        found = []
        for key in (*crowds, ("mission", run.mission.name)):
            those = self._found.get(key, ())
            before = bisect_left(those, ends, key=lambda conflict: conflict.at)
            last = those[before - 1] if before else None
            if last is not None and (last.details["until"] is None or last.details["until"] > run.at):
                found.append(last)
        return found + self._found.get(("start", run.schedule.id, run.at), [])


def _keys(conflict: Conflict) -> Iterator[Hashable]:
    details = conflict.details
    match conflict.code:
        case ConflictCode.TOO_FEW_ROBOTS:
            yield "group", details["group_id"]
        case ConflictCode.PLACE_FULL:
            yield from (("mission", name) for name in details["missions"])
        case ConflictCode.CRITICAL_BEHIND:
            yield "start", details["schedule_id"], conflict.at
