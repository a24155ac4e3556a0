"""The app's real threads and sockets, with operators at random, robots that answer slowly, and kills."""

from __future__ import annotations

import pytest

from tests.simulation.stress import stress


@pytest.mark.long
def test_under_stress_nothing_is_doubled_lost_or_sent_after_its_withdrawal():
    """Any time by hand: ``python -m tests.simulation.stress --minutes 60``."""
    result = stress(25.0, seed=3)
    assert result.problems == [], result.line()
    assert result.kills >= 2
    assert sum(result.acts.values()) >= 50
