"""The world's own diary: what people decided, what was wrong when, which machine had which items. The oracles judge by it alone."""

from __future__ import annotations

import copy
import hashlib
import math
import uuid
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, timedelta
from operator import itemgetter
from zoneinfo import ZoneInfo

from app.domain.models import WEEKDAYS, Overlap, Schedule
from mir_sim.mission_queue import QueueItem

KEPT_S = 6 * 3600.0  # longer than the longest window: older troubles and decisions explain nothing any more
MINUTE = timedelta(minutes=1)
OVERLAPS = (Overlap.SKIP, Overlap.QUEUE)  # of one robot
_since = itemgetter(0)
Key = tuple[int, datetime]  # of a start: its schedule's id and its instant


@dataclass(eq=False)
class Trouble:
    """``robot`` None: of all. ``start`` and ``end`` in seconds of true time."""

    kind: str
    robot: str | None
    start: float
    end: float = math.inf


@dataclass(frozen=True)
class Restore:
    """``at``: in seconds of true time. What was planned from ``start`` to ``end`` by the tablet's clock is not in the backup that was
    restored then: from when it was made, also by the clock as it goes since."""

    at: float
    start: datetime
    end: datetime


@dataclass(frozen=True)
class Undone:
    """An edit of a schedule from ``start`` to ``end``, in seconds of true time: its starts are due as if it had not been made."""

    schedule_id: int
    start: float
    end: float


@dataclass(frozen=True)
class Manual:
    robot: str  # empty: any of the group
    guid: str
    at: datetime  # of the press, by the tablet
    group_id: int | None = None


Target = tuple[int | None, int | None]  # a robot's id or a group's


@dataclass(frozen=True)
class Move:
    """One start, ``of`` a schedule, is at another time (of the clock on its wall) or on another robot. ``beside``: what
    its schedule is for, which it follows where that is its own too."""

    of: Key
    start: datetime
    target: Target
    beside: Target


@dataclass
class Wishes:
    """What people want, as they have decided it. ``moves``: by the ids of their plans, which follow from the others."""

    plans: dict[int, Schedule] = field(default_factory=dict)
    moves: dict[int, Move] = field(default_factory=dict)
    off: set[str] = field(default_factory=set)  # robots
    holds: dict[str | None, datetime | None] = field(
        default_factory=dict
    )  # robot (None: all), until when by the tablet's clock
    paused: dict[int, datetime] = field(default_factory=dict)
    skipped: set[Key] = field(default_factory=set)
    stopped: set[Key] = field(default_factory=set)  # permanently, by a pause or a robot that was switched off
    cancelled: set[str] = field(default_factory=set)  # tokens
    held_starts: set[str] = field(default_factory=set)  # the same, until they are released
    manual: dict[str, Manual] = field(default_factory=dict)
    idle: dict[str, str] = field(default_factory=dict)  # robot: guid of its mission
    working_days: tuple[str, ...] = WEEKDAYS
    closed: frozenset[date] = frozenset()
    groups: dict[int, frozenset[str]] = field(default_factory=dict)  # names of their robots
    at_once: set[int] = field(default_factory=set)  # groups whose starts go into queues
    assigned: set[str] = field(default_factory=set)  # tokens, by a person to a robot
    one_line: set[str] = field(default_factory=set)  # robots that get one start at a time

    def copy(self) -> Wishes:
        return Wishes(**{name: copy.copy(value) for name, value in vars(self).items()})

    def follow(self) -> None:
        """Moved starts are as their schedules are now."""
        for id_, move in self.moves.items():
            self.plans.pop(id_, None)
            self.paused.pop(id_, None)
            if (whole := self.plans.get(move.of[0])) is None:
                continue
            beside = whole.robot_id, whole.group_id
            robot_id, group_id = beside if move.target == move.beside else move.target
            self.moves[id_] = replace(move, target=(robot_id, group_id), beside=beside)
            has_it = next(instants(whole, move.of[1], move.of[1] + MINUTE), None) == move.of[1]
            self.plans[id_] = replace(
                whole,
                id=id_,
                start=move.start,
                recurrence=None,
                respect_working_days=False,
                robot_id=robot_id,
                group_id=group_id,
                enabled=whole.enabled and has_it,
                finish_by_minutes=None if group_id is None else whole.finish_by_minutes,
            )
            if whole.id in self.paused:
                self.paused[id_] = self.paused[whole.id]

    @property
    def whole(self) -> dict[int, Schedule]:
        """The schedules, without single starts that were moved."""
        return {id_: plan for id_, plan in self.plans.items() if id_ not in self.moves}

    def is_held(self, robot: str, wall: datetime) -> bool:
        return any(who in (None, robot) and (until is None or wall < until) for who, until in self.holds.items())


