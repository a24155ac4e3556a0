"""How a request travels to a robot. ``Transport`` is the seam: over HTTP in real life, straight into a simulated robot in simulations.

The rules of the HTTP one come from what clients were measured to do with hostile answers: redirects are never followed (a POST
would silently become a GET), proxies and .netrc are ignored (.netrc overrides the Authorization header), the whole answer has a deadline
however slowly it drips, its unpacked length has a limit, and whatever changes something gets a connection of its own (a kept-alive one
may just be closing).
"""
from __future__ import annotations

import http.client
import json as json_module
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any, Protocol
from urllib.parse import urlencode

from app.domain.message import message
from app.mir.address import Address
from app.mir.connections import Exchange, Resolver, RobotConnection, Tls
from app.mir.credentials import Token
from app.mir.errors import ConnectionLost, RobotError, TimedOut, Unreadable

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
    """Over HTTP or HTTPS. Reads share a kept-alive connection; everything else gets a fresh one.

    On the standard library's ``http.client``: of what a session of ``requests`` adds – cookies, proxies, .netrc, redirects, retries –
    nothing is wanted here, and it takes half of the processor time that sending a mission costs.
    """

    def __init__(self, address: Address, token: Token, *, certificate_sha256: str | None = None, resolver: Resolver | None = None,
                 longest_body: int = LONGEST_BODY) -> None:
        self._address, self._token, self._longest_body = address, token, longest_body
        self._exchange = Exchange(address, resolver or Resolver(), longest_answer=longest_body + MIB)     # + headers, chunk sizes
        self._tls = Tls(certificate_sha256) if address.is_secure else None
        self._reading = RobotConnection(self._exchange, self._tls)
        self._headers = {
            "Accept": "application/json", "Accept-Encoding": "identity", "Accept-Language": "en_US", "Content-Type": "application/json",
            "User-Agent": "AMR-Scheduler"}
        if token:
            self._headers["Authorization"] = token.header

    def send(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None, timeout: Timeouts) -> Response:
        target = API + path + (f"?{urlencode(query, safe=',')}" if query else "")
        self._exchange.begin(timeout.connect, timeout.read, timeout.total)
        if method == "GET":
            return self._get(target, timeout)
        body = b"" if json is None else json_module.dumps(json, allow_nan=False).encode("ascii")
        headers = {**self._headers, "Connection": "close", "Content-Length": str(len(body))}
        with closing(RobotConnection(self._exchange, self._tls)) as connection:
            return self._once(connection, method, target, headers, timeout, body)

    def close(self) -> None:
        self._reading.close()

    def _get(self, target: str, timeout: Timeouts) -> Response:
        headers = {**self._headers, "Connection": "keep-alive"}
        try:
            return self._once(self._reading, "GET", target, headers, timeout)
        except ConnectionLost:
            if not self._exchange.found_connection_dead:
                raise
            self._exchange.begin_again()
            return self._once(self._reading, "GET", target, headers, timeout)

    def _once(self, connection: RobotConnection, method: str, target: str, headers: Mapping[str, str], timeout: Timeouts,
              body: bytes | None = None) -> Response:
        try:
            connection.request(method, target, body, headers)
            with connection.getresponse() as answer:
                return Response(answer.status, self._read(answer), dict(answer.getheaders()))
        except (http.client.HTTPException, OSError, ValueError, zlib.error) as error:
            connection.close()
            # Not chained: the originals print whole requests and would only be noise in a log.
            raise self._translated(error, timeout) from None
        except BaseException:
            connection.close()               # what is left of the answer must not be taken for that of the next request
            raise

    def _read(self, answer: http.client.HTTPResponse) -> bytes:
        """The whole body. Raises Unreadable when it is too long, IncompleteRead when it ends early."""
        unpack = _unpacking(answer.getheader("Content-Encoding"))
        body = bytearray()
        while part := answer.read(65536):
            for piece in unpack(part):
                body += piece
                if len(body) > self._longest_body:
                    raise self._too_long()
        if answer.length:                    # http.client leaves that to those who read in parts
            raise http.client.IncompleteRead(bytes(body), answer.length)
        return bytes(body)

    def _too_long(self) -> Unreadable:
        return Unreadable(code="too_long", address=self._address.netloc, limit=self._longest_body // MIB)

    def _translated(self, error: Exception, timeout: Timeouts) -> RobotError:
        """What happened after the connection was made, from what the exchange saw of it."""
        exchange, address = self._exchange, self._address.netloc
        if exchange.is_too_long:
            return self._too_long()
        if exchange.is_stalled and exchange.is_over:
            return TimedOut(code="too_slow", address=address, seconds=timeout.total)
        if exchange.is_stalled:
            return TimedOut(address=address, seconds=timeout.read)
        if isinstance(error, OSError | http.client.IncompleteRead):          # RemoteDisconnected is one of the former
            return ConnectionLost(address=address)
        return Unreadable(address=address, problem=message("it doesn't keep to HTTP"))


def _unpacking(encoding: str | None) -> Callable[[bytes], Iterator[bytes]]:
    """Nothing packed was asked for; a proxy in between may do it all the same. Pieces stay small, however much is packed into a part.

    Raises ValueError for another encoding than gzip.
    """
    match (encoding or "identity").strip().lower():
        case "identity":
            return lambda part: iter((part,))
        case "gzip" | "x-gzip":
            unpacker = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
        case other:
            raise ValueError(f"content encoding {other!r}")

    def unpack(part: bytes) -> Iterator[bytes]:
        while part:
            yield unpacker.decompress(part, 65536)
            part = unpacker.unconsumed_tail
    return unpack
