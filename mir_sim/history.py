"""What a machine has done before: in use for years, its list of missions holds tens of thousands."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import NamedTuple

from mir_sim.clock import RobotClock
from mir_sim.mission_queue import USER_ABORT, ItemState, MissionQueue, QueueItem
from mir_sim.missions import MISSIONS, Mission
from mir_sim.site import DISTRIBUTOR

MAX_ITEMS = 100_000


class Ended(NamedTuple):
    """A mission of the past; times are simulated seconds, below 0."""

    mission: Mission
    started: float
    finished: float
    state: ItemState
    message: str


def past(count: int, rng: random.Random) -> Iterator[Ended]:
    """``count`` ended missions, oldest first; the last one ended ten minutes before simulated second 0."""
    age = 600.0
    times = []
    for _ in range(count):
        duration, pause = rng.uniform(40, 400), rng.expovariate(1 / 900)
        times.append((-age - duration, -age))
        age += duration + pause
    for started, finished in reversed(times):
        mission, chance = rng.choice(MISSIONS), rng.random()
        state, message = ItemState.DONE, ""
        if chance < 0.02:
            state, message = ItemState.ABORTED, USER_ABORT
        elif chance < 0.05:
            state, message = ItemState.ABORTED, "Failed to reach goal position 'Line 2'"
        yield Ended(mission, started, finished, state, message)


def fill(queue: MissionQueue, clock: RobotClock, count: int, rng: random.Random) -> None:
    """Put ``count`` ended items into the queue."""
    for number, one in enumerate(past(count, rng), start=1):
        queue.add(
            QueueItem(
                number,
                one.mission.guid,
                clock.stamp(one.started - 2),
                DISTRIBUTOR,
                "Distributor",
                message=one.message,
                description=one.mission.description,
                state=one.state,
                started=clock.stamp(one.started),
                finished=clock.stamp(one.finished),
            )
        )
