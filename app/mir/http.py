"""Requests to a robot over HTTP, each with a deadline, and whether it was sent at all.

An adapter of requests on the app's own connections, without ``requests.Session``. A session can be made to keep every
promise of this module (no cookies, proxies, .netrc or redirects; the deadline; what was sent), but then a request costs
182–250 µs of processor time instead of 82, about 0.6 ms more on the 2.5 ms of a mission, where 333 missions a second
fill three quarters of a core. Where nothing is that busy, a session is the better choice.

A failure on a socket is raised as a RobotError, which passes unchanged through urllib3 and requests: Unreachable or
CertificateProblem before the first byte of the request, TimedOut or ConnectionLost from then on.
"""

from __future__ import annotations

import errno
import functools
import hashlib
import http.client
import itertools
import json as json_module
import socket
import ssl
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import closing
from http.client import HTTPException
from typing import Any, cast
from urllib.parse import urlencode

import requests
from requests.utils import DEFAULT_CA_BUNDLE_PATH
from urllib3 import HTTPHeaderDict
from urllib3.connection import HTTPConnection, HTTPSConnection
from urllib3.exceptions import HTTPError
from urllib3.exceptions import SSLError as FingerprintError
from urllib3.response import HTTPResponse
from urllib3.util.ssl_ import create_urllib3_context

from app.domain.message import message
from app.mir.address import Address, is_ip
from app.mir.credentials import Token, normalise_fingerprint
from app.mir.errors import (
    CertificateMismatch,
    CertificateProblem,
    ConnectionLost,
    NotWanted,
    TimedOut,
    Unreachable,
    Unreadable,
)
from app.mir.transport import API, Response, Timeouts

LONGEST_BODY, MOST_PARTS = 8 << 20, 20_000  # with the head and the sizes of its parts
SMALLEST_READ = 256  # least bytes counted for one, so that there can't be millions of them
LONGEST_HEAD = (
    16 * 1024
)  # with interim answers and the begin of the body; what email.message takes for one grows with its square
NOT_HTTP = (OSError, HTTPException, HTTPError, ValueError, TypeError)  # the last for contradicting parameters
_CODES = {
    errno.ECONNREFUSED: "refused",
    errno.ETIMEDOUT: "no_answer",
    errno.EHOSTUNREACH: "no_answer",
    errno.EHOSTDOWN: "no_answer",
    errno.ENETUNREACH: "no_route",
    errno.ENETDOWN: "no_route",
    errno.EADDRNOTAVAIL: "no_route",
}
_of_numbers = functools.lru_cache(1024)(socket.getaddrinfo)  # an IP address never means another one
_lookups: dict[tuple[str, int], Future[list[Any]]] = {}  # the last one of each name


def resolve(host: str, port: int, seconds: float) -> list[Any]:
    """As ``getaddrinfo``, but with a deadline, so names are looked up in one thread each, shared by all who ask.

    Raises TimeoutError when it takes longer, OSError or UnicodeError when there is no such name.
    """

    def look_up(found: Future[list[Any]]) -> None:
        try:
            found.set_result(socket.getaddrinfo(host, port, type=socket.SOCK_STREAM))
        except Exception as error:
            found.set_exception(error)

    if is_ip(host):
        return _of_numbers(host, port, type=socket.SOCK_STREAM)
    lookup = _lookups.get((host, port))
    if lookup is None or lookup.done():
        lookup = Future()
        threading.Thread(target=look_up, args=(lookup,), name=f"lookup {host}", daemon=True).start()
        _lookups[host, port] = lookup
    return lookup.result(seconds)


too_long = functools.partial(Unreadable, code="too_long", limit=LONGEST_BODY >> 20)
not_http = functools.partial(Unreadable, problem=message("it doesn't follow HTTP"))


class _Socket(socket.socket):
    """Keeps to the deadline of its connection."""

    connection: RobotConnection

    def sendall(self, data: Any, flags: int = 0) -> None:
        self._run(super().sendall, data)

    def recv_into(self, *args: Any) -> int:
        connection = self.connection
        count: int = self._run(super().recv_into, *args)
        connection.received, connection.is_at_end = (
            connection.received + (count and max(count, SMALLEST_READ)),
            count == 0,
        )
        if connection.received > connection.limit:
            raise connection.excess()
        return count

    def _run(self, operation: Callable[..., Any], *args: Any) -> Any:
        left, timeouts = self.connection.ends - time.monotonic(), self.connection.timeouts
        try:
            if left <= 0:
                raise TimeoutError
            self.settimeout(min(timeouts.read, left))
            return operation(*args)
        except TimeoutError:
            raise (
                TimedOut(seconds=timeouts.read)
                if timeouts.read < left
                else TimedOut(code="too_slow", seconds=timeouts.total)
            ) from None
        except OSError:
            raise ConnectionLost() from None


