"""A simulated robot with a client, on a virtual clock and without sockets; every request that changes something is noted."""

from __future__ import annotations

import json as json_module
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from typing import Any
from urllib.parse import unquote

from app.domain.models import Robot
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import ConnectionLost, TimedOut, Unreachable
from app.mir.raw_client import PATIENT, RawClient
from app.mir.transport import Response, Timeouts
from app.services.check_up.session import CheckUpSession
from mir_sim import Profile, Request, SimulatedRobot
from mir_sim.api import BASE
from mir_sim.exchange import Fate, exchange
from tests.support.clock import VirtualClock

START = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)
ZONE = "Europe/Copenhagen"  # of the faithful robot
LATENCY = 0.02
TOKEN = Token.derive("distributor", "distributor")


class AskedRobot:
    """``history``: ended items that it has from the beginning. ``meddle`` may change an answer, or raise."""

    def __init__(self, profile: Profile | None = None, *, history: int = 400, **values: Any) -> None:
        self.clock = VirtualClock(START)
        profile = profile or Profile()
        self.machine = SimulatedRobot(
            "Aino",
            seed=1,
            battery=80.0,
            history=history,
            time_scale=1,
            clock=self.clock.elapsed,
            start=START,
            profile=replace(profile, **values),
        )
        self._begin()

    base, token = BASE, TOKEN

    def _begin(self) -> None:
        self.writes: list[str] = []
        self.requests: list[str] = []
        self.meddle: Callable[[str, str, Response], Response]
        self.before: Callable[[str, str], None]
        self.behave()

    def gives(self, answer: Response | Exception, is_meant: Callable[[str, str], bool]) -> None:
        """Instead of its own answers to these requests."""

        def meddle(method: str, path: str, own: Response) -> Response:
            if not is_meant(method, path):
                return own
            if isinstance(answer, Exception):
                raise answer
            return answer

        self.meddle = meddle

    def behave(self) -> None:
        """From now on nothing comes between."""
        self.before, self.meddle = lambda method, path: None, lambda method, path, answer: answer

    def client(self, robot: Robot | None = None) -> RobotClient:
        client = RobotClient(
            Address.parse("http://10.0.0.1"), TOKEN, transport=Direct(self), clock=self.clock.monotonic
        )
        client.timeouts = PATIENT
        return client

    def session(self, **values: Any) -> CheckUpSession:
        return CheckUpSession(RawClient(self.client(), self.clock), self.clock, ZONE, **values)


class Direct:
    def __init__(self, asked: AskedRobot) -> None:
        self._asked = asked

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
        asked = self._asked
        asked.before(method, path)
        asked.requests.append(f"{method} {path}")
        if method != "GET" and not path.endswith("/search"):
            asked.writes.append(f"{method} {path}")
        asked.clock.advance(LATENCY)
        headers = {"content-type": "application/json", "accept-language": "en_US"}
        headers |= {name.lower(): value for name, value in asked.token.headers.items()} if with_credentials else {}
        body = b"" if json is None else json_module.dumps(json).encode()
        result = exchange(asked.machine, Request(method, unquote(f"{asked.base}{path}"), query or {}, headers, body))
        if result.fate is Fate.REFUSED:
            raise Unreachable(code="refused", address="10.0.0.1")
        if result.seconds > timeout.read or result.fate is Fate.HELD:
            asked.clock.advance(timeout.read)
            raise TimedOut(address="10.0.0.1", seconds=timeout.read)
        asked.clock.advance(result.seconds)
        if result.response is None or result.fate is not Fate.ANSWERED:
            raise ConnectionLost(address="10.0.0.1")
        offset = asked.machine.clock.error(asked.clock.elapsed())
        date = format_datetime(
            (START + timedelta(seconds=asked.clock.elapsed() + offset)).replace(microsecond=0), usegmt=True
        )
        answer = Response(result.response.status, result.response.body, {**result.response.headers, "Date": date})
        return asked.meddle(method, path, answer)

    def read_connection(self) -> object:
        return self._asked

    def close(self) -> None:
        """Nothing is open."""
