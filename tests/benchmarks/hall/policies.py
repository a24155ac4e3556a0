"""Which start gets which robot: the app's own decision and the rules it is compared with. Fixed starts go to their robot under each."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Mapping

from app.services.allocation.choose import AHEAD, LAST_CALL, choose
from app.services.allocation.situation import Ineligible, Member, PlannedStart, Situation, Start
from tests.benchmarks.hall.day import MINIMUM, Day, Robot
from tests.benchmarks.hall.site import HOUR, Run


def in_order(runs: list[Run]) -> list[Run]:
    return sorted(runs, key=lambda run: (-run.priority, run.planned, run.id))


class Rule:
    """Base of the rules that look at one start after the other."""

    turns_to_others = True

    def decide(self, day: Day) -> None:
        for run in in_order([run for run in day.waiting if run.not_before <= day.now]):
            if not run.is_fixed:
                self.give(day, run)
            elif run.home is not None and day.level(day.robots[run.home]) >= MINIMUM:
                day.send(run, day.robots[run.home])

    def give(self, day: Day, run: Run) -> None:
        raise NotImplementedError


class FixedRobot(Rule):
    """As without groups: the schedule names the robot. An urgent one goes where the operator sees least to do."""

    turns_to_others = False

    def give(self, day: Day, run: Run) -> None:
        number = run.home
        if number is None:
            known = [robot for robot in day.robots if not robot.is_known_down] or day.robots
            number = min(known, key=lambda robot: (len(robot.queue) + (robot.running is not None), robot.number)).number
        if day.level(day.robots[number]) >= MINIMUM:
            day.send(run, day.robots[number])


class NearestIdle(Rule):
    """With the app until a robot is free, of these to the one that is done first, and into a queue just before it is too late."""

    def give(self, day: Day, run: Run) -> None:
        def done(robot: Robot) -> tuple[float, int]:
            farther = day.learned.way(robot.place, run.mission)
            return day.learned.takes(robot.number, run.mission, farther), robot.number

        robots = [robot for robot in day.robots if day.can_take(run, robot)]
        if idle := [robot for robot in robots if day.is_idle(robot)]:
            day.send(run, min(idle, key=done))
        elif robots and day.now >= run.closes - LAST_CALL:
            day.send(run, min(robots, key=lambda robot: (day.free_in(robot)[0], robot.number)))


class ThisApp(Rule):
    """The app's own decision code, with all that waits. ``ahead``: s within which planned starts are protected; ``keep_free``: robots."""

    def __init__(self, ahead: float = AHEAD, keep_free: int = 0) -> None:
        self._ahead, self._keep_free = ahead, keep_free

    def decide(self, day: Day) -> None:
        super().decide(day)  # the fixed ones
        runs = {run.id: run for run in day.waiting if not run.is_fixed and run.not_before <= day.now}
        if not runs:
            return
        for decision in choose(self.situation(day, runs.values())):
            if decision.robot_id is not None:
                day.send(runs[decision.start.id], day.robots[decision.robot_id])

    def give(self, day: Day, run: Run) -> None:
        """Together, not one by one."""

    def situation(self, day: Day, runs: Iterable[Run]) -> Situation:
        everybody = tuple(range(len(day.robots)))
        believed = [day.free_in(robot) for robot in day.robots]
        missions = {str(mission.number): mission for mission in day.site.missions}
        places, mean_ways = [place for _free_s, place in believed], dict[str, float]()

        def takes(robot_id: int, mission: str, *, slow: bool = False) -> float:
            wanted = missions[mission]
            if mission not in mean_ways:
                usable = [place for robot, place in zip(day.robots, places, strict=True) if not robot.is_known_down]
                ways = [day.learned.way(place, wanted) for place in usable or places]
                mean_ways[mission] = statistics.fmean(ways)
            farther = day.learned.way(places[robot_id], wanted) - mean_ways[mission]
            return day.learned.takes(robot_id, wanted, farther, slow=slow)

        robots = {
            robot.number: Member(
                robot.number,
                f"{robot.number:02d}",
                day.is_idle(robot),
                believed[robot.number][0],
                day.level(robot),
                robot.busy / HOUR,
                Ineligible.SILENT if robot.known_silent else Ineligible.STOPPED if robot.known_error else None,
            )
            for robot in day.robots
        }
        starts = [
            Start(
                run.id,
                str(run.mission.number),
                everybody,
                run.priority,
                run.planned - day.now,
                run.closes - day.now,
                minimum_battery=MINIMUM,
                keep_free=self._keep_free,
                tried={number: Ineligible.TRIED for number, until in run.barred.items() if until > day.now},
            )
            for run in runs
        ]
        coming = (
            [
                PlannedStart(
                    str(run.mission.number),
                    (run.home,) if run.is_fixed and run.home is not None else everybody,
                    run.planned - day.now,
                    day.site.mean_s,
                    run.priority,
                    run.is_fixed and run.home is not None,
                )
                for run in day.coming(self._ahead)
            ]
            if self._ahead
            else []
        )
        return Situation(robots, starts, takes, coming)


NO_METRES = "this app without positions"
POLICIES: Mapping[str, Callable[[], Rule]] = {
    "fixed robot": FixedRobot,
    "nearest idle": NearestIdle,
    "this app without look-ahead": lambda: ThisApp(0.0),
    NO_METRES: ThisApp,
    "this app": ThisApp,
}
