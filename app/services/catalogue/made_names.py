"""Names of schedules that the app made of a mission and a robot follow when one of the two is renamed; those that a person typed stay."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from app.domain import names
from app.domain.models import Group, Mission, Robot, Schedule
from app.services.catalogue.transaction import Transaction
from app.services.live.changes import Topic

Made = tuple[str, str]  # the names of a mission and of a robot


def follow_robot(edit: Transaction, old: str, robot: Robot | Group) -> None:
    """``old``: the name that it, or the group, had."""
    if robot.name != old:
        missions = {mission.id: mission.name for mission in edit.missions.all(edit.c)}
        of_target = edit.schedules.for_robot if isinstance(robot, Robot) else edit.schedules.for_group
        schedules = of_target(edit.c, robot.id)
        _follow(
            edit,
            schedules,
            {
                schedule.id: ((missions[schedule.mission_id], old), (missions[schedule.mission_id], robot.name))
                for schedule in schedules
            },
        )


def follow_mission(edit: Transaction, old: str, mission: Mission) -> None:
    """``old``: the name that it had."""
    if mission.name != old:
        schedules = edit.schedules.for_mission(edit.c, mission.id)
        targets = {schedule.id: edit.target_of(schedule).name for schedule in schedules}
        _follow(edit, schedules, {id_: ((old, name), (mission.name, name)) for id_, name in targets.items()})


def _follow(edit: Transaction, schedules: Sequence[Schedule], made_of: Mapping[int, tuple[Made, Made]]) -> None:
    """``made_of``: what the names are made of, before and now, by id of the schedule. Numbered ones keep their order."""
    taken, free = edit.schedules.names(edit.c), dict[Made, Iterator[str]]()
    for schedule in sorted(schedules, key=lambda schedule: (len(schedule.name), schedule.name)):
        before, now = made_of[schedule.id]
        if names.is_of_schedule(schedule.name, *before) and not names.is_of_schedule(schedule.name, *now):
            name = next(name for name in free.setdefault(now, names.of_schedule(*now)) if name not in taken)
            edit.schedules.update(edit.c, replace(schedule, name=name))
            edit.notes.append(f"schedule {schedule.name!r} changed: name {schedule.name!r} → {name!r}")
            edit.topics.add(Topic.SCHEDULES)
