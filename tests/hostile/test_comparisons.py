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
from tests.unit.mir.answers import MISSION


# ---------------------------------------------------------------------- for how long a compared serial number lets credentials go out
@dataclass
class TimedClient:
    """A client on a clock that a test moves."""

    client: RobotClient
    now: float = 0.0


@contextmanager
def compared(machine: Capture) -> Iterator[tuple[Capture, TimedClient]]:
    """A machine that has just shown the known serial number to this client."""
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
    yield machine, timed
    timed.client.close()


Known = tuple[Capture, TimedClient]


@pytest.fixture
def known(listen: Listen) -> Iterator[Known]:
    with compared(listen()) as found:
        yield found


def assert_refused(known: Known) -> None:
    """It is asked for its serial number, and gets no credentials."""
    machine, timed = known
    with pytest.raises(AnotherRobot):
        timed.client.missions()
    assert machine.credentials == []


def test_within_ten_seconds_of_the_comparison_a_request_needs_no_other(known: Known) -> None:
    machine, timed = known
    timed.now = 9.9
    timed.client.missions()
    assert [one.path for one in machine.seen] == ["/status", "/missions"]


def test_after_ten_seconds_the_serial_number_is_compared_again(known: Known) -> None:
    machine, timed = known
    timed.now, machine.serial = 10.1, "B-2"
    assert_refused(known)


@pytest.mark.parametrize(
    "pretends",
    [{"serial": "B-2"}, {"serial": None}, {"status_is_open": False}],
    ids=["another serial number", "no serial number", "no status without credentials"],
)
def test_a_comparison_that_fails_ends_the_one_before(known: Known, pretends: dict[str, Any]) -> None:
    machine, timed = known
    machine.pretend(pretends)
    for ask in (timed.client.status, timed.client.missions, lambda: timed.client.enqueue(MISSION)):
        with pytest.raises((AnotherRobot, SerialNumberHidden)):
            ask()
    assert machine.credentials == []


def test_a_connection_that_breaks_ends_the_comparison(known: Known) -> None:
    machine, timed = known
    machine.breaks_at = "/mission_queue"
    with pytest.raises(ConnectionLost):
        timed.client.enqueue(MISSION)
    machine.serial = "B-2"
    machine.seen.clear()
    assert_refused(known)


EVERY_METHOD = {
    "GET": lambda client: client.missions(),
    "POST": lambda client: client.enqueue(MISSION),
    "PUT": lambda client: client.set_state(RobotState.READY),
    "DELETE": lambda client: client.cancel(7),
}
by_every_method = pytest.mark.parametrize("ask", EVERY_METHOD.values(), ids=EVERY_METHOD.keys())


@by_every_method
def test_a_robot_that_hung_up_is_compared_again_before_anything_else(known: Known, ask: Any) -> None:
    machine, timed = known
    machine.hang_up()
    machine.serial = "B-2"
    for _ in range(2):
        with pytest.raises(AnotherRobot):
            ask(timed.client)
    assert machine.credentials == []


@by_every_method
def test_a_robot_that_closes_each_connection_is_trusted_for_two_seconds(listen: Listen, ask: Any) -> None:
    with compared(listen(says_close=True)) as (machine, timed):
        timed.now = 1.9
        ask(timed.client)
        assert [one.path for one in machine.seen].count("/status") == 1 + (machine.seen[-1].method == "PUT")
        machine.seen.clear()
        timed.now, machine.serial = 2.1, "B-2"
        with pytest.raises(AnotherRobot):
            ask(timed.client)
        assert machine.credentials == []


def test_a_connection_that_was_opened_later_proves_nothing_after_two_seconds(
    known: Known,
) -> None:
    machine, timed = known
    with pytest.raises(Rejected):
        timed.client.mission("unknown")  # the client ends a connection after an answer of failure
    timed.client.missions()
    timed.now, machine.serial = 2.1, "B-2"
    machine.seen.clear()
    assert_refused(known)


def test_a_read_with_credentials_is_repeated_on_a_new_connection_after_a_comparison_only(
    known: Known,
) -> None:
    machine, timed = known
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


def test_a_robot_that_says_nothing_when_it_closes_can_still_be_read(known: Known) -> None:
    machine, timed = known
    answer = machine.answer

    def hang_up_in_between(one: Seen) -> tuple[int, Any]:
        machine.answer = answer  # type: ignore[method-assign]
        machine.hang_up()
        return answer(one)

    machine.answer = hang_up_in_between  # type: ignore[method-assign]
    with pytest.raises(Unreadable):
        timed.client.mission("of another shape")
    assert [one.path for one in machine.seen] == ["/status", "/missions/of%20another%20shape"] * 2


def test_a_machine_that_was_commanded_is_compared_as_well(known: Known) -> None:
    machine, timed = known
    machine.serial = "B-2"
    with pytest.raises(AnotherRobot, match="that machine got the command") as error:
        timed.client.set_state(RobotState.READY)
    assert error.value.delivery is Delivery.UNKNOWN
    with pytest.raises(AnotherRobot, match="nothing was sent") as error:
        timed.client.set_state(RobotState.READY)
    assert error.value.delivery is Delivery.NOT_SENT
    assert [one.method for one in machine.seen if one.authorization] == ["PUT"]


def test_another_known_serial_number_ends_the_comparison(known: Known) -> None:
    known[1].client.serial_number = "B-2"
    assert_refused(known)
