"""A robot of Fleet Enterprise as a target, against the simulated fleet."""

from __future__ import annotations

import uuid
from email.utils import format_datetime
from typing import Any

import pytest

from app.domain.capabilities import FindBy
from app.domain.models import ANY_VEHICLE
from app.domain.robot import QueueState, RobotState
from app.mir.credentials import Token
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.errors import (
    AnotherFleet,
    AnotherRobot,
    ConnectionLost,
    Delivery,
    NotAMir,
    NotShownYet,
    OldFleet,
    Rejected,
    Unauthorized,
    Unreadable,
    VehicleUnavailable,
)
from app.mir.fleet_connection import FleetConnection
from app.mir.transport import Response
from mir_sim.faults import Fault, FaultKind
from tests.support.errors import raises
from tests.support.fleets import ADDRESS, KEY, TOKEN, MachineTransport
from tests.unit.mir.halls import EnterpriseHall, token
from tests.unit.sim.asking import GUIDS

OLDER = {"version": "1.4.2"}


@pytest.fixture
def hall() -> EnterpriseHall:
    return EnterpriseHall()


@pytest.fixture
def aino(hall: EnterpriseHall) -> Any:
    return hall.vehicle()


@pytest.fixture
def own() -> str:
    return token()


@pytest.fixture
def older() -> EnterpriseHall:
    return EnterpriseHall(**OLDER)


def test_a_request_that_is_lost_is_not_found(hall: EnterpriseHall, aino: Any) -> None:
    own = hall.lose(aino, FaultKind.DROP_REQUEST)
    assert aino.items_after(0, tokens=(own,)) == []
    with raises(Rejected, status=404):
        aino.queue_item(0, own)


@pytest.mark.parametrize("knobs", [{}, OLDER], ids=["1.5.0", "1.4.2"])
def test_the_same_order_sent_again_is_the_same(knobs: dict[str, Any]) -> None:
    hall = EnterpriseHall(**knobs)
    aino, own = hall.vehicle(), token()
    assert len({aino.enqueue(GUIDS["Home"], description=own) for _ in range(2)}) == 1 == hall.orders


def test_another_order_with_its_id_is_not_taken_for_it(hall: EnterpriseHall) -> None:
    aino, veikko, own = hall.vehicle(0), hall.vehicle(1), token()
    aino.enqueue(GUIDS["Home"], description=own)
    with raises(Rejected, status=409, delivery=Delivery.REFUSED):
        veikko.enqueue(GUIDS["Home"], description=own)


def test_an_order_that_was_taken_and_comes_later_is_in_doubt_until_then() -> None:
    hall = EnterpriseHall(posted="accepted", appears_seconds=(2.0, 3.0))
    aino, own = hall.vehicle(), token()
    with raises(NotShownYet, delivery=Delivery.UNKNOWN):
        aino.enqueue(GUIDS["Home"], description=own)
    assert aino.items_after(0, tokens=(own,)) == []
    hall.pass_time(3.5)
    assert [item.description for item in aino.items_after(0, tokens=(own,))] == [own]


def test_an_order_that_was_taken_and_never_comes_is_in_doubt() -> None:
    hall = EnterpriseHall(posted="lost")
    aino, own = hall.vehicle(), token()
    with pytest.raises(NotShownYet):
        aino.enqueue(GUIDS["Home"], description=own)
    hall.pass_time(90.0)
    assert aino.items_after(0, tokens=(own,)) == []


def test_an_ended_order_that_could_be_another_one_is_in_doubt(older: EnterpriseHall) -> None:
    """Software 1.4.2 does not say the ids of ended orders, and the app has been restarted since."""
    own = token()
    older.vehicle().enqueue(GUIDS["Home"], description=own)
    older.pass_time(300.0)
    older.restart_app()
    with pytest.raises(Unreadable):
        older.vehicle().items_after(0, tokens=(own,))
    assert older.vehicle(1).items_after(0, tokens=(own,)) == []


