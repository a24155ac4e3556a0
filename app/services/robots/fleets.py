"""A fleet's robots: asked from the fleet, compared with those of the plan, and added to it.

Everything but ``add`` talks to the fleet and belongs on a background thread.
"""

from __future__ import annotations

import itertools
import logging
import math
import threading
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from app.database.errors import DatabaseError
from app.domain import names
from app.domain.clock import Clock
from app.domain.message import Message, message
from app.domain.models import ANY_VEHICLE, Fleet, InvalidInput, Robot
from app.domain.robot import FleetIdentity, Vehicle
from app.i18n import _
from app.mir.address import machine
from app.mir.credentials import normalised, with_token
from app.mir.errors import RobotError
from app.services.catalogue import robot_edit
from app.services.catalogue.catalogue import Catalogue, Edit

ASK_EVERY, ASK_NEW_EVERY = 3600.0, 30.0  # s
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class FoundVehicle:
    """``vehicle`` is ANY_VEHICLE for whichever robot the fleet chooses. ``robot``: it, if it is in the plan. ``others``:
    of the plan, reached in another way, that are or may be the same machine."""

    vehicle: Vehicle
    robot: Robot | None = None
    others: tuple[Robot, ...] = ()

    @property
    def warning(self) -> Message:
        """Empty where there is nothing to warn about."""
        if not self.others:
            return ""
        return message(
            "{others} is the same robot, reached in another way: starts for both end up on one robot",
            others=", ".join(other.name for other in self.others),
        )


class Fleets:
    """``ask`` asks a fleet who it is and for its robots. Raises RobotError or InvalidInput."""

    def __init__(self, catalogue: Catalogue, ask: Callable[[Fleet], FleetIdentity], clock: Clock) -> None:
        self._catalogue, self._ask, self._clock = catalogue, ask, clock
        self._look_at, self._ask_at = -math.inf, dict[int, float]()  # monotonic; the second by fleet
        self._said = dict[int, str]()  # why they could not be asked, by fleet
        self._thread: threading.Thread | None = None

    def test_connection(self, fleet: Fleet, password: str | None = None) -> FleetIdentity:
        """Ask a fleet as entered, saved or not. Without a password the token of the saved one is used, if it belongs to
        that user, address and certificate. Raises InvalidInput or RobotError."""
        stored = self._fleet(fleet.id) if fleet.id else None
        identity = fleet.identity or (stored.identity if stored else None)
        fleet = with_token(replace(normalised(fleet), identity=identity), password, stored)
        if fleet.needs_password:
            raise InvalidInput(
                "password", "enter the password: the stored one belongs to another user, address or certificate"
            )
        return self._ask(fleet)

    def find(self, fleet_id: int) -> Sequence[FoundVehicle]:
        """The fleet's robots by name, and any of them. What the fleet says of itself is stored. Raises RobotError, or
        InvalidInput if another fleet answers, or the fleet has no password."""
        fleet = self._fleet(fleet_id)
        if fleet.needs_password:
            raise InvalidInput(
                "fleet", "{fleet} is switched off until its password is entered in Settings", fleet=fleet.name
            )
        said = self._identify(fleet)
        robots = self._catalogue.robots()
        either = Vehicle(ANY_VEHICLE, _("Any of {group}").format(group=fleet.name))
        vehicles = sorted(said.vehicles, key=lambda vehicle: (vehicle.name.casefold(), vehicle.id))
        return [_found(vehicle, fleet, robots) for vehicle in (either, *vehicles)]

    def add(self, fleet_id: int, vehicles: Iterable[Vehicle]) -> list[Robot]:
        """Those chosen, in one transaction, by the names that they have at the fleet, with a number if one is taken.
        Raises InvalidInput."""
        return self._catalogue.edit(lambda edit: _add(edit, edit.the(Fleet, fleet_id), vehicles))

    def tick(self) -> None:
        """A chore: ask fleets once an hour who they are, on a separate thread, as what a check-up found holds for one
        fleet with one software; those that are not known yet sooner. Returns at once."""
        now = self._clock.monotonic()
        if now < self._look_at or (self._thread and self._thread.is_alive()):
            return
        self._look_at = now + ASK_NEW_EVERY
        enabled = [fleet for fleet in self._catalogue.fleets() if fleet.enabled]
        fleets = [fleet for fleet in enabled if fleet.identity is None or self._ask_at.get(fleet.id, now) <= now]
        self._ask_at |= dict.fromkeys((fleet.id for fleet in fleets), now + ASK_EVERY)
        if fleets:
            self._thread = threading.Thread(target=self._identify_all, args=(fleets,), name="fleets", daemon=True)
            self._thread.start()

    def ask_new(self, fleet_ids: Collection[int | None]) -> None:
        """The same for a command, on its thread: those of these that are not known yet, at most every 30 s."""
        now = self._clock.monotonic()
        if now >= self._look_at:
            self._look_at = now + ASK_NEW_EVERY
            fleets = self._catalogue.fleets()
            self._identify_all([fleet for fleet in fleets if fleet.id in fleet_ids and fleet.identity is None])

    def _identify_all(self, fleets: Sequence[Fleet]) -> None:
        for fleet in fleets:
            said = ""
            try:
                self._identify(fleet)
            except (RobotError, InvalidInput, DatabaseError) as problem:
                said = str(problem)
                if said != self._said.get(fleet.id):
                    log.info("Fleet %r could not be asked who it is: %s", fleet.name, said)
            self._said[fleet.id] = said

    def _identify(self, fleet: Fleet) -> FleetIdentity:
        """What it says of itself is stored."""
        said = self._ask(fleet)
        if fleet.identity and said.identity and said.identity != fleet.identity:
            raise InvalidInput(
                "address",
                "another fleet answers at this address: {found} instead of {expected}",
                found=said.identity,
                expected=fleet.identity,
            )
        self._catalogue.note_fleet(fleet, said.identity, said.software)
        return said

    def _fleet(self, fleet_id: int) -> Fleet:
        if fleet := next((fleet for fleet in self._catalogue.fleets() if fleet.id == fleet_id), None):
            return fleet
        raise InvalidInput("fleet", "this fleet no longer exists")


