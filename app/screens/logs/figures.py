"""The figures of a period as read from the services: the five of the cards, their history day by day, and those of the page of figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, timedelta
from zoneinfo import ZoneInfo

from app.domain.clock import midnight
from app.screens.common.name_order import by_name
from app.screens.logs.facts import LogsServices
from app.screens.logs.view import Filters, period_start
from app.services.history.group_kpi import GroupKpis
from app.services.history.kpi import Adherence, DayKpis, Delays, KpiFilter, ThesisKpis
from app.services.history.pareto import Cause
from app.services.planning.durations import Trend

DAY = timedelta(days=1)
SHORTEST_HISTORY, LONGEST_HISTORY = 7, 30  # days


@dataclass(frozen=True)
class Earlier:
    """The same figures of as many days before, until the same time of day."""

    thesis: ThesisKpis
    adherence: Adherence


@dataclass(frozen=True)
class Figures:
    """``days`` runs up to today without gaps; ``adherence_days`` and ``utilisation_days`` belong to them, None where there is nothing."""

    thesis: ThesisKpis
    adherence: Adherence
    delays: Delays
    days: Sequence[DayKpis] = ()
    adherence_days: Sequence[float | None] = ()
    utilisation_days: Sequence[float | None] = ()
    first_day: date | None = None  # of the period; None: from the beginning
    last_day: date | None = None
    kept_since: date | None = None  # day of the first run that is known; None: there is none
    earlier: Earlier | None = None  # None: the history does not reach so far back
    group: str = ""  # whose runs they are; what its robots did is all that they did


@dataclass(frozen=True)
class MoreFigures:
    """What the page of figures has beside those of the cards."""

    causes: Sequence[Cause] = ()
    trends: Sequence[Trend] = ()
    groups: Sequence[GroupKpis] = ()


def read_figures(services: LogsServices, filters: Filters, now: datetime, zone: ZoneInfo) -> Figures:
    """Called off the UI thread."""
    kpis, wanted = services.kpis, _kpi_filter(filters, now, zone)
    thesis = kpis.thesis(wanted)
    thesis = replace(thesis, robots=by_name(thesis.robots, "robot"))
    today = now.astimezone(zone).date()
    count = min(LONGEST_HISTORY, max(SHORTEST_HISTORY, filters.period.days or LONGEST_HISTORY))
    kept_since = kpis.kept_since()
    kept_day = kept_since.astimezone(zone).date() if kept_since else None
    dates = [today - back * DAY for back in range(count - 1, -1, -1)]
    known = {day.day: day for day in kpis.per_day(replace(wanted, start=midnight(dates[0], zone)))}
    return Figures(
        thesis,
        kpis.adherence(wanted),
        kpis.delays(wanted),
        [known.get(day) or DayKpis(day) for day in dates],
        [
            kpis.adherence(replace(wanted, start=midnight(day, zone), end=midnight(day + DAY, zone))).rate
            for day in dates
        ],
        _utilisation_by_day(services, filters, dates, zone),
        first_day=wanted.start.astimezone(zone).date() if wanted.start else None,
        last_day=today,
        kept_since=kept_day,
        earlier=_earlier(services, filters, now, zone, kept_day),
        group=wanted.group or "",
    )


def _earlier(
    services: LogsServices, filters: Filters, now: datetime, zone: ZoneInfo, kept_day: date | None
) -> Earlier | None:
    days = filters.period.days
    if days is None or kept_day is None or (first := now.astimezone(zone).date() - (2 * days - 1) * DAY) < kept_day:
        return None
    end = (now.astimezone(zone) - days * DAY).astimezone(UTC)  # the same time on the clock
    before = replace(_kpi_filter(filters, now, zone), start=midnight(first, zone), end=end)
    return Earlier(services.kpis.thesis(before), services.kpis.adherence(before))


def read_more_figures(services: LogsServices, filters: Filters, now: datetime, zone: ZoneInfo) -> MoreFigures:
    """Called off the UI thread."""
    wanted = _kpi_filter(filters, now, zone)
    groups = services.group_figures.of(wanted, services.kpis.thesis(wanted).robots)
    return MoreFigures(services.kpis.failures(wanted), services.kpis.trends(wanted), groups)


def _kpi_filter(filters: Filters, now: datetime, zone: ZoneInfo) -> KpiFilter:
    return KpiFilter(
        period_start(filters.period, now, zone),
        robot_ids=filters.robot_ids,
        group=filters.group.name if filters.group else None,
    )


def _utilisation_by_day(
    services: LogsServices, filters: Filters, dates: Sequence[date], zone: ZoneInfo
) -> list[float | None]:
    """Mission seconds ÷ observed seconds of the robots together; None for a day on which none was observed."""
    seen = services.kpis.observed_seconds(dates[0], dates[-1], zone)
    robots = tuple(robot for robot in seen if filters.robot_ids is None or robot in filters.robot_ids)
    mission_s = {
        day.day: day.mission_s for day in services.kpis.per_day(KpiFilter(midnight(dates[0], zone), robot_ids=robots))
    }
    observed_s = {day: sum(seen[robot].get(day, 0.0) for robot in robots) for day in dates}
    return [min(1.0, mission_s.get(day, 0.0) / observed_s[day]) if observed_s[day] else None for day in dates]
