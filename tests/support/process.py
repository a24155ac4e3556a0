"""The app as a real process, as an integrator starts it, and configurations to give it."""

from __future__ import annotations

import json
import os
import queue
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from app.container import Container
from app.process.data_directory import DataDirectory
from app.services.catalogue import configuration
from mir_sim import MISSIONS, Fleet

ROOT = Path(__file__).parents[2]
PATIENCE = 60.0  # s that any single step may take on a busy machine


def environment() -> dict[str, str]:
    """Without a display, and without variables that would move the data or write past Python's buffers."""
    without = "DISPLAY", "WAYLAND_DISPLAY", "PYTHONUNBUFFERED"
    return {name: value for name, value in os.environ.items() if name not in without} | {"TZ": "Europe/Helsinki"}


def command(data_dir: Path, *arguments: object) -> list[str]:
    return [sys.executable, str(ROOT / "main.py"), "--data-dir", str(data_dir), *map(str, arguments)]


def run(
    data_dir: Path, *arguments: object, timeout: float = 60.0, before: Sequence[str] = ()
) -> subprocess.CompletedProcess[str]:
    """A one-shot command, to its end; ``before`` it the command that starts it."""
    return subprocess.run(
        [*before, *command(data_dir, *arguments)],
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=timeout,
        env=environment(),
        cwd=ROOT,
        check=False,
    )


def begun(data_dir: Path, *arguments: object) -> subprocess.Popen[str]:
    """A command that goes its own way."""
    return subprocess.Popen(
        command(data_dir, *arguments),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        env=environment(),
        cwd=ROOT,
        creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # on Windows Ctrl-Break goes to a group
    )


def answer(data_dir: Path, *arguments: object, before: Sequence[str] = ()) -> str:
    """What a one-shot command prints that succeeds."""
    done = run(data_dir, *arguments, before=before)
    assert (done.returncode, done.stderr) == (0, ""), done
    return done.stdout


def refusal(data_dir: Path, *arguments: object, code: int = 2, before: Sequence[str] = ()) -> str:
    """The one line that a command prints which ends with that code."""
    done = run(data_dir, *arguments, before=before)
    assert (done.returncode, done.stdout, is_one_line(done.stderr)) == (code, "", True), done
    return done.stderr


@contextmanager
def read_only(directory: Path) -> Iterator[list[str]]:
    """Nothing in it can be written. Returns the command that removes the right to write from root too; no other user
    has it."""
    places = [directory, *directory.rglob("*")]
    modes = {place: place.stat().st_mode for place in places}
    for place in places:
        place.chmod(0o500 if place.is_dir() else 0o400)
    try:
        yield ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.geteuid() == 0 else []
    finally:
        for place, mode in modes.items():
            place.chmod(mode)


class App:
    """``main.py --headless`` on a data directory. Everything it says is kept."""

    def __init__(self, data_dir: Path, *arguments: object) -> None:
        self.data_dir = data_dir
        self.process = begun(data_dir, "--headless", *arguments)
        self.stderr: list[str] = []
        self._stdout: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._readers = [
            threading.Thread(target=self._read_stdout, daemon=True),
            threading.Thread(target=self._read_stderr, daemon=True),
        ]
        for reader in self._readers:
            reader.start()

    def _read_stdout(self) -> None:
        for line in self.process.stdout:
            self._stdout.put(line.rstrip("\n"))

    def _read_stderr(self) -> None:
        for line in self.process.stderr:
            self.stderr.append(line.rstrip("\n"))

    def wait_ready(self) -> App:
        line = self._stdout.get(timeout=PATIENCE)
        assert line == "ready", line
        return self

    def said(self, text: str) -> bool:
        return any(text in line for line in list(self.stderr))

    def kill(self) -> None:
        """A power cut, as far as a process can have one."""
        self.process.kill()
        self._ended()

    def stop(self, by: signal.Signals = signal.SIGTERM) -> int:
        """Ask it to end; its exit code."""
        self.process.send_signal(by)
        return self._ended()

    def _ended(self) -> int:
        code = self.process.wait(PATIENCE)
        for reader in self._readers:
            reader.join(PATIENCE)
        self.process.stdout.close()
        self.process.stderr.close()
        return code


@contextmanager
def running(data_dir: Path, *arguments: object) -> Iterator[App]:
    """The app, ready, and ended at the end of the block if the test has not done so."""
    app = App(data_dir, *arguments)
    try:
        yield app.wait_ready()
    finally:
        if app.process.poll() is None:
            app.kill()


def wait_for(condition: Callable[[], Any], within: float = PATIENCE, what: str = "") -> Any:
    """Wait until it holds; its value."""
    deadline = time.monotonic() + within
    while not (found := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {within} s: {what or condition}")
        time.sleep(0.05)
    return found


# ---------------------------------------------------------------------- configurations
def configuration_of(
    fleet: Fleet | None = None, *, schedules: Sequence[dict[str, Any]] = (), **settings: Any
) -> dict[str, Any]:
    """Robots of a fleet, all missions that simulated robots have, and schedules."""
    robots = [
        {"name": robot.name, "address": robot.url, "username": "distributor", "password": "distributor"}
        for robot in (fleet.robots if fleet else ())
    ]
    return {
        "format": "amr-scheduler/1",
        "settings": {"timezone": "UTC", "history_limit": None, **settings},
        "robots": robots,
        "missions": [{"name": mission.name, "guid": mission.guid} for mission in MISSIONS],
        "schedules": list(schedules),
    }


def once_now(robot: str, mission: str, name: str, **values: Any) -> dict[str, Any]:
    """A schedule whose one start is this very minute: due as soon as it is imported."""
    return {
        "name": name,
        "robot": robot,
        "mission": mission,
        "start": f"{datetime.now(UTC):%Y-%m-%dT%H:%M}",
        "timezone": "UTC",
        "respect_working_days": False,
        **values,
    }


def write_configuration(path: Path, content: dict[str, Any]) -> Path:
    path.write_text(json.dumps({"format": "amr-scheduler/1"} | content), encoding="utf-8")
    return path


def import_configuration(data_dir: Path, content: dict[str, Any]) -> str:
    """Returns what the command prints."""
    path = write_configuration(data_dir.with_name(f"{data_dir.name}-configuration.json"), content)
    return answer(data_dir, "--import-config", path)


def prepared(data_dir: Path, content: dict[str, Any]) -> None:
    """The same in this process, which is quicker than to start another."""
    container = Container.open(DataDirectory.prepare(data_dir).path)
    try:
        configuration.import_configuration(container.catalogue, json.dumps(content).encode())
    finally:
        container.close()


def is_one_line(text: str, words: str = "") -> bool:
    """Every refusal is one line without a traceback, here with these words."""
    return bool(re.fullmatch(r"main\.py: [^\n]+\n", text)) and "Traceback" not in text and words in text
