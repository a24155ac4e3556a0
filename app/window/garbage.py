"""When Python collects garbage. A window is hundreds of thousands of objects that live as long as it does.

By default Python scans all of them from time to time, in the middle of whatever is going on: measured, half the time in
which a screen or dialog is built, and pauses of some 100 ms. Here young objects are scanned less often, and all of them only while
nobody touches the screen.
"""
from __future__ import annotations

import gc
from collections.abc import Callable

YOUNG = 20_000               # allocations between scans of young objects; Python's default is 700 (2,000 from 3.13)
MIDDLE = 10
NEVER = 1_000_000            # scans of the middle generation before a full one
EVERY = 300.0                # s between full collections
REST = 5.0                   # s without a touch, after which a pause goes unnoticed
AT_THE_LATEST = 1800.0       # s between full collections, also while the screen is in use


class Garbage:
    """``now`` is a monotonic clock in s. Call ``touched`` at every touch, ``collect_if_idle`` every few seconds, on the UI thread."""

    def __init__(self, now: Callable[[], float], collect: Callable[[], object] = gc.collect) -> None:
        self._now, self._collect = now, collect
        self._touched_at = self._collected_at = now()
        self._before: tuple[int, int, int] | None = None

    def begin(self) -> None:
        """Leave full collections to ``collect_if_idle``."""
        self._before = gc.get_threshold()
        gc.set_threshold(YOUNG, MIDDLE, NEVER)

    def end(self) -> None:
        """Back to Python's defaults."""
        if self._before is not None:
            gc.set_threshold(*self._before)
            self._before = None

    def touched(self, *_args: object) -> None:
        self._touched_at = self._now()

    def collect_if_idle(self, *_args: object) -> None:
        """Collect all garbage if it is time and nobody uses the screen."""
        now = self._now()
        since = now - self._collected_at
        if since >= AT_THE_LATEST or (since >= EVERY and now - self._touched_at >= REST):
            self._collect()
            self._collected_at = self._now()
