"""Robots of simulated fleets as the app's targets, in process: each request travels through the fleet's faults."""

from __future__ import annotations

import json as json_module
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import urlencode

import mir_sim
from app.mir.address import Address
from app.mir.credentials import Token
from app.mir.errors import ConnectionLost, NotWanted, TimedOut, Unreachable
from app.mir.transport import Response, Timeouts
from mir_sim import Exchange, Request
from mir_sim.exchange import Fate
from mir_sim.machine import Machine

ADDRESS = Address.parse("http://fleet.test")
TOKEN = Token.derive("distributor", "distributor")
KEY = Token.of_key("mir_scheduler")


class MachineTransport:
    """To one machine. ``requests`` are those that left, as "GET /robots"."""

    def __init__(self, machine: Machine, token: Token) -> None:
        self.machine, self._token = machine, token
        self.requests: list[str] = []

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
        if not self.machine.online:
            raise Unreachable(code="refused")
        if is_wanted is not None and not is_wanted():
            raise NotWanted()
        self.requests.append(f"{method} {path}")
        target = f"{self.machine.base}{path}" + (f"?{urlencode(query, safe=',')}" if query else "")
        headers = {"Content-Type": "application/json", "Accept": "application/json", "Accept-Language": "en_US"}
        body = b"" if json is None else json_module.dumps(json).encode()
        headers |= self._token.headers if with_credentials else {}
        return _answer(mir_sim.exchange(self.machine, Request.of(method, target, headers, body)), timeout)

    def read_connection(self) -> object:
        return self.machine

    def close(self) -> None:
        """Nothing is held."""


def _answer(found: Exchange, timeout: Timeouts) -> Response:
    if found.fate is Fate.REFUSED:
        raise Unreachable(code="refused")
    if found.fate in (Fate.CLOSED, Fate.CUT):
        raise ConnectionLost()
    if found.response is None or found.seconds > timeout.read:
        raise TimedOut(seconds=timeout.read)
    return Response(found.response.status, found.response.body, found.response.headers)
