"""How long missions take on robots: an estimate for the next run, and a comparison by day with what they took before the period."""

from __future__ import annotations

import math
import sqlite3
from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import date
from functools import cache, partial
from itertools import pairwise

from app.database.groups import PlaceRepository
from app.database.missions import DurationRepository, MissionRepository
from app.domain.execution import DurationEstimate
from app.domain.models import Group, Mission, Place, Robot
from app.services.allocation.situation import run_duration

MOST_MISSIONS = 5  # that are looked at
DURATIONS_OF = 5_000  # newest completed runs of a mission in the period
BASELINE_OF = 200  # newest completed runs before it, from which the usual range is computed
LEAST_BASELINE = 10  # fewer do not
Z_95 = 1.959964  # standard normal, two-sided 95 %


@dataclass(frozen=True)
class Band:
    """The usual range: of ``count`` runs, four fifths took between ``p10_s`` and ``p90_s``."""

    count: int
    p10_s: float
    p50_s: float
    p90_s: float


@dataclass(frozen=True)
class DayMedian:
    day: date
    count: int
    median_s: float


@dataclass(frozen=True)
class Trend:
    """Of one mission. ``count`` completed runs in the period; ``median_s`` over the newest 5,000 of them; ``days`` those with any, oldest
    first; ``usual`` None without enough runs before the period."""

    guid: str
    mission: str
    count: int
    median_s: float
    usual: Band | None
    days: Sequence[DayMedian]

    @property
    def is_longer(self) -> bool:
        """The median run of the period took longer than nine of ten runs before it."""
        return self.usual is not None and self.median_s > self.usual.p90_s


def expected(measured: DurationEstimate | None, mission: Mission | None) -> DurationEstimate | None:
    """How long the next run will take: as the runs on that robot did or, without any, as a person typed it; None: not known."""
    if measured is not None or mission is None or mission.usual_minutes is None:
        return measured
    seconds = mission.usual_minutes * 60.0
    return DurationEstimate(seconds, seconds, typed=True)


def pooled(estimates: Sequence[DurationEstimate]) -> DurationEstimate | None:
    """Of the runs of several robots together; None without any."""
    samples = sorted(seconds for each in estimates for seconds in each.samples_s)
    if not samples:
        return None
    return DurationEstimate(percentile(samples, 50) or 0.0, percentile(samples, 90) or 0.0, tuple(samples))


def percentile(ordered: Sequence[float], percent: float) -> float | None:
    """By nearest rank: the smallest value that at least so many percent are not above."""
    if not ordered:
        return None
    return ordered[max(0, math.ceil(percent / 100 * len(ordered)) - 1)]


def band(seconds: Sequence[float]) -> Band | None:
    """The usual range of these runs; None when they are too few."""
    if len(seconds) < LEAST_BASELINE:
        return None
    ordered = sorted(seconds)
    p10, p50, p90 = (percentile(ordered, percent) or 0.0 for percent in (10, 50, 90))
    return Band(len(ordered), p10, p50, p90)


def trend(
    guid: str,
    mission: str,
    count: int,
    runs: Sequence[tuple[str, float]],
    before: Sequence[float],
    days: Sequence[tuple[date, str]],
) -> Trend:
    """``runs`` (ended, seconds), at least one; ``before`` seconds; ``days`` (date, its first instant) in order. Instants are text."""
    ordered: list[tuple[str, float]] = sorted((ended_at, seconds) for ended_at, seconds in runs)
    ended = [ended_at for ended_at, _ in ordered]
    edges = [*(bisect_left(ended, start) for _, start in days), len(ordered)]
    parts = [sorted(seconds for _, seconds in ordered[first:last]) for first, last in pairwise(edges)]
    medians = [
        DayMedian(day, len(part), percentile(part, 50) or 0.0)
        for (day, _), part in zip(days, parts, strict=True)
        if part
    ]
    return Trend(
        guid, mission, count, percentile(sorted(seconds for _, seconds in ordered), 50) or 0.0, band(before), medians
    )


