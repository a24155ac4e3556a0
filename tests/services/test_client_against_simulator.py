"""The robot client over real HTTP against the simulated robot: the two speak of the same API, also when the network doesn't behave."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime

import pytest

from app.domain.robot import QueueState, RobotState
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import Busy, ConnectionLost, Delivery, RobotError, TimedOut, Unauthorized, Unreachable
from app.mir.transport import Timeouts
from mir_sim import FleetRobot, serve
from mir_sim.definition import SOFTWARE
from tests.support.process import wait_for

QUICK = Timeouts(connect=5.0, read=0.5, total=1.0)
USUAL = Timeouts()


@pytest.fixture(params=SOFTWARE)
def machine(request: pytest.FixtureRequest) -> Iterator[FleetRobot]:
    """A robot of each software generation, whose time runs 200 times as fast."""
    with serve(robots=1, time_scale=200, software=request.param) as fleet:
        yield fleet.robots[0]


def connect(
    machine: FleetRobot, user: str = "distributor", password: str | None = None, timeouts: Timeouts = USUAL
) -> RobotClient:
    token = Token.derive(user, user if password is None else password)
    client = RobotClient(Address.parse(machine.url), token)
    client.timeouts = timeouts
    return client


@pytest.fixture
def robot(machine: FleetRobot) -> Iterator[RobotClient]:
    client = connect(machine)
    yield client
    client.close()


def guid_of(robot: RobotClient, name: str) -> str:
    return next(mission.guid for mission in robot.missions() if mission.name == name)


# ---------------------------------------------------------------------- who and how
def test_the_robot_says_who_it_is(machine: FleetRobot, robot: RobotClient) -> None:
    identity = robot.identify()
    assert identity.name == machine.name
    assert identity.model
    assert identity.serial_number
    assert identity.software
    assert identity.user_name
    status = identity.status
    assert status.state is RobotState.READY
    assert status.battery_percentage is not None
    assert status.date is not None
    assert abs((status.date - datetime.now(UTC)).total_seconds()) < 7 * 86400


@pytest.mark.parametrize(("user", "password"), [("distributor", "wrong"), ("nobody", "distributor")])
def test_a_wrong_password_shows_though_status_answers(machine: FleetRobot, user: str, password: str) -> None:
    robot = connect(machine, user, password)
    assert robot.status().robot_name == machine.name
    for call in (robot.identify, robot.missions, lambda: robot.enqueue("x")):
        with pytest.raises(Unauthorized) as refused:
            call()
        assert refused.value.delivery is Delivery.REFUSED
    robot.close()


def test_map_places_and_parameters(robot: RobotClient) -> None:
    map_id = robot.status().map_id
    assert map_id is not None
    floor_plan = robot.map(map_id)
    assert floor_plan.resolution > 0
    assert floor_plan.name
    places = robot.positions(map_id)
    assert places
    assert all(place.name and place.pose and place.map_id == map_id for place in places)
    assert {place.guid for place in places} == {place.guid for place in robot.positions()}
    assert robot.parameters(guid_of(robot, "Deliver")) == []
    assert [parameter.name for parameter in robot.parameters(guid_of(robot, "Go to position"))] == ["Position"]
    assert [parameter.default for parameter in robot.parameters(guid_of(robot, "Wait at home"))] == ["00:01:00.000000"]


# ---------------------------------------------------------------------- the queue
def test_a_mission_from_the_queue_to_its_end(robot: RobotClient) -> None:
    assert (robot.highest_queue_id(), robot.open_items(), robot.items_after(0)) == (None, [], [])
    robot.set_state(RobotState.PAUSE)
    number = robot.enqueue(guid_of(robot, "Home"), description="token-1", text="Evening", priority=2)
    (item,) = robot.items_after(0)
    assert (item.id, item.state, item.description, item.priority) == (number, QueueState.PENDING, "token-1", 2)
    assert (item.started, item.finished, item.created_by_name) == (None, None, "Distributor")
    assert [found.id for found in robot.open_items()] == [number]
    assert robot.highest_queue_id() == number
    assert robot.items_after(number) == []
    robot.set_state(RobotState.READY)
    wait_for(lambda: robot.queue_item(number).state is QueueState.DONE)
    done = robot.queue_item(number)
    assert done.ordered is not None
    assert done.started is not None
    assert done.finished is not None
    assert done.ordered <= done.started <= done.finished
    assert done.description == "token-1"
    assert robot.open_items() == []


def test_cancelling_one_and_all(machine: FleetRobot, robot: RobotClient) -> None:
    other = connect(machine, "admin")
    guid = guid_of(robot, "Deliver")
    robot.set_state(RobotState.PAUSE)
    first, second, third = robot.enqueue(guid), other.enqueue(guid), robot.enqueue(guid)
    assert [(item.id, item.created_by_name) for item in robot.open_items()] == [
        (first, "Distributor"),
        (second, "Administrator"),
        (third, "Distributor"),
    ]
    robot.cancel(second)
    assert robot.queue_item(second).state is QueueState.ABORTED
    assert robot.queue_item(second).message == "Aborted - User Request"
    assert [item.id for item in robot.open_items()] == [first, third]
    robot.clear_queue()
    assert robot.open_items() == []
    assert [item.state for item in robot.items_after(0)] == [QueueState.ABORTED] * 3
    other.close()


# ---------------------------------------------------------------------- faults
@pytest.mark.parametrize(
    ("kind", "expected", "lands"),
    [
        ("drop_request", ConnectionLost, False),
        ("drop_response", ConnectionLost, True),
        ("delay", TimedOut, True),
        ("late", TimedOut, True),
        ("hang", TimedOut, False),
        ("status_503", Busy, False),
        ("html", RobotError, True),
        ("truncate", RobotError, True),
        ("garbage", RobotError, True),
    ],
)
def test_after_a_fault_the_queue_says_whether_the_mission_landed(
    machine: FleetRobot, robot: RobotClient, kind: str, expected: type[RobotError], lands: bool
) -> None:
    guid = guid_of(robot, "Deliver")
    robot.set_state(RobotState.PAUSE)
    floor = robot.enqueue(guid, description="before")
    machine.control({"fault": {"kind": kind, "method": "POST", "path": "/mission_queue", "seconds": 1.5}})
    hasty = connect(machine, timeouts=QUICK if expected is TimedOut else USUAL)
    with pytest.raises(expected) as failed:
        hasty.enqueue(guid, description="token-1")
    hasty.close()
    assert failed.value.delivery is Delivery.UNKNOWN
    if lands:
        wait_for(lambda: [item.description for item in robot.items_after(floor)] == ["token-1"])
    else:
        assert robot.items_after(floor) == []
    assert robot.enqueue(guid, description="token-2") > floor
    assert [item.description for item in robot.items_after(floor)] == [*(["token-1"] if lands else []), "token-2"]


def test_a_robot_that_reboots_is_unreachable_and_comes_back(machine: FleetRobot, robot: RobotClient) -> None:
    number = robot.enqueue(guid_of(robot, "Deliver"))
    machine.control({"reboot_seconds": 1.0})

    def is_gone() -> bool:
        try:
            robot.status()
        except RobotError as error:
            return isinstance(error, Unreachable) and error.delivery is Delivery.NOT_SENT
        return False

    wait_for(is_gone)
    wait_for(lambda: not is_gone())
    assert robot.queue_item(number).id == number
