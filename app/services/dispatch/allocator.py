"""Gives each start of a group to one of its robots as soon as one is free, and never to two.

A start of a group is a row without a robot. There is one allocator, on the engine's thread: it believes what the workers have read
(``_members``), has ``app.services.allocation`` decide, and binds: one write that finds the row still without a robot, and everything as it
was. From then on the row is that robot's worker's, which alone gives it back, when certainly nothing of it is on the robot.
"""
from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any

from app.database.executions import ExecutionRepository
from app.database.groups import GroupRepository
from app.database.values import to_instant
from app.domain.activity import activity_of
from app.domain.models import Connection, DurationEstimate, Execution, Group, HandOver, Mission, Reason, ReasonCode, Robot, Trigger, Wait
from app.domain.robot import QueueState, RobotState
from app.services.allocation import estimates
from app.services.allocation.belief import Coming, Member, Out, Situation, Start
from app.services.allocation.decide import AHEAD, Decision, decide
from app.services.dispatch.shared import Shared
from app.services.dispatch.waiting import Waiting, taken_back
from app.services.dispatch.worker import RobotWorker
from app.services.planning.durations import expected, pooled

DECIDES_EVERY = 5.0          # s, whatever happens
MOST_TOLD = 5                # robots of which a choice tells
WORKS = (RobotState.READY, RobotState.EXECUTING)
AFTER_A_RUN = (RobotState.ABORTED, RobotState.COMPLETED, RobotState.DOCKED, RobotState.DOCKING)      # for moments


class Allocator:
    def __init__(self, shared: Shared) -> None:
        self._s, self._ledger, self._clock = shared, shared.ledger, shared.clock
        self._executions, self._groups = ExecutionRepository(), GroupRepository()
        self._waiting = Waiting(shared, None, self._later)
        self._look_at: dict[int, float] = {}                  # by row, on the monotonic clock
        self.members: frozenset[int] = frozenset()            # robots that something waits for

    def _later(self, row: Execution, seconds: float) -> None:
        self._look_at[row.id] = self._clock.monotonic() + seconds

    def advance(self, workers: Mapping[int, RobotWorker], only: int | None = None) -> float:
        """Decide about all that waits, or this one. Returns the seconds until that is wanted again; infinite: nothing waits."""
        rows = [row for row in self._ledger.unbound() if only in (None, row.id)]
        if not rows:
            self.members = frozenset()
            return math.inf
        self._waiting.forget_all_but({row.id for row in rows})
        groups = {group.id: group for group in self._groups.all(self._s.db.read())}
        free_rows = [row for row in rows if self._is_to_be_given(row, groups.get(row.group_id or 0))]
        self.members = frozenset(robot_id for row in free_rows for robot_id in groups[row.group_id or 0].members)
        if free_rows:
            belief = _Belief(self._s, self._executions, workers, self.members)
            for decision in decide(belief.situation(free_rows, groups)):
                self._carry_out(decision, {row.id: row for row in free_rows}[decision.start.id], belief)
        return DECIDES_EVERY

    # ------------------------------------------------------------------ what waits
    def _is_to_be_given(self, row: Execution, group: Group | None) -> bool:
        reason = taken_back(row)
        if reason is None and (group is None or not group.members):
            reason = Reason(ReasonCode.ROBOT_REMOVED, {"robot": row.robot_group})
        if reason is None and group is not None and (refused := self._refused_by_all(row, group)):
            reason = refused
        return self._waiting.may_be_tried(row, reason) and not self._waits_for_the_one_before(row)

    def _refused_by_all(self, row: Execution, group: Group) -> Reason | None:
        """The last refusal, where every robot of the group has refused it for good."""
        tried = [row.tried.get(str(robot_id), {}) for robot_id in group.members]
        if not all(each.get("is_for_good") for each in tried):
            return None
        last = max(tried, key=lambda each: each.get("until", ""))
        code = ReasonCode(last["code"]) if "code" in last else ReasonCode.RETRY_LIMIT
        return Reason(code, {"attempts": row.attempts, "problem": last.get("problem", ""), "robot": last.get("robot", "")})

    def _waits_for_the_one_before(self, row: Execution) -> bool:
        """Of a schedule that queues: the earlier start, on whichever robot it is."""
        return row.schedule_id is not None and self._executions.has_earlier_open(self._s.db.read(), row.schedule_id, row.planned_at)

    # ------------------------------------------------------------------ decisions
    def _carry_out(self, decision: Decision, row: Execution, belief: _Belief) -> None:
        choice = belief.choice(decision, self._clock.now())
        if decision.too_late and row.finish_by is not None:
            self._ledger.end(row, Reason(ReasonCode.FINISH_BY, {"finish_by": row.finish_by.isoformat()}))
        elif decision.robot_id is None:
            self._ledger.waits(row, Wait.ROBOT, group=row.robot_group, **choice)
        else:
            robot = belief.robots[decision.robot_id]
            guid = belief.guid(robot.id, row.mission)
            if guid is not None:
                self._ledger.bind(self._ledger.bound(row, robot, guid, choice), decision.is_last_call or decision.start.at_once)


