"""Requests to one MiR robot that is known by its serial number: credentials go to that machine only.

The status is read without credentials and its serial number compared with the known one. Requests with credentials are
sent only if that was done in the last seconds; otherwise they do it first.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from app.domain.check_up import NOTHING_KNOWN, RobotProfile
from app.domain.message import message
from app.domain.robot import (
    IdentifiedBy,
    RobotStatus,
)
from app.mir import parse
from app.mir.address import Address
from app.mir.credentials import Token
from app.mir.errors import (
    AnotherRobot,
    Busy,
    ConnectionLost,
    NotAMir,
    Rejected,
    RobotError,
    RobotFault,
    SerialNumberHidden,
    Unauthorized,
    Unreadable,
)
from app.mir.http import HttpTransport
from app.mir.texts import clean, resolve
from app.mir.transport import OF_ALL, OF_READS, OF_STATUS, Pace, Response, Timeouts, Transport

LARGEST_OBJECT = 256 * 1024  # bytes of an answer about one thing: a status, a queue item, an error
VERIFIED_FOR = 10.0  # s for which credentials may be sent, while the connection that returned the serial number is open
VERIFIED_WITHOUT = 2.0  # the same if that connection was closed right after the answer

T = TypeVar("T")


class VerifiedRequests:
    """``clock`` is a monotonic clock in seconds; ``transport`` replaces HTTP in simulations.

    ``serial_number`` is the known one, None before the first contact. ``identified_by`` is how it was identified last:
    a robot that used to show its serial number without credentials gets none when it no longer does. ``pace`` is shared
    by all clients of the robot.
    """

    def __init__(
        self,
        address: Address,
        token: Token,
        *,
        certificate_sha256: str | None = None,
        serial_number: str | None = None,
        identified_by: IdentifiedBy | None = None,
        transport: Transport | None = None,
        clock: Callable[[], float] = time.monotonic,
        profile: RobotProfile | None = None,
        pace: Pace | None = None,
    ) -> None:
        self.address, self.serial_number, self.identified_by = address, serial_number, identified_by
        self.has_default_password = token.is_published_default
        self._verified_at, self._verified_over, self._verified_as = -math.inf, object(), serial_number
        self._has_answered = False  # as HTTP
        self._clock = clock
        self.timeouts = Timeouts()
        self._transport = transport or HttpTransport(address, token, certificate_sha256)
        self.on_pause: Callable[[], None] = lambda: None  # called between the many requests of a long read
        self._profile, self.pace = NOTHING_KNOWN, pace or Pace(clock)
        self.use_profile(profile)

    def close(self) -> None:
        """Close the connection; a later call opens a new one."""
        self._transport.close()

    def use_profile(self, profile: RobotProfile | None) -> None:
        """The check-up's profile of the robot in its present state; None: none."""
        profile = profile or NOTHING_KNOWN
        if profile != self._profile:
            self._profile, self.pace.rest = profile, profile.rest
            self.timeouts = Timeouts().at_least(profile.timeout_s)

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
                return _again_if_stale(lambda: self._send("GET", "/status", with_credentials=False)), True
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

    def _read(self, answer: Response, read: Callable[[Any], T], largest: int | None = LARGEST_OBJECT) -> T:
        """Parse a body of at most ``largest`` bytes, as parsing megabytes blocks every thread. Raises Unreadable or
        NotAMir, with the robot's address."""
        if largest is not None and len(answer.body) > largest:
            raise Unreadable(code="too_large", address=self.address.netloc, limit=largest >> 10)
        try:
            return read(parse.loads(answer.body))
        except Unreadable as error:
            if answer.body[:200].lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
                raise NotAMir(code="web_page", address=self.address.netloc) from None
            raise error.at(self.address.netloc) from None
        except RobotError as error:
            raise error.at(self.address.netloc) from None

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

        return _again_if_stale(send)

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

    def _send(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        json: Any = None,
        is_wanted: Callable[[], bool] | None = None,
        with_credentials: bool = True,
    ) -> Response:
        """The answer, if its status is one of success. Raises RobotError."""
        try:
            answer = self._transport.send(
                method,
                path,
                query=query,
                json=json,
                timeout=self.timeouts,
                is_wanted=is_wanted,
                with_credentials=with_credentials,
            )
        except RobotError as error:
            self._verified_at = -math.inf  # what answers next may be another machine
            if type(error) is ConnectionLost and not (self._has_answered or self.address.is_secure):
                error = ConnectionLost(code="lost_over_http")
            raise error.at(self.address.netloc) from None
        self._has_answered = True
        if 200 <= answer.status < 300:
            return answer
        raise self._problem_of(answer)

    def _problem_of(self, answer: Response) -> RobotError:
        status, address = answer.status, self.address.netloc
        if status < 200:
            return Unreadable(address=address, problem=message("status {status}", status=status))
        if status < 400:
            target = clean(answer.headers.get("Location", ""), 100) or "elsewhere"
            return NotAMir(code="redirected", address=address, target=target)
        if status in (401, 403):
            return Unauthorized(status=status, address=address)
        try:
            found = parse.loads(answer.body) if len(answer.body) <= LARGEST_OBJECT else None
        except Unreadable:
            found = None
        found = found if isinstance(found, dict) else {}
        kind = Rejected if status < 500 else Busy if status == 503 else RobotFault
        return kind(status=status, address=address, reason=resolve(found.get("error_human"), 300))


def _again_if_stale(ask: Callable[[], T]) -> T:
    """Read again on a new connection if the robot was just closing the open one."""
    try:
        return ask()
    except ConnectionLost as error:
        if not error.is_stale:
            raise
    return ask()
