"""The rule of a schedule in words, in the present language."""
from __future__ import annotations

from dataclasses import replace

from app.domain import rules
from app.domain.models import Schedule, Settings
from app.i18n import _
from app.screens.common import formats
from app.services.planning import sentences
from app.services.planning.working_days import WorkingCalendar

NO_BREAK = "\N{NO-BREAK SPACE}"


def rule_line(schedule: Schedule) -> str:
    """When it starts, for a row of a list."""
    return _when(replace(schedule, respect_working_days=False))


def rule_sentence(schedule: Schedule, settings: Settings, calendar: WorkingCalendar | None = None) -> str:
    """When it starts and under which conditions."""
    minimum, when = rules.minimum_battery(schedule, settings), _when(schedule)
    if calendar is not None and calendar.has_exceptions and schedule.respect_working_days and schedule.recurrence is not None:
        when = _("{rule}, not on holidays or other days off").format(rule=rule_line(schedule))
    if minimum is None:
        return when
    condition = _("if battery ≥ {percent}").format(percent=formats.percent(minimum))
    return f"{when}, {condition.replace('≥ ', f'≥{NO_BREAK}').replace(' %', f'{NO_BREAK}%')}"


def _when(schedule: Schedule) -> str:
    if schedule.recurrence is None:
        return _("Once on {day} at {time}").format(day=formats.wall_day(schedule.start.date(), year=True),
                                                   time=formats.wall_time(schedule.start))
    return sentences.sentence(schedule, _)
