"""Sockets that know their deadline. urllib3's time-outs hold for each read, so a robot that sends a byte per second would never time out.

``Exchange`` is the request on its way: when it has to be over, and what has happened to it. The sockets tell it what they do, so that a failure is
judged by facts ("no byte was sent") and not by guessing from the type of an exception.
"""
from __future__ import annotations

import errno
import hashlib
import ipaddress
import queue
import socket
import ssl
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import requests
import urllib3
from requests.adapters import HTTPAdapter
from requests.certs import where as certifi_where
from urllib3.connection import HTTPConnection, HTTPSConnection

from app.services.mir.address import Address
from app.services.mir.credentials import normalise_fingerprint
from app.services.mir.errors import CertificateMismatch, CertificateProblem, Unreachable

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer, WriteableBuffer

AddressInfo = tuple[socket.AddressFamily, socket.SocketKind, int, str, Any]
Lookup = Callable[[str, int, int, socket.SocketKind], list[AddressInfo]]


class Resolver:
    """Looks names up with a deadline, which ``getaddrinfo`` itself doesn't have: in a thread that is left behind when it takes too long.

    At most one such thread at a time; a later call waits for the same one. An IP address needs none.
    """

    def __init__(self, getaddrinfo: Lookup | None = None) -> None:
        self._getaddrinfo: Lookup = getaddrinfo or socket.getaddrinfo
        self._running: threading.Thread | None = None

    def resolve(self, host: str, port: int, seconds: float) -> list[AddressInfo]:
        """Raises TimeoutError when it takes longer, OSError (gaierror) when there is no such name."""
        if _is_ip(host):
            return self._getaddrinfo(host, port, 0, socket.SOCK_STREAM)
        ends = time.monotonic() + seconds
        if self._running is not None:
            self._running.join(max(0.0, seconds))
            if self._running.is_alive():
                raise TimeoutError(host)
        answers: queue.SimpleQueue[list[AddressInfo] | OSError | UnicodeError] = queue.SimpleQueue()
        self._running = threading.Thread(target=self._look_up, args=(host, port, answers), name=f"lookup {host}", daemon=True)
        self._running.start()
        try:
            answer = answers.get(timeout=max(0.001, ends - time.monotonic()))
        except queue.Empty:
            raise TimeoutError(host) from None
        self._running = None
        if isinstance(answer, Exception):
            raise answer
        return answer

    def _look_up(self, host: str, port: int, answers: queue.SimpleQueue[list[AddressInfo] | OSError | UnicodeError]) -> None:
        try:
            answers.put(self._getaddrinfo(host, port, 0, socket.SOCK_STREAM))
        except (OSError, UnicodeError) as error:
            answers.put(error)


