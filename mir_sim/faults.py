"""Faults of the network and of a machine's web server, injected between a request and its answer on demand or at random.

Each kind was reported by people who run robots: answers lost after the robot has queued the mission, stalls of many seconds while it
drives, bursts of 503 while it docks, connections closed without an answer.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class FaultKind(StrEnum):
    """Kinds of faults; for each, whether the robot handles the request."""

    DROP_REQUEST = "drop_request"  # closed before it is handled
    DROP_RESPONSE = "drop_response"  # handled, answer lost
    DELAY = "delay"  # handled, then answered late
    LATE = "late"  # answered late, handled only then
    HANG = "hang"  # held, never handled nor answered
    STATUS_503 = "status_503"  # refused, not handled
    HTML = "html"  # handled, then a web page
    TRUNCATE = "truncate"  # handled, then half a body
    GARBAGE = "garbage"  # handled, then noise
    TWICE = "twice"  # handled twice, as if something on the way had repeated it


AT_RANDOM = tuple(kind for kind in FaultKind if kind is not FaultKind.TWICE)  # of chaos


@dataclass
class Fault:
    """A fault that hits the next requests that match it.

    Attributes:
        path: exact path below /api/v2.0.0, or "*".
        method: verb in capitals, or "*".
        count: how many requests it still hits; None: all.
        seconds: real seconds, for ``delay`` and ``late``.
    """

    kind: FaultKind
    path: str = "*"
    method: str = "*"
    count: int | None = 1
    seconds: float = 5.0

    def hits(self, method: str, path: str) -> bool:
        return self.method in ("*", method) and self.path in ("*", path)

    def full(self) -> dict[str, Any]:
        return {
            "kind": str(self.kind),
            "method": self.method,
            "path": self.path,
            "count": self.count,
            "seconds": self.seconds,
        }


class FaultList:
    """The active faults, oldest first; a request is hit by the first that matches it. Only then may chance add one.

    Args:
        chaos: share of requests (0…1) that meet a random fault.
        rng: used for nothing else, so that chaos doesn't change what the robot does.
        latency: least and most real seconds for which every other request waits for its answer, which is a fault too.
    """

    def __init__(self, chaos: float, rng: random.Random, latency: tuple[float, float] | None = None) -> None:
        self._faults: list[Fault] = []
        self._chaos = chaos
        self._latency = latency
        self._rng = rng

    def add(self, fault: Fault) -> None:
        self._faults.append(fault)

    def clear(self) -> None:
        self._faults.clear()

    def full(self) -> list[dict[str, Any]]:
        return [fault.full() for fault in self._faults]

    def take(self, method: str, path: str) -> Fault | None:
        """Return the fault that hits this request, if any, and count it. ``path`` is below /api/v2.0.0."""
        for fault in self._faults:
            if fault.hits(method, path):
                if fault.count is not None:
                    fault.count -= 1
                    if fault.count <= 0:
                        self._faults.remove(fault)
                return fault
        if self._chaos and self._rng.random() < self._chaos:
            return Fault(self._rng.choice(AT_RANDOM), path, method, seconds=round(self._rng.uniform(0.2, 8.0), 3))
        return (
            None
            if self._latency is None
            else Fault(FaultKind.DELAY, path, method, seconds=self._rng.uniform(*self._latency))
        )
