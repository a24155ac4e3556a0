"""The figures of a period as read from the services: the five of the cards, day by day, and what else the page of figures shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime
from zoneinfo import ZoneInfo

from app.domain.clock import DAY, midnight
from app.screens.common.name_order import by_name
from app.screens.logs.facts import LogsServices
from app.screens.logs.view import Filters
from app.services.history.figures import Cause, Delays, Facts, GroupFacts
from app.services.history.kpis import KpiFilter
from app.services.planning.durations import Trend

SHORTEST_HISTORY, LONGEST_HISTORY = 7, 30  # days


@dataclass(frozen=True)
class Figures:
    """``facts`` of the period; ``days`` runs up to today without gaps, ``before`` are as many days before them."""

    facts: Facts = field(default_factory=Facts)
    delays: Delays = field(default_factory=Delays)
    days: Sequence[Facts] = ()
    before: Sequence[Facts] = ()
    first_day: date | None = None  # of the period; None: from the beginning
    last_day: date | None = None
    kept_since: date | None = None  # day of the first known run; None without runs
    earlier: Facts | None = (
        None  # of the same number of days before, until the same time of day; None: the history is too short
    )
    group: str = ""  # the group of the runs; its robots' activity includes all their work
    causes: Sequence[Cause] = ()
    trends: Sequence[Trend] = ()
    groups: Sequence[GroupFacts] = ()


def read_figures(services: LogsServices, filters: Filters, now: datetime, zone: ZoneInfo) -> Figures:
    """Called off the UI thread."""
    kpis, wanted = services.kpis, _kpi_filter(filters, now, zone)
    facts = kpis.facts(wanted)
    today = now.astimezone(zone).date()
    count = min(LONGEST_HISTORY, max(SHORTEST_HISTORY, filters.period.days or LONGEST_HISTORY))
    kept_since = kpis.kept_since()
    kept_day = kept_since.astimezone(zone).date() if kept_since else None
    earlier = _earlier(services, filters, now, zone, kept_day)
    dates = [today - back * DAY for back in range(count * (2 if earlier else 1) - 1, -1, -1)]
    days = kpis.per_day(replace(wanted, start=None), dates)
    return Figures(
        replace(facts, robots=by_name(facts.robots, "robot")),
        kpis.delays(wanted),
        days[-count:],
        days[:-count],
        first_day=wanted.start.astimezone(zone).date() if wanted.start else None,
        last_day=today,
        kept_since=kept_day,
        earlier=earlier,
        group=wanted.group or "",
        causes=kpis.failures(wanted),
        trends=kpis.trends(wanted),
        groups=kpis.groups(wanted, facts.robots),
    )


def _earlier(
    services: LogsServices, filters: Filters, now: datetime, zone: ZoneInfo, kept_day: date | None
) -> Facts | None:
    days = filters.period.days
    if days is None or kept_day is None or (first := now.astimezone(zone).date() - (2 * days - 1) * DAY) < kept_day:
        return None
    end = (now.astimezone(zone) - days * DAY).astimezone(UTC)  # the same time on the clock
    return services.kpis.facts(replace(_kpi_filter(filters, now, zone), start=midnight(first, zone), end=end))


def _kpi_filter(filters: Filters, now: datetime, zone: ZoneInfo) -> KpiFilter:
    """Of the period, whatever day of it the list is narrowed to."""
    return KpiFilter(
        replace(filters, day=None).span(now, zone)[0],
        robot_ids=filters.robot_ids,
        group=filters.group.name if filters.group else None,
    )