def _found(vehicle: Vehicle, fleet: Fleet, robots: Iterable[Robot]) -> FoundVehicle:
    own, others = None, list[Robot]()
    for robot in robots:
        if robot.fleet is not None and (robot.fleet.id, robot.vehicle) == (fleet.id, vehicle.id):
            own = robot
        elif _is_same_machine(vehicle, robot):
            others.append(robot)
    return FoundVehicle(vehicle, own, tuple(others))


def _is_same_machine(vehicle: Vehicle, robot: Robot) -> bool:
    """By their serial numbers; where one is not known, by the address of a robot that is reached directly."""
    if vehicle.serial_number and robot.serial_number:
        return vehicle.serial_number == robot.serial_number
    with suppress(InvalidInput):  # a damaged address is of no robot
        return robot.fleet is None and bool(vehicle.ip) and machine(robot.address)[0] == vehicle.ip
    return False


def _add(edit: Edit, fleet: Fleet, vehicles: Iterable[Vehicle]) -> list[Robot]:
    taken = {robot.name.casefold() for robot in edit.robots.all(edit.c)}
    taken |= {group.name.casefold() for group in edit.groups.all(edit.c)}
    added = []
    for vehicle in vehicles:
        name = _free_name(vehicle, taken)
        taken.add(name.casefold())
        robot = Robot(
            name, "", fleet=fleet, vehicle=vehicle.id, serial_number=vehicle.serial_number or None, model=vehicle.model
        )
        added.append(robot_edit.save(edit, robot))
    return added


def _free_name(vehicle: Vehicle, taken: Collection[str]) -> str:
    base = names.cleaned(vehicle.name) or vehicle.id
    numbered = (f"{base[: names.LONGEST - 5]} {number}" for number in itertools.count(2))
    return next(name for name in itertools.chain([base], numbered) if name.casefold() not in taken)
