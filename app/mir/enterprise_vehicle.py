"""A robot of Fleet Enterprise (``/api/v1``), or whichever robot that fleet chooses.

The id of an order is the token, so a second POST of it is refused while the fleet knows it, and it is asked for by that
id. An answer 202 says only that the fleet has taken the order: it counts once it is shown. Software before 1.5 can be
asked for active orders by their ids, and for ended ones only by what they are.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

from app.domain.capabilities import Capabilities, FindBy
from app.domain.message import message
from app.domain.robot import QueueItem, QueueState, RobotState, RobotStatus, UserPrompt
from app.mir import enterprise_vocabulary as words
from app.mir import parse
from app.mir.address import Address
from app.mir.credentials import Token
from app.mir.enterprise_past import LISTED_FOR, PastOrders
from app.mir.enterprise_requests import FIND_BY_ID, EnterpriseRequests
from app.mir.errors import (
    NO_LIST,
    AnotherRobot,
    HasAlready,
    NotShownYet,
    Rejected,
    RobotError,
    RobotFault,
    Unreadable,
    VehicleUnavailable,
)
from app.mir.fleet_target import NOT_FOUND
from app.mir.fleet_vocabulary import as_text
from app.mir.rest import segment
from app.mir.texts import clean
from app.mir.transport import OF_ALL, OF_STATUS

SILENT_AFTER = 15.0  # s without news of a robot, which reports each second: it has no contact
ORDER = "/serial-order"

OF_A_VEHICLE = Capabilities(find_by=FindBy.ID, own_queue=False)


class EnterpriseVehicle(EnterpriseRequests):
    """A ``Target``."""

    def __init__(self, address: Address, token: Token, vehicle: str, **options: Any) -> None:
        super().__init__(address, token, vehicle, **options)
        connection = self._connection
        self._followed: set[str] = set()  # tokens of orders that were asked for, for ANY_VEHICLE
        self._past = PastOrders(
            connection.notes,
            lambda within: connection.shared(self, "orders", self._ask_past, within),
            lambda since: connection.shared(self, f"orders since {since:%F %H:%M}", lambda: self._ask_past(since)),
            connection.clock,
            self._token,
        )

    @property
    def capabilities(self) -> Capabilities:
        can = not self._is_any and self._connection.notes.version >= FIND_BY_ID
        return replace(OF_A_VEHICLE, pause=can, clear_error=can, prompts=can)

    # ------------------------------------------------------------------ the robot
    def _status(self, within: float, *, is_for_order: bool = False) -> RobotStatus:
        self._check_fleet()
        ask_active = self._active if is_for_order else self._active_if_readable
        if self._is_any:
            began = self._clock()
            ask_active()
            return RobotStatus(state=RobotState.READY, elapsed_s=self._clock() - began)
        robot, date, took = self._connection.shared(self, f"robot {self.vehicle}", self._ask_robot, within)
        found = words.vehicle(parse.part(robot, "robot-identity")).serial_number
        if self.serial_number and found and found != self.serial_number:
            raise AnotherRobot(address=self.address.netloc, expected=self.serial_number, found=found)
        self._check_contact(robot, date)
        own = [event for event in ask_active() if event.get("robot-id") == self.vehicle]
        running = [event for event in own if words.state_of(event.get("state")) is QueueState.EXECUTING]
        asks = any(clean(event.get("state")).casefold() == "waitingforinput" for event in running)
        return words.status(robot, running, self._prompt() if asks else None, date, took)

    def _active_if_readable(self) -> list[parse.Object]:
        """What was sent is asked for by its id, so that it is followed without this list."""
        try:
            return self._active()
        except NO_LIST:
            return []

    def _ask_robot(self) -> tuple[parse.Object, datetime | None, float]:
        began = self._clock()
        try:
            answer = self._request("GET", f"/robots/{segment(self.vehicle)}", share=OF_STATUS)
        except Rejected as error:
            if error.status not in NOT_FOUND:
                raise
            raise VehicleUnavailable(code="not_in_fleet", address=self.address.netloc) from None
        robot = self._read(answer, lambda found: parse.object_(found, message("the robot")))
        return robot, parse.http_date(answer.headers.get("Date", "")), self._clock() - began

    def _check_contact(self, robot: parse.Object, date: datetime | None) -> None:
        """The last that the fleet has heard stays when the robot is off."""
        text, mono = words.heard_at(robot), self._clock()
        before, since = self._connection.notes.heard.get(self.vehicle, ("", mono))
        if text != before:
            before, since = text, mono
            self._connection.notes.heard[self.vehicle] = (text, mono)
        at = parse.instant(text)
        is_old = at is not None and date is not None and date - at.replace(tzinfo=UTC) > timedelta(seconds=SILENT_AFTER)
        if not text or is_old or mono - since > SILENT_AFTER:
            raise VehicleUnavailable(address=self.address.netloc, state=text or "?")

    def _prompt(self) -> UserPrompt | None:
        if not self.finds_by_id:
            return None
        own = (event for event in self._prompts() if event.get("robot-id") == self.vehicle)
        return next(filter(None, map(words.prompt, own)), None)

    def set_state(self, state: RobotState) -> RobotStatus | None:
        self._patch({"robot-end-state": "Paused" if state is RobotState.PAUSE else "Operational"})
        return None

    def clear_error(self) -> RobotStatus | None:
        self._patch({"errors": []})
        return None

    def _patch(self, body: parse.Object) -> None:
        """Taken, not done yet: the status shows when it is."""
        self._change("PATCH", f"/robots/{segment(self.vehicle)}", body)
        self._connection.forget(f"robot {self.vehicle}")

    def answer_prompt(self, guid: str, answer: str) -> RobotStatus | None:
        """By the option's number, from 1. Raises Rejected if the question has no such answer any more."""
        asked = next((event for event in self._prompts() if event.get("id") == guid), {})
        options = asked.get("options")
        options = [str(option).strip() for option in options] if isinstance(options, list) else []
        if answer not in options:
            raise Rejected(status=404, reason=message("the question is no longer asked"), address=self.address.netloc)
        self._change("POST", "/user-prompt", {"id": guid, "value": options.index(answer) + 1})
        self._connection.forget("prompts")
        return None

    # ------------------------------------------------------------------ orders
    def enqueue(
        self,
        mission_guid: str,
        *,
        description: str = "",
        text: str = "",
        priority: int = 0,
        parameters: Mapping[str, Any] | None = None,
        is_wanted: Callable[[], bool] = lambda: True,
    ) -> int:
        """Raises NotShownYet where the fleet has taken the order without showing it, and HasAlready where it had done so
        before."""
        arguments = [{"name": name, "value": as_text(value)} for name, value in (parameters or {}).items()]
        phase: parse.Object = {"mission-id": mission_guid, "arguments": arguments}
        self.pace.wait(OF_ALL)
        self._verify()
        try:
            if self.finds_by_id:
                phase["order-id"] = words.phase_of(description)
            else:
                self._past.note(description, mission_guid, "" if self._is_any else self.vehicle)
        except RobotError as error:
            raise error.unsent() from None
        order = {
            "id": description,
            "priority": words.PRIORITIES[(priority > 0) - (priority < 0) + 1],
            "robot-id": None if self._is_any else self.vehicle,
            "phases": [phase],
        }
        self._followed.add(description)
        try:
            answer = self._send("POST", ORDER, json={"serial-order": order}, is_wanted=is_wanted)
        except Rejected as error:
            if error.status != 409 or not self._is_same(self._shown(description, HasAlready), mission_guid):
                raise
        else:
            if answer.status != 201:
                self._shown(description, NotShownYet)
        finally:
            self._connection.forget("active", "orders")
        self._past.took(description)
        return words.number_of(description)

    def _shown(self, token: str, error: type[RobotError]) -> QueueItem:
        """The order that the fleet has taken. Raises ``error`` where it is not shown."""
        try:
            found = self._find(token)
        except RobotError:
            found = None
        if found is None:
            raise error(address=self.address.netloc) from None
        return found

    def _is_same(self, found: QueueItem, mission_guid: str) -> bool:
        """Whether the order that the fleet has with this id is the one that is sent again."""
        is_for_it = self._is_any or found.vehicle in ("", self.vehicle)
        return is_for_it and found.mission_id in (None, mission_guid)

    def queue_item(self, queue_id: int, token: str = "") -> QueueItem:
        token = token or self._token_of(queue_id)
        found = self._find(token) if token else None
        if found is None:
            raise Rejected(status=404, reason=message("the fleet has no such order"), address=self.address.netloc)
        self._followed.add(token)
        return found

    def _token_of(self, queue_id: int) -> str:
        """Of one that was asked for before, or of an active one, which may be another client's."""
        return self._past.token_with(queue_id) or next(
            (item.description for item in self._active_items() if item.id == queue_id), ""
        )

    def _find(self, token: str) -> QueueItem | None:
        """None: the fleet does not have it."""
        try:
            words.number_of(token)
        except ValueError:
            return None
        return self._find_by_id(token) if self.finds_by_id else self._find_by_facts(token)

    def _find_by_id(self, token: str) -> QueueItem | None:
        """By its phase, which stays when the order has ended; then by the order, whose phase may have another id, or be
        forgotten."""
        if (item := self._phase(token, words.phase_of(token))) is not None:
            return item
        order = self._found(f"{ORDER}/{segment(token)}")
        if order is None:
            return None
        phase = next(iter(parse.some_objects(order.get("phases"))), {})
        phase_id = clean(phase.get("order-id"), 80)
        if phase_id and (item := self._phase(token, phase_id)) is not None:
            return item
        is_active = any(event.get("serial-order-id") == token for event in self._active())
        return QueueItem(
            words.number_of(token),
            QueueState.PENDING if is_active else QueueState.UNKNOWN,
            "Created" if is_active else "",
            parse.text_or_none(phase.get("mission-id")),
            description=token,
            vehicle=clean(order.get("robot-id"), 80),
        )

    def _find_by_facts(self, token: str) -> QueueItem | None:
        active = {event["serial-order-id"]: event for event in self._active()}
        if (event := active.get(token)) is not None:
            self._past.saw(token, event)
            return words.item_of_event(event)
        order = self._past.find(token, "" if self._is_any else self.vehicle, active)
        return None if order is None else words.item_of_order(token, order, self._said(token))

    def _ask_past(self, since: datetime | None = None) -> list[parse.Object]:
        """Those that have ended ``since``, else within the hour."""
        query = None if since is None else {"terminatedAfter": f"{since.astimezone(UTC):%Y-%m-%dT%H:%M:%SZ}"}
        answer = self._request("GET", "/order", query=query)
        rows = self._read(answer, lambda found: parse.objects(found, message("the orders")), None)
        return [row | {"order-id": clean(row.get("order-id"), 80).lower()} for row in rows]

    def _phase(self, token: str, phase_id: str) -> QueueItem | None:
        order = self._found(f"/order/{segment(phase_id)}")
        if order is not None:
            self._past.remember(token, phase_id)
        return None if order is None else words.item_of_order(token, order, self._said(token))

    def note_sent(self, token: str, mission_guid: str, ago: float, date: datetime) -> None:
        self._past.note_earlier(token, mission_guid, "" if self._is_any else self.vehicle, ago, date)

    def own_key(self, mission_guid: str) -> str | None:
        """What lists of orders call the app's key, by the order for this robot that it has just made and deleted."""
        return self._past.key_of(mission_guid, self.vehicle)

    def ended_shown_for(self, enough: float) -> float:
        if not self.finds_by_id:  # what another run of the app has sent is looked for among those of the last hour
            return min(LISTED_FOR, self._past.shown_for(lambda _id: True, enough))
        return self._past.shown_for(lambda id_: self._found(f"/order/{segment(id_)}") is not None, enough)

    def open_items(self) -> list[QueueItem]:
        """Of this robot; for any robot those that no robot has yet, and those that were asked for."""
        found = [item for item in self._active_items() if item.state.is_open]
        self._followed.intersection_update(item.description for item in found)
        if self._is_any:
            return [item for item in found if not item.vehicle or item.description in self._followed]
        return [item for item in found if item.vehicle == self.vehicle]

    def newest_id(self, token: str = "") -> int | None:
        """Of those that are active or have ended within the hour; else ``token``'s, if that was sent since something was seen."""
        active = [item.id for item in self._active_items() if item.vehicle == self.vehicle]
        own = [row for row in self._past.rows() if row.get("robot-id") == self.vehicle and not words.gives_way(row)]
        notes = self._connection.notes
        if active:
            notes.newest[self.vehicle] = max(active)
        elif own:
            newest = max(own, key=lambda row: clean(row.get("order-created"), 40))
            notes.newest[self.vehicle] = self._number_of_phase(clean(newest.get("order-id"), 80), token)
        elif token and token != notes.sent_before.get(self.vehicle):
            notes.newest[self.vehicle] = words.number_of(token)
        notes.sent_before[self.vehicle] = token
        return notes.newest.get(self.vehicle)

    def _number_of_phase(self, phase_id: str, token: str) -> int:
        """Of the order that has it, if that is known; else a number of its own."""
        if token and phase_id == words.phase_of(token):
            return words.number_of(token)
        return words.number_of(self._past.token_of(phase_id) or phase_id)

    def items_after(
        self,
        id_floor: int,
        known: dict[int, QueueItem | None] | None = None,
        highest: int = 0,
        tokens: Collection[str] = (),
    ) -> list[QueueItem]:
        """Those with these ``tokens``, each by itself; without any the active ones."""
        if not tokens:
            return self.open_items()
        found = []
        for token in tokens:
            self.on_pause()
            try:
                item = self._find(token)
            except (RobotFault, Unreadable):  # while it is active, its event says enough
                if (item := self._active_item(token)) is None:
                    raise
            if item is not None:
                found.append(item)
        return sorted(found, key=lambda item: item.id)

    def highest_queue_id(self) -> int | None:
        """Its time, in seconds, when it was asked last."""
        now = self._connection.notes.time
        return None if now is None else int(now.timestamp())

    def _active_items(self) -> list[QueueItem]:
        found = [words.item_of_event(event) for event in self._active() if not words.gives_way(event)]
        return sorted(filter(None, found), key=lambda item: item.id)

    def _active_item(self, token: str) -> QueueItem | None:
        return next((item for item in self._active_items() if item.description == token), None)

    def cancel(self, queue_id: int, token: str = "") -> None:
        """Taken, not done yet."""
        token = token or self._token_of(queue_id)
        if not token:
            raise Rejected(status=404, reason=message("the fleet has no such order"), address=self.address.netloc)
        self._change("DELETE", f"{ORDER}/{segment(token)}")
        self._connection.forget("active")
