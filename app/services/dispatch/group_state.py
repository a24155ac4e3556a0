"""What the allocator knows of the robots and starts of groups at one moment, as ``app.services.allocation`` wants it."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from functools import cache
from statistics import fmean
from typing import Any
from zoneinfo import ZoneInfo

from app.database.executions import ExecutionRepository
from app.database.group_executions import FullPlace, GroupExecutionRepository
from app.database.missions import DurationRepository, StopRepository
from app.database.values import to_instant
from app.domain.activity import at_work, can_work, is_free
from app.domain.clock import midnight
from app.domain.execution import DurationEstimate, Execution
from app.domain.models import Connection, Group, HandOver, Mission, Robot
from app.domain.robot import QueueItem, QueueState, RobotStatus, Spot, Stop, straight_way
from app.services.allocation.choose import AHEAD, Advantage, Decision, Option
from app.services.allocation.situation import (
    FEW_RUNS,
    UNKNOWN_S,
    Ineligible,
    Member,
    PlannedStart,
    Situation,
    Start,
    remaining_duration,
    run_duration,
)
from app.services.dispatch.context import Context
from app.services.dispatch.worker import RobotWorker
from app.services.live.snapshots import STALE_POLLS
from app.services.planning.durations import expected, pooled

MOST_SHOWN = 5  # robots named in a choice
ABOUT = 30.0  # s: an instant is given to the nearest minute
KEPT_FOR = 60.0  # s that an estimate holds


class UsualDurations:
    """Usual durations of missions on robots, their positions, and robots' running time today, read once a minute from
    tables apart from the history, whose length never matters."""

    def __init__(self, context: Context) -> None:
        self._s, self._durations, self._all_stops = context, DurationRepository(), StopRepository()
        self._hours: Mapping[int, float] = {}
        self._hours_hold_until = -math.inf
        self._known: dict[
            tuple[int, str], tuple[float, DurationEstimate | None]
        ] = {}  # with the monotonic time until which it is valid
        self._stops: Mapping[str, Sequence[Stop]] = {}
        self._stops_hold_until = -math.inf

    def usual(self, robot_id: int, guid: str) -> DurationEstimate | None:
        mono, key = self._s.clock.monotonic(), (robot_id, guid)
        if key not in self._known or self._known[key][0] < mono:
            self._known[key] = (
                mono + KEPT_FOR,
                self._durations.usual(self._s.db.read(), robot_id, guid) if guid else None,
            )
        return self._known[key][1]

    def stops(self) -> Mapping[str, Sequence[Stop]]:
        """What missions drive to, by guid."""
        mono = self._s.clock.monotonic()
        if self._stops_hold_until < mono:
            self._stops, self._stops_hold_until = self._all_stops.all(self._s.db.read()), mono + KEPT_FOR
        return self._stops

    def hours_today(self) -> Mapping[int, float]:
        """By the robot's id; for the local day, including missions of others."""
        mono = self._s.clock.monotonic()
        if self._hours_hold_until < mono:
            zone, now = ZoneInfo(self._s.settings().timezone), self._s.clock.now()
            today = midnight(now.astimezone(zone).date(), zone)
            self._hours, self._hours_hold_until = (
                self._s.activities.hours_executing(self._s.db.read(), today, now),
                mono + KEPT_FOR,
            )
        return self._hours


