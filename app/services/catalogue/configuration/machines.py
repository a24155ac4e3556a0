"""The fleets and robots of a configuration file: added and changed first, then compared, as they may swap addresses."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from typing import TypeVar

from app.domain.message import Message
from app.domain.models import Fleet, InvalidInput, Robot, existing
from app.services.catalogue import fields, fleet_edit, robot_edit, validation
from app.services.catalogue.configuration import import_lines
from app.services.catalogue.configuration.document import Document
from app.services.catalogue.edit import Edit
from app.services.catalogue.fields import Item, placed

T = TypeVar("T", Fleet, Robot)


class Machines:
    def __init__(self, edit: Edit, document: Document) -> None:
        self._edit = edit
        self._fleets = [(item, edit.fleets.by_name(edit.c, item.values["name"])) for item in document.lists["fleets"]]
        self._robots = [(item, edit.robots.by_name(edit.c, item.values["name"])) for item in document.lists["robots"]]

    def take(self) -> None:
        """Add and change all of them. Raises InvalidInput."""
        for item, fleet in self._fleets:
            with placed(item):
                self._machine(item, item.of(fleet) or Fleet("", ""), fleet_edit.save)
        for item, robot in self._robots:
            with placed(item):
                if "fleet" in item.values or (robot is not None and robot.fleet is not None):
                    self._robot_of_fleet(item, robot)
                else:
                    self._machine(item, item.of(robot) or Robot("", ""), robot_edit.save)
        self._check_addresses()

    def lines(self) -> list[Message]:
        """What has changed of them."""
        fleets = {fleet.name: fleet for fleet in self._edit.fleets.all(self._edit.c)}
        robots = {robot.name: robot for robot in self._edit.robots.all(self._edit.c)}
        return [
            *(
                line
                for item, before in self._fleets
                for line in import_lines.of_machine("fleets", before, fleets[item.values["name"]])
            ),
            *(
                line
                for item, before in self._robots
                for line in import_lines.of_machine("robots", before, robots[item.values["name"]])
            ),
        ]

    def _machine(self, item: Item, stored: T, save: Callable[..., T]) -> None:
        password = item.values.get("password")
        saved = save(self._edit, replace(stored, **item.changes), password, is_one_of_many=True)
        if password is not None and item.values.get("enabled") is False and saved.enabled:
            save(self._edit, replace(saved, enabled=False))

    def _robot_of_fleet(self, item: Item, stored: Robot | None) -> None:
        """``enabled`` is its own switch, also while its fleet is off."""
        for key in fields.OF_FLEET:
            if key in item.values:
                path = f"{item.path}.{key}"
                raise InvalidInput(path, "{path}: a robot of a fleet has this from the fleet, leave it out", path=path)
        robot = stored or Robot("", "")
        if "fleet" in item.values:
            robot = replace(robot, fleet=self._fleet_named(item.values["fleet"], f"{item.path}.fleet"))
        if "enabled" in item.values:
            robot = replace(robot, off_with_fleet=False)
        robot_edit.save(self._edit, replace(robot, **item.changes), is_one_of_many=True)

    def _fleet_named(self, name: str, path: str) -> Fleet:
        return existing(
            self._edit.fleets.by_name(self._edit.c, name),
            path,
            "{path}: there is no fleet {name}, add it or write the name that it has now",
            path=path,
            name=name,
        )

    # ------------------------------------------------------------------ compared
    def _check_addresses(self) -> None:
        edit = self._edit
        present: list[Robot | Fleet] = [*edit.fleets.all(edit.c), *edit.robots.all(edit.c)]
        named = {(type(each), each.name): each for each in present}
        in_file = {item.values["name"] for item, _stored in self._robots}
        for kind, found in ((Fleet, self._fleets), (Robot, self._robots)):
            for item, before in found:
                it = named[kind, item.values["name"]]
                if before is None or it.address != before.address:
                    with placed(item):
                        _check_is_no_other(it, present, in_file if before is None else None)


def _check_is_no_other(it: Robot | Fleet, others: Iterable[Robot | Fleet], known: Collection[str] | None) -> None:
    """A robot that is not ``known`` by its name may be the same one, renamed."""
    for other in others:
        try:
            validation.check_is_no_other(it, [other])
        except InvalidInput as problem:
            may_be_renamed = isinstance(it, Robot) and isinstance(other, Robot) and problem.field == "address"
            if not may_be_renamed or known is None or other.name in known:
                raise
            raise InvalidInput(
                "address",
                "{name} has the address of {robot}, which is configured already: if it is the same one, "
                "write {robot} in the file",
                name=it.name,
                robot=other.name,
            ) from problem
