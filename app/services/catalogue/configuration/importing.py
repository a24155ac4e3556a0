"""Applies a configuration file to the stored configuration, in one transaction: all of it or nothing. No robot, mission
or schedule is deleted, and runs only after a person has confirmed it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from app.domain import names
from app.domain.message import Message, message
from app.domain.models import (
    DayException,
    Fleet,
    Group,
    IdleRule,
    InvalidInput,
    Mission,
    Place,
    Robot,
    Schedule,
    existing,
)
from app.services.catalogue import (
    group_edit,
    mission_edit,
    parameter_check,
    robot_edit,
    schedule_edit,
    settings_edit,
    validation,
)
from app.services.catalogue.catalogue import Catalogue, Edit
from app.services.catalogue.configuration import import_lines
from app.services.catalogue.configuration.asked_robots import AskedRobots, MoreToAsk
from app.services.catalogue.configuration.document import Document, read
from app.services.catalogue.configuration.machines import Machines
from app.services.catalogue.fields import Item, differing, placed
from app.services.catalogue.generated_names import Unnamed
from app.services.catalogue.parameter_check import Checked

# So many are written within a second, in which no one else can write.
MOST: Mapping[str, tuple[type, int]] = {
    "fleets": (Fleet, 20),
    "robots": (Robot, 500),
    "groups": (Group, 100),
    "places": (Place, 100),
    "missions": (Mission, 2000),
    "schedules": (Schedule, 2000),
}


class DeletesRuns(InvalidInput):
    """A file lowers the history limit below the number of stored runs; a person has to confirm this."""

    def __init__(self, limit: int, count: int) -> None:
        self.limit, self.count = limit, count
        super().__init__(
            "settings.history_limit",
            "settings.history_limit: keeping {limit} deletes {count} runs of the history; to confirm that, add --yes",
            limit=limit,
            count=count,
        )


def import_configuration(catalogue: Catalogue, content: bytes, *, may_delete: bool = False) -> list[Message]:
    """Tried out on a copy first. Returns what was added or changed, one sentence each; empty if nothing was new. Raises InvalidInput
    with the place in the file and how to correct it, DeletesRuns unless it ``may_delete``; then nothing was changed.
    """
    document = read(content)
    if not may_delete and (deletes := _deletes(catalogue, document)):
        raise deletes
    asked = AskedRobots(catalogue)
    lines, writes = _run(document, asked, catalogue.try_out)
    if writes:  # so no one waits for a file that is refused, or that changes nothing
        lines, _ = _run(document, asked, catalogue.edit)
    asked.keep()
    return lines


def preview(catalogue: Catalogue, content: bytes) -> tuple[list[Message], DeletesRuns | None]:
    """What ``import_configuration`` would return, and which runs it would delete; nothing is changed. Raises InvalidInput."""
    document = read(content)
    return _run(document, AskedRobots(catalogue), catalogue.try_out)[0], _deletes(catalogue, document)


def _deletes(catalogue: Catalogue, document: Document) -> DeletesRuns | None:
    limit: int | None = document.objects["settings"].values.get("history_limit")
    count = 0 if limit is None else catalogue.runs_beyond(limit)
    return DeletesRuns(limit, count) if limit is not None and count else None


Outcome = tuple[list[Message], bool]  # its lines, and whether anything is written


def _run(document: Document, asked: AskedRobots, edit: Callable[[Callable[[Edit], Outcome]], Outcome]) -> Outcome:
    """Again, while its robots have to be asked for what their missions take."""

    def take(each: Edit) -> Outcome:
        before = each.c.total_changes
        return _Import(each, document, asked).run(), each.c.total_changes > before

    while True:
        try:
            return edit(take)
        except MoreToAsk as more:
            asked.ask(more)


class _Import:
    def __init__(self, edit: Edit, document: Document, asked: AskedRobots) -> None:
        self._edit, self._document, self._asked = edit, document, asked
        self._to_check: list[tuple[Item, Schedule]] = []  # whose parameters must be checked
        self._idle: list[tuple[Item, Checked]] = []
        self._unnamed: dict[tuple[str, int], Unnamed] = {}
        self._place_ids: dict[str, int] = {}
        self._taken: set[str] = set()  # names of schedules in the file, reserved for them

    def run(self) -> list[Message]:
        """Settings first, as new schedules take their defaults from them; idle rules after the missions that they name."""
        objects, lists = self._document
        self._check_room()
        _check_no_doubles(lists)
        setting_lines = [
            *self._settings(objects["settings"], objects["settings"].changes),
            *self._different(objects["display"], objects["display"].changes),
            *self._calendar(objects["calendar"]),
        ]
        machines = Machines(self._edit, self._document)
        machines.take()
        group_lines = self._each(lists["groups"], self._group)
        place_lines = self._each(lists["places"], self._place)
        self._place_ids = self._edit.places.ids(self._edit.c)
        mission_lines = self._each(lists["missions"], self._mission)
        for item in lists["robots"]:
            self._idle_rule(item)
        self._taken |= {item.values["name"] for item in lists["schedules"] if item.values.get("name")}
        schedule_lines = self._each(lists["schedules"], self._schedule)
        self._check_room()
        runners = parameter_check.Runners(self._edit.c)
        self._asked.judge(
            [*self._idle, *((item, runners.check(schedule, self._asked.known)) for item, schedule in self._to_check)]
        )
        return [*setting_lines, *machines.lines(), *group_lines, *place_lines, *mission_lines, *schedule_lines]

    @staticmethod
    def _each(items: Sequence[Item], take: Callable[[Item], Iterator[Message]]) -> list[Message]:
        lines: list[Message] = []
        for item in items:
            with placed(item):
                lines += take(item)
        return lines

    def _check_room(self) -> None:
        """Each robot takes a thread, and each schedule time at every change of working days."""
        for section, items in self._document.lists.items():
            kind, most = MOST[section]
            if items and max(len(items), self._edit.tables[kind].count(self._edit.c)) > most:
                raise InvalidInput(
                    section,
                    "{section}: this file would make more than the {most} allowed",
                    section=section,
                    most=most,
                )

    # ------------------------------------------------------------------ settings
    def _settings(self, item: Item, changes: Mapping[str, Any]) -> Iterator[Message]:
        """``changes``: by attribute."""
        before = self._edit.settings
        with placed(item):
            after = settings_edit.change(self._edit, **changes)
        for field in differing(before, after, item.fields):
            yield import_lines.of_setting(field, before, after)

    def _different(self, item: Item, changes: Mapping[str, Any]) -> Iterator[Message]:
        """Those that are not as they are by default either."""
        settings = self._edit.settings
        yield from self._settings(
            item, {name: value for name, value in changes.items() if value != getattr(settings, name)}
        )

    def _calendar(self, item: Item) -> Iterator[Message]:
        """Another country has other regions. An existing day is not added again."""
        changes, country = item.changes, self._edit.settings.holiday_country
        if changes.get("holiday_country", country) != country:
            changes.setdefault("holiday_subdivision", "")
        yield from self._different(item, changes)
        there = Counter(replace(stored, id=0, source="") for stored in self._edit.days.all(self._edit.c))
        added = []
        for exception in map(_day, item.values.get("days", ())):
            identity = replace(exception, source="")
            if there[identity]:
                there[identity] -= 1
            else:
                added.append(exception)
        if added:
            with placed(item):
                settings_edit.save_days(self._edit, added)
        for exception in added:
            yield (
                message("extra working days added: {name}", name=exception.name)
                if exception.is_working
                else message("days off added: {name}", name=exception.name)
            )

    # ------------------------------------------------------------------ robots when idle
    def _idle_rule(self, item: Item) -> None:
        if "idle" not in item.values:
            return
        robot = self._robot_named(item.values["name"], f"{item.path}.name")
        entry: Item | None = item.values["idle"]
        if entry is None:
            robot_edit.set_idle_rule(self._edit, robot.id, None)
            return
        rule, path = robot.idle, entry.path
        if "mission" in entry.values:
            mission = self._mission_named(entry.values["mission"], robot, f"{path}.mission")
            rule = replace(rule, mission_id=mission.id) if rule else IdleRule(mission.id)
        if rule is None:
            raise InvalidInput(f"{path}.mission", "{path}: 'mission' is missing", path=path)
        with placed(entry):
            rule = replace(rule, **entry.changes)
            saved = robot_edit.set_idle_rule(self._edit, robot.id, rule)
        if parameter_check.is_mission_new(rule, robot.idle):
            self._idle.append((entry, parameter_check.of_idle_rule(self._edit, saved, rule, self._asked.known)))

    # ------------------------------------------------------------------ groups and places
    def _group(self, item: Item) -> Iterator[Message]:
        edit, name, values = self._edit, item.values["name"], item.changes
        stored = item.of(edit.groups.by_name(edit.c, name))
        if "robots" in item.values:
            members = (self._robot_named(robot, f"{item.path}.robots").id for robot in item.values["robots"])
            values["members"] = tuple(sorted(members))
        saved = group_edit.save(edit, replace(stored or Group(name), **values), may_be_empty=True)
        return import_lines.line("groups", stored, saved, name=name)

    def _place(self, item: Item) -> Iterator[Message]:
        edit, name = self._edit, item.values["name"]
        stored = item.of(edit.places.by_name(edit.c, name))
        saved = group_edit.save_place(edit, replace(stored or Place(name, 1), **item.changes))
        return import_lines.line("places", stored, saved, name=name)

    def _uses(self, mission: Mission, item: Item) -> bool:
        """Let the mission use exactly the places named in the file; returns whether that changes anything."""
        if (wanted := item.values.get("places")) is None:
            return False
        for name in wanted:
            if name not in self._place_ids:
                path = f"{item.path}.places"
                raise InvalidInput(path, "{path}: there is no place {name}", path=path, name=name)
        return group_edit.use_places(self._edit, mission, {self._place_ids[name] for name in wanted})

    # ------------------------------------------------------------------ missions
    def _mission(self, item: Item) -> Iterator[Message]:
        name, owner = item.values["name"], item.values.get("robot")
        robot = None if owner is None else self._robot_named(owner, f"{item.path}.robot")
        robot_id = robot.id if robot else None
        stored = item.of(self._edit.missions.by_name(self._edit.c, name, robot_id))
        saved = mission_edit.save(self._edit, replace(stored or Mission(name, "", robot_id=robot_id), **item.changes))
        more = [message("Places")] * self._uses(saved, item)
        if robot is None:
            return import_lines.line("missions", stored, saved, more, name=name)
        return import_lines.line("missions.own", stored, saved, more, name=name, robot=robot.name)

    # ------------------------------------------------------------------ schedules
    def _schedule(self, item: Item) -> Iterator[Message]:
        entry = item.values
        stored = item.of(self._stored(entry.get("name") or ""))
        target = self._target(item, stored)
        values = item.changes
        if "robot" in entry or "group" in entry:
            values |= {
                "robot_id": target.id if isinstance(target, Robot) else None,
                "group_id": target.id if isinstance(target, Group) else None,
            }
        if "mission" in entry:
            values["mission_id"] = self._mission_named(entry["mission"], target, f"{item.path}.mission").id
        if "robot" in entry:
            values.setdefault("finish_by_minutes", None)
        name = entry.get("name") or self._name_of_unnamed(target, values)
        self._taken.add(name)
        stored = stored or self._stored(name)
        defaults = {"name": name, "timezone": self._edit.settings.timezone}
        entered = replace(stored, **values) if stored else Schedule(**{**defaults, **values})
        saved = schedule_edit.save(self._edit, entered)
        if parameter_check.needs_check(saved, stored):
            self._to_check.append((item, saved))
        return import_lines.line("schedules", stored, saved, name=name)

    def _target(self, item: Item, stored: Schedule | None) -> Robot | Group:
        entry, edit = item.values, self._edit
        if stored is not None and "robot" not in entry and "group" not in entry:
            return edit.target_of(stored)
        if ("robot" in entry) is ("group" in entry):
            raise InvalidInput(f"{item.path}.robot", "{path}: name either a robot or a group", path=item.path)
        if "robot" in entry:
            return self._robot_named(entry["robot"], f"{item.path}.robot")
        path, name = f"{item.path}.group", entry["group"]
        found = edit.groups.by_name(edit.c, name)
        return existing(found, path, "{path}: there is no group {name}", path=path, name=name)

    def _name_of_unnamed(self, target: Robot | Group, values: dict[str, Any]) -> str:
        mission_id: int = values["mission_id"]
        unnamed = self._unnamed.get((target.name, mission_id))
        if unnamed is None:
            generated = names.generated(self._edit.the(Mission, mission_id).name, target.name)
            unnamed = self._unnamed[target.name, mission_id] = Unnamed(generated, self._taken, self._stored)
        return unnamed.name_of(values)

    def _stored(self, name: str) -> Schedule | None:
        return self._edit.schedules.by_name(self._edit.c, name)

    # ------------------------------------------------------------------ names
    def _robot_named(self, name: str, path: str) -> Robot:
        return existing(
            self._edit.robots.by_name(self._edit.c, name),
            path,
            "{path}: there is no robot {name}, add it or write the name that it has now",
            path=path,
            name=name,
        )

    def _mission_named(self, name: str, target: Robot | Group, path: str) -> Mission:
        missions, c = self._edit.missions, self._edit.c
        return existing(
            missions.for_robot(c, name, target.id) if isinstance(target, Robot) else missions.by_name(c, name),
            path,
            "{path}: there is no mission {name} for {robot}, add it or write the name that it has now",
            path=path,
            name=name,
            robot=target.name,
        )


def _day(item: Item) -> DayException:
    with placed(item):
        return validation.day_exception(DayException(**{"last_day": item.values["first_day"], **item.changes}))


def _check_no_doubles(lists: Mapping[str, Sequence[Item]]) -> None:
    """Names are the identity, so one file can't describe the same object twice."""
    for section, items in lists.items():
        keys = ("name", "robot") if section == "missions" else ("name",)
        seen: set[tuple[object, ...]] = set()
        for item in items:
            identity = tuple(item.values.get(key) for key in keys)
            if identity[0] is not None and identity in seen:
                raise InvalidInput(
                    f"{item.path}.name",
                    "{path}.name: {name} appears twice in the file",
                    path=item.path,
                    name=identity[0],
                )
            seen.add(identity)
