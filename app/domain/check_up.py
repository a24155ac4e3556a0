"""What a check-up of a robot found, and what the app may rely on because of it.

``Finding`` is for people, ``RobotProfile`` for the app: None means "not found out": the app then takes the careful way,
in which nothing can run twice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum

from app.domain.message import Message


class Level(StrEnum):
    """What a finding means for scheduling: nothing to do, something to note, or a problem to solve first."""

    GREEN = "green"
    AMBER = "amber"
    RED = "red"


class Topic(StrEnum):
    """Subjects of findings, in the order of the report. The first ones are read, those from ``ORDER`` on are tried."""

    IDENTITY = "identity"
    SOFTWARE = "software"
    RIGHTS = "rights"
    PASSWORD = "password"  # noqa: S105  (a topic)
    CERTIFICATE = "certificate"
    BATTERY = "battery"
    CLOCK = "clock"
    LANGUAGE = "language"
    MISSIONS = "missions"
    MAPS = "maps"
    QUEUE = "queue"
    SEARCH = "search"
    PAGING = "paging"
    SORTING = "sorting"
    OTHERS = "others"
    LATENCY = "latency"
    LOAD = "load"
    ORDER = "order"
    RECOGNISED = "recognised"
    WORDS = "words"
    CANCELLED = "cancelled"
    FAILED = "failed"
    PRIORITY = "priority"
    SECOND = "second"
    PAUSE = "pause"
    LEFT = "left"

    @property
    def is_tried(self) -> bool:
        return list(Topic).index(self) >= list(Topic).index(Topic.ORDER)


@dataclass(frozen=True)
class Finding:
    """``says``: the robot's behaviour. ``means``: its meaning for scheduling, and what to do about it."""

    topic: Topic
    level: Level
    says: Message
    means: Message = ""


@dataclass(frozen=True)
class Rest:
    """More than ``requests`` within ``seconds`` make the robot stop answering or boot."""

    requests: int
    seconds: float


@dataclass(frozen=True)
class RobotProfile:
    """The behaviour of one machine with one software. None: not found out.

    Attributes: serial_number, software: of the machine and its software; the profile of another one is ignored.
    has_search: whether ``POST /mission_queue/search`` exists. page_limit: most entries of a list in one answer, even if
    more were requested; 0: no limit found. ignores: parameters of lists without effect: whitelist, sort_by, limit,
    offset, filters. token_field: the field of a queue item in which the description that was sent comes back; empty: in
    none. item_states: the robot's words for states of items, each with MiR's: Pending, Executing, Abort, Done, Aborted,
    or ``Cancelled`` for one that a person has ended. cancelled_message: the beginning of a cancelled item's message, if
    its state is that of a failed one. gives_id: whether the answer to a POST to the queue has the item's id.
    order_status: status code of that answer. timezone: IANA name of the zone of its clock; ``clock_offset``: s that it
    is ahead of the tablet's. latency: s until an answer: fastest, median, 95th percentile, slowest. ``lost``: share of
    requests without an answer, 0–1. rest: the load that it does not bear, if found. priority_counts: whether an item of
    higher priority begins before an earlier one. quiet_s, timeout_s: derived from the latency: quiet time after an
    unknown outcome, and time-out of a whole answer, in seconds. ended_shown_s: for how long a fleet that is asked for
    orders by id shows those that have ended, at least. own_key: what its lists of orders call the app's API key.
    """

    serial_number: str | None
    software: str | None
    has_search: bool | None = None
    page_limit: int | None = None
    ignores: frozenset[str] | None = None
    token_field: str | None = None
    item_states: Mapping[str, str] = field(default_factory=dict)
    cancelled_message: str | None = None
    gives_id: bool | None = None
    order_status: int | None = None
    timezone: str | None = None
    clock_offset: float | None = None
    latency: tuple[float, float, float, float] | None = None
    lost: float | None = None
    rest: Rest | None = None
    priority_counts: bool | None = None
    quiet_s: float | None = None
    timeout_s: float | None = None
    ended_shown_s: float | None = None
    own_key: str | None = None

    def is_of(self, serial_number: str | None, software: str | None) -> bool:
        """Whether it is of this machine with its present software."""
        return self.serial_number == serial_number and self.software == software


NOTHING_KNOWN = RobotProfile(None, None)


@dataclass(frozen=True)
class Trial:
    """Agreement that missions are queued. ``mission``: the name of a harmless one of the robot's; None: one that waits a second is made
    for it, and removed afterwards. ``robot``: the name of the one that a fleet's order is for."""

    mission: str | None = None
    robot: str = ""


@dataclass(frozen=True)
class LeftBehind:
    """What a trial is about to change, or has changed, so that it can be undone in every case: the mission that was
    made (its guid; None: none) or the robot's own one that was ``queued`` (its guid), the tokens of what was queued,
    whether the robot was paused, and the ``hold`` (its id) of the plan's starts during the trial.

    The state at the pause, so that a later pause is not taken for the trial's: ``started`` is when the newest
    mission of the trial had begun, as the robot gives it (None: none had), ``uptime_s`` how long the robot had been
    on.

    Of a fleet, ``serial_number`` is what tells it from others: an order for the ``vehicle``, its id there, may be there
    since ``sent_at``, and has begun by ``begins_by`` if it is not deleted, in whichever zone its fleet reads times; its
    ``number`` once that is known; the ``holds`` of its robots."""

    serial_number: str | None
    mission: str | None = None
    tokens: tuple[str, ...] = ()
    queue_floor: int = 0  # what was queued has higher ids
    is_paused: bool = False
    queued: str | None = None
    hold: int | None = None
    started: str | None = None
    uptime_s: float | None = None
    vehicle: str = ""
    sent_at: datetime | None = None
    number: int | None = None
    holds: tuple[int, ...] = ()
    begins_by: datetime | None = None


@dataclass(frozen=True)
class Report:
    """One check-up. ``began_at`` is aware UTC, ``took_s`` in seconds. ``mission``: the queued one; empty: none.
    ``of_fleet``: it was a fleet, whose name is in ``robot``."""

    robot: str
    address: str
    model: str
    began_at: datetime
    took_s: float
    findings: tuple[Finding, ...]
    profile: RobotProfile
    mission: str = ""
    is_complete: bool = True  # not cancelled, and the robot answered to the end
    of_fleet: bool = False

    @property
    def level(self) -> Level:
        """The worst."""
        levels = {finding.level for finding in self.findings}
        return next((level for level in (Level.RED, Level.AMBER) if level in levels), Level.GREEN)


@dataclass(frozen=True)
class Progress:
    """``done`` of ``of`` seconds, as far as is known."""

    says: Message
    done: float
    of: float
