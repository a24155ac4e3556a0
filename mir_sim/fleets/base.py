"""A simulated fleet: robots, a site that is the same on all of them, and orders that it looks after each second."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from mir_sim import checks, control
from mir_sim.clock import RobotClock
from mir_sim.faults import FaultList
from mir_sim.fleets import knobs
from mir_sim.fleets.orders import STATE_OF_ITEM, Order, OrderBook, Vehicle
from mir_sim.history import past
from mir_sim.machine import Event, Machine
from mir_sim.missions import MISSIONS
from mir_sim.robot import SimulatedRobot
from mir_sim.site import Site, new_guid
from mir_sim.world import BY_NAME

LOOKS_EVERY = 1.0  # s between two looks at the robots (guess), at whole seconds, so that reading changes nothing

RETURN_TO_CHARGER, GO_HOME = (
    next(mission.guid for mission in MISSIONS if mission.name == name) for name in ("Return to charger", "Home")
)
HOME = BY_NAME["Home"]  # where idle robots wait
NEAR = 0.5  # m


class SimulatedFleet(Machine):
    """What all fleets have in common.

    Its clock is that of the first robot. The robots share its time, its lock and its missions, positions, maps and users, and are not
    to be advanced by themselves.

    Args:
        robots: at least one, all with the same clock and software, and without orders.
        seed: with the name, decides everything random.
        chaos: share of API requests (0…1) that meet a random fault.
        history: ended orders that the book begins with.
    """

    def __init__(
        self,
        name: str,
        robots: Sequence[SimulatedRobot],
        *,
        seed: int = 1,
        chaos: float = 0.0,
        history: int = 0,
    ) -> None:
        first = robots[0]
        super().__init__(
            name,
            RobotClock(first.clock.start, first.clock.zone, first.clock.offset, first.clock.drift),
            FaultList(chaos, random.Random(f"{seed}/{name}/chaos")),
            first.time_source,
            first.time_scale,
        )
        self.rng = random.Random(f"{seed}/{name}")
        self.serial_number = f"{self.rng.randrange(10**11):011d}"
        self.site = Site(self.rng, first.software, "Fleet")
        self._robots = tuple(robots)
        self.vehicles = [
            Vehicle(number, new_guid(self.rng), robot, f"192.0.2.{number}")
            for number, robot in enumerate(robots, start=1)
        ]
        self.book = OrderBook(
            self.vehicles, self.is_qualified, self.site.table("/missions").__contains__, self.description_on_robot
        )
        self._remember(history, random.Random(f"{seed}/{name}/history"))
        for vehicle in self.vehicles:
            robot = vehicle.robot
            robot.lock, robot.time_source = self.lock, self._time_for_robots
            robot.goes_offline = partial(self._lose_contact, vehicle)
            robot.site.share(self.site)

    knobs: Any = None  # how it differs, of the class for its kind

    def _remember(self, count: int, rng: random.Random) -> None:
        user = next(iter(self.site.table("/users")))
        for number, one in enumerate(past(count, rng), start=1):
            order = Order(number, new_guid(rng), one.mission.guid, user, one.started - 2, earliest=one.started - 2)
            order.state, order.vehicle = STATE_OF_ITEM[one.state], rng.choice(self.vehicles)
            order.started, order.ended = one.started, one.finished
            self.book.remember(order)

    # How fleets differ

    def is_qualified(self, vehicle: Vehicle, order: Order) -> bool:
        """Whether a robot may get an order that is for any."""
        return True

    def description_on_robot(self, order: Order) -> str:
        """What the item in the robot's queue has as description."""
        return order.description

    @property
    def charging_below(self) -> float | None:
        """Percent of battery below which a robot without orders is sent to the charger; None: never."""
        return None

    def charge(self, vehicle: Vehicle, mission_id: str) -> None:
        """Make an order for charging, which gives way to any other (guess)."""

    @property
    def staging_after(self) -> float | None:
        """Seconds after which a robot without orders is sent to where it waits; None: never."""
        return None

    def stage(self, vehicle: Vehicle, mission_id: str) -> None:
        """Make an order for that, which gives way to any other (guess)."""

    def keep_last(self, vehicle: Vehicle) -> None:
        """Keep what is shown of a robot while it isn't reached. Called just before that."""

    @property
    def assigns(self) -> bool:
        """Whether waiting orders are given to robots."""
        return True

    def look(self) -> None:
        """Called each second while the fleet is online and has something to do. The robots have advanced to ``now``."""
        self.book.look(self.now, assigns=self.assigns)
        if self._looks_after_idle_ones and self.assigns:
            for vehicle in self.vehicles:
                if self._is_idle(vehicle):
                    self._occupy(vehicle)

    @property
    def _looks_after_idle_ones(self) -> bool:
        return self.charging_below is not None or self.staging_after is not None

    def _occupy(self, vehicle: Vehicle) -> None:
        """Let an idle robot charge, or wait where it is in no one's way."""
        is_home = math.dist((vehicle.robot.pose.x, vehicle.robot.pose.y), (HOME.pose.x, HOME.pose.y)) < NEAR
        if self.charging_below is not None and vehicle.robot.battery.at(self.now) < self.charging_below:
            self.charge(vehicle, RETURN_TO_CHARGER)
        elif self.staging_after is not None and self.now >= vehicle.free_since + self.staging_after and not is_home:
            self.stage(vehicle, GO_HOME)

    def _is_idle(self, vehicle: Vehicle) -> bool:
        is_wanted = any(one.wanted is vehicle for one in self.book.open)
        return vehicle.is_free and vehicle.robot.run is None and not is_wanted

    def cut_off(self, names: set[str]) -> None:
        """Hear nothing of the robots with these names, and hear all others. All continue."""
        for vehicle in self.vehicles:
            if vehicle.robot.name in names:
                self._lose_contact(vehicle)
            vehicle.has_contact = vehicle.robot.name not in names

    def _lose_contact(self, vehicle: Vehicle) -> None:
        if vehicle.is_online:
            self.keep_last(vehicle)

    # Time

    def advance_to(self, seconds: float) -> None:
        with self.lock:
            super().advance_to(seconds)
            self._advance_robots()

    def _events(self) -> Iterator[Event]:
        yield from super()._events()
        if self.online and (self.book.has_open or self._looks_after_idle_ones):
            yield (math.floor(self.now / LOOKS_EVERY) + 1) * LOOKS_EVERY, self._look

    def _look(self) -> None:
        self._advance_robots()
        self.look()

    def _advance_robots(self) -> None:
        for robot in self._robots:
            robot.advance_to(self.now)

    def new_guid(self) -> str:
        return new_guid(self.rng)

    def _time_for_robots(self) -> float:
        """A robot that is asked by itself is where the fleet has let it come. The other robots follow when they are needed."""
        super().advance_to(self.time_source() if self.time_source is not None else self.now)
        return self.now

    def reboot(self, real_seconds: float) -> None:
        self.restart(real_seconds)

    def restart(self, real_seconds: float, *, forgets_waiting: bool = False, reuses_numbers: bool = False) -> None:
        """Be offline for a time. The robots continue, and what they have done is seen afterwards."""
        if forgets_waiting:
            self.book.forget_waiting(reuse_numbers=reuses_numbers)
        self._go_offline(real_seconds)


@control.commands_of.register
def _(fleet: SimulatedFleet) -> control.Commands:
    own = {"knobs": _turn, "out_of_contact": _cut_off}
    return {**{name: partial(command, fleet) for name, command in own.items()}, **control.SHARED}


def _turn(fleet: SimulatedFleet, value: Any) -> control.Action:
    turned = knobs.changed(fleet.knobs, value)
    return lambda _fleet: setattr(fleet, "knobs", turned)


def _cut_off(fleet: SimulatedFleet, value: Any) -> control.Action:
    names = [vehicle.robot.name for vehicle in fleet.vehicles]
    if not isinstance(value, list):
        raise checks.WrongValue("out_of_contact must be a list of names of robots.")
    wanted = {checks.one_of(one, "each of out_of_contact", names) for one in value}
    return lambda _fleet: fleet.cut_off(wanted)
