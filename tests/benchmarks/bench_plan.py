"""The Scheduler with very much in it: dragging a timeline of 50 robots with 2,000 bars each, and the form's preview among 10,000 schedules.

    SDL_VIDEODRIVER=offscreen uv run python -m tests.benchmarks.bench_plan

Dragging, scrolling, and new bars in the place of the old as they come after a drag: what the main thread does per frame (see
bench_frames). At 24 hours and more bars are too thin to distinguish and become blocks. Preview: wall time of one answer, off the main
thread. Reading: the whole screen's facts and bars.
"""

from __future__ import annotations

import random
import sqlite3
import tempfile
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path
from statistics import median
from typing import Any

from app.container import Container
from app.domain.execution import DurationEstimate
from app.domain.models import Mission, Robot, Schedule
from app.screens.common.shell import pick
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices, Window, read
from app.screens.scheduler.timeline import timeline
from app.services.catalogue.preview import Forecasts
from app.services.planning.planned import PlannedRun
from tests.benchmarks.bench_frames import FLING, Frames, headline, report
from tests.screenshots.registry import LANDSCAPE
from tests.screenshots.studio import open_window

ROBOTS, BARS, SCHEDULES = 50, 2_000, 10_000
DRAG = 24  # px a frame
GUID = "3d7c7c40-ce85-11ef-904a-000e8e9884eb"


def crowded(now: datetime) -> SchedulerFacts:
    """Facts in which each robot has 2,000 runs in the two days that are read."""
    chance = random.Random(1)
    robots = tuple(Robot(f"Robot {n}", f"http://10.0.0.{n}", "distributor", id=n + 1) for n in range(ROBOTS))
    mission = Mission("Deliver", GUID, id=1)
    begins, length = now - timedelta(hours=13), timedelta(hours=48)
    planned, usual = [], [DurationEstimate(seconds, 420.0) for seconds in (40.0, 300.0)]
    for robot in robots:
        schedule = Schedule(robot.name, robot.id, 1, begins.replace(tzinfo=None), "UTC", id=robot.id)
        planned += [
            PlannedRun(begins + length * chance.random(), schedule, robot, mission, chance.choice(usual))
            for _ in range(BARS)
        ]
    return SchedulerFacts(robots=robots, missions=(mission,), planned=tuple(sorted(planned, key=lambda run: run.at)))


def drag(frames: Frames, lanes: Any, name: str) -> None:
    from kivy.core.window import Window as window
    from kivy.tests.common import UnitTestTouch

    from app.widgets.lanes import Lanes
    from app.widgets.scrolling import CalmScroll

    chart = Lanes(
        lanes=lanes.lanes,
        ticks=lanes.ticks,
        bands=lanes.bands,
        hours=lanes.hours,
        first=lanes.first,
        now=lanes.now,
        now_label=lanes.now_label,
        size_hint=(None, None),
        width=window.width,
        seen_height=window.height,
    )
    chart.height = chart.wanted_height
    chart.top = window.height
    window.add_widget(chart)
    frames.run(1)
    x = window.width * 0.9
    touch = UnitTestTouch(x, window.height / 2)
    touch.touch_down()

    def move(frame: int) -> None:
        nonlocal x
        x += DRAG if frame // 30 % 2 else -DRAG
        touch.touch_move(x, window.height / 2)

    report(f"dragged, {name}: {sum(len(lane.bars) for lane in lanes.lanes):,} bars", frames.run(6.0, move))
    touch.touch_up()

    def renew(frame: int) -> None:
        if frame % 30 == 0:
            chart.lanes = list(chart.lanes[::-1])

    report(f"read twice a second, {name}", frames.run(3.0, renew))
    window.remove_widget(chart)
    page = CalmScroll(size_hint=(None, None), size=window.size)
    page.add_widget(chart)
    chart.size_hint_y = None
    window.add_widget(page)
    hidden = chart.height - page.height

    def scroll(frame: int) -> None:
        chart.seen_from = min(hidden, max(0.0, chart.seen_from + (-FLING if frame // 30 % 2 else FLING)))
        page.scroll_y = 1 - chart.seen_from / hidden

    report(f"lanes scrolled, {name}", frames.run(6.0, scroll))
    window.remove_widget(page)


def preview() -> None:
    with tempfile.TemporaryDirectory() as directory:
        container = Container.open(Path(directory, "data"))
        r, now, chance = container.repositories, container.clock.now(), random.Random(2)
        start = now.replace(tzinfo=None, second=0, microsecond=0)

        def furnish(c: sqlite3.Connection) -> tuple[int, int]:
            robots = [
                r.robots.add(c, Robot(f"R{n}", f"http://10.0.0.{n}", "distributor", "token")) for n in range(ROBOTS)
            ]
            mission = r.missions.add(c, Mission("Deliver", GUID))
            for n in range(SCHEDULES):
                first = start + timedelta(minutes=chance.randrange(1, 10_000))
                r.schedules.add(
                    c,
                    Schedule(
                        f"S{n}",
                        robots[n % ROBOTS].id,
                        mission.id,
                        first,
                        "UTC",
                        chance.choice(("FREQ=DAILY", "FREQ=WEEKLY;BYDAY=MO,WE,FR", "FREQ=HOURLY;INTERVAL=6")),
                        changed_at=now,
                        next_at=first.replace(tzinfo=UTC),
                    ),
                )
            return robots[0].id, mission.id

        robot_id, mission_id = container.db.write(furnish)
        forecasts = Forecasts(container.db, container.clock)
        draft = Schedule("", robot_id, mission_id, start + timedelta(days=1), "UTC", "FREQ=WEEKLY;BYDAY=MO,TU,WE,TH,FR")

        def took(work: Any) -> float:
            began = time.perf_counter()
            work()
            return (time.perf_counter() - began) * 1000

        answers = sorted(took(lambda: forecasts.of(draft)) for _ in range(20))
        reading = took(
            lambda: timeline(read(pick(SchedulerServices, container), Window()), container.clock.now(), Window())
        )
        print(f"\nms, {SCHEDULES:,} schedules on {ROBOTS} robots")
        print(f"form's preview{'':<30} {median(answers):>8.1f} (max {answers[-1]:.1f})")
        print(f"the plan of 24 hours read and made bars{'':>6} {reading:>8.1f}", flush=True)
        container.close()


def main() -> None:
    open_window(LANDSCAPE)
    from kivymd.app import MDApp

    from app import widgets
    from app.window.window import quiet_garbage

    widgets.load()
    app = type("Bench", (MDApp,), {})()
    app._run_prepare()
    frames, now = Frames(), datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
    facts = crowded(now)
    headline()
    with quiet_garbage():
        for hours in (6, 24, 168):
            drag(frames, timeline(facts, now, Window(None, hours)), f"{hours} h")
    preview()


if __name__ == "__main__":
    main()
