"""What no mock can show: the client on real sockets, against servers that drip, hang, bomb, reset and redirect.

No test measures time. If a server would continue for ever, the end of the test is the proof.
"""

from __future__ import annotations

import gzip
import itertools
import json
import socket
import threading
import tracemalloc
import zlib
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from app.mir.errors import ConnectionLost, Delivery, NotAMir, TimedOut, Unnumbered, Unreachable, Unreadable
from app.mir.transport import Timeouts
from tests.integration.mir.servers import HEAD, Conversation, closed_port
from tests.integration.mir.talking import (
    ACCEPTED,
    QUICK,
    READY,
    TOKEN,
    Connect,
    Serve,
    after_request,
    enqueue_fails,
    status_fails,
)
from tests.unit.mir.answers import MISSION


# ---------------------------------------------------------------------- a well-behaved robot
def test_reads_share_a_connection_and_writes_get_their_own(serve: Serve, connect: Connect) -> None:
    server = serve()
    robot = connect(server)
    robot.status()
    robot.status()
    assert server.connections == 1
    assert robot.enqueue(MISSION) == 7
    assert server.connections == 2
    robot.clear_error()
    robot.status()
    robot.status()
    assert server.connections == 3
    lines = [request.split(b"\r\n")[0] for request in server.requests]
    assert lines[2] == b"POST /api/v2.0.0/mission_queue HTTP/1.1"
    assert b"\r\nConnection: close\r\n" in server.requests[2]
    sent = [b"\r\nAuthorization: " + TOKEN.header.encode() + b"\r\n" in request for request in server.requests]
    assert sent == [False, False, True, True, False, False]  # the status is asked for without


def test_a_mission_leaves_in_one_piece(serve: Serve, connect: Connect, monkeypatch: pytest.MonkeyPatch) -> None:
    pieces: list[bytes] = []
    sendall = socket.socket.sendall
    monkeypatch.setattr(socket.socket, "sendall", lambda sock, data: (pieces.append(data), sendall(sock, data))[1])
    server = serve()
    assert connect(server).enqueue(MISSION) == 7
    assert [piece for piece in pieces if not piece.startswith(b"HTTP/")] == server.requests


def test_every_request_says_who_asks_and_what_it_wants(
    serve: Serve, connect: Connect, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "netrc").write_text("machine 127.0.0.1 login other password other")  # neither this nor a proxy is used
    monkeypatch.setenv("NETRC", str(tmp_path / "netrc"))
    monkeypatch.setenv("HTTP_PROXY", f"http://127.0.0.1:{closed_port()}")
    server = serve(
        after_request(lambda robot: robot.answer(READY, "200 OK", "Set-Cookie: session=1", "Connection: close"))
    )
    robot = connect(server)
    robot.status()
    for _ in range(2):
        with pytest.raises(Unreadable):
            robot.missions()
    for request, path, credentials in zip(
        server.requests, ("status", "missions", "missions"), (False, True, True), strict=True
    ):
        head = request.decode().split("\r\n")
        assert head[0] == f"GET /api/v2.0.0/{path} HTTP/1.1"
        assert head[1 : head.index("")] == [
            f"Host: 127.0.0.1:{server.port}",
            "Accept: application/json",
            "Accept-Encoding: identity",
            "Accept-Language: en_US",
            "Content-Type: application/json",
            "User-Agent: AMR-Scheduler",
            *[f"Authorization: {TOKEN.header}"] * credentials,
            "Connection: keep-alive",
        ]


def test_a_search_is_sorted_as_clients_on_robots_ask_for_it(serve: Serve, connect: Connect) -> None:
    server = serve(after_request(lambda robot: robot.answer(b"[]")))
    connect(server).open_items()
    assert b"sort_by=id,desc" in server.requests[0].split(b"\r\n")[0]  # the comma as it is


def test_an_unrequested_compressed_answer_is_refused(serve: Serve, connect: Connect) -> None:
    server = serve(after_request(lambda robot: robot.answer(gzip.compress(READY), "200 OK", "Content-Encoding: gzip")))
    error = status_fails(connect(server))
    assert (type(error), error.text) == (
        Unreadable,
        f"127.0.0.1:{server.port} gave an answer that can't be read: it is compressed",
    )


