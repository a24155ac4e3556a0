"""When a schedule runs next after it was made, changed or switched on: the one rule that screens, import and settings share."""
from __future__ import annotations

from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

from app.domain.models import Schedule, Settings
from app.domain.rules import closes_at
from app.services.planning.recurrence import next_occurrence, to_utc
from app.services.planning.working_days import WorkingCalendar

_MOMENT = timedelta(microseconds=1)


def first_due(schedule: Schedule, settings: Settings, now: datetime, calendar: WorkingCalendar) -> datetime | None:
    """The first instant from ``now`` on (UTC), ``now`` itself included; None when it is switched off or none is left.

    Earlier instants write no row, but a one-time start still inside its start window is due at once.
    """
    if not schedule.enabled:
        return None
    if schedule.recurrence is None:
        start = to_utc(schedule.start, ZoneInfo(schedule.timezone))
        return start if now < closes_at(start, schedule.start_window_minutes, settings) else None
    return next_occurrence(schedule, now - _MOMENT, calendar)
