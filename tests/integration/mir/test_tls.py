"""HTTPS with and without a pin: which certificates are taken, and that nothing is sent to any other."""

from __future__ import annotations

import hashlib
import json
import ssl
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from app.domain.models import InvalidInput
from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
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
from tests.integration.mir.servers import HEAD, Conversation, Server, closed_port
from tests.unit.mir.answers import MISSION, STATUS

CERTIFICATES = Path(__file__).parent / "certificates"
FIELD_ROBOT, PLANT_ROBOT = CERTIFICATES / "field_robot.pem", CERTIFICATES / "plant_robot.pem"
TOKEN = Token.derive("distributor", "distributor")
PATIENT = Timeouts(connect=10.0, read=20.0, total=60.0)
QUICK = Timeouts(connect=0.3, read=0.3, total=0.6)

Behaviour = Callable[[Conversation], None]
Serve = Callable[..., Server]


def fingerprint(certificate: Path) -> str:
    text = certificate.read_text()
    return hashlib.sha256(ssl.PEM_cert_to_DER_cert(text[text.index("-----BEGIN CERT") :])).hexdigest()


def robot_at(server: Server, pin: str | None, timeouts: Timeouts = PATIENT, host: str = "127.0.0.1") -> RobotClient:
    client = RobotClient(Address.parse(f"https://{host}:{server.port}"), TOKEN, certificate_sha256=pin)
    client.timeouts = timeouts
    return client


def ready(conversation: Conversation) -> None:
    while request := conversation.request():
        conversation.answer(
            b'{"id": 7}' if request.startswith(b"POST") else json.dumps(STATUS).encode(),
            "201 Created" if request.startswith(b"POST") else "200 OK",
        )


@pytest.fixture
def serve() -> Iterator[Serve]:
    with ExitStack() as stack:

        def start(behave: Behaviour = ready, certificate: Path | None = FIELD_ROBOT) -> Server:
            context = None
            if certificate is not None:
                context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
                context.load_cert_chain(certificate)
            server = Server(behave, context)
            stack.callback(server.close)
            return server

        yield start


def enqueue_fails(client: RobotClient) -> RobotError:
    with pytest.raises(RobotError) as failed:
        client.enqueue(MISSION)
    client.close()
    return failed.value


def test_the_pinned_certificate_is_taken_though_expired_nameless_and_self_signed(serve: Serve) -> None:
    server = serve()
    robot = robot_at(server, ":".join(fingerprint(FIELD_ROBOT).upper()[n : n + 2] for n in range(0, 64, 2)))
    assert robot.status().robot_name == "R1"
    assert robot.status().robot_name == "R1"
    assert server.connections == 1
    assert robot.enqueue(MISSION) == 7
    assert server.connections == 2
    robot.close()


def test_a_second_decrypted_answer_is_not_used_for_the_next_request(serve: Serve) -> None:
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

    server = serve(answers_twice)
    robot = robot_at(server, fingerprint(FIELD_ROBOT))
    assert robot.status().robot_name == "R1"
    assert robot.status().robot_name == "R1"
    assert server.connections == 2
    robot.close()


@pytest.mark.parametrize("pin", ["00" * 32, fingerprint(PLANT_ROBOT)])
def test_another_certificate_than_the_pinned_one_gets_not_a_byte(serve: Serve, pin: str) -> None:
    server = serve()
    error = enqueue_fails(robot_at(server, pin))
    assert (type(error), error.delivery) == (CertificateMismatch, Delivery.NOT_SENT)
    assert server.connections == 1
    assert server.requests == []


def test_a_self_signed_certificate_is_not_taken_without_a_pin(serve: Serve) -> None:
    server = serve()
    error = enqueue_fails(robot_at(server, None))
    assert (type(error), error.code, error.delivery) == (CertificateProblem, "certificate_untrusted", Delivery.NOT_SENT)
    assert server.requests == []


