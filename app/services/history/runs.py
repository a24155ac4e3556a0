"""The history: the ledger's rows, page by page; and what the robots did in a period, minute by minute."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from app.database.activities import ActivityRepository
from app.database.connection import Database
from app.database.execution_history import ExecutionFilter, ExecutionHistory, PageKey, Replacement
from app.database.executions import ExecutionRepository
from app.database.missions import DurationRepository, MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.domain.activity import ActivitySpan, without_gaps
from app.domain.execution import DurationEstimate, Execution, State
from app.services.planning.durations import expected

DOUBTED_FOR = timedelta(days=7)  # that a start is looked back for in whose place another one was started


@dataclass(frozen=True)
class Page:
    """Some rows, newest first, and where the next page begins (None: no more)."""

    rows: Sequence[Execution]
    next: PageKey | None


class History:
    def __init__(self, db: Database) -> None:
        self._db, self._executions, self._missions = db, ExecutionRepository(), MissionRepository()
        self._schedules, self._durations, self._history = ScheduleRepository(), DurationRepository(), ExecutionHistory()

    def page(self, wanted: ExecutionFilter, before: PageKey | None = None, size: int = 100) -> Page:
        rows = self._history.page(self._db.read(), wanted, before, size)
        return Page(rows, PageKey.of(rows[-1]) if len(rows) == size else None)

    def last_ended(self, robot_id: int, now: datetime, size: int) -> Sequence[Execution]:
        """Of one robot, the last one to end first, without what was planned for later."""
        return self._history.last_ended(self._db.read(), robot_id, now, size)

    def counts(self, wanted: ExecutionFilter) -> Mapping[State, int]:
        return self._history.counts(self._db.read(), wanted)

    def get(self, execution_id: int) -> Execution | None:
        """Its present row; None if it was deleted."""
        return self._executions.get(self._db.read(), execution_id)

    def replacements(self, rows: Sequence[Execution]) -> Mapping[int, Replacement]:
        """Replacements of these rows on other robots, and the rows that these replace, by the row's id."""
        if not rows:
            return {}
        planned = [row.planned_at for row in rows]
        found = self._history.replacements(self._db.read(), min(planned) - DOUBTED_FOR, max(planned))
        return {number: one for one in found for number in (one.id, one.other)}

    def open(self) -> Sequence[Execution]:
        """Everything under way or waiting, of all robots."""
        return self._executions.open_all(self._db.read())

    def last_of_schedule(self, schedule_id: int, until: datetime | None = None) -> Execution | None:
        """The one with the latest planned instant, which may be a future skipped start; ``until``: up to then."""
        c = self._db.read()
        if until is None:
            return self._executions.last_of_schedule(c, schedule_id)
        found = self._schedules.newest_row(c, schedule_id, until)
        return None if found is None else self._executions.get(c, found)

    def expected(self, robot_id: int, mission_guid: str) -> DurationEstimate | None:
        """The expected duration of a run there: from the last ones, or as typed for the mission; None: unknown."""
        c = self._db.read()
        return expected(
            self._durations.usual(c, robot_id, mission_guid), self._missions.with_guid(c, mission_guid, robot_id)
        )


# ---------------------------------------------------------------------- what robots did
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
        """Of the configured robots, or of those of them that are wanted, in order of name. What stands for any robot of a
        fleet does nothing itself."""
        c, known = self._db.read(), robot_ids
        robots = [each for each in self._robots.all(c) if not each.is_any and (known is None or each.id in known)]
        return [
            RobotTimeline(
                robot.id, robot.name, without_gaps(self._activities.between(c, robot.id, start, end), start, end)
            )
            for robot in sorted(robots, key=lambda robot: (robot.name.casefold(), robot.id))
        ]