@dataclass(frozen=True)
class LiveRobots:
    """Facts about robots outside the database, by their ids: whether one is silent or stopped, whether it charges and
    may be sent elsewhere, and whether it has a mission, by its guid."""

    is_unavailable: Callable[[int], bool] = lambda _robot_id: False
    is_charging: Callable[[int], bool] = lambda _robot_id: False
    has_mission: Callable[[int, str], bool] = lambda _robot_id, _guid: True


NO_LIVE_ROBOTS = LiveRobots()


class MissionDurations:
    """The mission of a name on each robot, and its duration there: read once for one question."""

    def __init__(self, c: sqlite3.Connection, groups: Iterable[Group] = (), live: LiveRobots = NO_LIVE_ROBOTS) -> None:
        self._c, self._live = c, live
        self.missions = {mission.id: mission for mission in MissionRepository().all(c)}
        self._by_name = {(mission.name, mission.robot_id): mission for mission in self.missions.values()}
        self._peers: dict[int, tuple[int, ...]] = {}  # robots of a robot's groups
        for group in groups:
            for robot_id in group.members:
                self._peers[robot_id] = tuple(sorted({*self._peers.get(robot_id, ()), *group.members}))
        self._measured = cache(partial(DurationRepository().usual, c))  # by robot and guid
        self._pooled = cache(self._measured_on_any)
        self.duration = cache(self._duration)

    def mission(self, name: str, robot_id: int | None = None) -> Mission | None:
        """The robot's own, else the one for all robots; None: no mission of that name."""
        return self._by_name.get((name, robot_id)) or self._by_name.get((name, None))

    def has(self, robot_id: int, name: str) -> bool:
        """Whether a robot can be given that mission, as far as is known."""
        meant = self.mission(name, robot_id)
        return meant is not None and self._live.has_mission(robot_id, meant.guid)

    def places(self) -> list[tuple[Place, frozenset[str]]]:
        """With the names of the missions that use them."""
        places = PlaceRepository().all(self._c)
        return [(place, frozenset(self.missions[each].name for each in place.missions)) for place in places]

    def usual(self, robot_id: int, mission: Mission) -> DurationEstimate | None:
        """Of that mission on that robot, or as typed."""
        return expected(self._measured(robot_id, mission.guid), mission)

    def usual_of_any(self, mission: Mission, members: Sequence[int]) -> DurationEstimate | None:
        """Of the runs of all these robots together, or as typed."""
        return expected(self._pooled(mission.name, tuple(members)), mission)

    def _measured_on_any(self, name: str, members: Sequence[int]) -> DurationEstimate | None:
        own = [(robot_id, self.mission(name, robot_id)) for robot_id in members]
        found = [self._measured(robot_id, meant.guid) for robot_id, meant in own if meant is not None]
        return pooled([each for each in found if each is not None])

    def usual_on(self, target: Robot | Group, mission: Mission) -> DurationEstimate | None:
        """On a robot, or on any robot of a group."""
        return (
            self.usual(target.id, mission) if isinstance(target, Robot) else self.usual_of_any(mission, target.members)
        )

    def _duration(self, robot_id: int, mission: str, *, slow: bool = False) -> float | None:
        """As the decision code estimates it, in seconds; None: the robot lacks the mission."""
        meant = self.mission(mission, robot_id)
        if meant is None or not self.has(robot_id, mission):
            return None
        peers = self._peers.get(robot_id, (robot_id,))
        return run_duration(self.usual(robot_id, meant), self.usual_of_any(meant, peers), slow=slow)


def wilson(successes: int, cases: int, z: float = Z_95) -> tuple[float, float] | None:
    """The score interval (Wilson 1927) of a share, both ends 0–1, for ``z`` of the standard normal; None without
    cases."""
    if cases <= 0:
        return None
    share, z2 = successes / cases, z**2
    middle = share + z2 / (2 * cases)
    spread = z * math.sqrt(share * (1 - share) / cases + z2 / (4 * cases**2))
    scale = 1 + z2 / cases
    return max(0.0, (middle - spread) / scale), min(1.0, (middle + spread) / scale)
