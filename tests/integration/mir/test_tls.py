"""HTTPS with and without a pin: which certificates are taken, and that nothing is sent to any other."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from app.domain.models import InvalidInput
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.errors import (
    CertificateMismatch,
    CertificateProblem,
    ConnectionLost,
    Delivery,
    RobotError,
    TimedOut,
    Unreachable,
)
from app.mir.http import presented_fingerprint
from app.mir.transport import Timeouts
from tests.integration.mir.servers import CERTIFICATES, FIELD, HEAD, PLANT, Conversation, Server, closed_port, pin_of
from tests.integration.mir.talking import (
    PATIENT,
    TOKEN,
    Behaviour,
    Connect,
    Serve,
    after_request,
    enqueue_fails,
)
from tests.unit.mir.answers import MISSION, STATUS

RobotAt = Callable[..., RobotClient]
SILENT = Timeouts(connect=10.0, read=0.3, total=0.6)


@pytest.fixture
def robot_at(connect: Connect) -> RobotAt:
    """A client over https that knows this fingerprint, or none."""
    return lambda server, pin, timeouts=PATIENT, host="127.0.0.1": connect(
        server, timeouts, host=host, scheme="https", pin=pin
    )


@pytest.fixture
def server(serve: Serve) -> Server:
    return serve(certificate=FIELD)


def test_the_pinned_certificate_is_taken_though_expired_nameless_and_self_signed(
    server: Server, robot_at: RobotAt
) -> None:
    robot = robot_at(server, ":".join(pin_of(FIELD).upper()[n : n + 2] for n in range(0, 64, 2)))
    assert robot.status().robot_name == "R1"
    assert robot.status().robot_name == "R1"
    assert server.connections == 1
    assert robot.enqueue(MISSION) == 7
    assert server.connections == 2


def test_a_second_decrypted_answer_is_not_used_for_the_next_request(serve: Serve, robot_at: RobotAt) -> None:
    def answers_twice(conversation: Conversation) -> None:
        conversation.request()
        body = json.dumps(STATUS).encode()
        length = 8192 - len(HEAD) - len(b"Content-Length: 8000\r\n\r\n")  # what is read at a time
        conversation.send(
            HEAD
            + b"Content-Length: %d\r\n\r\n%b" % (length, body.ljust(length))
            + HEAD
            + b"Content-Length: 15\r\n\r\n"
            + b'{"id": "wrong"}'
        )
        conversation.request()
        conversation.hang()

    server = serve(answers_twice, FIELD)
    robot = robot_at(server, pin_of(FIELD))
    assert robot.status().robot_name == "R1"
    assert robot.status().robot_name == "R1"
    assert server.connections == 2


@pytest.mark.parametrize("pin", ["00" * 32, pin_of(PLANT)])
def test_another_certificate_than_the_pinned_one_gets_not_a_byte(server: Server, robot_at: RobotAt, pin: str) -> None:
    error = enqueue_fails(robot_at(server, pin))
    assert (type(error), error.delivery) == (CertificateMismatch, Delivery.NOT_SENT)
    assert server.connections == 1
    assert server.requests == []


def test_a_self_signed_certificate_is_not_taken_without_a_pin(server: Server, robot_at: RobotAt) -> None:
    error = enqueue_fails(robot_at(server, None))
    assert (type(error), error.code, error.delivery) == (CertificateProblem, "certificate_untrusted", Delivery.NOT_SENT)
    assert server.requests == []


def test_a_certificate_of_an_authority_that_the_system_trusts_is_taken(
    serve: Serve, robot_at: RobotAt, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SSL_CERT_FILE", str(CERTIFICATES / PLANT))
    server = serve(certificate=PLANT)
    for host in ("127.0.0.1", "localhost"):
        assert robot_at(server, None, host=host).status().robot_name == "R1"


def test_a_trusted_certificate_of_another_name_is_not(
    serve: Serve, robot_at: RobotAt, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SSL_CERT_FILE", str(CERTIFICATES / PLANT))
    server = serve(certificate=PLANT)
    error = enqueue_fails(robot_at(server, None, host="[::ffff:127.0.0.1]"))
    assert (type(error), error.code, error.delivery) == (CertificateProblem, "certificate_untrusted", Delivery.NOT_SENT)
    assert server.requests == []


def test_https_to_a_robot_that_speaks_http(serve: Serve, robot_at: RobotAt) -> None:
    server = serve(lambda robot: robot.send(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n"))
    error = enqueue_fails(robot_at(server, None))
    assert (type(error), error.code, error.delivery) == (CertificateProblem, "tls_failed", Delivery.NOT_SENT)


def test_http_to_a_robot_that_speaks_https(server: Server, connect: Connect) -> None:
    error = enqueue_fails(connect(server))
    assert (type(error), error.code, error.delivery) == (
        ConnectionLost,
        "lost_over_http",
        Delivery.UNKNOWN,
    )  # it left in clear text
    assert error.text.endswith("perhaps it wants https")
    assert server.requests == []


@pytest.mark.parametrize("behave", [lambda robot: robot.reset(), lambda robot: None], ids=["reset", "close"])
def test_a_handshake_that_breaks_sent_nothing(serve: Serve, robot_at: RobotAt, behave: Behaviour) -> None:
    error = enqueue_fails(robot_at(serve(behave), pin_of(FIELD)))
    assert isinstance(error, Unreachable)
    assert error.delivery is Delivery.NOT_SENT


def test_a_handshake_that_hangs_sent_nothing(serve: Serve, robot_at: RobotAt) -> None:
    error = enqueue_fails(
        robot_at(serve(lambda robot: robot.hang()), pin_of(FIELD), Timeouts(connect=0.3, read=0.3, total=0.6))
    )
    assert (type(error), error.code, error.delivery) == (CertificateProblem, "tls_silent", Delivery.NOT_SENT)
    assert error.text.endswith("check the address (http or https) and the port")  # it is on, and on this network


@pytest.mark.parametrize(
    ("behave", "kind"),
    [
        (lambda robot: None, ConnectionLost),
        (lambda robot: robot.reset(), ConnectionLost),
        (lambda robot: robot.hang(), TimedOut),
        (lambda robot: robot.drip(HEAD + b"X: " + b"x" * 60_000), TimedOut),
        (lambda robot: robot.drip(HEAD + b"Content-Length: 60000\r\n\r\n" + b"x" * 60_000), TimedOut),
    ],
    ids=["close", "reset", "hang", "drip headers", "drip body"],
)
def test_a_break_after_the_handshake_leaves_the_outcome_unknown(
    serve: Serve, robot_at: RobotAt, behave: Behaviour, kind: type[RobotError]
) -> None:
    server = serve(after_request(behave), FIELD)
    error = enqueue_fails(robot_at(server, pin_of(FIELD), SILENT if kind is TimedOut else PATIENT))
    assert (type(error), error.delivery) == (kind, Delivery.UNKNOWN)
    assert len(server.requests) == 1


def test_the_fingerprint_that_a_robot_shows_can_be_read_without_telling_it_anything(
    server: Server, serve: Serve
) -> None:
    assert presented_fingerprint(Address.parse(f"https://127.0.0.1:{server.port}")) == pin_of(FIELD)
    assert server.requests == []
    with pytest.raises(Unreachable):
        presented_fingerprint(Address.parse(f"https://127.0.0.1:{closed_port()}"))
    with pytest.raises(CertificateProblem):
        presented_fingerprint(Address.parse(f"https://127.0.0.1:{serve(lambda robot: None).port}"))


def test_a_pin_that_is_none_is_refused_and_one_for_http_is_of_no_use() -> None:
    with pytest.raises(InvalidInput):
        RobotClient(Address.parse("https://robot.test"), TOKEN, certificate_sha256="nonsense")
    RobotClient(Address.parse("http://robot.test"), TOKEN, certificate_sha256="00" * 32).close()
