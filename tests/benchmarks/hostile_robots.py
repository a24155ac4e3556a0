"""Robots that answer as nobody should: each fate on a port of its own, at every path.

Started by ``bench_hostile``: ``python -m tests.benchmarks.hostile_robots`` prints a line ``port fate`` for each, then ``ready``, and runs
until it is terminated.
"""
from __future__ import annotations

import asyncio
import gzip
import itertools
import json
from collections.abc import Awaitable, Callable
from typing import Any

STATUS: dict[str, Any] = {
    "state_id": 3, "state_text": "Ready", "battery_percentage": 80.0, "robot_name": "Hostile", "robot_model": "MiR100", "errors": [],
    "serial_number": "H1", "mission_queue_id": None, "mission_text": "", "uptime": 1000}
_number = itertools.count(1)


def response(body: bytes, more: str = "") -> bytes:
    return f"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n{more}\r\n".encode() + body


def status(**changes: Any) -> Callable[[], bytes]:
    return lambda: json.dumps(STATUS | changes).encode()


def errors(count: int, length: int) -> Callable[[], bytes]:
    """Others at each read."""
    def body() -> bytes:
        begin = next(_number) * count
        found = [{"code": begin + n, "description": f"{begin + n} " + "x" * length, "module": "Wheels"} for n in range(count)]
        return json.dumps(STATUS | {"state_id": 12, "errors": found}).encode()
    return body


def flapping() -> bytes:
    """In error, and well, and in another error."""
    number = next(_number)
    found = [{"code": number, "description": f"fault {number}", "module": "Wheels"}] if number % 2 else []
    return json.dumps(STATUS | {"state_id": 12 if found else 3, "errors": found}).encode()


def endless_queue() -> bytes:
    return json.dumps([{"id": n, "state": "Pending", "url": f"/v2.0.0/mission_queue/{n}"} for n in range(50_000)]).encode()


BODIES: dict[str, Callable[[], bytes]] = {
    "a thousand errors": errors(1000, 500),
    "three hundred errors": errors(300, 400),
    "flapping": flapping,
    "8 MiB of status": status(mission_text="x" * (8 << 20)),
    "a thousand answers": status(user_prompt={"guid": "g", "question": "Which? " * 1000, "options": [f"Door {n}" for n in range(1000)]}),
    "deep": lambda: b'{"state_id": 3, "x": ' + b"[" * 100_000 + b"]" * 100_000 + b"}",
    "numbers": lambda: b'{"state_id": 3, "battery_percentage": ' + b"9" * 200_000 + b"}",
    "an endless queue": endless_queue,
    "no JSON": lambda: b"\xff" * 100_000,
}


async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, fate: str) -> None:
    try:
        while await reader.readuntil(b"\r\n\r\n"):
            await FATES[fate](writer)
            await writer.drain()
    except (asyncio.IncompleteReadError, asyncio.LimitOverrunError, OSError):
        pass
    finally:
        writer.close()


async def drip(writer: asyncio.StreamWriter) -> None:
    for byte in response(status()()):
        writer.write(bytes([byte]))
        await writer.drain()
        await asyncio.sleep(0.2)


async def endless_head(writer: asyncio.StreamWriter) -> None:
    writer.write(b"HTTP/1.1 200 OK\r\n")
    while True:
        writer.write(b"X-Noise: " + b"n" * 1000 + b"\r\n")
        await writer.drain()


async def bomb(writer: asyncio.StreamWriter) -> None:
    writer.write(response(_BOMB, "Content-Encoding: gzip\r\n"))


async def hang(writer: asyncio.StreamWriter) -> None:
    await asyncio.sleep(3600)


def answering(body: Callable[[], bytes]) -> Callable[[asyncio.StreamWriter], Awaitable[None]]:
    async def answer(writer: asyncio.StreamWriter) -> None:
        writer.write(response(body()))
    return answer


_BOMB = gzip.compress(b" " * (512 << 20), 9)
FATES = {"drip": drip, "endless head": endless_head, "a bomb": bomb, "hang": hang,
         **{fate: answering(body) for fate, body in BODIES.items()}}


async def main() -> None:
    servers = []
    for fate in FATES:
        server = await asyncio.start_server(lambda reader, writer, fate=fate: talk(reader, writer, fate), "127.0.0.1", 0)  # type: ignore[misc]
        servers.append(server)
        print(server.sockets[0].getsockname()[1], fate, flush=True)
    print("ready", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(main())
