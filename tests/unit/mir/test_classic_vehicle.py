"""A robot of a classic fleet as a target, against the simulated fleet."""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.capabilities import FindBy
from app.domain.check_up import RobotProfile
from app.domain.models import ANY_VEHICLE
from app.domain.robot import QueueState, RobotState
from app.mir.classic_requests import ClassicRequests
from app.mir.classic_vehicle import VERIFIED_FOR, ClassicVehicle
from app.mir.errors import (
    AnotherFleet,
    AnotherRobot,
    Delivery,
    NotAMir,
    Rejected,
    RobotError,
    Unreadable,
    VehicleUnavailable,
)
from app.mir.fleet_connection import FleetConnection
from app.mir.robot_vocabulary import USER_REQUEST
from app.mir.transport import Response
from mir_sim import SimulatedRobot
from mir_sim.faults import Fault, FaultKind
from mir_sim.fleets.classic_orders import Shown
from tests.support.errors import raises
from tests.support.fleets import ADDRESS, TOKEN, MachineTransport
from tests.unit.mir.halls import ClassicHall, token
from tests.unit.sim.asking import GUIDS


@pytest.fixture
def hall() -> ClassicHall:
    return ClassicHall()


@pytest.fixture
def aino(hall: ClassicHall) -> Any:
    return hall.vehicle()


def test_other_robots_orders_are_not_this_ones(hall: ClassicHall) -> None:
    aino, veikko = hall.vehicle("1"), hall.vehicle("2")
    number = veikko.enqueue(GUIDS["Home"], description=token())
    assert aino.items_after(0) == [] == aino.open_items()
    assert [item.id for item in veikko.open_items()] == [number]


@pytest.mark.parametrize("runs", [False, True], ids=["waiting", "running"])
def test_an_order_that_ends_before_it_began_was_cancelled(hall: ClassicHall, aino: Any, runs: bool) -> None:
    """Of one that ran the fleet doesn't say whether it failed."""
    number = aino.enqueue(GUIDS["Deliver"], description=token())
    if runs:
        hall.run_until(aino, number, "", QueueState.EXECUTING)
    hall.vehicle().cancel(number)
    hall.run_until(aino, number, "", QueueState.ABORTED)
    assert aino.queue_item(number).message == ("" if runs else USER_REQUEST)


def test_a_robot_without_contact_is_unavailable_although_its_last_status_is_shown(hall: ClassicHall, aino: Any) -> None:
    assert aino.status().state is RobotState.READY
    hall.robots[0].reboot(60.0)
    hall.pass_time(2.0)
    with pytest.raises(VehicleUnavailable):
        aino.status()
    with raises(VehicleUnavailable, delivery=Delivery.NOT_SENT):
        aino.enqueue(GUIDS["Home"], description=token())
    assert hall.vehicle("2").status().state is RobotState.READY


def test_another_fleet_at_the_address_gets_no_order(hall: ClassicHall) -> None:
    aino = hall.vehicle(serial_number="0815")
    any_robot = hall.vehicle(ANY_VEHICLE, fleet_identity="another user")
    for target, kind in ((aino, AnotherRobot), (any_robot, AnotherFleet)):
        with raises(kind, delivery=Delivery.NOT_SENT):
            target.enqueue(GUIDS["Home"], description=token())
    assert hall.vehicle().highest_queue_id() is None


def test_a_fleet_that_does_not_say_who_the_user_is_is_no_other_one(
    hall: ClassicHall, monkeypatch: pytest.MonkeyPatch
) -> None:
    aino, get = hall.vehicle(fleet_identity="own user"), ClassicRequests._get

    def boots(self: ClassicRequests, path: str, *rest: Any, **options: Any) -> Any:
        if path == "/users/me":
            raise Rejected(address="fleet", status=404, reason="Not found")
        return get(self, path, *rest, **options)

    monkeypatch.setattr(ClassicRequests, "_get", boots)
    with pytest.raises(Unreadable):
        aino.status()


def test_another_fleet_is_noticed_soon_after_the_known_one_answered(
    hall: ClassicHall, monkeypatch: pytest.MonkeyPatch
) -> None:
    any_robot = hall.vehicle(ANY_VEHICLE, fleet_identity="own user")
    monkeypatch.setattr(any_robot, "_ask_user", lambda: ("own user", ""))
    any_robot.status()
    hall.pass_time(VERIFIED_FOR + 1.0)
    monkeypatch.setattr(any_robot, "_ask_user", lambda: ("another user", ""))
    with pytest.raises(AnotherFleet):
        any_robot.enqueue(GUIDS["Home"], description=token())
    assert hall.vehicle().highest_queue_id() is None


