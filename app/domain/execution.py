"""One run of a mission: what caused it, its states, why it waits or has ended. Instants and names as in ``models``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from types import MappingProxyType
from typing import Any

from app.domain import names


class Trigger(StrEnum):
    """What caused an execution."""

    SCHEDULED = "scheduled"
    MANUAL = "manual"
    IDLE = "idle"


class State(StrEnum):
    """State of an execution; docs/architecture.md has the diagram of its transitions."""

    WAITING = "waiting"
    SUBMITTING = "submitting"
    QUEUED = "queued"
    EXECUTING = "executing"
    COMPLETED = "completed"
    FAILED = "failed"
    CANCELLED = "cancelled"
    SKIPPED = "skipped"
    MISSED = "missed"

    @property
    def is_open(self) -> bool:
        return self in OPEN_STATES


OPEN_STATES = (State.WAITING, State.SUBMITTING, State.QUEUED, State.EXECUTING)
ENDED_STATES = tuple(state for state in State if state not in OPEN_STATES)
MUCH_LONGER = 1.5  # times the usual duration of a run, after which it is called late


class ReasonCode(StrEnum):
    """Why an execution is not completed: a closed list (docs/interfaces.md)."""

    ROBOT_ABORTED = "robot_aborted"
    RETRY_LIMIT = "retry_limit"
    WINDOW_CLOSED = "window_closed"
    UNAUTHORIZED = "unauthorized"
    UNKNOWN_MISSION = "unknown_mission"
    REFUSED = "refused"
    WRONG_ROBOT = "wrong_robot"
    VANISHED = "vanished"
    UNKNOWN_OUTCOME = "unknown_outcome"
    NO_ROBOT = "no_robot"  # none of the group could be asked before the window closed
    USER_CANCELLED = "user_cancelled"
    QUEUE_CLEARED = "queue_cleared"
    SCHEDULE_CHANGED = "schedule_changed"
    ROBOT_REMOVED = "robot_removed"
    BATTERY_LOW = "battery_low"
    OVERLAP = "overlap"
    HOLD = "hold"
    FINISH_BY = "finish_by"  # it could not be done in time
    PLACE_BUSY = "place_busy"
    APP_DOWN = "app_down"
    CLOCK_IMPLAUSIBLE = "clock_implausible"


STATE_OF_REASON: Mapping[ReasonCode, State] = MappingProxyType(
    {
        **dict.fromkeys(
            (
                ReasonCode.ROBOT_ABORTED,
                ReasonCode.RETRY_LIMIT,
                ReasonCode.WINDOW_CLOSED,
                ReasonCode.UNAUTHORIZED,
                ReasonCode.UNKNOWN_MISSION,
                ReasonCode.REFUSED,
                ReasonCode.WRONG_ROBOT,
                ReasonCode.VANISHED,
                ReasonCode.UNKNOWN_OUTCOME,
                ReasonCode.NO_ROBOT,
            ),
            State.FAILED,
        ),
        **dict.fromkeys(
            (
                ReasonCode.USER_CANCELLED,
                ReasonCode.QUEUE_CLEARED,
                ReasonCode.SCHEDULE_CHANGED,
                ReasonCode.ROBOT_REMOVED,
            ),
            State.CANCELLED,
        ),
        **dict.fromkeys(
            (ReasonCode.BATTERY_LOW, ReasonCode.OVERLAP, ReasonCode.HOLD, ReasonCode.FINISH_BY, ReasonCode.PLACE_BUSY),
            State.SKIPPED,
        ),
        **dict.fromkeys((ReasonCode.APP_DOWN, ReasonCode.CLOCK_IMPLAUSIBLE), State.MISSED),
    }
)


@dataclass(frozen=True)
class Reason:
    """A code and the numbers of its sentence; ``app.domain.reasons`` renders it in any language."""

    code: ReasonCode
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def state(self) -> State:
        """The state an execution ends in for this reason."""
        return STATE_OF_REASON[self.code]


class Wait(StrEnum):
    """What a waiting execution waits for at present (shown on screen, never an outcome)."""

    DUE = "due"  # about to be sent
    RETRY = "retry"  # the last attempt failed
    BATTERY = "battery"
    HOLD = "hold"
    LATE_START = "late_start"  # the app came back late; sent when the operator's 30 s are over
    CLOCK = "clock"
    ROBOT = "robot"  # of a group: none is free yet
    CHECK_UP = "check_up"  # its robot's fleet has to be checked up first
    PLACE = "place"  # as many missions as may be are at a place that it uses
    ELSEWHERE = "elsewhere"  # a robot may have it although a restored backup does not know: all are asked


@dataclass(frozen=True)
class Execution:
    """One run of a mission caused by this app, from planned to its end: one row of the ledger. A start of a group has
    no robot until one is chosen: ``robot_id`` is None then, and ``robot`` empty."""

    trigger: Trigger
    robot_id: int | None
    robot: str
    mission: str
    mission_guid: str
    planned_at: datetime
    closes_at: datetime  # submitted only before this instant (planned + max(window, 1 min))
    created_at: datetime
    token: str
    timezone: str  # the schedule's, or settings.timezone: the zone its times are written in
    state: State = State.WAITING
    id: int = 0
    schedule_id: int | None = None
    schedule: str = ""
    moved_from: datetime | None = None  # when its schedule has it, if a person moved it
    parameters: Mapping[str, Any] = field(default_factory=dict)
    priority: int = 0
    minimum_battery_percent: float | None = None  # resolved when the row was made; None or 0 = no minimum
    reason: Reason | None = None
    wait: Wait = Wait.DUE
    wait_details: Mapping[str, Any] = field(default_factory=dict)
    listed_until: datetime | None = None  # of a late start: not sent before
    attempts: int = 0
    queue_floor: int | None = None  # highest queue id of the robot known before the last attempt
    queue_id: int | None = None
    cancel_code: ReasonCode | None = None  # asked for by the operator, not yet confirmed by the robot
    withdrawn: Reason | None = None  # why it must not be sent (again), though an item on the robot continues
    held: bool = False  # by a person: not sent before it is released, and not after its window
    group_id: int | None = None
    robot_group: str = ""  # its name then
    finish_by: datetime | None = None  # one of a group that can't be done by then is not sent
    bound_at: datetime | None = None  # when its robot was chosen
    choice: Mapping[str, Any] = field(default_factory=dict)  # why that robot, or why none yet: codes and numbers
    tried: Mapping[str, Any] = field(default_factory=dict)  # by a robot's id: its outcome there
    robot_address: str | None = None  # where it was sent to, and the serial number of the machine there
    robot_serial: str | None = None
    submitted_at: datetime | None = None
    started_at: datetime | None = None
    ended_at: datetime | None = None
    duration_s: float | None = None  # by the robot's own clock
    robot_delay_s: float | None = None  # robot's started − ordered
    starts: int = 1  # in this row: those that a schedule missed in one absence are one row, that of the last
    taken_by: str = ""  # of a start for any robot of a fleet: the name of the one that the fleet chose
    begun_at: datetime | None = None  # when its last attempt was: nothing of that was sent before

    @property
    def is_called_off(self) -> bool:
        """It is not sent, or not again: a person cancelled it, or the plan no longer has it."""
        return self.cancel_code is not None or self.withdrawn is not None

    @property
    def was_never_sent(self) -> bool:
        """Whether it certainly was never on a robot: tries that found none, or were refused, leave no floor."""
        return self.attempts == 0 or (
            self.queue_floor is None and all(each.get("floor") is None for each in self.tried.values())
        )

    @property
    def label(self) -> str:
        """Its name on the robot: its schedule's, else its mission's."""
        return self.schedule or self.mission

    @property
    def ran_on(self) -> str:
        """Its robot, and of any robot of a fleet which one it was: "Hall 2 (Bella)"; "" without one."""
        return f"{self.robot} ({self.taken_by})" if self.taken_by else self.robot

    @property
    def own_name(self) -> str:
        """Its schedule's typed name; "" for a generated one, which only repeats mission and robot."""
        return names.own_schedule_name(self.schedule, self.mission, self.robot_group or self.robot)


# What a start without a robot has of one.
UNBOUND: dict[str, Any] = {
    "robot_id": None,
    "robot": "",
    "bound_at": None,
    "choice": {},
    "queue_floor": None,
    "robot_address": None,
    "robot_serial": None,
}


@dataclass(frozen=True)
class DurationEstimate:
    """How long a mission takes on a robot, in seconds: median and 90th percentile of the latest runs; or a typed value
    for both, without runs."""

    median_s: float
    slow_s: float
    samples_s: tuple[float, ...] = ()  # each of them, shortest first
    typed: bool = False

    @property
    def runs(self) -> int:
        return len(self.samples_s)

    @property
    def quick_s(self) -> float:
        """The time that nine of ten runs exceeded; 0 if none was measured."""
        return self.samples_s[self.runs - math.ceil(0.9 * self.runs)] if self.samples_s else 0.0

    def left_s(self, elapsed_s: float) -> float:
        """Of a run, in seconds: 0 if it should end soon, negative if it takes much longer than the runs before it. A typed value
        is what somebody expects, so no run is late by it."""
        left = self.median_s - elapsed_s
        is_late = elapsed_s > MUCH_LONGER * self.median_s and not self.typed
        return left if left > 0 or is_late else 0.0
