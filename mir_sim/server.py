"""The HTTP shell: any number of robots, each on its own port, in one event loop on one thread."""
from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime

from mir_sim.exchange import Exchange, Fate, take_fault, undergo
from mir_sim.faults import FaultKind
from mir_sim.messages import Request, Response
from mir_sim.robot import SimulatedRobot
from mir_sim.wire import MAX_HEAD, BadRequest, encode, read_request

ONLINE_CHECK = 0.05           # s between two looks at whether a robot is on the air


@dataclass
class Station:
    """One robot's place on the network: its listening socket, or the bare reservation of its port while it is off the air."""

    robot: SimulatedRobot
    host: str
    port: int
    listener: asyncio.Server | None = None
    reservation: socket.socket | None = None
    writers: set[asyncio.StreamWriter] = field(default_factory=set)
    opened: float = field(default_factory=time.monotonic)

    async def open(self) -> None:
        """Listen. Raises OSError when the port is taken."""
        sock = _socket(self.host, self.port)
        sock.listen(512)
        self.port = sock.getsockname()[1]
        if self.reservation is not None:
            self.reservation.close()
            self.reservation = None
        self.listener = await asyncio.start_server(self._serve, sock=sock, limit=MAX_HEAD)

    def close(self) -> None:
        """Stop listening and drop every connection."""
        if self.listener is not None:
            self.listener.close()
            self.listener = None
        for writer in list(self.writers):
            writer.transport.abort()

    async def follow_power(self) -> None:
        """Go off the air with the robot and come back with it. The port stays reserved meanwhile: connections to it are refused."""
        while True:
            await asyncio.sleep(ONLINE_CHECK)
            self.robot.catch_up()
            if not self.robot.online and self.listener is not None:
                self.close()
                with contextlib.suppress(OSError):
                    self.reservation = _socket(self.host, self.port)
            elif self.robot.online and self.listener is None:
                with contextlib.suppress(OSError):
                    await self.open()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.writers.add(writer)
        try:
            while (request := await read_request(reader, writer)) is not None:
                if not await self._answer(request, reader, writer):
                    break
        except BadRequest:
            writer.write(encode(Response(400), date=self._date(), close=True))
        except (ConnectionError, TimeoutError, asyncio.CancelledError):
            writer.transport.abort()     # the client has gone, or the fleet is being stopped
        finally:
            self.writers.discard(writer)
            with contextlib.suppress(ConnectionError):
                writer.close()

    async def _answer(self, request: Request, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bool:
        """Answer one request; return whether the connection lives on. Only real waiting happens here, the rest is the model's."""
        fault = take_fault(self.robot, request)
        if fault is not None and fault.kind is FaultKind.LATE:
            await asyncio.sleep(fault.seconds)
        result = undergo(self.robot, request, fault)
        if result.seconds:
            await asyncio.sleep(result.seconds)
        if result.fate is Fate.HELD:
            while await reader.read(MAX_HEAD):     # until the client gives up
                pass
        return await self._send(request, result, writer)

    async def _send(self, request: Request, result: Exchange, writer: asyncio.StreamWriter) -> bool:
        if result.response is None:
            writer.transport.abort()
            return False
        cut = result.fate is Fate.CUT
        close = cut or request.headers.get("connection", "").lower() == "close"
        response = result.response
        if request.method == "HEAD":
            response = Response(response.status, response.headers)
        writer.write(encode(response, date=self._date(), close=close, length=result.full_length if cut else None))
        await writer.drain()
        return not close

    def _date(self) -> str:
        """The Date header: real time with the error of the robot's clock, whatever the time scale, since people compare it with theirs."""
        error = self.robot.clock.error(time.monotonic() - self.opened)
        return format_datetime(datetime.now(UTC) + timedelta(seconds=error), usegmt=True)


def _socket(host: str, port: int) -> socket.socket:
    """A bound TCP socket that doesn't listen yet."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    sock = socket.socket(family, socket.SOCK_STREAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind((host, port))
    except OSError:
        sock.close()
        raise
    return sock
