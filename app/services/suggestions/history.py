"""The ledger's rows and the robots' observed activities as the past that is replayed. Pure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType

from app.database.suggestions import PastActivity, PastRun
from app.domain.models import ReasonCode, Trigger
from app.services.suggestions.replay import Busy, Past, Start

SHORTEST_S = (
    60.0  # seen, and no run of ours: below that it is the edge of one, as robots are looked at from time to time
)
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
_WHY: Mapping[str, str] = MappingProxyType(
    {"executing": "other", "paused": "stopped", "error": "stopped", "offline": "silent"}
)


def past_of(runs: Sequence[PastRun], activities: Iterable[PastActivity], since: Mapping[int, float]) -> Past:
    """``since``: schedules that are looked at, and from when on; before they were other ones."""
    starts = [_start(run) for run in runs if run.planned >= since.get(run.schedule, float("inf")) and counts(run)]
    busy = defaultdict[int, list[Busy]](list)
    for run in runs:
        if run.started is not None and run.ended is not None and run.ended > run.started and run.robot:
            busy[run.robot].append(Busy(run.started, run.ended, run.id, run.planned, mission=run.mission))
    ours = {robot: sorted(spans) for robot, spans in busy.items()}
    seen = defaultdict[int, list[PastActivity]](list)
    for activity in activities:
        seen[activity.robot].append(activity)
    for robot, those in seen.items():
        busy[robot] += _not_ours(those, ours.get(robot, []))
    return Past(starts, busy)


def counts(run: PastRun) -> bool:
    """Whether it is a start of a schedule that ran, or could have."""
    return run.trigger == Trigger.SCHEDULED and bool(run.schedule) and (run.started is not None or run.reason in LOST)


def is_late(run: PastRun) -> bool:
    return _start(run).is_late


def _start(run: PastRun) -> Start:
    return Start(
        run.id,
        run.schedule,
        run.robot,
        run.planned,
        run.started,
        run.ended,
        run.started is None and run.reason == ReasonCode.BATTERY_LOW,
    )


def _not_ours(seen: Sequence[PastActivity], ours: Sequence[Busy]) -> Iterator[Busy]:
    """What is left of activities, in order of time, beside our own runs there, in order too."""
    number = 0
    for activity in seen:
        at = activity.begins
        while number and ours[number - 1].ends > at:
            number -= 1
        while number < len(ours) and ours[number].ends <= at:
            number += 1
        place = number
        while at < activity.ends:
            run = ours[place] if place < len(ours) and ours[place].begins < activity.ends else None
            until = activity.ends if run is None else run.begins
            if until - at >= SHORTEST_S:
                yield Busy(at, until, why=_WHY[activity.activity])
            at = activity.ends if run is None else max(at, run.ends)
            place += 1
