"""Which items of a robot's queue belong to an execution.

The token in ``description`` is the proof. A robot that does not give descriptions back is judged by mission, user and
number; while it is not known yet whether it does, an item that may be ours is taken for ours, to avoid sending twice.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from datetime import timedelta

from app.database.robots import Accepted
from app.domain.capabilities import FindBy
from app.domain.execution import Execution, Trigger
from app.domain.message import Message, message
from app.domain.models import ANY_VEHICLE
from app.domain.robot import QueueItem
from app.mir.errors import Refusal, Rejected, RobotError, RobotFault, Unreadable
from app.mir.target import Target
from app.services.dispatch.context import Context
from app.services.dispatch.observation import Observation

log = logging.getLogger(__name__)

SEARCHED_AFTER_RESTORE = 1000  # newest queue items that are searched for what a restored backup does not know
SHOWN_AT_LEAST = 60.0  # s: no fleet forgets an order that soon after its request; the history of each is of an hour
LONG_AGO = 1800.0  # s within which it is certain, after a restore, what a fleet has
CLOCK_STEPS = 120.0  # s by which a fleet's clock may have been set since an order ended
ENDED_BEFORE = timedelta(minutes=5)  # that a start had ended before another was planned, as clocks may be set back


class OwnItems:
    """On one robot. Raises RobotError where it can't be asked."""

    def __init__(self, client: Target, context: Context, observation: Observation) -> None:
        self._client, self._s, self._ledger, self._seen = client, context, context.ledger, observation
        self.alarmed: set[tuple[str, int]] = set()  # alarms by code and queue id
        self.note_accepted: Callable[[], None] = lambda: None  # writes which items are known to be ours
        self._has_forgotten = False  # an item that is certainly ours came without its token
        self._read: dict[int, QueueItem | None] = {}  # for a reading in several calls: items by id; None: missing

    def of(self, row: Execution) -> list[QueueItem]:
        """Items that the attempts of this row put on the robot, oldest first."""
        floor = row.queue_floor or 0
        if floor and self._client.capabilities.shares_numbers:  # others may order past it before the next look
            self._seen.read_highest(floor)
        newer = sorted(self._client.items_after(floor, tokens=(row.token,)), key=lambda item: item.id)
        found = [item for item in newer if item.description == row.token]
        if found or not newer:
            return found
        self.note_accepted()  # while the robot was read others may have been sent
        candidates = [item for item in newer if self.may_be_of(row, item)][:1]
        do_tokens_come_back = self.do_tokens_come_back() if candidates else None
        if do_tokens_come_back:
            return []
        if candidates and do_tokens_come_back is None:
            self.alarm_once("adopted_unproven", row, candidates[0])
        return candidates

    def do_tokens_come_back(self) -> bool | None:
        """Whether this robot now returns descriptions unchanged: judged by the newest item that is certainly ours,
        unless its check-up has shown that it does not. That it does is true until a robot boots; a fleet may have been
        changed unseen. None: unknown."""
        if self._client.capabilities.find_by is FindBy.ID:
            return True
        known = self._seen.known
        if known is not None and known.token_field == "":
            return False
        if (is_returned := self._was_last_token_returned()) is not None:
            return is_returned
        return True if known is not None and known.token_field and self._client.capabilities.own_queue else None

    def _was_last_token_returned(self) -> bool | None:
        """None: the robot, or any of its fleet, has no item that certainly belongs to the app."""
        is_returned = None
        for last in self._last_accepted():
            try:
                item = self._client.queue_item(last.queue_id)
            except Rejected:  # deleted, or its number is another item's now
                continue
            except (RobotFault, Unreadable):  # that one item, perhaps for long
                if self._has_forgotten:
                    return False
                raise
            is_returned = item.description == last.token
            if is_returned or not item.has_token:  # else that number has been given again
                break
        return is_returned

    def _last_accepted(self) -> list[Accepted]:
        """The newest item that the robot has taken from the app; then those of other robots of its fleet."""
        return self._s.robots.last_of_each(self._s.db.read(), self._seen.robot.id)

    def _is_last_anothers(self) -> bool:
        """Whether a fleet has another order under the number of the newest that it has taken from the app. Raises
        RobotError."""
        if not self._client.capabilities.shares_numbers:
            return False
        accepted = self._last_accepted()
        newest = max((last.queue_id for last in accepted), default=None)
        if newest is None:
            return False
        try:
            item = self._client.queue_item(newest)
        except Rejected:  # deleted
            return False
        except (RobotFault, Unreadable):  # that one order, perhaps for long: a list may show it
            tokens = [last.token for last in accepted]
            listed = {each.id: each for each in self._client.items_after(newest - 1, tokens=tokens)}
            if newest not in listed:
                raise
            item = listed[newest]
        return not any(last.queue_id == newest and self._may_be(last, item) for last in accepted)

    def _may_be(self, accepted: Accepted, item: QueueItem) -> bool:
        if item.has_token:
            return item.description == accepted.token
        missions = (accepted.mission_guid, item.mission_id)
        return self._is_made_by_app(item) and (missions[0] == missions[1] or not all(missions))

    def why_uncertain(
        self, row: Execution, is_taken: bool, may_change_robot: bool, age: float = 0.0, unasked: float = 0.0
    ) -> Message:
        """Why it may be or have been on the robot, though it is not found there; "": it certainly is not. ``is_taken``:
        the robot has accepted it. ``may_change_robot``: another robot would get it. ``age``: s since it was sent, and
        ``unasked`` the longest that the robot was not asked for it since, both at most."""
        if is_taken:
            return message("it took it, but its queue does not show it")
        floor, can = row.queue_floor or 0, self._client.capabilities
        if can.shares_numbers and not floor:
            return message("it had no orders before, so it may have forgotten this one")
        if (
            self._s.clock.monotonic() - self._seen.began_again_at <= age
            or (floor and can.find_by is not FindBy.ID and self._seen.read_highest(floor) < floor)
            or self._is_last_anothers()
        ):
            return message("its queue was reset")
        if unasked > SHOWN_AT_LEAST and age > self._ended_is_shown_for(age):
            return message("it may have ended, and the fleet may no longer show it")
        robot = self._seen.robot
        if robot.is_any and not robot.is_identified:
            return message("another fleet may have it, as this one can't be told from others")
        if may_change_robot and not self._would_be_seen():
            return message("its queue does not show whether it arrived")
        return ""

    def _ended_is_shown_for(self, enough: float) -> float:
        """Seconds; what was sent before may have ended and be forgotten. As its check-up has seen; where that is not
        ``enough``, as it shows now."""
        known = self._seen.robot.known
        shown = (known and known.ended_shown_s) or 0.0
        if shown >= enough:
            return shown
        return max(shown, self._client.ended_shown_for(enough + CLOCK_STEPS) - CLOCK_STEPS)

    def _would_be_seen(self) -> bool:
        """Whether an arrived item would be found: by its token, or, on a checked-up robot, by its mission and the app's
        user."""
        return self.do_tokens_come_back() is not False or (self._seen.known is not None and bool(self._seen.user_name))

    def may_be_of(self, row: Execution, item: QueueItem) -> bool:
        """Without tokens (a robot may put the mission's own description there): the same mission, put there since by the same
        user, and claimed by no other execution that may have it."""
        return (
            item.mission_id == row.mission_guid
            and not item.has_token
            and self._is_made_by_app(item)
            and not self._ledger.is_claimed(self._seen.robot.id, item.id, row.planned_at - ENDED_BEFORE)
        )

    def _is_made_by_app(self, item: QueueItem) -> bool:
        """As far as its user shows."""
        return item.created_by_name in ("", self._seen.user_name or item.created_by_name)

    def is_ours(self, row: Execution, item: QueueItem) -> bool:
        """Whether the item under this number is the app's; after a reset of the robot's database, or if another machine
        took the request, it may be somebody else's."""
        if item.has_token:
            return item.description == row.token
        if item.id <= (row.queue_floor or 0):  # it was there before the request left
            return False
        self._has_forgotten |= item.mission_id == row.mission_guid
        return item.mission_id in (None, "", row.mission_guid)

    @property
    def forgets_tokens(self) -> bool:
        """As far as is known without asking."""
        known = self._seen.known
        return self._has_forgotten if known is None or known.token_field is None else known.token_field == ""

    def newest_of_idle_mission(self, last_queue_id: int | None, highest: int | None) -> int | None:
        """The robot's newest item, if all items since its last idle mission are copies of the app's idle missions: it
        was not used otherwise. None: it was used, or unknown. Raises RobotError if it does not answer."""
        if last_queue_id is None or highest is None or highest == last_queue_id:
            return None
        do_ids_grow = self._client.capabilities.find_by is not FindBy.ID
        if do_ids_grow and highest < last_queue_id:
            return None
        try:
            if not self._is_of_idle_mission(
                self._client.queue_item(highest)
            ):  # usually; there may be thousands before it
                return None
            if not do_ids_grow:  # the newest is all that can be seen
                return highest
            newer = [item for item in self._client.items_after(last_queue_id) if self._may_have_used_robot(item)]
        except (Refusal, Unreadable) as error:
            log.info(
                "What %r has executed since its last idle mission is not known: %s", self._seen.robot.name, error.text
            )
            return None
        return max(item.id for item in newer) if newer and all(map(self._is_of_idle_mission, newer)) else None

    def _may_have_used_robot(self, item: QueueItem) -> bool:
        """A fleet's order that was deleted before a robot got it, as that of a check-up, has used none."""
        return self._client.capabilities.own_queue or bool(item.vehicle) or item.may_be_open

    def _is_of_idle_mission(self, item: QueueItem) -> bool:
        row = self._ledger.by_token(item.description) if item.has_token else None
        return row is not None and row.trigger is Trigger.IDLE

    def answer(self) -> None:
        """Report which starts this robot has, while a start is looked for on all robots. A failure delays nothing
        else."""
        robot, asked_at, known = self._seen.robot, self._s.clock.monotonic(), len(self._read)
        if not self._s.restored_starts.wants(robot):
            self._read = {}
            return
        lists_all = self._client.capabilities.find_by is not FindBy.ID  # it lists all, not only what is looked for
        tokens = self._s.restored_starts.sought()
        try:
            found = self._client.status().serial_number
            if robot.serial_number and found and found != robot.serial_number:  # another machine
                return
            highest = self._client.highest_queue_id() or 0
            if highest < max(self._read, default=0):  # its numbers have begun again
                self._read, known = {}, 0
            last = self._s.robots.last_accepted(self._s.db.read(), robot.id)
            floor, is_enough = self._floor_of_restored(highest)
            items = self._client.items_after(floor, self._read, highest, tokens=tokens)
            if lists_all and (not is_enough or (last is not None and highest < last.queue_id)):  # that is no answer
                log.info(
                    "%r does not show its newest items, so whether it has other starts of before the restore is not known",
                    robot.name,
                )
                asked_at = -math.inf
        except RobotError as error:
            if (
                len(self._read) > known
            ):  # more of them the next time: reading all at once would make what falls due late
                return
            log.info("Whether %r has starts of before the restore could not be asked: %s", robot.name, error.text)
        else:
            self._read = {}
            own = sorted((item for item in items if self.is_of_robot(item)), key=lambda item: item.id)
            if lists_all:
                self._s.restored_starts.answer(robot, asked_at, own)
            else:
                shows_since = self._s.clock.now() - timedelta(seconds=self._ended_is_shown_for(LONG_AGO))
                self._s.restored_starts.answer(robot, asked_at, own, tokens, shows_since)

    def _floor_of_restored(self, highest: int) -> tuple[int, bool]:
        """From where to search for what a restored backup does not know, and whether all of that lies above. A fleet
        has as many new orders in half an hour as a robot in days, but what the backup knows of it is older."""
        floor = max(0, highest - SEARCHED_AFTER_RESTORE)
        if self._client.capabilities.own_queue or floor == 0:
            return floor, True
        newest = max(self._last_accepted(), default=None)
        if newest is None:
            return floor, False
        return max(0, min(highest, newest.queue_id) - SEARCHED_AFTER_RESTORE), True

    def is_of_robot(self, item: QueueItem) -> bool:
        """Not another robot's of the same fleet."""
        return not item.vehicle or self._seen.robot.vehicle in ("", ANY_VEHICLE, item.vehicle)

    def alarm_once(self, code: str, row: Execution, item: QueueItem) -> None:
        if (code, item.id) in self.alarmed:  # it is met at every read
            return
        self.alarmed.add((code, item.id))
        self._seen.raise_about(row, code, queue_id=item.id)