def test_an_order_of_somebody_else_is_cancelled_by_its_number(hall: EnterpriseHall) -> None:
    hall.fleet.order_of_somebody(GUIDS["Deliver"], hall.fleet.vehicles[0])
    hall.pass_time(2.0)
    aino = hall.vehicle()
    (item,) = aino.open_items()
    aino.cancel(item.id)
    hall.pass_time(10.0)
    assert aino.open_items() == []


@pytest.mark.parametrize("shows", ["last", "identity"])
def test_a_robot_of_which_nothing_is_heard_is_unavailable(shows: str) -> None:
    hall = EnterpriseHall(offline_robot=shows)
    aino = hall.vehicle()
    assert aino.status().state is RobotState.READY
    hall.robots[0].reboot(600.0)
    for _ in range(3):
        hall.pass_time(10.0)
        if shows == "last" and hall.fleet.now < 20:
            aino.status()  # the last that was heard is not old yet
    with pytest.raises(VehicleUnavailable):
        aino.status()
    with raises(VehicleUnavailable, delivery=Delivery.NOT_SENT):
        aino.enqueue(GUIDS["Home"], description=token())
    assert hall.vehicle(1).status().state is RobotState.READY


def test_another_fleet_or_robot_gets_no_order(hall: EnterpriseHall) -> None:
    for target, kind in (
        (hall.vehicle(serial_number="0815"), AnotherRobot),
        (hall.vehicle(fleet_identity="Yard"), AnotherFleet),
        (hall.vehicle(ANY_VEHICLE, fleet_identity="Yard"), AnotherFleet),
    ):
        with raises(kind, delivery=Delivery.NOT_SENT):
            target.enqueue(GUIDS["Home"], description=token())
    assert hall.orders == 0


def test_older_software_is_refused() -> None:
    hall = EnterpriseHall(version="1.3.1")
    with raises(OldFleet, "1.3.1", delivery=Delivery.NOT_SENT):
        hall.vehicle().enqueue(GUIDS["Home"], description=token())
    assert hall.orders == 0


def test_a_wrong_key_is_refused(hall: EnterpriseHall) -> None:
    with pytest.raises(Unauthorized):
        hall.vehicle(transport=MachineTransport(hall.fleet, TOKEN)).status()


def test_the_robot_is_paused_and_resumed(hall: EnterpriseHall, aino: Any) -> None:
    aino.set_state(RobotState.PAUSE)
    hall.pass_time(3.0)
    assert aino.status().state is RobotState.PAUSE
    aino.set_state(RobotState.READY)
    hall.pass_time(3.0)
    assert aino.status().state is RobotState.READY


def test_what_it_can_do_is_known_by_its_software() -> None:
    whole, older = EnterpriseHall().vehicle(), EnterpriseHall(**OLDER).vehicle()
    for target in (whole, older):
        target.identify()
        assert target.capabilities.find_by is FindBy.ID
    assert whole.capabilities.pause
    assert not older.capabilities.pause


def test_a_mission_that_is_not_the_fleets_makes_a_robot_busy(hall: EnterpriseHall) -> None:
    robot = hall.robots[0]
    robot.order(GUIDS["Deliver"], next(iter(robot.site.table("/users"))))
    hall.pass_time(5.0)
    assert hall.vehicle().status().state is RobotState.EXECUTING
    assert hall.vehicle(1).status().state is RobotState.READY


def test_a_busy_robot_says_so_and_why_an_order_failed(hall: EnterpriseHall, aino: Any, own: str) -> None:
    number = aino.enqueue(GUIDS["Deliver"], description=own)
    hall.run_until(aino, 0, own, QueueState.EXECUTING)
    hall.pass_time(1.1)
    assert aino.status().state is RobotState.EXECUTING
    hall.robots[0].cancel_all()
    hall.run_until(aino, 0, own, QueueState.ABORTED)
    assert aino.queue_item(number, own).message


