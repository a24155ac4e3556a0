"""A day at a site, event by event. Robots run what stands in their queues, in order; the app sees them with a delay, and a policy sends."""

from __future__ import annotations

import heapq
import itertools
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from app.services.allocation.situation import CRITICAL, NORMAL, remaining_duration, weight
from tests.benchmarks.hall.site import HOUR, MINUTE, Learned, Machine, Mission, Place, Run, Site, run_time, way

POLL_S = 2.0  # between looks at a robot that matters
POST_S = 0.1  # from the decision to the robot
QUIET_S = 90.0  # in which a request may still be under way
AGAIN_S = 5.0  # between decisions while something waits and nothing happens
MINIMUM = 20.0  # % of battery under which nothing is sent
DRIVING, STANDING, CHARGING = -8.0, -2.0, 80.0  # % an hour
TRIES = 10  # of a policy that does not turn to another robot


@dataclass(frozen=True)
class Trouble:
    """Means and shares; ``chance`` False: every run takes its usual time, and no robot falls silent."""

    silent_every: float = 12 * HOUR
    silent_most: float = 8 * MINUTE
    abort: float = 0.01  # of the runs; the robot then stands in Error until a person comes
    error_most: float = 15 * MINUTE
    unknown: float = 0.15  # of the requests to a robot that has just fallen silent: sent, and never answered
    chance: bool = True


ROUGH = Trouble(silent_every=1.5 * HOUR, silent_most=20 * MINUTE, abort=0.02)
CALM = Trouble(chance=False)


@dataclass(eq=False)
class Robot:
    machine: Machine
    place: Place
    battery: float
    queue: list[tuple[Mission, Run | None]] = field(default_factory=list)  # None: queued by somebody else
    running: tuple[Mission, Run | None] | None = None
    began: float = 0.0
    drives_to_charger: bool = False
    charges: bool = False  # until something else comes
    battery_at: float = 0.0
    idle_since: float = 0.0
    busy: float = 0.0
    error: bool = False
    silent: bool = False
    known_error: bool = False  # as the app has it
    known_silent: bool = False
    seen_idle: bool = True

    @property
    def number(self) -> int:
        return self.machine.number

    @property
    def is_free(self) -> bool:
        return self.running is None and not self.queue and not self.drives_to_charger and not self.error

    @property
    def is_known_down(self) -> bool:
        return self.known_silent or self.known_error


class Policy(Protocol):
    turns_to_others: bool  # when a robot can't be connected to

    def decide(self, day: Day) -> None: ...