def test_a_single_robot_is_no_fleet() -> None:
    robot = SimulatedRobot("Aino", battery=80.0, software="2.14.7")
    connection = FleetConnection(clock=lambda: robot.now)
    target = ClassicVehicle(ADDRESS, TOKEN, "1", connection=connection, transport=MachineTransport(robot, TOKEN))
    with raises(NotAMir, code="not_a_fleet"):
        target.status()


def test_the_fleets_robots_share_one_reading(hall: ClassicHall) -> None:
    targets = [hall.vehicle("1"), hall.vehicle("2"), hall.vehicle(ANY_VEHICLE)]
    for target in targets:
        target.status()
        target.open_items()
    assert hall.transport.requests.count("GET /robots") == 1
    assert hall.transport.requests.count("POST /mission_scheduler/search") == 1
    hall.pass_time(1.5)
    targets[0].status()
    assert hall.transport.requests.count("GET /robots") == 2


@pytest.mark.parametrize("robots", ["whole", "short"])
def test_the_fleet_lists_its_robots(robots: str) -> None:
    hall = ClassicHall(robots=robots)
    found = hall.vehicle(ANY_VEHICLE).identify_fleet()
    names = [(each.id, each.name, each.serial_number, each.ip) for each in found.vehicles]
    assert names == [
        (str(number), robot.name, robot.serial_number, f"192.0.2.{number}")
        for number, robot in enumerate(hall.robots, start=1)
    ]


@pytest.mark.parametrize("knobs", [{"robots": "short"}, {"status": "list"}, {"search": 404}, {"answer": "whole"}])
def test_fleets_that_answer_in_another_form(knobs: dict[str, Any]) -> None:
    aino = ClassicHall(**knobs).vehicle(profile=None)
    assert aino.status().robot_name == "Aino"
    number = aino.enqueue(GUIDS["Home"], description=token())
    assert [item.id for item in aino.open_items()] == [number] == [item.id for item in aino.items_after(0)]


def test_in_maintenance_no_robot_is_ready(hall: ClassicHall) -> None:
    hall.fleet.state = "maintenance"
    for vehicle in ("1", ANY_VEHICLE):
        status = hall.vehicle(vehicle).status()
        assert (status.state, status.state_text) == (RobotState.UNKNOWN, "maintenance")


def test_what_the_fleet_can_not_do_is_done_by_the_robots_own_api(hall: ClassicHall) -> None:
    aino = hall.vehicle(serial_number=hall.robots[0].serial_number)
    assert not aino.capabilities.pause
    assert aino.identify().status.serial_number == hall.robots[0].serial_number
    assert aino.capabilities.pause
    assert aino.capabilities.failure_text
    aino.set_state(RobotState.PAUSE)
    hall.pass_time(2.0)
    assert aino.status().state is RobotState.PAUSE
    aino.set_state(RobotState.READY)
    hall.pass_time(2.0)
    number = aino.enqueue(GUIDS["Deliver"], description=token())
    hall.run_until(aino, number, "", QueueState.EXECUTING)
    aino.cancel(number)
    hall.run_until(aino, number, "", QueueState.ABORTED)
    assert aino.queue_item(number).message == "Aborted - User Request"


def test_a_robot_that_can_not_be_reached_by_itself_can_not_be_paused(hall: ClassicHall) -> None:
    other = MachineTransport(hall.robots[1], TOKEN)  # another machine at that address
    aino = hall.vehicle(serial_number=hall.robots[0].serial_number, reach=lambda _address: other)
    aino.identify()
    assert not aino.capabilities.pause
    with pytest.raises(RobotError):
        aino.set_state(RobotState.PAUSE)
    assert hall.robots[1].state.name == "READY"


@pytest.mark.parametrize(("field", "found"), [("description", FindBy.TOKEN), ("", FindBy.MATCH), (None, FindBy.MATCH)])
def test_how_orders_are_found_is_what_the_check_up_has_seen(
    hall: ClassicHall, field: str | None, found: FindBy
) -> None:
    profile = RobotProfile(None, None, token_field=field)
    assert hall.vehicle(profile=profile).capabilities.find_by is found


def test_without_descriptions_an_order_still_says_whose_it_is() -> None:
    aino = ClassicHall(description="mission").vehicle(profile=RobotProfile(None, None, token_field=""))
    user = aino.identify().user_name
    aino.enqueue(GUIDS["Home"], description=token())
    (item,) = aino.items_after(0)
    assert user
    assert item.created_by_name == user
    assert item.mission_id == GUIDS["Home"]


