"""A robot's answers as frozen values. Everything that is null or missing with some software versions is Optional.

Texts are cleaned (no control characters, at most 500 characters) and the robot's templates are resolved in them.
Instants of the robot are naive times of its own clock, which may be wrong: only differences between instants of one
item mean anything.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import Enum, IntEnum, StrEnum
from typing import Any, NamedTuple

from app.domain.message import Message, message

# types of positions in front of markers, chargers and lifts: no destination of their own
ENTRIES = frozenset({1, 8, 21, 26})
POSITIONS = ("position", "marker")  # parameters of actions whose value is the guid of a position
FARTHEST = 10_000.0  # m between two spots of one map


class RobotState(IntEnum):
    """``state_id`` of ``/status``. A number that is not in MiR's table is ``UNKNOWN``."""

    UNKNOWN = 0
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


@dataclass(frozen=True)
class RobotProblem:
    """One entry of the status's ``errors``."""

    code: int | None = None
    description: str = ""
    module: str = ""
    resettable: bool = True  # non_resettable exists from software 2.14.7 on


@dataclass(frozen=True)
class UserPrompt:
    """A question of a running mission that waits for an answer."""

    guid: str
    question: str
    options: tuple[str, ...] = ()
    timeout_s: float | None = None
    more_options: int = 0  # that are not among ``options``: too many, too long, or of what can't be shown


@dataclass(frozen=True)
class Pose:
    """Position on the map in m, orientation in degrees −180…180."""

    x: float
    y: float
    orientation: float


@dataclass(frozen=True)
class RobotStatus:
    """One answer of ``/status``."""

    state: RobotState = RobotState.UNKNOWN
    state_text: str = ""
    mission_text: str = ""
    mission_queue_id: int | None = None  # of what runs now
    battery_percentage: float | None = (
        None  # 0–100; None while unknown (the emergency stop cuts the battery monitor: −1)
    )
    battery_time_remaining_s: float | None = None
    robot_name: str = ""
    robot_model: str = ""
    serial_number: str | None = None
    errors: tuple[RobotProblem, ...] = ()
    user_prompt: UserPrompt | None = None
    position: Pose | None = None
    map_id: str | None = None
    distance_to_next_target: float | None = None  # m
    moved: float | None = None  # m, odometer
    uptime_s: float | None = None
    software: str | None = None  # header Robot-Version
    date: datetime | None = None  # header Date, aware UTC: the robot's clock when it answered
    elapsed_s: float = 0.0  # from asking to the whole answer

    @property
    def spot(self) -> Spot | None:
        """Where it is."""
        return (
            None
            if self.position is None or self.map_id is None
            else Spot(self.map_id, self.position.x, self.position.y)
        )

    def has_booted_since(self, uptime_s: float | None) -> bool:
        """``uptime_s``: how long it had been on before; if that or the present value is unknown, no boot is
        detected."""
        return uptime_s is not None and self.uptime_s is not None and self.uptime_s < uptime_s


class QueueState(Enum):
    """State of a queue item. In the short state ``Abort`` the reason is not known yet: message and times come with ``Aborted``."""

    PENDING = "Pending"
    EXECUTING = "Executing"
    DONE = "Done"
    ABORTING = "Abort"
    ABORTED = "Aborted"
    UNKNOWN = ""

    @property
    def is_open(self) -> bool:
        return self in (QueueState.PENDING, QueueState.EXECUTING)


@dataclass(frozen=True)
class QueueItem:
    """One entry of the robot's own queue, ours or anyone's."""

    id: int
    state: QueueState = QueueState.UNKNOWN
    state_text: str = ""  # the robot's word for it; "" in a list: only its number can tell
    mission_id: str | None = None
    message: str = ""  # how it went, written by the robot
    description: str = ""  # holds our token
    parameters: tuple[Any, ...] = ()
    priority: int | None = None
    ordered: datetime | None = None
    started: datetime | None = None
    finished: datetime | None = None
    created_by_name: str = ""
    vehicle: str = ""  # of a fleet's order: the id and name of the robot that has it; "" for none yet
    vehicle_name: str = ""

    @property
    def is_pending(self) -> bool:
        return self.state is QueueState.PENDING

    @property
    def has_token(self) -> bool:
        """Of this app, or of another copy of it."""
        return len(self.description) == 36 and self.description.count("-") == 4

    @property
    def may_be_open(self) -> bool:
        return self.state.is_open or (self.state is QueueState.UNKNOWN and self.finished is None)


@dataclass(frozen=True)
class MissionInfo:
    """A mission that the robot has."""

    guid: str
    name: str

    @property
    def is_built_in(self) -> bool:
        """Whether every robot has it, hidden on its own screen."""
        return self.guid.startswith("mirconst")


