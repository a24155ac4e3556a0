"""A credential belongs to one user on one robot at one address: no byte of it goes anywhere else."""
from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.container import Container
from app.domain.models import Connection, InvalidInput, Mission, ReasonCode, Robot, State
from app.domain.robot import IdentifiedBy
from app.mir.credentials import Token
from app.mir.errors import AnotherRobot, CertificateMismatch, CertificateProblem, RobotError, SerialNumberHidden, Unauthorized
from app.services.catalogue.configuration.importing import import_configuration
from app.services.dispatch import messages
from tests.hostile.capture import Capture, capture, pin_of
from tests.unit.mir.answers import MISSION

USER, PASSWORD = "scheduler", "a secret"
TOKEN = Token.derive(USER, PASSWORD).header
FIELD, PLANT = "field_robot.pem", "plant_robot.pem"
Listen = Callable[..., Capture]


@pytest.fixture
def listen() -> Iterator[Listen]:
    with ExitStack() as stack:
        yield lambda *args, **given: stack.enter_context(capture(*args, **given))


@pytest.fixture
def tablet(tmp_path: Path) -> Iterator[Container]:
    container = Container.open(tmp_path)
    yield container
    container.close()


def add(tablet: Container, address: str, **values: Any) -> Robot:
    return tablet.catalogue.save_robot(Robot("Aino", address, USER, **values), PASSWORD)


def stored(tablet: Container) -> Robot:
    robot, = tablet.catalogue.robots()
    return robot


def poll(tablet: Container, rounds: int = 2) -> None:
    """As the robot's worker does it, beginning anew."""
    worker = tablet.make_worker(stored(tablet))
    for _ in range(rounds):
        worker.handle(messages.Poll())
        worker.advance()
    worker.close()


def connection(tablet: Container) -> Connection:
    return tablet.snapshots.get(stored(tablet).id).connection


def import_robot(tablet: Container, **keys: Any) -> list[Any]:
    content = {"format": "amr-scheduler/1", "robots": [{"name": "Aino", **keys}]}
    return import_configuration(tablet.catalogue, json.dumps(content).encode())


def assert_needs_password(tablet: Container) -> None:
    robot = stored(tablet)
    assert (robot.token, robot.needs_password, robot.enabled) == (None, True, False)


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
def test_testing_a_changed_connection_asks_for_the_password_and_sends_nothing(tablet: Container, listen: Listen, change: Any) -> None:
    machine, thief = listen(), listen()
    robot = add(tablet, machine.url, serial_number="A-1")
    with pytest.raises(InvalidInput, match="enter the password") as refused:
        tablet.operator.test_connection(change(robot, thief))
    assert refused.value.field == "password"
    assert machine.seen == thief.seen == []


@changed_anyhow
def test_a_changed_robot_needs_its_password_before_anything_is_sent(tablet: Container, listen: Listen, change: Any) -> None:
    machine, thief = listen(), listen()
    robot = add(tablet, machine.url, serial_number="A-1")
    tablet.catalogue.save_robot(change(robot, thief))
    assert_needs_password(tablet)
    poll(tablet)
    with suppress(RobotError):
        tablet.operator.fetch_missions(robot.id)
    assert machine.credentials == thief.credentials == []
    tablet.catalogue.save_robot(replace(stored(tablet), address=robot.address, username=USER, certificate_sha256=None))
    assert_needs_password(tablet)                    # the token is gone, not kept for later


@pytest.mark.parametrize("key", ["host", "port", "scheme", "user", "pin"])
def test_an_imported_change_keeps_no_token(tablet: Container, listen: Listen, key: str) -> None:
    machine, thief = listen(), listen()
    robot = add(tablet, machine.url, serial_number="A-1")
    changed = CHANGES[key](robot, thief)
    pin = {"certificate_sha256": changed.certificate_sha256} if changed.certificate_sha256 else {}
    lines = import_robot(tablet, address=changed.address, username=changed.username, **pin)
    assert "needs a password" in str(lines)
    assert_needs_password(tablet)
    assert stored(tablet).serial_number == "A-1"
    poll(tablet)
    assert machine.credentials == thief.credentials == []


def test_the_same_address_in_other_words_keeps_the_token(tablet: Container) -> None:
    before = add(tablet, "http://10.0.0.1", certificate_sha256="ab" * 32)
    assert import_robot(tablet, address="10.0.0.1:80/", username=USER, certificate_sha256=":".join(["AB"] * 32)) == []
    assert stored(tablet) == before
    assert before.token == TOKEN


