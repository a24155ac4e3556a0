"""What one round of the engine costs when nothing is due: with 10,000 schedules it is one index lookup.

    uv run python -m tests.benchmarks.bench_tick

Compared with the thesis's way (read every schedule, compare in Python), on the same database.
"""

from __future__ import annotations

import sqlite3
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from statistics import median

from app.container import Container
from app.domain.models import Mission, Robot, Schedule
from app.services.dispatch.timing import CYCLE_TAKES
from tests.benchmarks.stub import MISSION_GUID

ROBOTS = 50
ROUNDS = 2000


def furnish(container: Container, count: int) -> None:
    """So many daily schedules, spread over the day after tomorrow."""
    r, now = container.repositories, container.clock.now()
    begin = (now + timedelta(days=2)).replace(second=0, microsecond=0)

    def work(c: sqlite3.Connection) -> None:
        robots = [r.robots.add(c, Robot(f"R{n}", f"http://127.0.0.1:{n + 1}", enabled=False)) for n in range(ROBOTS)]
        mission = r.missions.add(c, Mission("Deliver", MISSION_GUID))
        for n in range(count):
            due = begin + timedelta(minutes=n % 1440)
            r.schedules.add(
                c,
                Schedule(
                    f"S{n}",
                    robots[n % ROBOTS].id,
                    mission.id,
                    due.replace(tzinfo=None),
                    "UTC",
                    "FREQ=DAILY",
                    changed_at=now,
                    next_at=due,
                ),
            )

    container.db.write(work)


def milliseconds(call: Callable[[], object], times: int) -> tuple[float, float, float]:
    """p50, p99 and the longest."""
    spent = []
    for _ in range(times):
        began = time.perf_counter()
        call()
        spent.append((time.perf_counter() - began) * 1000)
    return median(spent), sorted(spent)[int(0.99 * times)], max(spent)


def by_reading_all(container: Container) -> list[Schedule]:
    now = datetime.now(UTC)
    return [
        schedule
        for schedule in container.repositories.schedules.all(container.db.read())
        if schedule.enabled and schedule.next_at is not None and schedule.next_at <= now
    ]


def main() -> None:
    print(f"{'schedules':>9} {'':<22} {'p50 ms':>8} {'p99 ms':>8} {'max ms':>8}")
    for count in (100, 1_000, 10_000, 100_000):
        with tempfile.TemporaryDirectory() as directory:
            container = Container.open(Path(directory))
            container.db.write(lambda c, container=container: container.repositories.settings.save(c, timezone="UTC"))
            furnish(container, count)
            engine = container.engine
            engine.start()
            begun = time.monotonic()
            while (
                time.monotonic() - begun < 2 * CYCLE_TAKES
            ):  # the robots are switched off: after it their workers' threads rest
                time.sleep(engine.advance())
            ways = {
                "round": (engine.advance, ROUNDS),
                "reading all (thesis)": (lambda container=container: by_reading_all(container), 3),
            }
            for name, (way, times) in ways.items():
                p50, p99, longest = milliseconds(way, times)
                print(f"{count:>9} {name:<22} {p50:>8.3f} {p99:>8.3f} {longest:>8.3f}", flush=True)
            container.close()


if __name__ == "__main__":
    main()
