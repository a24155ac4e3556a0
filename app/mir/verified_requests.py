"""Requests to one MiR robot that is known by its serial number: credentials go to that machine only.

The status is read without credentials and its serial number compared with the known one. Requests with credentials are
sent only if that was done in the last seconds; otherwise they do it first.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from app.domain.robot import (
    IdentifiedBy,
    RobotStatus,
)
from app.mir import parse
from app.mir.address import Address
from app.mir.api_v2 import ApiV2
from app.mir.credentials import Token
from app.mir.errors import (
    AnotherRobot,
    NotAMir,
    Rejected,
    RobotError,
    SerialNumberHidden,
    Unauthorized,
)
from app.mir.rest import again_if_stale
from app.mir.texts import clean
from app.mir.transport import OF_ALL, OF_READS, OF_STATUS, Response

VERIFIED_FOR = 10.0  # s for which credentials may be sent, while the connection that returned the serial number is open
VERIFIED_WITHOUT = 2.0  # the same if that connection was closed right after the answer


class VerifiedRequests(ApiV2):
    """``serial_number`` is the known one, None before the first contact. ``identified_by`` is how it was identified
    last: a robot that used to show its serial number without credentials gets none when it no longer does."""

    def __init__(
        self,
        address: Address,
        token: Token,
        *,
        serial_number: str | None = None,
        identified_by: IdentifiedBy | None = None,
        **options: Any,
    ) -> None:
        super().__init__(address, token, **options)
        self.serial_number, self.identified_by = serial_number, identified_by
        self._verified_at, self._verified_over, self._verified_as = -math.inf, object(), serial_number

    def status(self) -> RobotStatus:
        """The robot's status, read without credentials; with them only if it needs them (401). Raises AnotherRobot if
        its serial number is not the known one, SerialNumberHidden if it no longer shows the one it always did, NotAMir
        if something else answers.
        """
        return self._ask_status(OF_STATUS)

    def _ask_status(self, share: float | None) -> RobotStatus:
        self.pace.wait(share)
        began, self._verified_at = self._clock(), -math.inf
        answer, is_open = self._answer_of_status()
        status = self._status(answer, self._clock() - began)
        self._check_serial_number(status)
        if not status.serial_number:
            self._check_may_be_hidden()
        shown = IdentifiedBy.SERIAL_NUMBER if is_open and status.serial_number else IdentifiedBy.ADDRESS
        self.identified_by = IdentifiedBy.CERTIFICATE if self.address.is_secure else shown
        self._verified_at, self._verified_over = self._clock(), self._transport.read_connection()
        self._verified_as = self.serial_number
        return status

    def _answer_of_status(self) -> tuple[Response, bool]:
        """And whether it is given without credentials."""
        try:
            try:
                return again_if_stale(lambda: self._send("GET", "/status", with_credentials=False)), True
            except Unauthorized:
                self._check_may_be_hidden()
                return self._send("GET", "/status"), False
        except Rejected as error:
            if error.status in (404, 405, 410):
                raise NotAMir(code="no_interface", address=self.address.netloc, status=error.status) from None
            raise

    def _check_serial_number(self, status: RobotStatus, problem: type[AnotherRobot] = AnotherRobot) -> None:
        expected, found = self.serial_number, status.serial_number
        if expected and found and found != expected:
            self._verified_at = -math.inf
            raise problem(address=self.address.netloc, expected=expected, found=found)

    def _is_verified(self) -> bool:
        """Whether credentials may be sent: the known serial number was shown a moment ago, or on a connection that has
        been open since."""
        connection = self._transport.read_connection()
        lasts = VERIFIED_FOR if connection and connection is self._verified_over else VERIFIED_WITHOUT
        is_recent = self._clock() - self._verified_at <= lasts
        return connection is not False and is_recent and self._verified_as == self.serial_number

    def _check_may_be_hidden(self) -> None:
        """Another machine in a robot's place could hide its serial number to get the credentials. A certificate can't
        be hidden."""
        if self.serial_number and not self.address.is_secure and self.identified_by not in (None, IdentifiedBy.ADDRESS):
            raise SerialNumberHidden(address=self.address.netloc, expected=self.serial_number)

    def _status(self, answer: Response, elapsed_s: float) -> RobotStatus:
        software, date = (
            clean(answer.headers.get("Robot-Version", ""), 40) or None,
            parse.http_date(answer.headers.get("Date", "")),
        )
        return self._read(answer, lambda found: parse.status(found, software=software, date=date, elapsed_s=elapsed_s))

    def _request(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        json: Any = None,
    ) -> Response:
        """With credentials, to the robot that is known. Raises RobotError."""

        def send() -> Response:
            if method == "GET" or path.endswith("/search"):
                self.pace.wait(OF_READS, self.on_pause)
            else:
                self.pace.wait(OF_ALL)
            self._verify(OF_STATUS)
            return self._send(method, path, query=query, json=json)

        return again_if_stale(send)

    def _order(self, method: str, path: str, json: Any = None) -> Response:
        """The same of what a person orders, which does not wait for its turn."""
        self.pace.wait(None)
        self._verify(None)
        return self._send(method, path, json=json)

    def _verify(self, share: float | None) -> None:
        if self.serial_number and not self._is_verified():
            try:
                self._ask_status(share)
            except RobotError as error:
                raise error.unsent() from None

    def _has_no_answer(self) -> None:
        self._verified_at = -math.inf
