"""The second stage of a fleet's check-up: one order for one robot, which is to begin a day later, is looked at and
deleted. It is in the database before it is sent, so that it is deleted in every case."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

from app.database.check_ups import CheckUpRepository
from app.database.connection import Database
from app.database.robots import Hold
from app.domain.check_up import LeftBehind, Topic
from app.domain.message import Message, message
from app.domain.models import Fleet
from app.domain.robot import QueueState
from app.mir.errors import Refusal, RobotError
from app.mir.fleet_vocabulary import ORDER_STATES
from app.mir.raw_client import Answer
from app.services.check_up.fleet_orders import AHEAD, ENDED, ClassicOrders, EnterpriseOrders, Orders, Seen
from app.services.check_up.fleet_probes import LENGTH_S, has_own_user
from app.services.check_up.journal import ALARM, HOLD
from app.services.check_up.session import CheckUpSession, Found, amber, green, red
from app.services.check_up.trial import Item, TrialResult
from app.services.check_up.trial_probes import add_early_end, recognised, taken
from app.services.live.alarms import Alarms
from app.services.live.holds import Holds

TAKES_S = 30.0  # about
SHOWN_WITHIN = 15.0  # s from the answer until the fleet shows the order
WATCHED_S = 5.0  # that it must not begin in
ENDS_WITHIN = 15.0  # s from the first request to delete it
LATE = timedelta(seconds=90)  # after which an order that was sent no longer arrives
EVERY = 1.0  # s between two looks
TWICE = message("A start whose answer was lost could run twice: nothing is sent by itself.")


class FleetJournal:
    """What is at one fleet because of a check-up, as plain data: another process can delete it when this one is
    killed."""

    def __init__(self, db: Database, holds: Holds, alarms: Alarms, fleet: Fleet, left: LeftBehind) -> None:
        self._db, self._holds, self._alarms, self._fleet, self.left = db, holds, alarms, fleet, left
        self._check_ups = CheckUpRepository()

    def begin(self, robot_ids: Sequence[int]) -> None:
        """The plan's starts on these robots wait until all is undone: one could be taken for the trial's order. A robot
        that a person holds keeps that hold."""
        for robot_id in robot_ids:
            if self._holds.active(robot_id) is None:
                self._holds.hold(HOLD, robot_id=robot_id, also=lambda c, hold: self._put(c, self._with(hold)))

    def _with(self, hold: Hold) -> LeftBehind:
        self.left = replace(self.left, holds=(*self.left.holds, hold.id))
        return self.left

    def _put(self, c: sqlite3.Connection, left: LeftBehind | None) -> None:
        self._check_ups.note_left_on_fleet(c, self._fleet.id, left)

    def note(self, **changes: Any) -> None:
        """On the disk when it returns."""
        self.left = replace(self.left, **changes)
        self._db.write(lambda c: self._put(c, self.left))

    def end(self) -> None:
        for hold in self._holds.current():
            if hold.id in self.left.holds:
                self._holds.release(hold.robot_id, hold.id)
        self._db.write(lambda c: self._put(c, None))
        self._alarms.clear(ALARM, self._key)

    def warn(self, problem: Message) -> None:
        """By an alarm, until the order is deleted."""
        self._alarms.raise_(ALARM, self._key, robot=self._fleet.name, problem=problem)

    @property
    def _key(self) -> str:
        return f"fleet:{self._fleet.id}"


def put_back(session: CheckUpSession, orders: Orders, journal: FleetJournal) -> Message | None:
    """Delete what is there. Returns what could not be; None: nothing is left. Raises RobotError."""
    left, clock = journal.left, session.clock
    began = clock.monotonic()
    while seen := [each for each in orders.of(left) if each.may_be_open]:
        if clock.monotonic() - began > ENDS_WITHIN:
            return message("its order {number} does not end: delete it at the fleet", number=seen[0].key)
        for each in seen:
            orders.delete(each).checked(*ENDED)
        clock.sleep(EVERY)
    if left.sent_at is not None and abs(clock.now() - left.sent_at) < LATE:
        return message("it is not known yet whether its order arrived")
    journal.end()
    return None


class OrderTrial:
    """Of what is noted in ``journal``. ``date``: by the fleet's clock. ``is_known``: whether the app can rely on what
    was found."""

    def __init__(self, session: CheckUpSession, orders: Orders, journal: FleetJournal, date: datetime) -> None:
        self._session, self._orders, self._journal = session, orders, journal
        self._began = session.clock.monotonic()
        self._earliest = date + AHEAD
        self.is_known = False

    def run(self) -> bool:
        """Whether it was tried to the end. Raises Cancelled."""
        try:
            return self._run()
        except RobotError as error:
            add_early_end(self._session, error)
            return False

    def _run(self) -> bool:
        self._at(message("Ordering a mission for tomorrow"))
        now = self._session.clock.now()
        self._journal.note(sent_at=now, begins_by=now + 2 * AHEAD)
        answer = self._orders.post(self._journal.left, self._earliest)
        if isinstance(answer.error, Refusal) and answer.error.status < 500:
            self._journal.note(sent_at=None)
            self._session.add(Topic.ORDER, taken(self._session, answer, is_found=False))
            return True
        if isinstance(self._orders, ClassicOrders) and answer.id is not None:
            self._journal.note(number=answer.id, sent_at=None)
        seen = self._wait_for_it()
        if seen is None:
            self._session.add(Topic.ORDER, _not_there(answer))
            return answer.is_good
        self._journal.note(sent_at=None, number=self._number(seen))
        if is_due := seen.is_due:
            self._stop()
        look = self._look_at_classic if isinstance(self._orders, ClassicOrders) else self._look_at_enterprise
        is_recognised = look(seen, answer)
        if not is_due:
            self._watch()
        is_ended = self._delete()
        self.is_known = is_recognised and is_ended
        return True

    def _at(self, says: Message) -> None:
        self._session.at(says, LENGTH_S + self._session.clock.monotonic() - self._began)

    def _number(self, seen: Seen) -> int | None:
        return int(seen.key) if isinstance(self._orders, ClassicOrders) else None

    def _wait_for_it(self) -> Seen | None:
        clock = self._session.clock
        began = clock.monotonic()
        while not (found := self._orders.of(self._journal.left)):
            if clock.monotonic() - began > SHOWN_WITHIN:
                return None
            self._at(message("Waiting until the fleet shows it"))
            clock.sleep(EVERY)
        return found[0]

    # ------------------------------------------------------------------ what the fleet shows
    def _look_at_classic(self, seen: Seen, answer: Answer) -> bool:
        session, left, robot = self._session, self._journal.left, self._session.robot
        session.add(Topic.ORDER, taken(session, answer, is_found=True))
        number, token = int(seen.key), left.tokens[0]
        newest = {"whitelist": "all", "sort_by": "id,desc", "limit": "20"}
        above = {"fieldname": "id", "operator": ">", "value": number - 1}
        listed, searched = robot.get(robot.queue, **newest), robot.search(above, **newest)
        rows = {
            name: next((row for row in found.rows if row.get("id") == number), {})
            for name, found in (("list", listed), ("search", searched))
        }
        session.facts["has_search"] = bool(rows["search"])
        result = TrialResult(items=[Item(token, number, now=seen.row)], places={"item": seen.row, **rows})
        session.add(Topic.RECOGNISED, recognised(session, result))
        if seen.word not in ORDER_STATES:
            session.facts["item_states"] = {seen.word: QueueState.PENDING.value}
        if number <= left.queue_floor:
            session.add(
                Topic.RECOGNISED,
                red(
                    "Its new order has the number {number}, although {highest} is in use already",
                    "The app finds a start whose answer was lost by its higher number: nothing is sent by itself.",
                    number=number,
                    highest=left.queue_floor,
                ),
            )
            return False
        if not session.facts["token_field"] and not has_own_user(session):
            session.add(
                Topic.RECOGNISED,
                red(
                    "Neither a mark nor a user of its own tells the app's orders from those of people",
                    "Nothing is sent by itself: give the app a user of its own at the fleet, and check up again.",
                ),
            )
            return False
        return True

    def _look_at_enterprise(self, seen: Seen, answer: Answer) -> bool:
        session, left, orders = self._session, self._journal.left, self._orders
        assert isinstance(orders, EnterpriseOrders)
        session.facts["order_status"], session.facts["gives_id"] = answer.status, answer.status == 201
        session.facts["token_field"] = "id"  # noqa: S105
        session.add(Topic.ORDER, green("It takes an order with the app's own id, and shows it"))
        return self._is_found_by_id(orders, left.tokens[0]) and self._send_again(orders)

    def _is_found_by_id(self, orders: EnterpriseOrders, token: str) -> bool:
        if orders.finds_by_id and not all(answer.checked(404, 410).is_good for answer in orders.found_by_id(token)):
            self._session.add(Topic.RECOGNISED, red("An order can't be found by the app's id", TWICE))
            return False
        self._session.add(Topic.RECOGNISED, green("The order is found by the app's id"))
        return True

    def _send_again(self, orders: EnterpriseOrders) -> bool:
        """The same: it must not become a second order."""
        left, clock = self._journal.left, self._session.clock
        self._journal.note(sent_at=clock.now())
        again = orders.post(left, self._earliest)
        if again.status == 409:
            self._journal.note(sent_at=None)
            self._session.add(Topic.SECOND, green("It refuses an order that it has already"))
            return True
        clock.sleep(WATCHED_S)
        if len(orders.of(left)) == 1 and again.status != 201:
            self._session.add(
                Topic.SECOND,
                amber(
                    "It does not refuse an order that it has already, but has it once",
                    "The app looks whether the fleet has a start before it sends that again. Nothing to do.",
                ),
            )
            return True
        self._session.add(Topic.SECOND, red("The same order, sent twice, becomes two orders", TWICE))
        return False

    # ------------------------------------------------------------------ it must not begin
    def _watch(self) -> None:
        self._at(message("Watching that it does not begin"))
        began = self._session.clock.monotonic()
        while self._session.clock.monotonic() - began < WATCHED_S:
            if any(seen.is_due for seen in self._orders.of(self._journal.left)):
                self._stop()
                return
            self._session.check_is_wanted()
            self._session.clock.sleep(EVERY)

    def _stop(self) -> None:
        """At once."""
        for seen in self._orders.of(self._journal.left):
            self._orders.delete(seen)
        self._session.add(
            Topic.ORDER,
            red(
                "It does not wait with an order for tomorrow: it was cancelled at once",
                "Look whether the robot has moved. The app keeps the times of starts itself, so it changes nothing for them.",
            ),
        )

    def _delete(self) -> bool:
        self._at(message("Deleting the order"))
        session, left, clock = self._session, self._journal.left, self._session.clock
        answer: Answer | None = None
        began = clock.monotonic()
        while seen := [each for each in self._orders.of(left) if each.may_be_open]:
            if answer is None:
                answer = self._orders.delete(seen[0])
            if clock.monotonic() - began > ENDS_WITHIN:
                session.add(Topic.CANCELLED, _not_cancelled(answer, seen))
                return False
            clock.sleep(EVERY)
        for each in self._orders.of(left):
            if each.word not in ORDER_STATES and isinstance(self._orders, ClassicOrders):
                session.facts.setdefault("item_states", {}).setdefault(each.word, QueueState.ABORTED.value)
        if isinstance(self._orders, EnterpriseOrders) and not self._orders.finds_by_id:
            session.facts["own_key"] = self._orders.own_key(left)
        if isinstance(self._orders, EnterpriseOrders) and self._orders.finds_by_id:
            _order, phase = self._orders.found_by_id(left.tokens[0])
            if not phase.checked(404, 410).is_good:
                session.add(Topic.CANCELLED, red("An order that has ended can't be found any more", TWICE))
                return False
        session.add(Topic.CANCELLED, green("An order can be cancelled before it begins"))
        return True


def _not_there(answer: Answer) -> Found:
    if not answer.is_good:
        return red(
            "It does not take a mission: {problem}",
            "Nothing can be scheduled on it until that is corrected.",
            problem=answer.problem,
        )
    return red(
        "It took an order, but does not show it",
        "The app could not know whether a start arrived: nothing is sent by itself.",
    )


def _not_cancelled(answer: Answer, seen: Sequence[Seen]) -> Found:
    if answer.error is not None:
        return red(
            "A mission can't be cancelled: {problem}",
            "What the app has started can only be stopped on the robot: give the user more rights there.",
            problem=answer.problem,
        )
    return red(
        "An order that was deleted stays {state}",
        "Delete it at the fleet: nothing is sent by itself.",
        state=seen[0].word or "?",
    )
