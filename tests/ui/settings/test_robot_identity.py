"""Settings, Robots: a robot that no longer shows its serial number gets its password only after an integrator has said so."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from app.domain.models import Connection, Robot
from app.domain.robot import IdentifiedBy
from app.mir.credentials import Token
from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.trust import TrustSheet
from tests.hostile.capture import Capture, capture
from tests.ui.integrator import enter, entry, go, item_of, open_row, press, robots
from tests.ui.whole_app import PASSWORD, USER

pytestmark = pytest.mark.long

QUESTION = "No serial number"


@pytest.fixture(params=[{"status_is_open": False}, {"serial": None}], ids=["no status", "no serial number"])
def machine(request, site) -> Iterator[Capture]:
    """In the place of Aino, whose serial number is known."""
    with capture() as machine:
        site.container.catalogue.save_robot(Robot("Aino", machine.url, USER), PASSWORD)
        machine.hides = request.param
        yield machine


def replaced(site, ui, machine: Capture) -> None:
    """The robot has shown its serial number, and now something answers that doesn't."""
    ui.wait(lambda: robots(site)[0].identified_by)
    machine.pretend(machine.hides)
    ui.wait(lambda: site.container.snapshots.get(robots(site)[0].id).connection is Connection.WRONG_ROBOT)
    machine.seen.clear()


def question(ui) -> TrustSheet:
    ui.wait(lambda: ui.find_all(TrustSheet))
    return ui.find(TrustSheet)


def question_of_aino(ui) -> TrustSheet:
    """Its sheet asks by itself."""
    go(ui, "robots")
    ui.wait(lambda: item_of(ui, "Aino") and item_of(ui, "Aino").meta.startswith("Another robot"))
    open_row(ui, "Aino")
    return question(ui)


def answer(ui, word: str, asked: TrustSheet) -> RobotSheet:
    press(ui, word, asked)
    ui.wait(lambda: ui.find_all(RobotSheet))
    return ui.find(RobotSheet)


@pytest.mark.parametrize("password", ["", PASSWORD], ids=["stored", "entered again"])
def test_answering_no_leaves_the_robot_unchanged(site, app, ui, machine, password):
    replaced(site, ui, machine)
    dialog = answer(ui, "Send nothing", question_of_aino(ui))
    enter(ui, entry(dialog, "password"), password)
    press(ui, "Test connection", dialog)
    asked = question(ui)
    assert asked.title == QUESTION
    assert asked.question.text.startswith("Aino no longer shows it.")
    assert asked.question.before == "A-1"
    press(ui, "Send nothing", asked)
    assert dialog.outcome.tone == "attention"
    assert dialog.outcome.text == "Nothing was sent to it."
    press(ui, "Save anyway", dialog)
    ui.wait(lambda: not ui.find_all(RobotSheet))
    ui.wait(lambda: len(machine.seen) > 3)
    assert robots(site)[0].identified_by is IdentifiedBy.SERIAL_NUMBER
    assert machine.credentials == []


def test_yes_sends_the_stored_password_and_saving_keeps_the_answer(site, app, ui, machine):
    replaced(site, ui, machine)
    asked = question_of_aino(ui)
    assert machine.credentials == []
    dialog = answer(ui, "Send the password", asked)
    ui.wait(lambda: dialog.outcome.tone == "done")
    assert set(machine.credentials) == {Token.derive(USER, PASSWORD).header}
    assert robots(site)[0].identified_by is IdentifiedBy.SERIAL_NUMBER  # nothing is saved yet
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(RobotSheet))
    assert robots(site)[0].identified_by is IdentifiedBy.ADDRESS
    ui.wait(lambda: item_of(ui, "Aino").meta == "" and item_of(ui, "Aino").icon == "wifi")


def test_the_answer_holds_only_for_the_address_it_was_about(site, app, ui, machine):
    replaced(site, ui, machine)
    with capture(**machine.hides) as thief:
        dialog = answer(ui, "Send the password", question_of_aino(ui))
        ui.wait(lambda: dialog.outcome.tone == "done")
        enter(ui, entry(dialog, "address"), thief.url)
        enter(ui, entry(dialog, "password"), PASSWORD)
        press(ui, "Test connection", dialog)
        assert question(ui).title == QUESTION
        assert thief.credentials == []
