"""The robot's states, modes, errors and user prompts."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any


class StateId(IntEnum):
    """``state_id`` of /status. Robots are nearly always in 3, 4, 5, 10, 11 or 12; the others are short."""

    STARTING = 1
    SHUTTING_DOWN = 2
    READY = 3
    PAUSE = 4
    EXECUTING = 5
    ABORTED = 6
    COMPLETED = 7
    DOCKED = 8
    DOCKING = 9
    EMERGENCY_STOP = 10
    MANUAL_CONTROL = 11
    ERROR = 12

    @property
    def text(self) -> str:
        """``state_text``; recorded for Ready, Pause, Executing, EmergencyStop and Error, guessed for the rest."""
        return "".join(word.capitalize() for word in self.name.split("_"))


class ModeId(IntEnum):
    """``mode_id`` of /status."""

    MAPPING = 3
    MISSION = 7

    @property
    def text(self) -> str:
        return self.name.capitalize()


MISSION_CONTROLLER = 10120  # the mission could not continue, for example because a goal was not reached (recorded)


@dataclass(frozen=True)
class RobotError:
    """One entry of ``errors``. ``at`` is the simulated second at which the robot had it."""

    code: int
    description: str
    module: str = "MissionController"
    non_resettable: bool = False
    at: float = field(default=0.0, compare=False)

    def full(self) -> dict[str, Any]:
        return {
            "code": self.code,
            "description": self.description,
            "module": self.module,
            "non_resettable": self.non_resettable,
        }


BATTERY_EMPTY = RobotError(10001, "Battery is empty", "Battery")  # code and text are a guess


@dataclass
class Prompt:
    """A question to a person. ``expires`` is a simulated second; With ``blocks`` the missions wait for it, although none of them asked."""

    guid: str
    question: str
    options: list[str]
    timeout: float
    expires: float
    user_group: str
    blocks: bool = False

    def full(self) -> dict[str, Any]:
        return {
            "guid": self.guid,
            "user_group": self.user_group,
            "question": self.question,
            "timeout": self.timeout,
            "options": self.options,
        }
