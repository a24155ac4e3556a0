"""Connections that are kept open between requests, and have broken or received more data since."""

from __future__ import annotations

import pytest

from app.mir.errors import ConnectionLost, TimedOut
from tests.integration.mir.servers import Conversation
from tests.integration.mir.talking import (
    ACCEPTED,
    QUICK,
    READY,
    Connect,
    Serve,
    status_fails,
)
from tests.unit.mir.answers import MISSION


def dies_on_its_second_request(conversation: Conversation) -> None:
    conversation.request()
    conversation.answer(READY)
    conversation.request()


def test_a_read_on_a_dead_connection_is_silently_repeated_once(serve: Serve, connect: Connect) -> None:
    server = serve(dies_on_its_second_request)
    robot = connect(server)
    for _ in range(4):
        assert robot.status().robot_name == "R1"
    assert server.connections == 4
    assert len(server.requests) == 1 + 2 * 3


def test_a_read_is_repeated_only_once(serve: Serve, connect: Connect) -> None:
    def never_answers_again(conversation: Conversation) -> None:
        if server.connections == 1:
            dies_on_its_second_request(conversation)
        else:
            conversation.request()

    server = serve(never_answers_again)
    robot = connect(server)
    robot.status()
    assert type(status_fails(robot)) is ConnectionLost
    assert (server.connections, len(server.requests)) == (2, 3)


def test_a_write_after_a_read_does_not_meet_the_dead_connection(serve: Serve, connect: Connect) -> None:
    def closes_after_each_answer(conversation: Conversation) -> None:
        if request := conversation.request():
            conversation.answer(ACCEPTED if request.startswith(b"POST") else READY, "201 Created")

    server = serve(closes_after_each_answer)
    robot = connect(server)
    for number in range(1, 30):
        robot.status()
        assert robot.enqueue(MISSION) == 7
        assert server.connections == 2 * number


@pytest.mark.parametrize("first", [b"HTTP/1.1 103 Early Hints\r\n\r\n", b"HTTP/1.1 204 No Content\r\n\r\n"])
def test_a_belated_second_answer_is_not_that_of_the_next_request(serve: Serve, connect: Connect, first: bytes) -> None:
    def answers_twice(conversation: Conversation) -> None:
        conversation.request()
        conversation.send(first)
        conversation.request()  # the second answer arrives when the next request has left, if that comes here
        conversation.answer(READY)

    server = serve(answers_twice)
    robot = connect(server)
    status_fails(robot)
    status_fails(robot)
    assert server.connections == 2


def test_a_time_out_on_a_kept_alive_connection_is_not_a_reason_to_ask_again(serve: Serve, connect: Connect) -> None:
    def hangs_on_its_second_request(conversation: Conversation) -> None:
        conversation.request()
        conversation.answer(READY)
        conversation.request()
        conversation.hang()

    server = serve(hangs_on_its_second_request)
    robot = connect(server, QUICK)
    robot.status()
    assert type(status_fails(robot)) is TimedOut
    assert len(server.requests) == 2


def test_a_closed_client_opens_a_new_connection_when_asked(serve: Serve, connect: Connect) -> None:
    server = serve()
    robot = connect(server)
    robot.status()
    robot.close()
    robot.status()
    assert server.connections == 2
