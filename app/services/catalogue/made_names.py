"""Names of schedules that the app made of a mission and a robot follow when one of the two is renamed; those that a person typed stay."""
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from app.domain import names
from app.domain.models import Mission, Robot, Schedule
from app.services.catalogue.transaction import Transaction
from app.services.live.changes import Topic

Made = tuple[str, str]                   # the names of a mission and of a robot


def follow_robot(edit: Transaction, old: str, robot: Robot) -> None:
    """``old``: the name that it had."""
    if robot.name != old:
        missions = {mission.id: mission.name for mission in edit.missions.all(edit.c)}
        schedules = edit.schedules.for_robot(edit.c, robot.id)
        _follow(edit, schedules, {schedule.id: ((missions[schedule.mission_id], old), (missions[schedule.mission_id], robot.name))
                                  for schedule in schedules})


def follow_mission(edit: Transaction, old: str, mission: Mission) -> None:
    """``old``: the name that it had."""
    if mission.name != old:
        robots = {robot.id: robot.name for robot in edit.robots.all(edit.c)}
        schedules = edit.schedules.for_mission(edit.c, mission.id)
        _follow(edit, schedules, {schedule.id: ((old, robots[schedule.robot_id]), (mission.name, robots[schedule.robot_id]))
                                  for schedule in schedules})


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
