"""The way of a start through the code: which functions of the app are under way wherever it is handed on.

That is where it goes to another thread (a pool, a queue, an inbox), to the disk (its schedule, its intent), into the
worker's hands, and to the socket. Functions called on the side, which have returned by then, are not on the way, nor are
widgets, which pass a tap on; a lambda or nested function counts as the function that it is written in.
"""

from __future__ import annotations

import queue
import re
import socket
import sqlite3
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from app.database import writer
from app.services.dispatch import runner, sending

ROOT = Path(__file__).parents[2]
APP = str(ROOT / "app")
Function = tuple[str, str]  # its name, and its module's path
# Where a start is handed on, in this order: a function on the way there, and the last one.
HANDED_ON = (
    ("FormModel.save", "Background.run"),
    ("Catalogue.save_schedule", "ThreadedWriter.write"),
    ("save", "Table.add"),
    ("Planner.insert_due", "ThreadedWriter.write"),
    ("Planner._take_due", "ExecutionRepository.add_each_once"),
    ("Planner.insert_due", "Runner.post"),
    ("RobotWorker.handle", "Sending.take_over"),
    ("RobotClient.enqueue", "RobotConnection.urlopen"),
)


def documented() -> list[Function]:
    """As in the picture of docs/architecture.md."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    return re.findall(r"([\w.]+) +(app/[\w/]+\.py)", page)


class Way:
    """Notes from when it is made until ``patch`` is undone; ``begin`` forgets what was before."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self._stacks: list[list[Function]] = []

        class Noting(queue.SimpleQueue):
            put = self._noting(queue.SimpleQueue.put)

        patch.setattr(writer.queue, "SimpleQueue", Noting)
        patch.setattr(ThreadPoolExecutor, "submit", self._noting(ThreadPoolExecutor.submit))
        patch.setattr(socket.socket, "sendall", self._noting(socket.socket.sendall))
        patch.setattr(sending, "Attempt", self._noting(sending.Attempt))
        patch.setattr(runner.threading.Condition, "notify", self._noting(runner.threading.Condition.notify))

    def watch(self, connection: sqlite3.Connection) -> None:
        """Of the writer: its statements are noted, too."""
        connection.set_trace_callback(lambda _sql: self._note())

    def begin(self) -> None:
        self._stacks.clear()

    def functions(self) -> list[Function]:
        """In the order in which a start passes them, each once."""
        found, stacks = list[Function](), iter(list(self._stacks))
        for through, last in HANDED_ON:
            for stack in stacks:
                names = [name for name, _module in stack]
                if through in names and last in names:
                    found += dict.fromkeys(stack[: names.index(last) + 1])
                    break
            else:
                raise AssertionError(f"no start came through {through} to {last}")
        return list(dict.fromkeys(found))

    def _noting(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def noting(*args: Any, **values: Any) -> Any:
            self._note()
            return call(*args, **values)

        return noting

    def _note(self) -> None:
        stack, frame = list[Function](), sys._getframe()
        while frame := frame.f_back:  # type: ignore[assignment]
            if frame.f_code.co_filename.startswith(APP):
                name = frame.f_code.co_qualname.partition(".<locals>")[0]
                module = str(Path(frame.f_code.co_filename).relative_to(ROOT))
                stack += [(name, module)] if not module.startswith("app/widgets/") else []
        self._stacks.append(stack[::-1])
