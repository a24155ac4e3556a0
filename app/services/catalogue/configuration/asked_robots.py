"""What robots say about missions while a file is imported: each is asked once for each mission, many at a time, for
some seconds in all. A silent robot does not stop the import: it is asked again before the mission starts."""

from __future__ import annotations

import time
from collections.abc import Sequence

from app.domain.models import Robot
from app.domain.robot import MissionParameter
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.fields import Item, at
from app.services.catalogue.parameter_check import Checked
from app.services.live.mission_parameters import ANSWER_TIMEOUT, Answers

Wanted = Sequence[tuple[Robot, Sequence[str]]]


class MoreToAsk(Exception):
    """Robots, with guids of missions, that have to be asked before a file can be judged."""

    def __init__(self, wanted: Wanted) -> None:
        super().__init__()
        self.wanted = wanted


class AskedRobots:
    def __init__(self, catalogue: Catalogue) -> None:
        self._catalogue = catalogue
        self._said = Answers()
        self._robots: dict[int, Robot] = {}  # those that were asked, as they are in the file
        self._asked: set[tuple[int, str]] = set()
        self._known: dict[tuple[int, str], Sequence[MissionParameter] | None] = {}  # until more is said
        self._until = 0.0

    def known(self, robot: Robot, guid: str) -> Sequence[MissionParameter] | None:
        key = robot.id, guid
        if key not in self._known:
            said = self._said.get(key)
            self._known[key] = said if said is not None else self._catalogue.known_parameters(robot, guid)
        return self._known[key]

    def judge(self, doubts: Sequence[tuple[Item, Checked]]) -> None:
        """Raises InvalidInput for the first that a robot refuses, MoreToAsk if another answer may change that."""
        wanted: dict[int, tuple[Robot, dict[str, None]]] = {}
        for _item, checked in doubts:
            for robot, guid in checked.to_ask:
                if (robot.id, guid) not in self._asked and self._catalogue.parameters is not None:
                    wanted.setdefault(robot.id, (robot, {}))[1][guid] = None
        if wanted:
            raise MoreToAsk([(robot, list(guids)) for robot, guids in wanted.values()])
        for item, checked in doubts:
            if checked.problem is not None:
                raise at(f"{item.path}.{checked.problem.field}", checked.problem)

    def ask(self, more: MoreToAsk) -> None:
        self._known.clear()
        self._until = self._until or time.monotonic() + ANSWER_TIMEOUT
        self._robots |= {robot.id: robot for robot, _guids in more.wanted}
        self._asked |= {(robot.id, guid) for robot, guids in more.wanted for guid in guids}
        if self._catalogue.parameters is not None:
            self._said |= self._catalogue.parameters.ask(more.wanted, self._until - time.monotonic())

    def keep(self) -> None:
        """When the file is imported, and its robots are there."""
        if self._catalogue.parameters is None or not self._said:
            return
        stored = {(robot.name, robot.address): robot.id for robot in self._catalogue.robots()}
        there = {asked.id: stored.get((asked.name, asked.address)) for asked in self._robots.values()}
        self._catalogue.parameters.keep(
            {
                (robot_id, guid): found
                for (asked_id, guid), found in self._said.items()
                if (robot_id := there[asked_id]) is not None
            }
        )
