"""What the main thread does for each frame while All robots shows 200 of them, whose snapshots change, drawn for real.

    SDL_VIDEODRIVER=offscreen uv run python -m tests.benchmarks.bench_fleet [seconds per scene]

Columns as in bench_frames. The snapshots are written by another thread, as the robots' workers do: each robot's is new every 2 s, spread
over that time or all 200 within 50 ms, with another battery, another time left or another state.
"""

from __future__ import annotations

import random
import sys
import tempfile
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

from tests.benchmarks.bench_frames import Frames, headline, report, swing, turn_ns
from tests.screenshots.registry import LANDSCAPE
from tests.screenshots.studio import open_window

ROBOTS = 200
POLL = 2.0  # s


class Polls(threading.Thread):
    """Writes every robot's snapshot each POLL seconds, ``burst`` seconds long."""

    def __init__(self, container: Any, robots: list[Any], burst: float) -> None:
        super().__init__(daemon=True)
        self._container, self._robots, self._burst = container, robots, burst
        self._end = threading.Event()
        self._random = random.Random(7)

    def run(self) -> None:
        while not self._end.is_set():
            for robot in self._robots:
                self._poll(robot)
                self._end.wait(self._burst / len(self._robots))
            self._end.wait(POLL - self._burst)

    def stop(self) -> None:
        self._end.set()
        self.join()

    def _poll(self, robot: Any) -> None:
        from app.domain.models import Connection
        from tests.support import home_facts as sample

        kind = self._random.choice(
            [sample.READY, sample.READY, sample.EXECUTING, sample.EXECUTING, sample.CHARGING, sample.STOPPED]
        )
        if self._random.random() < 0.8:  # most stay unchanged
            kind = self._container.snapshots.get(robot.id).status or kind
        status = replace(
            kind, battery_percentage=None if kind.battery_percentage is None else 20.0 + self._random.randrange(80)
        )
        now = self._container.clock.now()
        self._container.snapshots.update(
            robot.id, connection=Connection.CONNECTED, status=status, read_at=now, queue_read_at=now
        )


def main() -> None:
    seconds = next((float(word) for word in sys.argv[1:] if word[0].isdigit()), 8.0)
    open_window(LANDSCAPE)
    from app.container import Container
    from app.domain.models import Robot
    from app.widgets.panel_grid import PanelGrid
    from app.window.application import SchedulerApp
    from app.window.window import quiet_garbage
    from tests.support import month

    with tempfile.TemporaryDirectory() as directory, quiet_garbage():
        container = Container.open(Path(directory, "data"), with_window=True)
        month.furnish(container, container.clock.now())
        container.db.write(
            lambda c: [
                container.repositories.robots.add(c, Robot(f"Robot {n}", f"http://127.0.1.{n}", "distributor", "x"))
                for n in range(ROBOTS - len(month.ROBOTS))
            ]
        )
        robots = list(container.catalogue.robots())
        app = SchedulerApp(container)
        app._run_prepare()
        frames = Frames()
        frames.run(2)
        page = app.shell.navigator.screen("home")
        grid = next(widget for widget in page.walk() if isinstance(widget, PanelGrid))
        headline()
        report(f"All robots, {ROBOTS} of them, nothing changes", frames.run(seconds))
        report("… scrolling", frames.run(seconds, swing(grid)))
        for words, burst in (("each polled every 2 s", POLL), ("all polled within 50 ms", 0.05)):
            polls = Polls(container, robots, burst)
            polls.start()
            frames.run(POLL)
            report(f"… {words}", frames.run(seconds))
            report(f"… {words}, scrolling", frames.run(seconds, swing(grid)))
            polls.stop()
        page.vm.fleet.open_robot(robots[0].id)
        frames.run(2)
        report("one robot, the others known", frames.run(seconds))
        print(f"a turn of an empty loop: {turn_ns():.1f} ns")
        app.dispatch("on_stop")
        container.close()


if __name__ == "__main__":
    main()
