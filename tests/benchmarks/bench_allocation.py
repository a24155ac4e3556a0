"""How starts that any of several robots may take come out under the app's own decision and under other rules, on invented days.

    uv run python -m tests.benchmarks.bench_allocation [--days 16] [--robots 5] [--fixed 0.0]
    uv run python -m tests.benchmarks.bench_allocation --optimum [--days 40]
    uv run python -m tests.benchmarks.bench_allocation --decision

``critical``: planned starts of that priority more than a minute late, %; ``urgent``: mean wait of unplanned ones, s; ``missed``: outside
their start window, %; ``weighted``: lateness x weight per start, s; ``spread`` of use between robots, points; ``empty``: m to the first
place. The hall, its robots and their troubles are invented (``tests/benchmarks/hall``). ``--optimum``: short, crowded days without chance,
compared with every order on every robot. ``--decision``: processor time of one.
"""

from __future__ import annotations

import argparse
import copy
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

from app.services.allocation.choose import choose
from app.services.allocation.situation import weight
from tests.benchmarks.hall.day import CALM, ROUGH, Day, Trouble, figures
from tests.benchmarks.hall.policies import NO_METRES, POLICIES, NearestIdle, ThisApp
from tests.benchmarks.hall.site import HOUR, Learned, Run, Site, run_time

LOADS = (0.3, 0.6, 0.85)
WORLDS: dict[str, tuple[Trouble, float]] = {
    "as estimated": (Trouble(), 0.0),
    "estimates 30 % off": (Trouble(), 0.3),
    "robots fall silent": (ROUGH, 0.0),
}
STARTS, ROBOTS = 8, 3  # of the short days
MOST_NODES = 400_000


def table(days: int, robots: int, fixed: float) -> None:
    for world, (trouble, error) in WORLDS.items():
        for load in LOADS:
            print(f"\n{world}, load {load:.0%}, {robots} robots, {days} days")
            for name, make in POLICIES.items():
                found = []
                for seed in range(days):
                    site = Site(seed, robots, load, fixed=fixed)
                    learned = Learned(site, seed, error=error, positions=name != NO_METRES)
                    found.append(figures(Day(site, learned, make(), seed, trouble).run()))
                means = {key: statistics.fmean(each[key] for each in found) for key in found[0]}
                print(f"{name:32s}" + "  ".join(f"{key} {value:.1f}" for key, value in means.items()), flush=True)


# ---------------------------------------------------------------------- the best that could be known afterwards
def least(site: Site, runs: list[Run], day: Day, known: float) -> tuple[float, bool]:
    """Weighted s of lateness in all, and whether every order was looked at. ``known`` is reached by some rule."""
    lasts = {
        (r, i, j): run_time(None, run.mission, machine, day.robots[r].place if i < 0 else runs[i].mission.last)
        for r, machine in enumerate(site.machines)
        for j, run in enumerate(runs)
        for i in range(-1, len(runs))
    }
    weights, planned = [weight(run.priority) for run in runs], [run.planned for run in runs]
    best, nodes = known, 0
    met: dict[tuple[frozenset[int], tuple[int, ...]], list[tuple[float, ...]]] = {}

    def branch(left: frozenset[int], free: tuple[float, ...], last: tuple[int, ...], cost: float, since: float) -> None:
        nonlocal best, nodes
        if not left:
            best = min(best, cost)
            return
        nodes += 1
        soonest = max(since, min(free))
        if nodes > MOST_NODES or cost + sum(weights[j] * max(0.0, soonest - planned[j]) for j in left) >= best - 1e-9:
            return
        state, others = (cost, since, *free), met.setdefault((left, last), [])
        if any(all(a <= b for a, b in zip(other, state, strict=True)) for other in others):
            return
        others.append(state)
        options = sorted(
            (weights[j] * (begins - planned[j]) + 0.01 * begins, begins, j, r)
            for j in left
            for r in range(len(free))
            if (begins := max(free[r], planned[j])) >= since
        )
        for _, begins, j, r in options:
            branch(
                left - {j},
                (*free[:r], begins + lasts[r, last[r], j], *free[r + 1 :]),
                (*last[:r], j, *last[r + 1 :]),
                cost + weights[j] * (begins - planned[j]),
                begins,
            )

    robots = len(site.machines)
    branch(frozenset(range(len(runs))), (0.0,) * robots, (-1,) * robots, 0.0, 0.0)
    return best, nodes <= MOST_NODES


def optimum(days: int) -> None:
    totals: dict[str, float] = dict.fromkeys(POLICIES, 0.0)
    best, proven = 0.0, 0
    for seed in range(days):
        site = Site(seed, ROBOTS, 1.3, 1.0, by_hand=0.0, urgent=0.0)
        reached = []
        for name, make in POLICIES.items():
            runs = site.runs()[:STARTS]
            for run in runs:
                run.window_s = 3 * HOUR
            Day(site, Learned(site, seed, positions=name != NO_METRES), make(), seed, CALM, runs).run()
            reached.append(sum(weight(run.priority) * run.late_s for run in runs))
            totals[name] += reached[-1]
        runs = site.runs()[:STARTS]
        found, is_proven = least(site, runs, Day(site, Learned(site, seed), ThisApp(), seed, CALM, runs), min(reached))
        best += found
        proven += is_proven
    print(f"{days} days of {STARTS} starts on {ROBOTS} robots, {proven} looked at to the end; weighted s per start")
    print(f"{'the best possible afterwards':32s}{best / days / STARTS:7.1f}")
    for name, total in totals.items():
        print(f"{name:32s}{total / days / STARTS:7.1f}  {total / best:5.2f} x")


# ---------------------------------------------------------------------- what a decision costs
def decision() -> None:
    for robots, due in ((5, 20), (50, 200)):
        for title, prepare in (("as in the middle of a day", lambda day: None), ("all robots free", _all_free)):
            took = [_decision(seed, robots, due, prepare) for seed in range(20)]
            print(
                f"{robots} robots, {due} due, {title}: p50 {statistics.median(took):.2f}, p95 {sorted(took)[18]:.2f} ms"
            )


def _decision(seed: int, robots: int, due: int, prepare: Callable[[Day], Any]) -> float:
    site = Site(seed, robots, 0.85, 1.0)
    day = copy.deepcopy(Day(site, Learned(site, seed), NearestIdle(), seed).run(-0.5 * HOUR))
    prepare(day)
    runs = [
        Run(10_000 + n, site.missions[n % len(site.missions)], day.now, n % 3 - 1, window_s=900.0) for n in range(due)
    ]
    situation = ThisApp().situation(day, runs)
    begun = time.process_time()
    choose(situation)
    return (time.process_time() - begun) * 1000


def _all_free(day: Day) -> None:
    for robot in day.robots:
        robot.running, robot.drives_to_charger, robot.error, robot.known_silent, robot.known_error = (
            None,
            False,
            False,
            False,
            False,
        )
        robot.seen_idle = True
        robot.queue.clear()


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks.bench_allocation",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--days", type=int, default=None)
    parser.add_argument("--robots", type=int, default=5)
    parser.add_argument("--fixed", type=float, default=0.0, help="share of the schedules that name one robot")
    parser.add_argument("--optimum", action="store_true")
    parser.add_argument("--decision", action="store_true")
    options = parser.parse_args()
    if options.optimum:
        optimum(options.days or 40)
    elif options.decision:
        decision()
    else:
        table(options.days or 16, options.robots, options.fixed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
