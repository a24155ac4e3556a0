"""A machine on loopback that answers as the robot it pretends to be and records every request with its headers."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from email.message import Message
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from tests.integration.mir.servers import tls_of
from tests.unit.mir.answers import STATUS

API = "/api/v2.0.0"


@dataclass(frozen=True)
class Seen:
    """One request."""

    method: str
    path: str  # below the API, without the query
    headers: Message

    @property
    def authorization(self) -> str | None:
        return self.headers["Authorization"]


@dataclass
class Capture:
    """``status_is_open``: whether ``/status`` is answered without credentials; everything else never is. Requests for ``breaks_at`` get
    no answer: the connection ends. ``says_close``: every answer announces its end."""

    url: str
    serial: str | None = "A-1"
    status_is_open: bool = True
    breaks_at: str = ""
    status: Mapping[str, Any] = field(default_factory=dict)  # fields of the status that are added or replaced
    says_close: bool = False
    seen: list[Seen] = field(default_factory=list)
    sockets: list[socket.socket] = field(default_factory=list)

    @property
    def credentials(self) -> list[str]:
        """Every Authorization header that arrived."""
        return [one.authorization for one in self.seen if one.authorization is not None]

    def pretend(self, values: Mapping[str, Any]) -> None:
        """Be another machine from now on."""
        for name, value in values.items():
            setattr(self, name, value)

    def hang_up(self) -> None:
        """On everybody who is connected now, as a machine that is switched off; not on who comes back while it does."""
        for one in tuple(self.sockets):
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)

    def answer(self, one: Seen) -> tuple[int, Any]:
        if one.authorization is None and not (one.path == "/status" and self.status_is_open):
            return 401, {"error_code": "unauthorized"}
        match one.method, one.path:
            case _, "/status":
                return 200, {**STATUS, "serial_number": self.serial, "state_id": 3, "errors": [], **self.status}
            case "GET", "/users/me":
                return 200, {"name": "scheduler"}
            case "POST", "/mission_queue":
                return 201, {"id": 7}
            case "GET", "/missions/unknown":
                return 404, None
            case "DELETE", _:
                return 204, None
        return 200, []


@contextmanager
def capture(certificate: str = "", **settings: Any) -> Iterator[Capture]:
    """Listens until the block ends; with a certificate (a file's name) over https."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_: Any) -> None:
            """Not on stderr."""

        def setup(self) -> None:
            super().setup()
            machine.sockets.append(self.connection)

        def handle_any(self) -> None:
            self.rfile.read(int(self.headers["Content-Length"] or 0))
            one = Seen(self.command, self.path.partition("?")[0].removeprefix(API), self.headers)
            machine.seen.append(one)
            if one.path == machine.breaks_at:
                self.close_connection = True
                return
            status, found = machine.answer(one)
            body = b"" if found is None else json.dumps(found).encode()
            self.send_response(status)
            self.send_header("Content-Length", str(len(body)))
            if machine.says_close:
                self.send_header("Connection", "close")
            self.end_headers()
            self.wfile.write(body)

        do_GET = do_POST = do_PUT = do_DELETE = handle_any

    class QuietServer(ThreadingHTTPServer):
        def handle_error(self, *_: Any) -> None:
            """A handshake that the app ends is what these tests are about."""

    with QuietServer(("127.0.0.1", 0), Handler) as server:
        if certificate:
            server.socket = tls_of(certificate).wrap_socket(server.socket, server_side=True)
        machine = Capture(f"http{'s' if certificate else ''}://127.0.0.1:{server.server_port}", **settings)
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        try:
            yield machine
        finally:
            server.shutdown()
            thread.join()
