"""What the main thread does for each frame while 200 robots are polled, at rest and while lists scroll, drawn for real.

    SDL_VIDEODRIVER=offscreen uv run python -m tests.benchmarks.bench_frames [seconds per scene]

Of each frame, in ms from the touch or clock that begins it to the flip: CPU time of the main thread, and wall time, in which it also
waited for other threads and processes. Not the flip, in which a graphics card (here a software renderer) does its part; of the CPU time
that went into drawing before it, the same apart; with KIVY_GL_BACKEND=mock nothing is rasterised and all is the app's. A
tablet draws 60 frames a second while nothing takes longer than 16 ms.
Before the first and after the last line stands what a turn of an empty loop takes, by which machines and hours can be compared.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from tests.benchmarks.bench_dispatch import Scenario, stub
from tests.benchmarks.stub import address
from tests.screenshots.registry import LANDSCAPE
from tests.screenshots.studio import open_window
from tests.support.edits import switch_robot

FRAME = 1 / 60
FLING = 25.0  # px a frame: 1,500 px/s
ROBOTS = Scenario(200, 200, 0.0, 0.0, 0)


@dataclass(frozen=True)
class Frame:
    """ms."""

    cpu: float
    wall: float
    drawing: float  # of the CPU time


class Frames:
    """Runs the event loop frame by frame, at 60 a second or as fast as it goes, and notes what each took until its flip."""

    def __init__(self) -> None:
        from kivy.clock import Clock
        from kivy.core.window import Window

        Clock._max_fps = 0  # this loop paces itself
        self._drawing = 0.0
        self._flipped: tuple[float, float] | None = None
        draw, flip = Window.on_draw, Window.on_flip

        def on_draw(*args: object) -> None:
            start = time.thread_time()
            draw(*args)
            self._drawing = time.thread_time() - start

        def on_flip(*args: object) -> None:
            self._flipped = time.thread_time(), time.perf_counter()
            flip(*args)

        Window.on_draw, Window.on_flip = on_draw, on_flip

    def run(self, seconds: float, each: Callable[[int], object] = lambda _frame: None) -> list[Frame]:
        """``each(number)`` is called at the beginning of a frame and counts too."""
        from kivy.base import EventLoop

        frames: list[Frame] = []
        due = time.perf_counter()
        end = due + seconds
        while time.perf_counter() < end:
            self._drawing, self._flipped = 0.0, None
            cpu, wall = time.thread_time(), time.perf_counter()
            each(len(frames))
            EventLoop.idle()
            cpu_end, wall_end = self._flipped or (time.thread_time(), time.perf_counter())
            frames.append(Frame((cpu_end - cpu) * 1000, (wall_end - wall) * 1000, self._drawing * 1000))
            due = max(due + FRAME, time.perf_counter())
            time.sleep(max(0.0, due - time.perf_counter()))
        return frames


def turn_ns() -> float:
    """CPU time of one turn of an empty loop, ns."""

    def once() -> float:
        start = time.thread_time()
        for _n in range(300_000):
            pass
        return (time.thread_time() - start) / 300_000 * 1e9

    return median(once() for _n in range(9))


def headline() -> None:
    print(f"a turn of an empty loop: {turn_ns():.1f} ns")
    print(f"{'':<44} {'':>6} {'CPU ms':>22} {'':>5} {'drawing':>7} {'wall ms':>22}")
    print(
        f"{'the main thread, per frame':<44} {'frames':>6} {'p50':>7} {'p95':>7} {'max':>7} {'> 16':>5} {'p95':>7}"
        f" {'p50':>7} {'p95':>7} {'max':>7}",
        flush=True,
    )


def report(name: str, frames: list[Frame]) -> None:
    def figures(values: list[float]) -> str:
        values = sorted(values)
        return f"{values[len(values) // 2]:>7.1f} {values[int(0.95 * len(values))]:>7.1f} {values[-1]:>7.1f}"

    drawing = sorted(frame.drawing for frame in frames)
    print(
        f"{name:<44} {len(frames):>6} {figures([frame.cpu for frame in frames])} {sum(frame.cpu > 16 for frame in frames):>5}"
        f" {drawing[int(0.95 * len(drawing))]:>7.1f} {figures([frame.wall for frame in frames])}",
        flush=True,
    )


def swing(view: Any) -> Callable[[int], None]:
    """Scrolls ``view`` to its end and back, as far per frame as a quick finger."""
    step = FLING / max(1.0, view.children[0].height - view.height)

    def move(frame: int) -> None:
        view.scroll_y = abs(1 - frame * step % 2)

    return move


def main() -> None:
    seconds = next((float(word) for word in sys.argv[1:] if word[0].isdigit()), 8.0)
    open_window(LANDSCAPE)
    from kivy.uix.scrollview import ScrollView

    from app.container import Container
    from app.domain.models import Robot
    from app.mir.credentials import Token
    from app.widgets.long_list import LongList
    from app.widgets.panel_grid import PanelGrid
    from app.window.application import SchedulerApp
    from app.window.window import quiet_garbage
    from tests.support import month

    with (
        tempfile.TemporaryDirectory() as directory,
        stub(ROBOTS, Path(directory, "posts.csv")) as port,
        quiet_garbage(),
    ):
        container = Container.open(Path(directory, "data"), with_window=True)
        month.furnish(container, container.clock.now())
        token = Token.derive("distributor", "distributor").header
        robots, r = container.repositories.robots.all(container.db.read()), container.repositories
        container.db.write(
            lambda c: [
                r.robots.add(c, Robot(f"R{n}", f"http://{address(n)}:{port}", "distributor", token))
                for n in range(ROBOTS.robots)
            ]
        )
        for robot in robots:  # of the month: nothing answers at their addresses
            switch_robot(container.catalogue, robot.id, False)
        container.catalogue.change_settings(
            poll_interval_seconds=2,
            timezone="UTC",  # else it is asked for, over Home
            selected_robot_id=r.robots.all(container.db.read())[-1].id,
        )
        container.runner.start()
        app = SchedulerApp(container)
        app._run_prepare()
        frames = Frames()

        def show(screen: str, **intent: Any) -> Any:
            app.shell.go(screen, **intent)
            for _n in range(3):  # what is read makes more to be read
                frames.run(1)
                while not app.shell.background.idle:
                    frames.run(0.1)
            return app.shell.navigator.screen(screen)

        def lists(screen: Any, kind: type) -> list[Any]:
            return [widget for widget in screen.walk(restrict=True) if isinstance(widget, kind)]

        headline()
        grid = lists(show("home"), PanelGrid)[0]
        report("All robots, each polled every 2 s", frames.run(seconds))
        report("All robots, scrolling", frames.run(seconds, swing(grid)))
        home = show("home", robot_id=container.settings().selected_robot_id)
        report("Home at rest", frames.run(seconds))
        moves = [swing(rows) for rows in lists(home, ScrollView)]
        report("Home, all its lists scrolling", frames.run(seconds, lambda frame: [move(frame) for move in moves]))
        runs = lists(show("logs"), LongList)[0]
        report("Logs, the runs scrolling", frames.run(seconds, swing(runs)))
        print(f"a turn of an empty loop: {turn_ns():.1f} ns")
        app.dispatch("on_stop")
        container.close()


if __name__ == "__main__":
    main()
