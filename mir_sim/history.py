"""A past for the mission queue: robots that have been at work for years have tens of thousands of items in it."""
from __future__ import annotations

import random

from mir_sim.clock import RobotClock
from mir_sim.mission_queue import USER_ABORT, ItemState, MissionQueue, QueueItem
from mir_sim.missions import MISSIONS
from mir_sim.site import DISTRIBUTOR

LONGEST = 100_000     # items


def fill(queue: MissionQueue, clock: RobotClock, count: int, rng: random.Random) -> None:
    """Put ``count`` ended items into the queue, the last one ended ten minutes before the model begins."""
    span = 600.0
    times = []
    for _ in range(count):
        duration, pause = rng.uniform(40, 400), rng.expovariate(1 / 900)
        times.append((-span - duration, -span))
        span += duration + pause
    for number, (started, finished) in enumerate(reversed(times), start=1):
        mission, chance = rng.choice(MISSIONS), rng.random()
        state, message = ItemState.DONE, ""
        if chance < 0.02:
            state, message = ItemState.ABORTED, USER_ABORT
        elif chance < 0.05:
            state, message = ItemState.ABORTED, "Failed to reach goal position 'Line 2'"
        queue.add(QueueItem(
            number, mission.guid, clock.stamp(started - 2), DISTRIBUTOR, "Distributor", message=message,
            description=mission.description, state=state, started=clock.stamp(started), finished=clock.stamp(finished)))