def test_a_waiting_order_is_found_before_the_fleet_shows_its_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    full = Shown.full
    monkeypatch.setattr(Shown, "full", lambda self: full(self) | {"robot_id": 0})
    hall = ClassicHall(description="mission")
    aino = hall.vehicle(profile=RobotProfile(None, None, token_field=""))
    hall.lose(aino, FaultKind.DROP_RESPONSE)
    assert [item.mission_id for item in aino.items_after(0)] == [GUIDS["Home"]]


def test_a_failed_order_is_read_though_its_robots_place_is_not_known(
    hall: ClassicHall, monkeypatch: pytest.MonkeyPatch
) -> None:
    aino = hall.vehicle(serial_number=hall.robots[0].serial_number)
    aino.identify()
    assert aino.capabilities.failure_text
    number = aino.enqueue(GUIDS["Deliver"], description=token())
    hall.run_until(aino, number, "", QueueState.EXECUTING)
    aino.cancel(number)
    hall.pass_time(5.0)
    find = aino._vehicle
    monkeypatch.setattr(aino, "_vehicle", lambda within: (find(within)[0] | {"ip": ""}, find(within)[1]))
    item = aino.queue_item(number)
    assert (item.state, item.message) == (QueueState.ABORTED, "")


@pytest.mark.parametrize("field", ["description", ""], ids=["by token", "by user"])
def test_an_order_that_is_another_ones_now_is_not_cancelled(field: str) -> None:
    """The fleet has begun its numbers again."""
    hall = ClassicHall(description="posted" if field else "mission")
    aino = hall.vehicle(profile=RobotProfile(None, None, token_field=field))
    number = aino.enqueue(GUIDS["Deliver"], description=token())
    if not field:
        (order,) = hall.fleet.book
        order.created_by = {**order.created_by, "guid": "another user", "name": "another user"}
    with raises(Rejected, status=404):
        aino.cancel(number, token())
    aino.clear_queue({number: token()})
    assert f"DELETE /mission_scheduler/{number}" not in hall.transport.requests


def test_an_order_without_its_token_is_cancelled() -> None:
    """The fleet has stopped returning descriptions since it was checked up."""
    hall = ClassicHall(description="mission")
    aino = hall.vehicle()
    own = token()
    number = aino.enqueue(GUIDS["Deliver"], description=own)
    aino.cancel(number, own)
    assert hall.run_until(aino, number, "", QueueState.ABORTED)


def test_an_order_that_can_not_be_read_is_cancelled(hall: ClassicHall, aino: Any) -> None:
    """It was listed with the app's token: a late one of a cancelled start must not run."""
    number = aino.enqueue(GUIDS["Deliver"], description=token())
    hall.fleet.faults.add(Fault(FaultKind.GARBAGE, f"/mission_scheduler/{number}", "GET"))
    aino.cancel(number)
    assert f"DELETE /mission_scheduler/{number}" in hall.transport.requests


@pytest.mark.parametrize(("body", "delivery"), [(b"<html>", Delivery.UNKNOWN), (b"{}", Delivery.REFUSED)])
def test_a_refusal_that_is_not_in_the_fleets_words_is_in_doubt(
    hall: ClassicHall, body: bytes, delivery: Delivery
) -> None:
    """A security box may have said it, of an order that the fleet has taken."""
    send = hall.transport.send

    def through_a_box(method: str, path: str, **options: Any) -> Response:
        return send(method, path, **options) if method == "GET" else Response(470, body, {})

    hall.transport.send = through_a_box  # type: ignore[method-assign]
    with raises(Rejected, delivery=delivery):
        hall.vehicle().enqueue(GUIDS["Home"], description=token())


def test_a_question_is_answered_through_the_fleet(hall: ClassicHall, aino: Any) -> None:
    number = aino.enqueue(GUIDS["Ask for release"], description=token())
    ends = hall.fleet.now + 120
    while (prompt := aino.status().user_prompt) is None:
        assert hall.fleet.now < ends
        hall.pass_time(1.0)
    aino.answer_prompt(prompt.guid, prompt.options[0])
    hall.pass_time(2.0)
    assert aino.status().user_prompt is None
    assert hall.run_until(aino, number, "", QueueState.DONE, QueueState.ABORTED)


@pytest.mark.parametrize("search", [200, 404], ids=["by search", "by list"])
def test_the_newest_order_of_a_robot_is_known_only_where_the_fleet_sorts(search: int) -> None:
    hall = ClassicHall(search=search)
    aino = hall.vehicle()
    numbers = [aino.enqueue(GUIDS["Home"], description=token()) for _ in range(3)]
    assert aino.newest_id() == numbers[-1]
    hall.connection.forget("newest")
    entries = aino._entries
    aino._entries = lambda *asked: sorted(entries(*asked), key=lambda entry: entry["id"])  # type: ignore[method-assign]
    assert aino.newest_id() is None