@pytest.mark.parametrize("by", ["import", "edit"])
def test_https_with_a_pin_does_not_become_http_in_silence(tablet: Container, listen: Listen, by: str) -> None:
    thief = listen()
    robot = add(tablet, thief.url.replace("http:", "https:"), certificate_sha256=pin_of(FIELD))
    if by == "import":
        import_robot(tablet, address=thief.url)
    else:
        tablet.catalogue.save_robot(replace(robot, address=thief.url))
    assert_needs_password(tablet)
    poll(tablet)
    assert thief.credentials == []


def test_an_import_with_a_password_says_that_encryption_ends(tablet: Container) -> None:
    add(tablet, "https://10.0.0.1", certificate_sha256="ab" * 32)
    lines = import_robot(tablet, address="http://10.0.0.1", password=PASSWORD)
    assert "no longer encrypted" in str(lines)
    assert stored(tablet).token == TOKEN


# ---------------------------------------------------------------------- who answers, before it gets the credentials
def everything_an_operator_asks_for(tablet: Container, robot: Robot) -> None:
    operator = tablet.operator
    for ask in (lambda: operator.pause(robot.id), lambda: operator.resume(robot.id), lambda: operator.reset_errors(robot.id),
                lambda: operator.answer_prompt(robot.id, "guid", "Yes"), lambda: operator.clear_queue(robot.id),
                lambda: operator.cancel_item(robot.id, 7), lambda: operator.fetch_missions(robot.id),
                lambda: operator.test_connection(robot),
                lambda: tablet.robot_missions.parameters(robot.id, MISSION)):
        with pytest.raises(RobotError):
            ask()
    tablet.robot_missions.learn_names(robot.id)
    tablet.maps.learn(robot.id, "a map")


def run_now(tablet: Container) -> Any:
    robot, mission = stored(tablet), tablet.catalogue.save_mission(Mission("Deliver", MISSION))
    row = tablet.operator.run_now(robot.id, mission.id)
    poll(tablet)
    return tablet.ledger.get(row.id)


def test_the_status_is_asked_for_without_credentials_and_all_else_after_it(tablet: Container, listen: Listen) -> None:
    machine = listen()
    add(tablet, machine.url)
    poll(tablet)
    assert (connection(tablet), stored(tablet).serial_number) == (Connection.CONNECTED, "A-1")
    assert stored(tablet).identified_by is IdentifiedBy.SERIAL_NUMBER
    assert run_now(tablet).state is State.QUEUED
    assert {one.authorization for one in machine.seen if one.path == "/status"} == {None}
    assert {one.authorization for one in machine.seen if one.path != "/status"} == {TOKEN}
    assert machine.seen[0].path == "/status"


def test_a_poll_of_a_known_robot_costs_one_status(tablet: Container, listen: Listen) -> None:
    machine = listen()
    add(tablet, machine.url)
    poll(tablet)
    worker = tablet.make_worker(stored(tablet))
    worker.handle(messages.Poll())
    worker.advance()
    machine.seen.clear()
    worker.handle(messages.Poll())
    worker.advance()
    worker.close()
    assert [one.path for one in machine.seen].count("/status") == 1
    assert len(machine.seen) > 1


@pytest.mark.parametrize("pretends", [{"serial": "B-2"}, {"serial": None}, {"status_is_open": False}],
                         ids=["another serial number", "no serial number", "no status without credentials"])
def test_a_machine_that_does_not_show_the_known_serial_number_gets_nothing(tablet: Container, listen: Listen,
                                                                           pretends: dict[str, Any]) -> None:
    machine = listen()
    robot = add(tablet, machine.url)
    poll(tablet)
    machine.seen.clear()
    for name, value in pretends.items():
        setattr(machine, name, value)
    poll(tablet)
    assert connection(tablet) is Connection.WRONG_ROBOT
    assert "wrong_robot" in [alarm.code for alarm in tablet.alarms.open()]
    everything_an_operator_asks_for(tablet, robot)
    with pytest.raises((AnotherRobot, SerialNumberHidden)):
        tablet.operator.test_connection(stored(tablet))
    if machine.serial == "B-2":
        with pytest.raises(AnotherRobot):
            tablet.operator.test_connection(stored(tablet), PASSWORD)
    assert run_now(tablet).state is not State.QUEUED
    assert machine.credentials == []
    assert stored(tablet).serial_number == "A-1"


def test_the_wrong_robot_is_an_alarm_and_fails_the_run(tablet: Container, listen: Listen) -> None:
    machine = listen(serial="B-2")
    add(tablet, machine.url, serial_number="A-1")
    assert run_now(tablet).reason.code is ReasonCode.WRONG_ROBOT
    assert "wrong_robot" in [alarm.code for alarm in tablet.alarms.open()]
    assert machine.credentials == []


def test_a_machine_that_takes_the_place_of_a_robot_while_it_is_followed_gets_nothing(tablet: Container, listen: Listen) -> None:
    machine = listen()
    add(tablet, machine.url)
    worker = tablet.make_worker(stored(tablet))
    for serial in ("A-1", "B-2", "B-2"):
        machine.seen.clear()
        machine.serial = serial
        worker.handle(messages.Poll())
        worker.advance()
    worker.close()
    assert machine.credentials == []
    assert stored(tablet).serial_number == "A-1"


