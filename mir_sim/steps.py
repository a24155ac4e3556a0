"""The actions of a mission in execution: how long each takes, what the robot shows while it runs, and its effect."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from mir_sim import power, world
from mir_sim.mission_queue import MissionQueue
from mir_sim.motion import Motion, Pose, Trip
from mir_sim.site import Site
from mir_sim.state import Prompt, StateId

PLANNING = 2.0  # s of path planning before a drive, even to where the robot is already
DOCKING_SPEED = 0.25  # m/s on the last metres to a marker
DOCKING_DISTANCE = 1.5  # m that are driven at that speed
LARGEST = 1e7  # accepted number in an action, in any unit
SHOWN_DOCKED = 3.0  # s in state Docked after the charger was reached


class UnknownPosition(Exception):
    """The action names a position that the robot doesn't have."""


class Robot(Protocol):
    """What a step may ask of the robot that runs it. ``now`` is in simulated seconds."""

    now: float
    queue: MissionQueue
    battery: power.Battery
    site: Site
    prompt: Prompt | None

    @property
    def pose(self) -> Pose: ...

    def ask(self, question: str, options: list[str], timeout: float) -> Prompt: ...

    def withdraw_prompt(self, guid: str) -> None: ...

    def set_register(self, register: int, value: float) -> None: ...


@dataclass
class Step:
    """One action under way. ``duration`` is in active seconds, which don't pass while missions are held."""

    duration: float
    label: str = ""
    battery_rate: ClassVar[float] = power.STANDING  # percent per second

    @property
    def length(self) -> float:
        """Metres that it drives in total."""
        return 0.0

    def begin(self, robot: Robot) -> None:
        """Start, from the robot's present pose."""

    def ends_at(self, robot: Robot, since: float, done: float) -> float | None:
        """Simulated second at which it ends unless it is held, or None when that isn't known yet.

        Args:
            since: simulated second at which the step was begun or resumed.
            done: active seconds it had had by then.
        """
        return since + self.duration - done

    def state(self, elapsed: float) -> StateId:
        return StateId.EXECUTING

    def text(self, robot: Robot, elapsed: float) -> str:
        return self.label

    def motion(self, elapsed: float) -> Motion | None:
        """Pose and speed of the robot, or None for a step that doesn't move it."""
        return None

    def finish(self, robot: Robot) -> None:
        """Produce the effect of the action."""


class MoveStep(Step):
    """Drive along the aisle to a position."""

    battery_rate = power.DRIVING

    def __init__(self, name: str, goal: Pose) -> None:
        super().__init__(0.0, name)
        self.goal = goal
        self.trip = Trip(goal, [])

    def begin(self, robot: Robot) -> None:
        start = robot.pose
        self.trip = Trip(start, world.route(start, self.goal.x, self.goal.y), self.goal.orientation)
        self.duration = PLANNING + self.trip.duration

    @property
    def length(self) -> float:
        return self.trip.length

    def motion(self, elapsed: float) -> Motion:
        return self.trip.at(max(0.0, elapsed - PLANNING))

    def text(self, robot: Robot, elapsed: float) -> str:
        left = self.length - self.motion(elapsed).travelled
        return f"Moving to '{self.label}' ({left:.1f} meters to goal)"


class DockStep(MoveStep):
    """Drive to a marker and approach it slowly."""

    approach = Trip(Pose(0, 0, 0), [])

    @property
    def length(self) -> float:
        return self.trip.length + self.approach.length

    def begin(self, robot: Robot) -> None:
        start, goal = robot.pose, self.goal
        side = DOCKING_DISTANCE if goal.y < world.AISLE else -DOCKING_DISTANCE
        entry = (goal.x, goal.y + side)
        self.trip = Trip(start, world.route(start, *entry))
        self.approach = Trip(self.trip.goal, [(goal.x, goal.y)], goal.orientation, cruise=DOCKING_SPEED)
        self.duration = PLANNING + self.trip.duration + self.approach.duration

    def _docking(self, elapsed: float) -> float:
        """Seconds since the slow approach began; negative before."""
        return elapsed - PLANNING - self.trip.duration

    def motion(self, elapsed: float) -> Motion:
        docking = self._docking(elapsed)
        if docking < 0:
            return super().motion(elapsed)
        near = self.approach.at(docking)
        return Motion(near.pose, near.linear, near.angular, self.trip.length + near.travelled)

    def state(self, elapsed: float) -> StateId:
        return StateId.EXECUTING if self._docking(elapsed) < 0 else StateId.DOCKING

    def text(self, robot: Robot, elapsed: float) -> str:
        return super().text(robot, elapsed) if self._docking(elapsed) < 0 else f"Docking to '{self.label}'"


