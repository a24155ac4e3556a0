"""What is known of the robots at present, apart from the database."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Seen:
    """Of a robot, by its id: whether it is silent or stopped, whether it charges and may be sent elsewhere, and whether it has a mission,
    by its guid, as far as its list is known. Without them nothing is known."""

    is_out: Callable[[int], bool] = lambda _robot_id: False
    charges: Callable[[int], bool] = lambda _robot_id: False
    has: Callable[[int, str], bool] = lambda _robot_id, _guid: True


NOTHING_SEEN = Seen()