def test_the_new_robot_is_taken_at_the_integrators_word_and_with_its_own_password(tablet: Container, listen: Listen) -> None:
    machine = listen(serial="B-2")
    robot = add(tablet, machine.url, serial_number="A-1")
    with pytest.raises(AnotherRobot) as another:
        tablet.operator.test_connection(robot)
    assert (another.value.params["expected"], another.value.params["found"]) == ("A-1", "B-2")
    new = replace(robot, serial_number="B-2")
    with pytest.raises(InvalidInput, match="enter the password"):
        tablet.operator.test_connection(new)
    assert machine.credentials == []
    assert tablet.operator.test_connection(new, PASSWORD).serial_number == "B-2"
    tablet.catalogue.save_robot(new, PASSWORD)
    poll(tablet)
    assert (connection(tablet), stored(tablet).serial_number) == (Connection.CONNECTED, "B-2")


# ---------------------------------------------------------------------- robots whose status is not for anybody
def test_a_robot_that_wants_credentials_for_its_status_gets_them_where_they_were_entered(tablet: Container, listen: Listen) -> None:
    machine, thief = listen(status_is_open=False), listen(status_is_open=False)
    robot = add(tablet, machine.url)
    poll(tablet)
    assert connection(tablet) is Connection.CONNECTED
    assert (stored(tablet).serial_number, stored(tablet).identified_by) == ("A-1", IdentifiedBy.ADDRESS)
    assert run_now(tablet).state is State.QUEUED
    machine.serial = "B-2"
    poll(tablet)
    assert connection(tablet) is Connection.WRONG_ROBOT
    tablet.catalogue.save_robot(replace(stored(tablet), address=thief.url))
    poll(tablet)
    with suppress(RobotError):
        tablet.operator.fetch_missions(robot.id)
    assert thief.credentials == []


def test_a_wrong_password_shows_there_too(tablet: Container, listen: Listen) -> None:
    machine = listen(status_is_open=False)
    machine.answer = lambda one: (401, {})           # type: ignore[method-assign]
    robot = add(tablet, machine.url)
    with pytest.raises(Unauthorized):
        tablet.operator.test_connection(robot)


def test_a_robot_that_begins_to_want_credentials_is_known_again_by_a_password_entered_anew(tablet: Container, listen: Listen) -> None:
    machine = listen()
    add(tablet, machine.url)
    poll(tablet)
    machine.status_is_open = False
    found = tablet.operator.test_connection(stored(tablet), PASSWORD)
    tablet.catalogue.save_robot(replace(stored(tablet), identified_by=found.identified_by), PASSWORD)
    poll(tablet)
    assert (connection(tablet), stored(tablet).identified_by) == (Connection.CONNECTED, IdentifiedBy.ADDRESS)


# ---------------------------------------------------------------------- certificates
@pytest.mark.parametrize("is_open", [True, False])
def test_a_pinned_certificate_is_the_proof(tablet: Container, listen: Listen, is_open: bool) -> None:
    machine = listen(FIELD, status_is_open=is_open)
    add(tablet, machine.url, certificate_sha256=pin_of(FIELD))
    poll(tablet)
    assert (connection(tablet), stored(tablet).identified_by) == (Connection.CONNECTED, IdentifiedBy.CERTIFICATE)


def test_another_certificate_is_an_alarm_and_gets_no_request(tablet: Container, listen: Listen) -> None:
    machine = listen(PLANT)
    robot = add(tablet, machine.url, certificate_sha256=pin_of(FIELD))
    poll(tablet, rounds=1)
    assert "certificate_changed" in [alarm.code for alarm in tablet.alarms.open()]
    with pytest.raises(CertificateMismatch):
        tablet.operator.test_connection(robot)
    assert machine.seen == []
    tablet.catalogue.save_robot(replace(robot, certificate_sha256=pin_of(PLANT)), PASSWORD)
    poll(tablet)
    assert connection(tablet) is Connection.CONNECTED
    assert [alarm.code for alarm in tablet.alarms.open() if alarm.cleared_at is None] == []


def test_an_unknown_certificate_gets_no_request_and_its_fingerprint_can_be_compared(tablet: Container, listen: Listen) -> None:
    machine = listen(FIELD)
    with pytest.raises(CertificateProblem) as refused:
        tablet.operator.test_connection(Robot("Aino", machine.url, USER), PASSWORD)
    assert refused.value.code == "certificate_untrusted"
    assert tablet.operator.presented_fingerprint(machine.url) == pin_of(FIELD)
    assert machine.seen == []
