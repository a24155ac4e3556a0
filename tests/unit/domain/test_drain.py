"""What a robot's runs use of its battery: learned from enough of them, weighted by time, and never beyond what a robot can use."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.drain import ENOUGH_RUNS, LEAST, MOST, USUAL, Drain, Used


def learned(runs):
    drain = Drain()
    for run in runs:
        drain = drain.after(run)
    return drain


def test_few_runs_say_nothing():
    runs = [Used(4.0, 0.1)] * ENOUGH_RUNS
    assert learned(runs[1:]).per_hour == USUAL
    assert learned(runs).per_hour == pytest.approx(40.0)


def test_whole_percents_are_as_good_as_exact_ones():
    """A robot that tells 87 % until it has 86: runs of 6 minutes at 13 %/h, each read so at its beginning and at its end."""
    rng, level, runs = random.Random(1), 90.0, []
    for _number in range(200):
        after = level - 1.3
        runs.append(Used(float(int(level) - int(after)), 0.1))
        level = after - rng.random() if after > 20.0 else 90.0 - rng.random()
    assert learned(runs).per_hour == pytest.approx(13.0, abs=2.0)


def test_long_runs_count_more_than_short_ones():
    assert learned([Used(0.0, 0.01), Used(20.0, 1.0)] * ENOUGH_RUNS).per_hour == pytest.approx(20.0, abs=0.5)


def test_a_robot_that_changes_is_known_anew_after_some_dozens_of_runs():
    assert learned([Used(1.0, 0.1)] * 500 + [Used(3.0, 0.1)] * 60).per_hour == pytest.approx(30.0, abs=1.0)


@given(st.lists(st.builds(Used, st.floats(0.0, 100.0), st.floats(0.0, 24.0)), min_size=ENOUGH_RUNS, max_size=40))
def test_whatever_was_measured_it_is_what_a_robot_can_use(runs):
    assert LEAST <= learned(runs).per_hour <= MOST


def test_a_time_of_nothing_says_nothing():
    assert learned([Used(1.0, 0.0)] * ENOUGH_RUNS).per_hour == USUAL
