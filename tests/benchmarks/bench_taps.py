"""How soon a tap on the bar of screens is seen, and how long a screen is empty, while both cores are busy.

    uv run python -m tests.benchmarks.bench_taps [--idle]

A month's database, three simulated robots in a process of their own, two more processes that only burn time (none with ``--idle``). Each
screen is opened by a finger for the first time, then twice again. ms from lifting the finger: until a frame with the screen's name
marked, and until a frame with something to read on it.
Drawn by KIVY_GL_BACKEND=mock, so that what a graphics card does on a tablet is not done by these cores.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

BUSY = 2  # processes
WORDS = 3  # that make a screen more than its title; those of the plan are drawn without a label
LONGEST = 5.0  # s until a tap counts as lost


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.benchmarks.bench_taps")
    options.add_argument("--idle", action="store_true", help="nothing else runs")
    is_idle = options.parse_args().idle
    os.environ.setdefault("KIVY_GL_BACKEND", "mock")
    from tests.screenshots.registry import LANDSCAPE
    from tests.screenshots.studio import open_window

    open_window(LANDSCAPE)
    from kivy.base import EventLoop
    from kivy.tests.common import UnitTestTouch

    from app.container import Container
    from app.widgets.frame import NavItem
    from app.window.application import SchedulerApp
    from app.window.window import quiet_garbage
    from tests.support import month
    from tests.support.fleet_process import serve_apart
    from tests.ui.looks import words

    with tempfile.TemporaryDirectory() as directory, serve_apart(3) as fleet, quiet_garbage():
        container = Container.open(Path(directory, "data"), with_window=True)
        month.furnish(container, container.clock.now())
        for robot, served in zip(container.catalogue.robots(), fleet.robots, strict=False):
            point_at(container, robot, served.url)
        container.catalogue.change_settings(timezone="UTC")  # else it is asked for, over Home
        container.runner.start()
        app = SchedulerApp(container)
        app._run_prepare()

        def until(is_seen: Callable[[], bool], since: float) -> float:
            while not is_seen():
                EventLoop.idle()
                if time.perf_counter() - since > LONGEST:
                    return float("inf")
            return (time.perf_counter() - since) * 1000

        def settle(seconds: float) -> None:
            end = time.perf_counter() + seconds
            while time.perf_counter() < end or not app.shell.background.idle:
                EventLoop.idle()

        def item(name: str) -> NavItem:
            return next(each for each in app.root.walk() if isinstance(each, NavItem) and each.name == name)

        settle(3)
        burning = (
            [] if is_idle else [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _n in range(BUSY)]
        )
        print(f"{'screen':<24} {'marked, ms':>12} {'to read, ms':>12}")
        try:
            for turn in ("first", "again", "again"):
                for name in ("scheduler", "logs", "settings", "home"):
                    touch = UnitTestTouch(*item(name).to_window(*item(name).center))
                    touch.touch_down()
                    settle(0.05)
                    lifted = time.perf_counter()
                    touch.touch_up()
                    marked = until(lambda name=name: item(name).active, lifted)
                    page = app.shell.navigator.screen(name)
                    shown = until(lambda page=page: len(words(page)) >= WORDS, lifted)
                    print(f"{name + ', ' + turn:<24} {marked:>12.0f} {shown:>12.0f}", flush=True)
                    settle(1)
        finally:
            for each in burning:
                each.kill()
        app.dispatch("on_stop")
        container.close()


def point_at(container: object, robot: object, url: str) -> None:
    """Give a robot of the month's database the address and password of a simulated one."""
    from dataclasses import replace

    container.catalogue.save_robot(replace(robot, address=url, username="distributor"), password="distributor")


if __name__ == "__main__":
    main()
