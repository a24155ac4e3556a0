"""Any number of simulated hours and seeds by hand: ``python -m tests.simulation --hours 1000 --seeds 1-10 [--per-hour 2] [--jobs 2]``.

One line per seed, with its verdict; exit 1 when any has a violation. A seed can be run again alone: same seed, same story.
"""
from __future__ import annotations

import argparse
import logging
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from tests.simulation.profile import Findings, Profile
from tests.simulation.world import World


def simulate(seed: int, hours: float, profile: Profile | None = None, stop_at: str | None = None) -> Findings:
    logging.disable(logging.CRITICAL)
    try:
        with tempfile.TemporaryDirectory(prefix="amr-simulation-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as directory:
            return World(Path(directory), seed, profile).run(hours, stop_at)
    finally:
        logging.disable(logging.NOTSET)


def _line(seed: int, hours: float, profile: Profile) -> tuple[bool, str]:
    began = time.process_time()
    findings = simulate(seed, hours, profile)
    text = f"{findings.line(seed)} ({time.process_time() - began:.0f} s)"
    return not findings.violations, "\n".join([text, *(f"   {problem}" for problem in findings.violations[:20])])


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.simulation", description=__doc__)
    parser.add_argument("--hours", type=float, default=100)
    parser.add_argument("--seeds", default="1", help="one number, or first-last")
    parser.add_argument("--every", type=int, help="minutes between the starts of each robot's first schedule; else drawn by the seed")
    parser.add_argument("--poll", type=int, help="s between polls; else drawn by the seed")
    parser.add_argument("--per-hour", type=float, default=Profile.acts_per_hour, help="things that people do, and that happen, each")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    profile = Profile(every_minutes=options.every, poll_interval=options.poll, acts_per_hour=options.per_hour,
                      events_per_hour=options.per_hour)
    all_good = True
    with ProcessPoolExecutor(options.jobs) as pool:
        for good, text in pool.map(_line, seeds, [options.hours] * len(seeds), [profile] * len(seeds)):
            print(text, flush=True)
            all_good &= good
    return 0 if all_good else 1


if __name__ == "__main__":
    sys.exit(main())
