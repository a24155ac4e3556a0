"""The life without a window: schedule until SIGINT or SIGTERM."""
from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Mapping, Sequence

from app import logs
from app.container import Container
from app.data_directory import DataDirectory
from app.host import host

DemoFleet = tuple[Sequence[tuple[str, str]], Mapping[str, str]]


def live(directory: DataDirectory, demo_robots: DemoFleet | None = None) -> int:
    """Returns the exit code, 0, after a stop was asked for."""
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    logs.start(directory.logs, stderr=True)
    with host(directory, demo=demo_robots) as container:
        if not stop.is_set():
            _say_ready(container, stop)
            stop.wait()
    return 0


def _say_ready(container: Container, stop: threading.Event) -> None:
    """Once every robot has answered its first poll, or 5 s after the start (contract: "ready")."""
    deadline = container.clock.monotonic() + 5.0
    while not container.loop.is_ready and container.clock.monotonic() < deadline and not stop.is_set():
        stop.wait(0.02)
    print("ready", flush=True)
    sys.stdout.flush()
