"""The runs that the Logs show at one moment, read on a background thread; view.py and story.py turn them into words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from zoneinfo import ZoneInfo

from app.database.execution_history import ExecutionFilter, PageKey
from app.domain.clock import Clock
from app.domain.execution import DurationEstimate, Execution, ReasonCode, State
from app.domain.models import Settings
from app.domain.reasons import codes_with
from app.i18n import _
from app.screens.common.name_order import by_name
from app.screens.common.plant import Plant
from app.screens.logs.story import StoryFacts
from app.screens.logs.view import Filters, Period, like_of
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
PAGE_OF_PROBLEMS = 1000  # equal ones are one row


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
class LogsFacts(Plant):
    """The newest runs that ``filters`` let through, and what is needed to show them."""

    filters: Filters = field(default_factory=Filters)
    missions: tuple[str, ...] = ()
    rows: tuple[Execution, ...] = ()
    next: PageKey | None = None  # where the next page begins; None: no next page
    counts: Mapping[State, int] = field(
        default_factory=dict
    )  # of rows that the filters except the outcomes let through
    expected: Mapping[int, DurationEstimate] = field(default_factory=dict)  # by id, of what is open

    @property
    def count(self) -> int:
        """Rows that the filters let through."""
        return sum(number for state, number in self.counts.items() if state in (self.filters.states or State))

    def with_more(self, page: LogsFacts) -> LogsFacts:
        """The same with the rows of the next page, unless they are known already."""
        known = {row.id for row in self.rows}
        return replace(self, rows=(*self.rows, *(row for row in page.rows if row.id not in known)), next=page.next)


def execution_filter(filters: Filters, now: datetime, zone: ZoneInfo) -> ExecutionFilter:
    """The filters of the screen as those of the history."""
    start, end = filters.span(now, zone)
    text, like, reasons = filters.text.strip(), filters.like, tuple[ReasonCode, ...]()
    if like is not None:
        text, reasons = like.part or like.words, () if like.part else (like.code,)
    elif text:
        reasons = codes_with(text, _)
    return ExecutionFilter(
        robot_ids=None if filters.group else filters.robot_ids,
        group=filters.group.name if filters.group else None,
        mission=filters.mission,
        states=filters.states or None,
        triggers=filters.triggers or None,
        start=start,
        end=end,
        text=text,
        reasons=reasons,
        values=filters.values,
    )


def read_facts(services: LogsServices, filters: Filters, rows: int = PAGE) -> LogsFacts:
    """The newest ``rows`` runs and their surroundings. Called off the UI thread: it asks the database, never a robot."""
    settings, history = services.settings(), services.history
    wanted = execution_filter(filters, services.clock.now(), ZoneInfo(settings.timezone))
    page = history.page(wanted, size=max(rows, PAGE_OF_PROBLEMS) if filters.folds else rows)
    return LogsFacts(
        settings,
        by_name(services.catalogue.robots()),
        by_name(services.catalogue.groups()),
        filters,
        tuple(sorted({mission.name for mission in services.catalogue.missions()}, key=str.casefold)),
        tuple(page.rows),
        page.next,
        history.counts(replace(wanted, states=None)),
        {
            row.id: found
            for row in page.rows
            if row.state.is_open
            and row.robot_id is not None
            and (found := history.expected(row.robot_id, row.mission_guid)) is not None
        },
    )


def read_next_page(services: LogsServices, facts: LogsFacts) -> LogsFacts:
    """The runs that follow those of ``facts``. Called off the UI thread."""
    wanted = execution_filter(facts.filters, services.clock.now(), facts.zone)
    page = services.history.page(wanted, before=facts.next, size=PAGE)
    return replace(facts, rows=tuple(page.rows), next=page.next)


def read_story(services: LogsServices, execution_id: int) -> StoryFacts | None:
    """A run with what belongs to its story; None if it is no longer in the history. Called off the UI thread."""
    run, zone = services.ledger.get(execution_id), ZoneInfo(services.settings().timezone)
    if run is None:
        return None
    like = like_of(run, zone)
    wanted = execution_filter(Filters(Period.MONTH, like=like), services.clock.now(), zone)
    return StoryFacts(
        run,
        None if run.robot_id is None else services.history.expected(run.robot_id, run.mission_guid),
        services.history.replacements([run]).get(run.id),
        sum(services.history.counts(wanted).values()) if like else 0,
    )


def filters_with(instant: datetime, now: datetime, zone: ZoneInfo, period: Period) -> Filters:
    """Only the period; if it doesn't contain that instant, the day of it, which is shown as a filter and can be cleared."""
    start, end = Filters(period).span(now, zone)
    is_within = (start is None or start <= instant) and (end is None or instant < end)
    return Filters(period, day=None if is_within else instant.astimezone(zone).date())
