"""Motion along a route, leg by leg: turn on the spot, then drive straight with a trapezoidal speed profile."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

CRUISE = 1.2  # m/s; a MiR250 can do 2.0 but is driven slower among people
ACCELERATION = 0.5  # m/s²
TURN_RATE = 45.0  # degrees/s


@dataclass(frozen=True)
class Pose:
    """Metres and degrees (−180…180) on the map."""

    x: float
    y: float
    orientation: float


@dataclass(frozen=True)
class Motion:
    """An instant of a trip: pose, speed (m/s, degrees/s) and metres driven so far."""

    pose: Pose
    linear: float = 0.0
    angular: float = 0.0
    travelled: float = 0.0


def turned(angle: float) -> float:
    """The same angle within −180…180 degrees."""
    return (angle + 180.0) % 360.0 - 180.0


@dataclass(frozen=True)
class _Turn:
    start: Pose
    by: float

    @property
    def duration(self) -> float:
        return abs(self.by) / TURN_RATE

    length = 0.0

    def at(self, seconds: float) -> Motion:
        rate = math.copysign(TURN_RATE, self.by)
        return Motion(Pose(self.start.x, self.start.y, turned(self.start.orientation + rate * seconds)), 0.0, rate)


@dataclass(frozen=True)
class _Drive:
    start: Pose
    length: float
    cruise: float

    @property
    def _ramp(self) -> float:
        """Seconds of acceleration, and as many of braking."""
        return min(self.cruise / ACCELERATION, math.sqrt(self.length / ACCELERATION))

    @property
    def duration(self) -> float:
        ramp = self._ramp
        return 2 * ramp + (self.length - ACCELERATION * ramp * ramp) / (ACCELERATION * ramp)

    def at(self, seconds: float) -> Motion:
        ramp, top, total = self._ramp, ACCELERATION * self._ramp, self.duration
        if seconds < ramp:
            distance, speed = ACCELERATION * seconds * seconds / 2, ACCELERATION * seconds
        elif seconds < total - ramp:
            distance, speed = top * ramp / 2 + top * (seconds - ramp), top
        else:
            left = max(0.0, total - seconds)
            distance, speed = self.length - ACCELERATION * left * left / 2, ACCELERATION * left
        angle = math.radians(self.start.orientation)
        pose = Pose(
            self.start.x + distance * math.cos(angle), self.start.y + distance * math.sin(angle), self.start.orientation
        )
        return Motion(pose, speed, 0.0, distance)


class Trip:
    """A planned drive from a pose along waypoints to an orientation.

    ``duration`` is in seconds, ``length`` in metres; ``at(seconds)`` gives any instant of it.
    """

    def __init__(
        self,
        start: Pose,
        waypoints: Sequence[tuple[float, float]],
        orientation: float | None = None,
        cruise: float = CRUISE,
    ) -> None:
        self._legs: list[_Turn | _Drive] = []
        pose = start
        for x, y in waypoints:
            length = math.hypot(x - pose.x, y - pose.y)
            if length < 0.01:
                continue
            heading = math.degrees(math.atan2(y - pose.y, x - pose.x))
            pose = self._turn(pose, heading)
            self._legs.append(_Drive(pose, length, cruise))
            pose = Pose(x, y, pose.orientation)
        self.goal = pose if orientation is None else self._turn(pose, orientation)
        self.duration = sum(leg.duration for leg in self._legs)
        self.length = sum(leg.length for leg in self._legs)

    def _turn(self, pose: Pose, heading: float) -> Pose:
        by = turned(heading - pose.orientation)
        if abs(by) > 0.1:
            self._legs.append(_Turn(pose, by))
        return Pose(pose.x, pose.y, turned(heading))

    def at(self, seconds: float) -> Motion:
        travelled = 0.0
        for leg in self._legs:
            if seconds < leg.duration:
                moment = leg.at(seconds)
                return Motion(moment.pose, moment.linear, moment.angular, travelled + moment.travelled)
            seconds -= leg.duration
            travelled += leg.length
        return Motion(self.goal, 0.0, 0.0, self.length)
