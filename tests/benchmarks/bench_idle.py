"""What the app costs when little happens: ``main.py --headless`` with three robots polled every 30 s, and its memory over a month.

    uv run python -m tests.benchmarks.bench_idle [--seconds 180] [--days 30]

The processor time of the real process comes from /proc (Linux); the month is simulated (tests/support/site.py): a mission per robot and
hour, history limit 100. Memory is all that Python holds, by tracemalloc; the simulated robots forget their old queue items each day, so
that only the app could grow.
"""

from __future__ import annotations

import argparse
import gc
import os
import subprocess
import sys
import tempfile
import time
import tracemalloc
from datetime import timedelta
from pathlib import Path
from statistics import fmean

from app.domain.models import Schedule
from mir_sim import SimulatedRobot
from tests.support.process import configuration_of, environment, import_configuration, running
from tests.support.site import Site

TICK = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


def robots(count: int) -> subprocess.Popen[str]:
    """In a process of their own, so that they are not measured."""
    return subprocess.Popen(
        [sys.executable, "-m", "mir_sim", "--robots", str(count), "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
        env=environment(),
    )


def cpu_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def status_of(pid: int, name: str) -> int:
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1])
    raise LookupError(name)


def wakeups(pid: int) -> int:
    """Voluntary context switches of all threads."""
    return sum(
        int(line.split()[1])
        for task in Path(f"/proc/{pid}/task").iterdir()
        for line in (task / "status").read_text(encoding="ascii").splitlines()
        if line.startswith("voluntary_ctxt")
    )


def idle(seconds: float) -> None:
    with tempfile.TemporaryDirectory() as directory, robots(3) as fleet:
        assert fleet.stdout is not None
        places = [fleet.stdout.readline().split()[1:] for _ in range(3)]
        configuration = configuration_of(poll_interval_seconds=30)
        configuration["robots"] = [
            {"name": name, "address": url, "username": "distributor", "password": "distributor"} for name, url in places
        ]
        data = Path(directory, "data")
        import_configuration(data, configuration)
        with running(data) as app:
            pid = app.process.pid
            time.sleep(10.0)  # what a start costs is over
            cpu, woken, began = cpu_seconds(pid), wakeups(pid), time.monotonic()
            time.sleep(seconds)
            spent = time.monotonic() - began
            share = (cpu_seconds(pid) - cpu) / spent
            print(
                f"idle, 3 robots every 30 s, over {spent:.0f} s: {100 * share:.3f} % of a core, {(wakeups(pid) - woken) / spent:.1f} "
                f"wake-ups/s, {status_of(pid, 'VmRSS') / 1024:.0f} MB resident, {status_of(pid, 'Threads')} threads"
            )
        fleet.terminate()


def forget_old_items(machine: SimulatedRobot) -> None:
    items = machine.queue._items
    for number in list(items)[:-50]:
        del items[number]


def month(days: int) -> None:
    print(f"{'day':>4} {'KiB held':>9} {'rows':>6} {'of ever':>8}")
    with tempfile.TemporaryDirectory() as directory:
        site = Site(Path(directory), robots=3)
        site.keep_charged()
        site.container.catalogue.change_settings(poll_interval_seconds=300)
        known, mission = site.add_robots(), site.add_mission("Home")
        start = site.clock.now().replace(tzinfo=None) + timedelta(hours=1)
        for robot in known:
            hourly = Schedule("", robot.id, mission.id, start, "UTC", "FREQ=HOURLY", respect_working_days=False)
            site.container.catalogue.save_schedule(hourly)
        tracemalloc.start()
        held = []
        for day in range(1, days + 1):
            site.run(86_400.0)
            for machine in site.machines.values():
                forget_old_items(machine)
            gc.collect()
            held.append(tracemalloc.get_traced_memory()[0] / 1024)
            c = site.container.db.read()
            rows, last = c.execute("SELECT count(*), max(id) FROM executions").fetchone()
            if day <= 3 or day % 5 == 0:
                print(f"{day:>4} {held[-1]:>9.0f} {rows:>6} {last:>8}", flush=True)
        site.switch_off()
    if days >= 10:
        print(f"mean of days 3 to 7 {fmean(held[2:7]):.0f} KiB, of the last five {fmean(held[-5:]):.0f} KiB")


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.benchmarks.bench_idle")
    options.add_argument("--seconds", type=float, default=180.0)
    options.add_argument("--days", type=int, default=30)
    args = options.parse_args()
    if args.seconds:
        idle(args.seconds)
    if args.days:
        month(args.days)


if __name__ == "__main__":
    main()
