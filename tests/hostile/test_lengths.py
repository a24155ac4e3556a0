"""A length that is not a number of bytes: the rest would be read until the robot hangs up, or be taken for another
answer."""

from __future__ import annotations

import pytest

from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import Unreadable
from tests.integration.mir.servers import Conversation, Server

BODY = b'{"state_id": 3, "serial_number": "A-1"}'


def ask(*headers: str) -> None:
    def behave(conversation: Conversation) -> None:
        conversation.request()
        conversation.send(
            b"HTTP/1.1 200 OK\r\n" + "".join(f"{header}\r\n" for header in headers).encode() + b"\r\n" + BODY
        )

    server = Server(behave)
    client = RobotClient(Address.parse(f"127.0.0.1:{server.port}"), Token())
    try:
        client.status()
    finally:
        client.close()
        server.close()


@pytest.mark.parametrize(
    "length", ["-5", "-0", "+39", "3_9", "39, 39", "", "0x27", "39.0", "9" * 5000], ids=lambda length: length[:6]
)
def test_an_answer_with_such_a_length_is_not_read(length):
    with pytest.raises(Unreadable, match="follow HTTP"):
        ask(f"Content-Length: {length}")


def test_nor_one_with_two():
    with pytest.raises(Unreadable, match="follow HTTP"):
        ask(f"Content-Length: {len(BODY)}", "Content-Length: 3")


@pytest.mark.parametrize("headers", [[], [f"Content-Length: {len(BODY)}"], [f"content-length:  {len(BODY)} "]])
def test_any_other_is(headers):
    ask(*headers)
