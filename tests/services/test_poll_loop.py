"""The threads around the services: a cycle reaches every robot, in turns when there are very many, and nobody waits for a dead one."""
from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence

import pytest

from app.domain.clock import SystemClock
from app.domain.models import Execution, Robot
from app.services.dispatch import poll_loop
from app.services.dispatch.planner import DueBatch
from app.services.dispatch.poll_loop import POLLED_AT_ONCE, PollLoop
from app.services.live.alarms import Alarms
from app.services.live.changes import Changes, Topic
from tests.support.process import wait_for


class CountingWorker:
    """A worker that only counts its polls; ``hangs`` until the test ends."""

    def __init__(self, robot: Robot, polls: Counter[int]) -> None:
        self.robot, self.polled, self.watched, self.clock_offset = robot, False, False, None
        self._polls = polls
        self.hangs: Callable[[], None] = lambda: None      # or raises
        self.told: list[bool] = []       # whether the ledger may hold something new, round by round

    def step(self, poll: bool, due_soon: bool = False, intents: Sequence[Execution] = (), changed: bool = True) -> float:
        self.told.append(changed)
        self.hangs()
        self._polls[self.robot.id] += poll
        self.polled = True
        return 60.0

    def close(self, untaken: Sequence[Execution] = ()) -> None: ...


class QuietScheduler:
    """Nothing is ever due."""

    def start(self) -> None: ...
    def stop(self) -> None: ...
    def tidy(self) -> None: ...

    def tick(self) -> DueBatch:
        return DueBatch()

    def due_soon(self) -> set[int]:
        return set()

    def seconds_to_next(self, longest: float = 1.0) -> float:
        return longest


@pytest.fixture
def polls() -> Counter[int]:
    return Counter()


@pytest.fixture
def start(site, polls) -> Iterator[Callable[..., PollLoop]]:
    """A loop over so many robots; those whose number is given hang."""
    loops, free = [], poll_loop.threading.Event()

    def make(count: int, *, hanging: int | None = None, every: float = 0.2, scheduler: QuietScheduler | None = None,
             changes: Changes | None = None, trouble: Callable[[Robot], None] = lambda robot: None,
             reading: Callable[[PollLoop], object] = lambda loop: None) -> PollLoop:
        def worker_of(robot: Robot) -> CountingWorker:
            worker = CountingWorker(robot, polls)
            worker.hangs = free.wait if robot.id == hanging else lambda: trouble(robot)
            return worker
        alarms = Alarms(site.container.db, site.container.repositories.alarms, SystemClock(), Changes())
        robots = [Robot(f"R{n}", "http://r", id=n) for n in range(count)]

        def read_robots() -> list[Robot]:
            reading(loop)
            return robots
        loop = PollLoop(site.container.db, scheduler=scheduler or QuietScheduler(), clock=SystemClock(), alarms=alarms,  # type: ignore[arg-type]
                        changes=changes or Changes(), robots=read_robots, make_worker=worker_of,  # type: ignore[arg-type]
                        poll_interval=lambda: every)
        loops.append(loop)
        loop.start()
        return loop
    yield make
    free.set()
    for loop in loops:
        loop.stop()


@pytest.mark.parametrize("count", [3, 2 * POLLED_AT_ONCE + 1])
def test_every_robot_is_polled_again_and_again(start, polls, count):
    start(count)
    wait_for(lambda: len(polls) == count and min(polls.values()) >= 3)


def test_very_many_are_polled_in_turns_that_a_new_cycle_does_not_start_again(start, polls):
    """Even when a cycle takes longer than the interval, the last ones get their turn."""
    count = 20 * POLLED_AT_ONCE
    start(count, every=0.3)
    wait_for(lambda: len(polls) == count and min(polls.values()) >= 1)


def test_a_robot_that_hangs_holds_up_itself_alone(start, polls, monkeypatch):
    monkeypatch.setattr(poll_loop, "FIRST_POLL_WITHIN", 0.2)
    start(5, hanging=2)
    wait_for(lambda: len(polls) == 4 and min(polls.values()) >= 3)
    assert 2 not in polls