def test_a_certificate_of_an_authority_that_the_system_trusts_is_taken(
    serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SSL_CERT_FILE", str(PLANT_ROBOT))
    server = serve(certificate=PLANT_ROBOT)
    for host in ("127.0.0.1", "localhost"):
        robot = robot_at(server, None, host=host)
        assert robot.status().robot_name == "R1"
        robot.close()


def test_a_trusted_certificate_of_another_name_is_not(serve: Serve, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SSL_CERT_FILE", str(PLANT_ROBOT))
    server = serve(certificate=PLANT_ROBOT)
    error = enqueue_fails(robot_at(server, None, host="[::ffff:127.0.0.1]"))
    assert (type(error), error.code, error.delivery) == (CertificateProblem, "certificate_untrusted", Delivery.NOT_SENT)
    assert server.requests == []


def test_https_to_a_robot_that_speaks_http(serve: Serve) -> None:
    server = serve(lambda robot: robot.send(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n"), certificate=None)
    error = enqueue_fails(robot_at(server, None))
    assert (type(error), error.code, error.delivery) == (CertificateProblem, "tls_failed", Delivery.NOT_SENT)


def test_http_to_a_robot_that_speaks_https(serve: Serve) -> None:
    server = serve()
    error = enqueue_fails(RobotClient(Address.parse(f"http://127.0.0.1:{server.port}"), TOKEN))
    assert (type(error), error.code, error.delivery) == (
        ConnectionLost,
        "lost_over_http",
        Delivery.UNKNOWN,
    )  # it left in clear text
    assert error.text.endswith("perhaps it wants https")
    assert server.requests == []


@pytest.mark.parametrize("behave", [lambda robot: robot.reset(), lambda robot: None], ids=["reset", "close"])
def test_a_handshake_that_breaks_sent_nothing(serve: Serve, behave: Behaviour) -> None:
    error = enqueue_fails(robot_at(serve(behave, certificate=None), fingerprint(FIELD_ROBOT)))
    assert isinstance(error, Unreachable)
    assert error.delivery is Delivery.NOT_SENT


def test_a_handshake_that_hangs_sent_nothing(serve: Serve) -> None:
    error = enqueue_fails(
        robot_at(serve(lambda robot: robot.hang(), certificate=None), fingerprint(FIELD_ROBOT), QUICK)
    )
    assert (type(error), error.code, error.delivery) == (CertificateProblem, "tls_silent", Delivery.NOT_SENT)
    assert error.text.endswith("check the address (http or https) and the port")  # it is on, and on this network


def after_request(conversation: Conversation, then: Callable[[], None]) -> None:
    conversation.request()
    then()


@pytest.mark.parametrize(
    ("behave", "kind"),
    [
        (lambda robot: after_request(robot, lambda: None), ConnectionLost),
        (lambda robot: after_request(robot, robot.reset), ConnectionLost),
        (lambda robot: after_request(robot, robot.hang), TimedOut),
        (lambda robot: after_request(robot, lambda: robot.drip(HEAD + b"X: " + b"x" * 60_000)), TimedOut),
        (
            lambda robot: after_request(
                robot, lambda: robot.drip(HEAD + b"Content-Length: 60000\r\n\r\n" + b"x" * 60_000)
            ),
            TimedOut,
        ),
    ],
    ids=["close", "reset", "hang", "drip headers", "drip body"],
)
def test_a_break_after_the_handshake_leaves_the_outcome_unknown(
    serve: Serve, behave: Behaviour, kind: type[RobotError]
) -> None:
    server = serve(behave)
    timeouts = Timeouts(connect=10.0, read=0.3, total=0.6) if kind is TimedOut else PATIENT
    error = enqueue_fails(robot_at(server, fingerprint(FIELD_ROBOT), timeouts))
    assert (type(error), error.delivery) == (kind, Delivery.UNKNOWN)
    assert len(server.requests) == 1


def test_the_fingerprint_that_a_robot_shows_can_be_read_without_telling_it_anything(serve: Serve) -> None:
    server = serve()
    assert presented_fingerprint(Address.parse(f"https://127.0.0.1:{server.port}")) == fingerprint(FIELD_ROBOT)
    assert server.requests == []
    with pytest.raises(Unreachable):
        presented_fingerprint(Address.parse(f"https://127.0.0.1:{closed_port()}"))
    with pytest.raises(CertificateProblem):
        presented_fingerprint(Address.parse(f"https://127.0.0.1:{serve(lambda robot: None, certificate=None).port}"))


def test_a_pin_that_is_none_is_refused_and_one_for_http_is_of_no_use() -> None:
    with pytest.raises(InvalidInput):
        RobotClient(Address.parse("https://robot.test"), TOKEN, certificate_sha256="nonsense")
    RobotClient(Address.parse("http://robot.test"), TOKEN, certificate_sha256="00" * 32).close()