@pytest.mark.parametrize("encoding", ["gzip", "deflate", "gzip, gzip"])
def test_nothing_is_unpacked(serve: Serve, connect: Connect, encoding: str) -> None:
    """Millions of packed nothings take urllib3 minutes, as it copies what is left for each."""
    one = zlib.compress(b"") if encoding == "deflate" else gzip.compress(b"", mtime=0)
    server = serve(
        after_request(
            lambda robot: robot.answer(one * (4_000_000 // len(one)), "200 OK", f"Content-Encoding: {encoding}")
        )
    )
    assert type(status_fails(connect(server))) is Unreadable


def test_a_broken_header_breaks_nothing(serve: Serve, connect: Connect) -> None:
    server = serve(
        after_request(lambda robot: robot.answer(READY, "200 OK", "no header", "Content-Type: multipart/mixed"))
    )
    assert connect(server).status().robot_name == "R1"


def test_ipv6_and_names_work_too(connect: Connect, serve: Serve) -> None:
    assert connect(serve(), host="localhost").status().robot_name == "R1"


# ---------------------------------------------------------------------- never sent
def test_a_refused_connection_sent_nothing(connect: Connect) -> None:
    error = enqueue_fails(connect(closed_port()))
    assert type(error) is Unreachable
    assert (error.code, error.delivery) == ("refused", Delivery.NOT_SENT)


LOOK_UP = socket.getaddrinfo


def test_an_unknown_name_sent_nothing(connect: Connect, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_addresses(host: str, port: int, **options: Any) -> list[Any]:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", no_addresses)
    error = enqueue_fails(connect(80, host="no-such-robot"))
    assert (error.code, error.delivery, error.params["host"]) == ("unknown_name", Delivery.NOT_SENT, "no-such-robot")


def test_a_name_that_takes_for_ever_sent_nothing_and_leaves_one_thread(
    serve: Serve, connect: Connect, monkeypatch: pytest.MonkeyPatch
) -> None:
    server, answered, asked = serve(), threading.Event(), []

    def slow(host: str, port: int, **options: Any) -> list[Any]:
        asked.append(host)
        assert answered.wait(30)
        return LOOK_UP("127.0.0.1", port, **options)

    monkeypatch.setattr(socket, "getaddrinfo", slow)
    for robot in (connect(server, QUICK, host="slow-robot"), connect(server, QUICK, host="slow-robot")):
        for _ in range(2):
            error = enqueue_fails(robot)
            assert (error.code, error.delivery) == ("slow_name", Delivery.NOT_SENT)
    assert asked == ["slow-robot"]
    answered.set()
    assert connect(server, host="slow-robot").status().robot_name == "R1"
    assert len(asked) <= 2  # whether the first look-up was over when it was needed again, is open


def test_every_address_of_a_name_is_tried(serve: Serve, connect: Connect, monkeypatch: pytest.MonkeyPatch) -> None:
    server, deaf = serve(), closed_port()
    monkeypatch.setattr(
        socket,
        "getaddrinfo",
        lambda host, port, **options: [*LOOK_UP("127.0.0.1", deaf, **options), *LOOK_UP("127.0.0.1", port, **options)],
    )
    assert connect(server, host="robot").status().robot_name == "R1"


def test_a_connection_that_is_not_accepted_sent_nothing(connect: Connect, closing: ExitStack) -> None:
    listener = closing.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
    port = listener.getsockname()[1]
    for _ in range(8):  # fill the queue of connections that the kernel accepts by itself
        filler = closing.enter_context(socket.socket())
        filler.setblocking(False)
        filler.connect_ex(("127.0.0.1", port))
    error = enqueue_fails(connect(port, Timeouts(connect=0.3, read=0.3, total=1.0)))
    assert (type(error), error.code, error.delivery) == (Unreachable, "no_answer", Delivery.NOT_SENT)


# ---------------------------------------------------------------------- outcome unknown
def flood(conversation: Conversation, head: bytes, data: bytes) -> None:
    conversation.send(head)
    for part in itertools.repeat(data):
        conversation.send(part)


def drip_fast(conversation: Conversation) -> None:
    """Byte after byte without a pause, but not so many that a quick machine finds the answer too long before it finds it too slow."""
    conversation.send(HEAD + b"\r\n")
    for _n in range(20_000):
        conversation.send(b" ")
    conversation.hang()


SLOW: dict[str, Callable[[Conversation], None]] = {
    "hang": lambda robot: robot.hang(),
    "drip the status line": lambda robot: robot.drip(b"HTTP/1.1 200 " + b"O" * 60_000),
    "drip headers": lambda robot: robot.drip(HEAD + b"X: " + b"x" * 60_000),
    "drip the body": lambda robot: robot.drip(HEAD + b"Content-Length: 100000\r\n\r\n" + b" " * 100_000),
    "drip without a pause": drip_fast,
    "drip a body without length": lambda robot: robot.drip(HEAD + b"\r\n" + b" " * 100_000),
    "drip a chunk's size": lambda robot: robot.drip(HEAD + b"Transfer-Encoding: chunked\r\n\r\n" + b"0" * 100_000),
    "drip interim answers": lambda robot: robot.drip(b"HTTP/1.1 100 Continue\r\n\r\n" * 5_000),
    "stop in the body": lambda robot: robot.send(HEAD + b"Content-Length: 100\r\n\r\n{", then=robot.hang),
}


@pytest.mark.parametrize("behaviour", SLOW)
def test_whatever_is_slow_ends_by_the_deadline(serve: Serve, connect: Connect, behaviour: str) -> None:
    server = serve(after_request(SLOW[behaviour]))
    error = enqueue_fails(connect(server, QUICK))
    assert (type(error), error.delivery) == (TimedOut, Delivery.UNKNOWN)
    assert len(server.requests) == server.connections == 1


def test_time_outs_say_how_long_they_waited(serve: Serve, connect: Connect) -> None:
    server = serve(after_request(lambda robot: robot.hang()))
    silent = status_fails(connect(server, Timeouts(connect=5.0, read=0.1, total=60.0)))
    assert silent.text == f"127.0.0.1:{server.port} didn't answer within 0.1 s"
    slow = status_fails(connect(server, Timeouts(connect=5.0, read=60.0, total=0.1)))
    assert slow.text == f"the answer of 127.0.0.1:{server.port} wasn't complete after 0.1 s"


BREAKS: dict[str, Callable[[Conversation], None]] = {
    "close": lambda robot: None,
    "reset": lambda robot: robot.reset(),
    "close in the headers": lambda robot: robot.send(HEAD),
    "close in the body": lambda robot: robot.send(HEAD + b'Content-Length: 100\r\n\r\n{"id": 7}'),
    "close in a chunk": lambda robot: robot.send(HEAD + b"Transfer-Encoding: chunked\r\n\r\n40\r\n{"),
    "reset in the body": lambda robot: robot.send(HEAD + b"Content-Length: 100\r\n\r\n{", then=robot.reset),
}


@pytest.mark.parametrize("behaviour", BREAKS)
def test_a_broken_connection_leaves_the_outcome_unknown_and_is_not_repeated(
    serve: Serve, connect: Connect, behaviour: str
) -> None:
    server = serve(after_request(BREAKS[behaviour]))
    robot = connect(server)
    error = enqueue_fails(robot)
    assert type(error) in (ConnectionLost, Unreadable)
    assert error.delivery is Delivery.UNKNOWN
    assert len(server.requests) == server.connections == 1
    status_fails(robot)
    assert len(server.requests) == 2  # not on a kept-alive connection, so not repeated either


def test_a_reset_before_the_request_is_read_is_not_repeated(serve: Serve, connect: Connect) -> None:
    server = serve(lambda robot: robot.reset())
    for _ in range(20):
        before = server.connections
        error = enqueue_fails(connect(server))
        assert type(error) in (ConnectionLost, Unreachable)  # the reset may be faster than the request
        assert (type(error) is Unreachable) == (error.delivery is Delivery.NOT_SENT)
        assert server.connections == before + 1


CREATED = HEAD.replace(b"200 OK", b"201 Created")
NONSENSE: dict[str, bytes] = {
    "noise": bytes(range(256)) * 4,
    "another protocol": b"SSH-2.0-OpenSSH_9.6\r\n",
    "two lengths": CREATED + b"Content-Length: 29\r\nContent-Length: 3\r\n\r\n" + ACCEPTED,
    "bad chunk size": CREATED + b"Transfer-Encoding: chunked\r\n\r\nxyz\r\n" + ACCEPTED + b"\r\n0\r\n\r\n",
    "an endless chunk size": CREATED + b"Transfer-Encoding: chunked\r\n\r\n" + b"0" * 200_000,
    "too many headers": CREATED + b"".join(b"X%d: 1\r\n" % n for n in range(500)) + b"\r\n" + ACCEPTED,
    "an endless header": CREATED + b"X: " + b"x" * 70_000 + b"\r\n\r\n" + ACCEPTED,
    "not gzip": CREATED + b"Content-Encoding: gzip\r\nContent-Length: 4\r\n\r\nnope",
    "switching protocols": b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: x\r\n\r\n",
    "a web page": b"HTTP/1.1 200 OK\r\nContent-Length: 13\r\n\r\n<html></html>",
    "half an answer": b'HTTP/1.1 201 Created\r\n\r\n{"id": 7',
    "parameters that contradict each other": HEAD.replace(
        b"application/json", b"multipart/mixed; boundary*=a; boundary*0=b"
    )
    + b"\r\n{}",
    "a parameter that takes hours": HEAD.replace(
        b"application/json", b'multipart/mixed; a="' + b"\r\n ".join([b";" * 60_000] * 90)
    )
    + b"\r\n\r\n{}",
    "a long head": CREATED + b"".join(b"X%d: %b\r\n" % (n, b"x" * 1000) for n in range(30)) + b"\r\n" + ACCEPTED,
}


NO_LENGTHS = (b"-5", b"-0", b"+29", b"2_9", b"29, 29", b"", b"0x1d", b"29.0", b"9" * 5000)
NONSENSE |= {
    f"length {length[:6]!r}": CREATED + b"Content-Length: %b\r\n\r\n" % length + ACCEPTED for length in NO_LENGTHS
}


@pytest.mark.parametrize("behaviour", NONSENSE)
def test_nonsense_is_never_taken_for_an_answer(serve: Serve, connect: Connect, behaviour: str) -> None:
    server = serve(after_request(lambda robot: robot.send(NONSENSE[behaviour])))
    error = enqueue_fails(connect(server))
    assert type(error) in (Unreadable, Unnumbered, NotAMir, ConnectionLost)
    assert error.delivery is Delivery.UNKNOWN
    assert len(server.requests) == 1


@pytest.mark.parametrize("length", [b"", b"content-length:  29 \r\n"])
def test_a_length_may_be_missing_or_stand_between_spaces(serve: Serve, connect: Connect, length: bytes) -> None:
    server = serve(after_request(lambda robot: robot.send(CREATED + length + b"\r\n" + ACCEPTED)))
    assert connect(server).enqueue(MISSION) == 7


# ---------------------------------------------------------------------- too much
FLOODS: dict[str, Callable[[Conversation], None]] = {
    "endless chunks": lambda robot: flood(
        robot, HEAD + b"Transfer-Encoding: chunked\r\n\r\n", b"10000\r\n" + b"a" * 65536 + b"\r\n"
    ),
    "endless body": lambda robot: flood(robot, HEAD + b"\r\n", b"a" * 65536),
    "a great length": lambda robot: flood(robot, HEAD + b"Content-Length: 99999999999\r\n\r\n", b"a" * 65536),
}


@pytest.mark.parametrize("behaviour", FLOODS)
def test_a_flood_is_cut(serve: Serve, connect: Connect, behaviour: str) -> None:
    server = serve(after_request(FLOODS[behaviour]))
    robot = connect(server)
    tracemalloc.start()
    try:
        error = enqueue_fails(robot)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (type(error), error.code, error.delivery) == (Unreadable, "too_long", Delivery.UNKNOWN)
    assert peak < 40 * 1024 * 1024
    assert len(server.requests) == 1


CHUNKED = HEAD + b"Transfer-Encoding: chunked\r\n\r\n"


@pytest.mark.parametrize(
    "head",
    [
        CHUNKED,
        CHUNKED.replace(b"chunked", b"chunked\r\nTransfer-Encoding: x"),
        CHUNKED.replace(b"chunked", b"x, Chunked"),
    ],
    ids=["plain", "named twice", "in a list"],
)
def test_a_million_tiny_chunks_are_not_read(serve: Serve, connect: Connect, head: bytes) -> None:
    error = enqueue_fails(connect(serve(after_request(lambda robot: flood(robot, head, b"1\r\n \r\n" * 10_000)))))
    assert (type(error), error.code, error.delivery) == (Unreadable, "too_long", Delivery.UNKNOWN)


def test_nor_are_millions_of_tiny_packets(serve: Serve, connect: Connect, monkeypatch: pytest.MonkeyPatch) -> None:
    reads = 0
    recv_into = socket.socket.recv_into

    def one_byte(sock: socket.socket, buffer: Any, *args: Any) -> int:
        nonlocal reads
        reads += 1
        return recv_into(sock, memoryview(buffer)[:1], *args)

    server = serve(after_request(lambda robot: flood(robot, HEAD + b"\r\n", b" " * 65536)))
    monkeypatch.setattr(socket.socket, "recv_into", one_byte)
    assert status_fails(connect(server)).code == "too_long"
    assert reads < 40_000


def test_chunks_of_a_usual_size_are_read(serve: Serve, connect: Connect) -> None:
    missions = json.dumps([{"guid": f"{number:036}", "name": "x" * 200} for number in range(1500)]).encode()
    parts = [missions[at : at + 60] for at in range(0, len(missions), 60)]
    body = b"".join(b"%x\r\n%b\r\n" % (len(part), part) for part in [*parts, b""])
    assert len(connect(serve(after_request(lambda robot: robot.send(CHUNKED + body)))).missions()) == 1500


def test_endless_interim_answers_are_cut(serve: Serve, connect: Connect) -> None:
    server = serve(after_request(lambda robot: flood(robot, b"", b"HTTP/1.1 100 Continue\r\n\r\n" * 100)))
    error = enqueue_fails(connect(server))
    assert (type(error), error.delivery) == (Unreadable, Delivery.UNKNOWN)


def test_a_long_answer_within_the_limit_is_read(serve: Serve, connect: Connect) -> None:
    places = [{"guid": f"{number:036}", "name": "x" * 200} for number in range(20_000)]
    body = json.dumps(places).encode()
    assert 5_000_000 < len(body) < 8_000_000
    server = serve(after_request(lambda robot: robot.answer(body)))
    assert len(connect(server).positions()) == 20_000


# ---------------------------------------------------------------------- redirects
@pytest.mark.parametrize("status", [301, 302, 303, 307, 308])
def test_redirects_are_not_followed(serve: Serve, connect: Connect, status: int) -> None:
    other = serve()
    server = serve(
        after_request(
            lambda robot: robot.answer(b"", f"{status} Moved", f"Location: http://127.0.0.1:{other.port}/api/v2.0.0/x")
        )
    )
    robot = connect(server)
    error = enqueue_fails(robot)
    assert (type(error), error.code, error.delivery) == (NotAMir, "redirected", Delivery.UNKNOWN)
    assert type(status_fails(robot)) is NotAMir
    assert other.connections == 0
    assert len(server.requests) == 2


@pytest.mark.parametrize("length", [30, 80, 99, 100, 101, 150, 500])
def test_a_token_that_a_robot_sends_back_is_not_shown_in_part_either(
    serve: Serve, connect: Connect, length: int
) -> None:
    said = "x" * (length - 30) + "\u200b".join(TOKEN.header)
    body = json.dumps({"error_code": TOKEN.header, "error_human": said}).encode()
    for answer in (
        lambda robot: robot.answer(b"", "302 Found", f"Location: {'x' * (length - 30)}{TOKEN.header}"),
        lambda robot: robot.answer(body, "400 Bad Request"),
        lambda robot: robot.answer(body, "503 Service Unavailable"),
    ):
        error = enqueue_fails(connect(serve(after_request(answer))))
        assert TOKEN.header[6:20] not in f"{error!r}{error}{vars(error)}"
