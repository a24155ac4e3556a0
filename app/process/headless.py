"""Headless operation: schedule until SIGINT or SIGTERM."""

from __future__ import annotations

import contextlib
import queue
import signal
import time
from collections.abc import Mapping, Sequence

from app.container import Container
from app.failures import BadInput
from app.process import log_file
from app.process.data_directory import DataDirectory
from app.process.host import host
from app.process.terminal import say_in_passing

DemoFleet = tuple[Sequence[tuple[str, str]], Mapping[str, str]]


def run(directory: DataDirectory, demo_robots: DemoFleet | None = None) -> int:
    """Returns the exit code, 0, after a stop was asked for."""
    # Not an Event: its lock may be held by the very wait that the signal interrupts, which would then never return.
    stop: queue.SimpleQueue[int] = queue.SimpleQueue()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _frame: stop.put(number))
    try:
        log_file.start(directory.logs, stderr=True)
        with host(directory, demo=demo_robots) as container:
            if stop.empty():
                _say_ready(container, stop)
            _wait_for(stop, container)
            if damage := container.runner.damage:
                raise BadInput(damage.text)
    except Exception:
        for number in (
            signal.SIGINT,
            signal.SIGTERM,
        ):  # what ends it is said next, perhaps to a terminal that stands still
            signal.signal(number, signal.SIG_DFL)
        raise
    return 0


def _wait_for(stop: queue.SimpleQueue[int], container: Container) -> None:
    """Until a signal, or the database is found damaged. Waits at most a second at a time: a signal that arrives just before a wait begins
    does not end it."""
    while container.runner.damage is None:
        with contextlib.suppress(queue.Empty):
            stop.get(timeout=1.0)
            return


def _say_ready(container: Container, stop: queue.SimpleQueue[int]) -> None:
    """Once every robot has answered its first poll, or 5 s after the start (docs/interfaces.md)."""
    deadline = container.clock.monotonic() + 5.0
    while not container.engine.is_ready and container.clock.monotonic() < deadline and stop.empty():
        time.sleep(0.02)
    say_in_passing("ready")
