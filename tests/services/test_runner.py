"""The threads around engine and workers: a cycle reaches every robot, in turns when there are many, and never waits for
a dead one."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from app.container import Container
from app.database.connection import Database, DatabaseUnavailable
from app.domain.execution import Execution
from app.domain.models import Robot
from app.services.dispatch import engine, messages, runner
from app.services.dispatch.clock_guard import Judgement
from app.services.dispatch.engine import POLLED_AT_ONCE, Engine
from app.services.dispatch.planner import DueBatch
from app.services.dispatch.runner import Runner
from app.services.live.alarms import alarm_sentence
from app.services.live.changes import Changes, Topic
from tests.support.process import wait_for


class CountingWorker:
    """A worker that only counts its polls; ``acts`` may hang or raise."""

    def __init__(self, robot: Robot, polls: Counter[int]) -> None:
        self.robot, self.polled, self.seen = robot, False, SimpleNamespace(clock=None, gives_time=False)
        self._polls = polls
        self._poll_wanted = True
        self.acts: Callable[[], None] = lambda: None
        self.received: list[type] = []
        self.untaken: Sequence[Execution] | None = None  # what it was closed with

    def handle(self, message: messages.Message) -> None:
        self.received.append(type(message))
        self._poll_wanted |= isinstance(message, messages.Poll)

    def advance(self) -> float:
        self.acts()
        self._polls[self.robot.id] += self._poll_wanted
        self._poll_wanted, self.polled = False, True
        return 60.0

    def readiness(self) -> None: ...

    def expect_recovery(self) -> messages.Recover:
        return messages.Recover(1)

    def close(self, untaken: Sequence[Execution] = ()) -> None:
        self.untaken = untaken


class Planner:
    """Nothing is ever due; ``acts`` in each round, and ``beats`` counts those that it ended well."""

    def __init__(self, acts: Callable[[], object] = lambda: None) -> None:
        self.acts, self.beats = acts, 0

    def next_due(self) -> None: ...
    def close_expired_run_nows(self) -> None: ...

    def robots_due(self, after: object, until: object) -> set[int]:
        return set()

    def insert_due(self, ready: object, hand_over: object) -> DueBatch:
        self.acts()
        self.beats += 1
        return DueBatch()


class TrustingGuard:
    is_in_doubt, is_proven = False, True

    def start(self) -> None: ...
    def stop(self) -> None: ...

    def judge(self, readings: object, can_ask: bool) -> Judgement:
        return Judgement(True)

    def acted(self) -> None:
        """There was nothing to do."""


class App:
    """Engine and runner over so many robots."""

    def __init__(
        self,
        container: Container,
        polls: Counter[int],
        count: int,
        *,
        every: float = 0.2,
        planner: Planner | None = None,
        acts: Callable[[Robot], None] = lambda robot: None,
        reading: Callable[[App], object] = lambda app: None,
    ) -> None:
        self.container, self.changes, self.workers = container, Changes(), {}
        self.robots = [Robot(f"R{number}", "http://r", id=number) for number in range(count)]

        def make_worker(robot: Robot) -> CountingWorker:
            worker = self.workers[robot.id] = CountingWorker(robot, polls)
            worker.acts = lambda: acts(robot)
            return worker

        def read_robots() -> list[Robot]:
            reading(self)
            return list(self.robots)

        clock, alarms = container.clock, container.alarms
        self.engine = Engine(
            planner=planner or Planner(),
            guard=TrustingGuard(),
            ledger=container.ledger,
            clock=clock,  # type: ignore[arg-type]
            alarms=alarms,
            changes=self.changes,
            robots=read_robots,
            make_worker=make_worker,  # type: ignore[arg-type]
            poll_interval=lambda: every,
            probe=lambda: None,
            restored_starts=container.restored_starts,
            allocator=container.allocator,
        )
        self.runner = Runner(container.db, self.engine, clock, alarms)
        self.runner.start()


def alarm_of(app: App) -> tuple[int, bool]:
    """How often the only alarm came, and whether its cause is over."""
    (alarm,) = [alarm for alarm in app.container.alarms.open() if alarm.code == "chore_failed"]
    return alarm.count, alarm.cleared_at is not None


@pytest.fixture
def polls() -> Counter[int]:
    return Counter()


@pytest.fixture
def start(tmp_path, polls) -> Iterator[Callable[..., App]]:
    """Start an app over so many robots, with ``values`` of ``App``."""
    apps, container = [], Container(Database.open(tmp_path / "a.db", durable=False))

    def make(count: int, **values: Any) -> App:
        apps.append(App(container, polls, count, **values))
        return apps[-1]

    yield make
    for app in apps:
        app.runner.stop()
    container.db.close()


@pytest.fixture
def started(start, polls) -> Callable[[int], App]:
    """Start one, which has polled each of its robots once and does it again in a minute."""

    def make(count: int) -> App:
        app = start(count, every=60.0)
        wait_for(lambda: len(polls) == count)
        return app

    return make


class Hanging:
    """What a worker does that hangs until it is ``free``."""

    def __init__(self) -> None:
        self.began, self.free = threading.Event(), threading.Event()

    def __call__(self) -> None:
        self.began.set()
        self.free.wait()


@pytest.mark.parametrize("count", [3, 2 * POLLED_AT_ONCE + 1])
def test_every_robot_is_polled_again_and_again(start, polls, count):
    start(count)
    wait_for(lambda: len(polls) == count and min(polls.values()) >= 3)


def test_very_many_are_polled_in_turns_that_a_new_cycle_does_not_start_again(start, polls):
    """Even when a cycle takes longer than the interval, the last ones get their turn."""
    count = 20 * POLLED_AT_ONCE
    start(count, every=0.3)
    wait_for(lambda: len(polls) == count and min(polls.values()) >= 2)


def test_a_robot_that_hangs_holds_up_itself_alone(start, polls, monkeypatch):
    monkeypatch.setattr(engine, "FIRST_POLL_WITHIN", 0.2)
    free = threading.Event()
    start(5, acts=lambda robot: free.wait(20) if robot.id == 2 else None)
    wait_for(lambda: len(polls) == 4 and min(polls.values()) >= 3)
    assert 2 not in polls
    free.set()


def test_a_worker_that_meets_an_unexpected_error_continues(start, polls, monkeypatch, caplog):
    monkeypatch.setattr(runner, "AFTER_A_FAILURE", 0.01)
    left = {1: 3}

    def trouble(robot: Robot) -> None:
        if left.get(robot.id, 0):
            left[robot.id] -= 1
            raise RuntimeError("planted")

    app = start(3, acts=trouble)
    wait_for(lambda: len(polls) == 3 and min(polls.values()) >= 3)
    assert left == {1: 0}
    assert app.workers[1].received.count(messages.Recover) == 3  # what a round did not get to, the next one takes up
    assert messages.Recover not in app.workers[2].received
    assert sum(record.exc_info is not None for record in caplog.records) == 3
    assert alarm_of(app) == (1, True)


@pytest.mark.parametrize("topic", [Topic.SCHEDULES, Topic.EXECUTIONS, Topic.HOLDS, Topic.ROBOTS])
def test_every_worker_learns_what_an_operator_has_changed(started, topic):
    """It may hold an intent that must not be sent any more."""
    app = started(3)
    before = app.engine.plan_version
    app.changes.publish(topic)
    wait_for(lambda: all(messages.LedgerChanged in worker.received for worker in app.workers.values()))
    assert app.engine.plan_version == before + 1


def test_a_change_of_one_robots_executions_is_its_own(started):
    """And it takes nothing back that others hold."""
    app = started(3)
    before = app.engine.plan_version
    app.changes.publish(Topic.EXECUTIONS, 1)
    wait_for(lambda: messages.LedgerChanged in app.workers[1].received)
    assert messages.LedgerChanged not in app.workers[0].received + app.workers[2].received
    assert app.engine.plan_version == before


def test_a_worker_gets_no_message_about_its_own_change(started):
    app = started(2)
    app.workers[1].acts = lambda: app.changes.publish(Topic.EXECUTIONS, None)
    app.engine.poll(1)
    wait_for(lambda: messages.LedgerChanged in app.workers[0].received)
    assert messages.LedgerChanged not in app.workers[1].received


def test_what_is_posted_arrives_in_its_order(started):
    app = started(1)
    app.workers[0].received.clear()
    intent: object = object()
    posted = [
        messages.Start(intent, 1),
        messages.LedgerChanged(),
        messages.Start(intent, 2),
        messages.Prefetch(),
        messages.ClockJumped(),
    ] * 20
    for message in posted:
        app.runner.post(0, message)

    def received() -> list[type]:
        return [
            kind for kind in app.workers[0].received if kind is not messages.Poll
        ]  # which the engine may request at the same time

    wait_for(lambda: len(received()) == len(posted))
    assert received() == [type(message) for message in posted]


def test_a_robots_new_worker_begins_when_the_one_before_has_ended(started):
    """Which may wait for an answer for long, and then still send what it has in hand."""
    app = started(2)
    before = app.workers[1]
    before.acts = hanging = Hanging()
    app.engine.poll(1)
    hanging.began.wait()
    app.robots[1] = replace(app.robots[1], address="http://other")
    app.changes.publish(Topic.ROBOTS)
    wait_for(lambda: app.workers[1] is not before)
    app.engine.poll(1)
    app.engine.poll(0)
    received = len(app.workers[0].received)
    wait_for(lambda: len(app.workers[0].received) >= received)
    assert (app.workers[1].received, before.untaken) == ([], None)
    hanging.free.set()
    wait_for(lambda: messages.Poll in app.workers[1].received)
    assert before.untaken is not None


def test_an_intent_that_reaches_no_worker_any_more_is_handed_back(started):
    """It was posted while the worker was busy with its last round."""
    app = started(1)
    worker, intent = app.workers[0], object()
    worker.acts = hanging = Hanging()
    app.engine.poll(0)
    hanging.began.wait()
    app.runner.post(0, messages.Start(intent, 1))  # type: ignore[arg-type]
    app.runner.close(0)
    hanging.free.set()
    wait_for(lambda: worker.untaken is not None)
    assert worker.untaken == [intent]
    app.runner.post(0, messages.Poll())  # no receiver: it is lost without harm


@pytest.mark.parametrize(
    ("change", "is_new"), [({"name": "Other"}, False), ({"enabled": False}, False), ({"address": "http://q"}, True)]
)
def test_a_robot_that_is_edited_keeps_its_worker_unless_its_connection_changed(started, change, is_new):
    app = started(2)
    before = dict(app.workers)
    app.robots[1] = Robot(**{"name": "R1", "address": "http://r", "id": 1, **change})
    app.changes.publish(Topic.ROBOTS)
    wait_for(lambda: app.workers[1] is not before[1] if is_new else messages.RobotEdited in before[1].received)
    assert (app.workers[1] is not before[1]) is is_new
    assert app.workers[0] is before[0]
    if is_new:
        wait_for(lambda: before[1].untaken is not None)


def test_the_scheduler_continues_after_an_unexpected_error(start, polls, monkeypatch, caplog):
    for module in (runner, engine):
        monkeypatch.setattr(module, "LONGEST_WAIT", 0.02)
    left = [RuntimeError("planted")] * 3

    def fail() -> None:
        if left:
            raise left.pop()

    planner = Planner(fail)
    app = start(2, planner=planner)
    wait_for(lambda: planner.beats >= 2 and len(polls) == 2)
    assert sum(record.exc_info is not None for record in caplog.records) == 3
    assert alarm_of(app) == (1, True)


def test_while_nothing_works_there_is_an_alarm(start, monkeypatch):
    monkeypatch.setattr(runner, "LONGEST_WAIT", 0.02)

    def unreadable(_app: App) -> None:
        raise ValueError("'nonsense' is not a valid IdentifiedBy")

    app = start(1, reading=unreadable)
    wait_for(lambda: app.container.alarms.open())
    assert alarm_of(app) == (1, False)
    assert alarm_sentence(app.container.alarms.open()[0]) == (
        "A part of the app does not work and is tried again: "
        "scheduler: ValueError: 'nonsense' is not a valid IdentifiedBy"
    )


def test_a_round_that_outlives_the_stop_is_no_failing_database(start, monkeypatch, caplog):
    monkeypatch.setattr(runner, "STOP_WITHIN", 0.05)
    hanging = Hanging()

    def meet_a_closed_database() -> None:
        hanging()
        raise DatabaseUnavailable("{path} is closed", path="a.db")

    app = start(1, planner=Planner(meet_a_closed_database))
    assert hanging.began.wait(20)
    app.runner.stop()
    hanging.free.set()
    wait_for(lambda: not any(thread.name == runner.SCHEDULER for thread in threading.enumerate()))
    assert (caplog.records, app.container.alarms.open()) == ([], [])


def test_what_the_scheduler_plans_does_not_wake_itself_but_what_others_plan_does(start, polls, monkeypatch):
    for module in (runner, engine):
        monkeypatch.setattr(module, "LONGEST_WAIT", 60.0)
    planner = Planner()
    app = start(1, every=60.0, planner=planner)
    wait_for(lambda: planner.beats >= 1 and len(polls) == 1)
    planner.acts = lambda: app.changes.publish(Topic.SCHEDULES)
    version = app.engine.plan_version
    for _ in range(3):
        seen = planner.beats
        app.changes.publish(Topic.SCHEDULES)
        wait_for(lambda seen=seen: planner.beats > seen)
    assert app.engine.plan_version == version + 3  # only those of others


def test_when_the_window_stops_asking_robots_are_still_polled(start, polls):
    """The window's clock asked once, then its thread is blocked: after two intervals the scheduler's own thread asks."""
    app = start(3, every=0.1)
    wait_for(lambda: len(polls) == 3)
    app.engine.request_cycle(by_window=True)
    seen = sum(polls.values())
    wait_for(lambda: sum(polls.values()) >= seen + 9)


def test_it_is_not_ready_while_its_workers_are_still_to_be_made(start):
    ready: list[bool] = []
    app = start(2, reading=lambda app: ready.append(app.engine.is_ready))
    wait_for(lambda: app.engine.is_ready)
    assert ready == [False]
