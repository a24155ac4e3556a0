"""When Python collects garbage, and how much of it. A window is hundreds of thousands of objects that live as long as
it does; a widget that goes is a thousand more that hold each other, so that only a collection frees them.

By default Python scans all of them from time to time, at any moment and on any thread: pauses of 0.1 s to 1 s. Here the
UI thread collects between two frames, as soon as there is enough to collect: a window that was turned and resized for a
minute left 1 GB behind when only time decided, and 600 MB were never returned, as surviving objects were scattered in
it. Surviving objects are frozen (excluded from the next collections), so that these don't get slower with every visited
screen. Frozen objects that die are only found when everything is scanned. That takes 0.3 s to 2 s, in which no thread
of Python runs, so it waits until the screen is not touched: a finger that is not answered presses again, and presses
what has come instead.

The heap never shrinks, as surviving objects lie everywhere in it. So before it grows far beyond its largest size so
far, everything is scanned in use too: then its size is that of live objects, without garbage.
"""

from __future__ import annotations

import ctypes
import gc
import sys
from collections.abc import Callable

NEW = 25_000  # objects that have come since the last collection: if all are garbage it takes 30 ms
SOME = 5_000  # also, if there may be no room for new objects
AT_REST = 100_000  # new live objects since the last full scan that cause another at the next rest
ALIVE = 150_000  # new live objects that are frozen in use: until then a collection takes up to 20 ms
MUCH = 50_000  # garbage, in objects; a sixth of it is only found by another scan
USUAL = 1_200_000  # blocks of a window that has shown its screens: before that nothing can be saved
MORE = 40_000  # blocks that Python's heap may grow beyond its largest live size, 3 MB
IN_USE = 200_000  # blocks more, 15 MB, until the screen rests
BURST = 120_000  # new in one frame when a section is built: garbage leaves room for them
EVERY = 300.0  # s between collections at rest, however little there is
LET_GO = 2.0  # s after which nothing holds removed screens
REST = 5.0  # s without a touch, after which a pause goes unnoticed
M_ARENA_MAX = -8  # of glibc's mallopt
FALLBACK = (400_000, 5, 5)  # Python's own thresholds, for when no frames are drawn (behind other apps on Android)


class Garbage:
    """``now`` is a monotonic clock in s. Call ``touched`` at every touch, ``collect_due`` every frame, both on the UI
    thread."""

    def __init__(self, now: Callable[[], float], room: int = USUAL) -> None:
        self._now = now
        self._touched_at = self._collected_at = now()
        self._is_scan_due = False  # at the next rest
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
        room = self._room if rests else self._room + IN_USE
        if new >= NEW or (new >= SOME and blocks() > room - BURST) or (rests and now - self._collected_at >= EVERY):
            gc.collect()
            self._collected_at = now
            alive, close = len(gc.get_objects(generation=2)), MORE // 4  # else it would be full again in a moment
            if alive >= AT_REST or blocks() > self._room - close:
                self._is_scan_due = True
            if blocks() > room - close:
                self._scan_all()
            elif alive >= ALIVE:
                gc.freeze()
        elif (rests and self._is_scan_due) or (self._gone_at is not None and now - self._gone_at >= LET_GO):
            self._scan_all()
            self._gone_at = None

    def _scan_all(self) -> None:
        gc.unfreeze()
        if gc.collect() >= MUCH:
            gc.collect()  # the rest of it: kivy's callbacks for a change of the screen's density hold themselves
        gc.freeze()
        self._is_scan_due = False
        self._room = max(self._room, blocks() + MORE)
        give_back()


def blocks() -> int:
    """Of Python's heap, in use. Takes 0.05 ms."""
    return sys.getallocatedblocks()


def give_back() -> None:
    """Return freed memory to the system: glibc keeps some 30 MB of it after an hour of use. Takes 10 ms."""
    if sys.platform == "linux" and hasattr(libc := ctypes.CDLL(None), "malloc_trim"):
        libc.malloc_trim(0)


def share_one_heap() -> None:
    """Let all threads share one heap: glibc would give each its own, and half of these 19 MB were free but useless to
    the others. Call it before threads are started."""
    if sys.platform == "linux" and hasattr(libc := ctypes.CDLL(None), "mallopt"):
        libc.mallopt(M_ARENA_MAX, 1)
