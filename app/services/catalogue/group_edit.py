"""Groups of robots and the places that they share: the part of a change of the plan that is about them.

Every function raises InvalidInput before it has written anything.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

from app.domain.execution import Execution, Reason, ReasonCode, State
from app.domain.models import Group, InvalidInput, Mission, Place, Robot
from app.services.catalogue import fields, generated_names, validation
from app.services.catalogue.edit import Edit, Removed
from app.services.catalogue.validation import check_name_is_free
from app.services.executions import transitions
from app.services.executions.transitions import Event
from app.services.live.changes import Topic


def save(edit: Edit, group: Group, *, may_be_empty: bool = False) -> Group:
    """Add (id 0) or change. Unsent starts of a robot that is no longer a member wait for another one.
    ``may_be_empty``: its last robot was removed, and a file says so."""
    stored = edit.the(Group, group.id) if group.id else None
    group = validation.group(group, may_be_empty=may_be_empty)
    _check_name(edit, group, stored)
    check_members([edit.the(Robot, robot_id) for robot_id in group.members])
    if group == stored:
        return group
    if stored is None:
        group = edit.groups.add(edit.c, group)
    else:
        edit.groups.update(edit.c, group)
        generated_names.rename(edit, stored.name, group)
        for robot_id in set(stored.members) - set(group.members):
            unassign(edit, robot_id, group.id)
    edit.note(
        f"group {group.name!r} {'added' if stored is None else 'changed'}: {len(group.members)} robots, "
        f"{group.hand_over}, {group.keep_free} kept free",
        Topic.ROBOTS,
    )
    return group


def check_members(robots: Iterable[Robot]) -> None:
    """A fleet that may choose any of its robots could choose one that the group has given something else."""
    vehicles: dict[int, set[bool]] = {}
    for robot in robots:
        if robot.fleet is not None:
            vehicles.setdefault(robot.fleet.id, set()).add(robot.is_any)
            if len(vehicles[robot.fleet.id]) > 1:
                raise InvalidInput(
                    "members",
                    "a group can't have single robots of {fleet} and any robot of it",
                    fleet=robot.fleet.name,
                )


def _check_name(edit: Edit, group: Group, stored: Group | None) -> None:
    """No other group or robot has that name; a new name differs from theirs by more than capital letters."""
    is_new = stored is None or stored.name != group.name

    def alike(names: set[str]) -> str | None:
        known = (name for name in names if name == group.name or (is_new and name.casefold() == group.name.casefold()))
        return next(known, None)

    if other := alike(edit.groups.names(edit.c) - {"" if stored is None else stored.name}):
        raise InvalidInput("name", "there is a group {name} already", name=other)
    if robot := alike(edit.robots.names(edit.c)):
        raise InvalidInput("name", "there is a robot {name} already", name=robot)


def remove(edit: Edit, group_id: int) -> Removed:
    """Deletes its schedules too. Starts that no robot has yet are cancelled; running missions continue."""
    group, schedules = edit.the(Group, group_id), edit.schedules.for_group(edit.c, group_id)
    starts = edit.end_starts_of(schedules)
    starts += _end_waiting(edit, group, {"removed": group.name})
    edit.note(f"group {group.name!r} removed, and {len(schedules)} schedules with it", Topic.ROBOTS, Topic.SCHEDULES)
    return edit.hide(Removed(edit.now, {Group: [group_id]}, starts=starts), schedules)


def end_without_robots(edit: Edit, groups: Iterable[Group]) -> list[Execution]:
    """A robot of these groups was removed: end the waiting starts of groups with no other robot switched on.
    Returns their rows as they were before."""
    left = [group for before in groups if (group := edit.groups.get(edit.c, before.id)) is not None]
    return [
        row
        for group in left
        if not any(edit.the(Robot, robot_id).enabled for robot_id in group.members)
        for row in _end_waiting(edit, group, {"group": group.name})
    ]


def _end_waiting(edit: Edit, group: Group, details: Mapping[str, str]) -> list[Execution]:
    waiting = edit.executions.waiting_of_group(edit.c, group.id)
    reason = Reason(ReasonCode.ROBOT_REMOVED, details)
    edit.apply(transitions.end(Event.REMOVE, row, reason) for row in waiting)
    return waiting


def unassign(edit: Edit, robot_id: int, group_id: int | None = None) -> None:
    """Unsent starts assigned to this robot of a group are for any of the others again."""
    waiting = edit.executions.open_for(edit.c, robot_id, [State.WAITING])
    of_groups = [row for row in waiting if row.group_id is not None and group_id in (None, row.group_id)]
    edit.apply(map(transitions.unassign, of_groups))


def save_place(edit: Edit, place: Place) -> Place:
    """Add (id 0) or change."""
    stored = edit.the(Place, place.id) if place.id else None
    place = replace(fields.checked(place, fields.PLACE), missions=tuple(sorted(set(place.missions))))
    check_name_is_free(edit.places.by_name(edit.c, place.name), place.id, "there is a place {name} already")
    for mission_id in place.missions:
        edit.the(Mission, mission_id)
    if place == stored:
        return place
    if stored is None:
        place = edit.places.add(edit.c, place)
    else:
        edit.places.update(edit.c, place)
    edit.note(
        f"place {place.name!r} {'added' if stored is None else 'changed'}: at most {place.most} missions",
        Topic.MISSIONS,
    )
    return place


def use_places(edit: Edit, mission: Mission, place_ids: Collection[int]) -> bool:
    """Let a mission use exactly these; returns whether that changes anything."""
    if edit.places.used_by(edit.c, mission.id) == set(place_ids):
        return False
    edit.places.use(edit.c, mission.id, place_ids)
    edit.note(f"mission {mission.name!r} uses {len(place_ids)} places", Topic.MISSIONS)
    return True


def remove_place(edit: Edit, place_id: int) -> Removed:
    """Missions that used it stay."""
    place = edit.the(Place, place_id)
    edit.note(f"place {place.name!r} removed", Topic.MISSIONS)
    return edit.hide(Removed(edit.now, {Place: [place_id]}))
