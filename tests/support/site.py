"""A whole site in one thread: the real services on a virtual clock, simulated robots behind a network that misbehaves on demand.

Nothing here waits: time passes when a worker asks for it (``clock.sleep``), when an answer takes time, or when the test says so.
"""
from __future__ import annotations

import heapq
import itertools
import math
import sqlite3
from collections.abc import Callable, Iterable
from datetime import datetime
from pathlib import Path
from typing import Any, cast

from app.container import Container
from app.database.connection import Database
from app.domain.models import Execution, Mission, Robot, State
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.services.dispatch.worker import PREFETCH_SPREAD, RobotWorker
from app.services.live.changes import Topic
from mir_sim import MISSIONS, SimulatedRobot
from tests.support.clock import VirtualClock
from tests.support.network import Network, SimulatedTransport

AHEAD = 0.95             # s before something due is written down, at which the app's own second finds that out
TICK_EVERY = 60.0        # s between ticks when nothing is due; the app's own second would make a simulated week long
USER, PASSWORD = "distributor", "distributor"
GUIDS = {mission.name: mission.guid for mission in MISSIONS}


class Site:
    """Robots, network, tablet. ``run`` lets time pass as the app's own threads would: ticks, cycles, workers, each at its instant."""

    def __init__(self, directory: Path, *, robots: int = 1, now: datetime | None = None, network: Network | None = None,
                 with_window: bool = False, timezone: str = "UTC", robot_speed: float = 1.0) -> None:
        self.clock = VirtualClock(now) if now else VirtualClock()
        self.network = network or Network()
        self.network.site = self
        self.directory, self._with_window = directory, with_window
        self.machines: dict[str, SimulatedRobot] = {}
        for number in range(1, robots + 1):
            self.machines[f"R{number}"] = SimulatedRobot(f"R{number}", seed=number, clock=lambda: self.seconds() * robot_speed,
                                                         start=self.clock.now(), timezone=timezone, battery=90.0)
        self._later: list[tuple[float, int, Callable[[], None]]] = []
        self._order = itertools.count()
        self.switched_on: Callable[[], None] = lambda: None       # the simulation makes the database shaky here
        self.container: Container
        self.switch_on()

    def keep_charged(self) -> None:
        """Somebody plugs the robots in: for runs of days, in which a robot that only waits would go flat."""
        for machine in self.machines.values():
            machine.set_battery(90.0)
        self.at(4 * 3600.0, self.keep_charged)

    def seconds(self) -> float:
        """True time since the beginning, which is the robots' simulated time."""
        return self.clock.elapsed()

    # ------------------------------------------------------------------ the tablet
    def switch_on(self) -> None:
        """Start the app on whatever the database holds."""
        db = Database.open(self.directory / "amr-scheduler.db", clock=self.clock, threaded=False, durable=False)
        self.container = Container(db, self.clock, make_client=self._client, with_window=self._with_window)
        self.container.first_start()
        self._workers: dict[int, RobotWorker] = {}
        self._due: dict[int, float] = {}
        self._polls: set[int] = set()
        self._soon: set[int] = set()
        self._changed: set[int] = set()
        self._intents: dict[int, list[Execution]] = {}
        self._in_tick = False
        self.container.changes.subscribe(self._on_change)
        self.container.loop.ready = lambda key: self._workers[key].ready() if key in self._workers else None
        self.container.loop.hand_over = self._hand_over
        self._next_tick = self._next_cycle = -math.inf
        self.switched_on()
        self.container.scheduler.start()

    def switch_off(self, *, cleanly: bool = True) -> None:
        """Stop the app; not cleanly is a power cut: whatever was not committed is gone."""
        if cleanly:
            self.container.scheduler.stop()
            for worker in self._workers.values():
                worker.close()
        self.container.db.close()

    def _client(self, robot: Robot) -> RobotClient:
        name = robot.address.removeprefix("http://").upper()
        token = Token.from_header(robot.token or "")
        transport = SimulatedTransport(self.machines[name], self.network, self.clock, name, token)
        return RobotClient(Address.parse(robot.address), token, transport=transport, clock=self.clock.monotonic)

    # ------------------------------------------------------------------ furnishing
    def add_robots(self) -> list[Robot]:
        save = self.container.catalogue.save_robot
        return [save(Robot(name, f"http://{name.lower()}", USER), password=PASSWORD) for name in self.machines]

    def add_mission(self, name: str = "Deliver") -> Mission:
        return self.container.catalogue.save_mission(Mission(name, GUIDS[name]))

    # ------------------------------------------------------------------ time
    def at(self, seconds_from_now: float, call: Callable[[], None]) -> None:
        """Have the world do something while time passes."""
        heapq.heappush(self._later, (self.clock.monotonic() + seconds_from_now, next(self._order), call))

    def run(self, seconds: float) -> None:
        """Let time pass."""
        end = self.clock.monotonic() + seconds
        while True:
            instant = min(self._next_tick, *self._due.values(), self._later[0][0] if self._later else math.inf, math.inf)
            if instant > end:
                break
            self._go_to(instant)
            self._step()
        self._go_to(end)

    def run_until(self, condition: Callable[[], bool], within: float = 3600.0) -> None:
        """Let time pass until something holds; an error when it doesn't in time."""
        end = self.clock.monotonic() + within
        while not condition():
            if self.clock.monotonic() > end:
                raise AssertionError(f"not within {within} s: {condition}")
            self.run(0.5)

    def read_ahead(self, worker: RobotWorker) -> None:
        """Something is due at that robot in a moment, and its turn to be read has come."""
        worker.step(False, due_soon=True, changed=False)
        self.clock.advance(PREFETCH_SPREAD)
        worker.step(False, changed=False)

    def _go_to(self, instant: float) -> None:
        self.clock.advance(max(0.0, instant - self.clock.monotonic()))

    def _step(self) -> None:
        while self._later and self._later[0][0] <= self.clock.monotonic():
            heapq.heappop(self._later)[2]()
        if self._next_tick <= self.clock.monotonic():
            self._tick()
        for key in sorted(self._due, key=self._due.__getitem__):
            if self._due.get(key, math.inf) <= self.clock.monotonic():
                self._step_worker(key)

    def tick(self) -> set[int]:
        """One tick of the scheduler; returns the robots for which something waits since."""
        self._in_tick = True
        try:
            return self.container.scheduler.tick().robot_ids
        finally:
            self._in_tick = False

    def _tick(self) -> None:
        """What the scheduler's thread does."""
        self._match_workers()
        kicked = self.tick()
        soon = self.container.scheduler.due_soon() & self._workers.keys()
        self.container.scheduler.tidy()
        self._soon |= soon
        self._changed |= kicked
        for key in kicked | soon:
            self._due[key] = self.clock.monotonic()
        if self.clock.monotonic() >= self._next_cycle:
            self._next_cycle = self.clock.monotonic() + self.container.settings().poll_interval_seconds
            for key in self._workers:
                self._polls.add(key)
                self._due[key] = self.clock.monotonic()
        wait = self.container.scheduler.seconds_to_next(longest=TICK_EVERY)
        if AHEAD + 0.01 < wait < TICK_EVERY:
            wait -= AHEAD                # the worker is notified that something falls due
        self._next_tick = self.clock.monotonic() + wait

    def _hand_over(self, intent: Execution) -> None:
        self._intents.setdefault(intent.robot_id, []).append(intent)
        self._due[intent.robot_id] = self.clock.monotonic()

    def _on_change(self, topic: Topic, about: int | None) -> None:
        """Somebody changed the plan or cancelled something: every worker is notified, at its next step."""
        if topic in (Topic.EXECUTIONS, Topic.HOLDS, Topic.SCHEDULES, Topic.ROBOTS) and about is None and not self._in_tick:
            self._changed |= self._workers.keys()

    def _match_workers(self) -> None:
        for robot in self.container.repositories.robots.all(self.container.db.read()):
            if robot.id not in self._workers:
                self._workers[robot.id] = self.container.make_worker(robot)
                self._due[robot.id] = self.clock.monotonic()

    def _step_worker(self, key: int) -> None:
        wanted = key in self._polls
        self._polls.discard(key)
        self._due[key] = math.inf
        soon, changed = key in self._soon, key in self._changed
        self._soon.discard(key)
        self._changed.discard(key)
        wait = self._workers[key].step(wanted, soon, self._intents.pop(key, ()), changed)
        self._due[key] = min(self._due[key], self.clock.monotonic() + max(wait, 0.01))

    def kick(self) -> None:
        """As after an operator's press: every worker looks at once."""
        for key in self._workers:
            self._due[key] = self.clock.monotonic()
            self._changed.add(key)
        self._next_tick = self.clock.monotonic()

    # ------------------------------------------------------------------ looking
    def executions(self, *states: State) -> list:
        c = self.container.db.read()
        rows = [self.container.repositories.executions.get(c, row[0]) for row in c.execute("SELECT id FROM executions ORDER BY id")]
        return [row for row in rows if not states or row.state in states]

    # ------------------------------------------------------------------ the world
    tablet = "the tablet"         # which machine the app runs on

    def others_go_on(self, robot: str, seconds: float) -> None:
        """An answer of that robot takes so long, a good one. Meanwhile its worker waits and everybody else goes on."""
        end, key = self.clock.monotonic() + seconds, self._key_of(robot)
        waiting = _Waiting(self._workers[key]) if key in self._workers else None
        if waiting is not None:
            self._workers[key] = cast(RobotWorker, waiting)
        try:
            self.run(seconds)
        finally:
            if waiting is not None:
                self._workers[key] = waiting.worker
                self._take_up(key, waiting)
        self._go_to(end)

    def _take_up(self, key: int, waiting: _Waiting) -> None:
        """What its worker was asked for while it waited."""
        self._intents.setdefault(key, []).extend(waiting.intents)
        for wanted, those in ((waiting.poll, self._polls), (waiting.soon, self._soon), (waiting.changed, self._changed)):
            if wanted:
                those.add(key)
        if waiting.poll or waiting.soon or waiting.changed or waiting.intents:
            self._due[key] = self.clock.monotonic()

    def _key_of(self, name: str) -> int:
        return next((robot.id for robot in self.container.catalogue.robots() if robot.address == f"http://{name.lower()}"), 0)

    def suspend(self, seconds: float) -> None:
        """The tablet sleeps. Robots go on; nothing of the app does, and its monotonic clock stands still."""
        self.clock.suspend(seconds)
        for machine in self.machines.values():
            machine.catch_up()

    def power_cut(self, seconds: float) -> None:
        """The tablet is off for so long, without warning; then the app starts again."""
        self.switch_off(cleanly=False)
        self.clock.advance(seconds)
        self.switch_on()

    def stranger_queues(self, mission: str = "Deliver", robot: str = "R1", *, description: str = "", user: str = "admin") -> int:
        """Somebody else puts a mission on a robot; returns the number of its item."""
        machine = self.machines[robot]
        machine.catch_up()
        person = next(row for row in machine.site.table("/users") if row["username"] == user)
        return machine.order(GUIDS[mission], person, description=description).id

    def make_read_only(self) -> Callable[[], None]:
        """From now on nothing can be written to the disk. Returns what mends it."""
        writing: list[sqlite3.Connection] = []
        self.container.db.write(writing.append)
        writing[0].execute("PRAGMA query_only = ON")
        return lambda: writing[0].execute("PRAGMA query_only = OFF").close()

    def fill_disk(self) -> Callable[[], None]:
        """The database can't grow by another page. Returns what makes room again."""
        writing: list[sqlite3.Connection] = []
        self.container.db.write(writing.append)
        writing[0].execute(f"PRAGMA max_page_count = {writing[0].execute('PRAGMA page_count').fetchone()[0]}")
        return lambda: writing[0].execute("PRAGMA max_page_count = 1073741823").close()

    def another_tablet(self, directory: Path) -> Site:
        """A second tablet on the same network, with its own data directory. One clock serves both; each lives while it is ``run``."""
        other = Site.__new__(Site)
        other.__dict__.update(self.__dict__, tablet=f"{self.tablet}, another one")
        other.directory, other._later, other._order = directory, [], itertools.count()
        other.switch_on()
        return other


class _Waiting:
    """Takes the place of a worker that waits for an answer, and keeps what it is asked for."""

    def __init__(self, worker: RobotWorker) -> None:
        self.worker, self.poll, self.soon, self.changed = worker, False, False, False
        self.intents: list[Execution] = []

    def step(self, poll: bool, due_soon: bool = False, intents: Iterable[Execution] = (), changed: bool = True) -> float:
        self.poll, self.soon, self.changed = self.poll or poll, self.soon or due_soon, self.changed or changed
        self.intents.extend(intents)
        return math.inf

    def __getattr__(self, name: str) -> Any:
        return getattr(self.worker, name)
