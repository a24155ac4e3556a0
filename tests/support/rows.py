"""Values of rows with which the tests of lists fill them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class QueueEntry:
    """Of QueueRow."""

    key: Any
    mission: str
    origin: str = ""
    number: str = ""
    icon: str = ""
    tone: str = "neutral"
    loud: bool = False
    cancellable: bool = True
    runs: bool = False


@dataclass(frozen=True)
class RobotSummary:
    """Of RobotChip."""

    key: int
    name: str
    word: str
    icon: str
    tone: str
    battery: str
    battery_icon: str
    battery_tone: str
    selected: bool
