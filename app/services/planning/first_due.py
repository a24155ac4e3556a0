"""When a schedule runs next after it was made, changed or switched on: the one rule that screens, import and settings share."""

from __future__ import annotations

from collections.abc import Collection
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

from app.domain.models import Schedule, Settings
from app.domain.rules import closes_at
from app.services.planning.recurrence import next_occurrence, to_utc
from app.services.planning.working_days import WorkingCalendar

_MOMENT = timedelta(microseconds=1)


def first_due(
    schedule: Schedule, settings: Settings, now: datetime, calendar: WorkingCalendar, skipped: Collection[datetime] = ()
) -> datetime | None:
    """The first instant from ``now`` on (UTC), ``now`` itself included, that was not planned before and that no person has ``skipped``;
    None when it is switched off or none is left.

    Earlier instants write no row, but a one-time start still inside its start window is due at once.
    """
    if not schedule.enabled:
        return None
    through = schedule.planned_through
    if schedule.recurrence is None:
        start = to_utc(schedule.start, ZoneInfo(schedule.timezone))
        is_open = now < closes_at(start, schedule.start_window_minutes, settings)
        return start if is_open and start not in skipped and (through is None or start > through) else None
    after = now - _MOMENT
    at = next_occurrence(schedule, after if through is None else max(after, through), calendar)
    while at is not None and at in skipped:
        at = next_occurrence(schedule, at, calendar)
    return at
