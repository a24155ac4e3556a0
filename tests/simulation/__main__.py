"""Any number of simulated hours and seeds by hand:
``python -m tests.simulation --hours 1000 --seeds 1-10 [--calm] [--groups] [--deviants]
[--target classic|enterprise] [--jobs 2]``.

One line per seed, with its verdict, and one of totals; exit 1 when any seed has a violation. A seed can be run again alone: same seed,
same story.
"""

from __future__ import annotations

import argparse
import logging
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

from tests.simulation.profile import CALM, Findings, Profile
from tests.simulation.world import World
from tests.support.targets import TARGETS


def simulate(seed: int, hours: float, profile: Profile | None = None, stop_at: str | None = None) -> Findings:
    logging.disable(logging.CRITICAL)
    try:
        with tempfile.TemporaryDirectory(
            prefix="amr-simulation-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None
        ) as directory:
            return World(Path(directory), seed, profile).run(hours, stop_at)
    finally:
        logging.disable(logging.NOTSET)


def _run(seed: int, hours: float, profile: Profile) -> tuple[Findings, float]:
    """And the processor time that it took, in s."""
    began = time.process_time()
    return simulate(seed, hours, profile), time.process_time() - began


def _totals(found: list[Findings], took_s: float) -> str:
    good = sum(not each.violations for each in found)
    hours = sum(each.hours for each in found)
    return (
        f"total: {hours:,.0f} simulated hours, {sum(each.occurrences for each in found):,} occurrences, "
        f"{sum(each.faults.total() for each in found):,} faults, {sum(each.crashes for each in found):,} app crashes, "
        f"{sum(each.steps for each in found):,} steps; {good} seeds ok, {len(found) - good} with violations; "
        f"{took_s:,.0f} s of processor time, {took_s / hours:.3f} s an hour"
    )


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.simulation", description=__doc__)
    parser.add_argument("--hours", type=float, default=100, help="of each seed")
    parser.add_argument("--seeds", default="1", help="one number, or first-last")
    parser.add_argument("--calm", action="store_true", help="hours in which less happens")
    parser.add_argument(
        "--groups", action="store_true", help="starts for any of three to five robots in addition to those for one"
    )
    parser.add_argument(
        "--deviants", action="store_true", help="some robots differ from the faithful one, checked up or not"
    )
    parser.add_argument("--target", choices=TARGETS, default=TARGETS[0], help="what takes the missions")
    parser.add_argument(
        "--every", type=int, help="minutes between the starts of each robot's first schedule; else drawn by the seed"
    )
    parser.add_argument("--poll", type=int, help="s between polls; else drawn by the seed")
    parser.add_argument("--per-hour", type=float, help="things that people do, and that happen, each")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    wanted = {
        "every_minutes": options.every,
        "poll_interval": options.poll,
        "acts_per_hour": options.per_hour,
        "events_per_hour": options.per_hour,
    }
    profile = replace(
        CALM if options.calm else Profile(), **{name: value for name, value in wanted.items() if value is not None}
    )
    profile = profile.with_groups() if options.groups else profile
    profile = replace(profile, deviants=options.deviants).through(options.target)
    found: list[Findings] = []
    took_s = 0.0
    with ProcessPoolExecutor(options.jobs) as pool:
        runs = pool.map(_run, seeds, [options.hours] * len(seeds), [profile] * len(seeds))
        for seed, (findings, seconds) in zip(seeds, runs, strict=True):
            problems = [f"   {problem}" for problem in findings.violations[:20]]
            print(f"{findings.line(seed)} ({seconds:.0f} s)", *problems, sep="\n", flush=True)
            found.append(findings)
            took_s += seconds
    print(_totals(found, took_s))
    return 0 if all(not each.violations for each in found) else 1


if __name__ == "__main__":
    sys.exit(main())
