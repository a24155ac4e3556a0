"""The terms that every layer shares, as frozen dataclasses and enums; docs/architecture.md explains them. ``execution``
has those of runs.

Instants are timezone-aware UTC ``datetime``; a schedule's ``start`` is naive wall-clock time in its own zone. Durations are seconds
unless a name says otherwise. Identifiers are database keys; names are what people and files use.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import date, datetime, time, timedelta
from enum import StrEnum
from typing import Any, TypeVar

from app.domain.capabilities import OF_A_ROBOT, Capabilities
from app.domain.check_up import RobotProfile
from app.domain.message import Message, message, render
from app.domain.robot import IdentifiedBy, QueueItem, RobotStatus

T = TypeVar("T")

WEEKDAYS = ("MO", "TU", "WE", "TH", "FR", "SA", "SU")


class Overlap(StrEnum):
    """What happens when a schedule falls due while its previous execution is still open."""

    SKIP = "skip"
    QUEUE = "queue"
    PARALLEL = "parallel"  # of a group: at the same time, on another robot


class HandOver(StrEnum):
    """When a due start goes to a robot: into its queue at once, or as soon as it is free, so that the app decides the
    order until then."""

    AT_ONCE = "at_once"
    WHEN_FREE = "when_free"


@dataclass(frozen=True)
class IdleRule:
    """Idle automation of one robot: which mission after how many minutes (5–30) of idleness."""

    mission_id: int
    after_minutes: int = 10
    enabled: bool = True


class FleetKind(StrEnum):
    """Which of MiR's two products, each with an API of its own."""

    CLASSIC = "classic"  # MiR Fleet, of software 2 and 3
    ENTERPRISE = "enterprise"  # MiR Fleet Enterprise


@dataclass(frozen=True)
class Fleet:
    """A MiR Fleet: a server that gives missions to its robots. ``token`` is the value of the header with the
    credentials, a secret: never printed, logged or exported."""

    name: str
    address: str
    kind: FleetKind = FleetKind.CLASSIC
    username: str = ""
    token: str | None = field(default=None, repr=False)
    id: int = 0
    enabled: bool = True
    needs_password: bool = False
    certificate_sha256: str | None = None
    identity: str | None = None  # what told the fleet that answered first from others: another one is a wrong fleet
    software: str | None = None
    profile: RobotProfile | None = field(default=None, hash=False, repr=False)  # by its last check-up

    @property
    def known(self) -> RobotProfile | None:
        """Its profile, if that is of this fleet with this software. None: it has to be checked up."""
        return self.profile if self.profile is not None and self.profile.is_of(self.identity, self.software) else None

    @property
    def is_identified(self) -> bool:
        """Whether another fleet at its address would be noticed: by its identity, or by its certificate."""
        return self.identity is not None or self.address.startswith("https:")


ANY_VEHICLE = "any"  # in the place of a robot's id at its fleet: whichever the fleet chooses


@dataclass(frozen=True)
class Robot:
    """A configured robot. ``token`` is the Authorization header value, a secret: never printed, logged or exported.

    One that is reached through a fleet has the ``fleet``, and its id there in ``vehicle``; address, user, token and
    certificate are then those of the fleet. One with ANY_VEHICLE stands for whichever robot the fleet chooses."""

    name: str
    address: str
    username: str = ""
    token: str | None = field(default=None, repr=False)
    id: int = 0
    enabled: bool = True
    needs_password: bool = False
    certificate_sha256: str | None = None
    serial_number: str | None = None  # of the machine that answered first; another one is a wrong robot
    identified_by: IdentifiedBy | None = None  # how it was known when it last answered; None: it never has
    model: str | None = None
    software: str | None = None
    idle: IdleRule | None = None
    hand_over: HandOver = HandOver.AT_ONCE
    profile: RobotProfile | None = field(default=None, hash=False, repr=False)  # by its last check-up
    fleet: Fleet | None = None
    vehicle: str = ""
    off_with_fleet: bool = False  # off only because the fleet is: on again with it

    @property
    def known(self) -> RobotProfile | None:
        """Its profile, if that is of this machine with this software, or its fleet's. None: nothing is known for
        certain."""
        if self.fleet is not None:
            return self.fleet.known
        return (
            self.profile if self.profile is not None and self.profile.is_of(self.serial_number, self.software) else None
        )

    @property
    def fleet_id(self) -> int | None:
        return self.fleet.id if self.fleet is not None else None

    @property
    def is_any(self) -> bool:
        """Whether its fleet chooses the robot."""
        return self.vehicle == ANY_VEHICLE

    def battery(self, status: RobotStatus) -> float | None:
        """In %, as starts are judged by; a fleet that chooses the robot looks after the batteries itself."""
        return 100.0 if self.is_any else status.battery_percentage

    @property
    def is_identified(self) -> bool:
        """Whether a robot of another fleet at the same address would be noticed: by the fleet, or by its own serial
        number."""
        return self.fleet is None or self.fleet.is_identified or self.serial_number is not None

    @property
    def needs_check_up(self) -> bool:
        """Whether nothing is sent to it by itself: what its fleet does with orders, or which one it is, is not known."""
        return self.fleet is not None and (self.fleet.known is None or not self.is_identified)

    @property
    def is_on_by_itself(self) -> bool:
        """Whether it is switched on, or would be if its fleet were."""
        return self.enabled or self.off_with_fleet

    def within(self, fleet: Fleet) -> Robot:
        """The same with all that it has of its fleet; it is off while that is."""
        is_on = self.is_on_by_itself
        return replace(
            self,
            fleet=fleet,
            address=fleet.address,
            username=fleet.username,
            token=fleet.token,
            certificate_sha256=fleet.certificate_sha256,
            needs_password=fleet.needs_password,
            enabled=is_on and fleet.enabled,
            off_with_fleet=is_on and not fleet.enabled,
        )


