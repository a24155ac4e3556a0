"""What the app remembers, as plain values that can be compared: for the explorer, which must know when it has met a state before."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from datetime import datetime
from enum import Enum
from typing import Any

from app.domain.execution import Execution
from app.services.dispatch.engine import Engine

_KEPT_FROM = ("app.services.dispatch.",)
_NOT_KEPT = ("Context", "Ledger", "Planner", "IdleWatch", "ClockReading")
_WITHOUT_EFFECT = frozenset(
    {  # here: the time of the last housekeeping, and counters whose differences alone count
        "_beat_at",
        "_chores_at",
        "_evaluated",
        "_first_at",
        "_last_heartbeat",
        "_looked_at",
        "_matched_version",
        "_pruned_at",
        "_robots_version",
        "_spans_saved_at",
        "_tidied_at",
        "_writes_to_prune",
        "plan_version",
        "user_name",
    }
)
OLDEST = 130.0  # s; older times do not differ


def rounded(seconds: float, grain: float) -> float:
    return math.copysign(math.inf, seconds) if math.isinf(seconds) else float(round(max(seconds, -OLDEST) / grain))


def remembered(value: Any, now: tuple[float, datetime, float], seen: set[int]) -> Any:
    """A value as plain tuples; instants become their distance from now."""
    mono, wall, grain = now
    if value is None or isinstance(value, (bool, str, Enum)):
        return value
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        return rounded(value - mono, grain) if value > 900.0 else round(value, 1)  # the virtual clock begins at 1000
    if isinstance(value, datetime):
        return rounded((value - wall).total_seconds(), grain)
    if isinstance(value, Execution):
        return value.id, value.state.value, value.attempts
    if isinstance(value, dict):
        return tuple((str(key), remembered(item, now, seen)) for key, item in value.items()) + _attributes(
            value, now, seen
        )
    if isinstance(value, (set, frozenset)):
        return tuple(sorted(map(str, value)))
    if isinstance(value, (list, tuple)):
        return tuple(remembered(item, now, seen) for item in value)
    return _attributes(value, now, seen)


def _attributes(value: Any, now: tuple[float, datetime, float], seen: set[int]) -> tuple[Any, ...]:
    kind = type(value)
    if not kind.__module__.startswith(_KEPT_FROM) or kind.__name__ in _NOT_KEPT or id(value) in seen:
        return ()
    seen.add(id(value))
    names = [
        *getattr(value, "__dict__", ()),
        *(name for base in kind.__mro__ for name in getattr(base, "__slots__", ())),
    ]
    names = [name for name in names if name not in _WITHOUT_EFFECT]
    return (kind.__name__, *((name, remembered(getattr(value, name), now, seen)) for name in names))


def _attempts_of(worker: Any) -> Iterator[Any]:
    """The attempts that belong to a version of the plan."""
    return (attempt for attempt in worker._sending.attempts.values() if attempt.plan_version)


def under_way() -> tuple[tuple[str, int], ...]:
    """Where in the app's dispatch this is called from."""
    places, frame = [], sys._getframe(1)
    walked: Any = frame
    while walked is not None:
        if "/app/services/" in walked.f_code.co_filename:
            places.append((walked.f_code.co_name, walked.f_lineno))
        walked = walked.f_back
    return tuple(places)


def memory_of(engine: Engine, mono: float, wall: datetime, grain: float) -> object:
    """Everything that the engine and its workers hold, except connections and services. Times rounded to ``grain``
    s."""
    it: Any = engine
    held = [
        attempt.plan_version - it.plan_version for worker in it._workers.values() for attempt in _attempts_of(worker)
    ]
    return remembered(engine, (mono, wall, grain), set()), it._matched_version == it._robots_version, held
