"""A whole site in one thread: the real services on a virtual clock, simulated robots behind a network that misbehaves on demand.

Nothing here waits: time passes when a worker asks for it (``clock.sleep``), when an answer takes time, or when the test says so.
"""

from __future__ import annotations

import heapq
import itertools
import math
import sqlite3
from collections import defaultdict
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from app.container import Container
from app.database.check_ups import CheckUpRepository
from app.database.connection import Database, DatabaseUnavailable
from app.database.execution_history import ExecutionHistory
from app.database.fleets import FleetRepository
from app.domain.check_up import Report, RobotProfile
from app.domain.execution import Execution, State
from app.domain.models import Fleet, FleetKind, Mission, Robot, Schedule
from app.domain.robot import FleetIdentity
from app.mir.address import Address
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.fleet_connection import FleetConnection
from app.mir.target import Target
from app.mir.transport import Pace, Transport
from app.services.dispatch import messages
from app.services.dispatch.engine import Engine
from app.services.dispatch.timing import LONGEST_WAIT
from app.services.dispatch.worker import RobotWorker
from app.services.live.changes import Topic
from app.services.live.tablet_zone import TabletZone
from mir_sim import MISSIONS, Profile, SimulatedRobot
from mir_sim.fleets.enterprise_orders import API_KEYS, Origin
from mir_sim.machine import Machine
from tests.support import targets
from tests.support.clock import VirtualClock
from tests.support.network import Network, SimulatedTransport
from tests.support.targets import OrdersOf

AHEAD = 1.05  # s before something is due, at which the app's own second finds that out
ROUND_EVERY = (
    300.0  # s between the engine's rounds when nothing is due; the app's own second would make a simulated week long
)
MOMENT = 1e-6  # s
USER, PASSWORD = "distributor", "distributor"
FLEET = "Fleet"
UTC_ZONE = TabletZone("UTC", "TZ", True)  # not this machine's, which also takes a while to find
GUIDS = {mission.name: mission.guid for mission in MISSIONS}


class OneThread(FleetConnection):
    """Workers take turns in one thread: one that asks can't be waited for."""

    def __init__(self, *values: Any) -> None:
        super().__init__(*values)
        self._locks = defaultdict(nullcontext)  # type: ignore[arg-type]
        self.moment: Callable[[], None] = lambda: None

    def shared(self, *asked: Any) -> Any:
        """An answer that is there already takes a moment too, as a worker that asks never gets one from before it asked."""
        self.moment()
        return super().shared(*asked)

    def forget_all(self) -> None:
        self.forget(*list(self._answers))

    def remembered(self, grain: float) -> object:
        """Which answers there are, how old in ``grain`` s, and what clients have noted."""
        now = self.clock()
        ages = {question: (round((now - at) / grain), type(found)) for question, (at, found) in self._answers.items()}
        notes = {name: sorted(map(str, kept)) for name, kept in vars(self.notes).items() if isinstance(kept, dict)}
        return sorted(ages.items(), key=str), notes


