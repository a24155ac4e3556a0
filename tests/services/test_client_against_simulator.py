"""The robot client over real HTTP against the simulated robot: the two speak of the same API, also when the network doesn't behave."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from app.domain.robot import QueueState, RobotState
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import Busy, ConnectionLost, Delivery, RobotError, TimedOut, Unauthorized, Unreachable
from app.mir.transport import Timeouts
from mir_sim import FleetRobot, serve
from mir_sim.definition import SOFTWARE
from tests.support.errors import raises
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
@pytest.mark.parametrize(("user", "password"), [("distributor", "wrong"), ("nobody", "distributor")])
def test_a_wrong_password_shows_though_status_answers(machine: FleetRobot, user: str, password: str) -> None:
    robot = connect(machine, user, password)
    assert robot.status().robot_name == machine.name
    for call in (robot.identify, robot.missions, lambda: robot.enqueue("x")):
        with raises(Unauthorized, delivery=Delivery.REFUSED):
            call()
    robot.close()


# ---------------------------------------------------------------------- the queue
def test_a_mission_from_the_queue_to_its_end(robot: RobotClient) -> None:
    assert (robot.highest_queue_id(), robot.open_items(), robot.items_after(0)) == (None, [], [])
    robot.set_state(RobotState.PAUSE)
    number = robot.enqueue(guid_of(robot, "Home"), description="token-1", text="Evening", priority=2)
    (item,) = robot.items_after(0)
    assert (item.id, item.state, item.description, item.priority) == (number, QueueState.PENDING, "token-1", 2)
    assert (item.started, item.finished, item.created_by_name) == (None, None, "Distributor")
    assert [found.id for found in robot.open_items()] == [number] == [robot.highest_queue_id()]
    assert robot.items_after(number) == []
    robot.set_state(RobotState.READY)
    wait_for(lambda: robot.queue_item(number).state is QueueState.DONE)
    done = robot.queue_item(number)
    assert done.ordered <= done.started <= done.finished
    assert (done.description, robot.open_items()) == ("token-1", [])


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
