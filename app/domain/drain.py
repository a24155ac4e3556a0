"""How much of its battery a robot uses while it runs missions, learned from its own runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

USUAL = 10.0  # % per hour: a full battery lasts a day's shift
ENOUGH_RUNS = 20  # fewer say too little
KEPT = 0.95  # of what was known, with each run: about the newest 20 count, as batteries age and loads change
# %/h. Standing alone takes more than the one, and with the other a full battery would be empty after less than two hours: what is measured
# beyond these says more about the reading (one that stands still, one that was set anew) than about the robot.
LEAST, MOST = 1.0, 60.0


class Used(NamedTuple):
    """By one run."""

    percent: float
    hours: float


@dataclass(frozen=True)
class Drain:
    """% of the battery that so many runs used in so many hours; of older ones less of both. As sums, so that a long run counts more than a
    short one, and whole percents do no harm."""

    runs: int = 0
    percent: float = 0.0
    hours: float = 0.0

    def after(self, run: Used) -> Drain:
        return Drain(self.runs + 1, self.percent * KEPT + run.percent, self.hours * KEPT + run.hours)

    @property
    def per_hour(self) -> float:
        """In %."""
        if self.runs < ENOUGH_RUNS or self.hours <= 0.0:
            return USUAL
        return min(max(self.percent / self.hours, LEAST), MOST)