class _TlsSocket(_Socket, ssl.SSLSocket):
    """The same within TLS."""


class RobotConnection(HTTPConnection):
    """Carries one request at a time; takes the place of a pool of connections in an adapter of requests."""

    sock: Any
    place: Any = None  # its last address from ``resolve``: a name may resolve to another machine each time

    def begin(self, timeouts: Timeouts, is_wanted: Callable[[], bool] | None = None, only: Any = None) -> None:
        """A new request; its time counts from now. Connects again if the robot has hung up since: to the address
        ``only``, or to any address of its name."""
        self._is_wanted, self.timeouts, self.ends, self._only = (
            is_wanted,
            timeouts,
            time.monotonic() + timeouts.total,
            only,
        )
        self.received, self.is_at_end, self.is_new, self.will_close = 0, False, False, False
        if not self.is_connected:
            self.close()

    def urlopen(
        self, *, method: str, url: str, body: bytes | None, headers: Mapping[str, str], **_: Any
    ) -> HTTPResponse:
        """Without redirects and retries. The request leaves in one piece."""
        if self.sock is None:
            self.connect()
        if self._is_wanted is not None and not self._is_wanted():
            raise NotWanted()
        head = "".join(
            [f"{method} {url} HTTP/1.1\r\n", *(f"{name}: {value}\r\n" for name, value in headers.items()), "\r\n"]
        )
        self.sock.sendall(head.encode("ascii") + (body or b""))
        answer, self.limit, self.excess = http.client.HTTPResponse(self.sock, method=method), LONGEST_HEAD, not_http
        answer.begin()
        if not all(
            length.strip().isdecimal() and len(length) < 20 for length in answer.headers.get_all("Content-Length", [])
        ):
            raise not_http()  # -5 would be taken for none, +5, 5_0 and "5, 5" for a number
        self.limit, self.excess, self.will_close = LONGEST_BODY, too_long, answer.will_close
        return HTTPResponse(answer, HTTPHeaderDict(answer.getheaders()), answer.status, preload_content=False)

    def connect(self) -> None:
        """Raises Unreachable or CertificateProblem."""
        self.is_new = True
        try:
            super().connect()
        except ssl.SSLCertVerificationError:
            raise CertificateProblem(code="certificate_untrusted") from None
        except FingerprintError:
            raise CertificateMismatch() from None
        except TimeoutError:
            raise CertificateProblem(code="tls_silent") from None
        except (OSError, ValueError):
            raise CertificateProblem() from None
        self.sock.connection = self

    def _new_conn(self) -> socket.socket:
        """TCP, before TLS. The name's look-up and all of its addresses together keep to the time-outs."""
        try:
            found = [self._only] if self._only else resolve(self.host, self.port, self.ends - time.monotonic())
        except TimeoutError:
            raise Unreachable(code="slow_name", host=self.host) from None
        except (OSError, UnicodeError):
            raise Unreachable(code="unknown_name", host=self.host) from None
        ends, problem = min(time.monotonic() + self.timeouts.connect, self.ends), OSError()
        for number, one in enumerate(found):
            family, kind, protocol, _, place = one
            sock: _Socket | None = None
            try:
                sock = _Socket(family, kind, protocol)
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                sock.settimeout(max(0.001, (ends - time.monotonic()) / (len(found) - number)))
                sock.connect(place)
                sock.settimeout(max(0.001, ends - time.monotonic()))  # for the TLS handshake
                self.place = one
                return sock
            except OSError as error:
                problem = error
                if sock is not None:
                    sock.close()
        raise Unreachable(
            code="no_answer" if isinstance(problem, TimeoutError) else _CODES.get(problem.errno or 0, "unreachable")
        )


class TlsConnection(RobotConnection, HTTPSConnection):
    """Compares the certificate with ``assert_fingerprint`` after the handshake, before anything is sent."""

    @property
    def is_connected(self) -> bool:
        """Nor with a rest of the last answer, which may already be decrypted."""
        return super().is_connected and not self.sock.pending()


def tls_context(*, is_pinned: bool) -> ssl.SSLContext:
    """TLS 1.2 or later. Unless pinned, the authorities known to the system and to requests decide; loading them takes 10 ms."""
    context = create_urllib3_context(cert_reqs=ssl.CERT_NONE if is_pinned else ssl.CERT_REQUIRED)
    if not is_pinned:
        context.load_default_certs()
        context.load_verify_locations(DEFAULT_CA_BUNDLE_PATH)
    context.sslsocket_class = _TlsSocket
    return context


