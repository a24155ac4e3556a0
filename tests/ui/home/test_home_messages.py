"""How long it holds what Home says of Reset errors: on a real service and a simulated robot."""
from __future__ import annotations

import pytest

from app.screens.home.cards import RobotHead
from tests.ui.home.operator import press


@pytest.fixture
def failed(home, ui):
    """A robot whose error stands, whatever is reset."""
    home.aino.control({"error": {"code": 10120, "description": "Failed to reach goal position 'Line 1'"}})
    ui.wait(lambda: "Failed to reach goal position 'Line 1'" in ui.texts())
    return home


def test_that_an_error_stands_is_said_for_longer_than_that_it_was_reset(failed, ui):
    press(ui, "Reset errors")
    ui.wait(lambda: failed.shell.snackbars.texts == ["Aino has got Reset errors, but its error stands"])
    ui.advance(6)
    assert failed.shell.snackbars.texts == ["Aino has got Reset errors, but its error stands"]
    ui.advance(2.5)
    assert failed.shell.snackbars.texts == []


def test_what_became_of_a_reset_is_not_said_after_another_screen_was_shown(failed, ui):
    press(ui, "Reset errors")
    ui.wait(lambda: failed.shell.snackbars.texts == ["Aino has got Reset errors"])
    failed.shell.go("logs")
    ui.skip(60)
    failed.shell.go("home")
    ui.wait(lambda: failed.shell.background.idle and ui.find_all(RobotHead))
    ui.advance(2)
    assert failed.shell.snackbars.texts == []
