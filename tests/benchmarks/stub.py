"""Many robots on loopback addresses of their own, in one process: they answer as MiR robots do, hang, or refuse, and
note every POST.

Started by the benchmarks: ``python -m tests.benchmarks.stub --robots 200 --refusing 20 --hanging 20 --out FILE``. Robot
n listens at ``address(n)`` on one common port, which is printed as ``ready PORT``; the first ones refuse (nothing
listens), the next ones hang (they take a connection and never answer). An accepted mission is done a second later.
``GET /count`` at any answering robot returns how many different missions the answering robots got, ``GET /drop`` has
the last ``--dropping`` ones refuse from then on; on SIGTERM the POSTs are written to FILE as ``time,robot,message``
lines.

Plain asyncio protocols and prepared bytes: on two cores the stub must not be what is measured.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import re
import signal
import time
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from email.utils import formatdate
from typing import Any

MISSION_SECONDS = 1.0
API = "/api/v2.0.0"
MISSION_GUID = "3d7c7c40-ce85-11ef-904a-000e8e9884eb"
_LENGTH = re.compile(rb"content-length:\s*(\d+)", re.IGNORECASE)


def address(robot: int) -> str:
    """The whole of 127.0.0.0/8 is this machine (on Linux; elsewhere the addresses have to be added to the loopback interface)."""
    return f"127.7.{robot // 200}.{robot % 200 + 1}"


@dataclass
class StubRobot:
    number: int
    answers: bool
    items: dict[int, dict[str, Any]] = field(default_factory=dict)
    ordered: dict[int, float] = field(default_factory=dict)
    connections: list[asyncio.Transport] = field(default_factory=list)

    def enqueue(self, wish: dict[str, Any], now: float) -> dict[str, Any]:
        number = len(self.items) + 1
        stamp = datetime.fromtimestamp(now, UTC).strftime("%Y-%m-%dT%H:%M:%S")
        self.items[number] = {
            "id": number,
            "state": "Pending",
            "mission_id": wish.get("mission_id"),
            "message": wish.get("message", ""),
            "description": wish.get("description", ""),
            "priority": wish.get("priority", 0),
            "parameters": wish.get("parameters", []),
            "ordered": stamp,
            "started": None,
            "finished": None,
        }
        self.ordered[number] = now
        return self.items[number]

    def item(self, number: int, now: float) -> dict[str, Any]:
        """Raises KeyError."""
        item = self.items[number]
        if item["state"] == "Pending" and now - self.ordered[number] >= MISSION_SECONDS:
            item |= {"state": "Done", "started": item["ordered"], "finished": item["ordered"]}
        return item


class Site:
    """All robots and what was posted to them."""

    def __init__(self) -> None:
        self.posts: list[tuple[float, int, str]] = []
        self.received: set[str] = set()
        self.drop = lambda: None  # has some robots refuse from now on

    def answer(self, robot: StubRobot, method: str, target: str, body: bytes) -> tuple[int, Any]:
        now = time.time()
        path = target.partition("?")[0].removeprefix(API)
        match method, path:
            case "GET", "/status":
                return 200, {
                    "state_id": 3,
                    "state_text": "Ready",
                    "battery_percentage": 60.0 + (now // 2 + robot.number) % 40,  # another one at each poll
                    "robot_name": f"R{robot.number}",
                    "robot_model": "MiR100",
                    "serial_number": f"S{robot.number:05}",
                    "errors": [],
                    "mission_queue_id": None,
                    "mission_text": "",
                    "uptime": 1000,
                }
            case "GET", "/users/me":
                return 200, {"name": "Distributor"}
            case "GET", "/software/system_status":
                return 200, {"application_version": "3.5.4"}
            case "GET", "/mission_queue":
                newest = list(robot.items)[:-3:-1]
                return 200, [
                    {"id": number, "state": "Done", "url": f"/v2.0.0/mission_queue/{number}"} for number in newest
                ]
            case "POST", "/mission_queue":
                item = robot.enqueue(json.loads(body), now)
                self.received.add(item["message"])
                return 201, item
            case "POST", "/mission_queue/search":
                return 200, self._search(robot, json.loads(body), now)
            case "GET", "/drop":
                self.drop()
                return 200, {}
            case "GET", "/count":
                return 200, len(self.received)
            case "GET", _ if path.startswith("/mission_queue/"):
                with suppress(KeyError):
                    return 200, robot.item(int(path.rpartition("/")[2]), now)
        return 404, {"error_code": "not_found", "error_human": "Not found"}

    @staticmethod
    def _search(robot: StubRobot, wish: dict[str, Any], now: float) -> list[dict[str, Any]]:
        wanted = wish["filters"][0]
        if wanted["fieldname"] == "id":
            return [robot.item(number, now) for number in range(len(robot.items), wanted["value"], -1)]
        young = [number for number in robot.ordered if now - robot.ordered[number] < MISSION_SECONDS]
        return [robot.items[number] for number in sorted(young, reverse=True)]


class Conversation(asyncio.Protocol):
    """One connection to one robot."""

    def __init__(self, site: Site, robot: StubRobot) -> None:
        self._site, self._robot, self._buffer = site, robot, b""
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = transport  # type: ignore[assignment]
        self._robot.connections.append(self._transport)  # type: ignore[arg-type]

    def data_received(self, data: bytes) -> None:
        self._buffer += data
        while (end := self._buffer.find(b"\r\n\r\n")) >= 0:
            head = self._buffer[:end]
            found = _LENGTH.search(head)
            length = int(found.group(1)) if found else 0
            if len(self._buffer) < end + 4 + length:
                return
            body, self._buffer = self._buffer[end + 4 : end + 4 + length], self._buffer[end + 4 + length :]
            self._take(head, body)

    def _take(self, head: bytes, body: bytes) -> None:
        method, target, _ = head.split(b"\r\n", 1)[0].decode("latin-1").split(" ")
        if method == "POST" and target.endswith("/mission_queue"):
            self._site.posts.append((time.time(), self._robot.number, json.loads(body).get("message", "")))
        if not self._robot.answers or self._transport is None:
            return
        status, answer = self._site.answer(self._robot, method, target, body)
        content = json.dumps(answer).encode()
        self._transport.write(
            b"HTTP/1.1 %d X\r\nContent-Type: application/json\r\nDate: %s\r\nContent-Length: %d\r\n\r\n%s"
            % (status, formatdate(usegmt=True).encode(), len(content), content)
        )
        if b"connection: close" in head.lower():
            self._transport.close()


async def serve(robots: int, refusing: int, hanging: int, dropping: int, out: str) -> None:
    loop, site = asyncio.get_running_loop(), Site()
    port, servers, all_robots = 0, [], []
    for number in range(refusing, robots):
        robot = StubRobot(number, answers=number >= refusing + hanging)
        server = await loop.create_server(
            lambda robot=robot: Conversation(site, robot), address(number), port, backlog=1024
        )  # type: ignore[misc]
        port = server.sockets[0].getsockname()[1]
        servers.append(server)
        all_robots.append(robot)

    def drop() -> None:
        pairs = list(zip(servers, all_robots, strict=True))[:-1]  # the last one is asked for counts
        for server, robot in pairs[-dropping:]:
            server.close()
            for connection in robot.connections:
                connection.abort()

    if dropping:
        site.drop = drop
    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(number, stop.set)
    print(f"ready {port}", flush=True)
    await stop.wait()
    with open(out, "w", encoding="utf-8") as file:
        file.writelines(f"{at:.6f},{robot},{message}\n" for at, robot, message in site.posts)


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.benchmarks.stub")
    options.add_argument("--robots", type=int, default=50)
    options.add_argument("--refusing", type=int, default=0)
    options.add_argument("--hanging", type=int, default=0)
    options.add_argument("--dropping", type=int, default=0)
    options.add_argument("--out", required=True)
    args = options.parse_args()
    asyncio.run(serve(args.robots, args.refusing, args.hanging, args.dropping, args.out))


if __name__ == "__main__":
    main()