class _Adapter(requests.adapters.HTTPAdapter):
    """Of requests, on one connection of ours and without cookies."""

    connection: RobotConnection

    def get_connection_with_tls_context(self, *_: Any, **__: Any) -> Any:
        return self.connection

    def cert_verify(self, *_: Any) -> None:
        """Done by the connection."""

    def build_response(self, req: requests.PreparedRequest, resp: Any) -> requests.Response:
        response = requests.Response()
        response.request, response.raw, response.status_code, response.headers = req, resp, resp.status, resp.headers
        return response


class HttpTransport:
    """Reads keep their connection open; everything else gets a fresh one, as the robot may just be closing an open one."""

    def __init__(self, address: Address, token: Token, certificate_sha256: str | None = None, base: str = API) -> None:
        self._address, self._base, self._adapter = address, base, _Adapter()
        kind, tls = RobotConnection, dict[str, Any]()
        if address.is_secure:
            pin = normalise_fingerprint(certificate_sha256) if certificate_sha256 else None
            kind, tls = (
                TlsConnection,
                {"ssl_context": tls_context(is_pinned=pin is not None), "assert_fingerprint": pin},
            )
        self._reading, self._writing = kind(address.host, address.port, **tls), kind(address.host, address.port, **tls)
        self._headers = {
            "Host": address.netloc,
            "Accept": "application/json",
            "Accept-Encoding": "identity",
            "Accept-Language": "en_US",
            "Content-Type": "application/json",
            "User-Agent": "AMR-Scheduler",
        }
        self._credentials = token.headers

    def send(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        json: Any = None,
        timeout: Timeouts,
        is_wanted: Callable[[], bool] | None = None,
        with_credentials: bool = True,
    ) -> Response:
        request = self._prepared(method, path, query, json, with_credentials)
        self._adapter.connection = connection = self._reading if method == "GET" else self._writing
        # To the machine whose status was read last, even if its name resolves to another one now.
        connection.begin(timeout, is_wanted, self._reading.place if with_credentials else None)
        keeps = False
        try:
            answer = self._adapter.send(request, stream=True)
            # As they come: each chunk costs microseconds, and unpacking could take minutes; it was not to be packed.
            parts = list(itertools.islice(answer.raw.stream(1 << 16, decode_content=False), MOST_PARTS))
            if len(parts) == MOST_PARTS:
                raise too_long()
            # Error answers may be followed by unannounced bytes.
            keeps = method == "GET" and answer.status_code == 200 and not connection.will_close
            return Response(answer.status_code, b"".join(parts), answer.headers)
        except (ConnectionLost, *NOT_HTTP) as error:
            # Not chained: the originals carry the request with its token.
            if not (isinstance(error, ConnectionLost) or connection.is_at_end):
                raise not_http() from None
            lost = ConnectionLost()
            lost.is_stale = method == "GET" and not (connection.is_new or connection.received)
            raise lost from None
        finally:
            if not keeps:  # or the rest of the answer may be taken for that of the next request
                connection.close()

    def _prepared(
        self, method: str, path: str, query: Mapping[str, str] | None, json: Any, with_credentials: bool
    ) -> requests.PreparedRequest:
        request, headers = requests.PreparedRequest(), {"Connection": "keep-alive"}
        request.method, request.url = (
            method,
            f"{self._address.url}{self._base}{path}" + (f"?{urlencode(query, safe=',')}" if query else ""),
        )
        if method != "GET":
            body = b"" if json is None else json_module.dumps(json, allow_nan=False).encode("ascii")
            request.body, headers = body or None, {"Connection": "close", "Content-Length": str(len(body))}
        # Their names need no other case.
        request.headers = cast(Any, self._headers | (self._credentials if with_credentials else {}) | headers)
        return request

    def read_connection(self) -> object:
        return (sock := self._reading.sock) and self._reading.is_connected and sock

    def close(self) -> None:
        self._reading.close()


def presented_fingerprint(address: Address) -> str:
    """SHA-256 of the certificate at an https address, as 64 hex digits. Sends no request.

    Raises Unreachable or CertificateProblem.
    """
    with closing(TlsConnection(address.host, address.port, ssl_context=tls_context(is_pinned=True))) as connection:
        connection.begin(Timeouts())
        try:
            connection.connect()
        except Unreachable as error:
            raise error.at(address.netloc) from None
        return hashlib.sha256(connection.sock.getpeercert(binary_form=True)).hexdigest()
