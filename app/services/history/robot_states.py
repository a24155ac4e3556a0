"""What the robots did in a period, minute by minute: spans without gaps, and how long each activity took."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from app.database.activities import ActivityRepository
from app.database.connection import Database
from app.database.robots import RobotRepository
from app.domain.activity import ActivitySpan, without_gaps


@dataclass(frozen=True)
class RobotTimeline:
    """``spans`` follow each other from the beginning of the period to its end."""

    robot_id: int
    robot: str
    spans: Sequence[ActivitySpan]

    @property
    def seconds(self) -> Mapping[str, float]:
        """By activity."""
        found: dict[str, float] = {}
        for span in self.spans:
            found[span.activity] = found.get(span.activity, 0.0) + span.seconds
        return found

    def at(self, instant: datetime) -> ActivitySpan | None:
        """The span that holds it."""
        return next((span for span in self.spans if span.start <= instant < span.end), None)


class RobotStates:
    def __init__(self, db: Database) -> None:
        self._db, self._activities, self._robots = db, ActivityRepository(), RobotRepository()

    def timelines(self, start: datetime, end: datetime, robot_ids: Sequence[int] | None = None) -> list[RobotTimeline]:
        """Of the configured robots, or of those of them that are wanted, in order of name."""
        c = self._db.read()
        robots = [robot for robot in self._robots.all(c) if robot_ids is None or robot.id in robot_ids]
        return [
            RobotTimeline(
                robot.id, robot.name, without_gaps(self._activities.between(c, robot.id, start, end), start, end)
            )
            for robot in sorted(robots, key=lambda robot: (robot.name.casefold(), robot.id))
        ]
