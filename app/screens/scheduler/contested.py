"""Which planned starts the conflicts of the plan are about. Pure."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Hashable, Iterable
from datetime import datetime, timedelta

from app.domain.conflicts import ConflictCode
from app.services.planning.planned import ASSUMED_S, Conflict, PlannedRun

SHOWN = (ConflictCode.TOO_FEW_ROBOTS, ConflictCode.PLACE_FULL, ConflictCode.CRITICAL_BEHIND)


class Contested:
    """``conflicts`` in order of time; those of one group or place don't overlap."""

    def __init__(self, conflicts: Iterable[Conflict]) -> None:
        self._found = defaultdict[Hashable, list[Conflict]](list)
        self._places = defaultdict[str, dict[Hashable, None]](dict)  # by the name of a mission, as places count
        for conflict in conflicts:
            if conflict.code in SHOWN:
                key = _key(conflict)
                self._found[key].append(conflict)
                for mission in conflict.details["missions"] if conflict.code is ConflictCode.PLACE_FULL else ():
                    self._places[mission][key] = None

    def of(self, run: PlannedRun) -> list[Conflict]:
        """Those that this start has a part in, in order of time."""
        ends = run.at + timedelta(seconds=run.usual_s or ASSUMED_S)
        keys: list[Hashable] = [*self._places.get(run.mission.name, ())]
        if run.group is not None:
            keys.append(("group", run.group.id))
        found = list(self._found.get(("start", run.schedule.id, run.at), ()))
        for key in keys:
            those = self._found.get(key, [])
            for conflict in reversed(those[: bisect_left(those, ends, key=_at)]):
                until = conflict.details["until"]
                if until is not None and until <= run.at:
                    break
                found.append(conflict)
        return sorted(found, key=_at)


def _at(conflict: Conflict) -> datetime:
    return conflict.at


def _key(conflict: Conflict) -> Hashable:
    """What it is about: a group, a place, or a single start."""
    details = conflict.details
    match conflict.code:
        case ConflictCode.TOO_FEW_ROBOTS:
            return "group", details["group_id"]
        case ConflictCode.PLACE_FULL:
            return "place", details["place_id"]
    return "start", details["schedule_id"], conflict.at
