"""What tests of the client on real sockets have in common: how a server behaves, and a request that fails."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import RobotError
from app.mir.transport import Timeouts
from tests.integration.mir.servers import Conversation, Server
from tests.unit.mir.answers import MISSION, STATUS

QUICK = Timeouts(connect=5.0, read=0.2, total=0.4)
PATIENT = Timeouts(connect=5.0, read=20.0, total=60.0)  # where a test is about something else than time
TOKEN = Token.derive("distributor", "distributor")
ACCEPTED = b'{"id": 7, "state": "Pending"}'
READY = json.dumps(STATUS).encode()

Behaviour = Callable[[Conversation], None]
Serve = Callable[..., Server]
Connect = Callable[..., RobotClient]


def every_request(conversation: Conversation) -> None:
    while request := conversation.request():
        conversation.answer(
            ACCEPTED if request.startswith(b"POST") else READY,
            "201 Created" if request.startswith(b"POST") else "200 OK",
        )


def after_request(then: Callable[[Conversation], None]) -> Behaviour:
    def behave(conversation: Conversation) -> None:
        conversation.request()
        then(conversation)

    return behave


def enqueue_fails(client: RobotClient) -> RobotError:
    with pytest.raises(RobotError) as failed:
        client.enqueue(MISSION)
    assert TOKEN.header not in f"{failed.value!r}{failed.value}"
    return failed.value


def status_fails(client: RobotClient) -> RobotError:
    with pytest.raises(RobotError) as failed:
        client.status()
    return failed.value
