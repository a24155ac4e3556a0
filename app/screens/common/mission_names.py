"""Missions with their values in words: "Go to position · Dock 3", wherever a mission with values is named. Values are
stored as robots need them, a position as its guid. Only robots know the names, so a screen asks for those it shows,
rarely, and all screens share the answers (``Shell.given``)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from app.domain.clock import Clock
from app.domain.execution import Execution
from app.domain.models import Group, Mission, Robot, Schedule
from app.domain.names import own_schedule_name
from app.domain.parameters import IDENTIFIER
from app.domain.robot import MissionParameter
from app.i18n import _
from app.screens.common import formats

if TYPE_CHECKING:
    from app.screens.common.shell import Shell
    from app.services.planning.planned import PlannedRun
    from app.services.robots.missions import RobotMissions

ASK_AGAIN_AFTER = 300.0  # s, for a name that the robot has not given
LONGEST_VALUE = 32  # characters of a value beside the mission's name

Start = tuple[int | None, str, Mapping[str, Any]]  # robot, guid of the mission, its values


@dataclass(frozen=True)
class MissionNames:
    """Known parameters and names. A guid without a known name is never shown."""

    parameters: Mapping[str, Sequence[MissionParameter]] = field(default_factory=dict)  # by guid of the mission
    names: Mapping[object, str] = field(default_factory=dict)  # of positions, by identifier

    def line(self, guid: str, values: Mapping[str, Any]) -> str:
        """Position: Dock 3 · Pallets: 2"""
        labels = {parameter.name: parameter.label for parameter in self.parameters.get(guid, ())}
        return " · ".join(
            f"{labels.get(name) or name}: {self._word(guid, name, value) or formats.NOTHING}"
            for name, value in values.items()
        )

    def run(self, execution: Execution) -> str:
        """Go to position · Dock 3"""
        return self._with_values(execution.mission, execution.mission_guid, execution.parameters)

    def start(self, run: PlannedRun) -> str:
        """The same for a future start."""
        return self.mission(run.mission, run.schedule.parameters)

    def mission(self, mission: Mission, values: Mapping[str, Any]) -> str:
        """The same for any mission with these values."""
        return self._with_values(mission.name, mission.guid, values)

    def schedule(self, schedule: Schedule, mission: Mission, target: Robot | Group) -> str:
        """Its name for people: the entered one, else mission and robot."""
        return own_schedule_name(schedule.name, mission.name, target.name) or _("{mission} on {robot}").format(
            mission=self.mission(mission, schedule.parameters), robot=target.name
        )

    def _with_values(self, mission: str, guid: str, values: Mapping[str, Any]) -> str:
        words = (self._word(guid, name, value) for name, value in values.items())
        return " · ".join(
            (mission, *(f"{word[:LONGEST_VALUE]}…" if len(word) > LONGEST_VALUE else word for word in words if word))
        )

    def lacks(self, values: Mapping[str, Any]) -> bool:
        """Whether one of the values has a name that only a robot knows."""
        return any(IDENTIFIER.fullmatch(str(value)) and value not in self.names for value in values.values())

    def positions_with(self, text: str) -> tuple[str, ...]:
        """Guids of positions with that text in their names, ignoring case."""
        wanted = text.strip().casefold()
        return tuple(str(key) for key, name in self.names.items() if wanted and wanted in name.casefold())

    def _word(self, guid: str, name: str, value: Any) -> str:
        parameter = next((each for each in self.parameters.get(guid, ()) if each.name == name), MissionParameter(name))
        if known := next(
            (label for key, label in parameter.choices if key == value and type(key) is type(value)),
            self.names.get(str(value)),
        ):
            return known
        if value is None:
            return ""
        if isinstance(value, bool):
            return _("Yes") if value else _("No")
        text = formats.plain(value) if isinstance(value, float) else str(value).removesuffix(".000000")  # of a duration
        return "" if IDENTIFIER.fullmatch(text) else " ".join(filter(None, (text, parameter.unit)))


NOTHING_KNOWN = MissionNames()


class SharedMissionNames:
    """What robots have said about it, to any screen."""

    def __init__(self) -> None:
        self.known = NOTHING_KNOWN

    def take(self, guid: str, found: Sequence[MissionParameter]) -> None:
        """The parameters of this mission, according to a robot."""
        names = {
            key: label for parameter in found for key, label in parameter.choices if IDENTIFIER.fullmatch(str(key))
        }
        self.known = replace(
            self.known, parameters={**self.known.parameters, guid: found}, names={**self.known.names, **names}
        )

    def take_stored(self, guid: str, found: Sequence[MissionParameter] | None) -> Sequence[MissionParameter] | None:
        """What was said earlier, if nothing is known yet. Returns what is known then."""
        if found is not None and guid not in self.known.parameters:
            self.take(guid, found)
        return self.known.parameters.get(guid)


class MissionNameLookup:
    """Asks for what a screen shows; ``learnt()`` is called when more is known."""

    def __init__(self, missions: RobotMissions, clock: Clock, shell: Shell, on_change: Callable[[], object]) -> None:
        self._missions, self._clock, self._shell, self._on_change = missions, clock, shell, on_change
        self._ask_at: dict[tuple[int, str], float] = {}

    def look(self, robots: Iterable[Robot], starts: Iterable[Start]) -> None:
        """Ask these robots, as far as they are switched on, for what these starts lack."""
        on = {robot.id for robot in robots if robot.enabled}
        for robot_id, guid, values in starts:
            if robot_id is None or robot_id not in on or not self._shell.mission_names.known.lacks(values):
                continue
            now = self._clock.monotonic()
            if now < self._ask_at.get((robot_id, guid), now):
                continue
            self._ask_at[robot_id, guid] = now + ASK_AGAIN_AFTER
            self._shell.background.run(
                partial(self._missions.parameters, robot_id, guid),
                partial(self._take, guid),
                lambda _problem: None,
                apart="mission names",
            )

    def _take(self, guid: str, found: Sequence[MissionParameter]) -> None:
        self._shell.mission_names.take(guid, found)
        self._on_change()