class Site:
    """Robots, network, tablet. ``run`` lets time pass as the app's own threads would: ticks, cycles, workers, each at its instant."""

    def __init__(
        self,
        directory: Path,
        *,
        robots: int = 1,
        now: datetime | None = None,
        network: Network | None = None,
        with_window: bool = False,
        timezone: str = "UTC",
        robot_speed: float = 1.0,
        profiles: Mapping[str, Profile] | None = None,
        target: str | None = None,
        token_field: str = "description",
    ) -> None:
        self.clock = VirtualClock(now) if now else VirtualClock()
        self.network = network or Network()
        self.network.site = self
        self.directory, self._with_window = directory, with_window
        self.machines: dict[str, SimulatedRobot] = {}
        for number in range(1, robots + 1):
            name, own = f"R{number}", (profiles or {}).get(f"R{number}")
            self.machines[name] = SimulatedRobot(
                name,
                seed=number,
                clock=lambda: self.seconds() * robot_speed,
                start=self.clock.now(),
                profile=own or Profile(),
                timezone=timezone if own is None else None,
                battery=90.0,
            )
        self.target, self._token_field = target or targets.chosen, token_field
        self.fleet = targets.above(list(self.machines.values()), self.target)
        self.identity = targets.give_identity(self.fleet, USER) if self.fleet else None
        self._orders = {
            each.robot.name: OrdersOf(self.fleet, each) for each in (self.fleet.vehicles if self.fleet else [])
        }
        self._paces: dict[str, Pace] = {}
        self._later: list[tuple[float, int, Callable[[], None]]] = []
        self._order = itertools.count()
        self.switched_on: Callable[[], None] = lambda: None  # the simulation makes the database shaky here
        self.container: Container
        self.switch_on()

    def keep_charged(self) -> None:
        """Somebody plugs the robots in: for runs of days, in which a robot that only waits would go flat."""
        for machine in self.machines.values():
            machine.set_battery(90.0)
        self.at(4 * 3600.0, self.keep_charged)

    def queue(self, robot: str) -> Any:
        """What it was ordered to do, by its own queue or by its fleet's orders for it, oldest first."""
        self.machines[robot].catch_up()
        return self._orders[robot] if self.fleet else self.machines[robot].queue

    def priority(self, wanted: int) -> int:
        """As its items have it: fleets know only what goes before others."""
        return wanted if self.fleet is None else min(wanted, 1)

    def as_for_a_second(self) -> None:
        """The robots have been as they are for as long as a fleet's answer serves."""
        self._connection.forget_all()

    @property
    def all_machines(self) -> list[Machine]:
        return [*self.machines.values(), *([self.fleet] if self.fleet else [])]

    def seconds(self) -> float:
        """True time since the beginning, which is the robots' simulated time."""
        return self.clock.elapsed()

    # ------------------------------------------------------------------ the tablet
    def switch_on(self) -> None:
        """Start the app on the database as it is."""
        db = Database.open(self.directory / "amr-scheduler.db", clock=self.clock, threaded=False, durable=False)
        self.container = Container(
            db,
            self.clock,
            make_client=self._client,
            ask_fleet=lambda _fleet: FleetIdentity(self.identity, None),
            with_window=self._with_window,
            machine=self.tablet,
            find_zone=lambda: UTC_ZONE,
        )
        self._connection = OneThread(  # by a clock that counts the tablet's sleep, as since_boot
            self.seconds, self._paces.setdefault(FLEET, Pace(self.clock.monotonic, self.network.time_out))
        )
        self._connection.moment = lambda: self.clock.advance(MOMENT)
        self.container.first_start()
        self._workers: dict[int, RobotWorker] = {}
        self._inboxes: dict[int, list[messages.Message]] = {}
        self._due: dict[int, float] = {}  # when each worker continues
        self._next_round, self._jumps = self.clock.monotonic(), self.clock.jumps
        self._acting: int | None = None  # the worker that is going on
        self._blocked: set[RobotWorker] = set()  # those that wait for an answer
        self._closing: dict[RobotWorker, list[Execution]] = {}  # no longer needed, and what they were not given
        self.engine.attach(self, self._wake)
        self.switched_on()
        self.engine.start()

    @property
    def engine(self) -> Engine:
        return self.container.engine

    def switch_off(self, *, cleanly: bool = True) -> None:
        """Stop the app; not cleanly is a power cut: what was not committed is lost."""
        if cleanly:
            self.engine.stop()
            for key in list(self._workers):
                self.close(key)
        self.container.db.close()

    # ------------------------------------------------------------------ mailboxes, as the runner's threads have them
    def open(self, worker: RobotWorker) -> None:
        self._workers[worker.robot.id] = worker
        self._inboxes[worker.robot.id] = []
        self._due[worker.robot.id] = self.clock.monotonic()

    def close(self, robot_id: int) -> None:
        del self._due[robot_id]
        intents = [message.intent for message in self._inboxes.pop(robot_id) if isinstance(message, messages.Start)]
        worker = self._workers.pop(robot_id)
        if worker in self._blocked:  # its thread ends when it has its answer
            self._closing[worker] = intents
        else:
            worker.close(intents)

    def post(self, robot_id: int, message: messages.Message) -> None:
        if robot_id in self._workers and not (isinstance(message, messages.LedgerChanged) and robot_id == self._acting):
            self._inboxes[robot_id].append(message)
            self._due[robot_id] = self.clock.monotonic()

    def _wake(self) -> None:
        self._next_round = self.clock.monotonic()

    def _client(self, robot: Robot) -> Target:
        if robot.fleet is not None:
            ids = self._vehicle_ids
            name = next((name for name, vehicle in ids.items() if vehicle == robot.vehicle), FLEET)
            token = Token.from_header(robot.token or "")
            make = ClassicVehicle if self.target == "classic" else EnterpriseVehicle
            return make(
                Address.parse(robot.address),
                token,
                robot.vehicle,
                connection=self._connection,
                serial_number=robot.serial_number,
                identified_by=robot.identified_by,
                fleet_identity=robot.fleet.identity,
                profile=robot.known,
                transport=SimulatedTransport(self.fleet, self.network, self.clock, name, token),
                **({"reach": self._reach} if make is ClassicVehicle else {}),
            )
        name = robot.address.removeprefix("http://").upper()
        token = Token.from_header(robot.token or "")
        transport = SimulatedTransport(self.machines[name], self.network, self.clock, name, token)
        pace = self._paces.setdefault(name, Pace(self.clock.monotonic, self.network.time_out))
        return RobotClient(
            Address.parse(robot.address),
            token,
            serial_number=robot.serial_number,
            identified_by=robot.identified_by,
            transport=transport,
            clock=self.clock.monotonic,
            profile=robot.known,
            pace=pace,
        )

    # ------------------------------------------------------------------ furnishing
    def _reach(self, address: Address) -> Transport:
        """A robot of the fleet, at the address that the fleet has of it."""
        robot = next(each.robot for each in self.fleet.vehicles if Address.parse(each.address).url == address.url)
        return SimulatedTransport(robot, self.network, self.clock, robot.name, Token.derive(USER, PASSWORD))

    def add_fleet(self) -> Fleet:
        """It has been checked up."""
        kind, catalogue = FleetKind(self.target), self.container.catalogue
        is_classic = kind is FleetKind.CLASSIC
        user, password = (USER, PASSWORD) if is_classic else ("", "mir_scheduler")
        new = Fleet(FLEET, f"http://{FLEET.lower()}", kind, user, identity=self.identity)
        fleet = catalogue.save_fleet(new, password=password)
        if is_classic:  # its trial's order
            person = next(iter(self.fleet.site.table("/users")))
            order = self.fleet.book.submit(self.fleet.new_guid(), GUIDS["Home"], person, self.fleet.now)
            self.fleet.book.cancel(order, self.fleet.now)
        found = (
            RobotProfile(self.identity, None, token_field=self._token_field)
            if is_classic
            else RobotProfile(self.identity, None, ended_shown_s=self._ended_shown_s, own_key=self._own_key)
        )
        self.container.db.write(lambda c: FleetRepository().update(c, replace(fleet, profile=found)))
        return fleet

    @property
    def _own_key(self) -> str | None:
        return Origin.of_key(API_KEYS["mir_scheduler"]).api_key_guid

    @property
    def _ended_shown_s(self) -> float:
        """What the check-up of a fleet that has worked for an hour finds."""
        return min(3600.0, self.fleet.knobs.orders_kept or 3600.0)

    @property
    def _vehicle_ids(self) -> dict[str, str]:
        """Ids of the robots at their fleet, by name."""
        vehicles = self.fleet.vehicles if self.fleet else []
        return {each.robot.name: str(each.number) if self.target == "classic" else each.guid for each in vehicles}

    def add_robots(self) -> list[Robot]:
        save = self.container.catalogue.save_robot
        if self.fleet is not None:
            fleet = self.add_fleet()
            return [save(Robot(name, "", fleet=fleet, vehicle=vehicle)) for name, vehicle in self._vehicle_ids.items()]
        return [save(Robot(name, f"http://{name.lower()}", USER), password=PASSWORD) for name in self.machines]

    def add_mission(self, name: str = "Deliver") -> Mission:
        return self.container.catalogue.save_mission(Mission(name, GUIDS[name]))

    def plan_once(self, robot_id: int | None, minutes: int = 2, **values: Any) -> Schedule:
        """A start of the first mission in so many minutes, whatever day it is."""
        start = (self.clock.now() + timedelta(minutes=minutes)).replace(tzinfo=None, second=0, microsecond=0)
        own = {"name": "S", "start_window_minutes": 60, "respect_working_days": False, **values}
        return self.container.catalogue.save_schedule(
            Schedule(robot_id=robot_id, mission_id=1, start=start, timezone="UTC", **own)
        )

    def check_up(self, robot: Robot, profile: RobotProfile) -> None:
        """As if a check-up had found this of the robot."""
        found = Report(robot.name, robot.address, "", self.clock.now(), 60.0, (), profile)
        self.container.db.write(lambda c: CheckUpRepository().put(c, robot.id, found))
        self.container.changes.publish(Topic.ROBOTS)

    # ------------------------------------------------------------------ time
    def at(self, seconds_from_now: float, call: Callable[[], None]) -> None:
        """Have the world do something while time passes."""
        heapq.heappush(self._later, (self.clock.monotonic() + seconds_from_now, next(self._order), call))

    def run(self, seconds: float) -> None:
        """Let time pass."""
        end = self.clock.monotonic() + seconds
        while True:
            if self._jumps != self.clock.jumps:  # of the app's own seconds one is over soon
                self._jumps = self.clock.jumps
                self._next_round = min(self._next_round, self.clock.monotonic() + LONGEST_WAIT)
            due = (at for key, at in self._due.items() if self._may_go_on(key))
            instant = min(self._next_round, min(due, default=math.inf), self._later[0][0] if self._later else math.inf)
            if instant > end:
                break
            self._go_to(instant)
            self._step()
        self._go_to(end)

    def ended(self, row: Execution) -> Execution:
        """That start, once it has ended."""
        self.run_until(lambda: not self.container.ledger.get(row.id).state.is_open)
        return self.container.ledger.get(row.id)

    def run_until(self, condition: Callable[[], bool], within: float = 3600.0) -> None:
        """Let time pass until something holds; an error when it doesn't in time."""
        end = self.clock.monotonic() + within
        while not condition():
            if self.clock.monotonic() > end:
                raise AssertionError(f"not within {within} s: {condition}")
            self.run(0.5)

    def _go_to(self, instant: float) -> None:
        self.clock.advance(max(0.0, instant - self.clock.monotonic()))

    def _step(self) -> None:
        while self._later and self._later[0][0] <= self.clock.monotonic():
            heapq.heappop(self._later)[2]()
        if self._next_round <= self.clock.monotonic():
            self._next_round = math.inf
            try:
                wait = self._until_next_round(self.engine.advance())
            except DatabaseUnavailable as error:
                wait = self._database_failed(error)
            self._next_round = min(self._next_round, self.clock.monotonic() + wait)
        for key in sorted(self._due, key=self._due.__getitem__):
            if key in self._due and self._may_go_on(key) and self._due[key] <= self.clock.monotonic():
                self._go_on(key)

    def _may_go_on(self, key: int) -> bool:
        """Whether the worker is not blocked and the one that it follows has closed."""
        return self._workers[key] not in self._blocked and not any(worker.robot.id == key for worker in self._closing)

    def _until_next_round(self, wanted: float) -> float:
        """The engine's second is left out as long as nothing is due, polled or doubted."""
        if wanted < 1.0 or self.container.holds.active() or self.container.alarms.is_database_failing:
            return wanted
        due = self.container.repositories.schedules.next_due(self.container.db.read())
        left = ROUND_EVERY if due is None else (due - self.clock.now()).total_seconds() - AHEAD
        return max(wanted, min(left, ROUND_EVERY, self.engine.seconds_to_cycle, self.engine.seconds_to_decision))

    def _database_failed(self, error: DatabaseUnavailable) -> float:
        """Do what the runner does; returns the seconds until the next try."""
        self.container.alarms.database_fails(error.message)
        return 1.0

    def kick(self) -> None:
        """As after an operator's press: every worker looks at once."""
        self._wake()
        for key in self._workers:
            self.post(key, messages.LedgerChanged())

    def _go_on(self, key: int) -> None:
        self._due[key] = math.inf
        inbox, self._inboxes[key] = self._inboxes[key], []
        self._acting = key
        self._acting_worker = worker = self._workers[key]
        try:
            for message in inbox:
                worker.handle(message)
            wait = worker.advance()
        except DatabaseUnavailable as error:
            worker.handle(worker.expect_recovery())
            wait = self._database_failed(error)
        finally:
            self._acting = None
        if worker in self._closing:
            worker.close(self._closing.pop(worker))
        if key in self._due:
            self._due[key] = min(self._due[key], self.clock.monotonic() + max(wait, 0.01))

    # ------------------------------------------------------------------ looking
    def states(self, after: float = 0.0) -> list[State]:
        """Of all starts, in the order in which they were made, when so many seconds have passed."""
        if after:
            self.run(after)
        return [row.state for row in self.executions()]

    def the_row(self, *states: State) -> Execution:
        """Of the only start, or of the only one in these states."""
        (row,) = self.executions(*states)
        return row

    def executions(self, *states: State) -> list:
        rows = ExecutionHistory().stream(self.container.db.read())
        return sorted((row for row in rows if not states or row.state in states), key=lambda row: row.id)

    # ------------------------------------------------------------------ the world
    tablet = "the tablet"  # which machine the app runs on

    def others_continue(self, seconds: float) -> None:
        """An answer takes this long: the caller waits and all others continue."""
        if self._acting is None:  # a person's request, on a connection of its own
            self.run(seconds)
            return
        acting, worker = self._acting, self._acting_worker
        self._acting = None  # its worker is notified of what others do
        self._blocked.add(worker)
        try:
            self.run(seconds)
        finally:
            self._blocked.discard(worker)
            self._acting, self._acting_worker = acting, worker

    def stay_off(self, seconds: float) -> None:
        """Time passes, but not for the app, which is switched off."""
        end = self.clock.monotonic() + seconds
        while self._later and self._later[0][0] <= end:
            self._go_to(self._later[0][0])
            heapq.heappop(self._later)[2]()
        self._go_to(end)

    def suspend(self, seconds: float) -> None:
        """The tablet sleeps. Robots continue; the app and its monotonic clock stop."""
        self.clock.suspend(seconds)
        for machine in self.all_machines:
            machine.catch_up()

    def without_link(self, seconds: float) -> None:
        """Neither robots nor their fleet answer for so long."""
        self.network.down.update([*self.machines, FLEET])
        self.run(seconds)
        self.network.down.clear()

    def power_cut(self, seconds: float) -> None:
        """The tablet is off for so long, without warning; then the app starts again."""
        self.switch_off(cleanly=False)
        self.stay_off(seconds)
        self.switch_on()

    def stranger_queues(
        self,
        mission: str = "Deliver",
        robot: str = "R1",
        *,
        description: str = "",
        user: str = "admin",
        at_robot: bool = False,
    ) -> int:
        """Somebody else orders a mission for a robot, of its fleet if it has one; returns the number of that order."""
        machine = self.machines[robot]
        machine.catch_up()
        person = next(row for row in machine.site.table("/users") if row["username"] == user)
        if self.fleet is not None and not at_robot:
            return targets.order(self.fleet, machine, GUIDS[mission], person, description)
        return machine.order(GUIDS[mission], person, description=description).id

    def cancel_all(self, robot: str = "R1") -> None:
        """Somebody else cancels everything that a robot has to do."""
        self.machines[robot].catch_up()
        if self.fleet is not None:
            targets.cancel_all(self.fleet, self.machines[robot])
        self.machines[robot].cancel_all()

    def make_read_only(self) -> Callable[[], None]:
        """From now on nothing can be written to the disk. Returns what mends it."""
        writing: sqlite3.Connection = self.container.db.write(lambda c: c)
        writing.execute("PRAGMA query_only = ON")
        return lambda: writing.execute("PRAGMA query_only = OFF").close()

    def fill_disk(self) -> Callable[[], None]:
        """The database can't grow by another page. Returns what makes room again."""
        writing: sqlite3.Connection = self.container.db.write(lambda c: c)
        writing.execute(f"PRAGMA max_page_count = {writing.execute('PRAGMA page_count').fetchone()[0]}")
        return lambda: writing.execute("PRAGMA max_page_count = 1073741823").close()

    def another_tablet(self, directory: Path, tablet: str = "another one") -> Site:
        """A second tablet on the same network, with its own data directory. One clock serves both; each lives while it is ``run``."""
        other = Site.__new__(type(self))
        other.__dict__.update(self.__dict__, tablet=tablet)
        other.directory, other._later, other._order = directory, [], itertools.count()
        other.switch_on()
        return other
