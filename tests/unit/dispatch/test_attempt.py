"""A worker's attempts: when each must be looked at again."""

from __future__ import annotations

import math

from app.services.dispatch.attempt import Attempt, Attempts, Phase


def test_when_the_next_has_to_be_looked_at():
    attempts = Attempts()
    assert (attempts.next_at(), attempts.next_ready_at()) == (math.inf, math.inf)
    attempts[1] = Attempt(Phase.ACCEPTED, math.inf)
    attempts[2] = Attempt(Phase.READY, 30.0)
    attempts[3] = Attempt(Phase.READY, 20.0)
    attempts[4] = Attempt(Phase.IN_DOUBT, 10.0)
    attempts[5] = Attempt(Phase.BACKOFF, 15.0)
    assert (attempts.next_at(), attempts.next_ready_at()) == (10.0, 20.0)
    assert list(attempts.of(Phase.READY)) == [attempts[2], attempts[3]]
