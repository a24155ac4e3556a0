"""A robot's name may mean another machine from one look-up to the next (a second address, another answer of the name server): what
was compared at one place proves nothing about the other."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import urlparse

import pytest

from app.domain.robot import IdentifiedBy
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import AnotherRobot
from tests.hostile.capture import Capture
from tests.hostile.credentials import TOKEN, Listen
from tests.hostile.test_comparisons import by_every_method

ROBOT, OTHER = "A-1", "B-2"
Name = Callable[..., None]


@pytest.fixture
def name(monkeypatch: pytest.MonkeyPatch) -> Name:
    """``name(machine, …)``: what robot.test means from now on."""
    means: list[Any] = []
    asked = socket.getaddrinfo

    def look_up(host: str, *args: Any, **kwargs: Any) -> Any:
        return list(means) if host == "robot.test" else asked(host, *args, **kwargs)

    monkeypatch.setattr(socket, "getaddrinfo", look_up)

    def mean(*machines: Capture) -> None:
        places = [("127.0.0.1", urlparse(machine.url).port) for machine in machines]
        means[:] = [(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP, "", place) for place in places]

    return mean


@pytest.fixture
def client(name: Name) -> Iterator[RobotClient]:
    made = RobotClient(
        Address.parse("http://robot.test"),
        Token.from_header(TOKEN),
        serial_number=ROBOT,
        identified_by=IdentifiedBy.SERIAL_NUMBER,
    )
    yield made
    made.close()


@by_every_method
@pytest.mark.parametrize("says_close", [False, True], ids=["keeps its connection", "ends its connections"])
def test_credentials_go_where_the_serial_number_was_shown(
    client: RobotClient, listen: Listen, name: Name, ask: Any, says_close: bool
) -> None:
    robot, other = listen(says_close=says_close), listen(serial=OTHER)
    name(robot)
    client.status()
    name(other)
    ask(client)
    assert other.seen == []
    assert robot.credentials


@by_every_method
def test_a_name_that_leads_elsewhere_is_compared_there_first(
    client: RobotClient, listen: Listen, name: Name, ask: Any
) -> None:
    robot, other = listen(), listen(serial=OTHER)
    name(robot)
    client.status()
    name(other)
    robot.hang_up()
    with pytest.raises(AnotherRobot):
        ask(client)
    assert other.credentials == []


def test_a_robot_that_wants_credentials_for_its_status_gets_them_where_it_was_asked(listen: Listen, name: Name) -> None:
    robot, other = listen(status_is_open=False, says_close=True), listen()
    answer = robot.answer

    def move(one: Any) -> tuple[int, Any]:
        name(other)
        return answer(one)

    robot.answer = move  # type: ignore[method-assign]
    name(robot)
    client = RobotClient(Address.parse("http://robot.test"), Token.from_header(TOKEN))
    client.status()
    client.close()
    assert (len(robot.credentials), other.seen) == (1, [])


def test_a_robot_that_has_moved_is_found_again(client: RobotClient, listen: Listen, name: Name) -> None:
    before, after = listen(), listen()
    name(before)
    client.status()
    name(after)
    before.hang_up()
    client.cancel(7)
    assert [(one.path, one.authorization is not None) for one in after.seen] == [
        ("/status", False),
        ("/mission_queue/7", True),
    ]
