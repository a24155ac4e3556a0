"""A robot of a fleet, or whichever robot that fleet chooses: what both kinds of fleets have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.domain.models import ANY_VEHICLE
from app.domain.robot import IdentifiedBy, Identity, RobotStatus
from app.mir import parse
from app.mir.address import Address
from app.mir.credentials import Token
from app.mir.errors import Rejected, RobotError, VehicleUnavailable
from app.mir.fleet_connection import FleetConnection
from app.mir.rest import RestRequests, again_if_stale
from app.mir.target import Target
from app.mir.transport import OF_READS, Response

KNOWN_FOR = 10.0  # s for which it is known which fleet this is
VERIFIED_FOR = 2.0  # s for which a reading shows that it is the known fleet and robot
NOT_FOUND = (404, 410)


class FleetTarget(RestRequests, Target):
    """``vehicle``: the robot's id at the fleet, or ANY_VEHICLE. ``serial_number``: the known one of that robot.
    ``fleet_identity``: as ``identify_fleet`` found it, None before."""

    says_no_in_objects = True
    _user_name = ""  # of the app's own user there, where the fleet says it

    def __init__(
        self,
        address: Address,
        token: Token,
        vehicle: str,
        *,
        connection: FleetConnection,
        serial_number: str | None = None,
        identified_by: IdentifiedBy | None = None,
        fleet_identity: str | None = None,
        **options: Any,
    ) -> None:
        self.vehicle, self.serial_number, self.identified_by = vehicle, serial_number, identified_by
        self.fleet_identity, self._connection, self._token = fleet_identity, connection, token
        self._is_any = vehicle == ANY_VEHICLE
        super().__init__(address, token, clock=connection.clock, pace=connection.pace, **options)

    # ------------------------------------------------------------------ who it is
    def status(self) -> RobotStatus:
        """As the fleet has said within the last second. Raises AnotherRobot, AnotherFleet, or VehicleUnavailable where
        the fleet has no contact with the robot."""
        return self._status(1.0)

    def identify(self) -> Identity:
        """Status and user, to detect wrong credentials (Unauthorized)."""
        status = self.status()
        self.identified_by = IdentifiedBy.CERTIFICATE if self.address.is_secure else IdentifiedBy.ADDRESS
        return Identity(status, self._user_name, status.software, self.identified_by)

    def _status(self, within: float, *, is_for_order: bool = False) -> RobotStatus:
        raise NotImplementedError

    def _check_fleet(self, within: float = KNOWN_FOR) -> object:
        """Raises AnotherFleet."""
        raise NotImplementedError

    def _verify(self, *, is_for_order: bool = True) -> None:
        """Whether the known fleet and robot are there, before anything is changed; for an order also whether the fleet
        reaches the robot, and shows its orders."""
        try:
            self._check_fleet(VERIFIED_FOR)
            self._status(VERIFIED_FOR, is_for_order=is_for_order)
        except VehicleUnavailable:
            if is_for_order:
                raise
        except RobotError as error:
            raise error.unsent() from None

    # ------------------------------------------------------------------ orders
    def clear_queue(self, own: Mapping[int, str] | None = None) -> None:
        for queue_id, token in (own or {}).items():
            try:
                self.cancel(queue_id, token)
            except Rejected as error:
                if error.status not in (400, *NOT_FOUND):  # it has ended
                    raise

    # ------------------------------------------------------------------ requests
    def _change(self, method: str, path: str, body: Any = None) -> None:
        """What a person orders, which does not wait for its turn."""
        self.pace.wait(None)
        self._verify(is_for_order=False)
        self._send(method, path, json=body)

    def _request(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        json: Any = None,
        share: float = OF_READS,
    ) -> Response:
        def send() -> Response:
            self.pace.wait(share, self.on_pause)
            return self._send(method, path, query=query, json=json)

        answer = again_if_stale(send)
        self._connection.notes.time = parse.http_date(answer.headers.get("Date", ""))
        return answer

    def ask(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None) -> Response:
        """Any request to the known fleet, for a check-up: an answer of success as it came. Raises RobotError."""
        self._check_fleet()
        return self._send(method, path, query=query, json=json)
