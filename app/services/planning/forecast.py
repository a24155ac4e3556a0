"""The robot of its group that a planned start will probably get, by the decision code itself. Pure. A robot counts as
free when its planned runs have usually ended. Unforeseeable facts are ignored: its position, its battery, silence, runs
started by a person. Times are seconds from a common origin.
"""

from __future__ import annotations

from bisect import insort
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from math import inf
from typing import NamedTuple

from app.services.allocation.choose import AHEAD, LAST_CALL, choose
from app.services.allocation.situation import UNKNOWN_S, Duration, Ineligible, Member, PlannedStart, Situation, Start

HOUR = 3600.0
# starts in groups that share robots, about a second of work. Later ones get no robot
MOST_CHOSEN = 20_000


@dataclass(frozen=True, kw_only=True)
class ForecastStart(Start):
    """A future start, in seconds from the origin. ``is_fixed``: on its only member, at its instant, like schedules of
    one robot."""

    is_fixed: bool = False


class ForecastSlot(NamedTuple):
    """A robot for a start. ``in_time``: it is free within the start's window, and not only asked at the last call."""

    robot_id: int
    begins: float
    ends: float
    in_time: bool


@dataclass(frozen=True)
class ForecastSite:
    """Robots by id: their names, when each is free, hours run on the first day of the forecast, and its holds.
    ``days``: the begins of the next days, in order. ``room``: the capacity of each place; ``at_places``: until when its
    present users are there."""

    names: Mapping[int, str]
    duration: Duration
    free: Mapping[int, float] = field(default_factory=dict)
    hours: Mapping[int, float] = field(default_factory=dict)
    held: Mapping[int, Sequence[tuple[float, float]]] = field(default_factory=dict)
    days: Sequence[float] = ()
    room: Mapping[str, int] = field(default_factory=dict)
    at_places: Mapping[str, Sequence[float]] = field(default_factory=dict)


def forecast(starts: Sequence[ForecastStart], site: ForecastSite) -> dict[int, ForecastSlot]:
    """The robot of each of these starts, which are in order of time, by its index; starts without a robot are
    missing."""
    found: dict[int, ForecastSlot] = {}
    for numbers, robots in _independent_parts(starts):
        found.update(_Simulation(starts, numbers, robots, site).run())
    return found


def _independent_parts(starts: Sequence[ForecastStart]) -> Iterator[tuple[list[int], list[int]]]:
    """Numbers of starts, and robots, that have to be looked at together: those of groups that share robots or places."""
    used = {(each.members, each.places) for each in starts if not each.is_fixed and each.members}
    together: list[Collection[int]] = [members for members, _ in used]
    for name in {name for _, places in used for name in places}:
        together.append({robot_id for each in starts if name in each.places for robot_id in each.members})
    parts: list[set[int]] = []
    for members in together:
        joined = set(members).union(*(part for part in parts if not part.isdisjoint(members)))
        parts = [joined, *(part for part in parts if part.isdisjoint(members))]
    part_of = {robot_id: part for part, robots in enumerate(parts) for robot_id in robots}
    numbers = [list[int]() for _ in parts]
    for number, each in enumerate(starts):
        if each.members and each.members[0] in part_of:
            numbers[part_of[each.members[0]]].append(number)
    yield from zip(numbers, map(sorted, parts), strict=True)


