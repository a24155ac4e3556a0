"""What a start that waits waits for, or why it ends: asked before anything is sent, by workers and by the allocator."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from datetime import datetime

from app.domain import rules
from app.domain.models import Execution, HandOver, Reason, Robot, State, Trigger, Wait
from app.domain.robot import RobotStatus
from app.services.allocation.choose import LAST_CALL
from app.services.dispatch.availability import is_free
from app.services.dispatch.context import Context
from app.services.dispatch.timing import EARLY_RECHECK, INTENT_LEAD, RECHECK
from app.services.executions import transitions
from app.services.executions.transitions import Event
from app.services.live.tablet import old_token


class Waiting:
    """``robot_id``: whose worker asks; None: for what has no robot yet. ``later`` is called with a row and the seconds after which it is to
    be looked at again."""

    def __init__(self, context: Context, robot_id: int | None, later: Callable[[Execution, float], None]) -> None:
        self._s, self._ledger, self._clock = context, context.ledger, context.clock
        self._robot_id, self._later = robot_id, later
        # Late starts that are listed first, on the monotonic clock.
        self._listed_until: dict[tuple[int, datetime], float] = {}

    def forget_all_but(self, ids: Collection[int]) -> None:
        self._listed_until = {key: until for key, until in self._listed_until.items() if key[0] in ids}

    def may_be_tried(self, row: Execution, why_not: Reason | None) -> bool:
        """Whether it may be tried now; else it is ended here, or left waiting. ``why_not``: why it must not be sent."""
        now = self._clock.now()
        if why_not:
            self._ledger.apply([transitions.withdraw(row, why_not)])
        elif now >= row.closes_at:
            app_was_down = self._s.downtime.overlaps(row.planned_at, row.closes_at)
            self._ledger.end(Event.EXPIRE, row, rules.reason_window_closed(row, app_was_down))
        elif self._s.clearing.blocks(row):
            self._later(row, RECHECK)
        elif row.held:
            self._waits(row, Wait.HOLD)
        elif hold := self._s.holds.active(self._robot_id):
            self._waits(row, Wait.CLOCK if hold.clock else Wait.HOLD, hold=hold.reason)
        elif (early := self._seconds_early(row)) > (INTENT_LEAD if row.group_id else 0):  # its intent may be ahead
            self._later(row, min(early, EARLY_RECHECK))
        else:
            return not self._may_have_run(row) and not self._is_listed_first(row)
        return False

    def has_room(self, row: Execution) -> bool:
        """Whether there is room at every place that it uses; else it waits for that."""
        if (full := self._ledger.full_place(row)) is None:
            return True
        self._waits(row, Wait.PLACE, place=full.name, robot=full.robot)
        return False

    def is_in_line(self, row: Execution, robot: Robot, status: RobotStatus, before: Sequence[Execution]) -> bool:
        """Of a robot that gets one start at a time, when it is free, so that the order is ours as long as can be: whether it waits so.
        ``before``: what goes before it now. At the last call it goes into the robot's queue."""
        left = (row.closes_at - self._clock.now()).total_seconds() - LAST_CALL
        if robot.hand_over is HandOver.AT_ONCE or row.group_id is not None or row.trigger is Trigger.IDLE or left <= 0:
            return False
        under_way = [
            each
            for each in self._ledger.open_for(robot.id)
            if each.state is not State.WAITING or each.group_id is not None
        ]
        if not before and is_free(status, self._s.snapshots.get(robot.id).queue, under_way):
            return False
        self._waits(row, Wait.ROBOT, robot=row.robot)
        return True

    def _waits(self, row: Execution, wait: Wait, **details: object) -> None:
        self._ledger.waits(row, wait, **details)
        self._later(row, RECHECK)

    def _seconds_early(self, row: Execution) -> float:
        """Until its instant, which may be still to come: a worker that was closed released it, or the clock was set back. What a person
        started, or idleness, waits for no instant."""
        return (row.planned_at - self._clock.now()).total_seconds() if row.trigger is Trigger.SCHEDULED else 0.0

    def _is_listed_first(self, row: Execution) -> bool:
        """A late start after the app was off is listed for some seconds, on the monotonic clock from when it is first seen."""
        if row.listed_until is None or row.wait is not Wait.LATE_START:
            return False
        mono, left = self._clock.monotonic(), (row.listed_until - self._clock.now()).total_seconds()
        until = self._listed_until.setdefault(
            (row.id, row.listed_until), mono + min(max(left, 0.0), rules.LATE_START_HOLD.total_seconds())
        )
        if until > mono:
            self._later(row, until - mono)
        return until > mono

    def _may_have_run(self, row: Execution) -> bool:
        """Whether it is or may be on a robot though a restored backup does not know: then the row adopts that item, or
        waits. A late start that may have run is listed once it is known that it has not."""
        through = self._s.restored_starts.uncertain_until
        if through is not None and row.planned_at <= through and self._is_elsewhere(row):
            return True
        if rules.is_listed_later(row):
            self._ledger.apply([transitions.list_late(row, self._clock.now())])
            self._later(row, RECHECK)
            return True
        return False

    def _is_elsewhere(self, row: Execution) -> bool:
        """A schedule may have been on another robot then. A tablet from which the plan moved here had tokens of its own."""
        tokens = (row.token, old_token(self._s.tablet.move, row))
        found = self._s.restored_starts.find(tokens, None if row.trigger is Trigger.SCHEDULED else self._robot_id)
        if found.robot and found.item:
            self._ledger.apply([transitions.adopt(row, found.robot, found.item, self._clock.now())])
        elif not found.is_certain:
            silent = {"robots": ", ".join(found.silent)} if found.silent else {}
            self._waits(row, Wait.ELSEWHERE, **silent, **(rules.LISTED_LATER if row.wait is Wait.LATE_START else {}))
        return found.robot is not None or not found.is_certain
