"""Servers and clients that end with their test."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.transport import Timeouts
from tests.integration.mir.servers import Server, tls_of
from tests.integration.mir.talking import (
    PATIENT,
    TOKEN,
    Behaviour,
    Connect,
    Serve,
    every_request,
)


@pytest.fixture
def closing() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def serve(closing: ExitStack) -> Serve:
    def start(behave: Behaviour = every_request, certificate: str = "") -> Server:
        server = Server(behave, tls_of(certificate) if certificate else None)
        closing.callback(server.close)
        return server

    return start


@pytest.fixture
def connect(closing: ExitStack) -> Connect:
    def make(
        server: Server | int,
        timeouts: Timeouts = PATIENT,
        *,
        host: str = "127.0.0.1",
        scheme: str = "http",
        pin: str | None = None,
    ) -> RobotClient:
        port = server if isinstance(server, int) else server.port
        client = RobotClient(Address.parse(f"{scheme}://{host}:{port}"), TOKEN, certificate_sha256=pin)
        client.timeouts = timeouts
        closing.callback(client.close)
        return client

    return make
