"""The order book of a fleet: which robot gets an order and when, how its end is seen, cancelling, restarts."""

from __future__ import annotations

from typing import Any

import pytest

from mir_sim import SimulatedRobot
from mir_sim.fleets import KINDS, make_fleet
from mir_sim.fleets.base import SimulatedFleet
from mir_sim.fleets.classic import OWN_USER
from mir_sim.fleets.orders import Order, OrderState, Vehicle
from mir_sim.site import DISTRIBUTOR
from tests.unit.sim.asking import GUIDS

WAITING, SENT, RUNNING, STOPPING, DONE, ABORTED, INVALID = OrderState


class Fleet(SimulatedFleet):
    """Two robots, and orders for them."""

    def __init__(self) -> None:
        super().__init__("Fleet", [SimulatedRobot(name, battery=80.0) for name in ("Aino", "Veikko")])
        self.disqualified: set[str] = set()

    def is_qualified(self, vehicle: Vehicle, order: Order) -> bool:
        return vehicle.robot.name not in self.disqualified

    def order(self, mission: str = "Home", robot: int | None = None, **fields: Any) -> Order:
        user = self.site.table("/users").get(DISTRIBUTOR)
        if robot is not None:
            fields["wanted"] = self.vehicles[robot - 1]
        return self.book.submit(f"guid-{len(self.book)}", GUIDS[mission], user, self.now, **fields)

    def pass_time(self, seconds: float) -> None:
        self.advance_to(self.now + seconds)

    def end_of(self, order: Order) -> OrderState:
        """The state in which an order ends, within ten minutes."""
        ends = self.now + 600
        while not order.state.is_end and self.now < ends:
            self.pass_time(0.5)
        return order.state


@pytest.fixture
def fleet() -> Fleet:
    return Fleet()


def name_of(order: Order) -> str | None:
    return order.vehicle.robot.name if order.vehicle is not None else None


def test_the_order_is_in_the_robots_own_queue(fleet: Fleet) -> None:
    order = fleet.order("Wait at home", parameters=[{"input_name": "Time", "value": "00:00:20"}], description="A1")
    fleet.pass_time(1)
    (item,) = fleet.vehicles[0].robot.queue
    assert order.item is item
    assert (item.fleet_schedule_guid, item.description, item.parameters) == (
        order.guid,
        "A1",
        [{"input_name": "Time", "value": "00:00:20"}],
    )


def test_any_order_goes_to_a_free_qualified_robot_each_in_turn(fleet: Fleet) -> None:
    orders = [fleet.order() for _ in range(3)]
    fleet.pass_time(1)
    assert [name_of(one) for one in orders] == ["Aino", "Veikko", None]
    assert [fleet.end_of(one) for one in orders] == [DONE, DONE, DONE]
    fleet.disqualified.add("Aino")
    orders = [fleet.order() for _ in range(2)]
    assert [(fleet.end_of(one), name_of(one)) for one in orders] == [(DONE, "Veikko")] * 2


@pytest.mark.parametrize("prevents", ["pause", "own mission", "inactive", "offline"])
def test_a_robot_that_is_not_free_gets_nothing_until_it_is(fleet: Fleet, prevents: str) -> None:
    vehicle = fleet.vehicles[0]
    robot = vehicle.robot
    match prevents:
        case "pause":
            robot.pause()
        case "own mission":
            robot.order(GUIDS["Home"], fleet.site.table("/users").get(DISTRIBUTOR))
        case "inactive":
            vehicle.is_active = False
        case "offline":
            robot.reboot(30)
    waits, other = fleet.order(robot=1), fleet.order()
    fleet.pass_time(3)
    assert (waits.state, other.vehicle) == (WAITING, fleet.vehicles[1])
    robot.resume()
    vehicle.is_active = True
    assert fleet.end_of(waits) is DONE
    assert waits.vehicle is vehicle


def test_an_order_whose_mission_was_deleted_is_invalid(fleet: Fleet) -> None:
    order = fleet.order("Home", earliest=10.0)
    fleet.vehicles[1].robot.site.table("/missions").remove(GUIDS["Home"])  # the robots' sites are the fleet's
    assert fleet.end_of(order) is INVALID


def test_a_restarted_fleet_sees_what_its_robots_have_done(fleet: Fleet) -> None:
    order, waits = fleet.order("Deliver", robot=1), fleet.order("Home", robot=1)
    fleet.pass_time(5)
    fleet.restart(300)
    fleet.pass_time(299)
    assert fleet.vehicles[0].robot.run is None
    assert (order.state, waits.state) == (RUNNING, WAITING)
    assert fleet.end_of(order) is DONE
    assert fleet.end_of(waits) is DONE


@pytest.mark.parametrize("kind", KINDS)
def test_a_fleet_that_is_simulated_again_is_the_same_one(kind):
    def identity(seed: int) -> object:
        fleet = make_fleet(kind, [SimulatedRobot("Bella")], seed=seed)
        own = [row["guid"] for row in fleet.site.table("/users") if row["username"] == OWN_USER]
        return fleet.name, own, [vehicle.guid for vehicle in fleet.vehicles]

    assert identity(1) == identity(1) != identity(2)
