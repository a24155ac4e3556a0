"""Garbage is collected by how much there is: a window in use all day never waits for it and never accumulates it."""

from __future__ import annotations

import ctypes
import gc
import os
import subprocess
import sys
import weakref
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.window.garbage import ALIVE, AT_REST, EVERY, IN_USE, LET_GO, MUCH, NEW, REST, SOME, Garbage
from tests.support.clock import VirtualClock

STATM = Path("/proc/self/statm")
FINGER = 1.0  # s between two touches


class Ring:
    """Garbage that only a collection finds."""

    alive = 0

    def __init__(self) -> None:
        self.itself = self
        Ring.alive += 1

    def __del__(self) -> None:
        Ring.alive -= 1


class Kept:
    """Scanned as a widget is, and freed with the last reference."""

    def __init__(self) -> None:
        self.values: list[object] = []


class Window:
    """The frames of a window, in which somebody makes things; ``finger`` says whether he also touches it all the time."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.garbage = Garbage(self.clock.monotonic, room=0)
        self.garbage.begin()

    def frames(self, count: int = 1, *, finger: bool = True) -> None:
        for _n in range(count):
            self.clock.advance(FINGER)
            if finger:
                self.garbage.touched()
            self.garbage.collect_due()

    def rest(self) -> None:
        self.frames(round(REST / FINGER) + 1, finger=False)


def resident() -> float:
    """MiB."""
    return int(STATM.read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.fixture
def new_window() -> Iterator[Window]:
    gc.collect()
    gc.freeze()  # what the tests themselves consist of
    Ring.alive = 0
    window = Window()
    yield window
    window.garbage.end()
    gc.collect()
    gc.freeze()  # as before


@pytest.fixture
def window(new_window: Window) -> Window:
    """Much more was alive in it once."""
    much = [Kept() for _n in range(5 * ALIVE)]
    new_window.frames()
    del much
    gc.unfreeze()
    gc.collect()
    gc.freeze()
    return new_window


def test_what_was_shown_for_a_while_is_collected_in_use(window: Window) -> None:
    shown: list[list[Ring]] = []
    most = 0
    for _n in range(100):
        shown.append([Ring() for _m in range(1000)])
        del shown[:-20]
        window.frames()
        most = max(most, Ring.alive)
    assert most <= 20_000 + NEW + 1000


@pytest.mark.long
def test_what_stays_is_frozen(window: Window) -> None:
    before = gc.get_freeze_count()
    stays = many_more(window, ALIVE)
    window.frames()
    assert gc.get_freeze_count() >= before + len(stays)


def frozen_garbage(window: Window) -> int:
    """A screen that existed at the scan and was discarded since."""
    old = [Ring() for _n in range(AT_REST)]
    window.frames()
    window.rest()
    assert gc.get_freeze_count() >= len(old)
    return len(old)


def many_more(window: Window, least: int) -> list[Kept]:
    """As many objects, in use."""
    new: list[Kept] = []
    while 2 * len(new) < least:
        new += [Kept() for _m in range(NEW // 2)]
        window.frames()
    return new


@pytest.mark.long
def test_discarded_frozen_objects_are_collected_at_rest_when_as_many_are_new(window: Window) -> None:
    count = frozen_garbage(window)
    window.rest()
    assert Ring.alive == count
    new = many_more(window, AT_REST)
    assert Ring.alive == count
    window.rest()
    assert Ring.alive == 0
    assert 2 * len(new) >= AT_REST


@pytest.mark.long
def test_a_person_who_touches_the_screen_does_not_wait_for_a_scan_of_everything(window: Window) -> None:
    """It takes a second, and what is pressed in it is not what was meant."""
    count = frozen_garbage(window)
    new = many_more(window, 2 * ALIVE)
    assert Ring.alive == count
    window.rest()
    assert Ring.alive == 0
    assert len(new) >= ALIVE


@pytest.mark.long
def test_frozen_garbage_does_not_wait_for_a_rest_for_ever(new_window: Window) -> None:
    frozen_garbage(new_window)
    stays = many_more(new_window, 2 * IN_USE)
    assert Ring.alive == 0
    assert stays


@pytest.mark.long
def test_a_form_and_a_dialog_that_were_open_for_long_are_no_frozen_garbage(window: Window) -> None:
    """However many dialogs were opened and closed since."""
    form = [Ring() for _m in range(3 * NEW // 2)]
    for _n in range(9):
        dialog = [Ring() for _m in range(3 * NEW // 2)]
        window.frames(3)
        del dialog
    del form
    many_more(window, NEW)
    assert Ring.alive == 0


@pytest.mark.long
def test_what_closes_soon_after_it_was_opened_is_no_frozen_garbage(window: Window) -> None:
    """Dialogs, as large as the largest, one after the other: not one of them waits for the long scan."""
    for _n in range(3):
        dialog = [Ring() for _m in range(2 * NEW)]
        window.frames()
        assert Ring.alive == len(dialog)
        del dialog
    many_more(window, NEW)
    assert Ring.alive == 0


class Follower:
    """As kivy's callbacks: in a list until its subject is freed, then held only by itself."""

    alive = 0

    def __init__(self, followed: Ring, all_of_them: dict[int, Follower]) -> None:
        self._all = all_of_them
        self._followed = weakref.ref(followed, self.leave)
        all_of_them[id(self)] = self
        Follower.alive += 1

    def leave(self, _gone: weakref.ref[Ring]) -> None:
        del self._all[id(self)]

    def __del__(self) -> None:
        Follower.alive -= 1


