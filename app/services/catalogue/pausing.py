"""Skip a start, and pause until a day. A skipped start gets its row in the ledger at once, which ends at its planned
instant: so it counts in that day's figures. Starts in a pause get theirs when they fall due, so that the pause can end
at any time.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

from app.domain import rules
from app.domain.clock import MOMENT
from app.domain.execution import Reason, ReasonCode
from app.domain.models import InvalidInput, Mission, Schedule
from app.services.catalogue import change_log, schedule_edit
from app.services.catalogue.catalogue import Catalogue, Edit
from app.services.live.changes import Topic
from app.services.planning.recurrence import next_occurrence

OF_STARTS = (Topic.SCHEDULES, Topic.EXECUTIONS)


class Pausing:
    def __init__(self, catalogue: Catalogue) -> None:
        self._catalogue = catalogue

    def skip(self, schedule_id: int, instant: datetime) -> None:
        """Skip the start planned at that instant (UTC). Raises InvalidInput if it is not planned."""

        def work(edit: Edit) -> None:
            c, now, schedule = edit.c, edit.now, edit.the(Schedule, schedule_id)
            if instant in edit.schedules.skipped(c, schedule_id):
                return
            check_is_to_come(edit, schedule, instant)
            target, mission = edit.target_of(schedule), edit.the(Mission, schedule.mission_id)
            install_id = edit.stored_settings.install_id(c)
            row = rules.scheduled(schedule, target, mission, edit.settings, install_id, instant, now)
            reason = Reason(ReasonCode.HOLD, {"skipped_at": now.isoformat()})
            edit.executions.add_once(c, rules.ended(row, reason, max(instant, now)))
            leave_out(edit, schedule, instant)
            edit.note(f"schedule {schedule.name!r}: the start at {change_log.moment(instant)} is skipped", *OF_STARTS)

        self._catalogue.edit(work)

    def unskip(self, schedule_id: int, instant: datetime, *, must_run: bool = False) -> None:
        """Undo the skip of that start (UTC). Raises InvalidInput if its time has passed, and with ``must_run`` also if
        it still would not run: the schedule is off, paused until then or has another rule now."""

        def work(edit: Edit) -> None:
            schedule = edit.the(Schedule, schedule_id)
            if _has_passed(edit, schedule, instant):
                raise InvalidInput("schedule", "the time of this start has passed")
            if (schedule_id, instant) in edit.schedules.moved_away(edit.c):
                raise InvalidInput("schedule", "this start was moved to another time: move it back")
            if must_run and not schedule.enabled:
                raise InvalidInput("schedule", "this schedule is switched off: switch it on first")
            if must_run and schedule.is_paused(instant):
                raise InvalidInput("schedule", "this schedule is paused beyond that start: resume it first")
            if must_run and next_occurrence(schedule, instant - MOMENT, edit.calendar) != instant:
                raise InvalidInput("schedule", "this schedule no longer has this start")
            schedule_edit.put_back(edit, schedule, instant)
            edit.note(
                f"schedule {schedule.name!r}: the start at {change_log.moment(instant)} is not skipped any more",
                *OF_STARTS,
            )

        self._catalogue.edit(work)

    def pause(self, schedule_id: int, until: datetime) -> Schedule:
        """Skip every start before ``until`` (aware), also waiting ones of the schedule. Raises InvalidInput for a time
        that has passed."""

        def work(edit: Edit) -> Schedule:
            schedule = edit.the(Schedule, schedule_id)
            if until <= edit.now:
                raise InvalidInput("until", "choose a time in the future")
            reason = Reason(ReasonCode.HOLD, {"paused_until": until.isoformat()})
            unsent = edit.unsent_of(edit.with_moved([schedule]))
            edit.withdraw((row for row in unsent if row.planned_at < until), reason)
            return _pause(edit, schedule, until)

        return self._catalogue.edit(work)

    def resume(self, schedule_id: int) -> Schedule:
        """End the pause: the next start runs. What was skipped stays so."""
        return self._catalogue.edit(lambda edit: _pause(edit, edit.the(Schedule, schedule_id), None))


def _pause(edit: Edit, schedule: Schedule, until: datetime | None) -> Schedule:
    for each in edit.with_moved([schedule]):
        edit.schedules.pause(edit.c, each.id, until)
    before, after = map(change_log.shown, (schedule.paused_until, until))
    edit.note(f"schedule {schedule.name!r} changed: paused until {before} → {after}", *OF_STARTS)
    return replace(schedule, paused_until=until)


def check_is_to_come(edit: Edit, schedule: Schedule, instant: datetime) -> None:
    if not schedule.enabled or schedule.next_at is None:
        raise InvalidInput("schedule", "this schedule has no start to skip")
    if instant < schedule.next_at and _has_passed(edit, schedule, instant):
        raise InvalidInput("schedule", "the time of this start has passed")
    after = max(schedule.next_at, instant - MOMENT)
    if instant not in (schedule.next_at, next_occurrence(schedule, after, edit.calendar)):
        raise InvalidInput("schedule", "this schedule no longer has this start")


def _has_passed(edit: Edit, schedule: Schedule, instant: datetime) -> bool:
    """Also if its row already exists just before it."""
    return instant <= edit.now or (schedule.planned_through is not None and instant <= schedule.planned_through)


def leave_out(edit: Edit, schedule: Schedule, at: datetime) -> None:
    """It does not start then."""
    edit.schedules.skip(edit.c, schedule.id, at)
    coming, skipped = schedule.next_at, edit.schedules.skipped(edit.c, schedule.id)
    while coming is not None and coming in skipped:
        coming = next_occurrence(schedule, coming, edit.calendar)
    edit.schedules.advance(edit.c, schedule.id, coming)
