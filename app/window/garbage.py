"""When Python looks for garbage. A window is hundreds of thousands of objects that live as long as it does.

Python's own habit is to walk through all of them every now and then, in the middle of whatever is going on: measured, half the time in
which a screen or dialog is built, and pauses of some 100 ms. Here the young objects are looked at less often, and all of them only while
nobody touches the screen.
"""
from __future__ import annotations

import gc
from collections.abc import Callable

YOUNG = 20_000               # objects more than before, until the young are looked at; Python's own is 700 (2,000)
MIDDLE = 10
NEVER = 1_000_000            # of the looks at the middle-aged, until Python by itself looks at all
EVERY = 300.0                # s between two looks at everything
REST = 5.0                   # s without a touch, after which a pause is not felt
AT_THE_LATEST = 1800.0       # s; whoever touches the screen all day has to bear it


class Garbage:
    """``now`` is a monotonic clock in s. Call ``touched`` with every touch and ``look`` every few seconds, both on the UI thread."""

    def __init__(self, now: Callable[[], float], collect: Callable[[], object] = gc.collect) -> None:
        self._now, self._collect = now, collect
        self._touched_at = self._looked_at = now()
        self._before: tuple[int, int, int] | None = None

    def begin(self) -> None:
        """From now on all objects are only looked at by ``look``."""
        self._before = gc.get_threshold()
        gc.set_threshold(YOUNG, MIDDLE, NEVER)

    def end(self) -> None:
        """As Python does it."""
        if self._before is not None:
            gc.set_threshold(*self._before)
            self._before = None

    def touched(self, *_args: object) -> None:
        self._touched_at = self._now()

    def look(self, *_args: object) -> None:
        """Collect all garbage, if it is time and nobody is at the screen."""
        now = self._now()
        since = now - self._looked_at
        if since >= AT_THE_LATEST or (since >= EVERY and now - self._touched_at >= REST):
            self._collect()
            self._looked_at = self._now()
