"""Schedule names that the app generates: "<mission> on <robot>", with a number if that is taken. They change when the
mission or the robot is renamed; typed names stay. Schedules of a file without a name get one.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from app.domain import names
from app.domain.models import Group, Mission, Robot, Schedule
from app.services.catalogue import schedule_edit
from app.services.catalogue.edit import Edit
from app.services.live.changes import Topic


def rename(edit: Edit, old: str, it: Robot | Group | Mission) -> None:
    """Those of its schedules. ``old``: the name that it had. Numbered ones keep their order."""
    if it.name == old:
        return
    of_kind = {Robot: edit.schedules.for_robot, Group: edit.schedules.for_group, Mission: edit.schedules.for_mission}
    for schedule in sorted(of_kind[type(it)](edit.c, it.id), key=lambda each: (len(each.name), each.name)):
        mission, target = edit.the(Mission, schedule.mission_id).name, edit.target_of(schedule).name
        before = (old, target) if isinstance(it, Mission) else (mission, old)
        was_generated = schedule.moved_of is None and names.is_generated(schedule.name, *before)
        if was_generated and not names.is_generated(schedule.name, mission, target):
            name = schedule_edit.free_name(edit, mission, target)
            edit.schedules.update(edit.c, replace(schedule, name=name))
            edit.note(f"schedule {schedule.name!r} changed: name {schedule.name!r} → {name!r}", Topic.SCHEDULES)


class Unnamed:
    """The unnamed schedules of one mission on one robot. ``names`` are tried in that order; ``taken`` are those used by
    the file, to which the caller adds each one returned; ``stored`` finds a schedule by name. Each name is looked up
    once, however many there are."""

    def __init__(self, names: Iterator[str], taken: set[str], stored: Callable[[str], Schedule | None]) -> None:
        self._names, self._taken, self._stored = names, taken, stored
        self._free = ""  # the first name that nothing has
        self._passed: list[Schedule] = []  # stored under the names before it
        self._found: dict[
            tuple[str, ...], tuple[list[int], dict[tuple[object, ...], deque[str]]]
        ] = {}  # by the keys that have a value

    def name_of(self, values: Mapping[str, Any]) -> str:
        """The name of the stored schedule that has these values: importing a file twice must not plan everything twice. Else a free one."""
        while not self._free or self._free in self._taken:
            self._advance()
        keys = tuple(values)
        (seen,), found = entry = self._found.setdefault(keys, ([0], {}))
        for schedule in self._passed[seen:]:
            found.setdefault(_comparable({key: getattr(schedule, key) for key in keys}), deque()).append(schedule.name)
        entry[0][0] = len(self._passed)
        same = found.get(_comparable(values), deque())
        while same:
            if (name := same.popleft()) not in self._taken:
                return name
        return self._free

    def _advance(self) -> None:
        name = next(self._names)
        if name in self._taken:
            return
        stored = self._stored(name)
        if stored is None:
            self._free = name
        else:
            self._passed.append(stored)


def _comparable(values: Mapping[str, Any]) -> tuple[object, ...]:
    return tuple(
        json.dumps(value, sort_keys=True) if isinstance(value, Mapping) else value for value in values.values()
    )
