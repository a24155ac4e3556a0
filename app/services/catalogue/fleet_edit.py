"""MiR Fleets, through which robots are reached: the part of a change of the plan that is about them.

Every function raises InvalidInput before it has written anything.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from math import ceil

from app.database.check_ups import CheckUpRepository
from app.domain.models import Fleet, InvalidInput, Mission, Robot, Schedule
from app.mir.credentials import with_token
from app.services.catalogue import change_log, fields, robot_edit
from app.services.catalogue.edit import Edit, Removed
from app.services.catalogue.validation import check_name_is_free
from app.services.live.changes import Topic


def save(edit: Edit, fleet: Fleet, password: str | None = None, *, is_one_of_many: bool = False) -> Fleet:
    """Add (id 0) or change, with all of its robots. Credentials are as those of robots: without a ``password`` (of Fleet
    Enterprise, an API key) a new fleet, or one with another user, address or certificate, is switched off and needs
    one. ``is_one_of_many``: the caller checks later that no other has its address."""
    stored = edit.the(Fleet, fleet.id) if fleet.id else None
    fleet = fields.checked(fleet, fields.FLEET)
    check_name_is_free(edit.fleets.by_name(edit.c, fleet.name), fleet.id, "there is a fleet {name} already")
    if password == "":
        raise InvalidInput("password", "enter a password")
    if stored is not None and fleet.kind is not stored.kind:
        raise InvalidInput("kind", "a fleet of another kind is another fleet: add that, and remove this one")
    if stored is not None:
        fleet = replace(fleet, identity=fleet.identity or stored.identity)
        is_confirmed = password is not None and fleet.address == stored.address
        if (is_confirmed or fleet.username != stored.username) and fleet.identity == stored.identity:
            fleet = replace(fleet, identity=None)  # it is asked again who it is: what is known counts if it is the same
        if fleet.identity is None and fleet.address != stored.address:  # it may be another one
            fleet = replace(fleet, profile=None)
    if not is_one_of_many:
        edit.check_is_no_other(fleet, stored)
    fleet = with_token(fleet, password, stored)
    if fleet.profile and stored and fleet.token != stored.token:  # orders show another key
        fleet = replace(fleet, profile=replace(fleet.profile, own_key=None))
    return _put(edit, fleet, stored)


def _put(edit: Edit, fleet: Fleet, stored: Fleet | None) -> Fleet:
    if fleet == stored:
        return fleet
    if stored is None:
        fleet = edit.fleets.add(edit.c, fleet)
        edit.notes.append(f"fleet {fleet.name!r} added, at {fleet.address}")
    else:
        robots = [edit.the(Robot, robot_id) for robot_id in edit.fleets.robot_ids(edit.c, fleet.id)]
        edit.fleets.update(edit.c, fleet)
        if changed := change_log.change_of_robot(stored, fleet):
            edit.notes.append(f"fleet {stored.name!r} changed: {changed}")
        for robot in robots:
            now = robot.within(fleet)
            edit.robots.update(edit.c, now)
            if robot.enabled and not now.enabled:
                robot_edit.end_unsent(edit, robot)
        edit.note_password(fleet, stored, f"fleet:{fleet.id}")
    edit.topics.add(Topic.ROBOTS)
    return fleet


def remove(edit: Edit, fleet_id: int) -> Removed:
    """With its robots, and with each what is removed with a robot. Raises InvalidInput while it may have an order that is
    to begin later, and that only the app deletes."""
    fleet, robot_ids = edit.the(Fleet, fleet_id), edit.fleets.robot_ids(edit.c, fleet_id)
    left = CheckUpRepository().left_on_fleets(edit.c).get(fleet_id)
    if left is not None and left.begins_by is not None and edit.now < left.begins_by:
        raise InvalidInput(
            "fleet",
            "{fleet} may still have the order of its check-up, which would begin tomorrow: the app deletes it as soon as it can "
            "sign in there. If that is impossible, {fleet} can be removed in {hours} h",
            fleet=fleet.name,
            hours=ceil((left.begins_by - edit.now) / timedelta(hours=1)),
        )
    of_robots = [robot_edit.remove(edit, robot_id) for robot_id in robot_ids]
    for code in ("needs_password", "check_up_left"):
        edit.end_alarm(code, f"fleet:{fleet_id}")
    edit.note(f"fleet {fleet.name!r} removed, and {len(robot_ids)} robots with it", Topic.ROBOTS)
    own = edit.hide(Removed(edit.now, {Fleet: [fleet_id]}, token=fleet.token))
    ids: dict[type, list[int]] = {
        kind: [id_ for each in of_robots for id_ in each.ids[kind]] for kind in (Robot, Mission, Schedule)
    }
    return replace(
        own,
        ids={**own.ids, **ids},
        made_names=[id_ for each in of_robots for id_ in each.made_names],
        starts=[start for each in of_robots for start in each.starts],
    )
