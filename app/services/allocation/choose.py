"""Which start goes to which robot now. Pure: the same situation gives the same decisions.

Every waiting start is assigned in turn, the most important first, each to the robot with the lowest score:

    seconds until it would be done there + PATIENCE where the robot is busy
    + EVEN for each hour that it ran today more than the one of them that ran least, but no more than PATIENCE
    + FAILED for each start that it failed since its last success, up to MOST_FAILED of them
    + the delay that this brings to planned starts that are its own or matter more, in seconds of this one's weight

A start assigned to a free robot is sent to it; one assigned to a busy robot keeps its place there and waits. Assigning
one at a time to the best robot is within a factor of three of the optimum (Gerkey and Matarić 2004 on single-task
robots and online assignment); the constants were measured in simulated days, ``tests/benchmarks/bench_allocation.py``.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from app.services.allocation.situation import HIGH, Ineligible, Member, PlannedStart, Situation, Start, weight

PATIENCE = 120.0  # s by which a busy robot has to be done sooner than a free one, to be waited for
EVEN = 30.0  # s for each hour run today
# s for each failure in a row: a free robot that did not fail is taken before it, a busy one soon done too
FAILED = 300.0
MOST_FAILED = 3  # failures that count: with no other robot it still gets every start
AHEAD = 600.0  # s within which planned starts are protected
LAST_CALL = 5.0  # s before its window closes a start goes into a queue after all
DRAIN = 10.0  # % of battery for each hour of running: a full one lasts a day's shift
RESERVE = 8.0  # % of battery that has to be left when a run ends
IN_A_HURRY = 300.0  # s to the latest start that can still be done in time


class Option(NamedTuple):
    """A robot that could take a start: when it would be done, and its score, both in s. ``taken_by``: the mission of a more
    important start that has just been assigned to it."""

    score: float
    robot_id: int
    done_s: float
    lasts_s: float
    is_free: bool
    failures: int = 0
    taken_by: str = ""


class Advantage(StrEnum):
    """What a robot had over others that were free."""

    SOONEST = "soonest"  # it will be done before they would be
    LESS_RUN = "less_run"  # it has run less today than those that would be done as soon
    AHEAD = "ahead"  # they are better where they are, for planned starts
    EQUAL = "equal"  # no advantage: it is farther away, and done at the same time


@dataclass(frozen=True)
class Decision:
    """``robot_id``: the robot that gets it now; None: none yet. ``options``: best first. ``ineligible``: why the
    other robots are not options. ``waits_for_planned``: it waits so that this planned start is on time.
    ``too_late``: no robot can finish it in time. ``full_place``: a full place for which it waits, without blocking a
    robot for others."""

    start: Start
    robot_id: int | None = None
    options: Sequence[Option] = ()
    ineligible: Sequence[tuple[int, Ineligible]] = ()
    waits_for_planned: PlannedStart | None = None
    is_last_call: bool = False
    too_late: bool = False
    full_place: str | None = None

    @property
    def advantage(self) -> Advantage | None:
        """The chosen robot's advantage over other free ones; None: none, or no other is free."""
        chosen = next((option for option in self.options if option.robot_id == self.robot_id), None)
        others = [option for option in self.options if option.is_free and option is not chosen]
        if chosen is None or not others:
            return None
        if chosen.done_s < min(other.done_s for other in others):
            return Advantage.SOONEST
        if not chosen.is_free:
            return None
        peers = [
            other for other in others if other.failures <= chosen.failures and not self.start.is_too_late(other.done_s)
        ]
        if not peers or chosen.done_s < min(peer.done_s for peer in peers):
            return None  # how often each of the others failed is in its own text
        least = min(peer.score for peer in peers)
        return Advantage.LESS_RUN if chosen.score < least else Advantage.AHEAD if chosen.score > least else None


def choose(situation: Situation) -> list[Decision]:
    """A decision for each start, in the order in which they are assigned."""
    return list(_Assignment(situation).choose_all())