def test_missions_and_what_they_ask_for(hall: EnterpriseHall, aino: Any) -> None:
    assert {mission.name: mission.guid for mission in aino.missions()}["Home"] == GUIDS["Home"]
    (asked,) = aino.parameters(GUIDS["Go to position"]) or ()
    assert asked.is_position
    place = aino.positions()[0]
    own = token()
    aino.enqueue(GUIDS["Go to position"], description=own, parameters={asked.name: place.guid})
    assert hall.run_until(aino, 0, own, QueueState.DONE)
    with pytest.raises(Rejected):
        aino.mission(token())


def test_a_question_is_answered_by_the_number_of_its_option(hall: EnterpriseHall, aino: Any, own: str) -> None:
    aino.enqueue(GUIDS["Ask for release"], description=own)
    ends = hall.fleet.now + 120
    while (prompt := aino.status().user_prompt) is None:
        assert hall.fleet.now < ends
        hall.pass_time(1.1)
    with pytest.raises(Rejected):
        aino.answer_prompt(prompt.guid, "perhaps")
    aino.answer_prompt(prompt.guid, prompt.options[-1])
    hall.pass_time(2.0)
    assert aino.status().user_prompt is None


def test_the_fleet_says_who_it_is(hall: EnterpriseHall) -> None:
    found = hall.vehicle(ANY_VEHICLE).identify_fleet()
    assert (found.identity, found.software) == ("Hall", "1.5.0")
    assert [(each.id, each.name) for each in found.vehicles] == list(zip(hall.ids, ("Aino", "Veikko"), strict=True))


def test_the_fleets_robots_share_what_is_the_same_for_all(hall: EnterpriseHall) -> None:
    targets = [hall.vehicle(0), hall.vehicle(1), hall.vehicle(ANY_VEHICLE)]
    for target in targets:
        target.status()
        target.open_items()
    for path in ("/system/version", "/serial-order-status/snapshot"):
        assert hall.transport.requests.count(f"GET {path}") == 1


def test_an_order_that_ended_long_ago_and_was_not_seen_is_the_newest_of_its_robot():
    hall = EnterpriseHall()
    aino, first, last = hall.vehicle(), str(uuid.uuid4()), str(uuid.uuid4())
    before = aino.enqueue(GUIDS["Deliver"], description=first)
    assert aino.newest_id(first) == before
    hall.run_until(aino, 0, first, QueueState.DONE)
    hall.pass_time(7200)
    sent = aino.enqueue(GUIDS["Deliver"], description=last)
    hall.run_until(aino, 0, last, QueueState.DONE)
    hall.pass_time(7200)
    assert aino.newest_id(last) == sent
    hall.restart_app()
    assert hall.vehicle().newest_id(last) == sent


class Dated(MachineTransport):
    """Its answers say what time it is at the fleet."""

    def send(self, *args: Any, **options: Any) -> Response:
        answer = super().send(*args, **options)
        date = format_datetime(self.machine.clock.utc(self.machine.now), usegmt=True)
        return Response(answer.status, answer.body, {**answer.headers, "Date": date})


def test_an_order_that_ended_more_than_an_hour_ago_is_found_by_its_time(older: EnterpriseHall) -> None:
    aino = older.vehicle(transport=Dated(older.fleet, KEY))
    older.run_one(aino)
    own = older.lose(aino, FaultKind.DROP_RESPONSE)
    older.pass_time(2 * 3600.0)
    (item,) = aino.items_after(0, tokens=(own,))
    assert (item.state, item.description) == (QueueState.DONE, own)


def test_without_the_fleets_time_an_order_of_more_than_an_hour_ago_is_in_doubt(older: EnterpriseHall) -> None:
    aino = older.vehicle()
    own = older.lose(aino, FaultKind.DROP_RESPONSE)
    older.pass_time(2 * 3600.0)
    with pytest.raises(Unreadable):
        aino.items_after(0, tokens=(own,))


