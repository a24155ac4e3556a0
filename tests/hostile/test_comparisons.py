"""For how long a compared serial number lets credentials go out, and over which connection."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest

from app.domain.robot import IdentifiedBy, RobotState
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import (
    AnotherRobot,
    ConnectionLost,
    Delivery,
    Rejected,
    SerialNumberHidden,
    Unreadable,
)
from tests.hostile.capture import Capture, Seen
from tests.hostile.credentials import TOKEN, Listen
from tests.support.errors import raises
from tests.unit.mir.answers import MISSION


# ---------------------------------------------------------------------- for how long a compared serial number lets credentials go out
@dataclass
class TimedClient:
    """A client on a clock that a test moves."""

    client: RobotClient
    now: float = 0.0


@contextmanager
def compared(machine: Capture) -> Iterator[TimedClient]:
    """The machine has just shown the known serial number to this client."""
    timed = TimedClient(
        RobotClient(
            Address.parse(machine.url),
            Token.from_header(TOKEN),
            serial_number="A-1",
            identified_by=IdentifiedBy.SERIAL_NUMBER,
            clock=lambda: timed.now,
        )
    )
    timed.client.status()
    yield timed
    timed.client.close()


@pytest.fixture
def timed(machine: Capture) -> Iterator[TimedClient]:
    with compared(machine) as timed:
        yield timed


def assert_refused(machine: Capture, timed: TimedClient) -> None:
    """It is asked for its serial number, and gets no credentials."""
    with pytest.raises(AnotherRobot):
        timed.client.missions()
    assert machine.credentials == []


def test_within_ten_seconds_of_the_comparison_a_request_needs_no_other(machine: Capture, timed: TimedClient) -> None:
    timed.now = 9.9
    timed.client.missions()
    assert [one.path for one in machine.seen] == ["/status", "/missions"]


def test_after_ten_seconds_the_serial_number_is_compared_again(machine: Capture, timed: TimedClient) -> None:
    timed.now, machine.serial = 10.1, "B-2"
    assert_refused(machine, timed)


@pytest.mark.parametrize(
    "pretends",
    [{"serial": "B-2"}, {"serial": None}, {"status_is_open": False}],
    ids=["another serial number", "no serial number", "no status without credentials"],
)
def test_a_comparison_that_fails_ends_the_one_before(
    machine: Capture, timed: TimedClient, pretends: dict[str, Any]
) -> None:
    machine.pretend(pretends)
    for ask in (timed.client.status, timed.client.missions, lambda: timed.client.enqueue(MISSION)):
        with pytest.raises((AnotherRobot, SerialNumberHidden)):
            ask()
    assert machine.credentials == []


def test_a_connection_that_breaks_ends_the_comparison(machine: Capture, timed: TimedClient) -> None:
    machine.breaks_at = "/mission_queue"
    with pytest.raises(ConnectionLost):
        timed.client.enqueue(MISSION)
    machine.serial = "B-2"
    machine.seen.clear()
    assert_refused(machine, timed)


EVERY_METHOD = {
    "GET": lambda client: client.missions(),
    "POST": lambda client: client.enqueue(MISSION),
    "PUT": lambda client: client.set_state(RobotState.READY),
    "DELETE": lambda client: client.cancel(7),
}
by_every_method = pytest.mark.parametrize("ask", EVERY_METHOD.values(), ids=EVERY_METHOD.keys())


@by_every_method
def test_a_robot_that_hung_up_is_compared_again_before_anything_else(
    machine: Capture, timed: TimedClient, ask: Any
) -> None:
    machine.hang_up()
    machine.serial = "B-2"
    for _ in range(2):
        with pytest.raises(AnotherRobot):
            ask(timed.client)
    assert machine.credentials == []


@by_every_method
def test_a_robot_that_closes_each_connection_is_trusted_for_two_seconds(listen: Listen, ask: Any) -> None:
    machine = listen(says_close=True)
    with compared(machine) as timed:
        timed.now = 1.9
        ask(timed.client)
        assert [one.path for one in machine.seen].count("/status") == 1 + (machine.seen[-1].method == "PUT")
        machine.seen.clear()
        timed.now, machine.serial = 2.1, "B-2"
        with pytest.raises(AnotherRobot):
            ask(timed.client)
        assert machine.credentials == []


def test_a_connection_that_was_opened_later_proves_nothing_after_two_seconds(
    machine: Capture,
    timed: TimedClient,
) -> None:
    with pytest.raises(Rejected):
        timed.client.mission("unknown")  # the client ends a connection after an answer of failure
    timed.client.missions()
    timed.now, machine.serial = 2.1, "B-2"
    machine.seen.clear()
    assert_refused(machine, timed)


def test_a_read_with_credentials_is_repeated_on_a_new_connection_after_a_comparison_only(
    machine: Capture,
    timed: TimedClient,
) -> None:
    machine.breaks_at = "/missions"
    with pytest.raises(ConnectionLost):
        timed.client.missions()
    assert [one.path for one in machine.seen] == ["/status", "/missions"] * 2
    machine.seen.clear()
    timed.client.status()
    machine.serial = "B-2"
    with pytest.raises(AnotherRobot):
        timed.client.missions()
    assert [one.path for one in machine.seen] == ["/status", "/missions", "/status"]


def test_a_robot_that_says_nothing_when_it_closes_can_still_be_read(machine: Capture, timed: TimedClient) -> None:
    answer = machine.answer

    def hang_up_in_between(one: Seen) -> tuple[int, Any]:
        machine.answer = answer  # type: ignore[method-assign]
        machine.hang_up()
        return answer(one)

    machine.answer = hang_up_in_between  # type: ignore[method-assign]
    with pytest.raises(Unreadable):
        timed.client.mission("of another shape")
    assert [one.path for one in machine.seen] == ["/status", "/missions/of%20another%20shape"] * 2


def test_a_machine_that_was_commanded_is_compared_as_well(machine: Capture, timed: TimedClient) -> None:
    machine.serial = "B-2"
    with raises(AnotherRobot, "that machine got the command", delivery=Delivery.UNKNOWN):
        timed.client.set_state(RobotState.READY)
    with raises(AnotherRobot, "nothing was sent", delivery=Delivery.NOT_SENT):
        timed.client.set_state(RobotState.READY)
    assert [one.method for one in machine.seen if one.authorization] == ["PUT"]


def test_another_known_serial_number_ends_the_comparison(machine: Capture, timed: TimedClient) -> None:
    timed.client.serial_number = "B-2"
    assert_refused(machine, timed)
