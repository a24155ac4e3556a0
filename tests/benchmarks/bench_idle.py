"""What the app costs when little happens: ``main.py --headless`` with three robots polled every 30 s, and its memory over a month.

    uv run python -m tests.benchmarks.bench_idle [--seconds 180] [--days 30]

The processor time of the real process comes from /proc (Linux); the month is simulated (tests/support/site.py): a mission per robot and
hour, history limit 100. Memory is what Python code of ``app`` holds, by tracemalloc, so that the growing histories of the simulated robots
don't count.
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

from app.models import Schedule
from tests.support.process import configuration_of, environment, import_configuration, running
from tests.support.site import Site

TICK = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


def robots(count: int) -> subprocess.Popen[str]:
    """In a process of their own, so that they are not measured."""
    return subprocess.Popen([sys.executable, "-m", "mir_sim", "--robots", str(count), "--port", "0"], stdout=subprocess.PIPE, text=True,
                            env=environment())


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
    return sum(int(line.split()[1]) for task in Path(f"/proc/{pid}/task").iterdir()
               for line in (task / "status").read_text(encoding="ascii").splitlines() if line.startswith("voluntary_ctxt"))


def idle(seconds: float) -> None:
    with tempfile.TemporaryDirectory() as directory, robots(3) as fleet:
        assert fleet.stdout is not None
        places = [fleet.stdout.readline().split()[1:] for _ in range(3)]
        configuration = configuration_of(poll_interval_seconds=30)
        configuration["robots"] = [{"name": name, "address": url, "username": "distributor", "password": "distributor"}
                                   for name, url in places]
        data = Path(directory, "data")
        import_configuration(data, configuration)
        with running(data) as app:
            pid = app.process.pid
            time.sleep(10.0)                 # what a start costs is over
            cpu, woken, began = cpu_seconds(pid), wakeups(pid), time.monotonic()
            time.sleep(seconds)
            spent = time.monotonic() - began
            share = (cpu_seconds(pid) - cpu) / spent
            print(f"idle, 3 robots every 30 s, over {spent:.0f} s: {100 * share:.3f} % of a core, {(wakeups(pid) - woken) / spent:.1f} "
                  f"wake-ups/s, {status_of(pid, 'VmRSS') / 1024:.0f} MB resident, {status_of(pid, 'Threads')} threads")
        fleet.terminate()


def month(days: int) -> None:
    print(f"{'day':>4} {'app KiB':>8} {'rows':>6} {'ended in all':>12}")
    with tempfile.TemporaryDirectory() as directory:
        site = Site(Path(directory), robots=3)
        site.keep_charged()
        site.container.catalogue.change_settings(poll_interval_seconds=300)
        known, mission = site.add_robots(), site.add_mission("Home")
        start = site.clock.now().replace(tzinfo=None) + timedelta(hours=1)
        for robot in known:
            site.container.catalogue.save_schedule(Schedule("", robot.id, mission.id, start, "UTC", "FREQ=HOURLY", respect_working_days=False))  # noqa: E501
        tracemalloc.start()
        held = []
        for day in range(1, days + 1):
            site.run(86_400.0)
            gc.collect()
            ours = tracemalloc.take_snapshot().filter_traces([tracemalloc.Filter(True, "*/app/*")])
            held.append(sum(trace.size for trace in ours.traces) / 1024)
            c = site.container.db.read()
            rows, last = c.execute("SELECT count(*), max(id) FROM executions").fetchone()
            if day <= 3 or day % 5 == 0:
                print(f"{day:>4} {held[-1]:>8.0f} {rows:>6} {last:>12}", flush=True)
        site.switch_off()
    half = len(held) // 2
    print(f"growth from the first half's mean to the second half's: {sum(held[half:]) / len(held[half:]) - sum(held[:half]) / half:+.0f} KiB")  # noqa: E501


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.benchmarks.bench_idle")
    options.add_argument("--seconds", type=float, default=180.0)
    options.add_argument("--days", type=int, default=30)
    given = options.parse_args()
    if given.seconds:
        idle(given.seconds)
    if given.days:
        month(given.days)


if __name__ == "__main__":
    main()
