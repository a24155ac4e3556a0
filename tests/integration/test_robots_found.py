"""Robots found on the tablet's own network: simulated ones on loopback, beside something else and nothing."""

from __future__ import annotations

import socket
import threading
import time
from contextlib import suppress
from ipaddress import IPv4Address

import pytest

from app.domain.robot import RobotStatus
from app.mir.transport import Timeouts
from app.services.robots import finder
from tests.hostile.capture import capture


def found(*asked: str, goes_on=lambda: True) -> dict[str, RobotStatus | None]:
    answers: dict[str, RobotStatus | None] = {}
    finder.find(asked, answers.__setitem__, goes_on)
    return answers


@pytest.fixture
def nothing():
    """Bound, not listening: refused."""
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        yield f"127.0.0.1:{closed.getsockname()[1]}"


def test_robots_say_who_they_are_and_nothing_else_is_one(nothing):
    with (
        capture(status={"robot_name": "Aino", "robot_model": "MiR250"}) as robot,
        capture(status_is_open=False) as shut,
    ):
        here, closed = (machine.url.removeprefix("http://") for machine in (robot, shut))
        answers = found(here, closed, nothing)
        assert (answers[here].robot_name, answers[here].robot_model) == ("Aino", "MiR250")
        assert (answers[closed], answers[nothing]) == (None, None)
        assert robot.credentials == shut.credentials == []  # no password goes anywhere


def test_it_ends_when_it_is_not_wanted_any_more(nothing):
    ends = threading.Event()
    asked = [nothing] * 200
    answers = []

    def on_answer(address: str, _status: RobotStatus | None) -> None:
        answers.append(address)
        ends.set()

    finder.find(asked, on_answer, lambda: not ends.is_set())
    assert 1 <= len(answers) <= finder.AT_ONCE


@pytest.mark.parametrize(
    ("own", "first", "count"),
    [
        ("192.168.12.7", "192.168.12.1", 253),
        ("10.3.4.1", "10.3.4.2", 253),
        ("127.0.0.1", None, 0),
        ("8.8.4.4", None, 0),
        (None, None, 0),
    ],
)
def test_only_addresses_beside_a_private_one_of_the_tablet_are_asked(monkeypatch, own, first, count):
    monkeypatch.setattr(finder, "_own_towards", lambda _target: own and IPv4Address(own))
    asked = finder.addresses()
    assert (asked[:1], len(asked)) == ([first] if first else [], count)
    assert own not in asked


@pytest.mark.parametrize(
    ("begin", "goes_on"),
    [
        (b"HTTP/1.1 200 OK\r\nContent-Length: 60000\r\n\r\n", b" "),
        (b"HTTP/1.1 200 OK\r\nX: ", b"a"),
        (b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n", b"1\r\n \r\n"),
        (b"", b"HTTP/1.1 100 Continue\r\n\r\n"),
    ],
    ids=["body", "header", "chunks", "interim answers"],
)
def test_an_answer_that_never_ends_is_no_robot(monkeypatch, begin, goes_on):
    monkeypatch.setattr(finder, "TIMEOUTS", Timeouts(connect=0.5, read=0.5, total=0.5))
    with socket.create_server(("127.0.0.1", 0)) as server:

        def drip() -> None:
            connection, _address = server.accept()
            with connection, suppress(OSError):
                connection.sendall(begin)
                while True:
                    connection.sendall(goes_on)
                    time.sleep(0.05)

        dripping = threading.Thread(target=drip, daemon=True)
        dripping.start()
        address = f"127.0.0.1:{server.getsockname()[1]}"
        asked_at = time.monotonic()
        assert found(address) == {address: None}
        assert time.monotonic() - asked_at < 20.0
        dripping.join(30)
        assert not dripping.is_alive()
