"""What a start that waits waits for, or why it ends: asked before anything is sent, by workers and by the allocator."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from datetime import datetime
from types import MappingProxyType
from typing import Any, NamedTuple

from app.domain import rules
from app.domain.activity import is_free
from app.domain.execution import Execution, Reason, State, Trigger, Wait
from app.domain.message import message
from app.domain.models import HandOver
from app.domain.robot import RobotStatus
from app.services.allocation.choose import LAST_CALL
from app.services.dispatch.context import Context
from app.services.dispatch.observation import Observation
from app.services.dispatch.restored_starts import Found
from app.services.dispatch.timing import EARLY_RECHECK, INTENT_LEAD, RECHECK
from app.services.executions import transitions
from app.services.executions.transitions import Event
from app.services.live.tablet import old_token


class WaitsFor(NamedTuple):
    """What a start waits for; ``wait`` is None where its row does not say it. It is looked at again after ``again_s`` seconds."""

    wait: Wait | None = None
    details: Mapping[str, Any] = MappingProxyType({})
    again_s: float = RECHECK


class Waiting:
    """``later`` is called with a row and the seconds after which it is to be looked at again. ``robot_id``: whose worker asks; None: for
    what has no robot yet."""

    def __init__(
        self, context: Context, later: Callable[[Execution, float], None], robot_id: int | None = None
    ) -> None:
        self._s, self._ledger, self._clock = context, context.ledger, context.clock
        self._later, self._robot_id = later, robot_id
        # Late starts that are listed first, on the monotonic clock.
        self._listed_until: dict[tuple[int, datetime], float] = {}

    def forget_all_but(self, ids: Collection[int]) -> None:
        self._listed_until = {key: until for key, until in self._listed_until.items() if key[0] in ids}

    def may_be_tried(self, row: Execution, why_not: Reason | None, *, needs_room: bool = False) -> bool:
        """Whether it may be tried now; otherwise it is ended here, or keeps waiting. ``why_not``: why it must not be
        sent. ``needs_room``: the places that it uses have not been looked at yet."""
        now = self._clock.now()
        if why_not:
            self._ledger.apply([transitions.withdraw(row, why_not)])
        elif now >= row.closes_at:
            app_was_down = self._s.downtime.overlaps(row.planned_at, row.closes_at)
            self._ledger.end(Event.EXPIRE, row, rules.reason_window_closed(row, app_was_down))
        elif waits := self.why_held(row) or self.why_early(row):
            self.put_off(row, waits)
        elif (found := self._found(row)).robot and found.item:
            self._ledger.apply([transitions.adopt(row, found.robot, found.item, now)])
        elif (
            waits := _why_uncertain(row, found) or self._why_listed(row) or (self.why_full(row) if needs_room else None)
        ):
            self.put_off(row, waits)
        else:
            return True
        return False

    def put_off(self, row: Execution, waits: WaitsFor) -> None:
        if waits.wait:
            self._ledger.waits(row, waits.wait, **waits.details)
        self._later(row, waits.again_s)

    # ------------------------------------------------------------------ what it waits for
    def why_held(self, row: Execution) -> WaitsFor | None:
        """A person holds it, or is clearing its queue, or the clock can't be right."""
        if self._s.clearing.blocks(row):
            return WaitsFor()
        if row.held:
            return WaitsFor(Wait.HOLD)
        if hold := self._s.holds.active(self._robot_id):
            return WaitsFor(Wait.CLOCK if hold.clock else Wait.HOLD, {"hold": hold.reason})
        return None

    def why_full(self, row: Execution) -> WaitsFor | None:
        """There is no room at a place that it uses."""
        full = self._ledger.full_place(row)
        return full and WaitsFor(Wait.PLACE, {"place": full.name, "robot": full.robot})

    def why_robot(self, row: Execution, seen: Observation, status: RobotStatus) -> WaitsFor | None:
        """Its robot shows that the clock may be wrong (soon everything is held, where the whole app runs), or its battery
        is too low; or its fleet can't be told from others, or was not checked up, unless a person starts it now."""
        if seen.contradicts_clock:
            return WaitsFor(Wait.CLOCK)
        fleet = seen.robot.fleet
        if fleet is not None and not seen.robot.is_identified and fleet.username:
            problem = message(
                "the app has no user of its own at the fleet {fleet}, so another could get it", fleet=fleet.name
            )
            return WaitsFor(Wait.CHECK_UP, {"fleet": fleet.name, "user": fleet.username, "problem": problem})
        is_by_person = row.trigger is Trigger.MANUAL and seen.robot.is_identified
        if fleet is not None and seen.robot.needs_check_up and not is_by_person:
            problem = message("the fleet {fleet} was not checked up", fleet=fleet.name)
            return WaitsFor(Wait.CHECK_UP, {"fleet": fleet.name, "problem": problem})
        battery, minimum = seen.robot.battery(status), row.minimum_battery_percent
        is_charged = rules.battery_allows(battery, minimum)
        return None if is_charged else WaitsFor(Wait.BATTERY, {"battery": battery, "minimum": minimum})

    def why_in_line(
        self, row: Execution, seen: Observation, status: RobotStatus, before: Sequence[Execution]
    ) -> WaitsFor | None:
        """Its robot gets one start at a time, when it is free, so that the order is ours as long as can be. ``before``: what goes before it
        now. At the last call it goes into the robot's queue."""
        robot, left = seen.robot, (row.closes_at - self._clock.now()).total_seconds() - LAST_CALL
        if robot.hand_over is HandOver.AT_ONCE or row.group_id is not None or row.trigger is Trigger.IDLE or left <= 0:
            return None
        rows = self._ledger.open_for(robot.id)
        under_way = [each for each in rows if each.state is not State.WAITING or each.group_id is not None]
        is_next = not before and is_free(status, self._s.snapshots.get(robot.id).queue, under_way)
        return None if is_next else WaitsFor(Wait.ROBOT, {"robot": row.robot})

    def why_early(self, row: Execution) -> WaitsFor | None:
        """Its instant is in the future: a closed worker released it, or the clock was set back. Run nows and idle
        missions wait for no instant; an intent may be written before it."""
        early = (row.planned_at - self._clock.now()).total_seconds() if row.trigger is Trigger.SCHEDULED else 0.0
        return WaitsFor(again_s=min(early, EARLY_RECHECK)) if early > INTENT_LEAD else None

    def _why_listed(self, row: Execution) -> WaitsFor | None:
        """A late start after the app was off is listed for some seconds, on the monotonic clock from when it is first
        seen. One that may have run is listed once it is known that it has not."""
        if rules.is_listed_later(row):
            self._ledger.apply([transitions.list_late(row, self._clock.now())])
            return WaitsFor()
        if row.listed_until is None or row.wait is not Wait.LATE_START:
            return None
        mono, left = self._clock.monotonic(), (row.listed_until - self._clock.now()).total_seconds()
        until = self._listed_until.setdefault(
            (row.id, row.listed_until), mono + min(max(left, 0.0), rules.LATE_START_HOLD.total_seconds())
        )
        return WaitsFor(again_s=until - mono) if until > mono else None

    def _found(self, row: Execution) -> Found:
        """Where it is, or may be, though a restored backup does not know that. A schedule may have been on another robot then; a tablet
        from which the plan moved here had tokens of its own."""
        through = self._s.restored_starts.uncertain_until
        if through is None or row.planned_at > through:
            return Found()
        tokens = (row.token, old_token(self._s.tablet.move, row))
        robot_id = None if row.trigger is Trigger.SCHEDULED else self._robot_id
        return self._s.restored_starts.find(tokens, robot_id, row.planned_at)


def _why_uncertain(row: Execution, found: Found) -> WaitsFor | None:
    """It may be on a robot that has not answered yet."""
    silent = {"robots": ", ".join(found.silent)} if found.silent else {}
    later = rules.LISTED_LATER if row.wait is Wait.LATE_START else {}
    return None if found.is_certain else WaitsFor(Wait.ELSEWHERE, {**silent, **later})
