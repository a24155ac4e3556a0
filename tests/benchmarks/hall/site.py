"""A site as it really is: hall, robots, missions, a day's plan. The app sees only ``learned`` and ``day`` of it.

Everything is drawn by seeds: the same seed, the same day. Times in s, ways in m.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median

from app.domain.execution import DurationEstimate
from app.services.allocation.situation import CRITICAL, HIGH, LOW, NORMAL, run_duration

MINUTE, HOUR = 60.0, 3600.0
WIDTH, DEPTH = 100.0, 60.0  # of the hall, with one aisle along its middle and every place on a spur of it
TURNS_S = 6.0  # per trip
SHARES = {LOW: 0.12, NORMAL: 0.61, HIGH: 0.20, CRITICAL: 0.07}
WINDOWS = {LOW: 60 * MINUTE, NORMAL: 15 * MINUTE, HIGH: 15 * MINUTE, CRITICAL: 10 * MINUTE}
PERIODS = {30: 0.1, 60: 0.3, 120: 0.3, 600: 0.3}  # min between the starts of a schedule
Place = tuple[float, float]


def way(a: Place, b: Place) -> float:
    """Driven: out to the aisle, along it, in again."""
    if abs(a[0] - b[0]) < 1:
        return abs(a[1] - b[1])
    return abs(a[1] - DEPTH / 2) + abs(a[0] - b[0]) + abs(b[1] - DEPTH / 2)


@dataclass(frozen=True)
class Mission:
    number: int
    first: Place
    last: Place
    handling_s: float


@dataclass(frozen=True)
class Machine:
    """What differs between robots."""

    number: int
    speed: float  # m/s
    slowness: float  # at handling
    battery: float  # % in the morning


@dataclass
class Rule:
    """A schedule; ``home`` is the robot that a careful planner chose for it."""

    mission: Mission
    period_s: float
    offset_s: float
    priority: int
    home: int = 0
    is_fixed: bool = False  # that robot under every policy


@dataclass(eq=False)
class Run:
    """One start of the day and what became of it. ``is_urgent``: by hand, not known before."""

    id: int
    mission: Mission
    planned: float
    priority: int
    home: int | None = None
    is_fixed: bool = False
    is_urgent: bool = False
    window_s: float = 0.0
    robot: int | None = None
    started: float | None = None
    ended: float | None = None
    state: str = "waiting"
    tries: int = 0
    not_before: float = 0.0
    barred: dict[int, float] = field(default_factory=dict)

    @property
    def closes(self) -> float:
        return self.planned + (self.window_s or WINDOWS[self.priority])

    @property
    def late_s(self) -> float:
        return max(0.0, self.started - self.planned) if self.started is not None else 2 * HOUR


class Site:
    def __init__(
        self,
        seed: int,
        robots: int,
        load: float,
        hours: float = 8.0,
        *,
        by_hand: float = 0.10,
        urgent: float = 0.03,
        fixed: float = 0.0,
    ) -> None:
        """``load``: of the robots' time; ``by_hand``, ``urgent`` and ``fixed``: shares of the runs and of the schedules."""
        rng = random.Random(f"site/{seed}")
        self.hours = hours
        self.places = [
            (rng.uniform(2, WIDTH - 2), rng.choice((rng.uniform(2, 22), rng.uniform(38, 58)))) for _ in range(24)
        ]
        self.charger: Place = (3.0, 50.0)
        self.machines = [
            Machine(n, rng.uniform(0.8, 1.0), rng.uniform(0.9, 1.15), rng.uniform(75, 100)) for n in range(robots)
        ]
        self.missions = []
        for n in range(max(12, robots * 2)):
            first, last = rng.sample(self.places, 2)
            self.missions.append(Mission(n, first, last, rng.uniform(60, 300)))
        self.mean_s = sum(self._mean(mission, self.machines[0]) for mission in self.missions) / len(self.missions)
        wanted = robots * load * hours * HOUR / self.mean_s
        self.rules: list[Rule] = []
        planned = wanted * (1 - by_hand - urgent)
        while planned > 0:
            minutes = rng.choices(list(PERIODS), list(PERIODS.values()))[0]
            step = 30 if rng.random() < 0.3 else 5  # people like round times
            self.rules.append(
                Rule(
                    rng.choice(self.missions),
                    minutes * MINUTE,
                    rng.randrange(0, minutes, step) * MINUTE,
                    rng.choices(list(SHARES), list(SHARES.values()))[0],
                )
            )
            planned -= hours * HOUR / (minutes * MINUTE)
        self._choose_homes()
        for rule in self.rules:
            rule.is_fixed = rng.random() < fixed
        self.by_hand = [
            (at, rng.choice(self.missions), rng.randrange(robots)) for at in self._times(rng, wanted * by_hand)
        ]
        self.urgent = [(at, rng.choice(self.missions)) for at in self._times(rng, wanted * urgent)]

    def _times(self, rng: random.Random, number: float) -> list[float]:
        times, at = [], 0.0
        while number > 0 and (at := at + rng.expovariate(number / (self.hours * HOUR))) < self.hours * HOUR:
            times.append(at)
        return times

    def _mean(self, mission: Mission, machine: Machine) -> float:
        empty = sum(way(place, mission.first) for place in self.places) / len(self.places)
        return (
            (empty + way(mission.first, mission.last)) / machine.speed
            + 2 * TURNS_S
            + mission.handling_s * machine.slowness
        )

    def _choose_homes(self) -> None:
        """The heaviest schedules first, each to the robot with least to do, and of these to the one with no start at those minutes."""
        work = [0.0] * len(self.machines)
        taken: list[set[int]] = [set() for _ in self.machines]
        for rule in sorted(self.rules, key=lambda rule: rule.period_s):
            minutes = {
                int((rule.offset_s + k * rule.period_s) / MINUTE) for k in range(int(self.hours * HOUR / rule.period_s))
            }
            rule.home = min(range(len(work)), key=lambda n: (round(work[n] * 8), len(minutes & taken[n]), work[n]))
            work[rule.home] += self.mean_s / rule.period_s
            taken[rule.home] |= minutes

    def runs(self) -> list[Run]:
        runs = [
            Run(0, rule.mission, rule.offset_s + k * rule.period_s, rule.priority, rule.home, rule.is_fixed)
            for rule in self.rules
            for k in range(max(0, math.ceil((self.hours * HOUR - rule.offset_s) / rule.period_s)))
        ]
        runs += [Run(0, mission, at, CRITICAL, is_urgent=True) for at, mission in self.urgent]
        runs.sort(key=lambda run: run.planned)
        for number, run in enumerate(runs):
            run.id = number
        return runs