FEWEST_TO_KEEP_FREE = 4  # robots of a group: of fewer none is kept free


@dataclass(frozen=True)
class Group:
    """Any of these robots may take a start. ``members``: their ids. ``keep_free``: how many are kept free for starts of
    high priority."""

    name: str
    members: tuple[int, ...] = ()
    hand_over: HandOver = HandOver.WHEN_FREE
    keep_free: int = 0
    id: int = 0


@dataclass(frozen=True)
class Place:
    """A location for at most ``most`` missions of this app at a time. ``missions``: ids of those that use it."""

    name: str
    most: int
    missions: tuple[int, ...] = ()
    id: int = 0


@dataclass(frozen=True)
class Mission:
    """A program on the robots, known by its guid. ``robot_id`` is set when the guid holds for that robot only."""

    name: str
    guid: str
    id: int = 0
    robot_id: int | None = None
    favourite: bool = False
    usual_minutes: int | None = None  # how long it takes as a person typed it, until runs on a robot show it
    on_low_battery: bool = False  # a person allows it under the minimum battery
    charges: bool = False  # it brings the robot to its charger, as its actions on the robot say

    @property
    def runs_on_low_battery(self) -> bool:
        """Whether the general minimum battery holds it up: a low battery is the one moment that a charging mission is for."""
        return self.on_low_battery or self.charges


@dataclass(frozen=True)
class Between:
    """The part of each day in which a sub-daily recurrence runs; both ends are included."""

    start: time
    end: time


@dataclass(frozen=True)
class Schedule:
    """A mission, its robot or group, its times and its constraints. Either ``robot_id`` or ``group_id`` is None."""

    name: str
    robot_id: int | None
    mission_id: int
    start: datetime  # naive, whole minutes, in ``timezone``
    timezone: str
    recurrence: str | None = None  # RFC 5545 RRULE value; None = once
    id: int = 0
    group_id: int | None = None
    enabled: bool = True
    between: Between | None = None
    minimum_battery_percent: float | None = None  # None inherits the setting, 0 means none
    respect_working_days: bool = True
    start_window_minutes: int | None = None  # None inherits the setting
    finish_by_minutes: int | None = None  # of a group: after its instant; None: whenever
    overlap: Overlap = Overlap.SKIP
    priority: int = 0
    parameters: Mapping[str, Any] = field(default_factory=dict)
    changed_at: datetime | None = None  # instants up to here write no row
    next_at: datetime | None = None  # next instant, UTC; None without more, or if it is switched off
    paused_until: datetime | None = None  # occurrences before it are skipped
    planned_through: datetime | None = None  # instants up to here have their rows, or had them
    started_through: datetime | None = None  # the newest instant that was begun
    moved_of: int | None = None  # of one start that a person moved: the schedule that it is of
    moved_from: datetime | None = None  # and when that one has it (UTC)

    @property
    def whole_id(self) -> int:
        """The schedule's id, and of one start that a person moved, that of the schedule that it is of."""
        return self.moved_of or self.id

    def is_paused(self, at: datetime) -> bool:
        """Whether an occurrence at that instant is skipped because a person paused the schedule."""
        return self.paused_until is not None and at < self.paused_until


