"""Which schedules often come late, why, and what would have helped. Pure.

What is said rests on at least ten starts; an option is one only if it halves the late starts in both halves of the days and hardly makes
others late (``tests/benchmarks/bench_suggestions.py`` tries them out in the weeks after).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import sqrt
from statistics import median

from app.services.suggestions.replay import HOUR, Past, Replay, Start

LEAST_STARTS = 10
USUALLY = 0.25  # of its starts come late, at least, with 90 % confidence
Z_90 = 1.2816  # standard normal, one-sided 90 %
LEAST_GAIN = 0.5  # of its late starts have to go
LEAST_FEWER = 3
COST = 1 / 3  # late starts of others for one gained, at most
ALIKE = 0.05  # share of late starts within which the smaller change is better
MOST = 3  # findings at once
LASTS_S = 300.0  # a run of which nothing is known
STEP_S, FURTHEST_S = 300.0, HOUR


class Cause(StrEnum):
    BUSY = "busy"  # with a mission of this app
    OTHER = "other"  # with something that others had put there
    STOPPED = "stopped"  # error, emergency stop, pause, manual control
    SILENT = "silent"
    BATTERY = "battery"
    UNKNOWN = "unknown"


class Kind(StrEnum):
    TIME = "time"  # value: s by which it is moved
    ROBOT = "robot"  # value: the robot's id
    GROUP = "group"  # value: the group's id


@dataclass(frozen=True)
class Rule:
    """A schedule, and what could be done about it. ``robots``: on which it may run now. ``shifts``: in s, that keep its days."""

    id: int
    robots: Sequence[int]
    shifts: Sequence[float] = ()
    others: Sequence[int] = ()
    groups: Sequence[tuple[int, Sequence[int]]] = ()


@dataclass(frozen=True)
class Option:
    """``late``: how many of the same starts would have come late."""

    kind: Kind
    value: float
    late: int


@dataclass(frozen=True)
class Finding:
    """``late`` of ``starts`` came late, as a rule by ``typical_s`` (None: most of them never ran). ``mission``: what its robot was busy
    with; ``robot``: which robot that was, 0 where there are several."""

    schedule: int
    starts: int
    late: int
    typical_s: float | None
    cause: Cause
    mission: str
    robot: int
    options: Sequence[Option]

    @property
    def share(self) -> float:
        return self.late / self.starts


def shifts() -> list[float]:
    """Smallest first, later before earlier."""
    steps = int(FURTHEST_S / STEP_S)
    return [sign * n * STEP_S for n in range(1, steps + 1) for sign in (1, -1)]


def is_usual(late: int, starts: int) -> bool:
    """Whether so many late starts are no chance: by the lower end of Wilson's interval."""
    if starts < LEAST_STARTS:
        return False
    share, z2 = late / starts, Z_90**2
    low = share + z2 / (2 * starts) - Z_90 * sqrt(share * (1 - share) / starts + z2 / (4 * starts**2))
    return low / (1 + z2 / starts) >= USUALLY


def findings(past: Past, rules: Sequence[Rule], pause: Callable[[], object] = lambda: None) -> list[Finding]:
    """Those for which something would have helped, the worst first. ``pause`` is called every few milliseconds."""
    found = []
    for rule in rules:
        starts = past.of_schedule.get(rule.id, [])
        late = [start for start in starts if start.is_late]
        if is_usual(len(late), len(starts)) and (options := _options(past, rule, starts, len(late), pause)):
            found.append(_finding(past, rule, starts, late, options))
    return sorted(found, key=lambda one: (-one.share, -one.late, one.schedule))


def _finding(
    past: Past, rule: Rule, starts: Sequence[Start], late: Sequence[Start], options: Sequence[Option]
) -> Finding:
    causes = Counter[tuple[Cause, str]]()
    for start in late:
        span = None if start.low_battery else past.blocked_by(start)
        causes[
            (Cause.BATTERY, "")
            if start.low_battery
            else (Cause.UNKNOWN, "")
            if span is None
            else (Cause(span.why), span.mission)
        ] += 1
    cause, mission = causes.most_common(1)[0][0]
    delays = [start.late_s for start in late if start.started is not None]
    return Finding(
        rule.id,
        len(starts),
        len(late),
        median(delays) if 2 * len(delays) >= len(late) else None,
        cause,
        mission,
        rule.robots[0] if len(rule.robots) == 1 else 0,
        options,
    )


def _options(past: Past, rule: Rule, starts: Sequence[Start], late: int, pause: Callable[[], object]) -> list[Option]:
    """At most one of each kind, the one with the fewest late starts first."""
    lasted = [start.ended - start.started for start in starts if start.started is not None and start.ended is not None]
    lasts = median(lasted) if lasted else LASTS_S
    before = past.replay(rule.id, 0.0, rule.robots, lasts)
    changes: list[tuple[Kind, float, float, Sequence[int]]] = [
        (Kind.TIME, shift, shift, rule.robots) for shift in rule.shifts
    ]
    changes += [(Kind.ROBOT, robot, 0.0, (robot,)) for robot in rule.others]
    changes += [(Kind.GROUP, group_id, 0.0, members) for group_id, members in rule.groups]
    most = [(1 - LEAST_GAIN) * number for number in past.late_in_halves(rule.id)]
    best: dict[Kind, list[tuple[float, Option]]] = {}
    for kind, value, shift, robots in changes:
        pause()
        after = past.replay(rule.id, shift, robots, lasts, (most[0], most[1]))
        if after is None or before is None or (cost := _cost(before, after, late)) is None:
            continue
        best.setdefault(kind, []).append((after.number + cost, Option(kind, value, after.number)))
    if Kind.TIME in best:
        best[Kind.TIME] = _not_by_chance(best[Kind.TIME], rule.shifts)
    return sorted(
        (_smallest(of_kind, len(starts)) for of_kind in best.values() if of_kind), key=lambda option: option.late
    )


def _cost(before: Replay, after: Replay, late: int) -> float | None:
    """Late starts of others that it brings; None where it does not help enough for them."""
    gain, cost = late - after.number, max(0, after.harm - before.harm)
    return None if gain < max(LEAST_FEWER, LEAST_GAIN * late) or cost > COST * gain else cost


def _not_by_chance(options: Sequence[tuple[float, Option]], possible: Sequence[float]) -> list[tuple[float, Option]]:
    """Times of which those next to them, but for the present one, would have helped as well: gaps of the past are not always where they
    were."""
    bad = set(possible) - {option.value for _, option in options}
    return [
        (late, option) for late, option in options if bad.isdisjoint((option.value - STEP_S, option.value + STEP_S))
    ]


def _smallest(options: Sequence[tuple[float, Option]], starts: int) -> Option:
    """Of those that are as good as the best: times come by how far they are moved, robots and groups in the given order."""
    least = min(late for late, _ in options)
    return next(option for late, option in options if late <= least + ALIKE * starts)
