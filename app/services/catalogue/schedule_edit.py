"""Schedules: the part of a change of the plan that is about them.

Every function raises InvalidInput before it has written anything.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta

from app.domain import names
from app.domain.clock import MOMENT
from app.domain.execution import State
from app.domain.models import Group, InvalidInput, Mission, Overlap, Robot, Schedule
from app.domain.rules import token_of
from app.services.catalogue import change_log, checks, validation
from app.services.catalogue.edit import Edit, Removed
from app.services.catalogue.validation import check_name_is_free
from app.services.executions import transitions
from app.services.executions.transitions import Event, Transition
from app.services.executions.wanted import as_defined, has_start
from app.services.live.changes import Topic
from app.services.planning.planned import first_due
from app.services.planning.recurrence import next_occurrence, passed_occurrences

NOTED = ("next_at", "paused_until", "planned_through", "started_through")  # by the app itself on a schedule
NOT_THE_RULE = {"id", "changed_at", *NOTED}
_FAR = timedelta(days=366)  # a rule that has ended is not searched further back


def next_due(edit: Edit, schedule: Schedule) -> datetime | None:
    """The next instant, without those already planned or skipped in advance."""
    return first_due(schedule, edit.settings, edit.now, edit.calendar, edit.schedules.skipped(edit.c, schedule.id))


def put_back(edit: Edit, schedule: Schedule, at: datetime) -> None:
    """It starts then after all."""
    edit.schedules.unskip(edit.c, schedule.id, at)
    edit.executions.drop_skipped(edit.c, schedule.id, at)
    if edit.executions.has_instant(edit.c, schedule.id, at):
        raise InvalidInput("schedule", "this start may have been sent already")
    if schedule.next_at is None or at < schedule.next_at:  # else a start due just now would be passed over
        edit.schedules.advance(edit.c, schedule.id, next_due(edit, schedule))


def save(edit: Edit, schedule: Schedule) -> Schedule:
    """Add (id 0) or change. A blank name becomes "<mission> on <robot>". Waiting starts of a changed schedule
    follow the change if their robot or group and their instant stay, otherwise they are cancelled; instants before
    now write no row; an unchanged schedule stays untouched."""
    stored = edit.the(Schedule, schedule.id) if schedule.id else None
    target = edit.target_of(schedule)
    mission = edit.mission_for(target, schedule.mission_id)
    schedule = replace(schedule, mission_id=mission.id, name=_name(edit, schedule, stored, target, mission))
    if stored is not None and _rule(schedule) == _rule(stored):
        return stored
    schedule = validation.schedule(schedule)
    if stored is not None and _rule(schedule) == _rule(stored):
        return stored
    validation.one_time_on_working_day(schedule, edit.calendar)
    schedule = replace(schedule, changed_at=edit.now)
    if stored is None:
        if schedule.moved_of is None:
            edit.notes.append(f"schedule {schedule.name!r} added")
        schedule = edit.schedules.add(edit.c, replace(schedule, next_at=next_due(edit, schedule)))
    else:
        was_on, ran = edit.target_of(stored), edit.the(Mission, stored.mission_id)
        changed = change_log.differences(
            change_log.of_schedule(stored, was_on, ran), change_log.of_schedule(schedule, target, mission)
        )
        edit.notes.append(f"schedule {stored.name!r} changed: {changed}")
        schedule = _replan(edit, stored, schedule)
        edit.schedules.update(edit.c, schedule)
        change_waiting(edit, schedule, mission)
        _choose_again(edit, schedule)
        _change_moved(edit, stored, schedule)
    edit.topics.add(Topic.SCHEDULES)
    return schedule


def moved_start(
    schedule: Schedule, instant: datetime, to: datetime, robot_id: int | None, group_id: int | None
) -> Schedule:
    """The start of that instant (UTC) as a one-time schedule at another time (naive, of the schedule's zone), on that
    robot or group; otherwise as its schedule is defined."""
    is_of_group = group_id is not None
    return replace(
        schedule,
        id=0,
        start=to,
        recurrence=None,
        between=None,
        robot_id=robot_id,
        group_id=group_id,
        finish_by_minutes=schedule.finish_by_minutes if is_of_group else None,
        overlap=schedule.overlap if is_of_group else Overlap.SKIP,
        planned_through=None,
        started_through=None,
        moved_of=schedule.id,
        moved_from=instant,
    )


def _change_moved(edit: Edit, was: Schedule, schedule: Schedule) -> None:
    """Its moved starts are as it is defined now; those that it no longer has don't run, unless it has them again."""
    for moved in edit.schedules.moved_starts(edit.c, schedule.id):
        has_own = (moved.robot_id, moved.group_id) != (was.robot_id, was.group_id)
        robot_id, group_id = (moved if has_own else schedule).robot_id, (moved if has_own else schedule).group_id
        instant = moved.moved_from or edit.now
        changed = moved_start(schedule, instant, moved.start, robot_id, group_id)
        is_planned = schedule.enabled and _nearest(edit, schedule, instant) == instant
        save(edit, replace(changed, id=moved.id, enabled=is_planned, respect_working_days=False))


def replan_outdated(edit: Edit) -> int:
    """At a start: starts planned by other rules (of an older version) or with other zone data are planned again,
    each moved to the nearest new instant. Returns the number of schedules."""
    outdated = [
        schedule
        for schedule in edit.schedules.all(edit.c)
        if schedule.next_at is not None and _nearest(edit, schedule, schedule.next_at) != schedule.next_at
    ]
    for schedule in outdated:
        _move_skips(edit, schedule)
        through = schedule.planned_through and _nearest(edit, schedule, schedule.planned_through)
        edit.schedules.advance(
            edit.c,
            schedule.id,
            first_due(
                replace(schedule, planned_through=through),
                edit.settings,
                schedule.changed_at or edit.now,
                edit.calendar,
                edit.schedules.skipped(edit.c, schedule.id),
            ),
        )
        edit.topics |= {Topic.SCHEDULES, Topic.EXECUTIONS}
    return len(outdated)


def _nearest(edit: Edit, schedule: Schedule, at: datetime) -> datetime:
    """The instant of the schedule nearest to ``at``, which may be one itself. Ignores working days: a start stays due if its day was
    closed later."""
    schedule = replace(schedule, respect_working_days=False)
    following = next_occurrence(schedule, at - MOMENT, edit.calendar)
    if following == at:
        return at
    reach = _FAR if following is None else min(following - at, _FAR)
    return passed_occurrences(schedule, at - reach, at, edit.calendar).last or following or at


def _move_skips(edit: Edit, schedule: Schedule) -> None:
    """Future starts that a person skipped or holds stay so at their new instants."""
    through = schedule.planned_through
    for held in (False, True):
        for _id, old in edit.schedules.skips(edit.c, [schedule.id], held=held):
            new = _nearest(edit, schedule, old)
            if new == old or (through is not None and old <= through):
                continue
            edit.schedules.unskip(edit.c, schedule.id, old)
            edit.schedules.move_original(edit.c, schedule.id, old, new)
            if held:
                edit.schedules.hold(edit.c, schedule.id, new)
            else:
                edit.schedules.skip(edit.c, schedule.id, new)
                _move_skipped_row(edit, schedule, old, new)


def _move_skipped_row(edit: Edit, schedule: Schedule, old: datetime, new: datetime) -> None:
    install_id = edit.stored_settings.install_id(edit.c)
    row = edit.executions.by_token(edit.c, token_of(install_id, schedule.id, old))
    if row is not None and row.ended_at is not None and not edit.executions.has_instant(edit.c, schedule.id, new):
        moved = {
            "planned_at": new,
            "ended_at": row.ended_at + (new - old),
            "closes_at": row.closes_at + (new - old),
            "finish_by": row.finish_by and row.finish_by + (new - old),
            "token": token_of(install_id, schedule.id, new),
        }
        edit.apply([Transition(Event.MOVE, row, moved)])


def _replan(edit: Edit, stored: Schedule, schedule: Schedule) -> Schedule:
    """Compute its next instant and withdraw waiting starts of instants that it no longer has; neither if only the
    way it runs was changed."""
    schedule = replace(schedule, **{name: getattr(stored, name) for name in NOTED})
    if when(schedule) == when(stored):
        return schedule
    kept = [row for row in edit.unsent_of([schedule]) if has_start(row, schedule, edit.settings, edit.calendar)]
    edit.apply(transitions.want_again(row) for row in kept)
    was = "changed" if schedule.enabled or schedule.moved_of is not None else "switched_off"
    withdrawn = [
        row for row in edit.withdraw_all(stored, was, {row.id for row in kept}) if row.was_never_sent and not row.held
    ]
    if withdrawn:  # never sent: as if they had never been planned
        instants, begun = {row.planned_at for row in withdrawn}, schedule.started_through
        last = max((row.planned_at for row in kept), default=min(instants) - MOMENT)
        if begun is not None and begun not in instants:  # of another one, later by a clock that has been set back
            last = max(last, begun)
        schedule = replace(schedule, planned_through=last)
    schedule = replace(schedule, next_at=next_due(edit, schedule))
    if schedule.next_at is not None:
        edit.executions.drop_withdrawn(edit.c, schedule.id, schedule.next_at)
    return schedule


def change_waiting(edit: Edit, schedule: Schedule, mission: Mission) -> None:
    """Waiting starts take over the schedule's new values; starts being sent are checked against them when they are
    sent (``wanted``)."""
    for row in edit.unsent_of([schedule]):
        columns = as_defined(edit.c, row, schedule, mission, edit.settings)
        if row.state is State.SUBMITTING:
            columns = {
                name: value for name, value in columns.items() if name == "closes_at"
            }  # how long it is looked for
        edit.apply([transitions.redefine(row, **columns)])


def _choose_again(edit: Edit, schedule: Schedule) -> None:
    """Choose the robot of its group again for a waiting start, before its other values are updated."""
    for row in edit.unsent_of([schedule]) if schedule.group_id is not None else ():
        if row.state is State.WAITING:
            edit.apply([transitions.redefine(row, priority=schedule.priority), transitions.unassign(row)])


def update_waiting(edit: Edit, mission_id: int | None = None) -> None:
    """Update the waiting starts of a mission that was changed, or all because settings were."""
    for schedule in edit.schedules.with_unsent(edit.c, mission_id):
        change_waiting(edit, schedule, edit.the(Mission, schedule.mission_id))


def _rule(schedule: Schedule) -> dict[str, object]:
    """The schedule without what the app itself notes on it."""
    return {name: value for name, value in vars(schedule).items() if name not in NOT_THE_RULE}


def _name(edit: Edit, schedule: Schedule, stored: Schedule | None, target: Robot | Group, mission: Mission) -> str:
    if schedule.moved_of is not None:
        return schedule.name
    if not schedule.name.strip():
        is_generated = stored is not None and names.is_generated(stored.name, mission.name, target.name)
        return stored.name if stored is not None and is_generated else free_name(edit, mission.name, target.name)
    name = checks.name(schedule.name)
    check_name_is_free(edit.schedules.by_name(edit.c, name), schedule.id, "there is a schedule {name} already")
    return name


def free_name(edit: Edit, mission: str, robot: str) -> str:
    """The first free name: each one is tried once in a transaction, however many schedules need one."""
    untried = edit.untried_names.setdefault((mission, robot), names.generated(mission, robot))
    return next(name for name in untried if edit.schedules.by_name(edit.c, name) is None)


def remove(edit: Edit, schedule_id: int) -> Removed:
    """Takes effect at once; waiting starts are cancelled, running ones continue, history stays."""
    schedule = edit.the(Schedule, schedule_id)
    schedules = edit.with_moved([schedule])
    starts = edit.end_starts_of(schedules)
    edit.note(f"schedule {schedule.name!r} removed", Topic.SCHEDULES)
    return edit.hide(Removed(edit.now, {}, starts=starts), [schedule])


def when(schedule: Schedule) -> tuple[object, ...]:
    """The values that determine its instants and its robot."""
    return (
        schedule.start,
        schedule.timezone,
        schedule.recurrence,
        schedule.between,
        schedule.respect_working_days,
        schedule.enabled,
        schedule.robot_id,
        schedule.group_id,
    )
