"""Connections below requests, for what it leaves open: how long an answer may take altogether, and whether a request has left.

What fails on a socket is raised as a RobotError here, which passes through urllib3 and requests as it is: Unreachable or
CertificateProblem before the first byte of the request, TimedOut or ConnectionLost from then on.
"""

from __future__ import annotations

import errno
import functools
import http.client
import socket
import ssl
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from typing import Any

from requests.utils import DEFAULT_CA_BUNDLE_PATH
from urllib3 import HTTPHeaderDict
from urllib3.connection import HTTPConnection, HTTPSConnection
from urllib3.exceptions import SSLError as FingerprintError
from urllib3.response import HTTPResponse
from urllib3.util.ssl_ import create_urllib3_context

from app.domain.message import message
from app.mir.address import is_ip
from app.mir.errors import (
    CertificateMismatch,
    CertificateProblem,
    ConnectionLost,
    NotWanted,
    TimedOut,
    Unreachable,
    Unreadable,
)
from app.mir.transport import Timeouts

LONGEST_BODY, MOST_PARTS = 8 << 20, 20_000  # with the head and the sizes of its parts
SMALLEST_READ = 256  # bytes as which a smaller one counts, so that there can't be millions of them
LONGEST_HEAD = (
    16 * 1024
)  # with interim answers and the begin of the body; what email.message takes for one grows with its square
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
    """As ``getaddrinfo``, but with a deadline, so in a thread for names: one for each, however often it is asked for meanwhile.

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
not_http = functools.partial(Unreadable, problem=message("it doesn't keep to HTTP"))


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
    place: Any = None  # where it was connected last, as ``resolve`` gives it: a name may mean another machine each time

    def begin(self, timeouts: Timeouts, is_wanted: Callable[[], bool] | None = None, only: Any = None) -> None:
        """A new request; its time counts from now. Connects again if the robot has hung up meanwhile: to the place ``only``, or wherever
        its name leads."""
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
        """Not with a rest of the last answer either, which may be decrypted already."""
        return super().is_connected and not self.sock.pending()


def tls_context(*, is_pinned: bool) -> ssl.SSLContext:
    """TLS 1.2 or later. Unless pinned, the authorities known to the system and to requests decide; loading them takes 10 ms."""
    context = create_urllib3_context(cert_reqs=ssl.CERT_NONE if is_pinned else ssl.CERT_REQUIRED)
    if not is_pinned:
        context.load_default_certs()
        context.load_verify_locations(DEFAULT_CA_BUNDLE_PATH)
    context.sslsocket_class = _TlsSocket
    return context
