"""A credential belongs to one user on one robot at one address: no byte of it goes anywhere else."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import pytest

from app.container import Container
from app.domain.execution import ReasonCode, State
from app.domain.models import Connection, InvalidInput, Robot
from app.domain.robot import IdentifiedBy
from app.mir.errors import (
    AnotherRobot,
    RobotError,
    SerialNumberHidden,
)
from app.services.dispatch import messages
from tests.hostile.capture import Capture, Seen
from tests.hostile.credentials import (
    PASSWORD,
    TOKEN,
    USER,
    Listen,
    add,
    assert_needs_password,
    connection,
    everything_an_operator_asks_for,
    import_robot,
    look,
    poll,
    run_now,
    stored,
)
from tests.integration.mir.servers import FIELD, pin_of
from tests.support.errors import refuses

# ---------------------------------------------------------------------- what a token belongs to
CHANGES: dict[str, Callable[[Robot, Capture], Robot]] = {
    "host": lambda robot, _: replace(robot, address=robot.address.replace("127.0.0.1", "localhost")),
    "port": lambda robot, thief: replace(robot, address=thief.url),
    "scheme": lambda robot, _: replace(robot, address=robot.address.replace("http:", "https:")),
    "user": lambda robot, _: replace(robot, username="admin"),
    "pin": lambda robot, _: replace(robot, certificate_sha256="ab" * 32),
    "serial number": lambda robot, _: replace(robot, serial_number="B-2"),
}
changed_anyhow = pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES.keys())


@changed_anyhow
def test_testing_a_changed_connection_asks_for_the_password_and_sends_nothing(
    container: Container, machine: Capture, thief: Capture, change: Any
) -> None:
    robot = add(container, machine.url, serial_number="A-1")
    with refuses("password", "enter the password"):
        container.operator.test_connection(change(robot, thief))
    assert machine.seen == thief.seen == []


@changed_anyhow
def test_a_changed_robot_needs_its_password_before_anything_is_sent(
    container: Container, machine: Capture, thief: Capture, change: Any
) -> None:
    robot = add(container, machine.url, serial_number="A-1")
    container.catalogue.save_robot(change(robot, thief))
    assert_needs_password(container)
    poll(container)
    with suppress(RobotError):
        container.operator.fetch_missions(robot.id)
    assert machine.credentials == thief.credentials == []
    container.catalogue.save_robot(
        replace(stored(container), address=robot.address, username=USER, certificate_sha256=None)
    )
    assert_needs_password(container)  # the token was deleted, not kept for later


@pytest.mark.parametrize("key", ["host", "port", "scheme", "user", "pin"])
def test_an_imported_change_keeps_no_token(container: Container, machine: Capture, thief: Capture, key: str) -> None:
    changed = CHANGES[key](add(container, machine.url, serial_number="A-1"), thief)
    pin = {"certificate_sha256": changed.certificate_sha256} if changed.certificate_sha256 else {}
    lines = import_robot(container, address=changed.address, username=changed.username, **pin)
    assert "needs a password" in str(lines)
    assert_needs_password(container)
    assert stored(container).serial_number == "A-1"
    poll(container)
    assert machine.credentials == thief.credentials == []


def test_the_same_address_in_other_words_keeps_the_token(container: Container) -> None:
    before = add(container, "http://10.0.0.1", certificate_sha256="ab" * 32)
    assert (
        import_robot(container, address="10.0.0.1:80/", username=USER, certificate_sha256=":".join(["AB"] * 32)) == []
    )
    assert stored(container) == before
    assert before.token == TOKEN


@pytest.mark.parametrize("by", ["import", "edit"])
def test_https_with_a_pin_does_not_become_http_in_silence(container: Container, listen: Listen, by: str) -> None:
    thief = listen()
    robot = add(container, thief.url.replace("http:", "https:"), certificate_sha256=pin_of(FIELD))
    if by == "import":
        import_robot(container, address=thief.url)
    else:
        container.catalogue.save_robot(replace(robot, address=thief.url))
    assert_needs_password(container)
    poll(container)
    assert thief.credentials == []


def test_an_import_with_a_password_says_that_encryption_ends(container: Container) -> None:
    add(container, "https://10.0.0.1", certificate_sha256="ab" * 32)
    lines = import_robot(container, address="http://10.0.0.1", password=PASSWORD)
    assert "no longer encrypted" in str(lines)
    assert stored(container).token == TOKEN


# ---------------------------------------------------------------------- who answers, before it gets the credentials
def test_the_status_is_asked_for_without_credentials_and_all_else_after_it(
    container: Container, machine: Capture
) -> None:
    add(container, machine.url)
    poll(container)
    assert (connection(container), stored(container).serial_number) == (Connection.CONNECTED, "A-1")
    assert stored(container).identified_by is IdentifiedBy.SERIAL_NUMBER
    assert run_now(container).state is State.QUEUED
    assert {one.authorization for one in machine.seen if one.path == "/status"} == {None}
    assert {one.authorization for one in machine.seen if one.path != "/status"} == {TOKEN}
    assert machine.seen[0].path == "/status"


def test_a_poll_of_a_known_robot_costs_one_status(container: Container, machine: Capture) -> None:
    add(container, machine.url)
    poll(container)
    worker = container.make_worker(stored(container))
    look(worker)
    machine.seen.clear()
    look(worker)
    worker.close()
    assert [one.path for one in machine.seen].count("/status") == 1
    assert len(machine.seen) > 1


@pytest.mark.parametrize(
    ("pretends", "code"),
    [
        ({"serial": "B-2"}, "wrong_robot"),
        ({"serial": None}, "serial_hidden"),
        ({"status_is_open": False}, "serial_hidden"),
    ],
    ids=["another serial number", "no serial number", "no status without credentials"],
)
def test_a_machine_that_does_not_show_the_known_serial_number_gets_nothing(
    container: Container, machine: Capture, pretends: dict[str, Any], code: str
) -> None:
    robot = add(container, machine.url)
    poll(container)
    machine.seen.clear()
    machine.pretend(pretends)
    poll(container)
    assert connection(container) is Connection.WRONG_ROBOT
    assert code in [alarm.code for alarm in container.alarms.open()]
    everything_an_operator_asks_for(container, robot)
    with pytest.raises((AnotherRobot, SerialNumberHidden)):
        container.operator.test_connection(stored(container))
    with pytest.raises((AnotherRobot, SerialNumberHidden)):
        container.operator.test_connection(stored(container), PASSWORD)
    assert run_now(container).state is not State.QUEUED
    assert machine.credentials == []
    assert stored(container).serial_number == "A-1"


def test_the_wrong_robot_fails_the_run(container: Container, listen: Listen) -> None:
    machine = listen(serial="B-2")
    add(container, machine.url, serial_number="A-1")
    assert run_now(container).reason.code is ReasonCode.WRONG_ROBOT
    assert machine.credentials == []


def test_a_machine_that_replaces_a_robot_during_polling_gets_nothing(container: Container, machine: Capture) -> None:
    add(container, machine.url)
    worker = container.make_worker(stored(container))
    look(worker)
    assert machine.credentials
    machine.seen.clear()
    machine.serial = "B-2"
    for _ in range(2):
        look(worker)
    worker.close()
    assert machine.credentials == []
    assert stored(container).serial_number == "A-1"


def test_a_robot_edited_during_polling_gets_nothing_before_its_new_serial_number(
    container: Container, machine: Capture
) -> None:
    add(container, machine.url)
    worker = container.make_worker(stored(container))
    worker.advance()
    assert worker.seen.fresh_status is not None
    machine.seen.clear()
    worker.handle(messages.RobotEdited(replace(stored(container), serial_number="B-2")))
    assert (worker.seen.fresh_status, worker.readiness()) == (None, None)
    look(worker)
    worker.close()
    assert [one.path for one in machine.seen] == ["/status"]
    assert machine.credentials == []


def test_the_new_robot_is_taken_at_the_integrators_word_and_with_its_own_password(
    container: Container, listen: Listen
) -> None:
    machine = listen(serial="B-2")
    robot = add(container, machine.url, serial_number="A-1")
    with pytest.raises(AnotherRobot) as another:
        container.operator.test_connection(robot)
    assert (another.value.params["expected"], another.value.params["found"]) == ("A-1", "B-2")
    new = replace(robot, serial_number="B-2")
    with pytest.raises(InvalidInput, match="enter the password"):
        container.operator.test_connection(new)
    assert machine.credentials == []
    assert container.operator.test_connection(new, PASSWORD).serial_number == "B-2"
    container.catalogue.save_robot(new, PASSWORD)
    poll(container)
    assert (connection(container), stored(container).serial_number) == (Connection.CONNECTED, "B-2")


@pytest.mark.parametrize(
    "change",
    [{"serial_number": "B-2"}, {"address": "http://127.0.0.1:1"}, {"username": "admin"}],
    ids=["serial number", "address", "user"],
)
@pytest.mark.parametrize("is_known", [False, True])
def test_facts_of_the_machine_before_an_edit_are_not_stored_for_the_new_one(
    container: Container, machine: Capture, is_known: bool, change: dict[str, Any]
) -> None:
    robot = add(container, machine.url, serial_number="A-1" if is_known else None)
    worker, answer = container.make_worker(robot), machine.answer

    def edited_while_answering(one: Seen) -> tuple[int, Any]:
        if one.path == "/users/me":
            container.catalogue.save_robot(replace(robot, **change), PASSWORD)
        return answer(one)

    machine.answer = edited_while_answering  # type: ignore[method-assign]
    worker.advance()
    assert stored(container) == replace(robot, **change, token=stored(container).token)
    assert worker.robot == robot  # so that it is seen to be of another connection
    worker.close()