class Day:
    def __init__(
        self,
        site: Site,
        learned: Learned,
        policy: Policy,
        seed: int,
        trouble: Trouble | None = None,
        runs: list[Run] | None = None,
    ) -> None:
        self.site, self.learned, self.policy, self.trouble = site, learned, policy, trouble or Trouble()
        self._rng = random.Random(f"day/{seed}")
        self.now = 0.0
        self.robots = [Robot(machine, self._rng.choice(site.places), machine.battery) for machine in site.machines]
        self.runs = site.runs() if runs is None else runs
        self.waiting: list[Run] = []
        self._planned = [run for run in self.runs if not run.is_urgent]
        self._fallen = 0  # of them are due
        self._events: list[tuple[float, int, Callable[..., None], tuple[Any, ...]]] = []
        self._order = itertools.count()
        self._looks_again = False
        self.empty_m, self.trips = 0.0, 0
        for run in self.runs:
            self.at(run.planned, self._due, run)
        for at, mission, number in site.by_hand:
            self.at(at, self._by_hand, mission, number)
        for robot in self.robots:
            if self.trouble.chance:
                self.at(self._rng.expovariate(1 / self.trouble.silent_every), self._fall_silent, robot)
            self.at(5 * MINUTE, self._idle_for_long, robot, 0.0)

    def at(self, seconds: float, call: Callable[..., None], *about: Any) -> None:
        heapq.heappush(self._events, (seconds, next(self._order), call, about))

    def run(self, more: float = 2 * HOUR) -> Day:
        end = self.site.hours * HOUR + more
        while self._events and self._events[0][0] <= end:
            self.now, _, call, about = heapq.heappop(self._events)
            call(*about)
        return self

    # ------------------------------------------------------------------ the app
    def _due(self, run: Run) -> None:
        self._fallen += not run.is_urgent
        self.waiting.append(run)
        self.decide()

    def decide(self) -> None:
        for run in [run for run in self.waiting if self.now >= run.closes]:
            run.state = "skipped"
            self.waiting.remove(run)
        if self.waiting:
            self.policy.decide(self)
            if self.waiting and not self._looks_again:
                self._looks_again = True
                self.at(self.now + AGAIN_S, self._look_again)

    def _look_again(self) -> None:
        self._looks_again = False
        self.decide()

    def coming(self, ahead: float) -> list[Run]:
        """Future planned starts, in order of time."""
        later = itertools.islice(self._planned, self._fallen, None)
        return list(itertools.takewhile(lambda run: run.planned <= self.now + ahead, later))

    def send(self, run: Run, robot: Robot) -> bool:
        """The POST. Whether the start is with that robot now, or may be: then no other robot gets it."""
        self.waiting.remove(run)
        run.tries += 1
        run.robot = robot.number
        if not robot.silent:
            self._take(run, robot)
            return True
        if self._rng.random() < self.trouble.unknown:
            run.state = "submitting"
            if self._rng.random() < 0.5:
                self._take(run, robot)
            return True
        robot.known_silent, run.robot = True, None  # never connected: nothing was sent
        pause = min(2.0**run.tries, 30.0)
        run.barred[robot.number] = self.now + pause
        turns = self.policy.turns_to_others and not run.is_fixed
        run.not_before = self.now + (1.0 if turns else pause)
        if run.tries > TRIES and not turns:
            run.state = "failed"
        else:
            self.waiting.append(run)
        return False

    def _take(self, run: Run, robot: Robot) -> None:
        if run.state == "waiting":
            run.state = "queued"
        robot.seen_idle = False
        robot.queue.append((run.mission, run))
        self.at(self.now + POST_S, self._next, robot)

    # ------------------------------------------------------------------ what the app believes
    def free_in(self, robot: Robot) -> tuple[float, Place]:
        """Expected s until it has nothing more to do, and where it will be then."""
        seconds, place = 0.0, robot.place
        if robot.running is not None:
            mission = robot.running[0]
            seconds = remaining_duration(self.learned.estimate(robot.number, mission), self.now - robot.began)
            place = mission.last
        elif robot.drives_to_charger:
            seconds, place = 30.0, self.site.charger
        for mission, _run in robot.queue:
            seconds += self.learned.takes(robot.number, mission)
            place = mission.last
        return (seconds or (0.0 if robot.seen_idle else POLL_S / 2)), place

    @staticmethod
    def is_idle(robot: Robot) -> bool:
        return robot.is_free and robot.seen_idle and not robot.is_known_down

    def can_take(self, run: Run, robot: Robot) -> bool:
        return (
            not robot.is_known_down and run.barred.get(robot.number, 0.0) <= self.now and self.level(robot) >= MINIMUM
        )

    # ------------------------------------------------------------------ the robots
    def level(self, robot: Robot) -> float:
        """Its battery now, %."""
        rate = DRIVING if robot.running or robot.drives_to_charger else CHARGING if robot.charges else STANDING
        robot.battery = min(100.0, max(0.0, robot.battery + rate * (self.now - robot.battery_at) / HOUR))
        robot.battery_at = self.now
        return robot.battery

    def _by_hand(self, mission: Mission, number: int) -> None:
        robot = self.robots[number]
        robot.queue.append((mission, None))
        robot.seen_idle = False
        self._next(robot)

    def _next(self, robot: Robot) -> None:
        if robot.running is not None or robot.error or robot.drives_to_charger or not robot.queue:
            return
        self.level(robot)
        robot.charges = False
        robot.running, robot.began = robot.queue.pop(0), self.now
        mission, run = robot.running
        if run is not None:
            run.started = self.now
        self.empty_m += way(robot.place, mission.first)
        self.trips += 1
        taken = run_time(self._rng if self.trouble.chance else None, mission, robot.machine, robot.place)
        self.at(self.now + taken, self._end, robot)

    def _end(self, robot: Robot) -> None:
        mission, run = robot.running
        self.level(robot)
        robot.busy += self.now - robot.began
        robot.running, robot.place = None, mission.last
        if run is not None:
            run.ended, run.state = self.now, "completed"
        if self.trouble.chance and self._rng.random() < self.trouble.abort:
            robot.error = True
            self.at(self.now + self._rng.uniform(0.2, 1) * self.trouble.error_most, self._mended, robot)
            self.at(self.now + self._rng.uniform(0, POLL_S), self._hear_of_error, robot, True)
            return
        self._go_on(robot)

    def _go_on(self, robot: Robot) -> None:
        self._next(robot)
        if robot.running is None:
            robot.idle_since = self.now
            self.at(self.now + 5 * MINUTE, self._idle_for_long, robot, self.now)
            self.at(self.now + self._rng.uniform(0, POLL_S) + 0.05, self._see, robot)

    def _see(self, robot: Robot) -> None:
        if robot.is_free and not robot.silent:
            robot.seen_idle = True
            self.decide()

    def _hear_of_error(self, robot: Robot, is_so: bool) -> None:
        robot.known_error = is_so
        self.decide()

    def _mended(self, robot: Robot) -> None:
        robot.error = False
        self.at(self.now + self._rng.uniform(0, POLL_S), self._hear_of_error, robot, False)
        self._go_on(robot)

    def _idle_for_long(self, robot: Robot, since: float) -> None:
        """Idle automation: to the charger, until something else comes."""
        if robot.is_free and not robot.charges and robot.idle_since == since and self.level(robot) < 95:
            robot.drives_to_charger, robot.seen_idle = True, False
            self.at(self.now + way(robot.place, self.site.charger) / robot.machine.speed + 15, self._dock, robot)

    def _dock(self, robot: Robot) -> None:
        self.level(robot)
        robot.drives_to_charger, robot.charges, robot.place = False, True, self.site.charger
        self._next(robot)
        if robot.running is None:
            self.at(self.now + self._rng.uniform(0, POLL_S) + 0.05, self._see, robot)

    def _fall_silent(self, robot: Robot) -> None:
        robot.silent = True
        self.at(self.now + self._rng.uniform(2, 6), self._notice, robot)
        self.at(self.now + self._rng.uniform(0.1, 1) * self.trouble.silent_most, self._speak, robot)

    def _notice(self, robot: Robot) -> None:
        if robot.silent:
            robot.known_silent = True
            self.decide()

    def _speak(self, robot: Robot) -> None:
        robot.silent = False
        self.at(self.now + self._rng.uniform(0, 30), self._hear, robot)
        self.at(self.now + self._rng.expovariate(1 / self.trouble.silent_every), self._fall_silent, robot)

    def _hear(self, robot: Robot) -> None:
        """It answers again: what was unknown there is looked for."""
        if robot.silent:
            return
        robot.known_silent = False
        robot.seen_idle = robot.seen_idle or robot.is_free
        for run in self.runs:
            if run.state == "submitting" and run.robot == robot.number:
                if run.started is not None or any(queued is run for _mission, queued in robot.queue):
                    run.state = "queued"
                else:
                    self.at(max(self.now, run.planned + QUIET_S), self._absent, run)
        self.decide()

    def _absent(self, run: Run) -> None:
        """Read after the quiet time, and not there: any robot may get it."""
        run.state, run.robot = "waiting", None
        self.waiting.append(run)
        self.decide()


def figures(day: Day) -> dict[str, float]:
    """Times in s, shares in %: what people at the site would notice."""
    runs, hours = day.runs, day.site.hours * HOUR
    late = sorted(run.late_s for run in runs)
    planned = [run for run in runs if run.priority == CRITICAL and not run.is_urgent]
    urgent = [run for run in runs if run.is_urgent]
    busy = [robot.busy / hours for robot in day.robots]

    def at(ordered: list[float], share: float) -> float:
        return ordered[min(len(ordered) - 1, int(share * len(ordered)))]

    return {
        "use": 100 * sum(busy) / len(busy),
        "p50": at(late, 0.5),
        "p95": at(late, 0.95),
        "normal p95": at(sorted(run.late_s for run in runs if run.priority == NORMAL), 0.95),
        "missed": 100 * sum(run.started is None or run.started > run.closes for run in runs) / len(runs),
        "critical": 100 * sum(run.late_s > MINUTE for run in planned) / max(1, len(planned)),
        "urgent": sum(run.late_s for run in urgent) / max(1, len(urgent)),
        "spread": 100 * (max(busy) - min(busy)),
        "empty": day.empty_m / max(1, day.trips),
        "weighted": sum(weight(run.priority) * run.late_s for run in runs) / len(runs),
    }
