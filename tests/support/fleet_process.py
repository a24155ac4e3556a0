"""Simulated robots in their own process, so that their memory is not measured with the app's."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import requests

from tests.support.process import PATIENCE, ROOT, environment


@dataclass(frozen=True)
class DistantRobot:
    """``control`` as that of ``mir_sim.FleetRobot``, from outside."""

    name: str
    url: str

    def control(self, commands: dict[str, Any]) -> dict[str, Any] | None:
        """POST /sim; returns the new state, or None while the robot is switched off, to whom nothing can be done."""
        try:
            answer = requests.post(f"{self.url}/sim", json=commands, timeout=PATIENCE)
        except requests.ConnectionError:
            return None
        answer.raise_for_status()
        state: dict[str, Any] = answer.json()
        return state


@dataclass(frozen=True)
class DistantFleet:
    robots: tuple[DistantRobot, ...]


@contextmanager
def serve_apart(robots: int, *, time_scale: float = 1.0) -> Iterator[DistantFleet]:
    """``python -m mir_sim`` on free ports until the block ends."""
    arguments = ["--seed", "1", "--robots", str(robots), "--port", "0", "--time-scale", str(time_scale)]
    with subprocess.Popen(
        [sys.executable, "-m", "mir_sim", *arguments], stdout=subprocess.PIPE, text=True, env=environment(), cwd=ROOT
    ) as process:
        try:
            lines = [process.stdout.readline().split() for _robot in range(robots)]
            yield DistantFleet(tuple(DistantRobot(name, url) for _ready, name, url in lines))
        finally:
            process.terminate()
