"""What a mission's name means on each robot, and how long it takes there: read once, for as long as a question takes to be answered."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Sequence
from math import ceil

from app.database.missions import DurationRepository, MissionRepository
from app.domain.models import DurationEstimate, Group, Mission, Robot
from app.services.allocation.situation import run_duration
from app.services.planning.durations import expected, pooled
from app.services.planning.seen import NOTHING_SEEN, Seen


class Known:
    def __init__(self, c: sqlite3.Connection, groups: Iterable[Group] = (), seen: Seen = NOTHING_SEEN) -> None:
        self._c, self._seen, self._durations = c, seen, DurationRepository()
        self.missions = {mission.id: mission for mission in MissionRepository().all(c)}
        self._meant = {(mission.name, mission.robot_id): mission for mission in self.missions.values()}
        self._peers: dict[int, tuple[int, ...]] = {}  # robots of a robot's groups
        for group in groups:
            for robot_id in group.members:
                self._peers[robot_id] = tuple(sorted({*self._peers.get(robot_id, ()), *group.members}))
        self._usual: dict[tuple[int, str], DurationEstimate | None] = {}
        self._pooled: dict[tuple[str, tuple[int, ...]], DurationEstimate | None] = {}
        self._run_durations: dict[tuple[int, str, bool], float | None] = {}

    def mission(self, name: str, robot_id: int) -> Mission | None:
        """The robot's own, else the one for all robots; None: it has none of that name."""
        return self._meant.get((name, robot_id)) or self._meant.get((name, None))

    def has(self, robot_id: int, name: str) -> bool:
        """Whether a robot can be given that mission, as far as is known."""
        meant = self.mission(name, robot_id)
        return meant is not None and self._seen.has(robot_id, meant.guid)

    def usual(self, robot_id: int, mission: Mission) -> DurationEstimate | None:
        """Of that mission on that robot, or as typed."""
        return expected(self._learned(robot_id, mission.guid), mission)

    def of_any(self, mission: Mission, members: Sequence[int]) -> DurationEstimate | None:
        """Of the runs of all these robots together, or as typed."""
        key = mission.name, tuple(members)
        if key not in self._pooled:
            meant = [(robot_id, self.mission(mission.name, robot_id)) for robot_id in members]
            found = [self._learned(robot_id, own.guid) for robot_id, own in meant if own is not None]
            self._pooled[key] = pooled([each for each in found if each is not None])
        return expected(self._pooled[key], mission)

    def of(self, target: Robot | Group, mission: Mission) -> DurationEstimate | None:
        """On a robot, or on whichever of a group."""
        return self.usual(target.id, mission) if isinstance(target, Robot) else self.of_any(mission, target.members)

    def duration(self, robot_id: int, mission: str, *, slow: bool = False) -> float | None:
        """As the decision code estimates it, in seconds; None: the robot lacks the mission."""
        key = robot_id, mission, slow
        if key not in self._run_durations:
            meant = self.mission(mission, robot_id)
            self._run_durations[key] = (
                None
                if meant is None or not self.has(robot_id, mission)
                else run_duration(
                    self.usual(robot_id, meant), self.of_any(meant, self._peers.get(robot_id, (robot_id,))), slow=slow
                )
            )
        return self._run_durations[key]

    def _learned(self, robot_id: int, guid: str) -> DurationEstimate | None:
        key = robot_id, guid
        if key not in self._usual:
            self._usual[key] = self._durations.usual(self._c, robot_id, guid)
        return self._usual[key]


def quick(estimate: DurationEstimate | None) -> float | None:
    """What nine of ten runs took at least; None where none was measured."""
    samples = estimate.samples_s if estimate else ()
    return samples[len(samples) - ceil(0.9 * len(samples))] if samples else None
