"""Changes of single fields; undoing them, any change of a schedule, a deletion, and the cancellation of a start."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from types import MappingProxyType
from typing import Any, TypeVar

from app.domain import names, rules
from app.domain.clock import MOMENT
from app.domain.execution import UNBOUND, Execution, ReasonCode, State, Trigger
from app.domain.models import DayException, Fleet, Group, IdleRule, InvalidInput, Mission, Place, Robot, Schedule
from app.services.catalogue import (
    change_log,
    fleet_edit,
    group_edit,
    mission_edit,
    robot_edit,
    schedule_edit,
    settings_edit,
)
from app.services.catalogue.edit import KINDS, Edit, Removed
from app.services.catalogue.validation import check_name_is_free
from app.services.executions import transitions
from app.services.executions.wanted import wanted
from app.services.live.changes import Topic
from app.services.planning.planned import first_due

T = TypeVar("T")


@dataclass(frozen=True)
class Changed:
    """A schedule before and after a change, whether both names were generated, and its starts that had not ended before:
    ``Catalogue.undo_change`` undoes that."""

    before: Schedule
    after: Schedule
    has_generated_names: bool
    open_starts: Sequence[Execution]


def change_schedule(edit: Edit, before: Schedule, after: Schedule) -> Changed:
    stored = edit.the(Schedule, before.id)
    open_starts, was_generated = edit.open_of(edit.with_moved([stored])), edit.has_generated_name(stored)
    saved: Schedule = change(edit, before, after)
    return Changed(stored, saved, was_generated and edit.has_generated_name(saved), open_starts)


def undo_change(edit: Edit, changed: Changed) -> Schedule:
    """What others have changed of the schedule stays. What waited waits again, and starts that fell due since are due, unless a later
    one of the changed schedule was sent or ended."""
    before, after, stored = changed.before, changed.after, edit.the(Schedule, changed.before.id)
    if changed.has_generated_names and edit.has_generated_name(stored):
        other = edit.schedules.by_name(edit.c, before.name)
        is_free = (other is None or other.id == before.id) and edit.has_generated_name(before)
        before, after = replace(before, name=before.name if is_free else ""), replace(after, name=stored.name)
    schedule: Schedule = change(edit, after, before, must_be_unchanged=True)
    if (due := _due_since(edit, changed, schedule)) is not None:
        edit.executions.drop_withdrawn(edit.c, schedule.id, due)
        edit.schedules.advance(edit.c, schedule.id, due)
    together = {start.planned_at for start in changed.open_starts}
    for start in changed.open_starts:
        if not _has_been_decided(edit, start):
            _restore_start(edit, start, together, has_its_robot_again=False)
    edit.topics.add(Topic.EXECUTIONS)
    return edit.the(Schedule, schedule.id)


def _due_since(edit: Edit, changed: Changed, schedule: Schedule) -> datetime | None:
    """The first start that the ``schedule`` has lost by the change, as it is again: it fell due since, and its window is still open.
    None where a later start of the changed schedule has been sent or ended."""
    before, due = changed.before, changed.before.next_at
    as_before = replace(schedule, robot_id=before.robot_id, group_id=before.group_id)
    if due is None or schedule_edit.when(as_before) != schedule_edit.when(before):
        return None
    first_changed, through = changed.after.next_at, schedule.planned_through
    if through is not None and through >= max(due, first_changed or due):
        return None
    window = rules.closes_at(due, schedule.start_window_minutes, edit.settings) - due
    since = max(due, edit.now - window + MOMENT)
    unplanned = replace(schedule, planned_through=before.planned_through)
    skipped = edit.schedules.skipped(edit.c, schedule.id)
    found = first_due(unplanned, edit.settings, since, edit.calendar, skipped)
    if found is None or not found <= edit.now < found + window:
        return None
    # From next_at on nothing is lost: the schedule is planned from there.
    return found if schedule.next_at is None or found < schedule.next_at else None


def _has_been_decided(edit: Edit, start: Execution) -> bool:
    """Whether it ended because its robot was switched off, or was planned again since, perhaps on another robot, and the history has
    forgotten its outcome."""
    row = edit.executions.by_token(edit.c, start.token)
    if row is not None:
        return row.id == start.id and row.reason is not None and row.reason.code is ReasonCode.ROBOT_REMOVED
    schedule = edit.schedules.get(edit.c, start.schedule_id or 0)
    through = None if schedule is None else schedule.planned_through
    return through is not None and through >= start.planned_at


_SAVE: Mapping[type, Callable[[Edit, Any], Any]] = MappingProxyType(
    {
        Fleet: fleet_edit.save,
        Robot: robot_edit.save,
        Group: group_edit.save,
        Place: group_edit.save_place,
        Mission: mission_edit.save,
        Schedule: schedule_edit.save,
        DayException: lambda edit, days: settings_edit.save_days(edit, [days])[0],
    }
)


# what a person chooses together, of a schedule
TARGET = ("robot_id", "group_id", "finish_by_minutes")
TASK = ("mission_id", "parameters")
_TOGETHER: Mapping[type, Sequence[Sequence[str]]] = MappingProxyType(
    {
        Fleet: (("address", "username", "certificate_sha256", "identity"),),
        Robot: (("address", "username", "certificate_sha256", "serial_number"),),
        Schedule: (("start", "timezone", "recurrence", "between"), TARGET, TASK),
    }
)


def change(edit: Edit, before: T | None, after: T, *, must_be_unchanged: bool = False, **how: Any) -> T:
    """Write what differs between the two to what is stored now, and with it what belongs together with that; without one ``before`` it is
    added. Raises InvalidInput where somebody has changed what belongs together of a schedule since it was opened, and with
    ``must_be_unchanged`` if anything that would be written is another now than in ``before``. ``how`` a robot is saved: as in
    ``robot_edit.save``."""
    kind, save = type(after), _SAVE[type(after)]
    if before is None:
        added: T = save(edit, after, **how)
        return added
    stored: Any = edit.the(kind, vars(before)["id"])
    differing = {name for name, value in vars(after).items() if value != getattr(before, name)}
    differing = differing.union(*(each for each in _TOGETHER.get(type(before), ()) if differing & set(each)))
    differing -= schedule_edit.NOT_THE_RULE
    changed = {name for name in differing if getattr(stored, name) != getattr(before, name)}
    if must_be_unchanged and changed:
        raise changed_again(stored.name)
    if isinstance(stored, Schedule) and any(changed & set(each) for each in _TOGETHER[Schedule]):
        raise InvalidInput("schedule", "{name} has been changed since you opened it: open it again", name=stored.name)
    values = {name: getattr(after, name) for name in differing}
    if isinstance(stored, Schedule) and "name" not in differing and edit.has_generated_name(stored):
        values["name"] = ""  # it follows the change
    saved: T = save(edit, replace(stored, **values), **how)
    return saved


def changed_again(name: str) -> InvalidInput:
    return InvalidInput("name", "{name} was changed again, so nothing is undone", name=name)


def idle_rule_back(edit: Edit, robot_id: int, before: IdleRule | None, changes: Mapping[str, Any]) -> Robot:
    """These alone, as long as they are so; one that was new is off."""
    robot = edit.the(Robot, robot_id)
    if robot.idle is None or any(getattr(robot.idle, name) != value for name, value in changes.items()):
        raise changed_again(robot.name)
    was = {"enabled": False} if before is None else {name: getattr(before, name) for name in changes}
    return robot_edit.set_idle_rule(edit, robot_id, replace(robot.idle, **was))


def restore(edit: Edit, removed: Removed) -> None:
    """Put back what a deletion hid, and what waited of it. What would have fallen due in between writes no row."""
    for fleet in _put_back(edit, Fleet, removed):
        _restore_fleet(edit, fleet, removed)
    robots = _put_back(edit, Robot, removed)
    for robot in robots:
        _restore_robot(edit, robot, removed)
    for group in _put_back(edit, Group, removed):
        _check_robot_name(edit, group.name)
        _write_back(edit, group)
    for place in _put_back(edit, Place, removed):
        check_name_is_free(edit.places.by_name(edit.c, place.name), 0, "there is a place {name} already")
        _write_back(edit, place)
    for mission in _put_back(edit, Mission, removed):
        if mission.robot_id is not None:
            edit.the(Robot, mission.robot_id)
        other = edit.missions.by_name(edit.c, mission.name, mission.robot_id)
        check_name_is_free(other, 0, "there is another mission {name} now: rename that one, then undo again")
        _write_back(edit, mission)
        mission_edit.check_used_only_there(edit, mission)
        mission_edit.use_own(edit, mission.name)
    for robot in robots:  # its own missions are there again
        robot_edit.set_idle_rule(edit, robot.id, edit.the(Robot, robot.id).idle)
    schedules = _put_back(edit, Schedule, removed)
    for schedule in schedules:
        _restore_schedule(edit, schedule, removed)
    together = {start.planned_at for start in removed.starts}
    for start in removed.starts:
        _restore_start(edit, start, together, has_its_robot_again=start.robot_id in removed.ids.get(Robot, ()))
    unsent = edit.unsent_of(edit.with_moved(schedules))
    edit.apply(transitions.want_again(row) for row in unsent if wanted(edit.c, row, reopen=True).why is None)
    days = _put_back(edit, DayException, removed)
    for exception in days:
        edit.days.update(edit.c, exception)
        edit.notes.append(f"{change_log.days(exception)} put back")
    if days:
        settings_edit.days_changed(edit)
    else:
        edit.topics |= {Topic.ROBOTS, Topic.MISSIONS, Topic.SCHEDULES, Topic.HOLDS, Topic.EXECUTIONS}


def _restore_fleet(edit: Edit, fleet: Fleet, removed: Removed) -> None:
    other = edit.fleets.by_name(edit.c, fleet.name)
    check_name_is_free(other, 0, "there is another fleet {name} now: rename that one, then undo again")
    with _naming_the_other():
        edit.check_is_no_other(fleet)
    _write_back(edit, replace(fleet, token=removed.token))


def _restore_robot(edit: Edit, robot: Robot, removed: Removed) -> None:
    _check_robot_name(edit, robot.name)
    if robot.fleet is not None:
        robot = robot.within(edit.the(Fleet, robot.fleet.id))
    with _naming_the_other():
        edit.check_is_no_other(robot)
    _write_back(edit, replace(robot, token=removed.token))
    for group in edit.groups.of_robot(edit.c, robot.id):
        group_edit.check_members([edit.the(Robot, member) for member in group.members])


@contextmanager
def _naming_the_other() -> Iterator[None]:
    """Of what was configured since, and prevents it."""
    try:
        yield
    except InvalidInput as other:
        raise InvalidInput(
            other.field,
            "not restored: {problem}. Change or delete that one, then undo again",
            problem=other.message,
        ) from None


def _put_back(edit: Edit, kind: type[T], removed: Removed) -> list[T]:
    """Undo may be pressed twice, at two places."""
    ids, table = removed.ids.get(kind, ()), edit.tables[kind]
    found = [each for id_ in ids if (each := table.put_back(edit.c, id_, removed.at)) is not None]
    if len(found) < len(ids):
        raise InvalidInput("name", "this has been restored already")
    return found


def _write_back(edit: Edit, it: Fleet | Robot | Group | Place | Mission | Schedule) -> None:
    """Under its name, which is free."""
    edit.tables[type(it)].update(edit.c, it)
    edit.notes.append(f"{KINDS[type(it)]} {it.name!r} put back")


def _check_robot_name(edit: Edit, name: str) -> None:
    """Robots and groups share their names."""
    robot, group = edit.robots.by_name(edit.c, name), edit.groups.by_name(edit.c, name)
    check_name_is_free(robot, 0, "there is another robot {name} now: rename that one, then undo again")
    check_name_is_free(group, 0, "there is another group {name} now: rename that one, then undo again")


def _restore_schedule(edit: Edit, schedule: Schedule, removed: Removed) -> None:
    target = edit.target_of(schedule)
    mission = edit.mission_for(target, schedule.mission_id)
    schedule, does = replace(schedule, mission_id=mission.id), (mission.name, target.name)
    other = edit.schedules.by_name(edit.c, schedule.name) if schedule.moved_of is None else None
    if schedule.id in removed.made_names and (other or not names.is_generated(schedule.name, *does)):
        schedule = replace(schedule, name=schedule_edit.free_name(edit, *does))
    else:
        check_name_is_free(other, 0, "there is another schedule {name} now: rename that one, then undo again")
    through = max(edit.now, schedule.started_through or edit.now)
    if schedule.planned_through is not None and schedule.planned_through > through:  # the clock was set back since
        schedule = replace(schedule, planned_through=through)
    _write_back(edit, replace(schedule, changed_at=edit.now))
    for row in removed.starts:
        if row.schedule_id == schedule.id and row.state is State.WAITING and row.held and row.planned_at > through:
            edit.schedules.hold(edit.c, schedule.id, row.planned_at)
    edit.executions.make_room_after(edit.c, schedule.id, through, edit.now)
    for each in edit.with_moved([schedule]):
        edit.schedules.advance(edit.c, each.id, schedule_edit.next_due(edit, each))


def _restore_start(edit: Edit, before: Execution, together: Collection[datetime], *, has_its_robot_again: bool) -> None:
    """Waiting starts wait again if the plan still has them; starts that its robot had, or may have, are looked for
    there as soon as the robot is restored. ``together``: instants of all restored starts, which existed at the same
    time. Decided without the history, which may have forgotten them."""
    row, was_waiting = edit.executions.by_token(edit.c, before.token), before.state is State.WAITING
    if row is not None and row.id != before.id and row.was_never_sent:  # an edit gave it to another robot
        row = replace(before, id=row.id, state=row.state, reason=row.reason, withdrawn=row.withdrawn, held=row.held)
    if row is None and before.schedule_id is not None and before.planned_at > edit.now:
        return  # the clock was set back since: its instant is planned again
    if row is None:  # what was in doubt was found on its robot: else it would be kept
        may_wait, goes_on = was_waiting, has_its_robot_again and not was_waiting
    elif row.state is not State.CANCELLED or row.reason is None or (was_waiting and row.withdrawn is not None):
        return  # it has moved on, or was started on another robot since
    else:
        was_changed, was_removed = (
            row.reason.code is code for code in (ReasonCode.SCHEDULE_CHANGED, ReasonCode.ROBOT_REMOVED)
        )
        goes_on = was_removed and has_its_robot_again and not was_waiting and row.robot_id == before.robot_id
        may_wait = was_changed or (was_removed and (was_waiting or (has_its_robot_again and row.robot_id is None)))
    row = replace(
        row or before, state=before.state if goes_on else State.WAITING, reason=None, ended_at=None, duration_s=None
    )
    unwanted = wanted(edit.c, row, reopen=True).why
    if goes_on:
        is_final = before.withdrawn is not None and before.withdrawn.code is not ReasonCode.SCHEDULE_CHANGED
        _restore_row(edit, replace(row, withdrawn=before.withdrawn if is_final else unwanted))
    elif may_wait and unwanted is None and not _has_made_way(edit, row, together):
        _wait_again(edit, row)


def _has_made_way(edit: Edit, row: Execution, together: Collection[datetime] = ()) -> bool:
    """Whether another start of its schedule is there, but one of ``together``, whose runs don't overlap: one of them would have been left
    out."""
    schedule = edit.schedules.get(edit.c, row.schedule_id) if row.schedule_id is not None else None
    newest = schedule and edit.executions.open_of_schedules(edit.c, [schedule.whole_id]).get(schedule.whole_id)
    return newest is not None and newest not in together


def _wait_again(edit: Edit, row: Execution) -> None:
    """As its schedule is defined now, and for a group on any robot; not if it is too late."""
    row = replace(
        row,
        state=State.WAITING,
        reason=None,
        ended_at=None,
        withdrawn=None,
        **(UNBOUND if row.group_id is not None else {}),
    )
    row = replace(row, **(wanted(edit.c, row).columns or {}))
    if row.closes_at > edit.now:
        _restore_row(edit, row)


def _restore_row(edit: Edit, row: Execution) -> None:
    """Also where the history has forgotten it."""
    stored = edit.executions.get(edit.c, row.id)
    if stored is None:
        edit.executions.add_once(edit.c, row)
    else:
        edit.apply([transitions.restore(stored, row)])


def may_wait_again(row: Execution) -> bool:
    """Whether a person has cancelled that start before it was sent. Idle missions are started again automatically."""
    return (
        row.state is State.CANCELLED
        and row.reason is not None
        and row.reason.code is ReasonCode.USER_CANCELLED
        and not row.attempts
        and not row.is_called_off
        and row.trigger is not Trigger.IDLE
    )


def wait_again(edit: Edit, execution_id: int) -> None:
    """Undo the cancellation of a waiting start; raises InvalidInput if it can't wait again. Nothing runs twice: it is
    the same row with the same token, and no request for it was ever sent. After this one transaction it is as if it had
    never been cancelled: all checks before sending apply again. A cause that would have ended it while it was cancelled
    is checked here.
    """
    row = edit.executions.get(edit.c, execution_id)
    if row is not None and row.state is State.SKIPPED and row.schedule_id is not None and row.planned_at > edit.now:
        _plan_again(edit, row, row.schedule_id)  # the clock was set back since
        return
    if row is None or not may_wait_again(row):
        raise InvalidInput("execution", "this start no longer waits and can't wait again")
    if row.closes_at <= edit.now:
        raise InvalidInput("execution", "it is too late for this start")
    if row.group_id is not None:
        edit.the(Group, row.group_id)
    elif not (robot := edit.the(Robot, row.robot_id or 0)).enabled:
        raise InvalidInput("robot", "{robot} is switched off in Settings", robot=robot.name)
    if row.schedule_id is not None:
        edit.the(Schedule, row.schedule_id)
        edit.schedules.unskip(edit.c, row.schedule_id, row.planned_at)
    if wanted(edit.c, row, reopen=True).why is not None:
        raise InvalidInput("schedule", "its schedule has been changed since")
    if _has_made_way(edit, row):
        raise InvalidInput("schedule", "the next start of its schedule is there already")
    _wait_again(edit, row)
    edit.note(f"#{row.id} {row.mission!r} waits again: its cancellation was undone", Topic.EXECUTIONS)


def _plan_again(edit: Edit, row: Execution, schedule_id: int) -> None:
    """Remove the skip of its instant, which is in the future."""
    schedule = edit.the(Schedule, schedule_id)
    schedule_edit.put_back(edit, schedule, row.planned_at)
    if row.held:
        edit.schedules.hold(edit.c, schedule_id, row.planned_at)
    if wanted(edit.c, replace(row, state=State.WAITING, reason=None), reopen=True).why is not None:
        raise InvalidInput("schedule", "its schedule has been changed since")
    edit.note(
        f"#{row.id} {row.mission!r} is planned again: its cancellation was undone", Topic.EXECUTIONS, Topic.SCHEDULES
    )
