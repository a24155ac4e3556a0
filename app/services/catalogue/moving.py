"""Move one start of a schedule to another time or robot.

In one transaction its schedule skips it and it becomes a one-time schedule, which is changed, paused, switched off and
deleted with the schedule that it is of, and runs only as long as that one has the start. Moved to where it was, it is a
start of its schedule again, so undo is a move too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from zoneinfo import ZoneInfo

from app.domain.clock import MOMENT
from app.domain.models import InvalidInput, Schedule
from app.services.catalogue import change_log, schedule_edit, validation
from app.services.catalogue.catalogue import Catalogue, Edit
from app.services.catalogue.pausing import OF_STARTS, check_is_to_come, leave_out
from app.services.planning.recurrence import next_occurrence, to_utc


@dataclass(frozen=True)
class Moved:
    """A start that was moved: the schedule whose start it was, and its instant there (UTC); those that it has now."""

    before: Schedule
    was_at: datetime
    after: Schedule
    at: datetime


class Moving:
    def __init__(self, catalogue: Catalogue) -> None:
        self._catalogue = catalogue

    def move(
        self,
        schedule_id: int,
        instant: datetime,
        to: datetime,
        *,
        robot_id: int | None = None,
        group_id: int | None = None,
        any_day: bool = False,
    ) -> Moved:
        """Move the start planned at ``instant`` (UTC) to ``to``, a wall-clock time in the schedule's zone; without a
        robot or group it stays on its own. Also one that was moved before, and that of a one-time schedule, which is
        changed. ``any_day``: it may be no working day. Raises InvalidInput if the start is no longer to come there, or
        can't be then."""
        return self._catalogue.edit(
            lambda edit: _move(edit, schedule_id, instant, to, robot_id, group_id, any_day=any_day)
        )

    def draft(
        self,
        schedule_id: int,
        instant: datetime,
        to: datetime,
        *,
        robot_id: int | None = None,
        group_id: int | None = None,
    ) -> Schedule:
        """As ``move`` would write it, for the preview of ``Forecasts``. Raises InvalidInput if there is no such schedule."""
        return self._catalogue.edit(lambda edit: _moved(*_read(edit, schedule_id), instant, to, robot_id, group_id))

    def undo(self, moved: Moved) -> Moved:
        """Back to where it was; on a robot that was chosen since it stays there. Raises InvalidInput if that time has
        passed, or the start is no longer where it was moved to."""

        def work(edit: Edit) -> Moved:
            if moved.was_at <= edit.now:
                raise InvalidInput("schedule", "the time of this start has passed")
            is_single = moved.before.recurrence is None
            before = moved.before if is_single else edit.the(Schedule, moved.before.id)
            to, target = _local(moved.was_at, before), _target(edit.the(Schedule, moved.after.id))
            if _target(moved.before) != _target(moved.after):
                if target != _target(moved.after):
                    raise InvalidInput("schedule", "its schedule has been changed since")
                target = _target(before)
            respects = moved.before.respect_working_days if is_single else None
            return _move(edit, moved.after.id, moved.at, to, *target, any_day=True, respects=respects)

        return self._catalogue.edit(work)


def _move(
    edit: Edit,
    schedule_id: int,
    instant: datetime,
    to: datetime,
    robot_id: int | None,
    group_id: int | None,
    *,
    any_day: bool,
    respects: bool | None = None,
) -> Moved:
    """``respects``: whether a one-time schedule avoids days off from now on; None: as it does."""
    shown, whole = _read(edit, schedule_id)
    _check_can_be_moved(edit, shown, instant)
    changed = _moved(shown, whole, instant, to, robot_id, group_id)
    _check_can_be_then(edit, whole, changed, any_day=any_day)
    is_held = (shown.id, instant) in edit.schedules.skips(edit.c, [shown.id], held=True)
    after = _save(edit, shown, whole, changed, instant, whole.respect_working_days if respects is None else respects)
    at = changed.moved_from or instant if after is whole and whole.recurrence is not None else _instant(after)
    if is_held:
        if shown.recurrence is None:
            edit.schedules.unskip(edit.c, shown.id, instant)
        edit.schedules.hold(edit.c, after.id, at)
    moved = f"the start at {change_log.moment(instant)} is moved to {change_log.moment(at)}"
    edit.note(f"schedule {whole.name!r}: {moved} on {edit.target_of(changed).name!r}", *OF_STARTS)
    return Moved(shown, instant, after, at)


def _read(edit: Edit, schedule_id: int) -> tuple[Schedule, Schedule]:
    """The schedule that the start is planned by, and the one that it is of."""
    shown = edit.the(Schedule, schedule_id)
    return shown, shown if shown.moved_of is None else edit.the(Schedule, shown.moved_of)


def _moved(
    shown: Schedule, whole: Schedule, instant: datetime, to: datetime, robot_id: int | None, group_id: int | None
) -> Schedule:
    if robot_id is None and group_id is None:
        robot_id, group_id = shown.robot_id, shown.group_id
    moved = schedule_edit.moved_start(whole, shown.moved_from or instant, to, robot_id, group_id)
    return moved if shown.recurrence is not None else replace(moved, id=shown.id)


def _check_can_be_moved(edit: Edit, shown: Schedule, instant: datetime) -> None:
    if not shown.enabled:
        raise InvalidInput("schedule", "this schedule is switched off: switch it on first")
    if instant in edit.schedules.skipped(edit.c, shown.id):
        raise InvalidInput("schedule", "this start is skipped or was moved already")
    if shown.next_at is None:
        raise InvalidInput("schedule", "the time of this start has passed")
    check_is_to_come(edit, shown, instant)


def _check_can_be_then(edit: Edit, whole: Schedule, changed: Schedule, *, any_day: bool) -> None:
    at = _instant(changed)
    if at <= edit.now:
        raise InvalidInput("start", "choose a time in the future")
    if whole.is_paused(at):
        raise InvalidInput("schedule", "this schedule is paused beyond that start: resume it first")
    respects = whole.respect_working_days and not any_day
    validation.one_time_on_working_day(replace(changed, respect_working_days=respects), edit.calendar)


def _save(
    edit: Edit, shown: Schedule, whole: Schedule, changed: Schedule, instant: datetime, respects: bool
) -> Schedule:
    """Returns the schedule whose start it is now."""
    if _is_where_it_was(edit, whole, changed):
        if shown is not whole:
            edit.schedules.drop_moved(edit.c, shown.id)
            schedule_edit.put_back(edit, whole, changed.moved_from or instant)
        return whole
    if whole.recurrence is None:
        respects = respects and edit.calendar.is_working_day(changed.start.date())
        return schedule_edit.save(edit, replace(changed, moved_of=None, moved_from=None, respect_working_days=respects))
    if shown is whole:
        leave_out(edit, whole, instant)
    return schedule_edit.save(edit, replace(changed, respect_working_days=False))


def _is_where_it_was(edit: Edit, whole: Schedule, changed: Schedule) -> bool:
    """And its schedule has it: its day may have been closed since."""
    was = changed.moved_from or edit.now
    return (
        changed.start == _local(was, whole)
        and _target(changed) == _target(whole)
        and next_occurrence(whole, was - MOMENT, edit.calendar) == was
    )


def _target(schedule: Schedule) -> tuple[int | None, int | None]:
    return schedule.robot_id, schedule.group_id


def _local(instant: datetime, schedule: Schedule) -> datetime:
    return instant.astimezone(ZoneInfo(schedule.timezone)).replace(tzinfo=None)


def _instant(once: Schedule) -> datetime:
    return to_utc(once.start, ZoneInfo(once.timezone))
