"""Serves simulated robots, and a fleet above them, on ports of this machine, for tests, demonstrations and the command line."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import ssl
import threading
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any, Generic, TypeVar

from mir_sim import control
from mir_sim.fleets import KINDS, make_fleet
from mir_sim.fleets.base import SimulatedFleet
from mir_sim.machine import Machine
from mir_sim.robot import SimulatedRobot
from mir_sim.server import MachineServer, follow_all

M = TypeVar("M", bound=Machine)
NAMES = ("Aino", "Veikko", "Sisu", "Lempi", "Onni", "Helmi", "Eino", "Toivo", "Aava", "Urho", "Impi", "Sulo")


def robot_name(index: int) -> str:
    """A friendly name for the n-th robot; with more robots than names a number is added."""
    turn, place = divmod(index, len(NAMES))
    return NAMES[place] if turn == 0 else f"{NAMES[place]}-{turn + 1}"


class Served(Generic[M]):
    """A robot or fleet that is served: its address, and control of it from any thread."""

    def __init__(self, server: MachineServer, model: M) -> None:
        self._server = server
        self.name = model.name
        self.model = model

    @property
    def port(self) -> int:
        return self._server.port

    @property
    def url(self) -> str:
        host = self._server.host
        scheme = "http" if self._server.tls is None else "https"
        return f"{scheme}://{f'[{host}]' if ':' in host else host}:{self.port}"

    def control(self, commands: dict[str, Any]) -> dict[str, Any]:
        """The same as POST /sim: execute the commands and return the new state. Raises WrongValue with a sentence."""
        control.apply(self.model, commands)
        return self.model.snapshot()

    def state(self) -> dict[str, Any]:
        """The same as GET /sim."""
        return self.model.snapshot()


FleetRobot = Served[SimulatedRobot]


class Fleet:
    """Robots that are served until ``stop``, on the ports after that of the fleet ``above`` them, if there is one. All share one clock, one
    thread and one event loop. ``key``, a random one by default, is asked for by /sim when a request comes from another machine. With
    ``tls`` they are reached by HTTPS.

    Attributes:
        robots, above: what is served, from ``start`` on.
    """

    def __init__(
        self,
        robots: list[SimulatedRobot],
        host: str = "127.0.0.1",
        port: int = 0,
        key: str = "",
        above: SimulatedFleet | None = None,
        tls: ssl.SSLContext | None = None,
    ) -> None:
        self.key = key or secrets.token_urlsafe(12)
        self._machines = (robots, above)
        machines: list[Machine] = [*([] if above is None else [above]), *robots]
        self._servers = [
            MachineServer(machine, host, port + number if port else 0, self.key, tls)
            for number, machine in enumerate(machines)
        ]
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run_loop, name="mir_sim", daemon=True)
        self._watch: asyncio.Task[None] | None = None
        self.robots: list[FleetRobot] = []
        self.above: Served[SimulatedFleet] | None = None

    def start(self) -> None:
        """Open all ports and answer from now on. Raises OSError when one is taken; then none stays open."""
        self._thread.start()
        try:
            asyncio.run_coroutine_threadsafe(self._open(), self._loop).result()
        except OSError:
            self.stop()
            raise
        robots, above = self._machines
        self.robots = [
            Served(server, robot) for server, robot in zip(self._servers[-len(robots) :], robots, strict=True)
        ]
        if above is not None:
            self.above = Served(self._servers[0], above)
            for vehicle, robot in zip(above.vehicles, self.robots, strict=True):
                vehicle.address = robot.url.partition("//")[2]

    def stop(self) -> None:
        """Close all ports and connections and end the thread."""
        if self._thread.is_alive():
            asyncio.run_coroutine_threadsafe(self._close(), self._loop).result()
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
        self._loop.close()

    def _run_loop(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_forever()

    async def _open(self) -> None:
        for server in self._servers:
            await server.open()
        self._watch = asyncio.create_task(follow_all(self._servers))

    async def _close(self) -> None:
        for server in self._servers:
            server.close()
        tasks = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def make_robots(count: int, *, time_scale: float = 1.0, seed: int = 1, **options: Any) -> list[SimulatedRobot]:
    """Robots that share one clock, which starts now. ``options`` go to each :class:`SimulatedRobot`."""
    began = time.monotonic()
    options.setdefault("start", datetime.now(UTC))

    def seconds() -> float:
        return (time.monotonic() - began) * time_scale

    return [
        SimulatedRobot(robot_name(number), seed=seed, time_scale=time_scale, clock=seconds, **options)
        for number in range(count)
    ]


@contextlib.contextmanager
def serve(
    robots: int = 3,
    *,
    fleet: str = "",
    knobs: Any = None,
    time_scale: float = 1.0,
    seed: int = 1,
    host: str = "127.0.0.1",
    port: int = 0,
    **options: Any,
) -> Iterator[Fleet]:
    """Serve robots while the block runs.

    Args:
        robots: how many.
        fleet: a kind of fleet above them, of ``fleets.KINDS``; empty: none.
        knobs: how the fleet differs, of the class for its kind; None: not at all.
        time_scale: simulated seconds per real second, 1 to 1000.
        seed: decides everything random.
        port: first of the consecutive ports, that of the fleet if there is one; 0 takes free ones.
        options: passed to every :class:`SimulatedRobot`.
    """
    if fleet:
        options.setdefault("software", KINDS[fleet].robots)
    machines = make_robots(robots, time_scale=time_scale, seed=seed, **options)
    history = options.get("history", 0)
    above = make_fleet(fleet, machines, seed=seed, knobs=knobs, history=history) if fleet else None
    served = Fleet(machines, host, port, above=above)
    served.start()
    try:
        yield served
    finally:
        served.stop()
