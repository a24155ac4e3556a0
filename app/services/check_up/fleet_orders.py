"""The one order of a fleet's check-up, which is to begin a day later and is deleted before: how each kind of fleet takes
it, shows it and deletes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from typing import Any, NamedTuple

from app.domain.check_up import LeftBehind
from app.domain.message import message
from app.domain.robot import QueueItem, QueueState
from app.mir import enterprise_vocabulary, parse
from app.mir.classic_requests import ORDERS
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.enterprise_vehicle import ORDER, EnterpriseVehicle
from app.mir.errors import Unreadable
from app.mir.fleet_target import NOT_FOUND
from app.mir.fleet_vocabulary import ORDER_STATES
from app.mir.raw_client import Answer, RawClient
from app.mir.rest import segment
from app.mir.texts import clean
from app.services.check_up.trial import LONGEST_WORD

AHEAD = timedelta(hours=24)  # of the fleet's clock, that the order begins: longer than any zone differs from another
CLEARLY_AHEAD = timedelta(hours=6)  # in whichever zone the fleet reads it
ENDED = (400, *NOT_FOUND)  # how a fleet may answer the deletion of an order that has ended
SNAPSHOT, EVENTS = "/serial-order-status/snapshot", "serial-order-status-events"


class Seen(NamedTuple):
    """The order as the fleet shows it. ``key``: its id there. ``word``: for its state."""

    key: str
    row: parse.Object
    word: str
    state: QueueState
    is_due: bool  # it has begun, was sent to its robot, or may begin at any time

    @property
    def may_be_open(self) -> bool:
        return self.state not in (QueueState.DONE, QueueState.ABORTED)


class ClassicOrders:
    """Its calls raise RobotError, but ``post`` and ``delete``, in whose answers it is. ``is_claimed``: whether an order
    with that number is a start of the plan."""

    def __init__(self, robot: RawClient, client: ClassicVehicle, is_claimed: Callable[[int], bool]) -> None:
        self._robot, self._client, self._is_claimed = robot, client, is_claimed

    def post(self, left: LeftBehind, earliest: datetime) -> Answer:
        order = {
            "mission_id": left.queued,
            "robot_id": int(left.vehicle),
            "description": left.tokens[0],
            "earliest_start_time": f"{earliest:%Y-%m-%dT%H:%M:%S}",
        }
        return self._robot.ask("POST", ORDERS, json=order, at_once=True)

    def of(self, left: LeftBehind) -> Sequence[Seen]:
        """Those of the check-up: one, if the fleet works as it should. By its number; else by its token; else what the
        app's user has ordered so for the robot, to begin much later."""
        if left.number is not None:
            return self._read(left.number)
        items = self._client.items_after(left.queue_floor, tokens=left.tokens)
        if own := [item for item in items if item.description in left.tokens]:
            return [seen for item in own for seen in self._read(item.id)]
        alike = [seen for item in items if self._is_alike(item, left) for seen in self._read(item.id)]
        user = self._robot.get_once("/users/me").one.get("guid")
        return [seen for seen in alike if _is_ahead(seen.row) and seen.row.get("created_by_id") in (None, user)]

    def _is_alike(self, item: QueueItem, left: LeftBehind) -> bool:
        is_same = (item.mission_id, item.vehicle) == (left.queued, left.vehicle)
        return is_same and item.may_be_open and not self._is_claimed(item.id)

    def _read(self, number: int) -> Sequence[Seen]:
        answer = self._robot.ask("GET", f"{ORDERS}/{number}", at_once=True).checked(*NOT_FOUND)
        row = answer.one
        if not answer.is_good:
            return []
        word = clean(row.get("state"), LONGEST_WORD).capitalize()
        if row.get("id", number) != number or not word:
            raise Unreadable(address=self._client.address.netloc, problem=message("the answer is no queue item"))
        state = QueueState(ORDER_STATES.get(word, ""))
        has_begun = word == "Outbound" or state in (QueueState.EXECUTING, QueueState.DONE)
        has_begun = has_begun or parse.instant(row.get("start_time")) is not None
        if state is QueueState.UNKNOWN and parse.instant(row.get("finish_time")):
            state = QueueState.ABORTED
        return [Seen(str(number), row, word, state, has_begun or _is_ahead(row) is False)]

    def delete(self, seen: Seen) -> Answer:
        return self._robot.ask("DELETE", f"{ORDERS}/{seen.key}", at_once=True)


def _is_ahead(row: parse.Object) -> bool | None:
    """Whether the fleet waits with it. None: it does not say."""
    ordered, earliest = parse.instant(row.get("order_time")), parse.instant(row.get("earliest_start_time"))
    return None if ordered is None or earliest is None else earliest - ordered > CLEARLY_AHEAD


class EnterpriseOrders:
    """The same; its id is the token."""

    def __init__(self, robot: RawClient, client: EnterpriseVehicle) -> None:
        self._robot, self._client = robot, client
        self.finds_by_id = client.finds_by_id

    def post(self, left: LeftBehind, earliest: datetime) -> Answer:
        token = left.tokens[0]
        phase: dict[str, Any] = {"mission-id": left.queued, "arguments": []}
        if self.finds_by_id:
            phase["order-id"] = enterprise_vocabulary.phase_of(token)
        order = {
            "id": token,
            "priority": "Medium",
            "earliest-start-time": f"{earliest:%Y-%m-%dT%H:%M:%SZ}",
            "robot-id": left.vehicle,
            "phases": [phase],
        }
        return self._robot.ask("POST", ORDER, json={"serial-order": order}, at_once=True)

    def of(self, left: LeftBehind) -> Sequence[Seen]:
        """Active ones."""
        answer = self._robot.get(SNAPSHOT).checked()
        events = [
            event
            for event in enterprise_vocabulary.wrapped(answer.found, EVENTS)
            if event.get("serial-order-id") in left.tokens
        ]
        whole = [event for event in events if event.get("phase-index") is None] or events[:1]
        return [seen for seen in map(_seen, whole) if seen.may_be_open]

    def found_by_id(self, token: str) -> tuple[Answer, Answer]:
        """The order and its phase, since software 1.5."""
        phase = enterprise_vocabulary.phase_of(token)
        return self._robot.get(f"{ORDER}/{segment(token)}"), self._robot.get(f"/order/{segment(phase)}")

    def own_key(self, left: LeftBehind) -> str | None:
        return self._client.own_key(left.queued or "")

    def delete(self, seen: Seen) -> Answer:
        return self._robot.ask("DELETE", f"{ORDER}/{segment(seen.key)}", at_once=True)


Orders = ClassicOrders | EnterpriseOrders


def _seen(event: parse.Object) -> Seen:
    word = clean(event.get("state"), LONGEST_WORD)
    state = enterprise_vocabulary.state_of(word)
    has_begun = word.casefold() == "outbound" or state in (QueueState.EXECUTING, QueueState.DONE)
    return Seen(str(event.get("serial-order-id")), event, word, state, has_begun)
