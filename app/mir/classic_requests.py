"""Requests to a classic fleet (``/api/v2.0.0``): who it is, its robots, whether it gives orders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from app.domain.message import message
from app.domain.robot import FleetIdentity
from app.mir import fleet_vocabulary, parse
from app.mir.api_v2 import LARGEST_MISSIONS, ApiV2
from app.mir.errors import AnotherFleet, NotAMir, Rejected, Unreadable
from app.mir.fleet_target import KNOWN_FOR, FleetTarget
from app.mir.texts import clean
from app.mir.transport import OF_STATUS, Response

ORDERS = "/mission_scheduler"
FIELDS = "id,ip,name,active,serial_number,robot_model,fleet_state,fleet_state_text,status"
NORMAL = "normal"  # the fleet's state in which it gives orders to robots
BUILT_IN = "mirconst"  # guids that are the same on all fleets begin so


class Fleet(NamedTuple):
    """What one request says of all robots, by their ids."""

    vehicles: Mapping[str, parse.Object]
    answer: Response
    elapsed_s: float


class ClassicRequests(FleetTarget, ApiV2):
    queue_path = ORDERS
    _user = ""  # the app's own user there, by its guid

    # ------------------------------------------------------------------ who it is
    def identify_fleet(self) -> FleetIdentity:
        """The fleet, and its robots as it lists them. Its name, which tells it from others, is the guid of the app's
        own user there; None where that is one of the users that all fleets have."""
        found = (row if "name" in row else self._alone(number) for number, row in self._fleet(0.0).vehicles.items())
        vehicles = sorted((fleet_vocabulary.vehicle(row) for row in found), key=lambda each: int(each.id))
        return FleetIdentity(self._name_of_fleet(), None, tuple(vehicles))

    def _name_of_fleet(self, within: float = KNOWN_FOR) -> str | None:
        self._user, self._user_name = self._connection.shared(self, "user", self._ask_user, within)
        return None if not self._user or self._user.startswith(BUILT_IN) else self._user

    def _ask_user(self) -> tuple[str, str]:
        try:
            found = self._get("/users/me", lambda found: parse.single(found, message("the user")))
        except Rejected:
            if self.fleet_identity:  # the known one told it: it boots, perhaps, which is no proof of another fleet
                raise Unreadable(problem=message("{what} is no JSON object", what=message("the user"))) from None
            self._request("GET", ORDERS, query={"limit": "1"})  # needs credentials as well
            return "", ""
        return clean(found.get("guid"), 80), clean(found.get("name"), 80)

    def _check_fleet(self, within: float = KNOWN_FOR) -> None:
        found = self._name_of_fleet(within)
        if self.fleet_identity and found != self.fleet_identity:
            raise AnotherFleet(address=self.address.netloc, expected=self.fleet_identity, found=found or "?")

    # ------------------------------------------------------------------ its robots
    def _alone(self, number: str) -> parse.Object:
        return self._get(f"/robots/{number}", lambda found: parse.object_(found, message("the robot")))

    def _fleet(self, within: float) -> Fleet:
        return self._connection.shared(self, "robots", self._all_robots, within)

    def _all_robots(self) -> Fleet:
        began = self._clock()
        answer = self._request("GET", "/robots", query={"whitelist": FIELDS}, share=OF_STATUS)
        rows = self._read(answer, lambda found: parse.objects(found, message("the list of robots")), LARGEST_MISSIONS)
        by_id = {number: row for row in rows if (number := parse.text_or_none(row.get("id")))}
        self._connection.notes.names = {number: clean(row.get("name"), 80) for number, row in by_id.items()}
        return Fleet(by_id, answer, self._clock() - began)

    def _ask_mode(self) -> str:
        """The fleet's own state, if it gives no orders to robots in it; else ""."""
        try:
            found = self._get("/status", lambda found: parse.single(found, message("the fleet's state")))
        except Rejected:
            return ""
        if "state_id" in found or "battery_percentage" in found:
            raise NotAMir(code="not_a_fleet", address=self.address.netloc)
        mode = clean(found.get("state"), 80)
        return "" if mode.casefold() == NORMAL else mode
