"""How a request travels to a robot. ``Transport`` is the seam: over HTTP in real life, straight into a simulated robot in simulations.

The rules of the HTTP one come from what ``requests`` was measured to do with hostile answers: redirects are never followed (a POST
would silently become a GET), proxies and .netrc are ignored (.netrc overrides the Authorization header), the whole answer has a deadline
however slowly it drips, its decoded length has a limit, and whatever changes something gets a connection of its own (a kept-alive one
may just be closing).
"""
from __future__ import annotations

import http.client
import json as json_module
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any, Protocol
from urllib.parse import urlencode

import requests
import urllib3
from requests.structures import CaseInsensitiveDict

from app.services.mir.address import Address
from app.services.mir.connections import Exchange, Resolver, RobotAdapter, certificate_problem
from app.services.mir.credentials import Token
from app.services.mir.errors import ConnectionLost, RobotError, TimedOut, Unreachable, Unreadable

API = "/api/v2.0.0"
MIB = 1024 * 1024
LONGEST_BODY = 8 * MIB          # decoded


@dataclass(frozen=True)
class Timeouts:
    """Seconds: to connect, between two parts of an answer, and for everything together."""
    connect: float = 3.0
    read: float = 5.0
    total: float = 10.0


@dataclass(frozen=True)
class Response:
    """A complete answer. Header names are matched without regard to case."""
    status: int
    body: bytes = field(default=b"", repr=False)
    headers: Mapping[str, str] = field(default_factory=dict, repr=False)

    def header(self, name: str) -> str | None:
        wanted = name.lower()
        return next((value for key, value in self.headers.items() if key.lower() == wanted), None)


class Transport(Protocol):
    """Carries one request at a time. Used by one thread at a time."""

    def send(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None, timeout: Timeouts) -> Response:
        """Send and return the answer, whatever its status. ``path`` is below ``/api/v2.0.0``; ``json`` None means no body.

        Raises Unreachable when nothing was sent, TimedOut, ConnectionLost or Unreadable when something was.
        """

    def close(self) -> None:
        """Let go of connections. A later ``send`` opens new ones."""


class HttpTransport:
    """Over HTTP or HTTPS, with the adapters of ``requests``. Reads share a kept-alive connection; everything else gets a fresh one.

    Without its ``Session``: cookies, proxies, .netrc and redirects are what a session adds, none of them is wanted, and it takes a third
    of the time of a request.
    """

    def __init__(self, address: Address, token: Token, *, certificate_sha256: str | None = None, resolver: Resolver | None = None,
                 longest_body: int = LONGEST_BODY) -> None:
        self._address, self._token, self._longest_body = address, token, longest_body
        self._exchange = Exchange(address, resolver or Resolver(), longest_answer=longest_body + MIB)     # + headers, chunk sizes
        self._reading = RobotAdapter(self._exchange, certificate_sha256)
        self._changing = RobotAdapter(self._exchange, certificate_sha256)
        self._base = f"{requests.Request('GET', address.url).prepare().url}".rstrip("/") + API
        self._headers = {
            "Accept": "application/json", "Accept-Encoding": "identity", "Accept-Language": "en_US", "Content-Type": "application/json",
            "User-Agent": "AMR-Scheduler", "Connection": "keep-alive"}
        if token:
            self._headers["Authorization"] = token.header

    def send(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None, timeout: Timeouts) -> Response:
        url = f"{self._base}{path}" + (f"?{urlencode(query, safe=',')}" if query else "")
        self._exchange.begin(timeout.connect, timeout.read, timeout.total)
        if method == "GET":
            return self._get(url, timeout)
        body = None if json is None else json_module.dumps(json, allow_nan=False).encode("ascii")
        try:
            return self._once(self._changing, self._request(method, url, body), timeout)
        finally:
            self._changing.close()           # whatever the robot keeps alive, the next one is a new connection

    def close(self) -> None:
        self._reading.close()
        self._changing.close()

    def _request(self, method: str, url: str, body: bytes | None = None) -> requests.PreparedRequest:
        request = requests.PreparedRequest()
        request.method, request.url, request.body = method, url, body
        request.headers = CaseInsensitiveDict(self._headers)
        if method != "GET":
            request.headers.update({"Connection": "close", "Content-Length": str(len(body or b""))})
        return request

    def _get(self, url: str, timeout: Timeouts) -> Response:
        request = self._request("GET", url)
        try:
            return self._once(self._reading, request, timeout)
        except ConnectionLost:
            if not self._exchange.found_connection_dead:
                raise
            self._reading.close()
            self._exchange.begin_again()
            return self._once(self._reading, request, timeout)

    def _once(self, adapter: RobotAdapter, request: requests.PreparedRequest, timeout: Timeouts) -> Response:
        try:
            answer = adapter.send(request, stream=True, timeout=(timeout.connect, timeout.read), proxies={})
            with closing(answer):
                return Response(answer.status_code, self._read(answer), dict(answer.headers))
        except (requests.RequestException, urllib3.exceptions.HTTPError, http.client.HTTPException, OSError, ValueError) as error:
            # Not chained: the originals print whole requests and would only be noise in a log.
            raise self._translated(error, timeout) from None

    def _read(self, answer: requests.Response) -> bytes:
        body = bytearray()
        for chunk in answer.iter_content(65536):
            body += chunk
            if len(body) > self._longest_body:
                raise self._too_long()
        return bytes(body)

    def _too_long(self) -> Unreadable:
        return Unreadable(code="too_long", address=self._address.netloc, limit=self._longest_body // MIB)

    def _translated(self, error: Exception, timeout: Timeouts) -> RobotError:
        """What happened, from what the exchange saw of it; the exception's type counts only where no socket of ours was involved."""
        exchange, address = self._exchange, self._address.netloc
        if exchange.is_too_long:
            return self._too_long()
        if not exchange.is_sent and isinstance(error, requests.exceptions.ConnectTimeout):
            return Unreachable(code="no_answer", address=address)
        if exchange.is_connecting and not exchange.is_sent:
            code = "no_answer" if isinstance(error, requests.Timeout) else "unreachable"
            return certificate_problem(error, address) or Unreachable(code=code, address=address)
        if exchange.is_stalled and exchange.is_over:
            return TimedOut(code="too_slow", address=address, seconds=f"{timeout.total:g}")
        if exchange.is_stalled or isinstance(error, requests.Timeout):
            return TimedOut(address=address, seconds=f"{timeout.read:g}")
        if isinstance(error, requests.exceptions.ContentDecodingError) or any(_is_nonsense(cause) for cause in _causes(error)):
            return Unreadable(address=address, problem="it doesn't keep to HTTP")
        return ConnectionLost(address=address)


def _causes(error: BaseException) -> Iterator[BaseException]:
    """The exceptions that an exception of requests wraps, as arguments or causes."""
    seen: set[int] = set()
    todo: list[BaseException] = [error]
    while todo:
        current = todo.pop()
        if id(current) in seen:
            continue
        seen.add(id(current))
        yield current
        todo += [inner for inner in (current.__cause__, current.__context__, *current.args) if isinstance(inner, BaseException)]


def _is_nonsense(cause: BaseException) -> bool:
    """Whether the answer was no HTTP, rather than cut."""
    if isinstance(cause, http.client.RemoteDisconnected):
        return False
    return isinstance(cause, http.client.BadStatusLine | http.client.LineTooLong | http.client.UnknownProtocol
                      | urllib3.exceptions.InvalidChunkLength | urllib3.exceptions.InvalidHeader)
