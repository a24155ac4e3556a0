"""The HTTP server: any number of robots and a fleet above them, each on its own port, in one event loop on one thread."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import ssl
import time
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime

from mir_sim.api import refuse
from mir_sim.control import refusal
from mir_sim.errors import ApiError
from mir_sim.exchange import Exchange, Fate, handle_with_fault, take_fault
from mir_sim.faults import FaultKind
from mir_sim.machine import Machine
from mir_sim.messages import Request, Response
from mir_sim.wire import MAX_HEAD, BadRequest, encode, read_request

ONLINE_CHECK = 0.02  # s between two checks for machines that are online
BACKLOG = 512


class MachineServer:
    """One machine on its port: a listening socket, or only a reservation of the port while the machine is offline."""

    def __init__(self, machine: Machine, host: str, port: int, key: str, tls: ssl.SSLContext | None = None) -> None:
        self.machine, self.host, self.port, self._key, self.tls = machine, host, port, key, tls
        self._listener: asyncio.Server | None = None
        self._reservation: socket.socket | None = None
        self._writers: set[asyncio.StreamWriter] = set()
        self._began = time.monotonic()

    async def open(self) -> None:
        """Listen. Raises OSError when the port is taken."""
        sock = _bound_socket(self.host, self.port)
        sock.listen(BACKLOG)
        self.port = sock.getsockname()[1]
        self._release()
        self._listener = await asyncio.start_server(self._serve, sock=sock, limit=MAX_HEAD, ssl=self.tls)

    def close(self) -> None:
        """Stop listening, abort all connections and free the port."""
        if self._listener is not None:
            self._listener.close()
            self._listener = None
        for writer in list(self._writers):
            writer.transport.abort()
        self._release()

    def _release(self) -> None:
        if self._reservation is not None:
            self._reservation.close()
            self._reservation = None

    async def follow(self) -> None:
        """Listen while the machine is online. While it is not, the port stays reserved and connections are refused."""
        if self.machine.shutting_down or not self.machine.online:
            self.machine.catch_up()
        if not self.machine.online and self._listener is not None:
            self.close()
            with contextlib.suppress(OSError):
                self._reservation = _bound_socket(self.host, self.port)
        elif self.machine.online and self._listener is None:
            with contextlib.suppress(OSError):  # another process has taken the port; the next check tries again
                await self.open()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.add(writer)
        try:
            while (request := await read_request(reader, writer)) is not None and await self._answer(
                request, reader, writer
            ):
                pass
        except BadRequest:
            writer.write(encode(Response(400), date=self._date(), close=True))
        except (ConnectionError, TimeoutError, asyncio.CancelledError):
            writer.transport.abort()  # the client has disconnected, or the fleet is being stopped
        finally:
            self._writers.discard(writer)
            writer.close()

    async def _answer(self, request: Request, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
        """Answer one request; return whether the connection stays open. Waits in real time; all else is done by the model."""
        peer = (writer.get_extra_info("peername") or ("",))[0]
        if (refused := refusal(request, peer, self._key)) is not None:
            return await self._send(request, Exchange(Fate.ANSWERED, refused), writer)
        fault = take_fault(self.machine, request)
        if fault is not None and fault.kind is FaultKind.LATE:
            await asyncio.sleep(fault.seconds)
        try:
            result = handle_with_fault(self.machine, request, fault)
        except Exception:
            logging.getLogger("mir_sim").exception("%s %s could not be answered", request.method, request.path)
            result = Exchange(Fate.ANSWERED, refuse(self.machine, ApiError(500)))
        if not self.machine.online:  # it went offline since the last check
            result = Exchange(Fate.REFUSED)
        if result.seconds:
            await asyncio.sleep(result.seconds)
        if result.fate is Fate.HELD:
            while await reader.read(MAX_HEAD):  # until the client gives up
                pass
        return await self._send(request, result, writer)

    async def _send(self, request: Request, result: Exchange, writer: asyncio.StreamWriter) -> bool:
        if result.response is None:
            writer.transport.abort()
            return False
        cut = result.fate is Fate.CUT
        close = cut or request.headers.get("connection", "").lower() == "close"
        response, length = result.response, result.full_length if cut else None
        if request.method == "HEAD":  # headers only, or the client would take the body for the next answer
            response, length = Response(response.status, response.headers), len(response.body)
        writer.write(encode(response, date=self._date(), close=close, length=length))
        await writer.drain()
        return not close

    def _date(self) -> str:
        """The Date header: real time plus the error of the machine's clock. Not scaled, since clients compare it with their own clock."""
        error = self.machine.clock.error(time.monotonic() - self._began)
        return format_datetime(datetime.now(UTC) + timedelta(seconds=error), usegmt=True)


async def follow_all(servers: Iterable[MachineServer]) -> None:
    """Open and close the ports as the machines go online and offline, until cancelled."""
    while True:
        await asyncio.sleep(ONLINE_CHECK)
        for server in servers:
            await server.follow()


def _bound_socket(host: str, port: int) -> socket.socket:
    """A TCP socket that is bound to its port but doesn't listen yet."""
    sock = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind((host, port))
    except OSError:
        sock.close()
        raise
    return sock
