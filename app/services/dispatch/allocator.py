"""Gives each start of a group to one of its robots as soon as one is free, and never to two.

A start of a group is a row without a robot. There is one allocator, on the engine's thread: it takes what the workers
have read (``group_state``), has ``app.services.allocation`` choose, and assigns the robot: one write, made only if the
row still has no robot and nothing has changed. From then on the row belongs to that robot's worker; only the worker
gives it back, when certainly nothing of it is on the robot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from app.database.group_executions import GroupExecutionRepository
from app.database.groups import GroupRepository
from app.domain import rules
from app.domain.execution import Execution, Reason, ReasonCode, Wait
from app.domain.models import Group, Robot
from app.services.allocation.choose import LAST_CALL, Decision, choose
from app.services.dispatch import messages
from app.services.dispatch.context import Context
from app.services.dispatch.group_state import GroupState, UsualDurations
from app.services.dispatch.timing import DECIDES_EVERY, LOOKS_FOR
from app.services.dispatch.waiting import Waiting
from app.services.dispatch.worker import RobotWorker
from app.services.executions import transitions
from app.services.executions.transitions import Event, Transition, why_withdrawn
from app.services.live.changes import NO_ROBOT

ASSIGNED_TOGETHER = 50  # with one write: more would delay other writes


class Allocator:
    """``lacks``: whether a robot is known not to have a mission, by their id and guid."""

    def __init__(self, context: Context, lacks: Callable[[int, str], bool]) -> None:
        self._s, self._ledger, self._clock, self._lacks = context, context.ledger, context.clock, lacks
        self._starts, self._groups = GroupExecutionRepository(), GroupRepository()
        self._waiting = Waiting(context, self._later)
        self._usual_durations = UsualDurations(context)
        self._look_at = math.inf  # on the monotonic clock: a waiting one can continue then
        self._met_at: dict[int, float] = {}  # starts by id: when they were first seen, on the same clock
        self.members: frozenset[int] = frozenset()  # robots that something waits for
        self.post: Callable[[int, messages.Start], None] = lambda robot_id, start: None  # to its worker

    def _later(self, row: Execution, seconds: float) -> None:
        self._look_at = min(self._look_at, self._clock.monotonic() + seconds)

    def advance(self, workers: Mapping[int, RobotWorker], only: int | None = None) -> float:
        """Decide about all waiting starts, or this one. Returns the seconds until the next decision; infinite: nothing
        waits."""
        rows = [row for row in self._ledger.unbound() if only in (None, row.id)]
        if not rows:
            self.members = frozenset()
            return math.inf
        self._look_at = math.inf
        self._waiting.forget_all_but({row.id for row in rows})
        self._met_at = {row.id: self._met_at.get(row.id, self._clock.monotonic()) for row in rows}
        groups = {group.id: group for group in self._groups.all(self._s.db.read())}
        robots = {key: worker.robot for key, worker in workers.items()}
        to_give = [row for row in rows if self._is_to_be_given(row, groups.get(row.group_id or 0), robots)]
        self.members = frozenset(robot_id for row in to_give for robot_id in groups[row.group_id or 0].members)
        to_give = [row for row in to_give if not self._await_fresh_status(row, groups[row.group_id or 0], workers)]
        while to_give:
            assigned, moved = self._decide(to_give, groups, workers)
            to_give = [
                row for row in to_give if moved and row.id not in assigned | moved
            ]  # what they were to get is for the others
        now = self._clock.now()
        last_calls = [(row.closes_at - now).total_seconds() - LAST_CALL for row in rows]
        return max(
            0.0,
            min([DECIDES_EVERY, self._look_at - self._clock.monotonic(), *(left for left in last_calls if left > 0)]),
        )

    def wait_for_the_clock(self) -> None:
        """Nothing is decided until it can be right."""
        waiting = [row for row in self._ledger.unbound() if not row.held]
        self._ledger.apply([each for row in waiting for each in transitions.wait(row, Wait.CLOCK)])

    # ------------------------------------------------------------------ what waits
    def _is_to_be_given(self, row: Execution, group: Group | None, robots: Mapping[int, Robot]) -> bool:
        reason = why_withdrawn(row)
        if reason is None and self._has_no_robot(row, group, robots):  # as far as their workers know
            reason = self._has_no_robot(
                row, group, {robot.id: robot for robot in self._s.robots.all(self._s.db.read())}
            )
        return self._waiting.may_be_tried(row, reason) and not self._waits_for_the_one_before(row)

    def _await_fresh_status(self, row: Execution, group: Group, workers: Mapping[int, RobotWorker]) -> bool:
        """Whether to wait for a fresh status of answering robots of its group before one is chosen: they have just been
        asked."""
        left = self._met_at[row.id] + LOOKS_FOR - self._clock.monotonic()
        if left <= 0 or not any(workers[key].seen.is_awaiting_answer for key in group.members if key in workers):
            return False
        self._later(row, left)
        return True

    def _has_no_robot(self, row: Execution, group: Group | None, robots: Mapping[int, Robot]) -> Reason | None:
        """Why none of these can ever get it; None: at least one can."""
        members = [robots[key] for key in group.members if key in robots] if group is not None else []
        others = [robot for robot in members if not rules.is_excluded(row.tried, robot.id)]
        if not any(robot.enabled for robot in others):
            which = "removed" if group is None else "group" if others == members else "others"
            return Reason(ReasonCode.ROBOT_REMOVED, {which: row.robot_group})
        return self._refused_by_all(row, others)

    def _refused_by_all(self, row: Execution, members: Sequence[Robot]) -> Reason | None:
        """The last refusal, if every switched-on robot of the group has finally refused it."""
        tried = [row.tried.get(str(robot.id), {}) for robot in members if robot.enabled]
        if not all(each.get("is_for_good") for each in tried):
            return None
        last = max(tried, key=lambda each: each.get("at", ""))
        code = ReasonCode(last["code"]) if "code" in last else ReasonCode.RETRY_LIMIT
        return Reason(
            code,
            {
                "attempts": row.attempts,
                "problem": last.get("problem", ""),
                "robot": last.get("robot", ""),
                "mission": row.mission,
            },
        )

    def _waits_for_the_one_before(self, row: Execution) -> bool:
        """Whether an earlier start of a schedule that queues is still open, on any robot."""
        before = self._starts.earlier_open(self._s.db.read(), row)
        if before:
            self._ledger.waits(row, Wait.ROBOT, group=row.robot_group, before=before.isoformat())
        return bool(before)

    # ------------------------------------------------------------------ decisions
    def _decide(
        self, rows: Sequence[Execution], groups: Mapping[int, Group], workers: Mapping[int, RobotWorker]
    ) -> tuple[set[int], set[int]]:
        """Returns the ids of the assigned ones, and of those not assigned because they or the robot had changed."""
        state, by_id = (
            GroupState(self._s, self._usual_durations, workers, self.members, self._lacks),
            {row.id: row for row in rows},
        )
        waits, assigned, plan_version = list[Transition](), list[Transition](), self._s.plan_version()
        for decision in choose(state.situation(rows, groups)):
            row = by_id[decision.start.id]
            if decision.too_late and row.finish_by is not None:
                self._ledger.end(
                    Event.EXPIRE, row, Reason(ReasonCode.FINISH_BY, {"finish_by": row.finish_by.isoformat()})
                )
            elif decision.robot_id is None:
                waits += self._waiting_for_robot(row, decision, state)
            elif mission := state.mission(decision.robot_id, row.mission):
                assigned.append(
                    transitions.assign(
                        row,
                        state.robots[decision.robot_id],
                        mission.guid,
                        state.choice(decision),
                        self._clock.now(),
                        intent_floor=self._intent_floor(row, workers[decision.robot_id], mission.guid),
                        into_queue=decision.is_last_call or decision.start.at_once,
                    )
                )
        self._ledger.apply(waits, quietly=True)
        taken: set[int] = set()
        for start in range(0, len(assigned), ASSIGNED_TOGETHER):
            some = assigned[start : start + ASSIGNED_TOGETHER]
            made = self._ledger.apply(
                some, hand_over=lambda row: self.post(row.robot_id or NO_ROBOT, messages.Start(row, plan_version))
            )
            taken |= {row.id for row in made}
        return taken, {each.row.id for each in assigned} - taken

    def _intent_floor(self, row: Execution, worker: RobotWorker, guid: str) -> int | None:
        """The highest known id, if it was never sent there and the robot is ready: then its intent is written with the
        choice."""
        ready = worker.readiness()
        if (
            ready is None
            or str(worker.robot.id) in row.tried
            or not rules.battery_allows(ready.battery, row.minimum_battery_percent)
        ):
            return None
        if (
            self._s.parameters.to_send(worker.robot.id, guid, row.mission, row.parameters) is None
        ):  # the robot is asked first
            return None
        may_be_there = ready.uncertain_through is not None and row.planned_at <= ready.uncertain_through
        return None if may_be_there else ready.queue_floor

    def _waiting_for_robot(self, row: Execution, decision: Decision, state: GroupState) -> list[Transition]:
        """What it waits for, if that has changed."""
        if decision.full_place is not None and (full := self._ledger.full_place(row)) is not None:
            return transitions.wait(row, Wait.PLACE, **state.describe_occupant(full))
        return transitions.wait(row, Wait.ROBOT, group=row.robot_group, **state.choice(decision))
