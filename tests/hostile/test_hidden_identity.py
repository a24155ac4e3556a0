"""Machines that hide what they are: credentials go to them only where a person, a certificate or nothing before speaks for it."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

import pytest

from app.container import Container
from app.domain.execution import State
from app.domain.models import Connection, Robot
from app.domain.robot import IdentifiedBy
from app.mir.errors import (
    CertificateMismatch,
    CertificateProblem,
    RobotError,
    SerialNumberHidden,
    Unauthorized,
)
from tests.hostile.capture import Capture
from tests.hostile.credentials import PASSWORD, USER, Listen, add, connection, poll, run_now, stored
from tests.integration.mir.servers import FIELD, PLANT, pin_of
from tests.support.errors import raises

hiding = pytest.mark.parametrize(
    "hides", [{"serial": None}, {"status_is_open": False}], ids=["no serial number", "no status"]
)


# ---------------------------------------------------------------------- robots whose status needs credentials
def test_a_robot_that_wants_credentials_for_its_status_gets_them_where_they_were_entered(
    container: Container, listen: Listen
) -> None:
    machine, thief = listen(status_is_open=False), listen(status_is_open=False)
    robot = add(container, machine.url)
    poll(container)
    assert connection(container) is Connection.CONNECTED
    assert (stored(container).serial_number, stored(container).identified_by) == ("A-1", IdentifiedBy.ADDRESS)
    assert run_now(container).state is State.QUEUED
    machine.serial = "B-2"
    poll(container)
    assert connection(container) is Connection.WRONG_ROBOT
    container.catalogue.save_robot(replace(stored(container), address=thief.url))
    poll(container)
    with suppress(RobotError):
        container.operator.fetch_missions(robot.id)
    assert thief.credentials == []


def test_a_wrong_password_shows_there_too(container: Container, listen: Listen) -> None:
    machine = listen(status_is_open=False)
    machine.answer = lambda one: (401, {})  # type: ignore[method-assign]
    robot = add(container, machine.url)
    with pytest.raises(Unauthorized):
        container.operator.test_connection(robot)


# ---------------------------------------------------------------------- a machine that hides the known serial number


@hiding
@pytest.mark.parametrize("password", [None, PASSWORD], ids=["stored", "entered again"])
def test_credentials_go_to_a_machine_that_hides_the_serial_number_only_after_somebody_agreed(
    container: Container, machine: Capture, hides: dict[str, Any], password: str | None
) -> None:
    add(container, machine.url)
    poll(container)
    machine.pretend(hides)
    machine.seen.clear()
    for _ in range(2):
        with pytest.raises(SerialNumberHidden, match="check at the robot that it is the same one"):
            container.operator.test_connection(stored(container), password)
    container.catalogue.save_robot(stored(container), password)
    poll(container)
    assert connection(container) is Connection.WRONG_ROBOT
    assert machine.credentials == []
    found = container.operator.test_connection(stored(container), password, by_address=True)
    assert found.identified_by is IdentifiedBy.ADDRESS
    container.catalogue.save_robot(
        replace(stored(container), identified_by=found.identified_by), password, is_tested=True
    )
    poll(container)
    assert (connection(container), stored(container).identified_by) == (Connection.CONNECTED, IdentifiedBy.ADDRESS)
    assert stored(container).serial_number == "A-1"
    machine.pretend({"serial": "A-1", "status_is_open": True})
    poll(container)
    assert stored(container).identified_by is IdentifiedBy.SERIAL_NUMBER  # it shows it again


@hiding
def test_a_dialog_that_was_opened_before_the_robot_was_known_does_not_make_it_unknown(
    container: Container, machine: Capture, hides: dict[str, Any]
) -> None:
    in_dialog = add(container, machine.url)
    poll(container)
    known = stored(container)
    container.catalogue.save_robot(replace(in_dialog, name="Aino 2"))
    assert stored(container) == replace(known, name="Aino 2")
    machine.pretend(hides)
    machine.seen.clear()
    poll(container)
    assert connection(container) is Connection.WRONG_ROBOT
    assert machine.credentials == []


@hiding
@pytest.mark.parametrize("certificate", ["", FIELD], ids=["without a certificate", "known by its certificate"])
def test_nor_do_they_go_to_one_at_another_address(
    container: Container, listen: Listen, certificate: str, hides: dict[str, Any]
) -> None:
    machine, thief = listen(certificate), listen(**hides)
    add(container, machine.url, **({"certificate_sha256": pin_of(certificate)} if certificate else {}))
    poll(container)
    moved = replace(stored(container), address=thief.url)
    with pytest.raises(SerialNumberHidden):
        container.operator.test_connection(moved, PASSWORD)
    container.catalogue.save_robot(moved, PASSWORD)
    poll(container)
    assert connection(container) is Connection.WRONG_ROBOT
    assert thief.credentials == []


@hiding
def test_a_certificate_stands_for_a_serial_number_that_is_hidden(
    container: Container, listen: Listen, hides: dict[str, Any]
) -> None:
    machine, safe = listen(), listen(FIELD, **hides)
    add(container, machine.url)
    poll(container)
    container.catalogue.save_robot(
        replace(stored(container), address=safe.url, certificate_sha256=pin_of(FIELD)), PASSWORD
    )
    poll(container)
    assert (connection(container), stored(container).identified_by) == (Connection.CONNECTED, IdentifiedBy.CERTIFICATE)


# ---------------------------------------------------------------------- certificates
@pytest.mark.parametrize("is_open", [True, False])
def test_a_pinned_certificate_is_the_proof(container: Container, listen: Listen, is_open: bool) -> None:
    add(container, listen(FIELD, status_is_open=is_open).url, certificate_sha256=pin_of(FIELD))
    poll(container)
    assert (connection(container), stored(container).identified_by) == (Connection.CONNECTED, IdentifiedBy.CERTIFICATE)


def test_another_certificate_is_an_alarm_and_gets_no_request(container: Container, listen: Listen) -> None:
    machine = listen(PLANT)
    robot = add(container, machine.url, certificate_sha256=pin_of(FIELD))
    poll(container, rounds=1)
    assert "certificate_changed" in [alarm.code for alarm in container.alarms.open()]
    with pytest.raises(CertificateMismatch):
        container.operator.test_connection(robot)
    assert machine.seen == []
    container.catalogue.save_robot(replace(robot, certificate_sha256=pin_of(PLANT)), PASSWORD)
    poll(container)
    assert connection(container) is Connection.CONNECTED
    assert [alarm.code for alarm in container.alarms.open() if alarm.cleared_at is None] == []


def test_an_unknown_certificate_gets_no_request_and_its_fingerprint_can_be_compared(
    container: Container, listen: Listen
) -> None:
    machine = listen(FIELD)
    with raises(CertificateProblem, code="certificate_untrusted"):
        container.operator.test_connection(Robot("Aino", machine.url, USER), PASSWORD)
    assert container.operator.presented_fingerprint(machine.url) == pin_of(FIELD)
    assert machine.seen == []


def test_a_robot_with_an_unknown_certificate_is_not_said_to_be_silent(container: Container, listen: Listen) -> None:
    machine = listen(FIELD)
    robot = add(container, machine.url)
    poll(container)
    assert connection(container) is Connection.UNTRUSTED
    assert [alarm.code for alarm in container.alarms.open()] == ["certificate_untrusted"]
    assert machine.seen == []
    container.catalogue.save_robot(replace(robot, certificate_sha256=pin_of(FIELD)), PASSWORD)
    poll(container)
    assert connection(container) is Connection.CONNECTED
    assert [alarm.code for alarm in container.alarms.open() if alarm.cleared_at is None] == []
