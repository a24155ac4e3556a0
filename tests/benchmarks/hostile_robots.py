"""Robots that answer wrongly, each kind on its own port: at every path, or at one path behind a good status.

Started by ``bench_hostile``: ``python -m tests.benchmarks.hostile_robots`` prints a line ``address fate`` for each, then ``ready``, and
runs until it is terminated. Those at https are robots that are known by the certificate ``FIELD``.
"""

from __future__ import annotations

import asyncio
import base64
import gzip
import itertools
import json
import re
import ssl
import time
from collections.abc import Awaitable, Callable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any
from urllib.parse import parse_qs, urlsplit

from tests.hostile.capture import API
from tests.hostile.test_pictures import GREY, RGBA, header, png, rows
from tests.integration.mir.servers import FIELD, PLANT, tls_of

STATUS: dict[str, Any] = {
    "state_id": 3,
    "state_text": "Ready",
    "battery_percentage": 80.0,
    "robot_name": "Hostile",
    "robot_model": "MiR100",
    "errors": [],
    "serial_number": "H1",
    "mission_queue_id": None,
    "mission_text": "",
    "uptime": 1000,
}
CHANGING = "certificates that change"  # over https
_number = itertools.count(1)

Body = Callable[[], bytes]
Answer = Callable[[str], bytes | int]  # to a path below the API with its query: a body, or an HTTP status of failure
Fate = Callable[[asyncio.StreamWriter, str], Awaitable[None]]


def response(body: bytes, more: str = "", code: int = 200) -> bytes:
    return (
        f"HTTP/1.1 {code} -\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n{more}\r\n".encode()
        + body
    )


# ---------------------------------------------------------------------- bodies
def status(**changes: Any) -> Body:
    return lambda: json.dumps(STATUS | changes).encode()


def errors(count: int, length: int) -> Body:
    """Others at each read."""

    def body() -> bytes:
        begin = next(_number) * count
        found = [
            {"code": begin + n, "description": f"{begin + n} " + "x" * length, "module": "Wheels"} for n in range(count)
        ]
        return json.dumps(STATUS | {"state_id": 12, "errors": found}).encode()

    return body


def flapping() -> bytes:
    """In error, and well, and in another error."""
    number = next(_number)
    found = [{"code": number, "description": f"fault {number}", "module": "Wheels"}] if number % 2 else []
    return json.dumps(STATUS | {"state_id": 12 if found else 3, "errors": found}).encode()


def other_question() -> bytes:
    """Another one at each read, as long as a status may be."""
    number = next(_number)
    options = [f"Door {number}.{n} " + "x" * 200 for n in range(1000)]
    return status(user_prompt={"guid": f"g{number}", "question": f"{number} " + "Which? " * 1000, "options": options})()


def other_map() -> bytes:
    return status(map_id=f"map-{next(_number)}")()


def other_serial() -> bytes:
    """A status with the serial number of the robot, then of another machine."""
    return status(serial_number=f"H{next(_number) % 2}")()


@cache
def endless_queue() -> bytes:
    return json.dumps(
        [{"id": n, "state": "Pending", "url": f"/v2.0.0/mission_queue/{n}"} for n in range(50_000)]
    ).encode()


def item(number: int) -> dict[str, Any]:
    return {
        "id": number,
        "state": "Pending",
        "mission_id": f"mission-{number}",
        "description": "",
        "message": "",
        "priority": 0,
        "created_by_name": "Nobody",
        "ordered": "2026-11-20T14:37:00",
        "started": None,
        "finished": None,
    }


def any_item(path: str) -> bytes:
    return json.dumps(item(int(path.rpartition("/")[2]))).encode()


def long_queue(path: str) -> bytes:
    """Nearly as many items as are read, in pages; all of them others in each second."""
    query = parse_qs(urlsplit(path).query)
    offset, limit = (int(query.get(name, ["200"])[0]) for name in ("offset", "limit"))
    newest = 10_000 * int(time.monotonic())
    return json.dumps([item(newest - n) for n in range(offset, min(offset + limit, 4_900))]).encode()


def map_with(picture: bytes) -> bytes:
    return json.dumps(
        {"guid": "m", "name": "Hall", "map": base64.b64encode(picture).decode(), "resolution": 0.05}
    ).encode()


# ---------------------------------------------------------------------- fates
def answering(answer: Answer) -> Fate:
    async def fate(writer: asyncio.StreamWriter, path: str) -> None:
        found = answer(path)
        writer.write(response(b"{}", code=found) if isinstance(found, int) else response(found))

    return fate


def everywhere(body: Body) -> Fate:
    return answering(lambda _path: body())


def behind(status_: Body, answers: Mapping[str, Answer] = MappingProxyType({})) -> Fate:
    """Paths that begin as a key does get that answer, all others a good one."""

    def by_path(path: str) -> bytes | int:
        for begin, answer in answers.items():
            if path.startswith(begin):
                return answer(path)
        match path.partition("?")[0].split("/")[1:]:
            case ["status"]:
                return status_()
            case ["users", "me"]:
                return b'{"name": "Hostile"}'
            case ["missions"] | ["mission_queue"] | ["mission_queue", "search"] | ["maps", _, "positions"]:
                return b"[]"
        return 404

    return answering(by_path)