@pytest.mark.long
def test_what_only_a_second_scan_finds_is_not_frozen(window: Window) -> None:
    all_of_them: dict[int, Follower] = {}
    discarded = [Ring() for _n in range(MUCH)]
    for ring in discarded:
        Follower(ring, all_of_them)
    assert Follower.alive == MUCH
    del discarded, ring
    window.garbage.much_has_gone()
    assert (Ring.alive, Follower.alive, len(all_of_them)) == (0, 0, 0)


@pytest.mark.long
def test_the_heap_does_not_grow_beyond_its_room_while_little_has_come(new_window: Window) -> None:
    """At most by what comes before it is looked at."""
    count = frozen_garbage(new_window)
    stays: list[Kept] = []
    most = new_window.garbage._room + IN_USE
    while Ring.alive == count:
        stays += [Kept() for _m in range(SOME // 2)]
        assert sys.getallocatedblocks() <= most + 2 * SOME
        new_window.frames()
    assert Ring.alive == 0


@pytest.mark.long
def test_objects_released_a_moment_later_are_collected_then(window: Window) -> None:
    held = Ring()
    window.garbage.much_has_gone()
    del held
    assert Ring.alive == 1
    window.frames(round(LET_GO / FINGER))
    assert Ring.alive == 0


@pytest.mark.long
def test_unreferenced_objects_are_collected_before_the_window_is_rebuilt(window: Window) -> None:
    frozen_garbage(window)
    window.garbage.much_has_gone()
    assert Ring.alive == 0


@pytest.mark.long
def test_freed_memory_goes_back_to_the_system_when_everything_is_scanned(window: Window) -> None:
    size = 2_000  # bytes, which malloc takes from one heap
    blocks = [bytes(size) for _n in range(50_000)]
    stays = blocks[-1]  # above all others, so that the heap can't shrink by itself
    frozen_garbage(window)
    del blocks
    before = resident()
    many_more(window, ALIVE)
    window.rest()
    assert Ring.alive == 0
    assert before - resident() > 30_000 * size / 2**20
    assert stays


@pytest.mark.long
def test_a_little_garbage_waits_for_a_rest(window: Window) -> None:
    window.rest()
    Ring()
    window.frames(round(EVERY / FINGER))
    assert Ring.alive == 1
    window.rest()
    assert Ring.alive == 0


HEAPS = """
import ctypes, threading
from app.window.garbage import share_one_heap
{first}
ready = threading.Barrier(5)
def work():
    blocks = [bytes(2_000) for _n in range(1_000)]
    ready.wait()
    ready.wait()
for _n in range(4):
    threading.Thread(target=work).start()
ready.wait()
libc = ctypes.CDLL(None)
libc.malloc_info(0, ctypes.c_void_p.in_dll(libc, "stdout"))
libc.fflush(None)
ready.wait()
"""


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "malloc_info"), reason="another system's malloc"
)
@pytest.mark.parametrize(("first", "one"), [("", False), ("share_one_heap()", True)])
def test_all_threads_share_one_heap(first: str, one: bool) -> None:
    said = subprocess.run(
        [sys.executable, "-c", HEAPS.format(first=first)], capture_output=True, text=True, check=True, timeout=60
    ).stdout
    assert (said.count("<heap nr=") == 1) == one


def test_python_is_left_unchanged() -> None:
    before = gc.get_threshold()
    garbage = Garbage(VirtualClock().monotonic)
    garbage.begin()
    assert gc.get_threshold() != before
    garbage.end()
    garbage.end()
    assert gc.get_threshold() == before