def run_time(rng: random.Random | None, mission: Mission, machine: Machine, begins: Place) -> float:
    """The true duration of a run; not random without ``rng``."""
    trips = (way(begins, mission.first) + way(mission.first, mission.last)) / machine.speed + 2 * TURNS_S
    smooth = trips + mission.handling_s * machine.slowness
    if rng is None:
        return smooth
    return smooth * rng.lognormvariate(0, 0.12) + (rng.expovariate(1 / 120) if rng.random() < 0.03 else 0.0)


class Learned:
    """What the app knows: the newest 20 runs of each mission on each robot. ``error``: so much too long or too short; ``share``: of the
    pairs of robot and mission are known by their own runs, the others by those of all robots; without ``positions`` no way is known."""

    def __init__(
        self, site: Site, seed: int, *, error: float = 0.0, share: float = 1.0, positions: bool = True
    ) -> None:
        rng = random.Random(f"learned/{seed}")
        self._positions = positions
        self._known: dict[tuple[int, int], DurationEstimate] = {}
        for mission in site.missions:
            factor = 1 + error * rng.choice((-1, 1)) if error else 1.0
            of_all: list[float] = []
            for machine in site.machines:
                begins = [rng.choice(site.places) for _ in range(20)]
                seen = [run_time(rng, mission, machine, place) * factor for place in begins]
                of_all += seen[:3]
                if rng.random() < share:
                    self._known[machine.number, mission.number] = _known(seen)
            for machine in site.machines:
                self._known.setdefault((machine.number, mission.number), _known(of_all))

    def way(self, place: Place, mission: Mission) -> float:
        """Straight to its first place, in m; without positions they are all alike."""
        return math.dist(place, mission.first) if self._positions else 0.0

    def takes(self, robot: int, mission: Mission, farther_m: float = 0.0, *, slow: bool = False) -> float:
        return run_duration(self._known[robot, mission.number], None, farther_m, slow=slow)

    def estimate(self, robot: int, mission: Mission) -> DurationEstimate:
        return self._known[robot, mission.number]


def _known(seen: Sequence[float]) -> DurationEstimate:
    lasted = tuple(sorted(seen))
    return DurationEstimate(median(lasted), lasted[math.ceil(0.9 * len(lasted)) - 1], lasted)
