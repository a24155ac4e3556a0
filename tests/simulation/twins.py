"""Twins: two runs of one plan that differ in something that must not matter, and what each sent."""

from __future__ import annotations

import random
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from app.domain.models import Overlap, Schedule
from tests.support.edits import skip_next
from tests.support.network import QUEUE, Fate
from tests.support.site import Site

NOON = datetime(2026, 11, 23, 6, 0)
ROBOTS, LASTS = 2, 2400.0
FATES = (Fate.LOST, Fate.ANSWER_LOST, Fate.ERROR_AFTER, Fate.CUT, Fate.REFUSED)


@dataclass(frozen=True)
class Twin:
    """``screen_s``: how often the screen reads a robot, if at all. ``restarts_at``: seconds at which the app is started again, at rest."""

    history_limit: int | None = None
    screen_s: float | None = None
    restarts_at: tuple[float, ...] = ()


def sent(directory: Path, seed: int, twin: Twin) -> list[tuple[int, str, str]]:
    """When (in minutes) which submissions left to which robot. What happens to a request is planned for the n-th one to a robot's queue."""
    directory.mkdir()
    site, rng = Site(directory, robots=ROBOTS, robot_speed=8.0), random.Random(seed)
    catalogue = site.container.catalogue
    catalogue.change_settings(history_limit=twin.history_limit, poll_interval_seconds=30)
    mission = site.add_mission("Deliver")
    robots = site.add_robots()
    for robot in robots:
        for number in range(3):
            start = NOON.replace(minute=1 + rng.randrange(5))
            catalogue.save_schedule(
                Schedule(
                    f"{robot.name} {number}",
                    robot.id,
                    mission.id,
                    start,
                    "UTC",
                    f"FREQ=MINUTELY;INTERVAL={rng.choice((6, 12))}",
                    overlap=Overlap.QUEUE,
                )
            )
    for minute in range(2, 38, 3):
        name, fate = f"R{rng.randrange(ROBOTS) + 1}", rng.choice(FATES)
        site.at(60.0 * minute + 30.0, lambda name=name, fate=fate: site.network.next("POST", QUEUE, fate, robot=name))
    skipped = rng.choice(catalogue.schedules()).id
    site.at(400.0, lambda: skip_next(site.container, skipped))
    site.at(1500.0, lambda: site.container.catalogue.change_settings(working_days=("MO", "TU")))
    if twin.screen_s is not None:
        _look(site, robots[0].id, twin.screen_s)
    for at in (*twin.restarts_at, LASTS):
        site.run(at - site.seconds())
        site.run_until(lambda: not site.container.history.open() and site.clock.now().second in range(20, 50))
        if at < LASTS:
            site.switch_off()
            site.switch_on()
    posts = [(round(post.at / 60), post.robot, post.mission_id) for post in site.network.posts()]
    site.switch_off()
    return sorted(posts)


def _look(site: Site, robot_id: int, every: float) -> None:
    """Somebody has the window open, at that robot."""
    site.container.engine.watch(robot_id)

    def cycle() -> None:
        site.container.engine.request_cycle(by_window=True)
        site.at(every, cycle)

    site.at(every, cycle)
