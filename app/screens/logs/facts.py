"""What the Logs show at one moment, read on a background thread; view.py turns it into words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from zoneinfo import ZoneInfo

from app.database.executions import ExecutionFilter, PageKey, Replacement
from app.domain.clock import Clock
from app.domain.models import DurationEstimate, Execution, Group, Robot, Settings
from app.domain.reasons import codes_with
from app.i18n import _
from app.screens.common.name_order import by_name
from app.screens.logs.view import Filters, Period, UsualSeconds, period_end, period_start
from app.services.catalogue.catalogue import Catalogue
from app.services.dispatch.ledger import Ledger
from app.services.files.exports import DataFiles
from app.services.history.kpis import Kpis
from app.services.history.runs import History, RobotStates
from app.services.history.shift_report import ShiftReports
from app.services.live.holds import Holds
from app.services.live.snapshots import Snapshots
from app.services.robots.commands import Operator
from app.services.robots.missions import RobotMissions

PAGE = 100


@dataclass(frozen=True)
class LogsServices:
    """The services that the Logs use, named as in the container."""

    catalogue: Catalogue
    clock: Clock
    history: History
    holds: Holds
    kpis: Kpis
    ledger: Ledger
    files: DataFiles
    operator: Operator
    robot_missions: RobotMissions
    robot_states: RobotStates
    settings: Callable[[], Settings]
    shift_reports: ShiftReports
    snapshots: Snapshots


@dataclass(frozen=True)
class LogsFacts:
    """The newest runs that ``filters`` let through, and what is needed to show them."""

    filters: Filters = field(default_factory=Filters)
    settings: Settings = field(default_factory=Settings)
    robots: tuple[Robot, ...] = ()
    groups: tuple[Group, ...] = ()
    missions: tuple[str, ...] = ()
    rows: tuple[Execution, ...] = ()
    next: PageKey | None = None  # where the next page begins; None: no next page
    count: int = 0  # rows that the filters let through
    usual_s: UsualSeconds = field(default_factory=dict)
    expected: Mapping[int, DurationEstimate] = field(default_factory=dict)  # by id, of what is open
    replacements: Mapping[int, Replacement] = field(default_factory=dict)  # by id, of what was started on another robot

    @property
    def zone(self) -> ZoneInfo:
        return ZoneInfo(self.settings.timezone)

    def target(self, run: Execution) -> Robot | Group | None:
        """Its robot or group, if that still exists."""
        if run.group_id is None:
            return next((robot for robot in self.robots if robot.id == run.robot_id), None)
        return next((group for group in self.groups if group.id == run.group_id), None)

    def with_more(self, page: LogsFacts) -> LogsFacts:
        """The same with the rows of the next page, unless they are known already."""
        known = {row.id for row in self.rows}
        return replace(
            self,
            rows=(*self.rows, *(row for row in page.rows if row.id not in known)),
            next=page.next,
            usual_s=page.usual_s,
            replacements={**self.replacements, **page.replacements},
        )


def execution_filter(filters: Filters, now: datetime, zone: ZoneInfo) -> ExecutionFilter:
    """The filters of the screen as those of the history."""
    return ExecutionFilter(
        robot_ids=None if filters.group else filters.robot_ids,
        group=filters.group.name if filters.group else None,
        mission=filters.mission,
        states=filters.states or None,
        triggers=filters.triggers or None,
        start=period_start(filters.period, now, zone),
        end=period_end(filters.period, now, zone),
        text=filters.text.strip(),
        reasons=codes_with(filters.text.strip(), _) if filters.text.strip() else (),
        values=filters.values,
    )


def read_facts(services: LogsServices, filters: Filters, rows: int = PAGE) -> LogsFacts:
    """The newest ``rows`` runs and their surroundings. Called off the UI thread: it asks the database, never a robot."""
    settings, history = services.settings(), services.history
    wanted = execution_filter(filters, services.clock.now(), ZoneInfo(settings.timezone))
    page = history.page(wanted, size=rows)
    return LogsFacts(
        filters,
        settings,
        by_name(services.catalogue.robots()),
        by_name(services.catalogue.groups()),
        tuple(sorted({mission.name for mission in services.catalogue.missions()}, key=str.casefold)),
        tuple(page.rows),
        page.next,
        history.count(wanted),
        usual_durations(history, page.rows, {}),
        {
            row.id: found
            for row in page.rows
            if row.state.is_open
            and row.robot_id is not None
            and (found := history.expected(row.robot_id, row.mission_guid)) is not None
        },
        history.replacements(page.rows),
    )


def read_next_page(services: LogsServices, facts: LogsFacts) -> LogsFacts:
    """The runs that follow those of ``facts``. Called off the UI thread."""
    wanted = execution_filter(facts.filters, services.clock.now(), facts.zone)
    page = services.history.page(wanted, before=facts.next, size=PAGE)
    return replace(
        facts,
        rows=tuple(page.rows),
        next=page.next,
        usual_s=usual_durations(services.history, page.rows, facts.usual_s),
        replacements=services.history.replacements(page.rows),
    )


def usual_durations(history: History, rows: Sequence[Execution], known: UsualSeconds) -> UsualSeconds:
    """For the missions of these rows, including known ones. A mission that ran only once would be compared with
    itself."""
    missing = {(row.robot_id, row.mission_guid) for row in rows if row.robot_id is not None} - known.keys()
    found = {key: history.expected(key[0], key[1]) for key in missing if key[0] is not None}
    return {
        **known,
        **{key: one.median_s for key, one in found.items() if one is not None and one.runs > 1 and one.median_s},
    }


def period_with(instant: datetime, now: datetime, zone: ZoneInfo) -> Period:
    """The shortest period that contains that instant."""

    def has(period: Period) -> bool:
        start, end = period_start(period, now, zone), period_end(period, now, zone)
        return (start is None or start <= instant) and (end is None or instant < end)

    return next(period for period in Period if has(period))
