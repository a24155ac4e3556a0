"""Requests to one REST API of MiR's at one address, and what its answers mean: an answer of success, or a RobotError."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, TypeVar
from urllib.parse import quote

from app.domain.check_up import NOTHING_KNOWN, RobotProfile
from app.domain.message import message
from app.mir import parse
from app.mir.address import Address
from app.mir.credentials import Token
from app.mir.errors import (
    Busy,
    ConnectionLost,
    Delivery,
    NotAMir,
    Rejected,
    RobotError,
    RobotFault,
    Unauthorized,
    Unreadable,
)
from app.mir.http import HttpTransport
from app.mir.texts import clean, resolve
from app.mir.transport import API, Pace, Response, Timeouts, Transport

LARGEST_OBJECT = 256 * 1024  # bytes of an answer about one thing: a status, a queue item, an error
REASONS = (
    "error_human",
    "detail",
    "title",
)  # fields of an error that say why: robots' and classic fleets', Enterprise's

T = TypeVar("T")


class RestRequests:
    """``clock`` is a monotonic clock in seconds; ``transport`` replaces HTTP in simulations. ``pace`` is shared by all
    clients of the machine."""

    base = API
    says_no_in_objects = False  # so that another refusal may be a box's on the way, of what was done

    def __init__(
        self,
        address: Address,
        token: Token,
        *,
        certificate_sha256: str | None = None,
        transport: Transport | None = None,
        clock: Callable[[], float] = time.monotonic,
        pace: Pace | None = None,
        profile: RobotProfile | None = None,
    ) -> None:
        self.address, self._clock, self.timeouts = address, clock, Timeouts()
        self.has_default_password = token.is_published_default
        self._has_answered = False  # as HTTP
        self._transport = transport or HttpTransport(address, token, certificate_sha256, self.base)
        self.on_pause: Callable[[], None] = lambda: None  # called between the many requests of a long read
        self.pace = pace or Pace(clock)
        self._profile = NOTHING_KNOWN
        self.use_profile(profile)

    def use_profile(self, profile: RobotProfile | None) -> None:
        """The check-up's profile of the robot in its present state; None: none."""
        profile = profile or NOTHING_KNOWN
        if profile != self._profile:
            self._profile = profile
            self._apply_profile()

    def _apply_profile(self) -> None:
        self.pace.rest = self._profile.rest
        self.timeouts = Timeouts().at_least(self._profile.timeout_s)

    def close(self) -> None:
        """Close the connection; a later call opens a new one."""
        self._transport.close()

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
            self._has_no_answer()
            if type(error) is ConnectionLost and not (self._has_answered or self.address.is_secure):
                error = ConnectionLost(code="lost_over_http")
            raise error.at(self.address.netloc) from None
        self._has_answered = True
        if 200 <= answer.status < 300:
            return answer
        raise self._problem_of(answer)

    def _has_no_answer(self) -> None:
        """What answers next may be another machine."""

    def _request(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None) -> Response:
        """With credentials, to the machine that is known, at its pace. Raises RobotError."""
        raise NotImplementedError

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
        reasons = [resolve(found.get(name), 300) for name in REASONS] if isinstance(found, dict) else []
        kind = Rejected if status < 500 else Busy if status == 503 else RobotFault
        problem = kind(status=status, address=address, reason=next(filter(None, reasons), ""))
        if self.says_no_in_objects and not isinstance(found, dict):
            problem.delivery = Delivery.UNKNOWN
        return problem

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

    def _get(
        self,
        path: str,
        read: Callable[[Any], T],
        query: Mapping[str, str] | None = None,
        *,
        largest: int | None = LARGEST_OBJECT,
    ) -> T:
        return self._read(self._request("GET", path, query=query), read, largest)


def segment(identifier: str) -> str:
    """One segment of a path."""
    return quote(identifier, safe="", errors="replace")


def again_if_stale(ask: Callable[[], T]) -> T:
    """Read again on a new connection if the robot was just closing the open one."""
    try:
        return ask()
    except ConnectionLost as error:
        if not error.is_stale:
            raise
    return ask()
