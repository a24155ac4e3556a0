"""The network between the app and simulated robots: it drops and delays requests and answers, determined by a seed.

``Network`` decides what happens to each request; ``SimulatedTransport`` takes the place of HTTP and calls a simulated robot's request
handler directly, so that a request takes microseconds of real time and moves only the virtual clock.
"""
from __future__ import annotations

import json as json_module
import random
import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from app.mir.credentials import Token
from app.mir.errors import ConnectionLost, NotWanted, TimedOut, Unreachable
from app.mir.transport import Response, Timeouts
from mir_sim import SimulatedRobot, api
from mir_sim.messages import Request
from tests.support.clock import VirtualClock

if TYPE_CHECKING:
    from tests.support.site import Site

LATENCY = 0.02           # s
DESCRIPTION = re.compile(rb'"description":\s*"[^"]*"')


class Fate(StrEnum):
    """What happens to one request."""
    FINE = "fine"
    REFUSED = "refused"              # no connection
    LOST = "lost"                    # connected, the request never arrives
    ANSWER_LOST = "answer_lost"      # handled, the answer never arrives
    LATE = "late"                    # the app gives up, the request is handled later
    ERROR_BEFORE = "error_before"    # 5xx, not handled
    ERROR_AFTER = "error_after"      # handled, then 5xx
    PAGE = "page"                    # handled, then a web page instead of the answer
    CUT = "cut"                      # handled, then half of the answer


HARMFUL = tuple(fate for fate in Fate if fate is not Fate.FINE)


@dataclass
class Network:
    """``rate`` of the requests meet a fault, drawn by ``seed``; outages of a robot are added by name."""
    rate: float = 0.0
    seed: int = 1
    latest: float = 60.0             # s after which a late request is handled at most
    fates: tuple[Fate, ...] = HARMFUL
    only: Callable[[str, str], bool] = lambda method, path: True
    site: Site | None = None
    counts: Counter[str] = field(default_factory=Counter)
    down: set[str] = field(default_factory=set)
    planned: list[tuple[str, str, Fate]] = field(default_factory=list)     # (method, path, fate): the next such request
    interrupt: Callable[[str], None] = lambda where: None                  # the simulation crashes the app here
    forgets_descriptions: bool = False                                     # robots that don't give back what they were sent

    def __post_init__(self) -> None:
        self.rng = random.Random(self.seed)

    def next(self, method: str, path: str, fate: Fate) -> None:
        """The next request of this kind meets this fate."""
        self.planned.append((method, path, fate))

    def fate_of(self, robot: str, method: str, path: str) -> Fate:
        for entry in self.planned:
            if entry[:2] == (method, path):
                self.planned.remove(entry)
                return self._counted(entry[2])
        if robot in self.down:
            return self._counted(Fate.REFUSED)
        if self.rate and self.only(method, path) and self.rng.random() < self.rate:
            return self._counted(self.rng.choice(self.fates))
        return Fate.FINE

    def _counted(self, fate: Fate) -> Fate:
        self.counts[fate] += 1
        return fate


class SimulatedTransport:
    def __init__(self, machine: SimulatedRobot, network: Network, clock: VirtualClock, name: str, token: Token) -> None:
        self._machine, self._network, self._clock, self._name = machine, network, clock, name
        self._headers = {"Authorization": token.header, "Content-Type": "application/json", "Accept-Language": "en_US"}

    def send(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None, timeout: Timeouts,
             is_wanted: Callable[[], bool] | None = None) -> Response:
        network, body = self._network, b"" if json is None else json_module.dumps(json).encode()
        network.interrupt(f"before {method} {path}")
        fate = network.fate_of(self._name, method, path)
        self._clock.advance(LATENCY)
        if is_wanted is not None and fate is not Fate.REFUSED and not is_wanted():
            raise NotWanted(address=self._name)

        def handle() -> Response:
            target = f"/api/v2.0.0{path}" + (f"?{urlencode(query)}" if query else "")
            answer = api.handle(self._machine, Request.of(method, target, self._headers, body))
            body_back = DESCRIPTION.sub(rb'"description":""', answer.body) if network.forgets_descriptions else answer.body
            return Response(answer.status, body_back, answer.headers)
        match fate:
            case Fate.REFUSED:
                raise Unreachable(code="refused", address=self._name)
            case Fate.LOST:
                self._clock.advance(timeout.read)
                raise TimedOut(address=self._name, seconds=timeout.read)
            case Fate.LATE:
                assert network.site is not None
                network.site.at(timeout.read + network.rng.uniform(0, network.latest), handle)
                self._clock.advance(timeout.read)
                raise TimedOut(address=self._name, seconds=timeout.read)
            case Fate.ERROR_BEFORE:
                return Response(500, b'{"error_code": "internal", "error_human": "no"}', {})
        answer = handle()
        network.interrupt(f"after {method} {path}")
        match fate:
            case Fate.ANSWER_LOST:
                self._clock.advance(timeout.read)
                raise TimedOut(address=self._name, seconds=timeout.read)
            case Fate.ERROR_AFTER:
                return Response(503, b'{"error_code": "service_unavailable", "error_human": "busy"}', {})
            case Fate.PAGE:
                return Response(200, b"<html><body>Sign in to the guest network</body></html>", {"Content-Type": "text/html"})
            case Fate.CUT:
                raise ConnectionLost(address=self._name)
        return answer

    def close(self) -> None:
        """Nothing is held."""
