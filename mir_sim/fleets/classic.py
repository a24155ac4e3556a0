"""MiR's classic fleet of software 2.x and 3.x: /api/v2.0.0 with /mission_scheduler, /robots and groups, and stored data as on robots.

What is said of fleets was recorded, is documented, or is read from clients in use, as far as no comment says "guess".
"""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from mir_sim import api, definition
from mir_sim.errors import ApiError
from mir_sim.fleets import classic_orders, classic_relations, classic_robots, classic_system, classic_view, knobs
from mir_sim.fleets.base import SimulatedFleet
from mir_sim.fleets.knobs import ClassicKnobs
from mir_sim.fleets.orders import Order, Vehicle
from mir_sim.messages import Request, Response
from mir_sim.profile import FAITHFUL
from mir_sim.resources import registry
from mir_sim.resources.call import Handlers
from mir_sim.rest_machine import RestMachine
from mir_sim.robot import SimulatedRobot
from mir_sim.site import ADMINISTRATOR, DISTRIBUTOR, password_hash

BOX_PAGE = b"<html><head><title>Blocked</title></head><body>Request blocked by policy.</body></html>\n"


OWN_USER = (
    "scheduler"  # and its password: a user that somebody has made for one client, so that it is on no other fleet
)


class ClassicFleet(SimulatedFleet, RestMachine):
    """A classic fleet. ``knobs``: how it differs from the faithful one."""

    knobs: ClassicKnobs
    profile = FAITHFUL
    software = definition.FLEET_SOFTWARE
    model = "Fleet"

    def __init__(
        self, name: str, robots: Sequence[SimulatedRobot], *, knobs: ClassicKnobs | None = None, **options: Any
    ) -> None:
        super().__init__(name, robots, **options)
        self.definition = definition.load(self.software)
        self.knobs = knobs or ClassicKnobs()
        self.state = "normal"
        self.removed: list[Vehicle] = []
        self.is_evacuating = False
        self.relations: dict[tuple[str, str], list[Any]] = {}  # by collection and group: keys of its members
        self.site.table("/robot_groups").add(
            {
                "id": 1,
                "name": "Default",
                "description": "All robots",
                "allow_all_mission_groups": True,
                "created_by_id": ADMINISTRATOR,
            }
        )
        self._add_own_user()
        self.last_status: dict[int, dict[str, Any]] = {}  # by number: of robots out of contact, the last one

    def _add_own_user(self) -> None:
        users = self.site.table("/users")
        own = {"username": OWN_USER, "name": "Scheduler", "password_hash": password_hash(OWN_USER)}
        guid = str(uuid.uuid5(uuid.NAMESPACE_OID, f"{self.serial_number}/{OWN_USER}"))  # the same after a restart
        users.add({**(users.get(DISTRIBUTOR) or {}), "guid": guid, **own})

    @property
    def search_status(self) -> int | None:
        return None if self.knobs.search == 404 else self.knobs.search

    def keep_last(self, vehicle: Vehicle) -> None:
        self.last_status[vehicle.number] = classic_view.status_of(vehicle)

    # Orders

    def is_qualified(self, vehicle: Vehicle, order: Order) -> bool:
        """By groups: that of the robot must allow that of the mission."""
        return self.may_run(vehicle, order.mission_id)

    def may_run(self, vehicle: Vehicle, mission_id: str) -> bool:
        group = self.site.table("/robot_groups").get(vehicle.group)
        mission = self.site.table("/missions").get(mission_id)
        if group is None or mission is None:
            return False
        allowed = classic_relations.members(self, "/robot_groups/{robot_group_id}/mission_groups", vehicle.group)
        return bool(group["allow_all_mission_groups"]) or mission["group_id"] in allowed

    def described(self, order: Order, kind: str) -> str:
        """The description of an order as a knob has it: "posted", "mission" or "none"."""
        mission = self.site.table("/missions").get(order.mission_id)
        return {"posted": order.description, "mission": mission["description"] if mission else "", "none": ""}[kind]

    def description_on_robot(self, order: Order) -> str:
        return self.described(order, self.knobs.description_on_robot)

    @property
    def assigns(self) -> bool:
        """Not in maintenance, nor while everything is evacuated (guess)."""
        return self.state == "normal" and not self.is_evacuating

    @property
    def charging_below(self) -> float | None:
        return self.knobs.charging_below

    @property
    def staging_after(self) -> float | None:
        return self.knobs.staging_after

    def charge(self, vehicle: Vehicle, mission_id: str) -> None:
        self._order_itself(mission_id, wanted=vehicle)

    def stage(self, vehicle: Vehicle, mission_id: str) -> None:
        self._order_itself(mission_id, wanted=vehicle, is_staging=True)

    def _order_itself(self, mission_id: str, **fields: Any) -> None:
        user = self.site.table("/users").get(ADMINISTRATOR)
        if user is not None:
            self.book.submit(self.new_guid(), mission_id, user, self.now, **fields)

    # Restarts

    def reboot(self, real_seconds: float) -> None:
        self.restart(
            real_seconds,
            forgets_waiting=self.knobs.waiting_after_reboot == "lost",
            reuses_numbers=self.knobs.ids_after_reboot == "reused",
        )

    def _come_online(self) -> None:
        super()._come_online()
        if self.knobs.order_of_robots == "changed":
            self.vehicles.append(self.vehicles.pop(0))

    def snapshot(self) -> dict[str, Any]:
        with self.lock:
            self.catch_up()
            return {
                "name": self.name,
                "kind": "classic",
                "now": self.stamp(),
                "seconds": round(self.now, 3),
                "state": self.state,
                "online": self.online,
                "orders": [classic_orders.Shown(self, order).full() for order in self.book],
                "robots": [classic_robots.brief(vehicle) for vehicle in self.vehicles],
                "knobs": knobs.shown(self.knobs),
                "faults": self.faults.full(),
            }

    def moment(self, seconds: float | None) -> str:
        """A time as answers have it: local, without zone, in whole seconds; 1970 for one that has not come."""
        return "1970-01-01T00:00:00" if seconds is None else self.clock.stamp(seconds)

    def seconds_of(self, moment: datetime) -> float:
        """The simulated second of a time that a client has sent; a knob says what one without zone means."""
        zone = UTC if self.knobs.earliest_start == "utc" else self.clock.tz
        aware = moment if moment.tzinfo else moment.replace(tzinfo=zone)
        return self.now + (aware - self.clock.utc(self.now)).total_seconds()


@api.answer.register
def _(fleet: ClassicFleet, request: Request) -> Response:
    if fleet.knobs.box is not None:
        return Response(fleet.knobs.box, {"Content-Type": "text/html"}, BOX_PAGE)
    if fleet.knobs.demands_language and "accept-language" not in request.headers:
        return api.refuse(fleet, ApiError(400))
    return api.answer_rest(fleet, request)


@registry.handlers.register
def _(fleet: ClassicFleet) -> Handlers:
    return OPERATIONS


OPERATIONS: Handlers = {
    **registry.SHARED,
    **classic_orders.HANDLERS,
    **classic_relations.HANDLERS,
    **classic_robots.HANDLERS,
    **classic_system.HANDLERS,
}