class _Assignment:
    """The robots as they would be with the starts assigned to them so far."""

    def __init__(self, situation: Situation) -> None:
        self._situation = situation
        usable = [robot for robot in situation.robots.values() if robot.ineligible is None]
        self._free_s = {robot.id: robot.free_s for robot in usable}
        self._idle = {robot.id for robot in usable if robot.is_free}
        self._room = dict(situation.room)
        self._missions: dict[int, str] = {}  # the first mission assigned to each robot
        self._delays: dict[tuple[int, int, float], float] = {}  # known ones, until a robot gets something

    def choose_all(self) -> Iterator[Decision]:
        for start in sorted(self._situation.starts, key=self._rank):
            yield self._choose(start)

    def _rank(self, start: Start) -> tuple[float, ...]:
        return -start.priority, not self._is_in_a_hurry(start), start.planned_s, start.id

    def _is_in_a_hurry(self, start: Start) -> bool:
        return start.finish_s is not None and start.finish_s - self._shortest(start) < IN_A_HURRY

    def _shortest(self, start: Start) -> float:
        """Seconds that it takes at least, with any robot free."""
        lasts = [
            self._situation.duration(robot_id, start.mission)
            for robot_id in start.members
            if robot_id in self._situation.robots
        ]
        return min((seconds for seconds in lasts if seconds is not None), default=0.0)

    # ------------------------------------------------------------------ one start
    def _choose(self, start: Start) -> Decision:
        options, ineligible = self._options(start)
        if (full := next((place for place in start.places if self._room.get(place, 1) <= 0), None)) is not None:
            return Decision(start, None, options, ineligible, full_place=full)
        if not options:
            return Decision(start, ineligible=ineligible)
        is_last_call = start.closes_s <= LAST_CALL
        in_time = [option for option in options if not start.is_too_late(option.done_s)]
        if not in_time:
            is_impossible = start.is_too_late(self._shortest(start))  # even for the fastest, if it began now
            return Decision(start, None, options, ineligible, too_late=is_last_call or is_impossible)
        may_go = not self._idle.isdisjoint(start.members) or start.at_once  # else it waits regardless of the plan
        protected = (
            []
            if is_last_call or not may_go
            else [each for each in self._situation.planned if each.is_fixed or each.priority > start.priority]
        )
        first = next((each for each in protected if not set(each.members).isdisjoint(start.members)), None)
        best = self._best_after_delays(start, in_time, protected, first) if first is not None else in_time[0]
        if best is None:
            return Decision(start, None, options, ineligible, waits_for_planned=first)
        is_assigned = is_last_call or start.at_once or (best.is_free and self._may_use_one_more(start))
        self._idle.discard(best.robot_id)
        self._missions.setdefault(best.robot_id, start.mission)
        self._free_s[best.robot_id] = best.done_s
        self._delays.clear()
        if is_assigned:
            self._room.update({place: self._room[place] - 1 for place in start.places if place in self._room})
        return Decision(start, best.robot_id if is_assigned else None, options, ineligible, is_last_call=is_last_call)

    def _may_use_one_more(self, start: Start) -> bool:
        return start.priority >= HIGH or len(self._idle.intersection(start.members)) > start.keep_free

    def _options(self, start: Start) -> tuple[list[Option], list[tuple[int, Ineligible]]]:
        options, ineligible = [], []
        fewest = min(
            (self._situation.robots[robot_id].hours for robot_id in start.members if robot_id in self._free_s),
            default=0.0,
        )
        for robot_id in start.members:
            robot = self._situation.robots.get(robot_id)
            if robot is None:
                continue  # it has just been removed
            if (why := robot.ineligible or start.tried.get(robot_id) or _too_low(robot, start)) is not None:
                ineligible.append((robot_id, why))
                continue
            lasts = self._situation.duration(robot_id, start.mission)
            if lasts is None:
                ineligible.append((robot_id, Ineligible.LACKS_MISSION))
            elif robot.battery is not None and robot.battery - lasts / 3600 * DRAIN < RESERVE:
                ineligible.append((robot_id, Ineligible.TOO_LITTLE_BATTERY))
            else:
                done, is_free = self._free_s[robot_id] + lasts, robot_id in self._idle
                even = min(EVEN * (robot.hours - fewest), PATIENCE)  # never a reason to wait for another robot
                failed = FAILED * min(robot.failures, MOST_FAILED)
                score = done + (0.0 if is_free else PATIENCE) + even + failed
                options.append(
                    Option(score, robot_id, done, lasts, is_free, robot.failures, self._missions.get(robot_id, ""))
                )
        options.sort(key=lambda option: (option.score, self._situation.robots[option.robot_id].name))
        return options, ineligible

    def _best_after_delays(
        self, start: Start, options: Sequence[Option], protected: Sequence[PlannedStart], first: PlannedStart
    ) -> Option | None:
        """The best option including the delays it causes; None: waiting until after ``first``, for the same robots, is
        better than every option."""
        before = self._delay(start.priority, protected, options[0].robot_id, 0.0)
        best, least = None, float("inf")
        for option in options:
            if option.score >= least:  # its delay can't make it better
                break
            slow = self._situation.duration(option.robot_id, start.mission, slow=True) or option.lasts_s
            after = self._delay(start.priority, protected, option.robot_id, max(slow, option.lasts_s))
            total = option.score + (after - before) / weight(start.priority)
            if total < least:
                best, least = option, total
        behind = max(0.0, first.planned_s) + options[0].score + options[0].lasts_s
        return best if least <= behind else None

    def _delay(self, priority: int, protected: Sequence[PlannedStart], robot_id: int, busy_s: float) -> float:
        """With this robot busy so much longer. Starts of one priority protect the same, so like ones ask the same."""
        key = priority, robot_id, busy_s
        if key not in self._delays:
            self._delays[key] = delay(protected, {**self._free_s, robot_id: self._free_s[robot_id] + busy_s})
        return self._delays[key]


def _too_low(robot: Member, start: Start) -> Ineligible | None:
    wanted = start.minimum_battery
    return Ineligible.LOW_BATTERY if wanted is not None and (robot.battery is None or robot.battery < wanted) else None


def delay(planned: Sequence[PlannedStart], free_s: Mapping[int, float]) -> float:
    """How late planned starts would be because of assignments now, in weighted seconds. ``free_s``: when each usable
    robot is free. A start for several robots gets, of those free in time, the last one: the others are left for earlier
    starts."""
    total = 0.0
    of_groups: dict[tuple[int, ...], list[float]] = {}
    for start in planned:
        if start.is_fixed:
            total += start.weight * max(0.0, free_s.get(start.members[0], 0.0) - start.planned_s)
            continue
        times = of_groups.get(start.members)
        if times is None:
            times = of_groups[start.members] = sorted(
                free_s[robot_id] for robot_id in start.members if robot_id in free_s
            )
        if times:
            begins = max(times.pop(max(0, bisect_right(times, start.planned_s) - 1)), start.planned_s)
            total += start.weight * (begins - start.planned_s)
            insort(times, begins + start.lasts_s)
    return total
