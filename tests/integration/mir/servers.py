"""Real sockets on loopback that misbehave as a test needs."""

from __future__ import annotations

import contextlib
import hashlib
import socket
import ssl
import struct
import threading
from collections.abc import Callable
from pathlib import Path

CERTIFICATES = Path(__file__).parent / "certificates"
FIELD, PLANT = "field_robot.pem", "plant_robot.pem"
HEAD = b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n"


class Conversation:
    """One accepted connection, on the server's side."""

    def __init__(self, server: Server, sock: socket.socket) -> None:
        self._server, self._sock, self._buffer = server, sock, b""

    def request(self) -> bytes | None:
        """The next whole request, None when the client has closed. The server remembers it."""
        while b"\r\n\r\n" not in self._buffer:
            if not self._more():
                return None
        head, _, rest = self._buffer.partition(b"\r\n\r\n")
        lengths = [
            int(line.partition(b":")[2]) for line in head.split(b"\r\n") if line.lower().startswith(b"content-length:")
        ]
        length = lengths[0] if lengths else 0
        while len(rest) < length:
            before = len(self._buffer)
            if not self._more():
                return None
            rest += self._buffer[before:]
        self._buffer = rest[length:]
        found = head + b"\r\n\r\n" + rest[:length]
        self._server.requests.append(found)
        return found

    def _more(self) -> bool:
        received = self._sock.recv(65536)
        self._buffer += received
        return bool(received)

    def send(self, data: bytes, then: Callable[[], None] | None = None) -> None:
        self._sock.sendall(data)
        if then is not None:
            then()

    def answer(self, body: bytes = b"{}", status: str = "200 OK", *extra: str) -> None:
        head = [f"HTTP/1.1 {status}", f"Content-Length: {len(body)}", "Content-Type: application/json", *extra]
        self.send("\r\n".join(head).encode() + b"\r\n\r\n" + body)

    def drip(self, data: bytes) -> None:
        """One byte every hundredth of a second, until the client has had enough."""
        for byte in data:
            self.send(bytes([byte]))
            if self._server.stopping.wait(0.01):
                return

    def hang(self) -> None:
        """Say nothing until the client goes away or the test is over."""
        self._sock.settimeout(0.05)
        while not self._server.stopping.is_set():
            try:
                if not self._sock.recv(65536):
                    return
            except TimeoutError:
                continue

    def reset(self) -> None:
        """Close with RST instead of FIN."""
        self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._sock.close()


class Server:
    """Runs ``behave`` for each connection in its own thread, and counts connections and requests."""

    def __init__(self, behave: Callable[[Conversation], None], tls: ssl.SSLContext | None = None) -> None:
        self.requests: list[bytes] = []
        self.connections = 0
        self.stopping = threading.Event()
        self._behave, self._tls = behave, tls
        self._sockets: list[socket.socket] = []
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=64)
        self.port: int = self._listener.getsockname()[1]
        self._threads = [threading.Thread(target=self._accept, daemon=True)]
        self._threads[0].start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                sock, _ = self._listener.accept()
                self.connections += 1
                thread = threading.Thread(target=self._serve, args=(sock,), daemon=True)
                self._threads.append(thread)
                self._sockets.append(sock)
                thread.start()

    def _serve(self, sock: socket.socket) -> None:
        with contextlib.suppress(OSError, ValueError):
            if self._tls is not None:
                sock = self._tls.wrap_socket(sock, server_side=True)
                self._sockets.append(sock)
            with sock:
                self._behave(Conversation(self, sock))

    def close(self) -> None:
        self.stopping.set()
        for sock in [self._listener, *self._sockets]:
            with contextlib.suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
            sock.close()
        for thread in self._threads:
            thread.join(5)


def tls_of(certificate: str) -> ssl.SSLContext:
    """A server with one of the certificates here."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(CERTIFICATES / certificate)
    return context


def pin_of(certificate: str) -> str:
    """Its SHA-256 fingerprint."""
    text = (CERTIFICATES / certificate).read_text()
    return hashlib.sha256(ssl.PEM_cert_to_DER_cert(text[text.index("-----BEGIN CERT") :])).hexdigest()


def closed_port() -> int:
    """A port of this machine where nothing listens."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
        return port
