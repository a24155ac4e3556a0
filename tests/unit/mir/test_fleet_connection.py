"""One answer serves all of a fleet's robots."""

from __future__ import annotations

import threading

import pytest

from app.mir.errors import TimedOut
from app.mir.fleet_connection import FRESH, FleetConnection


class Asking:
    """A client and its questions; each takes ``seconds``."""

    def __init__(self) -> None:
        self.now, self.asked, self.pauses, self.seconds = 0.0, 0, 0, 0.0
        self.connection = FleetConnection(clock=lambda: self.now)
        self.problem: TimedOut | None = None

    def on_pause(self) -> None:
        self.pauses += 1

    def ask(self) -> int:
        self.asked += 1
        self.on_pause()
        self.now += self.seconds
        if self.problem is not None:
            raise self.problem
        return self.asked

    def get(self) -> int:
        return self.connection.shared(self, "robots", self.ask)


@pytest.fixture
def asking() -> Asking:
    return Asking()


def test_an_answer_serves_for_a_second(asking: Asking) -> None:
    assert [asking.get(), asking.get()] == [1, 1]
    asking.now += FRESH + 0.1
    assert asking.get() == 2
    asking.connection.forget("robots")
    assert asking.get() == 3


def test_an_error_serves_those_that_have_waited_for_it(asking: Asking) -> None:
    asking.problem, asking.seconds = TimedOut(seconds=5), 5.0
    for _ in range(2):
        with pytest.raises(TimedOut):
            asking.get()
    assert asking.asked == 1


@pytest.mark.parametrize("later", [0.1, FRESH + 0.1])
def test_an_error_serves_none_that_comes_later(asking: Asking, later: float) -> None:
    """A start that is due is not put off because a moment before it something failed."""
    asking.problem = TimedOut(seconds=5)
    with pytest.raises(TimedOut):
        asking.connection.shared(asking, "user", asking.ask, 10.0)
    asking.problem = None
    asking.now += later
    assert [asking.connection.shared(asking, "user", asking.ask, 10.0) for _ in range(2)] == [2, 2]


def test_nothing_else_is_done_while_others_may_wait_for_the_answer(asking: Asking) -> None:
    """What a worker does in a pause may need the same answer."""
    asking.get()
    assert asking.pauses == 0
    asking.on_pause()
    assert asking.pauses == 1


def test_a_slow_answer_serves_all_that_waited_for_it(asking: Asking) -> None:
    begun, go_on = threading.Event(), threading.Event()
    found: list[int] = []

    def slowly() -> int:
        asking.asked += 1
        begun.set()
        assert go_on.wait(10)
        return 7

    def get() -> None:
        found.append(asking.connection.shared(asking, "robots", slowly))

    came = threading.Semaphore(0)
    asking.connection.clock = lambda: (came.release(), asking.now)[1]
    threads = [threading.Thread(target=get) for _ in range(3)]
    threads[0].start()
    assert begun.wait(10)
    for each in threads[1:]:
        each.start()
    for _ in range(4):  # the first has looked at the clock twice
        assert came.acquire(timeout=10)
    asking.now += 5 * FRESH
    go_on.set()
    for each in threads:
        each.join(10)
    assert (found, asking.asked) == ([7, 7, 7], 1)


def test_an_answer_of_before_a_change_is_not_kept(asking: Asking) -> None:
    def change_comes() -> int:
        asking.connection.forget("robots")
        return 0

    assert asking.connection.shared(asking, "robots", change_comes) == 0
    assert asking.get() == 1