def one_item(_path: str) -> bytes:
    """A queue with one item of a mission whose name only the robot knows."""
    return json.dumps([item(1)]).encode()


def without_search(path: str) -> bytes | int:
    if path.startswith("/mission_queue/search"):
        return 404
    return endless_queue() if path.partition("?")[0] == "/mission_queue" else any_item(path)


async def drip(writer: asyncio.StreamWriter, _path: str) -> None:
    for byte in response(status()()):
        writer.write(bytes([byte]))
        await writer.drain()
        await asyncio.sleep(0.2)


async def endless_head(writer: asyncio.StreamWriter, _path: str) -> None:
    writer.write(b"HTTP/1.1 200 OK\r\n")
    while True:
        writer.write(b"X-Noise: " + b"n" * 1000 + b"\r\n")
        await writer.drain()


def bomb(packed: bytes) -> Fate:
    async def fate(writer: asyncio.StreamWriter, _path: str) -> None:
        writer.write(response(packed, "Content-Encoding: gzip\r\n"))

    return fate


async def hang(_writer: asyncio.StreamWriter, _path: str) -> None:
    await asyncio.sleep(3600)


def fates() -> dict[str, Fate]:
    """By name; the long answers are made here, once."""
    two_headers = map_with(png(header(10, 10, GREY), header(13_000, 13_000, RGBA), rows(13_000, 1000, 4)).png)
    large = map_with(png(header(6900, 6900, GREY), rows(6900, 6900)).png)
    too_many = json.dumps([{"guid": f"{n:06}"} for n in range(400_000)], separators=(",", ":")).encode()
    long_text = "x" * ((8 << 20) - 1000)
    packed = gzip.compress(b" " * (512 << 20), 9)
    question = {"guid": "g", "question": "Which? " * 1000, "options": [f"Door {n}" for n in range(1000)]}
    return {
        "drip": drip,
        "endless head": endless_head,
        "hang": hang,
        "a bomb": bomb(packed),
        "a thousand errors": everywhere(errors(1000, 500)),
        "three hundred errors": everywhere(errors(300, 400)),
        "flapping": everywhere(flapping),
        "8 MiB of status": everywhere(status(mission_text=long_text)),
        "a thousand answers": everywhere(status(user_prompt=question)),
        "deep": everywhere(lambda: b'{"state_id": 3, "x": ' + b"[" * 100_000 + b"]" * 100_000 + b"}"),
        "numbers": everywhere(lambda: b'{"state_id": 3, "battery_percentage": ' + b"9" * 200_000 + b"}"),
        "no JSON": everywhere(lambda: b"\xff" * 100_000),
        "401": answering(lambda _path: 401),
        "401 behind the status": behind(status(), {"/users": lambda _path: 401}),
        "an endless queue": behind(status(), {"/mission_queue": without_search}),
        "a long queue": behind(status(), {"/mission_queue": long_queue}),
        "too many missions": behind(status(), {"/missions": lambda _path: too_many, "/mission_queue": one_item}),
        "pictures with two headers": behind(other_map, {"/maps": lambda _path: two_headers}),
        "large pictures": behind(other_map, {"/maps": lambda _path: large}),
        "other questions": behind(other_question),
        "a wrong serial number": behind(other_serial),
        CHANGING: behind(status()),
    }


async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, fate: Fate) -> None:
    try:
        while head := await reader.readuntil(b"\r\n\r\n"):
            length = re.search(rb"(?i)\r\ncontent-length: *(\d+)", head)
            await reader.readexactly(int(length[1]) if length else 0)
            await fate(writer, head.split(b" ", 2)[1].decode().removeprefix(API))
            await writer.drain()
    except (asyncio.IncompleteReadError, asyncio.LimitOverrunError, OSError):
        pass
    finally:
        writer.close()


def changing_certificates() -> ssl.SSLContext:
    """The one by which the robot is known, and at every second connection another."""
    contexts = [tls_of(FIELD), tls_of(PLANT)]
    turn = itertools.cycle(contexts)

    def chosen(connection: ssl.SSLObject, _name: str | None, _context: ssl.SSLContext) -> None:
        connection.context = next(turn)

    contexts[0].sni_callback = chosen  # type: ignore[assignment]
    return contexts[0]


async def main() -> None:
    asyncio.get_running_loop().set_exception_handler(
        lambda _loop, _context: None
    )  # broken handshakes are what is wanted
    servers = []
    for name, fate in fates().items():
        server = await asyncio.start_server(
            lambda reader, writer, fate=fate: talk(reader, writer, fate),  # type: ignore[misc]
            "127.0.0.1",
            0,
            ssl=changing_certificates() if name == CHANGING else None,
        )
        servers.append(server)
        print(
            f"http{'s' if name == CHANGING else ''}://127.0.0.1:{server.sockets[0].getsockname()[1]} {name}", flush=True
        )
    print("ready", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(main())
