"""Groups of robots and the places that they share: the part of a change of the plan that is about them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

from app.domain.models import Execution, Group, InvalidInput, Mission, Place, Reason, ReasonCode, State
from app.services.catalogue import fields, generated_names, validation
from app.services.catalogue.transaction import Transaction
from app.services.catalogue.undo import Removed
from app.services.executions import transitions
from app.services.executions.transitions import Event
from app.services.live.changes import Topic


class GroupEdit(Transaction):
    """Every method raises InvalidInput before it has written anything."""

    def save_group(self, group: Group, *, may_be_empty: bool = False) -> Group:
        """Add (id 0) or change. Unsent starts of a robot that is no longer a member wait for another one.
        ``may_be_empty``: its last robot was removed, and a file says so."""
        stored = self.the_group(group.id) if group.id else None
        group = validation.group(group, may_be_empty=may_be_empty)
        self._check_group_name(group, stored)
        for robot_id in group.members:
            self.the_robot(robot_id)
        if group == stored:
            return group
        if stored is None:
            group = self.groups.add(self.c, group)
        else:
            self.groups.update(self.c, group)
            generated_names.rename_for_robot(self, stored.name, group)
            for robot_id in set(stored.members) - set(group.members):
                self._unassign(robot_id, group.id)
        self.notes.append(
            f"group {group.name!r} {'added' if stored is None else 'changed'}: {len(group.members)} robots, "
            f"{group.hand_over}, {group.keep_free} kept free"
        )
        self.topics.add(Topic.ROBOTS)
        return group

    def _check_group_name(self, group: Group, stored: Group | None) -> None:
        """No other group or robot has that name; a new name differs from theirs by more than capital letters."""
        is_new = stored is None or stored.name != group.name

        def alike(name: str) -> bool:
            return name == group.name or (is_new and name.casefold() == group.name.casefold())

        if other := next(
            (other for other in self.groups.all(self.c) if other.id != group.id and alike(other.name)), None
        ):
            raise InvalidInput("name", "there is a group {name} already", name=other.name)
        if robot := next((robot for robot in self.robots.all(self.c) if alike(robot.name)), None):
            raise InvalidInput("name", "there is a robot {name} already", name=robot.name)

    def remove_group(self, group_id: int) -> Removed:
        """Deletes its schedules too. Starts that no robot has yet are cancelled; running missions continue."""
        group, schedules = self.the_group(group_id), self.schedules.for_group(self.c, group_id)
        starts = self.open_of(schedules)
        for schedule in schedules:
            self.withdraw_all(schedule, "deleted")
        starts += self._end_waiting(group, {"removed": group.name})
        self.notes.append(f"group {group.name!r} removed, and {len(schedules)} schedules with it")
        self.topics |= {Topic.ROBOTS, Topic.SCHEDULES}
        return self.remove(Removed(self.now, groups=[group_id], starts=starts), schedules)

    def _end_without_robots(self, groups: Iterable[Group]) -> list[Execution]:
        """A robot of these groups was removed: end the waiting starts of groups with no other robot switched on.
        Returns their rows as they were before."""
        left = [group for before in groups if (group := self.groups.get(self.c, before.id)) is not None]
        return [
            row
            for group in left
            if not any(self.the_robot(robot_id).enabled for robot_id in group.members)
            for row in self._end_waiting(group, {"group": group.name})
        ]

    def _end_waiting(self, group: Group, details: Mapping[str, str]) -> list[Execution]:
        waiting = self.executions.waiting_of_group(self.c, group.id)
        reason = Reason(ReasonCode.ROBOT_REMOVED, details)
        self.apply(transitions.end(Event.REMOVE, row, reason) for row in waiting)
        return waiting

    def _unassign(self, robot_id: int, group_id: int | None = None) -> None:
        """Unsent starts assigned to this robot of a group are for any of the others again."""
        waiting = self.executions.open_for(self.c, robot_id, [State.WAITING])
        of_groups = [row for row in waiting if row.group_id is not None and group_id in (None, row.group_id)]
        self.apply(map(transitions.unassign, of_groups))

    # ------------------------------------------------------------------ places
    def save_place(self, place: Place) -> Place:
        """Add (id 0) or change."""
        stored = self.the_place(place.id) if place.id else None
        place = replace(fields.checked(place, fields.PLACE), missions=tuple(sorted(set(place.missions))))
        other = self.places.by_name(self.c, place.name)
        if other is not None and other.id != place.id:
            raise InvalidInput("name", "there is a place {name} already", name=place.name)
        for mission_id in place.missions:
            self.the_mission(mission_id)
        if place == stored:
            return place
        if stored is None:
            place = self.places.add(self.c, place)
        else:
            self.places.update(self.c, place)
        self.notes.append(
            f"place {place.name!r} {'added' if stored is None else 'changed'}: at most {place.most} missions"
        )
        self.topics.add(Topic.MISSIONS)
        return place

    def use_places(self, mission: Mission, place_ids: Collection[int]) -> bool:
        """Let a mission use exactly these; returns whether that changes anything."""
        if self.places.used_by(self.c, mission.id) == set(place_ids):
            return False
        self.places.use(self.c, mission.id, place_ids)
        self.notes.append(f"mission {mission.name!r} uses {len(place_ids)} places")
        self.topics.add(Topic.MISSIONS)
        return True

    def remove_place(self, place_id: int) -> Removed:
        """Missions that used it stay."""
        place = self.the_place(place_id)
        self.notes.append(f"place {place.name!r} removed")
        self.topics.add(Topic.MISSIONS)
        return self.remove(Removed(self.now, places=[place_id]))