class Connection(StrEnum):
    """How the robot answers."""

    UNKNOWN = "unknown"  # not asked yet
    CONNECTED = "connected"
    SLOW = "slow"
    UNREACHABLE = "unreachable"
    UNAUTHORIZED = "unauthorized"
    WRONG_ROBOT = "wrong_robot"
    OTHER_CERTIFICATE = "other_certificate"
    UNTRUSTED = "untrusted"  # a certificate that no one has accepted
    NOT_A_ROBOT = "not_a_robot"
    DISABLED = "disabled"


@dataclass(frozen=True)
class RobotSnapshot:
    """The last known state of one robot, with the time it was read. Old values stay, with their age."""

    robot_id: int
    connection: Connection = Connection.UNKNOWN
    status: RobotStatus | None = None
    read_at: datetime | None = None  # of status
    queue: tuple[QueueItem, ...] = ()  # running first, then pending in order; including those of others
    queue_read_at: datetime | None = None
    since: datetime | None = None  # of this connection state
    problem: Message = ""  # the last failure, empty if it answers
    fleet_failed: bool = False  # that was its fleet's, not of this robot alone
    capabilities: Capabilities = OF_A_ROBOT


THEMES = ("light", "dark", "contrast")
KEYBOARDS = ("auto", "on", "off")  # on-screen: if the tablet has no keyboard, always, never
FONT_SCALES = (100, 115, 130)  # %, of the size that texts have by themselves


@dataclass(frozen=True)
class Settings:
    """Everything that can be set, with its default (docs/interfaces.md, "Configuration file")."""

    poll_interval_seconds: int = 30
    retry_limit: int = 10
    minimum_battery_percent: float | None = None
    working_days: tuple[str, ...] = ("MO", "TU", "WE", "TH", "FR")
    timezone: str = "UTC"  # replaced by the tablet's at the first start
    start_window_minutes: int = 15
    unknown_outcome_quiet_seconds: int = 90
    history_limit: int | None = 100_000
    # of the display and the calendar in the configuration file; the selected robot is not in it
    language: str = "en"
    theme: str = "light"  # one of THEMES
    gloves: bool = False  # larger targets
    font_scale_percent: int = 100  # one of FONT_SCALES
    keyboard: str = "auto"  # one of KEYBOARDS
    alarm_sound: bool = True  # at alarms of high priority, where the tablet has sound
    dim_from: int | None = None  # hour of the day from which on the screen is dimmed when left alone; None: never
    dim_until: int = 6  # hour
    holiday_country: str = ""  # ISO 3166 code of the country whose public holidays are not working days; empty: none
    holiday_subdivision: str = ""  # ISO 3166-2 part of it that has some of its own
    selected_robot_id: int | None = None

    @property
    def poll_interval(self) -> timedelta:
        return timedelta(seconds=self.poll_interval_seconds)


@dataclass(frozen=True)
class DayException:
    """Exceptions to the weekly working days: days off, or extra working days. Both ends are included."""

    name: str
    first_day: date
    last_day: date
    is_working: bool = False
    yearly: bool = False  # repeated in every later year
    source: str = ""  # the file it came with; empty: entered by hand
    id: int = 0


class Priority(StrEnum):
    """How serious an alarm is."""

    HIGH = "high"
    MEDIUM = "medium"
    LOW = "low"


@dataclass(frozen=True)
class Alarm:
    """Something a person should know, after ISA-18.2: one alarm per (code, key), counted when it repeats."""

    code: str  # e.g. "app_was_off", "duplicate_healed"; app.services.live.alarms has the list
    key: str  # its object, e.g. "robot:3"; with code the identity
    priority: Priority
    raised_at: datetime
    details: Mapping[str, Any] = field(default_factory=dict)
    id: int = 0
    last_at: datetime | None = None
    count: int = 1
    cleared_at: datetime | None = None
    acknowledged_at: datetime | None = None
    note: str = ""
    shelved_until: datetime | None = None


class InvalidInput(ValueError):
    """Something a person or a file gave that can't be taken.

    ``field`` names where it was entered, ``text`` is one English sentence with how to mend it; ``msgid`` and ``details`` let screens
    translate it.
    """

    def __init__(self, field: str, msgid: str, **details: Any) -> None:
        self.field, self.msgid, self.details = field, msgid, details
        super().__init__(render(self.message))

    @property
    def message(self) -> Mapping[str, Any]:
        """The message without a language."""
        return message(self.msgid, **self.details)

    @property
    def text(self) -> str:
        return str(self)


def existing(found: T | None, field: str, msgid: str, **details: object) -> T:
    """Raises InvalidInput with this sentence for None: it was removed while somebody had it before them, or never there."""
    if found is None:
        raise InvalidInput(field, msgid, **details)
    return found
