"""How long Home's messages about a start and about Reset errors stay true: on real services and simulated robots."""

from __future__ import annotations

import pytest

from app.screens.home.cards import SendTile
from app.widgets.buttons import CommandButton
from tests.ui.home.operator import choose, press, run, step

pytestmark = pytest.mark.long

ERROR = "Failed to reach goal position 'Line 1' (10120)"
STANDS = f"Still there: {ERROR}. Remove its cause at Aino, then reset again"


def say_held(home, ui) -> None:
    """Start a mission that a hold stops."""
    home.site.container.holds.hold("shift meeting")
    ui.wait(lambda: home.root_vm.view.card.send_note)
    run(ui, "Home")
    ui.wait(lambda: are_said(home, "Home is not sent to Aino yet. On hold: shift meeting"))


def say_silent(home, ui) -> None:
    """Start a mission on a robot that does not answer."""
    home.aino.control({"reboot_seconds": 3600})
    ui.wait(lambda: home.root_vm.view.card.old)
    run(ui, "Home")
    ui.wait(lambda: are_said(home, "Home is not sent to Aino yet. Attempt "))


def are_said(home, words: str) -> list[str]:
    """Messages that begin so."""
    return [text for text in home.shell.snackbars.texts if text.startswith(words)]


def test_a_start_that_is_cancelled_is_not_said_to_wait_for_an_answer(home, ui):
    say_silent(home, ui)
    (execution,) = home.site.container.history.open()
    ui.wait(lambda: any(row.attempts for row in home.root_vm.facts.open))
    home.root_vm.cancel(("execution", execution.id))
    press(ui, "Cancel mission")
    ui.wait(lambda: are_said(home, "Home is cancelled"))
    assert home.shell.snackbars.texts == ["Home is cancelled"]


def test_a_start_that_the_robot_accepted_is_said_to_be_sent(home, ui):
    say_silent(home, ui)
    home.aino.control({"reboot_seconds": 0})
    ui.wait(lambda: home.shell.snackbars.texts == ["Home is sent to Aino"])


def test_a_start_is_not_said_to_be_held_when_the_hold_ends_behind_another_screen(home, ui):
    say_held(home, ui)
    home.shell.go("scheduler")
    assert are_said(home, "Home is not sent to Aino yet. ")
    home.shell.snackbars.undo("Count is deleted", "Undo", lambda: None)  # the time of the one below it stops
    home.site.container.holds.release()
    ui.wait(lambda: not are_said(home, "Home is not sent to Aino yet. "))


def test_a_start_is_not_said_to_be_held_after_the_hold_although_its_robot_is_silent(home, ui):
    say_held(home, ui)
    home.shell.snackbars.undo("Count is deleted", "Undo", lambda: None)
    home.aino.control({"reboot_seconds": 3600})
    ui.wait(lambda: home.root_vm.view.card.old)
    home.site.container.holds.release()
    ui.wait(lambda: not are_said(home, "Home is not sent to Aino yet. On hold"))


def test_the_robot_shown_at_the_press_is_the_one_that_is_asked(home, ui, monkeypatch):
    followed: list[str] = []
    ids = {robot.name: robot.id for robot in home.root_vm.facts.robots}
    choose(ui, "Home")
    monkeypatch.setattr(home.root_vm.started, "follow", lambda execution: followed.append(execution.robot))
    home.root_vm.sending.run(home.shell.sheets.top, {})
    home.root_vm.select_robot(ids["Veikko"])  # in the same frame
    ui.wait(lambda: followed)
    assert followed == ["Aino"]


# ---------------------------------------------------------------------- reset errors
@pytest.fixture
def failed(home, ui):
    """A robot whose error stays after every reset."""
    home.aino.control({"error": {"code": 10120, "description": "Failed to reach goal position 'Line 1'"}})
    ui.wait(lambda: f"“{ERROR}”" in ui.texts())
    return home


def test_a_remaining_error_is_shown_longer_than_a_reset(failed, ui):
    step(ui, "Reset errors")
    ui.wait(lambda: failed.shell.snackbars.texts == [STANDS])
    ui.advance(6)
    assert failed.shell.snackbars.texts == [STANDS]
    ui.advance(2.5)
    assert failed.shell.snackbars.texts == []


def test_the_card_promises_nothing_of_reset_once_it_did_not_help(failed, ui):
    promise, stands = "Clear the way. Then reset.", "Still there. Remove its cause, reset again."
    assert promise in ui.texts()
    step(ui, "Reset errors")
    ui.wait(lambda: stands in ui.texts())
    assert not ui.find(CommandButton, text="Reset errors").disabled
    failed.aino.control({"error": {"code": 10121, "description": "Failed to reach goal position 'Line 2'"}})
    ui.wait(lambda: promise in ui.texts())


def test_the_result_of_a_reset_is_not_reported_on_another_screen(failed, ui):
    step(ui, "Reset errors")
    ui.wait(lambda: failed.shell.background.idle)
    failed.shell.go("logs")
    ui.skip(60)
    failed.shell.go("home")
    ui.wait(lambda: failed.shell.background.idle and ui.find_all(SendTile))
    ui.advance(2)
    assert failed.shell.snackbars.texts == []