def test_a_worker_that_meets_an_unexpected_error_goes_on(start, polls, monkeypatch, caplog):
    monkeypatch.setattr(poll_loop, "AFTER_A_CRASH", 0.01)
    left = {1: 3}

    def trouble(robot: Robot) -> None:
        if left.get(robot.id, 0):
            left[robot.id] -= 1
            raise RuntimeError("planted")

    loop = start(3, trouble=trouble)
    wait_for(lambda: len(polls) == 3 and min(polls.values()) >= 3)
    assert left == {1: 0}
    assert loop._workers[1].worker.told[:5] == [False, True, True, True, False]       # what a round did not get to, the next one takes up
    assert [record.exc_info is not None for record in caplog.records] == [True] * 3


@pytest.mark.parametrize("topic", [Topic.SCHEDULES, Topic.EXECUTIONS, Topic.HOLDS, Topic.ROBOTS])
def test_every_worker_learns_what_an_operator_has_changed(start, polls, topic):
    """It may have an intent in hand that must not be sent any more."""
    changes = Changes()
    loop = start(3, every=60.0, changes=changes)
    wait_for(lambda: len(polls) == 3)
    workers = [thread.worker for thread in loop._workers.values()]
    before = [sum(worker.told) for worker in workers]
    changes.publish(topic)
    wait_for(lambda: [sum(worker.told) for worker in workers] == [count + 1 for count in before])


class FailingScheduler(QuietScheduler):
    """Its first ticks raise what no code should."""

    def __init__(self) -> None:
        self.left, self.beats = 3, 0

    def tick(self) -> DueBatch:
        if self.left:
            self.left -= 1
            raise RuntimeError("planted")
        self.beats += 1
        return DueBatch()


def test_the_scheduler_goes_on_after_an_unexpected_error(start, polls, monkeypatch, caplog):
    monkeypatch.setattr(poll_loop, "LONGEST_WAIT", 0.02)
    scheduler = FailingScheduler()
    start(2, scheduler=scheduler)
    wait_for(lambda: scheduler.beats >= 2 and len(polls) == 2)
    assert [record.exc_info is not None for record in caplog.records] == [True] * 3


class PlanningScheduler(QuietScheduler):
    """Each of its ticks plans something and tells so."""

    def __init__(self, changes: Changes) -> None:
        self.changes, self.beats, self.loop = changes, 0, None
        self.woken: list[bool] = []

    def tick(self) -> DueBatch:
        before = self.loop and self.loop._woken
        self.changes.publish(Topic.SCHEDULES)
        if self.loop and not before:
            self.woken.append(self.loop._woken)
        self.beats += 1
        return DueBatch()


def test_what_the_scheduler_plans_does_not_wake_itself_but_what_others_plan_does(start, polls, monkeypatch):
    monkeypatch.setattr(poll_loop, "LONGEST_WAIT", 60.0)
    changes = Changes()
    scheduler = PlanningScheduler(changes)
    scheduler.loop = start(1, every=60.0, scheduler=scheduler, changes=changes)
    wait_for(lambda: scheduler.beats >= 1 and len(polls) == 1)
    for _ in range(3):
        seen = scheduler.beats
        changes.publish(Topic.SCHEDULES)
        wait_for(lambda seen=seen: scheduler.beats > seen)
    assert scheduler.woken
    assert not any(scheduler.woken)


def test_when_the_window_stops_asking_robots_are_polled_all_the_same(start, polls):
    """The window's clock asked once, then its thread is blocked: after two intervals the scheduler's own thread asks."""
    loop = start(3, every=0.1)
    wait_for(lambda: len(polls) == 3)
    loop.request_cycle(by_window=True)
    seen = sum(polls.values())
    wait_for(lambda: sum(polls.values()) >= seen + 9)


def test_a_loop_is_not_ready_while_its_workers_are_still_to_be_made(start):
    ready: list[bool] = []
    loop = start(2, reading=lambda loop: ready.append(loop.is_ready))
    wait_for(lambda: loop.is_ready)
    assert ready == [False]
