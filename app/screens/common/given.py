"""What missions were given, in words: "Go to position · Dock 3". Values are kept as robots want them, a position as its identifier; only a
robot knows what it calls that, so a screen asks for what it shows, seldom."""
from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from app.domain.clock import Clock
from app.domain.models import Robot
from app.domain.robot import MissionParameter
from app.i18n import _
from app.screens.common import formats
from app.screens.common.shell import Shell
from app.services.robots.missions import RobotMissions

ASK_AGAIN_AFTER = 300.0                  # s, for a name that the robot has not told
LONGEST_BESIDE = 32                      # characters of a value beside the mission's name
_IDENTIFIER = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", re.IGNORECASE)

Start = tuple[int | None, str, Mapping[str, Any]]        # robot, guid of the mission, what it is given


@dataclass(frozen=True)
class Given:
    """What is known of it. An identifier without a known name is never shown."""
    parameters: Mapping[str, Sequence[MissionParameter]] = field(default_factory=dict)       # by guid of the mission
    names: Mapping[object, str] = field(default_factory=dict)                                # of positions, by identifier

    def line(self, guid: str, values: Mapping[str, Any]) -> str:
        """Position: Dock 3 · Pallets: 2"""
        labels = {parameter.name: parameter.label for parameter in self.parameters.get(guid, ())}
        return " · ".join(f"{labels.get(name) or name}: {self._word(guid, name, value) or formats.NOTHING}"
                          for name, value in values.items())

    def beside(self, mission: str, guid: str, values: Mapping[str, Any]) -> str:
        """Go to position · Dock 3"""
        words = (self._word(guid, name, value) for name, value in values.items())
        return " · ".join((mission, *(f"{word[:LONGEST_BESIDE]}…" if len(word) > LONGEST_BESIDE else word for word in words if word)))

    def lacks(self, values: Mapping[str, Any]) -> bool:
        """Whether there is one of which only a robot knows the name."""
        return any(_IDENTIFIER.fullmatch(str(value)) and value not in self.names for value in values.values())

    def _word(self, guid: str, name: str, value: Any) -> str:
        parameter = next((each for each in self.parameters.get(guid, ()) if each.name == name), MissionParameter(name))
        if known := next((label for key, label in parameter.choices if key == value and type(key) is type(value)),
                          self.names.get(str(value))):
            return known
        if value is None:
            return ""
        if isinstance(value, bool):
            return _("Yes") if value else _("No")
        text = formats.plain(value) if isinstance(value, float) else str(value).removesuffix(".000000")      # of a duration
        return "" if _IDENTIFIER.fullmatch(text) else " ".join(filter(None, (text, parameter.unit)))


NOTHING_KNOWN = Given()


class GivenNames:
    """``learnt()`` is called when ``known`` has become more."""

    def __init__(self, missions: RobotMissions, clock: Clock, shell: Shell, learnt: Callable[[], object]) -> None:
        self._missions, self._clock, self._shell, self._learnt = missions, clock, shell, learnt
        self.known = Given()
        self._ask_at: dict[tuple[int, str], float] = {}

    def look(self, robots: Iterable[Robot], starts: Iterable[Start]) -> None:
        """Ask these robots, as far as they are switched on, for what these starts lack."""
        on = {robot.id for robot in robots if robot.enabled}
        for robot_id, guid, values in starts:
            if robot_id is None or robot_id not in on or not self.known.lacks(values):
                continue
            now = self._clock.monotonic()
            if now < self._ask_at.get((robot_id, guid), now):
                continue
            self._ask_at[robot_id, guid] = now + ASK_AGAIN_AFTER
            self._shell.background.run(partial(self._missions.parameters, robot_id, guid), partial(self._take, guid),
                                       lambda _problem: None, apart="given")

    def _take(self, guid: str, found: Sequence[MissionParameter]) -> None:
        names = {key: label for parameter in found for key, label in parameter.choices if _IDENTIFIER.fullmatch(str(key))}
        self.known = replace(self.known, parameters={**self.known.parameters, guid: found}, names={**self.known.names, **names})
        self._learnt()
