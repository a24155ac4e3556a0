"""What the window costs while it is not touched and nothing happens: the real loop on the demo's history, three robots at rest that answer.

    uv run python -m tests.benchmarks.bench_rest [--seconds 60]

For each screen a fresh process, drawn in software without a display (with DISPLAY and SDL_VIDEODRIVER=x11 in a window there). Processor
time is that of the app's process, all its threads; the robots are in another one.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, closing
from pathlib import Path

SETTLED = 10.0  # s after which all that a start costs is over
SCREENS = ("home", "scheduler", "logs", "settings")


def measure(screen: str, seconds: float) -> str:
    """Percent of a core, and how many frames a second were made and drawn."""
    from app.window import pace, window

    window.configure(kiosk=False)
    os.environ.setdefault("SDL_VIDEODRIVER", "offscreen")
    from kivy.clock import Clock
    from kivy.core.window import Window

    import mir_sim
    from app.container import Container
    from app.process.demo import furnish
    from app.window.application import SchedulerApp
    from tests.support.fleet_process import serve_apart

    drawn: list[float] = []
    figures: list[tuple[float, float, int, int]] = []

    def note(_dt: float) -> None:
        figures.append((time.monotonic(), time.process_time(), Clock.frames, len(drawn)))

    def count(_window: object) -> None:
        drawn.append(Clock.get_time())

    with ExitStack() as stack:
        directory, fleet = stack.enter_context(tempfile.TemporaryDirectory()), stack.enter_context(serve_apart(3))
        container = stack.enter_context(closing(Container.open(Path(directory, "data"), with_window=True)))
        missions = {mission.name: mission.guid for mission in mir_sim.MISSIONS}
        furnish(container, [(robot.name, robot.url) for robot in fleet.robots], missions)
        for schedule in container.catalogue.schedules():
            container.catalogue.switch_schedule(schedule.id, False)  # nothing is to happen
        container.runner.start()
        app = SchedulerApp(container, first=screen)
        Window.bind(on_draw=count)
        Clock.schedule_once(note, SETTLED)
        Clock.schedule_once(note, SETTLED + seconds)
        Clock.schedule_once(lambda _dt: app.stop(), SETTLED + seconds)
        stack.enter_context(window.quiet_garbage())
        stack.enter_context(pace.slow_at_rest())
        app.run()
    (began, cpu, frames, draws), (ended, spent, made, painted) = figures
    passed = ended - began
    return (
        f"{screen:<10} {100 * (spent - cpu) / passed:5.2f} % of a core; {(made - frames) / passed:5.1f} frames/s, "
        f"{(painted - draws) / passed:4.2f} drawn/s"
    )


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.benchmarks.bench_rest")
    options.add_argument("--seconds", type=float, default=60.0)
    options.add_argument("--one", choices=SCREENS, help=argparse.SUPPRESS)
    args = options.parse_args()
    if args.one:
        print(measure(args.one, args.seconds), flush=True)
        return
    for screen in SCREENS:
        output = subprocess.run(
            [sys.executable, "-m", "tests.benchmarks.bench_rest", "--seconds", str(args.seconds), "--one", screen],
            check=True,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        ).stdout
        print(output.splitlines()[-1], flush=True)


if __name__ == "__main__":
    main()