def test_a_question_that_fails_before_the_order_leaves_it_unsent(older: EnterpriseHall) -> None:
    older.fleet.faults.add(Fault(FaultKind.DROP_RESPONSE, "/order", "GET"))
    with raises(ConnectionLost, delivery=Delivery.NOT_SENT):
        older.vehicle().enqueue(GUIDS["Home"], description=token())
    assert older.orders == 0


@pytest.mark.parametrize("robot", [0, ANY_VEHICLE])
def test_while_the_list_of_orders_can_not_be_read_orders_are_followed_and_cancelled_but_none_is_sent(
    hall: EnterpriseHall, robot: int | str
) -> None:
    client, own = hall.vehicle(robot), token()
    number = client.enqueue(GUIDS["Deliver"], description=own)
    hall.run_until(client, 0, own, QueueState.EXECUTING)
    hall.fleet.faults.add(Fault(FaultKind.HTML, "/serial-order-status/snapshot", "GET", count=None))
    hall.pass_time(2.0)
    assert client.status().state in (RobotState.READY, RobotState.EXECUTING)
    with raises(NotAMir, delivery=Delivery.NOT_SENT):
        client.enqueue(GUIDS["Home"], description=token())
    assert hall.orders == 1
    client.cancel(number, own)
    assert hall.run_until(client, 0, own, QueueState.ABORTED)


def test_an_order_whose_phase_has_another_id_is_followed_without_the_list_of_orders(hall: EnterpriseHall) -> None:
    serial = hall.fleet.order_of_somebody(GUIDS["Home"], hall.fleet.vehicles[0], id_=token())
    hall.fleet.faults.add(Fault(FaultKind.HTML, "/serial-order-status/snapshot", "GET", count=None))
    hall.pass_time(300.0)
    assert hall.vehicle().queue_item(0, serial.id).state is QueueState.DONE


@pytest.mark.parametrize("is_key_known", [True, False])
def test_an_order_of_another_api_client_is_not_taken_for_a_lost_one(older: EnterpriseHall, is_key_known: bool) -> None:
    aino, others = older.vehicle(), Token.of_key("mir_other")
    if is_key_known:
        older.run_one(aino)
    own = older.lose(aino, FaultKind.DROP_REQUEST)
    connection, transport = FleetConnection(clock=lambda: older.fleet.now), MachineTransport(older.fleet, others)
    stranger = EnterpriseVehicle(ADDRESS, others, older.ids[0], connection=connection, transport=transport)
    stranger.enqueue(GUIDS["Home"], description=token())
    older.pass_time(300.0)
    if is_key_known:
        assert aino.items_after(0, tokens=(own,)) == []
    else:
        with pytest.raises(Unreadable):
            aino.items_after(0, tokens=(own,))


def test_an_order_whose_phase_is_forgotten_is_not_waiting_for_ever(
    hall: EnterpriseHall, aino: Any, own: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    number, found = aino.enqueue(GUIDS["Home"], description=own), aino._found
    monkeypatch.setattr(aino, "_found", lambda path: None if path.startswith("/order/") else found(path))
    assert aino.queue_item(number, own).state is QueueState.PENDING
    hall.pass_time(300.0)
    assert aino.queue_item(number, own).state is QueueState.UNKNOWN


def test_ids_in_capitals_are_the_same(older: EnterpriseHall) -> None:
    aino, own, get = older.vehicle(), token(), older.transport.send
    aino.enqueue(GUIDS["Home"], description=own)

    def send(*args: Any, **options: Any) -> Response:
        answer = get(*args, **options)
        return Response(answer.status, answer.body.replace(own.encode(), own.upper().encode()), answer.headers)

    older.transport.send = send  # type: ignore[method-assign]
    (item,) = aino.items_after(0, tokens=(own,))
    assert item.description == own
