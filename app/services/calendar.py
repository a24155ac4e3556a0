"""On which days work is done."""
from __future__ import annotations

from datetime import date

from app.models import WEEKDAYS, Settings


class WorkingCalendar:
    """Answers for any local date whether a schedule that respects working days may run on it."""

    def __init__(self, settings: Settings) -> None:
        self._weekdays = frozenset(WEEKDAYS.index(name) for name in settings.working_days)

    def is_working_day(self, day: date) -> bool:
        return day.weekday() in self._weekdays
