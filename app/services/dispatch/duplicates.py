"""Items that the app put on a robot's queue: what to do with second or late ones."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timedelta

from app.domain.capabilities import FindBy
from app.domain.clock import EARLIEST
from app.domain.execution import Execution, Reason, ReasonCode, State, Trigger
from app.domain.message import Message
from app.domain.robot import QueueItem, QueueState
from app.mir.errors import Ambiguous, Rejected, RobotError, RobotFault, Unreadable
from app.mir.target import Target
from app.services.dispatch.context import Context
from app.services.dispatch.observation import Observation
from app.services.dispatch.own_items import OwnItems
from app.services.dispatch.timing import UNSEARCHED_AT_MOST
from app.services.executions import transitions
from app.services.executions.apply import WATCHED_FOR
from app.services.executions.transitions import NOT_WITH_THE_ROBOT, Event, Transition, was_given_up
from app.services.live.tablet import old_token

log = logging.getLogger(__name__)

DOUBLED_WITHIN = timedelta(minutes=1)  # of a start, and a poll more: possible delay of a request in the network
LOOKS_BACK = timedelta(hours=1)  # for starts that another tablet may have made too
# No person cancelled it.
MAY_STILL_RUN = (
    ReasonCode.UNKNOWN_OUTCOME,
    ReasonCode.WINDOW_CLOSED,
    ReasonCode.RETRY_LIMIT,
    ReasonCode.NO_ROBOT,
    ReasonCode.REFUSED,
)


class Duplicates:
    """Of one robot. Raises RobotError where it can't be asked."""

    def __init__(self, client: Target, context: Context, observation: Observation) -> None:
        self._client, self._s, self._ledger, self._seen = client, context, context.ledger, observation
        self.own = OwnItems(client, context, observation)
        self._watched: dict[str, tuple[int, float]] = {}  # by token: queue floor, and until when on the monotonic clock
        self._searched_until = EARLIEST  # starts sent to a fleet later may have copies that were not searched for
        self._search_fails_since = math.inf  # on the monotonic clock
        self._read: dict[int, QueueItem | None] = {}  # by a fleet's search, which the next call continues

    def give_up(self, row: Execution, problem: Message, *, may_come: bool = True) -> Transition:
        """Its outcome can't be found out. ``may_come``: it is watched for."""
        self._seen.raise_about(row, "unknown_outcome", problem=problem)
        if may_come:
            self.watch_for(row)
        reason = Reason(ReasonCode.UNKNOWN_OUTCOME, {"problem": problem})
        return transitions.end(Event.GIVE_UP, row, reason, may_come=may_come)

    def watch_for(self, row: Execution) -> None:
        """Its request was given up and may still arrive: the robot's queue is searched for it for a while."""
        self._watched[row.token] = (row.queue_floor or 0, self._s.clock.monotonic() + WATCHED_FOR)

    def watch_from(self, row: Execution, floor: int) -> None:
        """An extra item that could not be cancelled is handled again, even if it has begun by then. Open searches
        continue."""
        _floor, until = self._watched.get(row.token, (0, -math.inf))
        if until > self._s.clock.monotonic():
            return
        highest = self._seen.highest
        self._watched[row.token] = (
            floor if highest is None else min(floor, highest),
            self._s.clock.monotonic() + WATCHED_FOR,
        )
        self._ledger.watch(row, self._seen.robot.id)

    def watch_again(self) -> None:
        """Starts that an earlier run of the app gave up; if their time is over, search again, as they may have arrived
        unseen."""
        now, mono = self._s.clock.now(), self._s.clock.monotonic()
        for watch in self._ledger.watches_of(self._seen.robot.id):
            left = (watch.until - now).total_seconds()
            self._watched[watch.token] = (watch.queue_floor, mono + min(max(0.0, left), WATCHED_FOR))

    @property
    def is_watching(self) -> bool:
        return any(until > self._s.clock.monotonic() for _floor, until in self._watched.values())

    def remove_duplicates(self, open_items: Sequence[QueueItem]) -> None:
        """Handle items that the robot has more than once, or whose row has ended."""
        if self._s.holds.is_copy is not None:
            return  # these rows are another tablet's
        items = {item.id: item for item in open_items if item.has_token}
        self._find_other_tablet(items.values())
        mono = self._s.clock.monotonic()
        floors = self._floors()
        newer, unread = self._search(mono, floors)
        before = set(self._watched)
        items |= {item.id: item for item in newer if item.description in floors}
        unsettled = self._report_unmarked_items(newer, open_items) | unread
        for item in sorted(items.values(), key=lambda item: item.id):
            row = self._ledger.by_token(item.description)
            if row is None or (row.robot_id != self._seen.robot.id and row.group_id is None):
                continue
            if self._is_other_vehicles(row, item):
                continue
            is_here = row.robot_id == self._seen.robot.id
            if is_here and row.queue_id == item.id and not was_given_up(row):
                continue
            # Still looked for, and may end without having found it; or it can't be read yet.
            if (is_here and row.state in NOT_WITH_THE_ROBOT) or (shown := self._in_full(row, item)) is None:
                unsettled.add(row.token)
            elif not (self._reconcile_item if is_here else self._item_elsewhere)(row, shown):
                unsettled.add(row.token)  # met again before it begins
                self.watch_from(row, item.id - 1)
        searched = max((item.id for item in newer), default=0)  # what is older has been seen
        self._seen.saw_id(searched)  # or the next search would begin at the first item
        self._watched = {
            token: (floor if token in unsettled or not newer else searched, until)
            for token, (floor, until) in self._watched.items()
            if until > mono or (token in unsettled and until > mono - UNSEARCHED_AT_MOST)
        }  # again after its time
        if over := before - self._watched.keys():
            self._ledger.drop_watches(self._seen.robot.id, over)

    def _is_other_vehicles(self, row: Execution, item: QueueItem) -> bool:
        """Whether another robot of the same fleet has it, or the fleet chooses among all: that one's worker looks after
        it."""
        robot = self._seen.robot
        if robot.fleet is None:
            return False
        if not self.own.is_of_robot(item):
            return True
        holder = None if row.robot_id is None else self._s.robots.get(self._s.db.read(), row.robot_id)
        if holder is None or holder.id == robot.id or holder.fleet is None or holder.fleet.id != robot.fleet.id:
            return False
        return holder.is_any or row.queue_id == item.id

    def _in_full(self, row: Execution, item: QueueItem) -> QueueItem | None:
        """Reads by number what the list may not show. None: it can't be read, and may be the row's own."""
        if item.state_text and item.id != row.queue_id:
            return item
        try:
            return self._client.queue_item(item.id, row.token)
        except (Rejected, RobotFault, Unreadable):
            is_extra = item.id != row.queue_id and (row.queue_id is not None or transitions.why_withdrawn(row))
            return item if is_extra else None  # an extra one must not run, whatever its state

    def _floors(self) -> dict[str, int]:
        """By token, of all watched starts; and of those that were sent lately to a fleet, which may run a copy at once and end
        it between two polls."""
        floors, can = {token: floor for token, (floor, _until) in self._watched.items()}, self._client.capabilities
        if not can.own_queue and can.find_by is FindBy.TOKEN:
            floors |= {row.token: row.queue_floor or 0 for row in self._sent_since(self._searched_until)}
        return floors

    def _search(self, mono: float, floors: Mapping[str, int]) -> tuple[list[QueueItem], set[str]]:
        """Items above these floors, also after a long absence of the robot, and the tokens of those that can't be read. A
        queue that can't be searched would make its robot unreadable for ever: after an hour, searches past their time
        are given up. Raises RobotError."""
        now = self._s.clock.now()
        try:
            found = self._newer(floors)
        except RobotError as error:
            if not isinstance(error, Unreadable):  # it may come back with other orders
                self._read = {}
            self._search_fails_since = min(self._search_fails_since, mono)
            if mono - self._search_fails_since >= UNSEARCHED_AT_MOST:
                over = {token for token, (_floor, until) in self._watched.items() if until <= mono}
                self._ledger.drop_watches(self._seen.robot.id, over)
                self._watched = {token: value for token, value in self._watched.items() if token not in over}
            raise
        self._search_fails_since, self._searched_until, self._read = math.inf, now - DOUBLED_WITHIN, {}
        return found

    def _newer(self, floors: Mapping[str, int]) -> tuple[list[QueueItem], set[str]]:
        """Where each is asked for by its token, one that can't be read hides no other."""
        newer, unread = list[QueueItem](), set[str]()
        can = self._client.capabilities
        are_asked_singly, read = can.find_by is FindBy.ID, {} if can.own_queue else self._read
        together = [[*floors]] if floors else []
        for tokens in [[token] for token in floors] if are_asked_singly else together:
            try:
                newer += self._client.items_after(self._lowest(floors), read, tokens=tokens)
            except Ambiguous:  # those that may still run are among the open ones
                continue
            except (RobotFault, Unreadable):
                if not are_asked_singly:
                    raise
                unread.update(tokens)
        return newer, unread

    def _report_unmarked_items(self, newer: Sequence[QueueItem], open_items: Sequence[QueueItem]) -> set[str]:
        """A robot that returns no tokens may have a second item of a watched or recent start, or one that a person put
        there: a person decides. Returns the tokens of those that can't be judged yet."""
        self.own.note_accepted()  # while the robot was read others may have been sent
        watched = [
            (row, floor)
            for token, (floor, _until) in self._watched.items()
            if (row := self._ledger.by_token(token)) is not None
        ]
        found = [
            (row, item)
            for item in filter(self._is_unmarked, newer)
            for row, floor in reversed(watched)  # most likely the last's
            if item.id > floor and self.own.may_be_of(row, item)
        ]
        if found and self.own.do_tokens_come_back() is not False:
            found = []
        unmarked = list(filter(self._is_unmarked, open_items)) if self.own.forgets_tokens else []
        since = self._s.clock.now() - DOUBLED_WITHIN - self._s.settings().poll_interval
        lately = self._sent_since(since) if unmarked else []
        found += [
            (row, item)
            for item in unmarked
            for row in lately
            if item.id > (row.queue_floor or 0) and self.own.may_be_of(row, item)
        ]
        rows = self._ledger.open_for(self._seen.robot.id, NOT_WITH_THE_ROBOT) if found else []
        looked_for = {row.mission_guid for row in rows if row.attempts}  # it is taken for that one
        for row, item in found:
            if row.mission_guid not in looked_for:
                self.own.alarm_once("unmarked_copy", row, item)
        return {row.token for row, _item in found if row.mission_guid in looked_for and row.token in self._watched}

    def _is_unmarked(self, item: QueueItem) -> bool:
        return bool(item.created_by_name) and not item.has_token and ("unmarked_copy", item.id) not in self.own.alarmed

    def _sent_since(self, since: datetime) -> list[Execution]:
        now = self._s.clock.now()
        rows = self._ledger.planned_between(self._seen.robot.id, now - LOOKS_BACK, now)
        return [row for row in rows if row.queue_id is not None and row.submitted_at and row.submitted_at >= since]

    def _lowest(self, floors: Mapping[str, int]) -> int:
        """Items to search for have a higher number, unless the robot's numbers have begun again since."""
        floor, highest = min(floors.values()), self._seen.highest
        return 0 if highest is not None and highest < floor else floor

    def _find_other_tablet(self, open_items: Iterable[QueueItem]) -> None:
        """The plan moved here, and the robot has an item of the old tablet's from since then: both tablets are on. Each
        item is reported once; a released hold is not set again for it."""
        move = self._s.tablet.move
        if move is None or self._s.holds.active(self._seen.robot.id) is not None:
            return
        now = self._s.clock.now()
        rows = self._ledger.planned_between(self._seen.robot.id, max(move.at, now - LOOKS_BACK), now)
        theirs = {token for row in rows if (token := old_token(move, row))}
        floors = [row.queue_floor for row in rows if row.queue_floor is not None]
        newer = (
            self._client.items_after(min(floors), tokens=theirs) if floors else open_items
        )  # what is over already too
        found = {("two_tablets", item.id) for item in newer if item.description in theirs}
        if found - self.own.alarmed:
            self.own.alarmed |= found
            self._s.holds.hold("two tablets start missions of this plan")
            self._s.alarms.raise_("two_tablets", "tablet", robot=self._seen.robot.name)
        else:
            self._s.alarms.clear("two_tablets", "tablet")

    def _reconcile_item(self, row: Execution, item: QueueItem) -> bool:
        """Returns whether that is done; else it is tried again."""
        if row.queue_id is None:
            return self._late_item(row, item)
        if item.id == row.queue_id:  # it could not be read, and is followed again
            return self._reopen(row, item)
        if item.id < row.queue_id and row.state.is_open:  # the earlier one is ours
            later = row.queue_id
            return not self._reopen(row, item) or self.cancel_copy(self._client.queue_item(later, row.token), row)
        if row.cancel_code and item.may_be_open:  # cancelled, however often it comes
            return self._cancel_late(row, item)
        return self.cancel_copy(item, row)

    def _item_elsewhere(self, row: Execution, item: QueueItem) -> bool:
        """A group's start that this robot gave back, and another one may have: the first item found counts, if nothing
        has been sent to the other. Returns whether that is done."""
        if row.cancel_code and item.may_be_open:  # cancelled, on any robot
            return self._cancel_late(row, item)
        if row.state is State.WAITING:  # a copy that was cancelled here is no evidence
            return item.state is QueueState.ABORTED or bool(
                self._ledger.apply([transitions.adopt(row, self._seen.robot, item, self._s.clock.now())])
            )
        may_be_theirs = not self._client.capabilities.own_queue and not item.vehicle
        if row.state is State.SUBMITTING and (may_be_theirs or not item.is_pending):
            return False  # it is searched for there, and may not be found
        if row.state.is_open or row.queue_id is not None:
            return self.cancel_copy(item, row)
        return self._late_item(row, item)

    def _late_item(self, row: Execution, item: QueueItem) -> bool:
        """The only item of a row that ended without one: a late or withdrawn one is cancelled unless it is done;
        otherwise the row is corrected."""
        is_wanted = row.reason is not None and row.reason.code in MAY_STILL_RUN
        is_too_late = item.is_pending and self._s.clock.now() >= row.closes_at
        may_run = item.state.is_open or item.state is QueueState.UNKNOWN
        if item.state is QueueState.DONE or (is_wanted and not is_too_late and may_run):
            self._reopen(row, item)
        elif may_run:
            return self._cancel_late(row, item)
        return True

    def _reopen(self, row: Execution, item: QueueItem) -> bool:
        found = transitions.reopen(row, self._seen.robot, item.id, self._s.clock.now())
        return bool(self._ledger.apply([found]))

    def _cancel_late(self, row: Execution, item: QueueItem) -> bool:
        if is_cancelled := self.cancel(item.id, row, runs=not item.is_pending):
            self.own.alarm_once("late_cancelled", row, item)
        return is_cancelled

    def cancel_copy(self, item: QueueItem, row: Execution) -> bool:
        """A later item with a token that is claimed already is cancelled while it is pending, and an alarm is raised. Returns whether all
        is done about it."""
        runs = item.state in (QueueState.EXECUTING, QueueState.DONE, QueueState.UNKNOWN)  # or it may
        if row.trigger is Trigger.IDLE:
            self._ledger.note_idle_copy(self._seen.robot.id, item.id, runs=runs)
        if item.is_pending:
            if not self.cancel(item.id, row):
                return False
            self.own.alarm_once("duplicate_healed", row, item)
        elif runs:
            self.own.alarm_once("duplicate_running", row, item)
        return True

    def cancel(self, queue_id: int, row: Execution, *, runs: bool = False) -> bool:
        """Returns whether the robot has done it. An item that can't be cancelled now is handled again at the next
        poll. ``runs``: or it may."""
        can = self._client.capabilities
        if not (can.cancel_running if runs else can.cancel_waiting):
            return False
        try:
            self._client.cancel(queue_id, row.token)
        except RobotError as error:
            log.warning("Item %d of %r could not be cancelled yet: %s", queue_id, self._seen.robot.name, error.text)
            return False
        return True