@dataclass(frozen=True)
class MissionParameter:
    """An input that must be given when the mission is queued, as ``{"input_name": name, "value": …}``."""

    name: str
    label: str = ""
    type: str = ""  # the robot's name of the type, empty when it gives none
    default: Any = None
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[tuple[Any, str], ...] = ()  # (value, label); of positions those on the robot's present map
    on_other_maps: tuple[tuple[Any, str], ...] = ()  # the same of positions on its other maps
    sets: str = ""  # the parameter of an action that it sets, as MiR calls it: position, x, time …
    unit: str = ""  # of a number

    @property
    def is_position(self) -> bool:
        """Whether the robot wants the guid of a position on its map."""
        return self.sets in POSITIONS

    def value_of(self, entered: Any) -> Any:
        """The choice with the value ``entered``, or with it as its label; None if there is no such choice."""
        if any(entered == value and type(entered) is type(value) for value, _label in self.choices):
            return entered
        word = str(entered).strip().casefold()
        for places in (self.choices, self.on_other_maps):
            named = [value for value, label in places if word in (label.casefold(), str(value).casefold())]
            if named:
                return named[0] if len(named) == 1 else None
        return None


class IdentifiedBy(StrEnum):
    """What shows, before credentials are sent, that the machine at an address is the robot."""

    SERIAL_NUMBER = "serial_number"  # in its status, which needs no credentials
    CERTIFICATE = "certificate"  # of HTTPS
    ADDRESS = "address"  # only the address: it gives no status without credentials, or no serial number


@dataclass(frozen=True)
class Vehicle:
    """A robot as its fleet lists it. ``id``: as orders name it there. ``ip``: as far as the fleet says."""

    id: str
    name: str
    serial_number: str | None = None
    model: str | None = None
    ip: str = ""


@dataclass(frozen=True)
class FleetIdentity:
    """What a fleet says of itself, and its robots; asked with credentials, so a wrong password is noticed."""

    identity: str | None  # what tells it from others
    software: str | None
    vehicles: tuple[Vehicle, ...] = ()


@dataclass(frozen=True)
class Identity:
    """Who answers at an address; asked with credentials, so a wrong password is noticed."""

    status: RobotStatus
    user_name: str = ""
    software: str | None = None
    identified_by: IdentifiedBy = IdentifiedBy.ADDRESS

    @property
    def name(self) -> str:
        return self.status.robot_name

    @property
    def model(self) -> str | None:
        return self.status.robot_model or None

    @property
    def serial_number(self) -> str | None:
        return self.status.serial_number


class Spot(NamedTuple):
    """Where something is: metres on a map."""

    map_id: str
    x: float
    y: float


def straight_way(here: Spot | None, there: Spot | None) -> float | None:
    """Metres; None if one of them is unknown, they are on different maps, or it is impossible."""
    if here is None or there is None or here.map_id != there.map_id:
        return None
    metres = math.hypot(here.x - there.x, here.y - there.y)
    return metres if metres <= FARTHEST else None


@dataclass(frozen=True)
class Stop:
    """A position that a mission drives to, by its guid, which is empty for other goals: a parameter, or coordinates.
    Without a ``name`` it is unknown, or the entry of a marker or charger, where no robot stays."""

    position: str = ""
    name: str = ""
    spot: Spot | None = None


@dataclass(frozen=True)
class MissionActions:
    """What the actions of a mission are. ``charges``: it only brings the robot to its charger. ``drives_to``: guids of
    positions in order, empty ones as in ``Stop``."""

    charges: bool = False
    drives_to: tuple[str, ...] = ()


@dataclass(frozen=True)
class RobotMap:
    """A map as PNG. ``origin`` is the pose of the picture's lower left corner in the map's frame (ROS convention)."""

    guid: str
    name: str
    png: bytes = field(repr=False)
    resolution: float = 0.05  # m per pixel
    origin: Pose = Pose(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class MapPosition:
    """A named place on a map; coordinates only where the robot gives them in the list."""

    guid: str
    name: str
    type_id: int | None = None
    map_id: str | None = None
    pose: Pose | None = None

    @property
    def spot(self) -> Spot | None:
        return None if self.pose is None or self.map_id is None else Spot(self.map_id, self.pose.x, self.pose.y)


MOST_PROBLEMS = 3
LONGEST_PROBLEMS = 280  # characters, so that the number of the others fits into 300


def problems_in_words(problems: Sequence[RobotProblem]) -> Message:
    """The first different ones, each with its code, and the number of others; empty without texts."""
    found = list(dict.fromkeys(filter(None, map(_described, problems))))
    shown = found[:MOST_PROBLEMS]
    while len(shown) > 1 and len(" · ".join(shown)) > LONGEST_PROBLEMS:
        shown.pop()
    text, more = clipped(" · ".join(shown), LONGEST_PROBLEMS), len(found) - len(shown)
    return message("{problems} … and {count} more", problems=text, count=more) if more else text


def _described(problem: RobotProblem) -> str:
    """In the robot's words, with the number under which its manual has it."""
    text, number = problem.description or problem.module, "" if problem.code is None else f" ({problem.code})"
    return (clipped(text, LONGEST_PROBLEMS - len(number)) + number).strip()


def clipped(text: str, longest: int) -> str:
    """The text, or its beginning."""
    return text if len(text) <= longest else text[: longest - 1] + "…"
