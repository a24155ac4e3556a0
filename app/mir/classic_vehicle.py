"""A robot of a classic fleet (``/api/v2.0.0/mission_scheduler``), or whichever robot that fleet chooses.

Orders have numbers that grow, shared by all of the fleet's clients, and give back the description with the token where
the check-up has seen that. The collection is never deleted, as others' orders are in it, and the fleet's own state never
set.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import closing
from dataclasses import replace
from typing import Any

from app.domain.capabilities import Capabilities, FindBy
from app.domain.check_up import RobotProfile
from app.domain.message import message
from app.domain.robot import Identity, QueueItem, RobotState, RobotStatus
from app.mir import fleet_vocabulary, parse
from app.mir.address import Address, InvalidAddress
from app.mir.classic_requests import ORDERS, ClassicRequests, Fleet
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import (
    AnotherRobot,
    Refusal,
    Rejected,
    RobotError,
    RobotFault,
    Unreadable,
    VehicleUnavailable,
)
from app.mir.fleet_target import NOT_FOUND, VERIFIED_FOR
from app.mir.mission_queue import PAGE, UNSUPPORTED
from app.mir.robot_vocabulary import LONGEST_DESCRIPTION
from app.mir.texts import clean, resolve
from app.mir.transport import OF_ALL, Timeouts, Transport

OF_ITS_OWN = Timeouts(connect=1.5, read=3.0, total=5.0)  # it may be on a network that only the fleet reaches
SEARCHED = 50  # newest items of a robot's queue, for an order of the fleet
NEWEST = {"whitelist": "all", "sort_by": "id,desc", "limit": str(PAGE)}

OF_A_VEHICLE = Capabilities(find_by=FindBy.MATCH, own_queue=False, pause=False, clear_error=False, failure_text=False)


class ClassicVehicle(ClassicRequests):
    """A ``Target``. ``reach`` replaces HTTP to a robot's own address in simulations."""

    def __init__(
        self,
        address: Address,
        token: Token,
        vehicle: str,
        *,
        reach: Callable[[Address], Transport | None] = lambda _address: None,
        **options: Any,
    ) -> None:
        super().__init__(address, token, vehicle, **options)
        self._reach = reach
        self._followed: set[int] = set()  # orders for ANY_VEHICLE that the app follows, which a robot may have now

    def _words_of(self, profile: RobotProfile) -> RobotProfile:
        return replace(profile, item_states={**fleet_vocabulary.ORDER_STATES, **profile.item_states})

    @property
    def capabilities(self) -> Capabilities:
        reaches = not self._is_any and self._connection.notes.reached.get(self.vehicle, False)
        find_by = FindBy.TOKEN if self._profile.token_field else FindBy.MATCH
        return replace(
            OF_A_VEHICLE,
            find_by=find_by,
            pause=reaches,
            clear_error=reaches,
            failure_text=reaches,
            prompts=not self._is_any,
        )

    # ------------------------------------------------------------------ who it is
    def _status(self, within: float, *, is_for_order: bool = False) -> RobotStatus:
        self._check_fleet()
        mode = self._connection.shared(self, "mode", self._ask_mode)
        if self._is_any:
            fleet = self._fleet(within)
            state = RobotState.UNKNOWN if mode else RobotState.READY
            date = parse.http_date(fleet.answer.headers.get("Date", ""))
            return RobotStatus(state=state, state_text=mode, date=date, elapsed_s=fleet.elapsed_s)
        vehicle, fleet = self._vehicle(within)
        found = parse.text_or_none(vehicle.get("serial_number"))
        is_identified = self.fleet_identity is not None or self.address.is_secure
        if self.serial_number and found != self.serial_number and (found or not is_identified):
            raise AnotherRobot(address=self.address.netloc, expected=self.serial_number, found=found or "?")
        if not fleet_vocabulary.has_contact(vehicle):
            text = clean(vehicle.get("fleet_state_text"), 80) or "?"
            raise VehicleUnavailable(address=self.address.netloc, state=text)
        date = parse.http_date(fleet.answer.headers.get("Date", ""))
        return fleet_vocabulary.vehicle_status(vehicle, mode, date, fleet.elapsed_s)

    def _vehicle(self, within: float) -> tuple[parse.Object, Fleet]:
        """From the list of all; by a request of its own where the list is short. Raises VehicleUnavailable where the
        fleet has no such robot."""
        fleet = self._fleet(within)
        listed = fleet.vehicles.get(self.vehicle)
        if listed is not None and "fleet_state" in listed and "status" in listed:
            return listed, fleet
        try:
            alone = self._connection.shared(self, f"robot {self.vehicle}", lambda: self._alone(self.vehicle), within)
        except Rejected as error:
            if error.status not in NOT_FOUND:
                raise
            raise VehicleUnavailable(code="not_in_fleet", address=self.address.netloc) from None
        return alone, fleet

    def identify(self) -> Identity:
        """Also looks whether the robot's own API can be reached, for what the fleet can't do."""
        identity = super().identify()
        if not self._is_any:
            self._connection.notes.reached[self.vehicle] = self._reaches_robot()
        return identity

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
        """``text`` has no place in a fleet's order. Only a positive priority has an effect that is known."""
        body: parse.Object = {"mission_id": mission_guid, "description": description[:LONGEST_DESCRIPTION]}
        if not self._is_any:
            body["robot_id"] = int(self.vehicle)
        if priority > 0:
            body["high_priority"] = True
        if parameters:
            body["parameters"] = [
                {"input_name": name, "value": fleet_vocabulary.as_text(value)} for name, value in parameters.items()
            ]
        self.pace.wait(OF_ALL)
        self._verify()
        try:
            answer = self._send("POST", ORDERS, json=body, is_wanted=is_wanted)
        except RobotError:
            self._connection.forget("robots")  # the next start reads its robot first
            raise
        finally:
            self._connection.forget("open", "highest", "newest")
        number = self._number_of_new(answer)
        self._followed.add(number)
        return number

    def queue_item(self, queue_id: int, token: str = "") -> QueueItem:
        """With the robot's own message where the order failed and the robot can be reached."""
        found = self._get(f"{ORDERS}/{queue_id}", parse_order)
        item = parse.queue_item(self._in_mir_words(found))
        self._queue.saw(item)
        if token:
            self._followed.add(queue_id)
        guid = clean(found.get("fleet_schedule_guid") or found.get("fleet_scheduled_guid"), 80)
        if item.state.is_open or not item.vehicle or not guid or not self.capabilities.failure_text:
            return item
        try:
            return replace(item, message=self._message_of(guid) or item.message)
        except RobotError:  # of the robot's place, which is not the order's
            return item

    def open_items(self) -> list[QueueItem]:
        """Of this robot; for any robot those that no robot has yet, and those that were asked for by number."""
        found = self._connection.shared(self, "open", self._queue.open_items)
        self._followed.intersection_update(item.id for item in found)
        if self._is_any:
            return [item for item in found if not item.vehicle or item.id in self._followed]
        return [item for item in found if item.vehicle == self.vehicle]

    def items_after(
        self,
        id_floor: int,
        known: dict[int, QueueItem | None] | None = None,
        highest: int = 0,
        tokens: Collection[str] = (),
    ) -> list[QueueItem]:
        """Those with these ``tokens`` whatever their number: a fleet that restarts may have given lower ones again."""
        found = self._queue.items_after(id_floor, known, highest)
        missing = set(tokens) - {item.description for item in found}
        if missing and self._profile.token_field:
            found = [*self._queue.described(missing), *found]
        may_be_its = ("", self.vehicle)  # an order that waits may show no robot yet, though it has one
        return [item for item in found if self._is_any or item.vehicle in may_be_its or item.description in tokens]

    def highest_queue_id(self) -> int | None:
        """Of all orders of the fleet. One of a moment ago is lower, and safe to search from."""
        return self._connection.shared(self, "highest", self._queue.highest_id)

    def newest_id(self, token: str = "") -> int | None:
        """Where the fleet has no search, of the newest orders of all its robots. None too where it doesn't sort."""
        filters = [{"fieldname": "robot_id", "operator": "=", "value": self.vehicle}]
        try:
            found = self._entries("POST", f"{ORDERS}/search", {**NEWEST, "limit": "2"}, {"filters": filters})
        except Refusal as error:
            if error.status not in UNSUPPORTED:
                raise
            found = self._connection.shared(self, "newest", lambda: self._entries("GET", ORDERS, NEWEST, None))
        numbers = [parse.queue_id(entry) for entry in found]
        if numbers != sorted(numbers, reverse=True):
            return None
        return next((entry["id"] for entry in found if entry["vehicle"] == self.vehicle), None)

    def cancel(self, queue_id: int, token: str = "") -> None:
        self.pace.wait(None)
        self._verify(is_for_order=False)
        self._check_order(queue_id, token)
        try:
            self._send("DELETE", f"{ORDERS}/{queue_id}")
        finally:
            self._connection.forget("open")

    def _check_order(self, queue_id: int, token: str) -> None:
        """A fleet that has begun its numbers again may have another's order under this one. Raises Rejected then. One that
        can't be read is cancelled: it was listed with the app's token, and must not run."""
        try:
            answer = self._send("GET", f"{ORDERS}/{queue_id}")
            item = parse.queue_item(self._in_mir_words(self._read(answer, parse_order)))
        except (RobotFault, Unreadable):
            return
        except RobotError as error:
            raise error.unsent() from None
        is_ours = item.description == token
        if not (token and item.has_token):  # by who made it
            is_ours = not self._user_name or item.created_by_name in ("", self._user_name)
        if not is_ours:
            reason = message("the fleet has no such order")
            raise Rejected(status=404, reason=reason, address=self.address.netloc)

    # ------------------------------------------------------------------ the robot
    def set_state(self, state: RobotState) -> RobotStatus | None:
        with self._own_api() as robot:
            return robot.set_state(state)

    def clear_error(self) -> RobotStatus | None:
        with self._own_api() as robot:
            return robot.clear_error()

    def answer_prompt(self, guid: str, answer: str) -> RobotStatus | None:
        self._change("PUT", f"/prompt/{guid}", {"answer": answer})
        return None

    def _own_api(self) -> closing[RobotClient]:
        """The robot's own API, for what the fleet can't do: at its address in the fleet, with the same credentials.
        Raises Rejected where that can't be known for the robot's."""
        vehicle, _fleet = self._vehicle(VERIFIED_FOR)
        serial_number = self.serial_number or parse.text_or_none(vehicle.get("serial_number"))
        try:
            address = Address.parse(f"{self.address.scheme}://{clean(vehicle.get('ip'), 80)}")
        except InvalidAddress:
            serial_number = None
        if not serial_number:  # credentials go to the known machine only
            reason = message("the fleet can't do that, and doesn't say where the robot itself is")
            raise Rejected(status=404, reason=reason, address=self.address.netloc)
        robot = RobotClient(
            address, self._token, serial_number=serial_number, clock=self._clock, transport=self._reach(address)
        )
        robot.timeouts = OF_ITS_OWN
        return closing(robot)

    def _reaches_robot(self) -> bool:
        """Whether it answers, and accepts the fleet's user."""
        try:
            with self._own_api() as robot:
                robot.identify()
        except RobotError:
            return False
        return True

    def _message_of(self, guid: str) -> str:
        """What the robot says about the fleet's order with this guid. Raises RobotError."""
        with self._own_api() as robot:
            answer = robot.ask("GET", robot.queue_path, query={**NEWEST, "limit": str(SEARCHED)})
        items = parse.objects(parse.loads(answer.body), message("the mission queue"))
        found = (item.get("message") for item in items if item.get("fleet_schedule_guid") == guid)
        return resolve(next(found, ""))

    # ------------------------------------------------------------------ requests
    def _next_item(self, queue_id: int) -> QueueItem:
        self.on_pause()
        return parse.queue_item(self._in_mir_words(self._get(f"{ORDERS}/{queue_id}", parse_order)))

    def _in_mir_words(self, item: Any) -> Any:
        names = self._connection.notes.names
        return super()._in_mir_words(fleet_vocabulary.order_in_robot_words(item, self._user, self._user_name, names))


def parse_order(found: Any) -> parse.Object:
    return parse.object_(found, message("the queue item"))
