"""How quickly does a big simulated fleet answer? Many robots in one process, each asked for its status once a second and kept driving.

Run by hand, nothing else on the machine:

    uv run python -m tests.benchmarks.bench_simulator

Times are from writing the request to having read the whole answer, on kept connections, in milliseconds. The client runs in a process of
its own and spreads its polls over the second, as that many apps would.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import os
import subprocess
import sys
import time
from base64 import b64encode
from hashlib import sha256
from urllib.parse import urlsplit

from mir_sim import MISSIONS
from tests.benchmarks.bench_idle import cpu_seconds

AUTHORIZATION = b64encode(b"distributor:" + sha256(b"distributor").hexdigest().encode()).decode()


def start(robots: int, time_scale: float, history: int) -> tuple[subprocess.Popen[str], list[str]]:
    """The simulator as an integrator starts it, and the addresses of its robots."""
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "mir_sim",
            "--port",
            "0",
            "--robots",
            str(robots),
            "--time-scale",
            str(time_scale),
            "--history",
            str(history),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    return process, [process.stdout.readline().split()[2] for _ in range(robots)]


def request(method: str, path: str, host: str, body: object = None) -> bytes:
    content = b"" if body is None else json.dumps(body).encode()
    head = (
        f"{method} /api/v2.0.0{path} HTTP/1.1\r\nHost: {host}\r\nAuthorization: Basic {AUTHORIZATION}\r\n"
        f"Content-Type: application/json\r\nContent-Length: {len(content)}\r\n\r\n"
    )
    return head.encode() + content


async def ask(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, message: bytes) -> tuple[int, float]:
    """Send one request; return the status code and the seconds until its whole answer was here."""
    began = time.perf_counter()
    writer.write(message)
    head = await reader.readuntil(b"\r\n\r\n")
    length = next(
        int(line.split(b":")[1]) for line in head.lower().split(b"\r\n") if line.startswith(b"content-length")
    )
    await reader.readexactly(length)
    return int(head.split(b" ", 2)[1]), time.perf_counter() - began


async def poll(url: str, first: float, seconds: int, taken: list[float], late: list[float]) -> None:
    """One app: a mission every ten seconds, a status every second."""
    parts = urlsplit(url)
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
    host = parts.netloc
    for turn in range(seconds):
        due = first + turn
        await asyncio.sleep(max(0.0, due - time.perf_counter()))
        late.append(time.perf_counter() - due)
        if turn % 10 == 0:
            status, _ = await ask(
                reader, writer, request("POST", "/mission_queue", host, {"mission_id": MISSIONS[0].guid})
            )
            assert status == 201
        status, duration = await ask(reader, writer, request("GET", "/status", host))
        assert status == 200
        taken.append(duration)
    writer.close()


async def measure(urls: list[str], seconds: int) -> tuple[list[float], list[float]]:
    taken: list[float] = []
    late: list[float] = []
    begin = time.perf_counter() + 1.0
    await asyncio.gather(
        *(poll(url, begin + number / len(urls), seconds, taken, late) for number, url in enumerate(urls))
    )
    return sorted(taken), sorted(late)


def percentile(sorted_values: list[float], share: float) -> float:
    return sorted_values[min(len(sorted_values) - 1, math.ceil(share * len(sorted_values)) - 1)] * 1000


def main() -> None:
    options = argparse.ArgumentParser(prog="python -m tests.benchmarks.bench_simulator")
    options.add_argument("--robots", type=int, default=200)
    options.add_argument("--seconds", type=int, default=20)
    options.add_argument("--time-scale", type=float, default=1.0)
    options.add_argument("--history", type=int, default=0)
    args = options.parse_args()
    process, urls = start(args.robots, args.time_scale, args.history)
    try:
        cpu_before = cpu_seconds(process.pid)
        taken, late = asyncio.run(measure(urls, args.seconds))
        cpu = (cpu_seconds(process.pid) - cpu_before) / args.seconds
        threads = len(os.listdir(f"/proc/{process.pid}/task"))
    finally:
        process.terminate()
        process.wait()
    print(
        f"{args.robots} robots, {len(taken)} status polls in {args.seconds} s, time scale {args.time_scale:g}, {threads} threads, "
        f"{cpu:.0%} of a core, load {os.getloadavg()[0]:.1f}"
    )
    print(
        f"answer ms  p50 {percentile(taken, 0.5):.2f}  p99 {percentile(taken, 0.99):.2f}  max {percentile(taken, 1.0):.2f}   "
        f"(client late by p99 {percentile(late, 0.99):.2f})"
    )


if __name__ == "__main__":
    main()
