"""Trips: turns, drives, arrival, and the relation of distance and time."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mir_sim.motion import ACCELERATION, CRUISE, TURN_RATE, Pose, Trip, turned

METRES = st.floats(-50, 50)
POSES = st.builds(Pose, METRES, METRES, st.floats(-180, 180))


def test_a_long_drive_takes_its_length_at_cruise_and_the_ramps() -> None:
    trip = Trip(Pose(0, 0, 0), [(24, 0)])
    assert trip.duration == pytest.approx(24 / CRUISE + CRUISE / ACCELERATION)
    assert trip.at(trip.duration / 2).linear == CRUISE


def test_a_turn_takes_its_angle() -> None:
    trip = Trip(Pose(0, 0, 0), [], orientation=-90)
    assert trip.duration == pytest.approx(90 / TURN_RATE)
    assert trip.at(1.0).angular == -TURN_RATE
    assert trip.at(1.0).pose.orientation == pytest.approx(-45)


def test_nowhere_to_go_takes_no_time() -> None:
    trip = Trip(Pose(3, 4, 10), [(3, 4)], orientation=10)
    assert (trip.duration, trip.length, trip.at(5).pose) == (0, 0, Pose(3, 4, 10))


@given(POSES, st.lists(st.tuples(METRES, METRES), max_size=4), st.floats(-180, 180))
def test_every_trip_goes_from_its_start_to_its_goal_and_never_jumps(
    start: Pose, waypoints: list[tuple[float, float]], end: float
) -> None:
    trip = Trip(start, waypoints, end)
    assert math.dist((trip.at(0).pose.x, trip.at(0).pose.y), (start.x, start.y)) < 1e-6
    arrived = trip.at(trip.duration + 1).pose
    assert abs(turned(arrived.orientation - end)) < 0.11
    if waypoints:
        assert math.dist((arrived.x, arrived.y), waypoints[-1]) < 0.05
    steps = 60
    moments = [trip.at(trip.duration * step / steps) for step in range(steps + 1)]
    for earlier, later in pairwise(moments):
        apart = math.dist((earlier.pose.x, earlier.pose.y), (later.pose.x, later.pose.y))
        assert later.travelled >= earlier.travelled - 1e-9
        assert apart <= later.travelled - earlier.travelled + 1e-6
        assert apart <= CRUISE * trip.duration / steps + 1e-6
        assert -180 <= later.pose.orientation <= 180