class ChargeStep(Step):
    """Charge for a time and up to a level, or until another mission is queued: without one it never ends."""

    battery_rate = power.CHARGING

    def __init__(self, minimum_time: float, percentage: float, until_new_mission: bool) -> None:
        super().__init__(minimum_time)
        self.percentage = percentage
        self.until_new_mission = until_new_mission

    def ends_at(self, robot: Robot, since: float, done: float) -> float | None:
        if self.until_new_mission:
            return robot.now if robot.queue.pending() else None
        charged = robot.battery.time_of(self.percentage)
        return max(since + self.duration - done, charged if charged is not None else since)

    def state(self, elapsed: float) -> StateId:
        return StateId.DOCKED if elapsed < SHOWN_DOCKED else StateId.EXECUTING

    def text(self, robot: Robot, elapsed: float) -> str:
        level = robot.battery.at(robot.now)
        if level < self.percentage:
            return f"Charging until battery reaches {self.percentage:.0f}% (Current: {level:.0f}%)..."
        return "Charging... Waiting for new mission..." if self.until_new_mission else "Charging..."


class PromptStep(Step):
    """Show a prompt and wait for the answer; without one the mission continues when the prompt times out."""

    def __init__(self, question: str, timeout: float) -> None:
        super().__init__(0.0, "Waiting for user input")
        self.question = question
        self.timeout = timeout
        self._guid = ""

    def begin(self, robot: Robot) -> None:
        self._guid = robot.ask(self.question, ["Yes", "No"], self.timeout).guid

    def ends_at(self, robot: Robot, since: float, done: float) -> float | None:
        waiting = robot.prompt is not None and robot.prompt.guid == self._guid
        return None if waiting else robot.now

    def finish(self, robot: Robot) -> None:
        robot.withdraw_prompt(self._guid)


class RegisterStep(Step):
    """Write a PLC register."""

    def __init__(self, register: int, value: float) -> None:
        super().__init__(0.1, f"Setting register {register}")
        self.register = register
        self.value = value

    def finish(self, robot: Robot) -> None:
        robot.set_register(self.register, self.value)


def _number(value: Any) -> float:
    """Convert to a number no larger than ``LARGEST``. Raises ValueError or TypeError when that is not possible."""
    number = float(value)
    if not abs(number) <= LARGEST:
        raise ValueError(f"{value!r} is out of bounds")
    return number


def seconds_of(value: Any) -> float:
    """Convert MiR's "HH:MM:SS.ffffff", or plain seconds, into seconds. Raises ValueError when it is neither."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return max(0.0, _number(value))
    match = re.fullmatch(r"(\d+):([0-5]?\d):([0-5]?\d(?:\.\d*)?)", str(value))
    if not match:
        raise ValueError(f"{value!r} is no duration of the form HH:MM:SS")
    hours, minutes, seconds = match.groups()
    return _number(int(hours) * 3600 + int(minutes) * 60 + float(seconds))


def _goal(robot: Robot, guid: Any) -> tuple[str, Pose]:
    row = robot.site.table("/positions").get(guid)
    if row is None:
        raise UnknownPosition(str(guid))
    return row["name"], Pose(row["pos_x"], row["pos_y"], row["orientation"])


def step_for(robot: Robot, action_type: str, values: Mapping[str, Any]) -> Step:
    """Make the step for an action. Action types that aren't simulated (sounds, lights, logic) take a second and do nothing.

    Raises:
        UnknownPosition: the position that it drives to doesn't exist.
        KeyError, ValueError, TypeError, OverflowError: a parameter is missing or has no usable value.
    """
    if action_type in ("move", "move_to"):
        return MoveStep(*_goal(robot, values.get("position")))
    if action_type == "move_to_position":
        return MoveStep(
            "coordinates", Pose(_number(values["x"]), _number(values["y"]), _number(values.get("orientation") or 0.0))
        )
    if action_type == "docking":
        return DockStep(*_goal(robot, values.get("marker")))
    if action_type == "wait":
        return Step(seconds_of(values["time"]), "Waiting")
    if action_type == "charging":
        return ChargeStep(
            seconds_of(values.get("minimum_time") or 0),
            min(100.0, _number(values.get("minimum_percentage") or 0)),
            bool(values.get("charge_until_new_mission")),
        )
    if action_type == "set_plc_register":
        return RegisterStep(int(_number(values["register"])), _number(values["value"]))
    if action_type == "prompt_user":
        return PromptStep(str(values.get("question", "")), seconds_of(values.get("timeout") or 60))
    return Step(1.0, action_type)
