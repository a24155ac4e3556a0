"""A client of a simulated robot without a network, at simulated times that the test chooses."""

from __future__ import annotations

import json
from base64 import b64encode
from hashlib import sha256
from typing import Any

import mir_sim
from mir_sim import MISSIONS, Exchange, Request, Response, SimulatedRobot
from mir_sim.control import apply
from mir_sim.machine import Machine

GUIDS = {mission.name: mission.guid for mission in MISSIONS}


def credentials(user: str = "distributor", password: str = "distributor") -> str:
    return "Basic " + b64encode(f"{user}:{sha256(password.encode()).hexdigest()}".encode()).decode()


HEADERS = {"Authorization": credentials(), "Content-Type": "application/json"}


class Client:
    """Of a machine. ``pass_time`` advances the machine's time."""

    machine: Machine
    base, headers = "/api/v2.0.0", HEADERS

    def pass_time(self, seconds: float) -> None:
        self.machine.advance_to(self.machine.now + seconds)

    def request(self, method: str, path: str, body: Any = None, headers: dict[str, str] | None = None) -> Request:
        content = b"" if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
        return Request.of(method, f"{self.base}{path}", self.headers if headers is None else headers, content)

    def send(self, method: str, path: str, body: Any = None, headers: dict[str, str] | None = None) -> Response:
        return mir_sim.handle(self.machine, self.request(method, path, body, headers))

    def exchange(self, method: str, path: str, body: Any = None) -> Exchange:
        return mir_sim.exchange(self.machine, self.request(method, path, body))

    def get(self, path: str) -> Any:
        response = self.send("GET", path)
        assert response.status == 200, response.body
        return response.json()


class Asker(Client):
    """A robot and a client of it."""

    def __init__(self, **options: Any) -> None:
        self.machine = SimulatedRobot("Aino", **{"seed": 1, "battery": 80.0, **options})

    @property
    def robot(self) -> SimulatedRobot:
        return self.machine

    def put_status(self, **fields: Any) -> Any:
        response = self.send("PUT", "/status", fields)
        assert response.status == 200, response.body
        return response.json()

    def status(self) -> Any:
        return self.get("/status")

    def order(self, mission: str = "Deliver", **fields: Any) -> int:
        response = self.send("POST", "/mission_queue", {"mission_id": GUIDS[mission], **fields})
        assert response.status == 201, response.body
        return int(response.json()["id"])

    def run_for(self, seconds: float, mission: str = "Deliver") -> int:
        """Order a mission and let time pass; the number of its item."""
        number = self.order(mission)
        self.pass_time(seconds)
        return number

    def item(self, number: int) -> Any:
        return self.get(f"/mission_queue/{number}")

    def state_of(self, number: int, after: float = 0.0) -> str:
        """When so many seconds have passed."""
        if after:
            self.pass_time(after)
        return str(self.item(number)["state"])

    def control(self, **commands: Any) -> None:
        apply(self.machine, commands)

    def pass_until_done(self, number: int, most: float = 3600.0) -> None:
        self.pass_until(lambda: self.state_of(number) == "Done", most)

    def pass_until(self, condition: Any, most: float = 3600.0) -> None:
        """Advance time until a condition holds, checked every half second."""
        ends = self.machine.now + most
        while not condition():
            assert self.machine.now < ends
            self.pass_time(0.5)
