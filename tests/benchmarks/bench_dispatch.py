"""How late do missions arrive at healthy robots, while others are dead? The app, APScheduler 3.x, ``schedule`` and the
thesis's loop.

Run by hand (about 20 minutes; nothing else on the machine):

    uv run --with apscheduler==3.11.3 --with sqlalchemy --with schedule==1.2.2 python -m tests.benchmarks.bench_dispatch

``--scenario`` and ``--engine`` choose, ``--repeat`` shows how much figures vary. Lateness is from the instant a job is
due to the arrival of its POST at the stub, by the wall clock of this machine. A job that a healthy robot did not get in
time is dropped. ``--groups``: the app alone, with starts for any of ten robots; lateness is that of the first start at
each healthy robot, and "moved on" is the time from a refused connection until another robot had the start.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.benchmarks.engines import ENGINES, Job, Spec
from tests.benchmarks.stub import API, address


@dataclass(frozen=True)
class Scenario:
    robots: int
    jobs: int
    window: float  # s over which the jobs fall due; 0 = all at one instant
    dead: float  # share of the robots that refuse (one half) or hang (the other)
    idle_jobs: int  # planned, but not due
    patience: float = 60.0  # s after the window
    groups: int = 0  # of robots; a job is for any robot of one
    dropping: int = 0  # robots that refuse from a moment before the instant on

    @property
    def refusing(self) -> int:
        return round(self.robots * self.dead / 2)

    @property
    def ill(self) -> int:
        return 2 * self.refusing

    def jobs_of(self, seed: int) -> list[Job]:
        chance = random.Random(seed)
        if self.window == 0:
            robots = [n % (self.groups or self.robots) for n in range(self.jobs)]
            chance.shuffle(robots)  # so that the dead are not all first in line
            return [Job(f"j{n}", robot, 0.0) for n, robot in enumerate(robots)]
        return [Job(f"j{n}", chance.randrange(self.robots), chance.uniform(0.0, self.window)) for n in range(self.jobs)]


SCENARIOS = {
    "burst": Scenario(200, 200, 0.0, 0.2, 9_800),
    "spread": Scenario(50, 10_000, 30.0, 0.0, 0),
    "spread-dead": Scenario(50, 10_000, 30.0, 0.2, 0),
}
GROUPS = {
    "groups": Scenario(200, 200, 0.0, 0.2, 9_800, groups=20),
    "groups-refusing": Scenario(200, 60, 0.0, 0.0, 9_800, groups=20, dropping=60),
}
DROP_AHEAD = 0.3  # s before the instant: the robots were read a moment ago


@dataclass(frozen=True)
class Figures:
    """Figures of the healthy robots' missions. Lateness in ms, ascending."""

    wanted: int
    lateness: list[float]
    twice: int
    cpu: float
    megabytes: float
    load: float
    moved: list[float] = field(default_factory=list)  # s

    @property
    def dropped(self) -> int:
        return self.wanted - len(self.lateness)

    def percentile(self, share: float) -> float:
        return (
            self.lateness[min(len(self.lateness) - 1, int(share * len(self.lateness)))]
            if self.lateness
            else float("nan")
        )


@contextmanager
def stub(scenario: Scenario, out: Path) -> Iterator[int]:
    """The robots; gives their port. What was posted is in ``out`` afterwards."""
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "tests.benchmarks.stub",
            "--robots",
            str(scenario.robots),
            "--refusing",
            str(scenario.refusing),
            "--hanging",
            str(scenario.ill - scenario.refusing),
            "--dropping",
            str(scenario.dropping),
            "--out",
            str(out),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield int(process.stdout.readline().split()[1])
    finally:
        process.terminate()
        process.wait(20)


