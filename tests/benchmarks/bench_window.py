"""What the window costs: until the app's first frame, to build Home, and in memory.

    uv run python -m tests.benchmarks.bench_window [runs]

Processor time in ms, drawn in software without a display; medians of so many fresh processes (5). Until the first frame
it is that of the whole process; for Home that of the main thread, from the sample facts of its picture until its third
frame, built again and again in one process. Memory is what the process has resident after the first one. The time of an
empty loop's turn allows comparison between machines and hours.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

BUILDS = 9  # of Home per process
PAGE_MB = os.sysconf("SC_PAGE_SIZE") / 2**20


def first_frame() -> dict[str, float]:
    """The app on an invented plant's month, from the start of Python to its first frame."""
    from tests.screenshots.registry import LANDSCAPE
    from tests.screenshots.studio import open_window

    open_window(LANDSCAPE)
    from kivy.base import EventLoop

    from app.window.application import SchedulerApp
    from tests.support import month

    with tempfile.TemporaryDirectory() as directory:
        filled = time.process_time()
        container = month.plant(Path(directory))
        filled = time.process_time() - filled
        app = SchedulerApp(container)
        app._run_prepare()
        EventLoop.idle()
        spent = time.process_time() - filled
        app.dispatch("on_stop")
        container.close()
    return {"start to the app's first frame, ms": spent * 1000}


def home() -> dict[str, float]:
    from tests.screenshots.registry import LANDSCAPE
    from tests.screenshots.studio import Studio, open_window

    open_window(LANDSCAPE)
    from app.window.garbage import Garbage
    from tests.benchmarks.bench_frames import turn_ns
    from tests.screenshots import home as pictures

    studio = Studio(LANDSCAPE)
    studio.use("light")
    Garbage(time.monotonic).begin()  # as app/window/window.py does

    def build() -> float:
        studio.clear()
        gc.collect()
        begin = time.thread_time()
        pictures.running(studio)
        studio.driver.advance()
        return (time.thread_time() - begin) * 1000

    first = build()
    memory = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * PAGE_MB
    return {
        "Home built for the first time, ms": first,
        "Home built again, ms": median(builds := [build() for _n in range(BUILDS)]),
        "at best, ms": min(builds),
        "memory after Home, MB": memory,
        "a turn of an empty loop, ns": turn_ns(),
    }


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps({"app": first_frame, "home": home}[sys.argv[2]]()), flush=True)
        os._exit(0)
    runs = int(sys.argv[1]) if sys.argv[1:] else 5
    figures: dict[str, list[float]] = {}
    for _run in range(runs):
        for what in ("app", "home"):
            output = subprocess.run(
                [sys.executable, "-m", "tests.benchmarks.bench_window", "--one", what],
                check=True,
                text=True,
                stdout=subprocess.PIPE,
            ).stdout
            for name, figure in json.loads(output.splitlines()[-1]).items():
                figures.setdefault(name, []).append(figure)
    for name, values in figures.items():
        print(f"{name:<40} {median(values):>8.1f}   ({min(values):.1f}–{max(values):.1f})")


if __name__ == "__main__":
    main()
