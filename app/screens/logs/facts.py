"""What the Logs need to know at one moment, read on a background thread; logs_view and logs_kpi_view turn it into words."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

from app.domain.models import DurationEstimate, Execution, Robot, Settings
from app.screens.logs.view import Chosen, Period, period_start

if TYPE_CHECKING:
    from app.container import Container
    from app.services.history.runs import Page

PAGE = 100


@dataclass(frozen=True)
class LogsFacts:
    settings: Settings = field(default_factory=Settings)
    robots: tuple[Robot, ...] = ()
    missions: tuple[str, ...] = ()
    rows: tuple[Execution, ...] = ()
    next: Any = None                     # where the next page begins; None: there is none
    count: int = 0                       # rows that the filters let through
    usual_s: Mapping[tuple[int | None, str], float] = field(default_factory=dict)
    expected: Mapping[int, DurationEstimate] = field(default_factory=dict)      # by id, of what is open

    @property
    def zone(self) -> ZoneInfo:
        return ZoneInfo(self.settings.timezone)

    @property
    def robot(self) -> Robot | None:
        """The selected one."""
        chosen = self.settings.selected_robot_id
        return next((robot for robot in self.robots if robot.id == chosen), self.robots[0] if self.robots else None)


def filter_of(chosen: Chosen, now: datetime, zone: ZoneInfo) -> Any:
    """The repository's filter for what is chosen."""
    from app.database.executions import ExecutionFilter

    return ExecutionFilter(
        robot_ids=None if chosen.robot_id is None else (chosen.robot_id,), mission=chosen.mission, states=chosen.states or None,
        triggers=chosen.triggers or None, start=period_start(chosen.period, now, zone), text=chosen.text.strip())


def read(container: Container, chosen: Chosen, rows: int = PAGE) -> LogsFacts:
    """The newest ``rows`` runs and their surroundings. Called off the UI thread: it asks the database, never a robot."""
    settings, c, now = container.settings(), container.db.read(), container.clock.now()
    wanted = filter_of(chosen, now, ZoneInfo(settings.timezone))
    page = container.history.page(wanted, size=rows)
    names = sorted({mission.name for mission in container.repositories.missions.all(c)}, key=str.casefold)
    facts = LogsFacts(settings=settings, robots=tuple(container.repositories.robots.all(c)), missions=tuple(names), rows=tuple(page.rows),
                      next=page.next, count=container.history.count(wanted))
    return replace(facts, usual_s=usual_durations(container, page.rows, {}), expected={
        row.id: found for row in page.rows if row.state.is_open and row.robot_id is not None
        and (found := container.history.expected(row.robot_id, row.mission_guid)) is not None})


def read_more(container: Container, chosen: Chosen, before: Any) -> Page:
    """The page behind that key."""
    zone = ZoneInfo(container.settings().timezone)
    return container.history.page(filter_of(chosen, container.clock.now(), zone), before=before, size=PAGE)


def usual_durations(container: Container, rows: Any, known: Mapping[tuple[int | None, str], float]) -> dict[tuple[int | None, str], float]:
    """Of the missions of these rows, those already known included."""
    missing = {(row.robot_id, row.mission_guid) for row in rows if row.robot_id is not None} - known.keys()
    found = {key: container.history.usual_duration(key[0], key[1]) for key in missing if key[0] is not None}
    return {**known, **{key: seconds for key, seconds in found.items() if seconds}}


def period_with(instant: datetime, now: datetime, zone: ZoneInfo) -> Period:
    """The shortest period that holds that instant."""
    for period in (Period.TODAY, Period.WEEK, Period.MONTH):
        start = period_start(period, now, zone)
        if start is not None and instant >= start:
            return period
    return Period.ALL
