"""How much work something is, counted instead of timed: lines of the app that run."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

PACKAGE = "/app/services/planning/"


def steps(work: Callable[[], object], most: int | None = None) -> int:
    """Lines of ``PACKAGE`` that run in this thread; an AssertionError as soon as they are more than ``most``."""
    count = 0

    def line(frame: FrameType, event: str, _argument: Any) -> Any:
        nonlocal count
        count += event == "line"
        assert most is None or count <= most, f"more than {most} steps"
        return line

    def call(frame: FrameType, _event: str, _argument: Any) -> Any:
        return line if PACKAGE in frame.f_code.co_filename else None

    before = sys.gettrace()
    sys.settrace(call)
    try:
        work()
    finally:
        sys.settrace(before)
    return count