def _is_ip(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


class Exchange:
    """One request of one transport at a time. All instants are of ``time.monotonic``."""

    def __init__(self, address: Address, resolver: Resolver, longest_answer: int) -> None:
        self.address, self.resolver, self._longest_answer = address, resolver, longest_answer
        self.begin(0.0, 0.0, 0.0)

    def begin(self, connect: float, read: float, total: float) -> None:
        """A new request; its seconds count from now."""
        self._connect, self._read, self._ends = connect, read, time.monotonic() + total
        self.begin_again()

    def begin_again(self) -> None:
        """The same request on another connection, within the same deadline."""
        self.is_connecting = self.is_sent = self.is_stalled = self.is_too_long = False
        self.received = 0

    @property
    def is_over(self) -> bool:
        return time.monotonic() >= self._ends

    @property
    def found_connection_dead(self) -> bool:
        """It went out on a kept-alive connection and nothing came back: the robot had closed it, which is no news about the robot."""
        return self.is_sent and not self.is_connecting and not self.is_stalled and self.received == 0

    def left(self) -> float:
        return max(0.0, self._ends - time.monotonic())

    def connect_ends(self) -> float:
        return min(time.monotonic() + self._connect, self._ends)

    def next_wait(self) -> float:
        """Seconds that the next operation on the socket may take. Raises TimeoutError when there are none left."""
        if (seconds := min(self._read, self.left())) <= 0:
            self.is_stalled = True
            raise TimeoutError("deadline")
        return seconds

    def has_received(self, count: int) -> None:
        self.received += count
        if self.received > self._longest_answer:
            self.is_too_long = True
            raise OSError("answer too long")


class _PlainSocket(socket.socket):
    """A socket that keeps to its exchange's deadline and reports to it."""
    exchange: Exchange | None = None

    def recv_into(self, buffer: WriteableBuffer, nbytes: int = 0, flags: int = 0) -> int:
        if self.exchange is None:
            return super().recv_into(buffer, nbytes, flags)
        self.settimeout(self.exchange.next_wait())
        try:
            count = super().recv_into(buffer, nbytes, flags)
        except TimeoutError:
            self.exchange.is_stalled = True
            raise
        self.exchange.has_received(count)
        return count

    def sendall(self, data: ReadableBuffer, flags: int = 0) -> None:
        if self.exchange is not None:
            self.exchange.is_sent = True
            self.settimeout(self.exchange.next_wait())
        super().sendall(data, flags)


class _TlsSocket(ssl.SSLSocket):
    """The same within TLS; the handshake happens before ``exchange`` is set."""
    exchange: Exchange | None = None

    def recv_into(self, buffer: WriteableBuffer, nbytes: int | None = None, flags: int = 0) -> int:
        if self.exchange is None:
            return super().recv_into(buffer, nbytes, flags)
        self.settimeout(self.exchange.next_wait())
        try:
            count = super().recv_into(buffer, nbytes, flags)
        except TimeoutError:
            self.exchange.is_stalled = True
            raise
        self.exchange.has_received(count)
        return count

    def sendall(self, data: ReadableBuffer, flags: int = 0) -> None:
        if self.exchange is not None:
            self.exchange.is_sent = True
            self.settimeout(self.exchange.next_wait())
        super().sendall(data, flags)


def dial(exchange: Exchange) -> socket.socket:
    """A connected socket to the robot; name look-up and all its addresses together keep to the time-outs. Raises Unreachable."""
    address = exchange.address
    exchange.is_connecting = True
    try:
        found = exchange.resolver.resolve(address.host, address.port, exchange.left())
    except TimeoutError:
        raise Unreachable(code="slow_name", address=address.netloc, host=address.host) from None
    except (OSError, UnicodeError):
        raise Unreachable(code="unknown_name", address=address.netloc, host=address.host) from None
    ends = exchange.connect_ends()
    problem: OSError = OSError("no address")
    for number, (family, kind, protocol, _, place) in enumerate(found):
        try:
            sock = _PlainSocket(family, kind, protocol)
        except OSError as error:
            problem = error
            continue
        try:
            sock.settimeout(max(0.001, (ends - time.monotonic()) / (len(found) - number)))
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sock.connect(place)
        except OSError as error:
            sock.close()
            problem = error
            continue
        sock.settimeout(max(0.001, ends - time.monotonic()))          # what is left is the TLS handshake's
        sock.exchange = exchange
        return sock
    raise Unreachable(code=_why_not(problem), address=address.netloc)


def _why_not(error: OSError) -> str:
    if isinstance(error, TimeoutError) or error.errno in (errno.EHOSTUNREACH, errno.EHOSTDOWN):
        return "no_answer"
    if isinstance(error, ConnectionRefusedError):
        return "refused"
    if error.errno in (errno.ENETUNREACH, errno.ENETDOWN, errno.EADDRNOTAVAIL):
        return "no_route"
    return "unreachable"


class _PlainConnection(HTTPConnection):
    def __init__(self, *args: Any, exchange: Exchange, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._exchange = exchange

    def _new_conn(self) -> socket.socket:
        return dial(self._exchange)


class _TlsConnection(HTTPSConnection):
    def __init__(self, *args: Any, exchange: Exchange, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._exchange = exchange

    def _new_conn(self) -> socket.socket:
        return dial(self._exchange)

    def connect(self) -> None:
        super().connect()
        if isinstance(self.sock, _TlsSocket):
            self.sock.exchange = self._exchange


class RobotAdapter(HTTPAdapter):
    """Connections of the kinds above, never retried by itself. With a pin, exactly that certificate is accepted, whoever signed it and
    whatever name or date is in it; without one, the system's and certifi's authorities decide."""

    def __init__(self, exchange: Exchange, certificate_sha256: str | None = None) -> None:
        self._exchange = exchange
        self._pin = normalise_fingerprint(certificate_sha256) if certificate_sha256 and exchange.address.is_secure else None
        super().__init__(pool_connections=1, pool_maxsize=1, max_retries=urllib3.Retry(0, read=False))

    def init_poolmanager(self, connections: int, maxsize: int, block: bool = False, **pool_kwargs: Any) -> None:
        if self._exchange.address.is_secure:
            pool_kwargs["ssl_context"] = _tls_context(pinned=self._pin is not None)
            if self._pin is not None:
                pool_kwargs.update(assert_fingerprint=self._pin, assert_hostname=False)
        super().init_poolmanager(connections, maxsize, block, **pool_kwargs)

    def build_connection_pool_key_attributes(self, request: requests.PreparedRequest, verify: Any,
                                             cert: Any = None) -> tuple[dict[str, Any], dict[str, Any]]:
        """requests ≥ 2.32 would put its own verification settings over those of our context."""
        host, pool_kwargs = super().build_connection_pool_key_attributes(request, verify, cert)
        if self._exchange.address.is_secure:
            pool_kwargs = {"cert_reqs": "CERT_NONE" if self._pin is not None else "CERT_REQUIRED"}
        return host, pool_kwargs

    def get_connection_with_tls_context(self, request: requests.PreparedRequest, verify: Any, proxies: Any = None,
                                        cert: Any = None) -> urllib3.HTTPConnectionPool:
        pool = super().get_connection_with_tls_context(request, verify, proxies, cert)
        kind = _TlsConnection if self._exchange.address.is_secure else _PlainConnection
        pool.ConnectionCls = partial(kind, exchange=self._exchange)  # type: ignore[assignment]  # called like a class, nothing else
        return pool

    def cert_verify(self, conn: Any, url: str, verify: Any, cert: Any) -> None:
        """Nothing: the context knows whom to trust, and loading the authorities anew for each connection costs 10 ms."""


def _tls_context(*, pinned: bool) -> ssl.SSLContext:
    if pinned:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE       # the pin is checked instead, before anything is sent
    else:
        context = ssl.create_default_context()
        context.load_verify_locations(certifi_where())
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.sslsocket_class = _TlsSocket
    return context


def certificate_problem(error: BaseException, address: str) -> CertificateProblem | None:
    """What is wrong with TLS, if that is what an exception from before the first byte says."""
    if not isinstance(error, requests.exceptions.SSLError):
        return None
    text = str(error)
    if "CERTIFICATE_VERIFY_FAILED" in text or "doesn't match" in text:
        return CertificateProblem(code="certificate_untrusted", address=address)
    if "ingerprint" in text:
        return CertificateMismatch(address=address)
    return CertificateProblem(address=address)


def presented_fingerprint(address: Address, *, connect: float = 3.0, total: float = 10.0, resolver: Resolver | None = None) -> str:
    """SHA-256 of the certificate that answers at an https address, as 64 hex digits, for a person to compare and pin. Sends no request.

    Raises Unreachable or CertificateProblem.
    """
    exchange = Exchange(address, resolver or Resolver(), longest_answer=0)
    exchange.begin(connect, total, total)
    with dial(exchange) as plain:
        try:
            with _tls_context(pinned=True).wrap_socket(plain, server_hostname=address.host) as secure:
                certificate = secure.getpeercert(binary_form=True)
        except (OSError, ValueError):
            certificate = None
    if not certificate:
        raise CertificateProblem(address=address.netloc)
    return hashlib.sha256(certificate).hexdigest()
