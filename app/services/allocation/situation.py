"""The input of a decision: the known state of a group's robots, waiting starts, and future ones. Times are seconds from
the moment of the decision, negative for the past.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Protocol

from app.domain.execution import DurationEstimate

LOW, NORMAL, HIGH, CRITICAL = -1, 0, 1, 2
_WEIGHTS = (0.5, 1.0, 3.0, 10.0)
UNKNOWN_S = 300.0  # of an unknown mission
FEW_RUNS = 3  # with fewer on one robot, those of its whole group are better
OVERDUE = 0.15  # of the usual time are left when a run has lasted longer than every one before
SECONDS_PER_METRE = 1.5  # of the straight way to the first stop: a third of detour, at 0.9 m/s
SHORTEST_S = 20.0


def weight(priority: int) -> float:
    """How much a second of lateness counts."""
    return _WEIGHTS[max(LOW, min(priority, CRITICAL)) - LOW]


class Ineligible(StrEnum):
    """Why a robot gets nothing at present."""

    OFF = "off"  # switched off, or without its password
    UNCHECKED = "unchecked"  # its fleet was not checked up
    SILENT = "silent"
    WRONG_ROBOT = "wrong_robot"
    HELD = "held"
    STOPPED = "stopped"  # error, emergency stop, pause, manual control, mapping
    LACKS_MISSION = "lacks_mission"
    TRIED = "tried"  # it refused this start, or will be asked again later
    LOW_BATTERY = "low_battery"
    TOO_LITTLE_BATTERY = "too_little_battery"  # for the whole run


@dataclass(frozen=True)
class Member:
    """A robot. ``free_s``: until it has nothing more to do. ``is_free``: Ready with an empty queue, as read a moment
    ago. ``battery`` in %, ``hours`` that it ran today, ``failures`` since its last success; ``ineligible`` for any
    start."""

    id: int
    name: str
    is_free: bool = True
    free_s: float = 0.0
    battery: float | None = None
    hours: float = 0.0
    ineligible: Ineligible | None = None
    failures: int = 0


@dataclass(frozen=True)
class Start:
    """One that waits for a robot. ``members``: robots that may get it. ``tried``: those of them excluded at present.
    ``finish_s``: when it must be done, None: no limit. ``keep_free``: robots of its group reserved for more important
    starts. ``places``: those that its mission uses."""

    id: int
    mission: str
    members: tuple[int, ...]
    priority: int = NORMAL
    planned_s: float = 0.0
    closes_s: float = 900.0
    finish_s: float | None = None
    minimum_battery: float | None = None
    tried: Mapping[int, Ineligible] = field(default_factory=dict)
    keep_free: int = 0
    at_once: bool = False
    places: tuple[str, ...] = ()

    def is_too_late(self, done_s: float) -> bool:
        """Whether that is after it has to be done."""
        return self.finish_s is not None and done_s > self.finish_s


@dataclass(frozen=True)
class PlannedStart:
    """A start that is planned within the next minutes. ``is_fixed``: to one robot, by a schedule of its own; a group of one robot is a
    group."""

    mission: str
    members: tuple[int, ...]
    planned_s: float
    lasts_s: float
    priority: int = NORMAL
    is_fixed: bool = False

    @cached_property
    def weight(self) -> float:
        return weight(self.priority)


class Duration(Protocol):
    """Seconds that a mission takes on a robot from its position when it is free; None: it lacks the mission."""

    def __call__(self, robot_id: int, mission: str, *, slow: bool = False) -> float | None: ...


@dataclass(frozen=True)
class Situation:
    """Everything that a decision needs to know."""

    robots: Mapping[int, Member]
    starts: Sequence[Start]
    duration: Duration
    planned: Sequence[PlannedStart] = ()  # in order of time, at most AHEAD s away
    room: Mapping[str, int] = field(default_factory=dict)  # how many more may use each place


def run_duration(
    own: DurationEstimate | None, of_group: DurationEstimate | None, farther_m: float = 0.0, *, slow: bool = False
) -> float:
    """A whole run: of this robot's runs if there are enough, else of the group's, else as typed. ``farther_m``: extra
    way to the mission's first stop, compared with the robots' average. ``slow``: the 90th percentile."""
    known = own if own is not None and (own.typed or own.runs >= FEW_RUNS) else of_group or own
    usual = UNKNOWN_S if known is None else known.slow_s if slow else known.median_s
    return max(SHORTEST_S, usual + farther_m * SECONDS_PER_METRE)


def remaining_duration(estimate: DurationEstimate | None, elapsed_s: float) -> float:
    """The remaining time of a run: the mean over earlier runs that lasted longer than it has so far."""
    if estimate is None:
        return max(UNKNOWN_S - elapsed_s, UNKNOWN_S * OVERDUE)
    longer = estimate.samples_s[bisect_right(estimate.samples_s, elapsed_s) :] or (
        (estimate.median_s,) if elapsed_s < estimate.median_s else ()
    )
    return sum(longer) / len(longer) - elapsed_s if longer else estimate.median_s * OVERDUE
