"""Settings and the calendar: the part of a change of the plan that is about them.

Every function raises InvalidInput before it has written anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from app.domain.models import DayException, InvalidInput, Settings
from app.services.catalogue import change_log, schedule_edit, validation, zones
from app.services.catalogue.edit import Edit, Removed
from app.services.live.changes import Topic
from app.services.planning import public_holidays

_NO_NEWS = frozenset({"selected_robot_id"})  # settings that change whenever somebody looks at another robot


def change(edit: Edit, **changes: Any) -> Settings:
    """When working days change, the next occurrences of schedules that respect them are recomputed."""
    before, changes = edit.settings, validation.settings(changes)
    changed = replace(before, **changes)
    if "timezone" in changes:
        zones.was_chosen(edit)
    if _days_off(changed)[1:] != _days_off(before)[1:]:
        public_holidays.check(changed.holiday_country, changed.holiday_subdivision)
    changes = {
        name: value
        for name, value in changes.items()
        if value != getattr(before, name) or not edit.stored_settings.is_stored(edit.c, name)
    }
    if changes:
        edit.settings = edit.stored_settings.save(edit.c, **changes)
        edit.topics.add(Topic.SETTINGS)
        wanted = sorted(changes.keys() - _NO_NEWS)
        if line := change_log.differences(change_log.parts(before, wanted), change_log.parts(edit.settings, wanted)):
            edit.notes.append(f"settings changed: {line}")
    if _days_off(edit.settings) != _days_off(before):
        _replan_schedules(edit)
    if _of_starts(edit.settings) != _of_starts(before):
        schedule_edit.update_waiting(edit)
    return edit.settings


def _replan_schedules(edit: Edit) -> None:
    """Due starts stay due; a one-time schedule ignores working days."""
    edit.known_calendar = None
    for schedule in edit.schedules.all(edit.c):
        is_due = schedule.next_at is not None and schedule.next_at <= edit.now
        if schedule.respect_working_days and schedule.recurrence is not None and not is_due:
            next_at = schedule_edit.next_due(edit, schedule)
            if next_at != schedule.next_at:
                edit.schedules.advance(edit.c, schedule.id, next_at)
    edit.schedules.days_changed(edit.c, edit.now)
    edit.topics.add(Topic.SCHEDULES)


def save_days(edit: Edit, exceptions: Sequence[DayException]) -> list[DayException]:
    """Add (id 0) or change exceptions to the working days; the next occurrences of schedules that respect them are recomputed."""
    exceptions = [validation.day_exception(exception) for exception in exceptions]
    before = {exception.id: edit.the(DayException, exception.id) for exception in exceptions if exception.id}
    if edit.days.count(edit.c) + sum(not exception.id for exception in exceptions) > validation.MOST_DAY_EXCEPTIONS:
        raise InvalidInput("days", "the calendar has room for {most} entries", most=validation.MOST_DAY_EXCEPTIONS)
    saved = []
    for exception in exceptions:
        if stored := before.get(exception.id):
            edit.days.update(edit.c, exception)
            saved.append(exception)
            if stored != exception:
                edit.notes.append(f"{change_log.days(stored)} → {change_log.days(exception)}")
        else:
            saved.append(edit.days.add(edit.c, exception))
            edit.notes.append(f"{change_log.days(exception)} added")
    days_changed(edit)
    return saved


def remove_days(edit: Edit, ids: Sequence[int]) -> Removed:
    """Those of them that are still there."""
    days = edit.days.by_ids(edit.c, ids)
    edit.notes += [f"{change_log.days(day)} removed" for day in days.values()]
    removed = edit.hide(Removed(edit.now, {DayException: list(days)}))
    days_changed(edit)
    return removed


def days_changed(edit: Edit) -> None:
    edit.topics.add(Topic.CALENDAR)
    _replan_schedules(edit)


def _of_starts(settings: Settings) -> tuple[object, ...]:
    """The default settings for starts whose schedule has no own ones."""
    return settings.start_window_minutes, settings.minimum_battery_percent


def _days_off(settings: Settings) -> tuple[object, ...]:
    """The settings that decide which days are working days."""
    return settings.working_days, settings.holiday_country, settings.holiday_subdivision
