"""For any bytes from a socket, a call raises only RobotError, and a mission is requested once."""

from __future__ import annotations

import contextlib

from hypothesis import example, given
from hypothesis import strategies as st

from app.mir.errors import RobotError
from tests.integration.mir.talking import Connect, Serve, after_request
from tests.support.examples import examples

RAW = st.binary(max_size=200) | st.builds(
    lambda status, headers, body: b"HTTP/1.1 %d X\r\n" % status + headers + b"\r\n" + body,
    st.integers(0, 999),
    st.lists(
        st.sampled_from(
            [
                b"Content-Length: 3\r\n",
                b"Content-Length: x\r\n",
                b"Transfer-Encoding: chunked\r\n",
                b"Content-Encoding: gzip\r\n",
                b"Content-Encoding: br, zstd\r\n",
                b"Location: http://[\r\n",
                b"Location: \xff\r\n",
                b"Set-Cookie: \x00=;\r\n",
                b"Connection: close\r\n",
                b": \r\n",
                b"Date: \x80\r\n",
                b"Robot-Version: \xff\xfe\r\n",
            ]
        ),
        max_size=5,
    ).map(b"".join),
    st.binary(max_size=60) | st.sampled_from([b'{"id": 7}', b"3\r\n{}\n\r\n0\r\n\r\n", b"ffffffff\r\n{"]),
)


def test_whatever_comes_out_of_a_socket_raises_nothing_but_robot_errors(serve: Serve, connect: Connect) -> None:
    raw = b""
    server = serve(after_request(lambda robot: robot.send(raw)))

    @examples(150)
    @example(b"HTTP/1.1 401 X\r\n\r\n")
    @given(RAW)
    def says(answer: bytes) -> None:
        nonlocal raw
        raw, robot = answer, connect(server)
        for call, most in (
            (lambda: robot.enqueue("g"), 1),
            (robot.status, 2),
        ):  # the status again, with credentials, after a 401
            before = len(server.requests)
            with contextlib.suppress(RobotError):
                call()
            assert before < len(server.requests) <= before + most

    says()