class _Belief:
    """What is known of the robots at this moment."""

    def __init__(self, shared: Shared, executions: ExecutionRepository, workers: Mapping[int, RobotWorker],
                 members: Collection[int]) -> None:
        self._s, self._executions, self._c, self._now = shared, executions, shared.db.read(), shared.clock.now()
        self._settings = shared.settings()
        self._guids: dict[tuple[int, str], Mission | None] = {}
        self._estimates: dict[tuple[int, str], DurationEstimate | None] = {}
        self._of_group: dict[tuple[str, tuple[int, ...]], DurationEstimate | None] = {}
        self._all = tuple(sorted(members))
        self.robots = {key: workers[key].robot for key in self._all if key in workers}
        self.members = {key: self._member(workers[key]) for key in self.robots}

    def situation(self, rows: Iterable[Execution], groups: Mapping[int, Group]) -> Situation:
        starts = [self._start(row, groups[row.group_id or 0]) for row in rows]
        return Situation(self.members, starts, self.takes, self._coming(groups))

    def _coming(self, groups: Mapping[int, Group]) -> list[Coming]:
        """The next start of each schedule, where these robots may get it."""
        missions = {mission.id: mission.name for mission in self._s.missions.all(self._c)}
        found = []
        for schedule in self._s.schedules.due(self._c, self._now + timedelta(seconds=AHEAD)):
            group = groups.get(schedule.group_id or 0)
            members = group.members if group is not None else () if schedule.robot_id is None else (schedule.robot_id,)
            if schedule.next_at is not None and schedule.next_at > self._now and not set(members).isdisjoint(self.robots):
                found.append(self._planned(schedule.next_at, missions[schedule.mission_id], members, schedule.priority))
        return found

    def _seconds(self, instant: datetime) -> float:
        return (instant - self._now).total_seconds()

    # ------------------------------------------------------------------ robots
    def _member(self, worker: RobotWorker) -> Member:
        robot, status = worker.robot, worker.seen.fresh_status
        is_charging = status is not None and activity_of(status) == "charging"        # which ends by itself when something comes
        open_ones = [row for row in self._executions.open_for(self._c, robot.id) if not (is_charging and row.trigger is Trigger.IDLE)]
        out = self._out(worker)
        has_more = any(item.is_pending for item in self._s.snapshots.get(robot.id).queue)         # between two it is ready for a moment
        is_free = out is None and status is not None and not open_ones and not has_more and (
            status.state is RobotState.READY or is_charging)
        return Member(robot.id, robot.name, is_free=is_free, free_s=0.0 if is_free else self._free_s(robot, open_ones),
                      battery=None if status is None else status.battery_percentage, hours=0.0, out=out)

    def _out(self, worker: RobotWorker) -> Out | None:
        robot, snapshot = worker.robot, self._s.snapshots.get(worker.robot.id)
        if not robot.enabled or robot.needs_password:
            return Out.OFF
        if self._s.holds.active(robot.id):
            return Out.HELD
        if snapshot.connection is Connection.WRONG_ROBOT:
            return Out.WRONG_ROBOT
        status = worker.seen.fresh_status
        if status is None:
            return Out.SILENT
        return None if status.state in (*WORKS, *AFTER_A_RUN) and not status.errors else Out.STOPPED

    def _free_s(self, robot: Robot, open_ones: Sequence[Execution]) -> float:
        """What is left of what runs, and all of what is pending, whoever put it there; and what of ours is not there yet."""
        queue = self._s.snapshots.get(robot.id).queue
        left = 0.0
        known = {row.queue_id for row in open_ones}
        for item in queue:
            estimate = self._estimate(robot.id, item.mission_id or "")
            if item.state is QueueState.EXECUTING:
                row = next((row for row in open_ones if row.queue_id == item.id), None)
                elapsed = self._seconds(row.started_at) * -1.0 if row and row.started_at else 0.0
                left += estimates.remaining(estimate, elapsed)
            else:
                left += estimates.takes(estimate, None)
        seen = {item.id for item in queue}
        return left + sum(estimates.takes(self._estimate(robot.id, row.mission_guid), None) for row in open_ones
                          if row.queue_id is None or (row.queue_id not in seen and known))

    # ------------------------------------------------------------------ starts
    def _start(self, row: Execution, group: Group) -> Start:
        is_barred = {int(key): Out.TRIED for key, each in row.tried.items()
                     if each.get("is_for_good") or to_instant(each["until"]) > self._now}
        return Start(row.id, row.mission, group.members, row.priority, self._seconds(row.planned_at), self._seconds(row.closes_at),
                     None if row.finish_by is None else self._seconds(row.finish_by), row.minimum_battery_percent, is_barred,
                     group.keep_free, group.hand_over is HandOver.AT_ONCE)

    def _planned(self, at: datetime, mission: str, members: Sequence[int], priority: int) -> Coming:
        lasts = [seconds for robot_id in members if (seconds := self.takes(robot_id, mission, slow=True)) is not None]
        return Coming(mission, tuple(members), self._seconds(at), max(lasts, default=estimates.UNKNOWN_S), priority)

    def mission(self, robot_id: int, name: str) -> Mission | None:
        key = robot_id, name
        if key not in self._guids:
            self._guids[key] = self._s.missions.for_robot(self._c, name, robot_id)
        return self._guids[key]

    def guid(self, robot_id: int, name: str) -> str | None:
        mission = self.mission(robot_id, name)
        return mission.guid if mission else None

    def takes(self, robot_id: int, mission: str, *, slow: bool = False) -> float | None:
        """Seconds; None: it lacks the mission."""
        meant = self.mission(robot_id, mission)
        if meant is None:
            return None
        key = mission, self._all
        if key not in self._of_group:
            own = [self._estimate(each, self.guid(each, mission) or "") for each in self._all]
            self._of_group[key] = pooled([each for each in own if each is not None])
        return estimates.takes(expected(self._estimate(robot_id, meant.guid), meant), self._of_group[key], slow=slow)

    def _estimate(self, robot_id: int, guid: str) -> DurationEstimate | None:
        key = robot_id, guid
        if key not in self._estimates:
            self._estimates[key] = self._executions.usual(self._c, robot_id, guid) if guid else None
        return self._estimates[key]

    # ------------------------------------------------------------------ why
    def choice(self, decision: Decision, now: datetime) -> dict[str, Any]:
        """Codes and numbers of its sentence: of five robots at most, the best first."""
        robots: list[dict[str, Any]] = []
        best_first = sorted(decision.options, key=lambda option: option.robot_id != decision.robot_id)       # the chosen one before all
        for option in best_first[:MOST_TOLD]:
            member = self.members[option.robot_id]
            until = (now + timedelta(seconds=member.free_s + 30.0)).replace(second=0, microsecond=0)     # to the minute
            robots.append({"robot": member.name} | ({} if member.is_free else {"until": until.isoformat()}))
        for robot_id, out in decision.out[:MOST_TOLD - len(robots)]:
            member = self.members[robot_id]
            robots.append({"robot": member.name, "out": str(out)} | (
                {"battery": member.battery} if out in (Out.LOW_BATTERY, Out.TOO_LITTLE_BATTERY) else {}))
        more = len(decision.options) + len(decision.out) - len(robots)
        kept = decision.kept_for
        return {"robots": robots, **({"more": more} if more else {}), **({"kept_for": kept.mission} if kept else {}),
                **({"last_call": True} if decision.is_last_call else {})}

