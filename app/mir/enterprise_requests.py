"""Requests to Fleet Enterprise: who it is, its stored data, its active orders."""

from __future__ import annotations

from typing import NamedTuple

from app.domain.message import message
from app.domain.robot import (
    FleetIdentity,
    MapPosition,
    MissionActions,
    MissionInfo,
    MissionParameter,
    RobotMap,
)
from app.mir import enterprise_vocabulary as words
from app.mir import parse
from app.mir.api_v2 import LARGEST_MISSIONS, MOST_MISSIONS
from app.mir.errors import AnotherFleet, NotAMir, OldFleet, Rejected, Unreadable
from app.mir.fleet_target import KNOWN_FOR, NOT_FOUND, FleetTarget
from app.mir.rest import segment
from app.mir.texts import clean

LEAST, FIND_BY_ID = (
    (1, 4, 2),
    (1, 5),
)  # versions: before the first no order can be found, from the second on each by its id
MOST_REMEMBERED = 500  # orders whose messages are kept


class Version(NamedTuple):
    number: tuple[int, ...]
    text: str
    name: str  # of the fleet; the key is of no other, so that it may have none


class EnterpriseRequests(FleetTarget):
    """``fleet_identity``: the known fleet's name."""

    base = "/api/v1"

    def _apply_profile(self) -> None:
        super()._apply_profile()
        if self._profile.own_key is not None:
            self._connection.notes.own_keys.setdefault(self._token, self._profile.own_key)

    # ------------------------------------------------------------------ who it is
    def _check_fleet(self, within: float = KNOWN_FOR) -> Version:
        """Its version. Raises AnotherFleet, or OldFleet where the software is too old."""
        found = self._connection.shared(self, "version", self._ask_version, within)
        if found.number < LEAST:
            least = ".".join(map(str, LEAST))
            raise OldFleet(address=self.address.netloc, version=found.text or "?", least=least)
        if self.fleet_identity and found.name != self.fleet_identity:
            raise AnotherFleet(address=self.address.netloc, expected=self.fleet_identity, found=found.name)
        return found

    def _ask_version(self) -> Version:
        try:
            found = self._get("/system/version", lambda found: parse.object_(found, message("the fleet's version")))
        except Rejected as error:
            if error.status not in NOT_FOUND:
                raise
            raise NotAMir(code="no_interface", address=self.address.netloc, status=error.status) from None
        text = clean(found.get("version"), 40)
        numbers = [int(part) for part in text.split("-")[0].split(".") if part.isascii() and part.isdigit()]
        self._connection.notes.version = tuple(numbers)
        return Version(tuple(numbers), text, clean(found.get("fleet-name"), 80) or "?")

    @property
    def finds_by_id(self) -> bool:
        """Whether an order that has ended is found by its id. Raises RobotError."""
        return self._check_fleet().number >= FIND_BY_ID

    def identify_fleet(self) -> FleetIdentity:
        """Its name, its software, and its robots."""
        version = self._check_fleet(0.0)
        robots = self._get("/robots", lambda found: words.wrapped(found, "robots"), largest=LARGEST_MISSIONS)
        return FleetIdentity(version.name, version.text or None, tuple(map(words.vehicle, robots)))

    # ------------------------------------------------------------------ stored data
    def missions(self) -> list[MissionInfo]:
        """Raises Unreadable for more than MOST_MISSIONS."""
        rows = self._get("/site/mission", lambda found: words.wrapped(found, "missions"), largest=LARGEST_MISSIONS)
        if len(rows) > MOST_MISSIONS:
            raise Unreadable(problem=message("more than {n} entries", n=MOST_MISSIONS), address=self.address.netloc)
        return [found for row in rows if (found := words.mission(row)) is not None]

    def mission(self, guid: str) -> parse.Object:
        """Raises Rejected with status 404 when the fleet has no such mission."""
        return self._get(f"/site/mission/{segment(guid)}", lambda found: parse.object_(found, message("the mission")))

    def parameters(self, guid: str) -> list[MissionParameter] | None:
        arguments = parse.some_objects(self.mission(guid).get("arguments"))
        return [found for row in arguments if (found := words.parameter(row)) is not None]

    def actions(self, guid: str) -> MissionActions:
        """The fleet does not show them."""
        return MissionActions()

    def positions(self, map_id: str | None = None) -> list[MapPosition]:
        """Of all maps: the list has only names."""
        rows = self._get("/site/position", lambda found: words.wrapped(found, "positions"), largest=LARGEST_MISSIONS)
        return [MapPosition(guid, clean(row.get("name"), 255)) for row in rows if (guid := clean(row.get("id"), 80))]

    def position(self, guid: str) -> MapPosition:
        raise self._is_not_there()

    def map(self, map_id: str) -> RobotMap:
        raise self._is_not_there()

    def _is_not_there(self) -> Rejected:
        return Rejected(status=404, reason=message("the fleet doesn't show that"), address=self.address.netloc)

    # ------------------------------------------------------------------ what is the same for all of its robots
    def _active(self) -> list[parse.Object]:
        """Events of the orders that are scheduled or run, one of each."""
        return self._connection.shared(self, "active", self._ask_active)

    def _ask_active(self) -> list[parse.Object]:
        name = "serial-order-status-events"
        events = self._get(
            "/serial-order-status/snapshot", lambda found: words.wrapped(found, name), largest=LARGEST_MISSIONS
        )
        events = [event | {"serial-order-id": clean(event.get("serial-order-id"), 80).lower()} for event in events]
        said = self._connection.notes.said
        for event in events:
            if text := clean(event.get("message")):
                said[event["serial-order-id"]] = text
        for token in list(said)[:-MOST_REMEMBERED]:
            del said[token]
        return list(words.one_of_each_order(events).values())

    def _said(self, token: str) -> str:
        """The last message that this order's events have had."""
        return self._connection.notes.said.get(token, "")

    def _prompts(self) -> list[parse.Object]:
        return self._connection.shared(
            self,
            "prompts",
            lambda: self._get("/user-prompt-snapshot", lambda found: words.wrapped(found, "user-prompt-events")),
        )

    # ------------------------------------------------------------------ requests
    def _found(self, path: str) -> parse.Object | None:
        try:
            return self._get(path, lambda found: parse.object_(found, message("the order")))
        except Rejected as error:
            if error.status not in NOT_FOUND:
                raise
            return None
