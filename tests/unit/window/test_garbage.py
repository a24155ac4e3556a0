"""All objects are looked at when nobody touches the screen, and now and then even if somebody always does."""
from __future__ import annotations

import gc

from app.window.garbage import AT_THE_LATEST, EVERY, REST, Garbage
from tests.support.clock import VirtualClock


class Watched:
    def __init__(self) -> None:
        self.clock, self.looks = VirtualClock(), 0
        self.garbage = Garbage(self.clock.monotonic, self._collect)

    def _collect(self) -> None:
        self.looks += 1


def test_it_waits_for_a_rest_of_the_hands() -> None:
    watched = Watched()
    watched.clock.advance(EVERY)
    watched.garbage.touched()
    watched.garbage.collect_if_idle()
    assert watched.looks == 0
    watched.clock.advance(REST)
    watched.garbage.collect_if_idle()
    assert watched.looks == 1
    watched.clock.advance(REST)
    watched.garbage.collect_if_idle()
    assert watched.looks == 1


def test_it_does_not_wait_for_ever() -> None:
    watched = Watched()
    for _n in range(round(AT_THE_LATEST / REST) + 1):
        watched.clock.advance(REST)
        watched.garbage.touched()
        watched.garbage.collect_if_idle()
    assert watched.looks == 1


def test_python_is_left_as_it_was() -> None:
    before = gc.get_threshold()
    garbage = Garbage(VirtualClock().monotonic)
    garbage.begin()
    assert gc.get_threshold() != before
    garbage.end()
    garbage.end()
    assert gc.get_threshold() == before
