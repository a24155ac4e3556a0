"""Sockets that know their deadline. A socket's own time-out holds for each read, so a robot that sends a byte per second would never
time out.

``Exchange`` is the request on its way: when it has to be over, and what has happened to it. The sockets tell it what they do, so that
a failure is judged by facts ("no byte was sent") and not by guessing from the type of an exception.
"""
from __future__ import annotations

import errno
import hashlib
import http.client
import ipaddress
import queue
import socket
import ssl
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import certifi

from app.mir.address import DEFAULT_PORTS, Address
from app.mir.credentials import normalise_fingerprint
from app.mir.errors import CertificateMismatch, CertificateProblem, Unreachable

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer, WriteableBuffer

AddressInfo = tuple[socket.AddressFamily, socket.SocketKind, int, str, Any]
Lookup = Callable[[str, int], Sequence[AddressInfo]]


def look_up(host: str, port: int) -> Sequence[AddressInfo]:
    return socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)


class Resolver:
    """Looks names up with a deadline, which ``getaddrinfo`` itself doesn't have: in a thread that is left behind when it takes too long.

    At most one such thread at a time; a later call waits for the same one. An IP address needs none.
    """

    def __init__(self, lookup: Lookup = look_up) -> None:
        self._lookup = lookup
        self._of_numbers: dict[tuple[str, int], Sequence[AddressInfo]] = {}      # they never change
        self._running: threading.Thread | None = None

    def resolve(self, host: str, port: int, seconds: float) -> Sequence[AddressInfo]:
        """Raises TimeoutError when it takes longer, OSError (gaierror) when there is no such name."""
        if found := self._of_numbers.get((host, port)):
            return found
        if _is_ip(host):
            return self._of_numbers.setdefault((host, port), self._lookup(host, port))
        ends = time.monotonic() + seconds
        if self._running is not None:
            self._running.join(max(0.0, seconds))
            if self._running.is_alive():
                raise TimeoutError(host)
        answers: queue.SimpleQueue[Sequence[AddressInfo] | OSError | UnicodeError] = queue.SimpleQueue()
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

    def _look_up(self, host: str, port: int, answers: queue.SimpleQueue[Sequence[AddressInfo] | OSError | UnicodeError]) -> None:
        try:
            answers.put(self._lookup(host, port))
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

    @contextmanager
    def watching(self, sock: socket.socket) -> Iterator[None]:
        """Around one operation of a socket: it may take as long as a read may, and no longer than the whole request may."""
        try:
            if (seconds := min(self._read, self.left())) <= 0:
                raise TimeoutError("deadline")
            sock.settimeout(seconds)
            yield
        except TimeoutError:
            self.is_stalled = True
            raise

    def has_received(self, count: int) -> None:
        self.received += count
        if self.received > self._longest_answer:
            self.is_too_long = True
            raise OSError("answer too long")


class _PlainSocket(socket.socket):
    """A socket that keeps to its exchange's deadline and reports to it."""
    exchange: Exchange

    def recv_into(self, buffer: WriteableBuffer, nbytes: int = 0, flags: int = 0) -> int:
        with self.exchange.watching(self):
            count = super().recv_into(buffer, nbytes, flags)
        self.exchange.has_received(count)
        return count

    def sendall(self, data: ReadableBuffer, flags: int = 0) -> None:
        self.exchange.is_sent = True
        with self.exchange.watching(self):
            super().sendall(data, flags)


class _TlsSocket(ssl.SSLSocket):
    """The same within TLS. ``exchange`` is set after the handshake, which doesn't come through here."""
    exchange: Exchange

    def recv_into(self, buffer: WriteableBuffer, nbytes: int | None = None, flags: int = 0) -> int:
        with self.exchange.watching(self):
            count = super().recv_into(buffer, nbytes, flags)
        self.exchange.has_received(count)
        return count

    def sendall(self, data: ReadableBuffer, flags: int = 0) -> None:
        self.exchange.is_sent = True
        with self.exchange.watching(self):
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
    problem = OSError("no address")
    for number, info in enumerate(found):
        try:
            sock = _connected(info, (ends - time.monotonic()) / (len(found) - number))
        except OSError as error:
            problem = error
        else:
            sock.settimeout(max(0.001, ends - time.monotonic()))          # what is left is the TLS handshake's
            sock.exchange = exchange
            return sock
    raise Unreachable(code=_why_not(problem), address=address.netloc)


