import string

import pytest

from app.mir import errors
from app.mir.errors import (
    SENTENCES,
    AnotherRobot,
    Busy,
    CertificateMismatch,
    CertificateProblem,
    ConnectionLost,
    Delivery,
    NotAMir,
    Rejected,
    RobotError,
    RobotFault,
    TimedOut,
    Unauthorized,
    Unreachable,
    Unreadable,
)


@pytest.mark.parametrize(
    ("error", "delivery"),
    [
        (Unreachable(), Delivery.NOT_SENT),
        (Unreachable(code="refused"), Delivery.NOT_SENT),
        (CertificateProblem(), Delivery.NOT_SENT),
        (CertificateMismatch(), Delivery.NOT_SENT),
        (Unauthorized(), Delivery.REFUSED),
        (Unauthorized(status=403), Delivery.REFUSED),
        *((Rejected(status=status), Delivery.REFUSED) for status in (400, 402, 404, 405, 409, 410, 422)),
        *((Rejected(status=status), Delivery.UNKNOWN) for status in (408, 425, 429)),
        (Busy(status=503), Delivery.UNKNOWN),
        *((RobotFault(status=status), Delivery.UNKNOWN) for status in (500, 501, 502, 504)),
        (ConnectionLost(), Delivery.UNKNOWN),
        (TimedOut(), Delivery.UNKNOWN),
        (NotAMir(), Delivery.UNKNOWN),
        (AnotherRobot(expected="1", found="2"), Delivery.NOT_SENT),
        (Unreadable(problem="it is no JSON"), Delivery.UNKNOWN),
        (RobotError(), Delivery.UNKNOWN),
    ],
)
def test_every_error_says_what_it_may_have_done(error: RobotError, delivery: Delivery) -> None:
    assert error.delivery is delivery
    assert error.certainly_without_effect is (delivery is not Delivery.UNKNOWN)


def test_an_error_has_code_sentence_and_values() -> None:
    error = Unreachable(code="refused", address="10.0.0.7")
    assert error.code == "refused"
    assert error.msgid == SENTENCES["refused"]
    assert error.params["address"] == "10.0.0.7"
    assert error.text == str(error) == "10.0.0.7 refused the connection. Is it switched on and its address right?"


def test_the_robots_own_words_come_along() -> None:
    error = Rejected(status=404, reason="Not found {x}")
    assert (error.status, error.reason) == (404, "Not found {x}")
    assert error.text == "the robot refused: Not found {x} (status 404)"
    assert Rejected(status=400).text == "the robot refused (status 400)"
    assert RobotFault(status=500, reason="Oops").text == "the robot failed on its side: Oops (status 500)"
    assert Unauthorized(status=403).code == "forbidden"
    assert Unauthorized(status=401).code == "unauthorized"


@pytest.mark.parametrize("code", SENTENCES)
def test_every_sentence_can_be_said_with_values_missing(code: str) -> None:
    fields = {field for _, field, _, _ in string.Formatter().parse(SENTENCES[code]) if field}
    text = RobotError(code=code).text
    assert "{" not in text
    assert ("?" in text) >= bool(fields - {"address"})
    assert not text.endswith(".")
    assert RobotError(code=code, **dict.fromkeys(fields, "X")).text


def test_every_class_has_a_sentence() -> None:
    def tree(kind: type[RobotError]) -> list[type[RobotError]]:
        return [kind, *(below for child in kind.__subclasses__() for below in tree(child))]

    assert {kind.code for kind in tree(RobotError)} <= set(SENTENCES)
    assert len(tree(RobotError)) == sum(
        isinstance(value, type) and issubclass(value, RobotError) for value in vars(errors).values()
    )


def test_the_reason_why_another_request_was_not_sent_is_an_error_of_its_own():
    shared = errors.Busy(status=503, reason="docking").at("fleet.test")
    reason = shared.unsent()
    assert (type(reason), reason.text, reason.status) == (errors.Busy, shared.text, 503)
    assert (reason.delivery, shared.delivery) == (errors.Delivery.NOT_SENT, errors.Delivery.UNKNOWN)