class _Simulation:
    """Time passes from one instant to the next at which something can be decided."""

    def __init__(
        self, starts: Sequence[ForecastStart], numbers: Sequence[int], robots: Sequence[int], site: ForecastSite
    ) -> None:
        self._starts, self._numbers, self._site = starts, numbers, site
        self._free = {robot_id: site.free.get(robot_id, -inf) for robot_id in robots}
        self._hours = {robot_id: site.hours.get(robot_id, 0.0) for robot_id in robots}
        self._days = list(site.days)
        self._next = 0  # of the numbers
        self._waiting: list[int] = []
        self._found: dict[int, ForecastSlot] = {}
        self._slow_s = cache(self._slow_duration)
        self._chosen = 0
        self._leave_at = defaultdict[str, list[float]](list)  # when each of those at a place leaves it
        for name, ends in site.at_places.items():
            self._leave_at[name] += ends

    def run(self) -> dict[int, ForecastSlot]:
        now = -inf
        while (self._next < len(self._numbers) or self._waiting) and self._chosen < MOST_CHOSEN:
            now = self._next_instant(now)
            if now == inf:  # what waits is never called
                break
            self._pass_midnights(now)
            while self._next < len(self._numbers) and self._starts[self._numbers[self._next]].planned_s <= now:
                self._falls_due(self._numbers[self._next])
                self._next += 1
            if self._waiting:
                self._choose(now)
        return self._found

    def _next_instant(self, now: float) -> float:
        due = self._starts[self._numbers[self._next]].planned_s if self._next < len(self._numbers) else inf
        if not self._waiting:
            return due
        robots = {robot_id for number in self._waiting for robot_id in self._starts[number].members}
        ends = [self._free[robot_id] for robot_id in robots]
        ends += [until for robot_id in robots for _, until in self._site.held.get(robot_id, ())]
        ends += [
            until for number in self._waiting for name in self._starts[number].places for until in self._leave_at[name]
        ]
        calls = [self._starts[number].closes_s - LAST_CALL for number in self._waiting]
        return min(due, min((instant for instant in ends + calls if instant > now), default=inf))

    def _pass_midnights(self, now: float) -> None:
        while self._days and self._days[0] <= now:
            del self._days[0]
            self._hours = dict.fromkeys(self._hours, 0.0)

    def _falls_due(self, number: int) -> None:
        each = self._starts[number]
        if each.is_fixed:
            robot_id = each.members[0]
            lasts = self._site.duration(robot_id, each.mission) or UNKNOWN_S
            self._assign(number, robot_id, each.planned_s, lasts, in_time=True)
        else:
            insort(self._waiting, number)

    def _assign(self, number: int, robot_id: int, now: float, lasts: float, *, in_time: bool) -> None:
        begins = max(now, self._free[robot_id])
        self._free[robot_id] = begins + lasts
        self._hours[robot_id] += lasts / HOUR
        self._found[number] = ForecastSlot(robot_id, begins, begins + lasts, in_time)
        for name in self._starts[number].places:
            self._leave_at[name].append(begins + lasts)

    # ------------------------------------------------------------------ decisions
    def _choose(self, now: float) -> None:
        last_calls = {number for number in self._waiting if self._starts[number].closes_s - LAST_CALL <= now}
        if not last_calls and not any(
            self._free[robot_id] <= now or self._starts[number].at_once
            for number in self._waiting
            for robot_id in self._starts[number].members
        ):
            return  # as no robot of it is free
        self._chosen += len(self._waiting)
        settled = set(last_calls)
        for decision in choose(self._situation(now, last_calls)):
            if decision.robot_id is not None:
                settled.add(decision.start.id)
                lasts = next(option.lasts_s for option in decision.options if option.robot_id == decision.robot_id)
                self._assign(
                    decision.start.id,
                    decision.robot_id,
                    now,
                    lasts,
                    in_time=not decision.is_last_call or self._free[decision.robot_id] <= now,
                )
            elif decision.too_late:
                settled.add(decision.start.id)
        self._waiting = [number for number in self._waiting if number not in settled]

    def _situation(self, now: float, last_calls: Collection[int]) -> Situation:
        starts = [self._start(number, now, number in last_calls) for number in self._waiting]
        robots = {robot_id for start in starts for robot_id in start.members}
        members = {
            robot_id: Member(
                robot_id,
                self._site.names[robot_id],
                self._free[robot_id] <= now,
                max(0.0, self._free[robot_id] - now),
                hours=self._hours[robot_id],
                ineligible=self._ineligible(robot_id, now),
            )
            for robot_id in robots
        }
        planned = list(self._protected(now, robots, min(start.priority for start in starts)))
        room = self._room_left(now, {name for start in starts for name in start.places})
        return Situation(members, starts, self._site.duration, planned, room)

    def _room_left(self, now: float, places: Iterable[str]) -> dict[str, int]:
        for name in places:
            self._leave_at[name] = [until for until in self._leave_at[name] if until > now]
        return {name: self._site.room[name] - len(self._leave_at[name]) for name in places}

    def _start(self, number: int, now: float, is_last_call: bool) -> Start:
        each = self._starts[number]
        return replace(
            each,
            id=number,
            planned_s=each.planned_s - now,
            closes_s=LAST_CALL if is_last_call else each.closes_s - now,
            finish_s=None if each.finish_s is None else each.finish_s - now,
        )

    def _ineligible(self, robot_id: int, now: float) -> Ineligible | None:
        return (
            Ineligible.HELD if any(since <= now < until for since, until in self._site.held.get(robot_id, ())) else None
        )

    def _protected(self, now: float, robots: Iterable[int], least: int) -> Iterator[PlannedStart]:
        """Starts of the next minutes that may be more important than one of that priority."""
        for number in range(self._next, len(self._numbers)):
            each = self._starts[self._numbers[number]]
            if each.planned_s > now + AHEAD:
                return
            if (each.is_fixed or each.priority > least) and not set(each.members).isdisjoint(robots):
                ahead, lasts = each.planned_s - now, self._slow_s(each.mission, each.members)
                yield PlannedStart(each.mission, each.members, ahead, lasts, each.priority, each.is_fixed)

    def _slow_duration(self, mission: str, members: Sequence[int]) -> float:
        """On the slowest of these robots."""
        lasts = (self._site.duration(robot_id, mission, slow=True) for robot_id in members)
        return max((seconds for seconds in lasts if seconds is not None), default=UNKNOWN_S)
