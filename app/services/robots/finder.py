"""Looks for robots on the tablet's own networks: MiR robots tell their status without a password (docs/interfaces.md).

Only asked for by a person, only private addresses beside the tablet's own (/24), and never with credentials.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from http import HTTPStatus
from ipaddress import IPv4Address, IPv4Network, collapse_addresses

from app.domain.robot import RobotStatus
from app.mir import parse
from app.mir.address import Address
from app.mir.credentials import Token
from app.mir.errors import RobotError
from app.mir.http import HttpTransport
from app.mir.transport import Timeouts

AT_ONCE = 32  # addresses that are asked at the same time
TIMEOUTS = Timeouts(connect=1.5, read=1.5, total=3.0)
# one in each private network: connecting a datagram socket sends nothing, but shows which address of ours would be used
PRIVATE = (IPv4Network("10.0.0.0/8"), IPv4Network("172.16.0.0/12"), IPv4Network("192.168.0.0/16"))


def addresses() -> list[str]:
    """All that may be asked: those beside the tablet's own, without these."""
    own = {own for network in PRIVATE if (own := _own_towards(str(network[1]))) is not None}
    networks = [
        IPv4Network(f"{address}/24", strict=False) for address in own if any(address in network for network in PRIVATE)
    ]
    return [str(host) for network in collapse_addresses(networks) for host in network.hosts() if host not in own]


def _own_towards(target: str) -> IPv4Address | None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((target, 9))
        except OSError:
            return None
        return IPv4Address(probe.getsockname()[0])


def find(
    asked: Iterable[str], on_answer: Callable[[str, RobotStatus | None], object], goes_on: Callable[[], bool]
) -> None:
    """Ask these addresses (host, or host:port); ``on_answer(address, status)`` is called for each, on other threads, with None where no
    robot answers. Ends within some seconds after ``goes_on()`` is False."""

    def ask(address: str) -> None:
        if goes_on():
            on_answer(address, status_of(address))

    with ThreadPoolExecutor(AT_ONCE, "find-robots") as pool:
        for _none in pool.map(ask, asked):
            pass


def status_of(address: str) -> RobotStatus | None:
    """What a robot there says of itself to all; None: no robot, or one that wants a password."""
    with closing(HttpTransport(Address.parse(address), Token())) as robot:
        try:
            answer = robot.send("GET", "/status", timeout=TIMEOUTS, with_credentials=False)
            status = parse.status(parse.loads(answer.body)) if answer.status == HTTPStatus.OK else None
        except RobotError:
            return None
    return status if status is not None and (status.robot_model or status.robot_name) else None