def instants(plan: Schedule, start: datetime, end: datetime) -> Iterator[datetime]:
    """Those of a schedule from ``start`` up to ``end``, counted by hand. Working days are left out of it."""
    zone = ZoneInfo(plan.timezone)
    first = plan.start.replace(tzinfo=zone).astimezone(UTC)
    if plan.recurrence is None:
        if start <= first < end:
            yield first
        return
    if "MINUTELY" in plan.recurrence:
        step = timedelta(minutes=int(plan.recurrence.rpartition("=")[2]))
        at = first + max(0, math.ceil((start - first) / step)) * step
        while at < end:
            yield at
            at += step
        return
    day = max(plan.start.date(), (start - timedelta(days=2)).date())
    while day <= (end + timedelta(days=2)).date():
        at = datetime.combine(day, plan.start.time(), zone).astimezone(UTC)
        is_on = "DAILY" in plan.recurrence or WEEKDAYS[day.weekday()] in plan.recurrence.partition("BYDAY=")[2]
        if start <= at < end and at >= first and is_on:
            yield at
        day += timedelta(days=1)


class Diary:
    """``names``: of robots by id. ``guids``: of missions by id."""

    def __init__(self, install_id: str) -> None:
        self._namespace = uuid.UUID(install_id).bytes
        self.names: dict[int, str] = {}
        self.guids: dict[int, str] = {}
        self.wishes: list[tuple[float, Wishes]] = [(0.0, Wishes())]
        self.troubles: list[Trouble] = []
        self.clock: list[tuple[float, float]] = [
            (0.0, 0.0)
        ]  # true time, and what the tablet's clock is ahead from then on
        self.excused: dict[str, str] = {}  # tokens whose items the robot lost or hid, and how
        self.uncertain: set[str] = set()  # tokens whose cancellation may or may not have been noted
        self.by_person: set[str] = set()  # tokens that a person cancelled or held, or was about to
        self.restores: list[Restore] = []
        self.undone: list[Undone] = []
        self.lost_items: dict[str, list[QueueItem]] = defaultdict(list)  # by machine: of queues that were reset
        self.started_at: float = 0.0  # the app's last start
        self._tokens: dict[str, Key] = {}
        self._made: set[tuple[int, datetime]] = set()  # schedules and hours with all tokens known
        self.ids: set[int] = set()  # of all schedules that there ever were

    # ------------------------------------------------------------------ decisions
    @property
    def now(self) -> Wishes:
        return self.wishes[-1][1]

    def decide(self, at: float) -> Wishes:
        """A copy of what holds, to be changed: it holds from now on."""
        self.wishes.append((at, self.now.copy()))
        return self.now

    def come_again(self, at: float, wall: datetime) -> None:
        """Starts after that time by the tablet's clock, which was set: what was stopped then may run, or not if it had been sent."""
        if again := {key for key in self.now.stopped if key[1] > wall}:
            self.decide(at).stopped -= again
            self.uncertain |= {self.token(key) for key in again}

    def between(self, start: float, end: float, undone_of: int | None = None) -> list[Wishes]:
        """What held at any moment of this time, except during undone edits of that schedule."""
        first = bisect_left(self.wishes, start, key=_since) - 1
        found = self.wishes[max(0, first) : bisect_right(self.wishes, end, key=_since)]
        return [wishes for at, wishes in found if not self.was_undone(undone_of, at)]

    def was_undone(self, schedule_id: int | None, at: float) -> bool:
        """Whether an edit of a schedule held then that was undone later."""
        return any(each.schedule_id == schedule_id and each.start <= at < each.end for each in self.undone)

    def undone_until(self, schedule_id: int, start: float, end: float) -> float:
        """When the last edit of it was undone that held in this time; ``start`` if none did."""
        ends = (each.end for each in self.undone if each.schedule_id == schedule_id and each.start < end)
        return max([start, *ends])

    def wants(self, wishes: Wishes, key: Key, days: bool = True) -> bool:
        """Whether that start is planned; ``days`` False: ignoring working days."""
        plan, instant = wishes.plans.get(key[0]), key[1]
        if (
            plan is None
            or not plan.enabled
            or self.robots_of(plan, wishes) <= wishes.off
            or key in wishes.skipped
            or key in wishes.stopped
        ):
            return False
        if instant < wishes.paused.get(key[0], instant):
            return False
        if days and not self.is_on_its_days(wishes, plan, instant):
            return False
        return next(instants(plan, instant, instant + MINUTE), None) == instant

    @staticmethod
    def is_on_its_days(wishes: Wishes, plan: Schedule, instant: datetime) -> bool:
        """Whether the schedule runs on that day."""
        local = instant.astimezone(ZoneInfo(plan.timezone)).date()
        is_off = local in wishes.closed or WEEKDAYS[local.weekday()] not in wishes.working_days
        return not (plan.respect_working_days and is_off)

    def others(self, key: Key, start: datetime, end: datetime) -> Iterator[Key]:
        """Of the same schedule from ``start`` up to ``end``, those included that were moved."""
        moves, plans = self.now.moves, self.now.plans
        whole = moves[key[0]].of[0] if key[0] in moves else key[0]
        for id_ in (whole, *(id_ for id_, move in moves.items() if move.of[0] == whole)):
            for instant in instants(plans[id_], start, end) if id_ in plans else ():
                if (id_, instant) != key:
                    yield id_, instant

    def robots_of(self, plan: Schedule, wishes: Wishes | None = None) -> frozenset[str]:
        """Names of the robots that may get a start of it."""
        if plan.group_id is None:
            return frozenset({self.names[plan.robot_id or 0]})
        return (wishes or self.now).groups.get(plan.group_id, frozenset())

    # ------------------------------------------------------------------ tokens
    def token(self, key: Key) -> str:
        name = f"{key[0]}|{key[1].replace(tzinfo=None).isoformat(timespec='seconds')}Z"
        return self._uuid5(name)

    def _uuid5(self, name: str) -> str:
        """As ``uuid.uuid5`` makes it, which takes ten times as long."""
        hexed = hashlib.sha1(self._namespace + name.encode(), usedforsecurity=False).hexdigest()
        return f"{hexed[:8]}-{hexed[8:12]}-5{hexed[13:16]}-{int(hexed[16], 16) & 3 | 8:x}{hexed[17:20]}-{hexed[20:32]}"

    def key_of(self, token: str, wall: datetime) -> Key | None:
        """The schedule and start of a token; None: of no schedule around that time."""
        if token in self._tokens:
            return self._tokens[token]
        around = wall.replace(minute=0, second=0, microsecond=0)
        for hour in (around + hours * timedelta(hours=1) for hours in range(-5, 2)):
            for schedule_id in self.ids:
                if (schedule_id, hour) not in self._made:
                    self._made.add((schedule_id, hour))
                    self._tokens |= {
                        self.token(key): key for key in ((schedule_id, hour + minute * MINUTE) for minute in range(60))
                    }
        return self._tokens.get(token)

    def is_of_restored_time(self, instant: datetime) -> bool:
        """Whether a backup was restored after it was due or just before."""
        return any(instant <= each.end + MINUTE for each in self.restores)

    # ------------------------------------------------------------------ troubles
    def begin(self, kind: str, robot: str | None, at: float, seconds: float = math.inf) -> Trouble:
        self.troubles.append(Trouble(kind, robot, at, at + seconds))
        return self.troubles[-1]

    def _in_the_way(self, robot: str, start: float, end: float, but: tuple[str, ...]) -> Iterator[Trouble]:
        for each in self.troubles:
            if each.end > start and each.start < end and each.robot in (None, robot) and each.kind not in but:
                yield each

    def clear_spans(
        self, robot: str, start: float, end: float, but: tuple[str, ...] = ("slow",)
    ) -> list[tuple[float, float]]:
        """Times in which nothing was wrong for that robot."""
        spans, at = [], start
        for trouble in sorted(self._in_the_way(robot, start, end, but), key=lambda each: each.start):
            if trouble.start > at:
                spans.append((at, trouble.start))
            at = max(at, trouble.end)
        return [*spans, (at, end)] if at < end else spans

    def is_clear(self, robot: str, start: float, end: float, but: tuple[str, ...] = ("slow",)) -> bool:
        return start < end and next(self._in_the_way(robot, start, end, but), None) is None

    def was_wrong(self, kind: str, robot: str | None, start: float, end: float) -> bool:
        return any(
            each.kind == kind
            and (robot is None or each.robot in (None, robot))
            and each.start < end
            and each.end > start
            for each in self.troubles
        )

    def ahead(self, at: float) -> float:
        """s by which the tablet's clock was ahead of true time."""
        return next(offset for since, offset in reversed(self.clock) if since <= at)

    def most_back(self) -> float:
        """s by which the clock has been set back at most."""
        return (
            max((before[1] - after[1] for before, after in zip(self.clock, self.clock[1:], strict=False)), default=0.0)
            + 2.0
        )

    def is_steady(self, since: float) -> bool:
        """Whether the tablet's clock has been set by no more than some seconds since then."""
        now = self.clock[-1][1]
        offsets = [self.ahead(since), *(offset for at, offset in self.clock if at > since)]
        return all(abs(offset - now) < 5.0 for offset in offsets)

    def forget(self, now: float) -> None:
        self.troubles = [each for each in self.troubles if each.end > now - KEPT_S]
        self.undone = [each for each in self.undone if each.end > now - KEPT_S]
        old = [index for index, (at, _wishes) in enumerate(self.wishes) if at < now - KEPT_S]
        self.wishes = self.wishes[old[-1] :] if old else self.wishes
