"""Which schedules are often late, and why. Pure; times are seconds since 1970. Findings need at least ten starts."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import inf
from statistics import median
from types import MappingProxyType

from app.database.suggestions import PastRun
from app.domain.execution import ReasonCode, Trigger
from app.services.planning.durations import wilson

LATE_S = 300.0  # after its planned instant
NEXT_S = 10.0  # between two runs of a queue, at most
LEAST_STARTS = 10
USUALLY = 0.25  # of its starts come late, at least, with 90 % confidence
Z_90 = 1.2816  # standard normal, one-sided 90 %
# Why a start that never ran counts as late: for the others a person, the tablet or the robot's settings are the reason.
LOST = frozenset(
    {
        ReasonCode.BATTERY_LOW,
        ReasonCode.OVERLAP,
        ReasonCode.FINISH_BY,
        ReasonCode.PLACE_BUSY,
        ReasonCode.WINDOW_CLOSED,
        ReasonCode.NO_ROBOT,
    }
)


class Cause(StrEnum):
    BUSY = "busy"  # with a mission of this app
    OTHER = "other"  # with something that others had put there
    STOPPED = "stopped"  # error, emergency stop, pause, manual control
    SILENT = "silent"
    BATTERY = "battery"
    UNKNOWN = "unknown"


_OF_ACTIVITY: Mapping[str, Cause] = MappingProxyType(
    {"executing": Cause.OTHER, "paused": Cause.STOPPED, "error": Cause.STOPPED, "offline": Cause.SILENT}
)
Activity = Callable[[int, float], str]  # a robot's activity at an instant, by its id; empty: unknown


@dataclass(frozen=True)
class Finding:
    """``late`` of ``starts`` were late, usually by ``typical_s`` (None: most of them never ran). ``mission``: the one
    that kept its robot busy."""

    schedule: int
    starts: int
    late: int
    typical_s: float | None
    cause: Cause
    mission: str

    @property
    def share(self) -> float:
        return self.late / self.starts


def is_usual(late: int, starts: int) -> bool:
    """Whether so many late starts are more than chance: by the lower end of Wilson's interval."""
    ends = wilson(late, starts, Z_90)
    return starts >= LEAST_STARTS and ends is not None and ends[0] >= USUALLY


def counts(run: PastRun) -> bool:
    """Whether it is a start of a schedule that ran, or could have."""
    return run.trigger == Trigger.SCHEDULED and bool(run.schedule) and (run.started is not None or run.reason in LOST)


def is_late(run: PastRun) -> bool:
    return run.started is None or run.started - run.planned > LATE_S


def findings(runs: Sequence[PastRun], since: Mapping[int, float], activity: Activity) -> list[Finding]:
    """The worst first. ``since``: schedules that are looked at, and from when on; before they were other ones."""
    of_schedule, busy = defaultdict[int, list[PastRun]](list), defaultdict[int, list[tuple[float, float, str]]](list)
    for run in runs:
        if run.planned >= since.get(run.schedule, inf) and counts(run):
            of_schedule[run.schedule].append(run)
        if run.started is not None and run.ended is not None and run.ended > run.started:
            busy[run.robot].append((run.started, run.ended, run.mission))
    for spans in busy.values():
        spans.sort()
    found = []
    for schedule, starts in of_schedule.items():
        late = [start for start in starts if is_late(start)]
        if is_usual(len(late), len(starts)):
            causes = Counter(_cause(start, busy[start.robot], activity) for start in late)
            delays = [start.started - start.planned for start in late if start.started is not None]
            typical_s = median(delays) if 2 * len(delays) >= len(late) else None
            found.append(Finding(schedule, len(starts), len(late), typical_s, *causes.most_common(1)[0][0]))
    return sorted(found, key=lambda one: (-one.share, -one.late, one.schedule))


def _cause(start: PastRun, busy: Sequence[tuple[float, float, str]], activity: Activity) -> tuple[Cause, str]:
    """Its robot's activity when it fell due, and the mission that kept it busy. ``busy``: begins and ends of its runs,
    in order."""
    if start.started is None and start.reason == ReasonCode.BATTERY_LOW:
        return Cause.BATTERY, ""
    number = bisect_right(busy, (start.planned + NEXT_S, inf, "")) - 1
    if number >= 0 and busy[number][1] > start.planned:
        return Cause.BUSY, busy[number][2]
    return _OF_ACTIVITY.get(activity(start.robot, start.planned), Cause.UNKNOWN), ""
