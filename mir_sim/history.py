"""Fills the mission queue with ended items: on robots in use for years it holds tens of thousands."""

from __future__ import annotations

import random

from mir_sim.clock import RobotClock
from mir_sim.mission_queue import USER_ABORT, ItemState, MissionQueue, QueueItem
from mir_sim.missions import MISSIONS
from mir_sim.site import DISTRIBUTOR

MAX_ITEMS = 100_000


def fill(queue: MissionQueue, clock: RobotClock, count: int, rng: random.Random) -> None:
    """Put ``count`` ended items into the queue; the last one ended ten minutes before simulated second 0."""
    age = 600.0
    times = []
    for _ in range(count):
        duration, pause = rng.uniform(40, 400), rng.expovariate(1 / 900)
        times.append((-age - duration, -age))
        age += duration + pause
    for number, (started, finished) in enumerate(reversed(times), start=1):
        mission, chance = rng.choice(MISSIONS), rng.random()
        state, message = ItemState.DONE, ""
        if chance < 0.02:
            state, message = ItemState.ABORTED, USER_ABORT
        elif chance < 0.05:
            state, message = ItemState.ABORTED, "Failed to reach goal position 'Line 2'"
        queue.add(
            QueueItem(
                number,
                mission.guid,
                clock.stamp(started - 2),
                DISTRIBUTOR,
                "Distributor",
                message=message,
                description=mission.description,
                state=state,
                started=clock.stamp(started),
                finished=clock.stamp(finished),
            )
        )