class GroupState:
    """``lacks``: whether a robot certainly does not have a mission, by their id and guid."""

    def __init__(
        self,
        context: Context,
        experience: UsualDurations,
        workers: Mapping[int, RobotWorker],
        members: Collection[int],
        lacks: Callable[[int, str], bool],
    ) -> None:
        self._s, self._executions, self._c, self._now = (
            context,
            ExecutionRepository(),
            context.db.read(),
            context.clock.now(),
        )
        self._usual, self._hours, self._stops, self._lacks = (
            experience.usual,
            experience.hours_today(),
            experience.stops(),
            lacks,
        )
        self._run_durations: dict[tuple[int, str, bool], float | None] = {}
        self._mean_way: dict[str, float] = {}  # to each mission's first stop, of the robots that may get a start, in m
        self._spots: dict[int, Spot | None] = {}  # of each robot when it is free
        self._of_group: dict[str, DurationEstimate | None] = {}
        configured = self._s.missions.all(self._c)
        self._by_guid = {mission.guid: mission for mission in configured}
        self._by_name = {(mission.robot_id, mission.name): mission for mission in configured}
        self._all, self._seem_free = tuple(sorted(members)), set[int]()
        self._room = GroupExecutionRepository().room(self._c)
        self.robots = {key: workers[key].robot for key in self._all if key in workers}
        self._failures = context.robots.failures(self._c, self._all)
        self.members = {key: self._member(workers[key]) for key in self.robots}

    def situation(self, rows: Iterable[Execution], groups: Mapping[int, Group]) -> Situation:
        starts = [self._start(row, groups[row.group_id or 0]) for row in rows]
        return Situation(
            self.members,
            starts,
            self.duration,
            self._planned_starts(groups),
            {room.place: room.left for room in self._room},
        )

    def _planned_starts(self, groups: Mapping[int, Group]) -> list[PlannedStart]:
        """The next start of each schedule that these robots may get."""

        @cache
        def longest(mission: str, members: tuple[int, ...]) -> float:
            lasts = [self.duration(robot_id, mission, slow=True) for robot_id in members]
            return max((seconds for seconds in lasts if seconds is not None), default=UNKNOWN_S)

        found, until = [], self._now + timedelta(seconds=AHEAD)
        for at, mission, robot_id, group_id, priority in self._s.schedules.next_starts(self._c, self._now, until):
            group, is_fixed = groups.get(group_id or 0), robot_id is not None
            members = group.members if group is not None else () if robot_id is None else (robot_id,)
            if not self.robots.keys().isdisjoint(members):
                lasts = longest(mission, members)
                found.append(PlannedStart(mission, members, self._seconds(at), lasts, priority, is_fixed))
        return found

    def _seconds(self, instant: datetime) -> float:
        return (instant - self._now).total_seconds()

    # ------------------------------------------------------------------ robots
    def _member(self, worker: RobotWorker) -> Member:
        robot, status, queue = worker.robot, self._status(worker), self._s.snapshots.get(worker.robot.id).queue
        rows, ineligible = self._executions.open_for(self._c, robot.id), self._ineligible(worker)
        seems_free = ineligible is None and is_free(status, queue, rows)
        if seems_free:
            self._seem_free.add(robot.id)
        self._spots[robot.id] = (
            status.spot if seems_free and status is not None else self._ends_at(queue, at_work(rows, status))
        )
        return Member(
            robot.id,
            robot.name,
            is_free=seems_free and worker.seen.fresh_status is not None,
            free_s=0.0 if seems_free else self._free_s(robot, at_work(rows, status)),
            battery=None if status is None else robot.battery(status),
            hours=self._hours.get(robot.id, 0.0),
            failures=self._failures.get(robot.id, 0),
            ineligible=ineligible,
        )

    def _status(self, worker: RobotWorker) -> RobotStatus | None:
        """As read last, of a robot that answers: one that waits for its next read, or is being read, is not silent."""
        snapshot, trusted_for = (
            self._s.snapshots.get(worker.robot.id),
            STALE_POLLS * self._s.settings().poll_interval_seconds,
        )
        is_known = (
            snapshot.connection in (Connection.CONNECTED, Connection.SLOW) and worker.seen.answered_ago <= trusted_for
        )
        return worker.seen.fresh_status or (snapshot.status if is_known else None)

    def _ineligible(self, worker: RobotWorker) -> Ineligible | None:
        robot, snapshot = worker.robot, self._s.snapshots.get(worker.robot.id)
        if not robot.enabled or robot.needs_password:
            return Ineligible.OFF
        if robot.needs_check_up:
            return Ineligible.UNCHECKED
        if self._s.holds.active(robot.id) or self._s.clearing.is_of(robot.id):
            return Ineligible.HELD
        if snapshot.connection is Connection.WRONG_ROBOT:
            return Ineligible.WRONG_ROBOT
        status = self._status(worker)
        if status is None:
            return Ineligible.SILENT
        return None if can_work(status) else Ineligible.STOPPED

    def _free_s(self, robot: Robot, open_ones: Sequence[Execution]) -> float:
        """The rest of the running mission and all pending ones, also of others, and the app's starts that are not there
        yet."""
        queue = self._s.snapshots.get(robot.id).queue
        by_item = {row.queue_id: row for row in open_ones if row.queue_id is not None}
        left = 0.0
        for item in queue:
            estimate = self._lasts(robot.id, item.mission_id or "")
            if item.state is QueueState.EXECUTING:
                row = by_item.get(item.id)
                left += remaining_duration(estimate, -self._seconds(row.started_at) if row and row.started_at else 0.0)
            else:
                left += run_duration(estimate, None)
        seen = {item.id for item in queue}
        return left + sum(
            run_duration(self._lasts(robot.id, row.mission_guid), None) for row in open_ones if row.queue_id not in seen
        )

    def _ends_at(self, queue: Sequence[QueueItem], open_ones: Sequence[Execution]) -> Spot | None:
        """Where the last mission of a robot ends; the app's own, if the queue was read before it arrived."""
        seen = {item.id for item in queue}
        guids = [row.mission_guid for row in open_ones if row.queue_id not in seen] or [
            item.mission_id or "" for item in queue
        ]
        stops = self._stops.get(guids[-1]) if guids else None
        return stops[-1].spot if stops else None

    def _lasts(self, robot_id: int, guid: str) -> DurationEstimate | None:
        """Duration of any item in a robot's queue: from its own runs, its group's if it had few, or as typed."""
        own, mission = self._usual(robot_id, guid), self._by_guid.get(guid)
        if mission is None or (own is not None and own.runs >= FEW_RUNS):
            return own
        return self._pooled(mission.name) or expected(own, mission)

    # ------------------------------------------------------------------ starts
    def _start(self, row: Execution, group: Group) -> Start:
        is_barred = {
            int(key): Ineligible.TRIED
            for key, each in row.tried.items()
            if each.get("is_for_good") or to_instant(each["at"]) <= self._now < to_instant(each["until"])
        }  # unless set back
        is_barred |= self._lacking(row.mission, group.members)
        return Start(
            row.id,
            row.mission,
            group.members,
            row.priority,
            self._seconds(row.planned_at),
            self._seconds(row.closes_at),
            None if row.finish_by is None else self._seconds(row.finish_by),
            row.minimum_battery_percent,
            is_barred,
            group.keep_free,
            group.hand_over is HandOver.AT_ONCE,
            tuple(room.place for room in self._room if row.mission in room.missions),
        )

    def _lacking(self, mission: str, members: Sequence[int]) -> dict[int, Ineligible]:
        """Robots whose mission list, read a while ago, lacks it; if no other robot could do it, they are still
        asked."""
        usable = [
            robot_id for robot_id in members if robot_id in self.members and self.members[robot_id].ineligible is None
        ]
        own = {robot_id: found for robot_id in usable if (found := self.mission(robot_id, mission))}
        lacking = {robot_id for robot_id, found in own.items() if self._lacks(robot_id, found.guid)}
        return dict.fromkeys(lacking, Ineligible.LACKS_MISSION) if lacking != own.keys() else {}

    def mission(self, robot_id: int, name: str) -> Mission | None:
        """That robot's own of that name, or the one for all robots."""
        return self._by_name.get((robot_id, name)) or self._by_name.get((None, name))

    def duration(self, robot_id: int, mission: str, *, slow: bool = False) -> float | None:
        """Seconds; None: it lacks the mission."""
        key = robot_id, mission, slow
        if key not in self._run_durations:
            meant = self.mission(robot_id, mission)
            self._run_durations[key] = (
                None
                if meant is None
                else run_duration(
                    expected(self._usual(robot_id, meant.guid), meant),
                    self._pooled(mission),
                    self._farther(robot_id, meant),
                    slow=slow,
                )
            )
        return self._run_durations[key]

    def _way(self, robot_id: int, mission: Mission) -> float | None:
        """The straight way to its first stop, from the robot's position when it is free, in m."""
        stops = self._stops.get(mission.guid)
        return straight_way(self._spots.get(robot_id), stops[0].spot) if stops else None

    def _farther(self, robot_id: int, mission: Mission) -> float:
        """How much its way exceeds the robots' average, in m; 0 if unknown."""
        if mission.name not in self._mean_way:
            usable = [each for each, member in self.members.items() if member.ineligible is None]
            ways = [self._way(each, found) for each in usable if (found := self.mission(each, mission.name))]
            known = [way for way in ways if way is not None]
            self._mean_way[mission.name] = fmean(known) if known else 0.0
        way = self._way(robot_id, mission)
        return 0.0 if way is None else way - self._mean_way[mission.name]

    def _pooled(self, mission: str) -> DurationEstimate | None:
        if mission not in self._of_group:
            own = [self._usual(each, found.guid) for each in self._all if (found := self.mission(each, mission))]
            self._of_group[mission] = pooled([each for each in own if each is not None])
        return self._of_group[mission]

    # ------------------------------------------------------------------ why
    def choice(self, decision: Decision) -> dict[str, Any]:
        """Codes and numbers of its sentence: of five robots at most, the best first."""
        robots: list[dict[str, Any]] = []
        best_first = sorted(
            decision.options, key=lambda option: option.robot_id != decision.robot_id
        )  # the chosen one before all
        for option in best_first[:MOST_SHOWN]:
            member = self.members[option.robot_id]
            robots.append(
                {"robot": member.name}
                | (
                    {"until": self._in(member.free_s)}
                    if member.id not in self._seem_free
                    else self._metres(member.id, decision)
                )
                | ({"failures": member.failures} if member.failures else {})
                | self._unfit(decision, option)
            )
            if option.robot_id == decision.robot_id and (advantage := decision.advantage):
                robots[-1] |= {"why": advantage} | (
                    {"done": self._in(option.done_s)} if advantage == Advantage.SOONEST else {}
                )
        if robots and decision.robot_id is not None and "why" not in robots[0] and _is_farther(*robots):
            robots[0] |= {"why": Advantage.EQUAL}
        for robot_id, why_not in decision.ineligible[: MOST_SHOWN - len(robots)]:
            member = self.members[robot_id]
            tells_battery = (
                why_not in (Ineligible.LOW_BATTERY, Ineligible.TOO_LITTLE_BATTERY) and member.battery is not None
            )
            robots.append(
                {"robot": member.name, "out": str(why_not)}
                | ({"battery": round(member.battery or 0.0)} if tells_battery else {})
            )
        more = len(decision.options) + len(decision.ineligible) - len(robots)
        kept = decision.waits_for_planned
        return {
            "robots": robots,
            **({"more": more} if more else {}),
            **({"kept_for": kept.mission} if kept else {}),
            **({"last_call": True} if decision.is_last_call else {}),
        }

    def _unfit(self, decision: Decision, option: Option) -> dict[str, Any]:
        """Why a free robot without an obstacle was not chosen. Only in a choice, as metres are."""
        if decision.robot_id is None:
            return {}
        if option.robot_id in self._seem_free and not option.is_free:
            return {"gets": option.taken_by} if option.taken_by else {"unread": True}
        return {"late": True} if decision.start.is_too_late(option.done_s) else {}

    def _metres(self, robot_id: int, decision: Decision) -> dict[str, int]:
        """Only of a choice: while it waits that would be written again each time a robot moves."""
        meant = self.mission(robot_id, decision.start.mission) if decision.robot_id is not None else None
        metres = None if meant is None else self._way(robot_id, meant)
        return {} if metres is None else {"metres": round(metres)}

    def describe_occupant(self, full: FullPlace) -> dict[str, Any]:
        """Of a place without room."""
        elapsed = 0.0 if full.started_at is None else -self._seconds(full.started_at)
        return {
            "place": full.name,
            "robot": full.robot,
            "until": self._in(remaining_duration(self._usual(full.robot_id, full.mission_guid), elapsed)),
        }

    def _in(self, seconds: float) -> str:
        """An instant to the minute, so that stored values change at most once a minute."""
        return (self._now + timedelta(seconds=seconds + ABOUT)).replace(second=0, microsecond=0).isoformat()


def _is_farther(chosen: Mapping[str, Any], *others: Mapping[str, Any]) -> bool:
    """Than one of the others without another reason."""
    metres = chosen.get("metres", 0)
    return any(other.keys() == {"robot", "metres"} and other["metres"] < metres for other in others)