def measure(engine: str, scenario: Scenario, seed: int) -> Figures:
    jobs = scenario.jobs_of(seed)
    wanted = {job.name for job in jobs if job.robot >= scenario.ill or scenario.groups}
    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory, "posts.csv")
        with stub(scenario, out) as port:
            spec = Spec(
                [f"http://{address(n)}:{port}" for n in range(scenario.robots)],
                jobs,
                scenario.idle_jobs,
                scenario.groups,
            )
            process = subprocess.Popen(
                [sys.executable, "-m", "tests.benchmarks.engines", engine],
                text=True,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
            )
            process.stdin.write(spec.write() + "\n")
            process.stdin.flush()
            due: dict[str, float] = json.loads(process.stdout.readline())["due"]
            if scenario.dropping:
                time.sleep(max(0.0, min(due.values()) - DROP_AHEAD - time.time()))
                urllib.request.urlopen(f"http://{address(scenario.robots - 1)}:{port}{API}/drop", timeout=10).close()
            _wait_until_all_came(
                f"http://{address(scenario.robots - 1)}:{port}", len(wanted), max(due.values()), scenario.patience
            )
            process.stdin.write("stop\n")
            process.stdin.flush()
            result = json.loads(process.stdout.readline())
            process.wait(20)
        arrived: dict[str, float] = {}
        twice, served = 0, set()
        for line in out.read_text(encoding="utf-8").splitlines():
            at, robot, name = line.split(",", 2)
            if name in wanted:
                twice += name in arrived
                arrived.setdefault(name, float(at))
                if scenario.groups and not scenario.dropping and robot in served:
                    wanted.discard(name)  # it had to wait until that robot was free again
                served.add(robot)
        arrived = {name: at for name, at in arrived.items() if name in wanted}
    lateness = sorted((at - due[name]) * 1000 for name, at in arrived.items())
    return Figures(
        len(wanted),
        lateness,
        twice,
        result["cpu"],
        result["megabytes"],
        os.getloadavg()[0],
        sorted(result["moved"]),
    )


def _wait_until_all_came(url: str, count: int, last_due: float, patience: float) -> None:
    while time.time() < last_due + patience:
        time.sleep(0.5)
        if time.time() > last_due:
            with urllib.request.urlopen(f"{url}{API}/count", timeout=10) as answer:
                if json.load(answer) >= count:
                    break
    time.sleep(0.5)


HEADER = (
    f"{'engine':<20} {'sent':>13} {'dropped':>8} {'twice':>6} {'p50 ms':>9} {'p99 ms':>9} {'max ms':>9} {'p99 : app':>10} "
    f"{'cpu s':>7} {'MB':>5} {'load':>5}"
)


def line(engine: str, figures: Figures, app: Figures | None) -> str:
    ratio = f"{figures.percentile(0.99) / app.percentile(0.99):.1f}" if app else "–"
    return (
        f"{engine:<20} {len(figures.lateness):>6}/{figures.wanted:<6} {figures.dropped:>8} {figures.twice:>6} "
        f"{figures.percentile(0.5):>9.1f} {figures.percentile(0.99):>9.1f} {figures.percentile(1.0):>9.1f} {ratio:>10} "
        f"{figures.cpu:>7.2f} {figures.megabytes:>5.0f} {figures.load:>5.1f}"
    )


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.benchmarks.bench_dispatch")
    options.add_argument("--scenario", choices=SCENARIOS, action="append")
    options.add_argument("--engine", choices=ENGINES, action="append")
    options.add_argument("--groups", action="store_true")
    options.add_argument("--seed", type=int, default=7)
    options.add_argument("--repeat", type=int, default=1)
    args = options.parse_args()
    if args.groups:
        for name, scenario in GROUPS.items():
            print(
                f"\n{name}: {scenario.jobs} missions for {scenario.groups} groups of {scenario.robots // scenario.groups} robots at one "
                f"instant, {scenario.ill} robots dead, {scenario.dropping} refuse from {DROP_AHEAD} s before\n{HEADER}"
            )
            for repeat in range(args.repeat):
                figures = measure("app", scenario, args.seed + repeat)
                print(line("app", figures, None))
                if figures.moved:
                    print(
                        f"moved on: {len(figures.moved)}, p50 {figures.moved[len(figures.moved) // 2]:.2f} s, "
                        f"p95 {figures.moved[int(0.95 * len(figures.moved))]:.2f} s, max {figures.moved[-1]:.2f} s",
                        flush=True,
                    )
        return
    for name in args.scenario or SCENARIOS:
        scenario = SCENARIOS[name]
        print(
            f"\n{name}: {scenario.jobs} missions on {scenario.robots} robots "
            + (f"over {scenario.window:.0f} s" if scenario.window else "at one instant")
            + f", {scenario.jobs + scenario.idle_jobs} schedules, {scenario.ill} robots dead "
            f"({scenario.refusing} refuse, {scenario.ill - scenario.refusing} hang)\n{HEADER}"
        )
        app = None
        for engine in args.engine or ENGINES:
            for repeat in range(args.repeat):
                figures = measure(engine, scenario, args.seed + repeat)
                app = app or (figures if engine == "app" else None)
                print(line(engine, figures, app), flush=True)


if __name__ == "__main__":
    main()
