"""How long a cycle keeps the UI thread from its next frame: the interpreter runs one thread at a time, so lanes and window share it.

    uv run python -m tests.benchmarks.bench_ui_blocking

A thread wants to draw 60 times a second and does nothing else, as a resting window; how late it is each time is noted while the real
services poll 200 robots (10 of them dead), and while 160 missions fall due at one instant. Without Kivy, whose own drawing comes on top.
"""

from __future__ import annotations

import sqlite3
import tempfile
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

from app.container import Container
from app.domain.models import Mission, Robot, Schedule
from app.mir.credentials import Token
from tests.benchmarks.bench_dispatch import Scenario, stub
from tests.benchmarks.stub import MISSION_GUID, address

FRAME = 1 / 60
ROBOTS = Scenario(200, 200, 0.0, 0.05, 0)


def frames(seconds: float) -> list[float]:
    """Lateness of each frame in ms, ascending."""
    late = []
    due = time.perf_counter() + FRAME
    end = due + seconds
    while due < end:
        time.sleep(max(0.0, due - time.perf_counter()))
        now = time.perf_counter()
        late.append((now - due) * 1000)
        due = max(due + FRAME, now)
    return sorted(late)


def report(what: str, seconds: float, work: Callable[[], None]) -> None:
    thread = threading.Timer(0.5, work)
    thread.start()
    late = frames(seconds)
    thread.join()
    print(
        f"{what:<44} {late[len(late) // 2]:>7.2f} {late[int(0.99 * len(late))]:>7.2f} {late[-1]:>7.2f} "
        f"{sum(ms > 16 for ms in late):>5} of {len(late)}",
        flush=True,
    )


def main() -> None:
    with tempfile.TemporaryDirectory() as directory, stub(ROBOTS, Path(directory, "posts.csv")) as port:
        container = Container.open(Path(directory, "data"))
        r, now = container.repositories, container.clock.now()
        token = Token.derive("distributor", "distributor").header
        begin = (now + timedelta(days=1)).replace(second=0, microsecond=0)

        def furnish(c: sqlite3.Connection) -> list[int]:
            robots = [
                r.robots.add(c, Robot(f"R{n}", f"http://{address(n)}:{port}", "distributor", token))
                for n in range(ROBOTS.robots)
            ]
            mission = r.missions.add(c, Mission("Deliver", MISSION_GUID))
            return [
                r.schedules.add(
                    c,
                    Schedule(
                        f"S{robot.name}",
                        robot.id,
                        mission.id,
                        begin.replace(tzinfo=None),
                        "UTC",
                        "FREQ=DAILY",
                        respect_working_days=False,
                        changed_at=now,
                        next_at=begin,
                    ),
                ).id
                for robot in robots
            ]

        schedules = container.db.write(furnish)

        def all_due() -> None:
            container.db.write(
                lambda c: [r.schedules.advance(c, key, datetime.now(UTC) + timedelta(seconds=1.5)) for key in schedules]
            )
            container.runner.wake()

        print(f"{'lateness of frames, ms':<44} {'p50':>7} {'p99':>7} {'max':>7} {'> 16 ms':>14}")
        report("nothing else runs", 5.0, lambda: None)
        container.runner.start()
        time.sleep(12.0)  # the first polls are over
        report("200 robots, between two polls", 5.0, lambda: None)
        report("200 robots are polled", 5.0, container.engine.request_cycle)
        report("a mission for each of 200 robots falls due", 5.0, all_due)
        container.close()


if __name__ == "__main__":
    main()