def _connected(info: AddressInfo, seconds: float) -> _PlainSocket:
    family, kind, protocol, _, place = info
    sock = _PlainSocket(family, kind, protocol)
    try:
        sock.settimeout(max(0.001, seconds))
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.connect(place)
    except OSError:
        sock.close()
        raise
    return sock


def _why_not(error: OSError) -> str:
    if isinstance(error, TimeoutError) or error.errno in (errno.EHOSTUNREACH, errno.EHOSTDOWN):
        return "no_answer"
    if isinstance(error, ConnectionRefusedError):
        return "refused"
    if error.errno in (errno.ENETUNREACH, errno.ENETDOWN, errno.EADDRNOTAVAIL):
        return "no_route"
    return "unreachable"


class RobotConnection(http.client.HTTPConnection):
    """One connection of an exchange, plain or within TLS; nothing is tried twice.

    With a pin, exactly that certificate is accepted, whoever signed it and whatever name or date is in it; without one, the authorities
    known to the system and to certifi decide. Raises Unreachable or CertificateProblem before anything is sent.
    """

    def __init__(self, exchange: Exchange, tls: Tls | None) -> None:
        address = exchange.address
        self.default_port = DEFAULT_PORTS[address.scheme]         # which the Host header leaves out
        super().__init__(address.host, address.port)
        self._exchange, self._tls = exchange, tls
        self._held: list[bytes] | None = None        # what is not to go out yet

    def request(self, *args: Any, **options: Any) -> None:
        """Head and body in one piece: they leave with one call of the system, mostly in one packet."""
        self._held = []
        try:
            super().request(*args, **options)
            request = b"".join(self._held)
        finally:
            self._held = None
        super().send(request)

    def send(self, data: Any) -> None:
        if self._held is None:
            super().send(data)
        else:
            self._held.append(data)

    def connect(self) -> None:
        plain = dial(self._exchange)
        self.sock = plain if self._tls is None else self._tls.secured(plain, self._exchange)


class Tls:
    """How to speak HTTPS with one robot, and whom to trust. Made once: loading the authorities takes 10 ms."""

    def __init__(self, certificate_sha256: str | None = None) -> None:
        self._pin = normalise_fingerprint(certificate_sha256) if certificate_sha256 else None
        self._context = _tls_context(pinned=self._pin is not None)

    def secured(self, plain: socket.socket, exchange: Exchange) -> _TlsSocket:
        """Shake hands. Raises CertificateProblem, CertificateMismatch or Unreachable, with the socket closed."""
        address = exchange.address.netloc
        try:
            secure = self._context.wrap_socket(plain, server_hostname=exchange.address.host)
        except ssl.SSLCertVerificationError:
            raise CertificateProblem(code="certificate_untrusted", address=address) from None
        except TimeoutError:
            raise Unreachable(code="no_answer", address=address) from None
        except (ssl.SSLError, ValueError):
            raise CertificateProblem(address=address) from None
        except OSError:
            raise Unreachable(address=address) from None
        finally:
            plain.close()                # its descriptor belongs to the other now, or to nobody
        if self._pin is not None and _fingerprint(secure) != self._pin:
            secure.close()
            raise CertificateMismatch(address=address)
        assert isinstance(secure, _TlsSocket)
        secure.exchange = exchange
        return secure


def _fingerprint(secure: ssl.SSLSocket) -> str:
    return hashlib.sha256(secure.getpeercert(binary_form=True) or b"").hexdigest()


def _tls_context(*, pinned: bool) -> ssl.SSLContext:
    if pinned:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE       # the pin is checked instead, before anything is sent
    else:
        context = ssl.create_default_context()
        context.load_verify_locations(certifi.where())
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.sslsocket_class = _TlsSocket
    return context


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
