"""When Python collects garbage, and how much of it. A window is hundreds of thousands of objects that live as long as
it does; a widget that goes is a thousand more that hold each other, so that only a collection frees them.

By default Python scans all of them from time to time, at any moment and on any thread: pauses of 0.1 s to 1 s. Here the
UI thread collects between two frames, as soon as there is enough to collect: a window that was turned and resized for a
minute left 1 GB behind when only time decided, and 600 MB were never returned, as surviving objects were scattered in
it. Surviving objects are frozen (excluded from the next collections), so that these don't get slower with every visited
screen. Frozen objects that die are only found when everything is scanned. So that comes first, and nothing is frozen
before much more is alive than comes and goes by itself, a form, a dialog and two sections of Settings: at 100,000
objects nearly all of these were frozen before they closed, and 40 MB of them waited for the next scan.

The heap never shrinks, as surviving objects lie everywhere in it. So before it grows beyond its largest size so far,
everything is scanned too: then its size is that of live objects, without garbage.
"""

from __future__ import annotations

import ctypes
import gc
import sys
from collections.abc import Callable

NEW = 25_000  # objects that have come since the last collection: if all are garbage it takes 30 ms
SOME = 5_000  # also, if there may be no room for new objects
AT_REST = 100_000  # new live objects since the last full scan that cause another, and freezing, at the next rest: 0.3 s
ALIVE = 150_000  # also while the screen is in use: until then a collection takes up to 20 ms
AT_THE_LATEST = 250_000  # also while a dialog is open, which would be frozen too: 30 ms
MUCH = 50_000  # garbage, in objects; a sixth of it is only found by another scan
USUAL = 1_000_000  # blocks of a window that has shown its screens: before that nothing can be saved
MORE = 40_000  # blocks that Python's heap may grow beyond its largest live size, 3 MB
BURST = 120_000  # new in one frame when a section is built: garbage leaves room for them
EVERY = 300.0  # s between collections at rest, however little there is
LET_GO = 2.0  # s after which nothing holds removed screens
REST = 5.0  # s without a touch, after which a pause goes unnoticed
M_ARENA_MAX = -8  # of glibc's mallopt
FALLBACK = (400_000, 5, 5)  # Python's own thresholds, for when no frames are drawn (behind other apps on Android)


class Garbage:
    """``now`` is a monotonic clock in s; ``is_calm()`` is whether nothing is open that will close. Call ``touched`` at every touch,
    ``collect_due`` every frame, both on the UI thread."""

    def __init__(self, now: Callable[[], float], is_calm: Callable[[], bool] = lambda: True, room: int = USUAL) -> None:
        self._now, self._is_calm = now, is_calm
        self._touched_at = self._collected_at = now()
        self._alive = 0  # objects that are not frozen, at the last collection
        self._room = room  # blocks that the heap may have before everything is scanned
        self._gone_at: float | None = None
        self._before: tuple[int, int, int] | None = None

    def begin(self) -> None:
        """Leave collections to ``collect_due``; what has been imported stays."""
        self._before = gc.get_threshold()
        gc.set_threshold(*FALLBACK)
        gc.freeze()

    def end(self) -> None:
        """Back to Python's defaults."""
        if self._before is not None:
            gc.set_threshold(*self._before)
            self._before = None
            gc.unfreeze()

    def touched(self, *_args: object) -> None:
        self._touched_at = self._now()

    def much_has_gone(self) -> None:
        """Most of the window was removed and will be rebuilt. Free what can be freed first: otherwise the heap gets
        room for two windows, with the new one scattered in it. Remaining references to the old one end soon."""
        self._scan_all()
        self._gone_at = self._now()

    def collect_due(self, *_args: object) -> None:
        """Collect what is due; mostly nothing."""
        now, new = self._now(), gc.get_count()[0]
        rests = now - self._touched_at >= REST
        if new >= NEW or (new >= SOME and self._is_full(BURST)) or (rests and now - self._collected_at >= EVERY):
            gc.collect()
            self._collected_at = now
            self._alive = len(gc.get_objects(generation=2))
            if self._is_full(MORE // 4):  # else it would be again in a moment
                self._scan_all()
        elif self._is_scan_due(rests) or (self._gone_at is not None and now - self._gone_at >= LET_GO):
            self._scan_all()
            self._gone_at = None

    def _is_full(self, still_to_come: int = 0) -> bool:
        """Takes 0.05 ms."""
        return sys.getallocatedblocks() + still_to_come > self._room

    def _is_scan_due(self, rests: bool) -> bool:
        return self._alive >= AT_THE_LATEST or (self._alive >= (AT_REST if rests else ALIVE) and self._is_calm())

    def _scan_all(self) -> None:
        gc.unfreeze()
        if gc.collect() >= MUCH:
            gc.collect()  # the rest of it: kivy's callbacks for a change of the screen's density hold themselves
        gc.freeze()
        self._alive = 0
        self._room = max(self._room, sys.getallocatedblocks() + MORE)
        give_back()


def give_back() -> None:
    """Return freed memory to the system: glibc keeps some 30 MB of it after an hour of use. Takes 10 ms."""
    if sys.platform == "linux" and hasattr(libc := ctypes.CDLL(None), "malloc_trim"):
        libc.malloc_trim(0)


def share_one_heap() -> None:
    """Let all threads share one heap: glibc would give each its own, and half of these 19 MB were free but useless to
    the others. Call it before threads are started."""
    if sys.platform == "linux" and hasattr(libc := ctypes.CDLL(None), "mallopt"):
        libc.mallopt(M_ARENA_MAX, 1)
