"""The figures of a period as read from the services: the thesis's five, adherence, their history day by day."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date, datetime, timedelta
from typing import TYPE_CHECKING
from zoneinfo import ZoneInfo

from app.domain.clock import midnight
from app.domain.models import Robot
from app.screens.logs.view import Chosen, period_start
from app.services.history.kpi import Adherence, DayKpis, Delays, KpiFilter, ThesisKpis
from app.services.history.pareto import Cause
from app.services.planning.durations import Trend

if TYPE_CHECKING:
    from app.container import Container

SHORTEST_HISTORY, LONGEST_HISTORY = 7, 30        # days


@dataclass(frozen=True)
class Figures:
    """``days`` runs up to today without gaps; ``adherence_days`` and ``utilisation_days`` belong to them, None where there is nothing."""
    thesis: ThesisKpis
    everyone: ThesisKpis                         # of all robots, for the comparison
    adherence: Adherence
    delays: Delays
    days: Sequence[DayKpis] = ()
    adherence_days: Sequence[float | None] = ()
    utilisation_days: Sequence[float | None] = ()
    charging_s: Mapping[int, float] = field(default_factory=dict)
    robot: Robot | None = None                   # whose utilisation is shown
    first_day: date | None = None                # of the period; None: from the beginning
    last_day: date | None = None


@dataclass(frozen=True)
class MoreFigures:
    """What the page of figures has beside those of the cards."""
    causes: Sequence[Cause] = ()
    trends: Sequence[Trend] = ()


def read(container: Container, chosen: Chosen, robot: Robot | None, now: datetime, zone: ZoneInfo) -> Figures:
    """Called off the UI thread. ``robot`` is the selected one; a chosen one goes before it."""
    start = period_start(chosen.period, now, zone)
    robots = None if chosen.robot_id is None else (chosen.robot_id,)
    wanted = KpiFilter(start=start, robot_ids=robots)
    thesis = container.kpis.thesis(wanted)
    today = now.astimezone(zone).date()
    count = min(LONGEST_HISTORY, max(SHORTEST_HISTORY, chosen.period.days or LONGEST_HISTORY))
    dates = [today - timedelta(days=back) for back in range(count - 1, -1, -1)]
    first = midnight(dates[0], zone)
    known = {day.day: day for day in container.kpis.per_day(KpiFilter(start=first, robot_ids=robots))}
    seen = container.kpis.observed_seconds(dates[0], today, zone)
    everyone = thesis if robots is None else container.kpis.thesis(KpiFilter(start=start))
    return Figures(
        thesis, everyone, container.kpis.adherence(wanted),
        container.kpis.delays(wanted), [known.get(day) or DayKpis(day) for day in dates],
        [_adherence_of(container, day, robots, zone) for day in dates],
        [] if robot is None else _utilisation_of(container, robot, dates, first, seen),
        {one.robot_id: one.charging_s for one in everyone.robots}, robot,
        first_day=start.astimezone(zone).date() if start else None, last_day=today)


def read_more(container: Container, chosen: Chosen, now: datetime, zone: ZoneInfo) -> MoreFigures:
    """Called off the UI thread."""
    wanted = KpiFilter(start=period_start(chosen.period, now, zone), robot_ids=None if chosen.robot_id is None else (chosen.robot_id,))
    return MoreFigures(container.kpis.failures(wanted), container.kpis.trends(wanted))


def _adherence_of(container: Container, day: date, robots: tuple[int, ...] | None, zone: ZoneInfo) -> float | None:
    return container.kpis.adherence(KpiFilter(midnight(day, zone), midnight(day + timedelta(days=1), zone), robots)).rate


def _utilisation_of(container: Container, robot: Robot, dates: Sequence[date], first: datetime,
                    seen: Mapping[int, Mapping[date, float]]) -> list[float | None]:
    """Mission seconds ÷ observed seconds, day by day."""
    mission_s = {day.day: day.mission_s for day in container.kpis.per_day(KpiFilter(start=first, robot_ids=(robot.id,)))}
    observed_s = seen.get(robot.id, {})
    return [min(1.0, mission_s.get(day, 0.0) / observed_s[day]) if day in observed_s else None for day in dates]
